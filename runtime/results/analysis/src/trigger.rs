//! When an operation has to act for a test to fail: the shortest description, by what happens in the undisturbed run,
//! that tells windows with which the test fails from others.
//!
//! Descriptions are made of windows that were tried and held against fresh ones, so that a reader sees how often one
//! holds. Shortest is what [`Trigger::length`] says; a window that is on the wrong side counts as much as two words.

mod candidates;

use std::cmp::Ordering;

use serde::Serialize;

use sesame_base::observation::{Course, Happening};
use sesame_plan::Span;

use candidates::{Candidate, candidates};

/// How many words a description may be longer for a window that it gets right.
const WORDS_PER_WINDOW: usize = 2;
/// Of fewer windows nothing is described, and fewer fresh ones show little.
const FEWEST: (usize, usize) = (12, 6);

/// A window of an operation that was tried.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TriedWindow {
    /// The window, in seconds.
    pub window: Span,
    /// Whether the test with it failed.
    pub fails: bool,
}

/// When an operation has to act.
#[derive(Debug, Clone, PartialEq)]
pub enum Trigger {
    /// At any time.
    Always,
    /// From a time before or after a moment to another one; both zero where the moment itself suffices.
    Around {
        /// The moment.
        moment: Moment,
        /// From when, in seconds after the moment; negative before it.
        from: f64,
        /// Until when, in the same way; at least `from`.
        to: f64,
    },
    /// For some time while something is so.
    While {
        /// What.
        state: State,
        /// For how many seconds at least; 0 if any time suffices.
        least: f64,
    },
    /// So that it begins, or ends, at some times, whatever else it does.
    Edge {
        /// Which of both.
        edge: Edge,
        /// When that has to be.
        within: Within,
    },
    /// All of a time of the run that nothing in it explains.
    Between {
        /// In seconds.
        span: Span,
    },
}

/// A side of a window.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Edge {
    /// Where the operation begins to act.
    Begins,
    /// Where it ends.
    Ends,
}

impl Edge {
    /// Both.
    pub const ALL: [Edge; 2] = [Edge::Begins, Edge::Ends];

    fn of(self, window: Span) -> f64 {
        match self {
            Edge::Begins => window.start,
            Edge::Ends => window.end,
        }
    }

    fn rule(self) -> Rule {
        match self {
            Edge::Begins => Rule::Begins,
            Edge::Ends => Rule::Ends,
        }
    }
}

/// When a window has to begin or to end.
#[derive(Debug, Clone, PartialEq)]
pub enum Within {
    /// While something is so.
    State(State),
    /// Around a moment.
    Around {
        /// The moment.
        moment: Moment,
        /// From when, in seconds after the moment; negative before it.
        from: f64,
        /// Until when, in the same way; at least `from`.
        to: f64,
    },
    /// In a time of the run that nothing in it explains.
    Times {
        /// In seconds.
        span: Span,
    },
}

/// Something that happens in the undisturbed run.
#[derive(Debug, Clone, PartialEq)]
pub struct Moment {
    /// The position of the wire among the paths of topics in the order of the plan.
    pub wire: u32,
    /// The field from the message inwards; empty for a message that is a single value, and for messages as such.
    pub field: String,
    /// What happens.
    pub what: Event,
    /// Which one.
    pub which: Which,
}

/// What happens at a moment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Event {
    /// A change of a field, or something about its messages.
    Happens(Happening),
    /// The field takes a value.
    Becomes(String),
}

/// Which of the moments at which something happens.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Which {
    /// Each of them.
    Any,
    /// The one with this number, from 1.
    Nth(usize),
    /// The last of several.
    Last,
}

/// Something that is so for some of the undisturbed run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct State {
    /// The position of the wire.
    pub wire: u32,
    /// The field from the message inwards; empty for a message that is a single value, and for messages as such.
    pub field: String,
    /// What is so.
    pub holds: Holds,
}

/// What is so of a field, or of the messages of a wire.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Holds {
    /// The field has this value.
    Value(String),
    /// Its number moves.
    Moves,
    /// Its number rests.
    Rests,
    /// Messages come.
    Speaks,
    /// No messages come, after some came.
    FallsSilent,
}

