//! Suggestions of all diagnostics that the corpus gives: each makes sense where only the suggestion is shown.

use sesame_dsl::source::SourceMap;
use sesame_dsl::{analyse, diagnostic::Diagnostic};

/// What a suggestion that says what to do begins with.
const IMPERATIVES: [&str; 8] = ["add", "apply", "move", "remove", "split", "swap", "use", "write"];

#[expect(clippy::disallowed_methods, reason = "the crate is pure; its tests read their corpus")]
fn diagnostics_of_the_corpus() -> Vec<Diagnostic> {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/bad");
    let files = std::fs::read_dir(folder).expect("the corpus is beside this file");
    let texts = files.map(|file| std::fs::read_to_string(file.expect("it can be listed").path()).expect("it is text"));
    let diagnostics = texts.flat_map(|text| {
        let mut sources = SourceMap::new();
        let file = sources.add("bad.sesame", text);
        analyse(&sources, file).diagnostics
    });
    diagnostics.collect()
}

#[test]
fn every_suggestion_asks_what_was_meant_or_says_what_to_do() {
    let mut seen = 0;
    for found in diagnostics_of_the_corpus() {
        for suggestion in &found.suggestions {
            let message = suggestion.message.as_str();
            let asks = message.starts_with("did you mean `") && message.ends_with("`?");
            let first = message.split(' ').next().unwrap_or_default();
            assert!(asks || IMPERATIVES.contains(&first), "{}: {message}", found.code);
            seen += 1;
        }
    }
    assert!(seen > 50, "the corpus gives many suggestions, not {seen}");
}
