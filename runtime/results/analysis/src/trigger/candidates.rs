//! What may be said of when an operation has to act, by the course of the undisturbed run.

use std::collections::BTreeMap;

use sesame_base::observation::{Course, Happening, Signal, States};
use sesame_plan::Span;

use crate::trigger::{Decides, Edge, Event, Holds, Moment, Rule, State, TriedWindow, Trigger, Which, Within};

/// Of something that happens more often, no single one is counted out.
const COUNTED: usize = 12;

/// A description, and what follows from it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Candidate {
    pub(super) trigger: Trigger,
    /// The wire that it is about, if it is about one.
    pub(super) wire: Option<u32>,
    pub(super) decides: Decides,
}

/// Times are equal up to this share of the longest, since they come from sums of steps.
const EQUAL: f64 = 1e-9;

impl Decides {
    fn new(rule: Rule, spans: Vec<Span>) -> Decides {
        Decides { rule, least: 0.0, spans }
    }

    /// Whether the test fails with a window.
    pub(super) fn fails(&self, window: Span) -> bool {
        let near = EQUAL * window.end.abs().max(1.0);
        let any = |decides: &dyn Fn(&Span) -> bool| self.spans.iter().any(decides);
        match self.rule {
            Rule::Always => true,
            // A window ends before a message at its end.
            Rule::Contains => any(&|span| {
                let until = if span.length() > 0.0 { window.end + near >= span.end } else { window.end > span.end };
                window.start <= span.start + near && until
            }),
            Rule::Overlaps => {
                any(&|span| window.end.min(span.end) - window.start.max(span.start) > (self.least - near).max(0.0))
            }
            Rule::Begins => any(&|span| span.start <= window.start + near && window.start < span.end),
            Rule::Ends => any(&|span| span.start < window.end && window.end <= span.end + near),
        }
    }
}

/// All that may be said. `smallest` is a smallest window with which the test fails: it decides which one of several
/// moments is meant, and from when to when around it. The run ends at `end`. Where it only matters when a window
/// begins, or when it ends, the windows that were tried show from when to when that may be.
pub(super) fn candidates(course: &Course, end: f64, smallest: Span, tried: &[TriedWindow]) -> Vec<Candidate> {
    let mut found = vec![
        Candidate { trigger: Trigger::Always, wire: None, decides: Decides::new(Rule::Always, Vec::new()) },
        Candidate {
            trigger: Trigger::Between { span: smallest },
            wire: None,
            decides: Decides::new(Rule::Contains, vec![smallest]),
        },
    ];
    for edge in Edge::ALL {
        let at = tried.iter().map(|tried| (edge.of(tried.window), tried.fails));
        if let Some(span) = interval(at, edge.of(smallest)) {
            let within = Within::Times { span };
            let decides = Decides::new(edge.rule(), vec![span]);
            found.push(Candidate { trigger: Trigger::Edge { edge, within }, wire: None, decides });
        }
    }
    for signal in &course.signals {
        let mut by_kind: BTreeMap<Happening, Vec<f64>> = BTreeMap::new();
        for event in &signal.events {
            by_kind.entry(event.what).or_default().push(event.at);
        }
        for (what, times) in by_kind {
            // The values say more, where there are some.
            let known = what == Happening::Changes && course.states.iter().any(|states| is_of(states, signal));
            if !known {
                around(signal.wire, &signal.field, &Event::Happens(what), &times, (smallest, tried), &mut found);
            }
        }
        for (holds, spans) in periods(signal, end) {
            let state = State { wire: signal.wire, field: signal.field.clone(), holds };
            whiles(&state, &spans, smallest, &mut found);
        }
    }
    for states in &course.states {
        let mut by_value: BTreeMap<&str, Vec<Span>> = BTreeMap::new();
        for (at, entered) in states.entered.iter().enumerate() {
            let end = states.entered.get(at + 1).map_or(end, |next| next.at);
            by_value.entry(&entered.value).or_default().push(Span { start: entered.at, end });
        }
        let first = states.entered.first().map_or(0.0, |entered| entered.at);
        for (value, spans) in by_value {
            let times: Vec<f64> = spans.iter().map(|span| span.start).filter(|start| *start > first).collect();
            around(
                states.wire,
                &states.field,
                &Event::Becomes(value.to_owned()),
                &times,
                (smallest, tried),
                &mut found,
            );
            let holds = Holds::Value(value.to_owned());
            let state = State { wire: states.wire, field: states.field.clone(), holds };
            whiles(&state, &spans, smallest, &mut found);
        }
    }
    found
}

fn is_of(states: &States, signal: &Signal) -> bool {
    states.wire == signal.wire && states.field == signal.field && !signal.is_of_messages()
}

