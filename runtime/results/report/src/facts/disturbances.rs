//! What the operations of a test do, in words.

use sesame_plan::Span;

use crate::facts::readable::short_numbers;
use crate::facts::show::OperationReport;

/// When an operation was to be active: its window, or the conditions that switched it; a dash for an offline one. The
/// only messages that it alters follow, if they are listed.
pub(crate) fn planned_text(operation: &OperationReport) -> String {
    let when = match (&operation.conditions, operation.planned) {
        (Some(conditions), _) => short_numbers(conditions),
        (None, planned) => spans_text(planned.as_slice()),
    };
    let listed = operation.messages.as_ref().map_or(String::new(), |messages| format!(", only messages {messages}"));
    format!("{when}{listed}")
}

/// Spans in seconds, as in `8.00–57.00 s`; a dash for none.
pub(crate) fn spans_text(spans: &[Span]) -> String {
    if spans.is_empty() {
        return "–".to_owned();
    }
    let words: Vec<String> = spans.iter().take(4).map(|span| format!("{:.2}–{:.2}", span.start, span.end)).collect();
    let more = if spans.len() > 4 { format!(" and {} more", spans.len() - 4) } else { String::new() };
    format!("{} s{more}", words.join(", "))
}

/// What operations do in a test, and when: `lag_link1 (latency 310 ms, at 4.00–9.00 s)`.
pub(crate) fn disturbances_text(operations: &[OperationReport]) -> String {
    let words = |used: &OperationReport| {
        let at = if used.planned.is_some() { "at " } else { "" };
        let words = [choices_text(used), format!("{at}{}", planned_text(used))];
        let words: Vec<&str> = words.iter().map(String::as_str).filter(|words| *words != "–").collect();
        if words.is_empty() { used.operation.clone() } else { format!("{} ({})", used.operation, words.join(", ")) }
    };
    operations.iter().map(words).collect::<Vec<_>>().join(" + ")
}

/// What an operation's parameters are, in words.
pub(crate) fn choices_text(operation: &OperationReport) -> String {
    let words: Vec<&str> = operation.choices.iter().map(|choice| choice.text.as_str()).collect();
    if words.is_empty() { "–".to_owned() } else { words.join(", ") }
}
