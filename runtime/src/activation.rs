//! When an operation of a test is active: in a window of time, or from one condition until another or for a length.

use sesame_plan::condition::Condition;
use sesame_plan::{Activation, MetricId, Span};

use crate::condition::holds;
use crate::time::SimTime;

/// The activity of one operation in one run: whether it is on now, and when it was.
///
/// It is told of time by [`Activity::follow`] and of values by [`Activity::weigh`], each with the number of the step in
/// which that happens. Nothing goes on and off, or off and on again, in one step.
#[derive(Debug, Clone)]
pub struct Activity {
    /// A window of time, or `within` where conditions switch: never active outside of it.
    window: (SimTime, SimTime),
    switch: Switch,
    phase: Phase,
    /// How often it may still go on.
    left: u32,
    /// The last step in which it went on or off.
    changed_in: Option<u64>,
    observed: Vec<(SimTime, SimTime)>,
    /// The length of all observed intervals together.
    past: SimTime,
}

/// What switches it on and off, besides the window.
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
    /// It goes off at `until` at the latest.
    Active { since: SimTime, until: SimTime },
    /// It is never active again.
    Over,
}

/// What a moment did to an activity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Edge {
    /// Nothing.
    None,
    /// It went on.
    Started,
    /// It went off.
    Ended,
}

impl Activity {
    /// An activity that has not begun. `within` is a hard limit: outside of it the operation is never active. An offline
    /// operation never is.
    pub fn new(activation: &Activation, within: Span) -> Self {
        let (from, to, left, switch) = match activation {
            Activation::Time { start, end } => (start.max(within.start), end.min(within.end), 1, Switch::Time),
            Activation::Condition { start, end, times } => {
                let switch = Switch::Conditions { start: start.clone(), end: end.clone() };
                (within.start, within.end, *times, switch)
            }
            Activation::ConditionFor { start, length, times } => {
                let switch = Switch::Length { start: start.clone(), length: SimTime::from_seconds(*length) };
                (within.start, within.end, *times, switch)
            }
            Activation::Offline => (within.start, within.start, 0, Switch::Time),
        };
        let window = (SimTime::from_seconds(from), SimTime::from_seconds(to));
        let phase = if window.0 < window.1 && left > 0 { Phase::Before } else { Phase::Over };
        Activity { window, switch, phase, left, changed_in: None, observed: Vec::new(), past: SimTime::ZERO }
    }

    /// Whether it is on.
    pub fn is_active(&self) -> bool {
        matches!(self.phase, Phase::Active { .. })
    }

    /// Whether conditions switch it, so that it must be told of values.
    pub fn is_conditional(&self) -> bool {
        !matches!(self.switch, Switch::Time)
    }

    /// When time alone will next change it, as far as is known.
    pub fn next_edge(&self) -> Option<SimTime> {
        match self.phase {
            Phase::Before => Some(self.window.0),
            Phase::Active { until, .. } => Some(until),
            Phase::Waiting | Phase::Over => None,
        }
    }

    /// Follows time, which never goes back and stops at each edge: it is active for `start <= t < end`.
    pub fn follow(&mut self, now: SimTime, step: u64) -> Edge {
        match self.phase {
            Phase::Before if now >= self.window.0 => match self.switch {
                Switch::Time => self.begin(self.window.0, self.window.1, step),
                Switch::Conditions { .. } | Switch::Length { .. } => {
                    self.phase = Phase::Waiting;
                    Edge::None
                }
            },
            Phase::Active { since, until } if now >= until => self.cease(since, until, step),
            _ => Edge::None,
        }
    }

    /// Weighs its conditions at a moment, given the values of metrics then.
    pub fn weigh(&mut self, now: SimTime, step: u64, value: &impl Fn(MetricId) -> Option<f64>) -> Edge {
        if self.changed_in == Some(step) {
            return Edge::None;
        }
        match (self.phase, &self.switch) {
            (Phase::Waiting, _) if now >= self.window.1 => {
                self.phase = Phase::Over;
                Edge::None
            }
            (Phase::Waiting, Switch::Conditions { start, .. }) if holds(start, value) => {
                self.begin(now, self.window.1, step)
            }
            (Phase::Waiting, Switch::Length { start, length }) if holds(start, value) => {
                let until = (now + *length).min(self.window.1);
                self.begin(now, until, step)
            }
            (Phase::Active { since, .. }, Switch::Conditions { end, .. }) if holds(end, value) => {
                self.cease(since, now, step)
            }
            _ => Edge::None,
        }
    }

    fn begin(&mut self, since: SimTime, until: SimTime, step: u64) -> Edge {
        self.left -= 1;
        self.changed_in = Some(step);
        self.phase = Phase::Active { since, until };
        Edge::Started
    }

    fn cease(&mut self, since: SimTime, at: SimTime, step: u64) -> Edge {
        self.changed_in = Some(step);
        self.observed.push((since, at));
        self.past = self.past + (at - since);
        self.phase = if self.left > 0 && at < self.window.1 { Phase::Waiting } else { Phase::Over };
        Edge::Ended
    }

