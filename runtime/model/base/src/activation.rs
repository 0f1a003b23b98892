//! When an operation of a test is active: in a window of time, or from one condition until another, or for a length.
//!
//! An activation by condition begins when its start *becomes* true: the start condition without the end condition, or
//! the start condition alone if the activation has a length. Before the operation's window nothing counts as true, so a
//! start that holds at the beginning of the window begins one activation there. A start that becomes true while the
//! operation is active begins nothing.
//!
//! At one instant of simulation time an operation switches at most once. A second switch waits until the instant is
//! over, and happens one nanosecond later (the resolution of simulation time) if its condition still holds then. So
//! every activation has a length.

use sesame_plan::condition::Condition;
use sesame_plan::{Activation, MetricId, Span};

use crate::condition::holds;
use crate::time::SimTime;

/// The resolution of simulation time: how long an instant lasts.
pub const TICK: SimTime = SimTime::from_nanos(1);

/// The activity of one operation in one run: whether it is active now, and when it was.
///
/// It follows time by [`Activity::advance_to`], which must stop at each [`Activity::next_edge`], and the values of
/// metrics by [`Activity::evaluate`], at each edge and whenever a value changed. Evaluating the same values again
/// changes nothing.
#[derive(Debug, Clone)]
pub struct Activity {
    /// A window of time, or `within` if conditions switch it: it is never active outside of it.
    window: (SimTime, SimTime),
    switch: Switch,
    phase: Phase,
    /// How many activations are left.
    left: u32,
    /// Whether its start held at the last evaluation.
    held: bool,
    /// Its start became true and holds, but the activation could not begin yet.
    waiting: bool,
    /// When it last became active or inactive.
    switched: Option<SimTime>,
    /// When it has to be evaluated again, because something waits for the end of an instant.
    again: Option<SimTime>,
    observed: Vec<(SimTime, SimTime)>,
    /// The total length of all observed intervals.
    past: SimTime,
}

/// How it is switched, apart from the window.
#[derive(Debug, Clone)]
enum Switch {
    Time,
    Conditions { start: Condition, end: Condition },
    Length { start: Condition, length: SimTime },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// The window has not begun.
    Before,
    /// A condition can switch it on.
    Waiting,
    /// It becomes inactive at `until` at the latest.
    Active { since: SimTime, until: SimTime },
    /// It is never active again.
    Over,
}

/// The effect of a moment on an activity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Edge {
    /// No change.
    None,
    /// It became active.
    Started,
    /// It became inactive.
    Ended,
}

impl Activity {
    /// An activity that has not begun. `within` is a hard limit: outside of it the operation is never active. An
    /// offline operation is never active.
    pub fn new(activation: &Activation, within: Span) -> Self {
        let (from, to, left, switch) = match activation {
            Activation::Time { start, end } => (start.max(within.start), end.min(within.end), 1, Switch::Time),
            Activation::Condition { start, end, times } => {
                let switch = Switch::Conditions { start: start.clone(), end: end.clone() };
                (within.start, within.end, *times, switch)
            }
            Activation::ConditionFor { start, length, times } => {
                let length = SimTime::from_seconds(*length).max(TICK);
                (within.start, within.end, *times, Switch::Length { start: start.clone(), length })
            }
            Activation::Offline => (within.start, within.start, 0, Switch::Time),
        };
        let window = (SimTime::from_seconds(from), SimTime::from_seconds(to));
        let phase = if window.0 < window.1 && left > 0 { Phase::Before } else { Phase::Over };
        Activity {
            window,
            switch,
            phase,
            left,
            held: false,
            waiting: false,
            switched: None,
            again: None,
            observed: Vec::new(),
            past: SimTime::ZERO,
        }
    }

    /// Whether it is active.
    pub fn is_active(&self) -> bool {
        matches!(self.phase, Phase::Active { .. })
    }

    /// Whether conditions switch it, so that it has to be evaluated.
    pub fn is_conditional(&self) -> bool {
        !matches!(self.switch, Switch::Time)
    }

