//! Two sequences of decisions compared: those of one test in simulation and in a lab, say. First whether they are the
//! same, then how far their times are apart.

use sesame_base::time::SimTime;
use sesame_plan::MonitorId;

use crate::network::{Decision, State};

/// Something has a new state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Step<S> {
    /// When.
    pub at: SimTime,
    /// The state: that of a monitor, or the value of evidence.
    pub state: S,
}

/// The decisions of one monitor.
pub fn steps(decisions: &[Decision], monitor: MonitorId) -> Vec<Step<State>> {
    let own = decisions.iter().filter(|decision| decision.monitor == monitor);
    own.map(|decision| Step { at: decision.at, state: decision.state }).collect()
}

/// How two sequences differ.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Comparison<S> {
    /// The first position at which the states differ, or one sequence has ended; `None` if the sequences are the same,
    /// whatever their times.
    pub difference: Option<Difference<S>>,
    /// For each position before that: by how much the second is later than the first; negative if it is earlier.
    pub shifts: Vec<SimTime>,
}

/// Where two sequences first differ.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Difference<S> {
    /// The position in both.
    pub position: usize,
    /// What the first has there, if it has not ended.
    pub first: Option<Step<S>>,
    /// What the second has there, if it has not ended.
    pub second: Option<Step<S>>,
}

impl<S> Comparison<S> {
    /// Whether both have the same states in the same order.
    pub fn is_same(&self) -> bool {
        self.difference.is_none()
    }

    /// The position with the greatest shift in either direction, the first of these; and the shift.
    pub fn greatest_shift(&self) -> Option<(usize, SimTime)> {
        let shifts = self.shifts.iter().copied().enumerate();
        shifts.reduce(|a, b| if b.1.nanos().unsigned_abs() > a.1.nanos().unsigned_abs() { b } else { a })
    }
}

/// Compares two sequences, each in the order of time.
pub fn compare<S: PartialEq + Clone>(first: &[Step<S>], second: &[Step<S>]) -> Comparison<S> {
    let same = first.iter().zip(second).take_while(|(a, b)| a.state == b.state).count();
    let differ = same < first.len() || same < second.len();
    Comparison {
        difference: differ.then(|| Difference {
            position: same,
            first: first.get(same).cloned(),
            second: second.get(same).cloned(),
        }),
        shifts: first.iter().zip(second).take(same).map(|(a, b)| b.at - a.at).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn steps(of: &[(i64, char)]) -> Vec<Step<char>> {
        of.iter().map(|&(at, state)| Step { at: SimTime::from_nanos(at), state }).collect()
    }

    #[test]
    fn sequences_are_the_same_at_other_times() {
        let one = steps(&[(0, 's'), (10, 'g'), (20, 's')]);
        let other = steps(&[(0, 's'), (15, 'g'), (13, 's')]);
        let found = compare(&one, &other);
        assert!(found.is_same());
        assert_eq!(found.shifts.iter().map(|shift| shift.nanos()).collect::<Vec<_>>(), [0, 5, -7]);
        assert_eq!(found.greatest_shift(), Some((2, SimTime::from_nanos(-7))));
    }

    #[test]
    fn the_first_difference_is_where_states_differ_or_one_has_ended() {
        let one = steps(&[(0, 's'), (10, 'g'), (20, 's')]);
        let found = compare(&one, &steps(&[(0, 's'), (12, 'f')]));
        let difference = found.difference.unwrap();
        assert_eq!((difference.position, difference.second.unwrap().state, found.shifts.len()), (1, 'f', 1));
        let difference = compare(&one[..2], &one).difference.unwrap();
        assert_eq!((difference.position, difference.first, difference.second), (2, None, Some(one[2])));
    }
}
