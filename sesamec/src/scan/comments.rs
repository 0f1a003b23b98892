//! Comments of the space: what it cannot say, numbers in words, and text that anybody may have written.

use sesame_dsl::diagnostic::visible_lines;

/// What cannot be said in the language, one comment each.
#[derive(Default)]
pub(super) struct LeftOut(Vec<String>);

impl LeftOut {
    /// A question to a person.
    pub(super) fn decide(&mut self, what: &str) {
        self.0.push(format!("// decide: {}\n", on_one_line(what)));
    }

    /// All of them.
    pub(super) fn text(&self) -> String {
        self.0.concat()
    }
}

/// A rate to three digits.
pub(super) fn rate(hertz: f64) -> String {
    if hertz >= 100.0 {
        format!("{hertz:.0}")
    } else if hertz >= 10.0 {
        format!("{hertz:.1}")
    } else {
        format!("{hertz:.2}")
    }
}

pub(super) fn counted(n: u64, what: &str) -> String {
    match n {
        0 => format!("no {what}"),
        1 => format!("1 {what}"),
        n => format!("{n} {what}s"),
    }
}

/// Text for a comment: on one line, without signs that a terminal would interpret.
pub(super) fn on_one_line(text: &str) -> String {
    let longest: String = visible_lines(text).chars().take(400).collect();
    longest.replace(['\n', '\r', '\u{2028}', '\u{2029}', '\u{85}'], " ")
}