    /// The next moment at which time alone changes it, or at which it has to be evaluated again, as far as is known.
    // The relay asks each operation at each message.
    #[inline]
    pub fn next_edge(&self) -> Option<SimTime> {
        let edge = match self.phase {
            Phase::Before => Some(self.window.0),
            Phase::Active { until, .. } => Some(until),
            Phase::Waiting | Phase::Over => None,
        };
        edge.into_iter().chain(self.again).min()
    }

    /// Advances time, which never goes back and stops at each edge: it is active for `start <= t < end`.
    pub fn advance_to(&mut self, now: SimTime) -> Edge {
        match self.phase {
            Phase::Before if now >= self.window.0 => match self.switch {
                Switch::Time => self.begin(self.window.0, self.window.1),
                Switch::Conditions { .. } | Switch::Length { .. } => {
                    self.phase = Phase::Waiting;
                    Edge::None
                }
            },
            Phase::Active { since, until } if now >= until => self.deactivate(since, until),
            _ => Edge::None,
        }
    }

    /// Evaluates its conditions at a moment, given the values of metrics at that moment.
    pub fn evaluate(&mut self, now: SimTime, value: &impl Fn(MetricId) -> Option<f64>) -> Edge {
        let ended = self.evaluate_end(now, value);
        let started = self.evaluate_start(now, true, value);
        if ended == Edge::None { started } else { ended }
    }

    /// The first half of [`Activity::evaluate`]: whether its end condition makes it inactive.
    pub fn evaluate_end(&mut self, now: SimTime, value: &impl Fn(MetricId) -> Option<f64>) -> Edge {
        self.again = self.again.filter(|&again| again > now);
        match (self.phase, &self.switch) {
            (Phase::Active { since, .. }, Switch::Conditions { end, .. }) if holds(end, value) => {
                if self.switched == Some(now) {
                    self.again = Some(now + TICK);
                    return Edge::None;
                }
                self.deactivate(since, now)
            }
            _ => Edge::None,
        }
    }

    /// The second half of [`Activity::evaluate`]: whether its conditions make it active. If it is not `free` to begin,
    /// it waits for as long as they hold.
    pub fn evaluate_start(&mut self, now: SimTime, free: bool, value: &impl Fn(MetricId) -> Option<f64>) -> Edge {
        let (holds, length) = match &self.switch {
            Switch::Time => return Edge::None,
            Switch::Conditions { start, end } => (holds(start, value) && !holds(end, value), None),
            Switch::Length { start, length } => (holds(start, value), Some(*length)),
        };
        if matches!(self.phase, Phase::Before | Phase::Over) {
            return Edge::None;
        }
        let became = holds && !self.held;
        self.held = holds;
        if self.is_active() {
            return Edge::None;
        }
        if now >= self.window.1 {
            self.phase = Phase::Over;
            self.again = None;
            return Edge::None;
        }
        self.waiting = holds && (became || self.waiting);
        if !self.waiting {
            return Edge::None;
        }
        if self.switched == Some(now) {
            self.again = Some(now + TICK);
            return Edge::None;
        }
        if !free {
            return Edge::None;
        }
        let until = length.map_or(self.window.1, |length| (now + length).min(self.window.1));
        self.begin(now, until)
    }

    fn begin(&mut self, since: SimTime, until: SimTime) -> Edge {
        self.left -= 1;
        self.waiting = false;
        self.switched = Some(since);
        self.phase = Phase::Active { since, until };
        Edge::Started
    }

    fn deactivate(&mut self, since: SimTime, at: SimTime) -> Edge {
        self.switched = Some(at);
        self.observed.push((since, at));
        self.past = self.past + (at - since);
        self.again = None;
        self.phase = if self.left > 0 && at < self.window.1 { Phase::Waiting } else { Phase::Over };
        Edge::Ended
    }

    /// How long it has been active until now, which is not before any moment it knows.
    pub fn active_time(&self, now: SimTime) -> SimTime {
        match self.phase {
            Phase::Active { since, .. } => self.past + (now - since),
            _ => self.past,
        }
    }

