//! Delays at which the order of two things may change: differences of two lists of times, in order, without a list of
//! them all.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use sesame_base::time::SimTime;

/// Differences between times that are delayed and times that are not, and the nanoseconds after them.
pub(super) struct Critical {
    late: Vec<SimTime>,
    in_time: Vec<SimTime>,
    /// Per time that is delayed: the next difference, its position, and the position of the other time.
    next: BinaryHeap<Reverse<(SimTime, usize, usize)>>,
    /// The nanosecond after the last difference, until it was looked at.
    between: Option<SimTime>,
}

impl Critical {
    pub(super) fn new(mut late: Vec<SimTime>, mut in_time: Vec<SimTime>) -> Self {
        for times in [&mut late, &mut in_time] {
            times.sort_unstable();
            times.dedup();
        }
        let mut critical = Critical { late, in_time, next: BinaryHeap::new(), between: None };
        for at in 0..critical.late.len() {
            let other = critical.in_time.partition_point(|&time| time < critical.late[at]);
            critical.push(at, other);
        }
        critical
    }

    fn push(&mut self, late: usize, in_time: usize) {
        if let Some(&time) = self.in_time.get(in_time) {
            self.next.push(Reverse((time - self.late[late], late, in_time)));
        }
    }

    /// The next delay to look at, after this one, which must not fall.
    pub(super) fn after(&mut self, delay: SimTime) -> Option<SimTime> {
        loop {
            let difference = self.next.peek().map(|Reverse((difference, ..))| *difference);
            match (self.between, difference) {
                (Some(between), _) if between <= delay => self.between = None,
                (Some(between), Some(difference)) if between < difference => return self.between.take(),
                (Some(_), None) => return self.between.take(),
                (_, Some(difference)) => {
                    let Reverse((_, late, in_time)) = self.next.pop()?;
                    self.push(late, in_time + 1);
                    self.between = Some(difference + SimTime::from_nanos(1));
                    if difference > delay {
                        return Some(difference);
                    }
                }
                (None, None) => return None,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn all_differences_and_what_follows_them_come_in_order(
            late in prop::collection::vec(0..30_i64, 0..6),
            in_time in prop::collection::vec(0..30_i64, 0..6),
        ) {
            let mut expected: Vec<i64> = late.iter()
                .flat_map(|a| in_time.iter().map(move |b| b - a))
                .filter(|difference| *difference >= 0)
                .flat_map(|difference| [difference, difference + 1])
                .filter(|&delay| delay > 1)
                .collect();
            expected.sort_unstable();
            expected.dedup();
            let times = |of: Vec<i64>| of.into_iter().map(SimTime::from_nanos).collect();
            let mut critical = Critical::new(times(late), times(in_time));
            let mut found = Vec::new();
            let mut at = SimTime::from_nanos(1);
            while let Some(next) = critical.after(at) {
                found.push(next.nanos());
                at = next;
            }
            prop_assert_eq!(found, expected);
        }
    }
}
