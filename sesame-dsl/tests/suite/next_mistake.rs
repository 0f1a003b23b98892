//! No suggestion leads to the next mistake: after it is applied, nothing new is wrong at its place.
//!
//! The place is what the suggestion writes, the place of the mistake, and what follows one of them on its line.

use std::collections::BTreeSet;
use std::ops::Range;

use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::{RngSeed, TestRunner};
use sesame_dsl::diagnostic::{Code, Diagnostic, Severity, Suggestion};

use crate::files::corpus;
use crate::fixes::{EXAMPLES, applied, diagnostics, diagnostics_after, moved, slips, with_slip};
use crate::pages::wrong_examples;

/// Warnings about what is still to be written.
const STILL_TO_WRITE: [&str; 5] = ["W0002", "W0004", "W0011", "W0014", "W0015"];

/// Where the replacements of a suggestion are in the text with them.
fn written(suggestion: &Suggestion) -> Vec<Range<i64>> {
    let mut edits: Vec<_> = suggestion.edits.iter().collect();
    edits.sort_by_key(|(span, _)| *span);
    let mut grown = 0;
    let place = |(span, replacement): &(sesame_dsl::span::Span, String)| {
        let lo = i64::from(span.lo) + grown;
        let length = i64::try_from(replacement.len()).expect("short");
        grown += length - i64::from(span.hi - span.lo);
        lo..lo + length
    };
    edits.into_iter().map(place).collect()
}

fn touch(a: &Range<i64>, b: &Range<i64>) -> bool {
    let near = a.start <= b.end && b.start <= a.end;
    near && (a.start < b.end && b.start < a.end || a.is_empty() || b.is_empty())
}

/// Whether only blanks are between the end of one stretch and the beginning of another.
fn follows(text: &str, a: &Range<i64>, b: &Range<i64>) -> bool {
    let [from, to] = [a.end, b.start].map(|at| usize::try_from(at).expect("it is in the text"));
    text.get(from..to).is_some_and(|gap| gap.trim_matches([' ', '\t']).is_empty())
}

/// What is new at the place of a suggestion after it is applied, if `counts`.
fn new_at_its_place(
    text: &str,
    found: &Diagnostic,
    suggestion: &Suggestion,
    before: &[Diagnostic],
    counts: fn(&str, &Range<i64>, &Range<i64>) -> bool,
) -> Option<String> {
    let mended = applied(text, suggestion);
    let others = before.iter().filter(|other| *other != found);
    let known: BTreeSet<(Code, i64, bool)> = others
        .flat_map(|other| {
            let (lo, hi) = moved(other.span, suggestion);
            [(other.code, lo, false), (other.code, hi, true)]
        })
        .collect();
    let (lo, hi) = moved(found.span, suggestion);
    let mut places = written(suggestion);
    places.push(lo..hi);
    let new = diagnostics_after(&mended).into_iter().find(|other| {
        let at = i64::from(other.span.lo)..i64::from(other.span.hi);
        let known = known.contains(&(other.code, at.start, false)) || known.contains(&(other.code, at.end, true));
        let later = other.severity() == Severity::Warning && STILL_TO_WRITE.contains(&other.code.text());
        !known && !later && places.iter().any(|place| counts(&mended, place, &at))
    })?;
    let line = text[..found.span.range().start].matches('\n').count();
    let line = |text: &str| text.lines().nth(line).unwrap_or_default().to_owned();
    let Diagnostic { code, title, label, .. } = new;
    Some(format!(
        "{}: {}\n{}\n{}\n{}\n{code}: {title} ({label})",
        found.code,
        found.title,
        line(text),
        suggestion.message,
        line(&mended)
    ))
}

/// All suggestions for a text that lead to the next mistake, and how many there are.
fn next_mistakes(text: &str, counts: fn(&str, &Range<i64>, &Range<i64>) -> bool) -> (Vec<String>, usize) {
    let before = diagnostics(text);
    let suggested =
        || before.iter().flat_map(|found| found.suggestions.iter().map(move |suggestion| (found, suggestion)));
    let next = suggested().filter_map(|(found, suggestion)| new_at_its_place(text, found, suggestion, &before, counts));
    (next.collect(), suggested().count())
}

#[test]
fn no_suggestion_in_the_corpora_leads_to_the_next_mistake() {
    let (mut next, mut tried) = (Vec::new(), 0);
    let texts = ["good", "bad", "systems"].into_iter().flat_map(corpus);
    for (name, text) in texts.chain(wrong_examples()) {
        let (found, suggested) = next_mistakes(&text, |text, place, at| touch(place, at) || follows(text, place, at));
        next.extend(found.into_iter().map(|said| format!("{name}: {said}")));
        tried += suggested;
    }
    assert!(next.is_empty(), "{} of {tried}\n{}", next.len(), next.join("\n\n"));
    assert!(tried > 300, "{tried}");
}