    /// The observed active intervals in seconds, clipped to a run that ended at `end`. None is empty.
    pub fn intervals(&self, end: SimTime) -> Vec<Span> {
        let open = match self.phase {
            Phase::Active { since, .. } => Some((since, end)),
            _ => None,
        };
        let all = self.observed.iter().copied().chain(open).map(|(from, to)| (from, to.min(end)));
        all.filter(|(from, to)| from < to).map(|(from, to)| Span { start: from.seconds(), end: to.seconds() }).collect()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use sesame_plan::condition::{Comparison, Operand};

    use super::*;
    use crate::condition::testing::{above, below, compare, variable};

    const WITHIN: Span = Span { start: 1.0, end: 9.0 };

    fn activity(start: f64, end: f64) -> Activity {
        Activity::new(&Activation::Time { start, end }, WITHIN)
    }

    fn run(activity: &mut Activity, times: &[f64]) -> Vec<bool> {
        times
            .iter()
            .map(|&t| {
                let now = SimTime::from_seconds(t);
                while let Some(edge) = activity.next_edge().filter(|&edge| edge <= now) {
                    activity.advance_to(edge);
                }
                activity.is_active()
            })
            .collect()
    }

    /// Carries out all edges up to a moment, each with the value known by then.
    fn carry_out(activity: &mut Activity, now: SimTime, x: Option<f64>) {
        while let Some(edge) = activity.next_edge().filter(|&edge| edge <= now) {
            activity.advance_to(edge);
            activity.evaluate(edge, &|_| x);
        }
    }

    /// Advances time and then evaluates a metric's value, at each of these moments.
    fn weighed(activation: &Activation, moments: &[(f64, f64)]) -> (Vec<bool>, Vec<(f64, f64)>) {
        let mut activity = Activity::new(activation, WITHIN);
        let (mut active, mut known) = (Vec::new(), None);
        for &(t, x) in moments {
            let now = SimTime::from_seconds(t);
            carry_out(&mut activity, now, known);
            known = Some(x);
            activity.evaluate(now, &|_| known);
            active.push(activity.is_active());
        }
        let end = SimTime::from_seconds(10.0);
        carry_out(&mut activity, end, known);
        (active, activity.intervals(end).into_iter().map(|span| (span.start, span.end)).collect())
    }

    fn until(times: u32) -> Activation {
        Activation::Condition { start: above(0, 5.0), end: below(0, 3.0), times }
    }

    fn lasting(length: f64, times: u32) -> Activation {
        Activation::ConditionFor { start: above(0, 5.0), length, times }
    }

    #[test]
    fn active_from_start_inclusive_to_end_exclusive() {
        let mut window = activity(2.0, 3.0);
        assert_eq!(run(&mut window, &[0.0, 1.99, 2.0, 2.99, 3.0, 4.0]), [false, false, true, true, false, false]);
        assert_eq!(window.intervals(SimTime::from_seconds(10.0)), [Span { start: 2.0, end: 3.0 }]);
    }

    #[test]
    fn within_is_a_hard_limit() {
        let mut window = activity(0.0, 100.0);
        assert_eq!(run(&mut window, &[0.5, 1.0, 8.9, 9.0]), [false, true, true, false]);
        assert_eq!(window.intervals(SimTime::from_seconds(10.0)), [Span { start: 1.0, end: 9.0 }]);
        let high = [(0.5, 9.0), (1.5, 9.0), (8.5, 9.0), (9.0, 9.0), (9.5, 9.0)];
        assert_eq!(weighed(&until(5), &high), (vec![false, true, true, false, false], vec![(1.0, 9.0)]));
        assert_eq!(weighed(&lasting(20.0, 5), &high), (vec![false, true, true, false, false], vec![(1.0, 9.0)]));
    }

    #[test]
    fn an_interval_still_open_ends_with_the_run() {
        let mut window = activity(2.0, 8.0);
        run(&mut window, &[0.0, 2.5]);
        assert_eq!(window.intervals(SimTime::from_seconds(4.0)), [Span { start: 2.0, end: 4.0 }]);
        assert_eq!(window.active_time(SimTime::from_seconds(2.5)), SimTime::from_seconds(0.5));
    }

    #[test]
    fn a_window_never_reached_has_no_interval() {
        let mut window = activity(5.0, 6.0);
        run(&mut window, &[0.0, 4.0]);
        assert!(window.intervals(SimTime::from_seconds(4.0)).is_empty());
        let mut empty = activity(5.0, 5.0);
        assert_eq!(run(&mut empty, &[0.0, 5.0, 6.0]), [false, false, false]);
        assert!(empty.intervals(SimTime::from_seconds(9.0)).is_empty());
    }

    #[test]
    fn one_condition_switches_on_and_another_off() {
        let moments = [(2.0, 4.0), (3.0, 6.0), (4.0, 4.0), (5.0, 2.0), (6.0, 6.0), (7.0, 2.0), (8.0, 6.0)];
        let (active, intervals) = weighed(&until(1), &moments);
        assert_eq!(active, [false, true, true, false, false, false, false]);
        assert_eq!(intervals, [(3.0, 5.0)]);
        assert_eq!(weighed(&until(2), &moments).1, [(3.0, 5.0), (6.0, 7.0)]);
        assert_eq!(weighed(&until(3), &moments).1, [(3.0, 5.0), (6.0, 7.0), (8.0, 9.0)]);
    }

    #[test]
    fn a_length_ends_exactly_even_between_coarse_steps() {
        let (active, intervals) = weighed(&lasting(0.7, 1), &[(2.0, 6.0), (3.0, 0.0), (4.0, 6.0)]);
        assert_eq!((active, intervals), (vec![true, false, false], vec![(2.0, 2.7)]));
    }

    #[test]
    fn a_condition_that_goes_on_holding_begins_one_activation() {
        let high = |t: f64| (t, 6.0);
        let moments = [high(2.0), high(2.5), high(3.0), high(4.0), (5.0, 4.0), high(6.0), high(7.5)];
        assert_eq!(weighed(&lasting(1.0, 9), &moments).1, [(2.0, 3.0), (6.0, 7.0)]);
        assert_eq!(weighed(&lasting(1.0, 1), &moments).1, [(2.0, 3.0)]);
    }

    #[test]
    fn what_becomes_true_during_an_activation_begins_none() {
        let moments = [(2.0, 6.0), (2.5, 4.0), (2.75, 6.0), (5.0, 6.0), (6.0, 4.0), (7.0, 6.0)];
        assert_eq!(weighed(&lasting(1.0, 9), &moments).1, [(2.0, 3.0), (7.0, 8.0)]);
    }

    #[test]
    fn where_start_and_end_hold_at_once_nothing_begins() {
        let same = compare(variable(0), Comparison::Equal, Operand::Number(5.0));
        let both = Activation::Condition { start: same.clone(), end: same, times: 2 };
        assert_eq!(weighed(&both, &[(2.0, 5.0), (3.0, 4.0), (4.0, 5.0)]).1, []);
    }

    #[test]
    fn what_begins_and_ends_at_one_instant_lasts_for_that_instant() {
        let moments = [(2.0, 6.0), (2.0, 2.0), (4.0, 6.0), (5.0, 2.0)];
        let (active, intervals) = weighed(&until(2), &moments);
        assert_eq!(active, [true, true, true, false], "the end waits until the instant is over");
        assert_eq!(intervals, [(2.0, 2.000_000_001), (4.0, 5.0)]);
        // It does not end if its end condition does not hold any more by then.
        assert_eq!(weighed(&until(2), &[(2.0, 6.0), (2.0, 2.0), (2.0, 6.0), (3.0, 2.0)]).1, [(2.0, 3.0)]);
    }

    #[test]
    fn what_ends_and_begins_at_one_instant_begins_when_the_instant_is_over() {
        let moments = [(2.0, 6.0), (3.0, 2.0), (3.0, 6.0), (4.0, 2.0)];
        let (active, intervals) = weighed(&until(2), &moments);
        assert_eq!(active, [true, false, false, false]);
        assert_eq!(intervals, [(2.0, 3.0), (3.000_000_001, 4.0)]);
        assert_eq!(weighed(&until(2), &[(2.0, 6.0), (3.0, 2.0), (3.0, 6.0), (3.0, 2.0)]).1, [(2.0, 3.0)]);
    }

    #[test]
    fn an_activation_that_may_not_begin_waits_for_as_long_as_its_condition_holds() {
        let at = SimTime::from_seconds;
        let waiting = |until: f64| {
            let mut activity = Activity::new(&lasting(1.0, 9), WITHIN);
            activity.advance_to(at(1.0));
            assert_eq!(activity.evaluate_start(at(2.0), false, &|_| Some(6.0)), Edge::None);
            activity.evaluate_start(at(3.0), false, &|_| Some(until));
            activity.evaluate_start(at(4.0), true, &|_| Some(6.0))
        };
        assert_eq!(waiting(6.0), Edge::Started, "it begins as soon as it may");
        let mut lost = Activity::new(&lasting(1.0, 9), WITHIN);
        lost.advance_to(at(1.0));
        lost.evaluate_start(at(2.0), false, &|_| Some(6.0));
        lost.evaluate_start(at(3.0), false, &|_| Some(4.0));
        assert_eq!(lost.evaluate_start(at(4.0), true, &|_| Some(4.0)), Edge::None, "that occurrence is lost");
    }

    /// The window of the property below, in nanoseconds.
    const FROM: i64 = 8;
    const TO: i64 = 70;

    /// The description of the module, literally: every nanosecond is visited, and the truth of the start is kept for
    /// all moments so far.
    fn plainly(changes: &[(i64, f64)], times: usize, length: Option<i64>) -> Vec<(i64, i64)> {
        let (mut intervals, mut on): (Vec<(i64, i64)>, Option<i64>) = (Vec::new(), None);
        // Per moment, from the last one at which it was active: whether its start holds.
        let mut history = vec![false];
        let mut switched = None;
        for t in FROM..TO {
            let known = changes.iter().rev().find(|(at, _)| *at < t).map(|(_, x)| *x);
            let here = changes.iter().filter(|(at, _)| *at == t).map(|(_, x)| Some(*x));
            for x in std::iter::once(known).chain(here) {
                let (high, low) = (x.is_some_and(|x| x > 5.0), x.is_some_and(|x| x < 3.0));
                if let Some(since) = on {
                    let over = length.map_or(low, |length| t >= since + length);
                    if over && switched != Some(t) {
                        intervals.push((since, t));
                        (on, switched) = (None, Some(t));
                        history.drain(..history.len() - 1);
                    }
                }
                history.push(high);
                let stretch = history.iter().rev().take_while(|holds| **holds).count();
                let became = stretch > 0 && stretch < history.len();
                if on.is_none() && became && switched != Some(t) && intervals.len() < times {
                    (on, switched) = (Some(t), Some(t));
                }
            }
        }
        intervals.extend(on.map(|since| (since, TO)));
        intervals
    }

    proptest! {
        #[test]
        fn activity_by_condition_is_that_of_a_plain_model(
            changes in prop::collection::vec((0i64..4, 0u32..8), 0..60),
            times in 1u32..4,
            length in prop::option::of(1i64..20),
        ) {
            let mut time = 0;
            let changes: Vec<(i64, f64)> = changes.iter().map(|&(gap, x)| {
                time += gap;
                (time, f64::from(x))
            }).collect();
            let activation = match length {
                Some(length) => lasting(SimTime::from_nanos(length).seconds(), times),
                None => until(times),
            };
            let seconds = |nanos| SimTime::from_nanos(nanos).seconds();
            let mut activity = Activity::new(&activation, Span { start: seconds(FROM), end: seconds(TO) });
            let mut known = None;
            for &(t, x) in &changes {
                let now = SimTime::from_nanos(t);
                carry_out(&mut activity, now, known);
                known = Some(x);
                activity.evaluate(now, &|_| known);
            }
            let end = SimTime::from_nanos(100);
            carry_out(&mut activity, end, known);
            let intervals: Vec<(i64, i64)> = activity.intervals(end).iter().map(|span| {
                (SimTime::from_seconds(span.start).nanos(), SimTime::from_seconds(span.end).nanos())
            }).collect();
            prop_assert!(intervals.iter().all(|(start, end)| start < end));
            prop_assert_eq!(intervals, plainly(&changes, usize::try_from(times).unwrap(), length));
        }
    }
}
