//! Suggestions, tried before they are made: none leads to the next mistake if that can be helped.
//!
//! Each suggestion is applied to a copy of the text, and the copy is analysed again. If nothing is wrong at that place
//! any more, the suggestion stays. If it leads to a mistake that has a suggestion of its own, it takes that along:
//! `drop 50%` becomes `packet loss [0%, 50%]` in one step. If it makes a mistake itself, as a similar name does that is
//! in the list already, it is left out, and so is one that leads to a further mistake where another does not.
//!
//! Certificates of monitors are not checked again, and a text is read again only so often.

use std::ops::Range;

use crate::diagnostic::{Applicability, Code, Diagnostic, Severity, Suggestion};
use crate::source::SourceMap;
use crate::span::{FileId, Span};

/// The most bytes that are read again in all. What is suggested after that stays as it is.
const MOST_READ: usize = 1 << 17;

/// The most mistakes that one suggestion mends.
const MOST_STEPS: usize = 3;

/// The longest text that the message of a suggestion quotes.
const LONGEST_QUOTE: usize = 60;

/// Warnings about what is still to be written, which say nothing about the place of a suggestion.
const STILL_TO_WRITE: [Code; 5] =
    [Code::UNUSED_OPERATION, Code::NO_CAMPAIGN, Code::UNUSED_METRIC, Code::UNUSED_TOPIC, Code::UNUSED_EVIDENCE];

/// What is wrong with a name or a clause that is there already.
const TWICE: [Code; 3] = [Code::DEFINED_TWICE, Code::LISTED_TWICE, Code::CLAUSE_TWICE];

/// What a suggestion leads to, the better the smaller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Outcome {
    /// Nothing is wrong at its place.
    Mended,
    /// The text was read again too often already.
    Untried,
    /// There is a warning at its place.
    Warned,
    /// A mistake shows somewhere else.
    Elsewhere,
    /// A mistake shows that the author made and that was hidden.
    Further,
    /// What it writes is a mistake, or the mistake stays.
    Wrong,
}

/// Tries all suggestions of the diagnostics for some files; `again` gives those for changed files.
pub(crate) fn keep_what_mends(
    sources: &SourceMap,
    diagnostics: &mut [Diagnostic],
    again: impl Fn(&SourceMap) -> Vec<Diagnostic>,
) {
    if diagnostics.iter().all(|found| found.suggestions.is_empty()) {
        return;
    }
    let before = diagnostics.to_vec();
    let mut trials = Trials { sources, before: &before, again, read: 0 };
    for found in diagnostics {
        let suggested = std::mem::take(&mut found.suggestions);
        found.suggestions =
            kept(suggested.into_iter().map(|suggestion| trials.settled(found, suggestion, MOST_STEPS)).collect());
    }
}

/// The suggestions to make, of all that were tried.
fn kept(tried: Vec<(Outcome, Suggestion)>) -> Vec<Suggestion> {
    let mended = tried.iter().any(|(outcome, _)| *outcome == Outcome::Mended);
    let most = if mended { Outcome::Untried } else { Outcome::Further };
    let mut kept: Vec<Suggestion> = Vec::new();
    for (_, suggestion) in tried.into_iter().filter(|(outcome, _)| *outcome <= most) {
        if kept.iter().all(|other| other.edits != suggestion.edits) {
            kept.push(suggestion);
        }
    }
    kept
}

struct Trials<'a, A> {
    sources: &'a SourceMap,
    before: &'a [Diagnostic],
    again: A,
    /// How many bytes were read again.
    read: usize,
}

