//! When an operation of a test is active.

use sesame_plan::{Activation, Span};

use crate::time::SimTime;

/// The activity of one operation in one run: whether it is on now, and when it was.
#[derive(Debug, Clone)]
pub struct Activity {
    window: (SimTime, SimTime),
    phase: Phase,
    observed: Vec<(SimTime, SimTime)>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    Before,
    Active { since: SimTime },
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
    /// An activity that has not begun. `within` is a hard limit: outside of it the operation is never active.
    pub fn new(activation: Activation, within: Span) -> Self {
        let Activation::Time { start, end } = activation;
        let window = (SimTime::from_seconds(start.max(within.start)), SimTime::from_seconds(end.min(within.end)));
        let phase = if window.0 < window.1 { Phase::Before } else { Phase::Over };
        Activity { window, phase, observed: Vec::new() }
    }

    /// Whether it is on.
    pub fn is_active(&self) -> bool {
        matches!(self.phase, Phase::Active { .. })
    }

    /// When it will next go on or off, as far as is known.
    pub fn next_edge(&self) -> Option<SimTime> {
        match self.phase {
            Phase::Before => Some(self.window.0),
            Phase::Active { .. } => Some(self.window.1),
            Phase::Over => None,
        }
    }

    /// Follows time, which never goes back and stops at each edge: it is active for `start <= t < end`.
    pub fn follow(&mut self, now: SimTime) -> Edge {
        let (start, end) = self.window;
        match self.phase {
            Phase::Before if now >= start => {
                self.phase = Phase::Active { since: start };
                Edge::Started
            }
            Phase::Active { since } if now >= end => {
                self.observed.push((since, end));
                self.phase = Phase::Over;
                Edge::Ended
            }
            _ => Edge::None,
        }
    }

    /// Observed active intervals in seconds, clipped to a run that ended at `end`.
    pub fn intervals(&self, end: SimTime) -> Vec<Span> {
        let open = match self.phase {
            Phase::Active { since } if since < end => Some((since, end)),
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
    use super::*;

    fn activity(start: f64, end: f64) -> Activity {
        Activity::new(Activation::Time { start, end }, Span { start: 1.0, end: 9.0 })
    }

    fn run(activity: &mut Activity, times: &[f64]) -> Vec<bool> {
        times
            .iter()
            .map(|&t| {
                let now = SimTime::from_seconds(t);
                while let Some(edge) = activity.next_edge().filter(|&edge| edge <= now) {
                    activity.follow(edge);
                }
                activity.is_active()
            })
            .collect()
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
    }

    #[test]
    fn an_interval_still_open_ends_with_the_run() {
        let mut window = activity(2.0, 8.0);
        run(&mut window, &[0.0, 2.5]);
        assert_eq!(window.intervals(SimTime::from_seconds(4.0)), [Span { start: 2.0, end: 4.0 }]);
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
}
