//! Any text gets an answer: no panic, spans that lie in the file, and an answer in every rendering.

use proptest::prelude::*;

use crate::sound::{analyse_text, has_a_sound_answer};

const SAMPLES: &[&str] = &[
    include_str!("../good/kuka_cell.sesame"),
    include_str!("../good/conditions.sesame"),
    include_str!("../bad/ten_mistakes.sesame"),
    include_str!("../bad/e0104_later_constructs.sesame"),
    include_str!("../good/blocks.sesame"),
];

/// Pieces that mean something somewhere.
const PIECES: &[&str] = &[
    "{",
    "}",
    "when",
    "until",
    "for",
    "at most",
    "over",
    "start contains",
    "[",
    "]",
    "(",
    ")",
    "\"",
    "\\",
    "//",
    "///",
    "=",
    "==",
    "<=",
    "..",
    ".",
    ",",
    ":",
    "-",
    "5ms",
    "0.3rad",
    "40%",
    "1e999",
    "list of ",
    "system",
    "message",
    "topic",
    "metric",
    "operation",
    "test",
    "campaign",
    "hook on",
    "from",
    "to",
    "within",
    "search",
    "import \"a.sesame\"",
    "eddi a publishes b {",
    "from eddi",
    "physical lab {",
    "passive 3 times",
    "seed",
    "end after",
    "when",
    "ü",
    "µs",
    "\u{FEFF}",
    "\r\n",
    "\u{0}",
    " ",
];

/// A byte offset near a fraction of the text, on a character boundary.
fn boundary(text: &str, at: prop::sample::Index) -> usize {
    let mut offset = at.index(text.len() + 1);
    while !text.is_char_boundary(offset) {
        offset -= 1;
    }
    offset
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, ..ProptestConfig::default() })]

    #[test]
    fn mutated_samples_have_a_sound_answer(
        sample in 0..SAMPLES.len(),
        edits in prop::collection::vec((any::<prop::sample::Index>(), 0..12usize, prop::sample::select(PIECES)), 1..6),
    ) {
        let mut text = SAMPLES[sample].to_owned();
        for (at, removed, piece) in edits {
            let start = boundary(&text, at);
            let end = text[start..].char_indices().nth(removed).map_or(text.len(), |(length, _)| start + length);
            text.replace_range(start..end, piece);
        }
        has_a_sound_answer(&text);
    }

    #[test]
    fn pieces_in_any_order_have_a_sound_answer(pieces in prop::collection::vec(prop::sample::select(PIECES), 0..60)) {
        has_a_sound_answer(&pieces.concat());
        has_a_sound_answer(&pieces.join(" "));
    }

    #[test]
    fn arbitrary_text_has_a_sound_answer(text in "\\PC{0,200}") {
        has_a_sound_answer(&text);
    }

    #[test]
    fn a_cut_off_file_has_a_sound_answer(sample in 0..SAMPLES.len(), at: prop::sample::Index) {
        let text = SAMPLES[sample];
        has_a_sound_answer(&text[..boundary(text, at)]);
    }
}

#[test]
fn what_is_quoted_over_several_lines_is_said_in_one() {
    let text =
        "space s\noperation o on t = latency [1s,\r\n  2s]\ntest t { o delay 1s when a +\n b until c\n == 2 + 1 }";
    has_a_sound_answer(text);
    let (_, _, analysis) = analyse_text(text);
    assert!(analysis.diagnostics.iter().any(|diagnostic| diagnostic.title.contains("a + b")), "{analysis:?}");
}

#[test]
fn deep_nesting_and_long_repetition_are_refused_or_read_but_never_overflow() {
    for piece in ["{", "(", "[", "list of ", "system {", "\"{", "test t {", "message M { a: list of ", "- ", "a: "] {
        has_a_sound_answer(&piece.repeat(2_000));
    }
    has_a_sound_answer(&" ".repeat(9 << 20));
}

#[test]
fn a_long_chain_of_messages_is_sorted_without_a_stack() {
    let chain: Vec<String> = (0..2_000).map(|n| format!("  message M{n} {{ next: M{} }}\n", n + 1)).collect();
    let chain = chain.concat();
    let text = format!(
        "space s\nsystem {{\n{chain}  message M2000 {{ x: int }}\n  simulator sim = in_process \"a::B\" {{ step 1ms }}\n}}\n"
    );
    let (_, _, analysis) = analyse_text(&text);
    let space = analysis.model.unwrap_or_else(|| panic!("{:?}", analysis.diagnostics));
    let first = space.messages.values().next().unwrap();
    assert_eq!(first.declaration.name, "M2000", "what is contained comes first");
}

#[test]
fn every_suggestion_of_the_corpus_can_be_applied() {
    let text = SAMPLES[1];
    let (_, _, analysis) = analyse_text(text);
    let before = analysis.diagnostics.len();
    for diagnostic in &analysis.diagnostics {
        let Some(suggestion) = diagnostic.suggestions.first() else { continue };
        let mut edits = suggestion.edits.clone();
        edits.sort_by_key(|(span, _)| std::cmp::Reverse(span.lo));
        let mut mended = text.to_owned();
        for (span, replacement) in &edits {
            mended.replace_range(span.range(), replacement);
        }
        let (_, _, after) = analyse_text(&mended);
        assert!(after.diagnostics.len() < before, "{} stays after: {}", diagnostic.title, suggestion.message);
    }
}