impl<A: Fn(&SourceMap) -> Vec<Diagnostic>> Trials<'_, A> {
    /// A suggestion with what it leads to, if need be with those for the mistakes that it leads to.
    fn settled(&mut self, found: &Diagnostic, suggestion: Suggestion, steps: usize) -> (Outcome, Suggestion) {
        self.read = self.read.saturating_add(self.sources.bytes());
        let applied = if self.read > MOST_READ { None } else { Applied::new(self.sources, &suggestion) };
        let Some(applied) = applied else { return (Outcome::Untried, suggestion) };
        let (outcome, next) = self.tried(found, &applied);
        let next = next.filter(|_| steps > 1 && outcome > Outcome::Elsewhere);
        let further = next.map_or(Vec::new(), |next| next.suggestions);
        let mut best = (outcome, None);
        for further in &further {
            let Some(both) = applied.followed_by(self.sources, &suggestion, further) else { continue };
            let (outcome, both) = self.settled(found, both, steps - 1);
            if outcome < best.0 && outcome != Outcome::Untried {
                best = (outcome, Some(both));
            }
        }
        (best.0, best.1.unwrap_or(suggestion))
    }

    /// What applied edits lead to, and the worst diagnostic among what is new at their place.
    fn tried(&self, found: &Diagnostic, applied: &Applied) -> (Outcome, Option<Diagnostic>) {
        let mistake = |diagnostic: &Diagnostic| (diagnostic.code, diagnostic.span, diagnostic.title.clone());
        let others = self.before.iter().filter(|other| mistake(other) != mistake(found));
        let known: Vec<(Code, Range<usize>)> = others
            .filter(|other| other.span.file == applied.file)
            .map(|other| (other.code, applied.moved(other.span)))
            .collect();
        let is_known = |code, at: &Range<usize>| {
            known.iter().any(|(known, place)| *known == code && (place.start == at.start || place.end == at.end))
        };
        let place = applied.place(found.span);
        let mut worst = (Outcome::Mended, None);
        for other in (self.again)(&self.sources.with_text(applied.file, &applied.text)) {
            let at = other.span.range();
            if other.code == Code::NOT_IMPORTED || other.span.file == applied.file && is_known(other.code, &at) {
                continue;
            }
            let outcome = applied.outcome(self.sources, found, &place, &other);
            if outcome > worst.0 {
                worst = (outcome, Some(other));
            }
        }
        worst
    }
}

/// A text with the edits of a suggestion.
struct Applied {
    file: FileId,
    text: String,
    /// What each edit replaced, and where the replacement is, in order.
    edits: Vec<(Range<usize>, Range<usize>)>,
}

impl Applied {
    /// Nothing if the edits are in several files.
    fn new(sources: &SourceMap, suggestion: &Suggestion) -> Option<Applied> {
        let mut edits: Vec<&(Span, String)> = suggestion.edits.iter().collect();
        edits.sort_by_key(|(span, _)| *span);
        let file = edits.first()?.0.file;
        let original = sources.file(file).text();
        let mut applied = Applied { file, text: String::with_capacity(original.len()), edits: Vec::new() };
        let mut done = 0;
        for (span, replacement) in edits {
            if span.file != file {
                return None;
            }
            applied.text.push_str(&original[done..span.range().start]);
            let lo = applied.text.len();
            applied.text.push_str(replacement);
            applied.edits.push((span.range(), lo..applied.text.len()));
            done = span.range().end;
        }
        applied.text.push_str(&original[done..]);
        Some(applied)
    }

    /// Where something is that was at a place before.
    fn moved(&self, span: Span) -> Range<usize> {
        let [mut lo, mut hi] = [span.range().start, span.range().end].map(|at| {
            let passed = self.edits.iter().rfind(|(before, _)| before.end <= at);
            passed.map_or(at, |(before, after)| at - before.end + after.end)
        });
        // An end that was replaced is where the replacement is.
        for (before, after) in &self.edits {
            if before.start < span.range().start && span.range().start < before.end {
                lo = after.start;
            }
            if before.start < span.range().end && span.range().end < before.end {
                hi = after.end;
            }
        }
        lo..hi.max(lo)
    }

    /// Where a mistake was, with all that was written at it.
    fn place(&self, span: Span) -> Range<usize> {
        let at = span.range();
        let touched = self.edits.iter().filter(|(before, _)| before.start <= at.end && at.start <= before.end);
        touched.fold(self.moved(span), |all, (_, after)| all.start.min(after.start)..all.end.max(after.end))
    }