/// That it has to act at moments of one kind, or around them, or to begin or end around them.
fn around(
    wire: u32,
    field: &str,
    what: &Event,
    times: &[f64],
    (smallest, tried): (Span, &[TriedWindow]),
    found: &mut Vec<Candidate>,
) {
    let middle = f64::midpoint(smallest.start, smallest.end);
    let distance = |at: &f64| (at - middle).abs();
    let Some(nearest) = (0..times.len()).min_by(|&a, &b| distance(&times[a]).total_cmp(&distance(&times[b]))) else {
        return;
    };
    let offsets = (smallest.start - times[nearest], smallest.end - times[nearest]);
    // A moment that is farther away than the window is long explains nothing.
    let near = |offset: f64| offset.abs() <= 2.0 * smallest.length();
    let mut which = vec![(Which::Any, times.to_vec())];
    if times.len() > 1 && times.len() <= COUNTED {
        let one = if nearest + 1 == times.len() { Which::Last } else { Which::Nth(nearest + 1) };
        which.push((one, vec![times[nearest]]));
    }
    for (which, times) in which {
        for edge in Edge::ALL {
            // How long after the nearest moment it is.
            let after = |at: f64| {
                let offsets = times.iter().map(|time| at - time);
                offsets.min_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(f64::INFINITY)
            };
            let at = tried.iter().map(|tried| (after(edge.of(tried.window)), tried.fails));
            let Some(Span { start: from, end: to }) = interval(at, after(edge.of(smallest))) else { continue };
            // A moment that is farther away than half of the interval explains nothing.
            if from.max(-to) > (to - from) / 2.0 {
                continue;
            }
            let moment = Moment { wire, field: field.to_owned(), what: what.clone(), which };
            let spans = times.iter().map(|at| Span { start: at + from, end: at + to }).collect();
            let trigger = Trigger::Edge { edge, within: Within::Around { moment, from, to } };
            found.push(Candidate { trigger, wire: Some(wire), decides: Decides::new(edge.rule(), spans) });
        }
        let mut add = |from: f64, to: f64| {
            let moment = Moment { wire, field: field.to_owned(), what: what.clone(), which };
            let spans = times.iter().map(|at| Span { start: at + from, end: at + to }).collect();
            let trigger = Trigger::Around { moment, from, to };
            found.push(Candidate { trigger, wire: Some(wire), decides: Decides::new(Rule::Contains, spans) });
        };
        add(0.0, 0.0);
        let (from, to) = offsets;
        if near(from) && near(to) {
            add(from, to);
            // It begins or ends with the moment, which the window that was tried need not have met exactly.
            if from <= 0.0 && to > 0.0 {
                add(from, 0.0);
                add(0.0, to);
            }
        }
    }
}

/// That it has to act, or to begin to, while something is so, in these times.
fn whiles(state: &State, spans: &[Span], smallest: Span, found: &mut Vec<Candidate>) {
    let common = |span: &Span| smallest.end.min(span.end) - smallest.start.max(span.start);
    let longest = spans.iter().map(common).fold(0.0, f64::max);
    if longest <= 0.0 {
        return;
    }
    let wire = Some(state.wire);
    let mut add = |trigger, rule, least| {
        found.push(Candidate { trigger, wire, decides: Decides { least, ..Decides::new(rule, spans.to_vec()) } });
    };
    for least in [0.0, longest] {
        add(Trigger::While { state: state.clone(), least }, Rule::Overlaps, least);
    }
    for edge in Edge::ALL {
        add(Trigger::Edge { edge, within: Within::State(state.clone()) }, edge.rule(), 0.0);
    }
}

/// The interval around a place in which most of what is at places fails, and most outside does not; it ends halfway to
/// the next place. `None` if there is nothing on one side of it, so that it has no end there.
fn interval(places: impl Iterator<Item = (f64, bool)>, around: f64) -> Option<Span> {
    let mut places: Vec<(f64, bool)> = places.filter(|(at, _)| at.is_finite()).collect();
    places.sort_by(|a, b| a.0.total_cmp(&b.0));
    let middle = places.partition_point(|(at, _)| *at < around);
    // Going outwards, each that fails counts for the interval, and each that does not against it.
    let farthest = |going: &mut dyn Iterator<Item = usize>| {
        let (mut sum, mut best, mut until) = (0i32, 0i32, None);
        for at in going {
            sum += if places[at].1 { 1 } else { -1 };
            if sum > best {
                (best, until) = (sum, Some(at));
            }
        }
        until
    };
    let last = farthest(&mut (middle..places.len())).map_or(middle, |at| at + 1);
    let first = farthest(&mut (0..middle).rev()).unwrap_or(middle);
    let outside = |at: usize| places.get(at).map(|place| place.0);
    let (before, after) = (outside(first.checked_sub(1)?)?, outside(last)?);
    let inside = &places[first..last];
    let least = inside.first().map_or(around, |place| place.0.min(around));
    let most = inside.last().map_or(around, |place| place.0.max(around));
    Some(Span { start: f64::midpoint(before, least), end: f64::midpoint(most, after) })
}

/// The times in which a number moves or rests, or messages come or do not.
fn periods(signal: &Signal, end: f64) -> Vec<(Holds, Vec<Span>)> {
    let [of_messages, of_number] =
        [[Happening::Begins, Happening::Ends], [Happening::SetsOut, Happening::Rests]].map(|[begins, ends]| {
            let events = signal.events.iter().filter(|event| event.what == begins || event.what == ends);
            let marks: Vec<(f64, bool)> = events.map(|event| (event.at, event.what == begins)).collect();
            marks
        });
    let alternate = |marks: &[(f64, bool)]| -> [Vec<Span>; 2] {
        let mut of_each = [Vec::new(), Vec::new()];
        for (at, &(start, on)) in marks.iter().enumerate() {
            let end = marks.get(at + 1).map_or(end, |next| next.0);
            of_each[usize::from(!on)].push(Span { start, end });
        }
        // Before the first mark it was the other way.
        if let Some(&(first, on)) = marks.first() {
            of_each[usize::from(on)].insert(0, Span { start: 0.0, end: first });
        }
        of_each
    };
    let [speaks, mut silent] = alternate(&of_messages);
    // Nobody falls silent who has not spoken.
    silent.retain(|span| span.start > 0.0);
    let [moves, rests] = alternate(&of_number);
    let all = [(Holds::Speaks, speaks), (Holds::FallsSilent, silent), (Holds::Moves, moves), (Holds::Rests, rests)];
    all.into_iter().filter(|(_, spans)| !spans.is_empty()).collect()
}
