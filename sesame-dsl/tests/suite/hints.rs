//! Examples in messages can be pasted: after `for example` stands what the language reads at the place that is meant.

use sesame_dsl::diagnostic::{Code, Diagnostic};

use crate::files::corpus;
use crate::fixes::{diagnostics, diagnostics_after, without_quotes};
use crate::pages::wrong_examples;

/// The example at the end of a sentence.
fn example(sentence: &str) -> Option<&str> {
    let (_, after) = sentence.split_once("for example")?;
    after.trim_start_matches(',').strip_prefix(" `")?.strip_suffix('`').filter(|example| !example.contains('`'))
}

/// Where what a declaration lacks is written: at the beginning of its block, or of the file.
fn lacking(text: &str, found: &Diagnostic) -> Option<std::ops::Range<usize>> {
    let from = found.span.range().end;
    let begins = |at: usize| text[at..].find('{').map(|brace| at + brace + 1);
    let at = match found.code {
        Code::MISSING_DECLARATION if found.title.contains("space") && !text.contains("space ") => Some(0),
        Code::MISSING_DECLARATION => begins(text.find("system ")?),
        Code::CLAUSE_MISSING | Code::SEARCH_OR_REPEAT => begins(from),
        _ => None,
    };
    at.map(|at| at..at)
}

/// Where a value that does not fit stands. A lab fits numbers alone, so a box of points has no place there.
fn unfit(text: &str, found: &Diagnostic) -> Option<std::ops::Range<usize>> {
    let before = text[..found.span.range().start].rsplit(['\n', ',']).next().unwrap_or_default();
    let fits = matches!(found.code, Code::WRONG_CHOICE | Code::WRONG_TYPE) && !before.contains("relay ");
    fits.then(|| found.span.range())
}

/// What is wrong with an example of a diagnostic that is pasted, in words.
fn unreadable(text: &str, found: &Diagnostic, example: &str, place: std::ops::Range<usize>) -> Option<String> {
    let mut pasted = text.to_owned();
    pasted.replace_range(place.clone(), &format!(" {example} "));
    let end = place.start + example.len() + 2;
    let after = diagnostics_after(&pasted);
    let wrong = after.iter().find(|other| {
        let unread = other.code.text() < "E02" || other.code == Code::UNKNOWN_NAME;
        let within = place.start <= other.span.range().start && other.span.range().end <= end;
        let stays = other.code == found.code && without_quotes(&other.title) == without_quotes(&found.title);
        let near = other.span.range().end == found.span.range().end && found.span.range().end <= place.start;
        unread && within || stays && (near || within)
    })?;
    let (code, title) = (found.code, &found.title);
    Some(format!("{code}: {title}: `{example}`: {}: {} ({})", wrong.code, wrong.title, wrong.label))
}

#[test]
fn every_example_in_a_message_can_be_pasted() {
    let (mut wrong, mut tried) = (Vec::new(), 0);
    for (name, text) in corpus("bad").into_iter().chain(wrong_examples()) {
        for found in diagnostics(&text) {
            let notes = found.notes.iter().filter(|note| note.starts_with("for example"));
            let clauses = notes.filter_map(|note| Some((example(note)?, lacking(&text, &found)?)));
            let label = Some(&found.label).filter(|label| label.starts_with("expected"));
            let values =
                label.and_then(|label| example(label)).and_then(|example| Some((example, unfit(&text, &found)?)));
            for (example, place) in clauses.chain(values) {
                tried += 1;
                wrong.extend(unreadable(&text, &found, example, place).map(|said| format!("{name}: {said}")));
            }
        }
    }
    assert!(wrong.is_empty(), "{} of {tried}\n{}", wrong.len(), wrong.join("\n"));
    assert!(tried > 30, "{tried}");
}