    /// What another diagnostic for the text makes of the edits, which were suggested for `found`.
    fn outcome(&self, sources: &SourceMap, found: &Diagnostic, place: &Range<usize>, other: &Diagnostic) -> Outcome {
        if other.span.file != self.file {
            return if other.severity() == Severity::Error { Outcome::Elsewhere } else { Outcome::Mended };
        }
        let at = other.span.range();
        let written = || self.edits.iter().map(|(_, after)| after);
        let touched = written().chain([place]).any(|part| touch(&at, part));
        if other.severity() == Severity::Warning {
            let counts = touched && !STILL_TO_WRITE.contains(&other.code);
            return if counts { Outcome::Warned } else { Outcome::Mended };
        }
        if touched {
            let again = other.code == found.code && without_quotes(&other.title) == without_quotes(&found.title);
            let new = TWICE.contains(&other.code)
                || self.edits.iter().any(|(before, after)| {
                    let author = &sources.file(self.file).text()[before.clone()];
                    after.start <= at.start && at.end <= after.end && !quotes(author, &self.text[at.clone()])
                });
            return if again || new { Outcome::Wrong } else { Outcome::Further };
        }
        let follows = |part: &Range<usize>| {
            self.text.get(part.end..at.start).is_some_and(|gap| gap.chars().all(|c| matches!(c, ' ' | '\t')))
        };
        if written().chain([place]).any(follows) { Outcome::Further } else { Outcome::Elsewhere }
    }

    /// These edits and then those that were suggested for the text with them, as one; nothing if they are too far from
    /// each other.
    fn followed_by(&self, sources: &SourceMap, first: &Suggestion, then: &Suggestion) -> Option<Suggestion> {
        let changed = sources.with_text(self.file, &self.text);
        let further = Applied::new(&changed, then).filter(|further| further.file == self.file)?;
        let original = sources.file(self.file).text();
        let lo = self.edits.iter().map(|(before, _)| before.start);
        let hi = self.edits.iter().map(|(before, _)| before.end);
        let lo = lo.chain(further.edits.iter().map(|(at, _)| self.before(at.start, true))).min()?;
        let hi = hi.chain(further.edits.iter().map(|(at, _)| self.before(at.end, false))).max()?;
        let after = |hi: usize| further.text.len() - (original.len() - hi);
        let open = |hi: usize| {
            let written = &further.text[lo..after(hi)];
            written.matches(['[', '(']).count() > written.matches([']', ')']).count()
        };
        // What the message quotes is whole.
        let closed = original[hi..].bytes().take_while(|byte| matches!(byte, b']' | b')')).count();
        let hi = (hi..=hi + closed).find(|&hi| !open(hi)).unwrap_or(hi);
        let written = &further.text[lo..after(hi)];
        if original[lo..hi].contains('\n') || written.contains('\n') {
            return None;
        }
        let short = written.len() <= LONGEST_QUOTE && !written.contains('`');
        let message = if short { format!("write `{written}`") } else { first.message.clone() };
        let [lo, hi] = [lo, hi].map(|at| u32::try_from(at).expect("files are small"));
        let mut both = Suggestion::possible(message, vec![(Span { file: self.file, lo, hi }, written.to_owned())]);
        if [first, then].iter().all(|suggestion| suggestion.applicability == Applicability::MachineApplicable) {
            both.applicability = Applicability::MachineApplicable;
        }
        Some(both)
    }

    /// Where an end of something was before the edits: the beginning or the end of what was replaced, if it lies in a
    /// replacement.
    fn before(&self, at: usize, begins: bool) -> usize {
        let within = self.edits.iter().find(|(_, after)| after.start <= at && at <= after.end);
        if let Some((before, _)) = within {
            return if begins { before.start } else { before.end };
        }
        let passed = self.edits.iter().rfind(|(_, after)| after.end < at);
        passed.map_or(at, |(before, after)| at - after.end + before.end)
    }
}

/// Whether two stretches have something in common; an empty one has its ends.
fn touch(a: &Range<usize>, b: &Range<usize>) -> bool {
    let near = a.start <= b.end && b.start <= a.end;
    near && (a.start < b.end && b.start < a.end || a.is_empty() || b.is_empty())
}

/// Whether a longer text contains some words as words of their own.
fn quotes(text: &str, words: &str) -> bool {
    let joins = |c: char| c.is_alphanumeric() || c == '_';
    !words.is_empty()
        && text.len() > words.len()
        && text
            .match_indices(words)
            .any(|(at, _)| !text[..at].ends_with(joins) && !text[at + words.len()..].starts_with(joins))
}

/// A title without what it quotes.
fn without_quotes(title: &str) -> String {
    title.split('`').step_by(2).collect()
}