    /// How long it has been active until now, which is not before anything it was told of.
    pub fn active_time(&self, now: SimTime) -> SimTime {
        match self.phase {
            Phase::Active { since, .. } => self.past + (now - since),
            _ => self.past,
        }
    }

    /// Observed active intervals in seconds, clipped to a run that ended at `end`. One in which an operation went on and
    /// off at the same moment has no length.
    pub fn intervals(&self, end: SimTime) -> Vec<Span> {
        let open = match self.phase {
            Phase::Active { since, .. } if since < end => Some((since, end)),
            _ => None,
        };
        self.observed
            .iter()
            .copied()
            .chain(open)
            .map(|(from, to)| Span { start: from.seconds(), end: to.min(end).seconds() })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::condition::tests::{above, below, compare, variable};
    use sesame_plan::condition::{Comparison, Operand};

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
                    activity.follow(edge, edge.nanos().unsigned_abs());
                }
                activity.is_active()
            })
            .collect()
    }

    /// Follows time and then weighs a metric's value, at each of these moments.
    fn weighed(activation: &Activation, moments: &[(f64, f64)]) -> (Vec<bool>, Vec<(f64, f64)>) {
        let mut activity = Activity::new(activation, WITHIN);
        let mut active = Vec::new();
        // Edges before a moment are steps of their own, as the relay has them.
        for (step, &(t, x)) in (0..).map(|n| 2 * n + 1).zip(moments) {
            let now = SimTime::from_seconds(t);
            while let Some(edge) = activity.next_edge().filter(|&edge| edge <= now) {
                activity.follow(edge, if edge < now { step - 1 } else { step });
            }
            activity.weigh(now, step, &|_| Some(x));
            active.push(activity.is_active());
        }
        while let Some(edge) = activity.next_edge().filter(|&edge| edge <= SimTime::from_seconds(10.0)) {
            activity.follow(edge, u64::MAX);
        }
        let intervals = activity.intervals(SimTime::from_seconds(10.0));
        (active, intervals.into_iter().map(|span| (span.start, span.end)).collect())
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
        assert_eq!(weighed(&until(5), &high), (vec![false, true, true, false, false], vec![(1.5, 9.0)]));
        assert_eq!(weighed(&lasting(20.0, 5), &high), (vec![false, true, true, false, false], vec![(1.5, 9.0)]));
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
    fn nothing_goes_on_and_off_in_one_step() {
        let always = |by| compare(variable(0), by, Operand::Number(5.0));
        let both = Activation::Condition { start: always(Comparison::Equal), end: always(Comparison::Equal), times: 2 };
        let (active, intervals) = weighed(&both, &[(2.0, 5.0), (3.0, 5.0), (4.0, 5.0), (5.0, 5.0), (6.0, 5.0)]);
        assert_eq!(active, [true, false, true, false, false]);
        assert_eq!(intervals, [(2.0, 3.0), (4.0, 5.0)]);
        // The length is over at 3 s, which is the step at 3 s: the next activation waits for the one after it.
        let (active, intervals) = weighed(&lasting(1.0, 2), &[(2.0, 6.0), (3.0, 6.0), (4.0, 6.0), (5.5, 6.0)]);
        assert_eq!((active, intervals), (vec![true, false, true, false], vec![(2.0, 3.0), (4.0, 5.0)]));
    }

    proptest! {
        #[test]
        fn activity_by_condition_is_that_of_a_plain_model(
            moments in prop::collection::vec((1u32..12, 0u32..8), 0..60),
            times in 1u32..4,
            length in prop::option::of(1u32..40),
        ) {
            let mut time = 0;
            let moments: Vec<(f64, f64)> = moments.iter().map(|&(gap, x)| {
                time += gap;
                (f64::from(time) * 0.125, f64::from(x))
            }).collect();
            let activation = match length {
                Some(length) => lasting(f64::from(length) * 0.125, times),
                None => until(times),
            };
            // Plainly: go through the steps, on if allowed, off if due, one change per step.
            let (mut on, mut spans, mut used) = (None, Vec::new(), 0);
            let due = |on: Option<f64>| on.map(|since| (since + length.map_or(100.0, |n| f64::from(n) * 0.125)).min(9.0));
            for &(t, x) in &moments {
                match (on, due(on)) {
                    (Some(since), Some(due)) if due <= t => {
                        spans.push((since, due));
                        on = None;
                        if due == t {
                            continue;
                        }
                    }
                    _ => {}
                }
                if let Some(since) = on {
                    if length.is_none() && x < 3.0 {
                        spans.push((since, t));
                        on = None;
                    }
                } else if x > 5.0 && used < times && (1.0..9.0).contains(&t) {
                    used += 1;
                    on = Some(t);
                }
            }
            spans.extend(on.zip(due(on)));
            let (_, intervals) = weighed(&activation, &moments);
            prop_assert_eq!(intervals, spans);
        }
    }
}