/// Whether something lies in what a suggestion writes.
fn is_written(_: &str, place: &Range<i64>, at: &Range<i64>) -> bool {
    !at.is_empty() && place.start <= at.start && at.end <= place.end
}

/// All suggestions for a text that write a mistake which its author did not write.
fn written_mistakes(text: &str) -> Vec<String> {
    let mut next = next_mistakes(text, is_written).0;
    next.retain(|said| {
        let [_, author, _, mended, ..] = said.lines().collect::<Vec<_>>()[..] else { return true };
        let wrong = said.rsplit('\n').next().unwrap_or_default().split('`').nth(1);
        wrong.is_some_and(|wrong| mended.contains(wrong) && !author.contains(wrong))
    });
    next
}

/// In these texts something else may be wrong at the same place. But that is not what a suggestion writes.
#[test]
fn no_suggestion_for_a_text_of_fuzzing_writes_the_next_mistake() {
    for (name, text) in corpus("fuzzed") {
        let next = written_mistakes(&text);
        assert!(next.is_empty(), "{name}: {}", next.join("\n\n"));
    }
}

/// So many slips, in a sequence that this number stands for.
fn no_suggestion_for_slips_writes_the_next_mistake(seed: u64, count: u32) {
    let config = ProptestConfig { rng_seed: RngSeed::Fixed(seed), ..ProptestConfig::default() };
    let mut runner = TestRunner::new(config);
    let drawn = (0..EXAMPLES.len(), slips());
    for _ in 0..count {
        let (example, slip) = drawn.new_tree(&mut runner).expect("nothing is refused").current();
        let text = with_slip(EXAMPLES[example], &slip);
        let next = written_mistakes(&text);
        assert!(next.is_empty(), "{slip:?}: {}", next.join("\n\n"));
    }
}

#[test]
fn no_suggestion_for_a_slip_writes_the_next_mistake() {
    no_suggestion_for_slips_writes_the_next_mistake(2, 60);
}

#[test]
#[ignore = "long: 3,000 slips"]
fn no_suggestion_for_one_of_many_slips_writes_the_next_mistake() {
    no_suggestion_for_slips_writes_the_next_mistake(3, 3_000);
}

/// A space with one operation, which is written in the words of other tools.
fn with_operation(operation: &str) -> String {
    format!(
        "space cell\nsystem {{\n  simulator sim = process \"python3\" \"sim.py\" {{ step 100ms }}\n  \
         topic link0 = \"link0\" : real[rad]\n  topic load = \"load\" : int\n  topic stop = \"stop\" : bool\n  \
         topic mode = \"mode\" : text\n}}\n\
         metric time minimise = fuzzing_time()\n{operation}\n\
         campaign c {{ objectives time  operations o 1 per test  search random {{ evaluations 4 }}  end after 9s }}\n"
    )
}

#[test]
fn words_of_other_tools_are_mended_in_one_step() {
    for (written, meant) in [
        ("operation o on load = stuck at 1", "operation o on load = stuck at [1, 1]"),
        ("operation o on link0 = stuck at 1", "operation o on link0 = stuck at [1rad, 1rad]"),
        ("operation o on stop = stuck at [true]", "operation o on stop = stuck at true"),
        ("operation o on mode = random one of [\"a\", \"b\"]", "operation o on mode = random one of \"a\", \"b\""),
        ("operation o on link0 = drop 50%", "operation o on link0 = packet loss [0%, 50%]"),
        ("operation o on link0 = drop 0.5", "operation o on link0 = packet loss [0%, 50%]"),
        ("operation o on link0 = packet loss 0.5", "operation o on link0 = packet loss [0%, 50%]"),
        ("operation o on link0 = delay 200ms", "operation o on link0 = latency [0ms, 200ms]"),
        ("operation o on link0 = gaussian noise [0, 1]", "operation o on link0 = noise [0rad, 1rad]"),
        ("operation o on link0 = gaussian 0.1", "operation o on link0 = noise [0rad, 0.1rad]"),
        ("operation o on link0 = bias -0.5", "operation o on link0 = bias [-0.5rad, 0rad]"),
        ("operation o on link0 = throttle 5", "operation o on link0 = rate limit [1Hz, 5Hz]"),
    ] {
        let (text, mended) = (with_operation(written), with_operation(meant));
        let found = diagnostics(&text);
        let [found] = &found[..] else { panic!("{written}: {found:#?}") };
        let suggested: Vec<String> = found.suggestions.iter().map(|suggestion| applied(&text, suggestion)).collect();
        assert!(suggested.contains(&mended), "{written}: {found:#?}");
        assert_eq!(diagnostics(&mended), [], "{meant}");
    }
}