/// With which windows a test fails, by times of the undisturbed run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Decides {
    /// What a window must have to do with one of the times.
    pub rule: Rule,
    /// How many seconds it must have in common with it, at least, if that is the rule; 0 if any time suffices.
    pub least: f64,
    /// The times, in seconds.
    pub spans: Vec<Span>,
}

/// With which windows a test fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Rule {
    /// With all.
    Always,
    /// With those that contain one of the times.
    Contains,
    /// With those that have time in common with one of them.
    Overlaps,
    /// With those that begin within one of them.
    Begins,
    /// With those that end within one of them.
    Ends,
}

/// A description, and how often it holds.
#[derive(Debug, Clone, PartialEq)]
pub struct Description {
    /// When the operation has to act.
    pub trigger: Trigger,
    /// The same without words.
    pub decides: Decides,
    /// Of how many windows that it was made of, and how many of them it gets right.
    pub made_of: Agreement,
    /// The same of fresh windows.
    pub fresh: Agreement,
}

/// How many windows a description gets right.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Agreement {
    /// Windows of which it says what came out.
    pub right: usize,
    /// All windows.
    pub of: usize,
}

impl Trigger {
    /// How long its description is, in words, roughly: more for what a reader has to look up.
    pub fn length(&self) -> usize {
        match self {
            Trigger::Always => 0,
            Trigger::Around { moment, from, to } => {
                let times = usize::from(*from != 0.0) + usize::from(*to != 0.0);
                2 + usize::from(moment.which != Which::Any) + times
            }
            Trigger::While { least, .. } => 2 + usize::from(*least > 0.0),
            Trigger::Edge { within: Within::State(_), .. } => 4,
            Trigger::Edge { within: Within::Around { moment, .. }, .. } => 6 + usize::from(moment.which != Which::Any),
            Trigger::Edge { within: Within::Times { .. }, .. } => 8,
            Trigger::Between { .. } => 6,
        }
    }
}

/// Describes when an operation has to act.
///
/// The run ends at `end`; `smallest` is the smallest window with which the test fails; `own` are the wires that the
/// operation disturbs: if several descriptions are equally good, one by their messages is taken. `None` if too few
/// windows were tried.
pub fn describe(
    course: &Course,
    end: f64,
    own: &[u32],
    smallest: Span,
    tried: &[TriedWindow],
    fresh: &[TriedWindow],
) -> Option<Description> {
    if tried.len() < FEWEST.0 || fresh.len() < FEWEST.1 {
        return None;
    }
    let mut made_of = tried.to_vec();
    made_of.push(TriedWindow { window: smallest, fails: true });
    let ranked = candidates(course, end, smallest, &made_of).into_iter().map(|candidate| {
        let wrong = made_of.len() - right(&candidate, &made_of);
        (WORDS_PER_WINDOW * wrong + candidate.trigger.length(), wrong, candidate)
    });
    let (_, wrong, best) = ranked.min_by(|a, b| {
        let of_others = |candidate: &Candidate| candidate.wire.is_some_and(|wire| !own.contains(&wire));
        let by_words = a.0.cmp(&b.0).then(a.1.cmp(&b.1)).then(of_others(&a.2).cmp(&of_others(&b.2)));
        by_words.then(a.2.decides.spans.len().cmp(&b.2.decides.spans.len())).then(closer(&a.2, &b.2, smallest))
    })?;
    let (made_of, fresh) = (
        Agreement { right: made_of.len() - wrong, of: made_of.len() },
        Agreement { right: right(&best, fresh), of: fresh.len() },
    );
    Some(Description { trigger: best.trigger, decides: best.decides, made_of, fresh })
}

/// How many windows a candidate gets right.
fn right(candidate: &Candidate, tried: &[TriedWindow]) -> usize {
    tried.iter().filter(|tried| candidate.decides.fails(tried.window) == tried.fails).count()
}

/// Which of two candidates is about times closer to a window.
fn closer(a: &Candidate, b: &Candidate, window: Span) -> Ordering {
    let middle = |span: &Span| f64::midpoint(span.start, span.end);
    let distance = |candidate: &Candidate| {
        let distances = candidate.decides.spans.iter().map(|span| (middle(span) - middle(&window)).abs());
        distances.fold(f64::INFINITY, f64::min)
    };
    distance(a).total_cmp(&distance(b))
}

#[cfg(test)]
mod tests;
