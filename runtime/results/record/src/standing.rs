//! The verdict of a test that was run again with fresh seeds of the simulator.
//!
//! This is the only place that decides it, for requirements as for crashes and timeouts. Only fresh runs count: the run
//! that selected the test was chosen for what it showed. An inconclusive fresh run speaks neither for nor against a
//! finding.

use serde::Serialize;

use crate::Verdict;

/// How many fresh runs of a test gave each verdict on a requirement.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Tally {
    /// Runs that violate it.
    pub violated: usize,
    /// Runs that satisfy it.
    pub satisfied: usize,
    /// Runs that are inconclusive.
    pub inconclusive: usize,
}

/// Whether fresh runs confirm a finding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Standing {
    /// Every conclusive fresh run shows it.
    Confirmed,
    /// Some show it, some do not.
    Flaky,
    /// The first run showed it, and no fresh one does.
    NotConfirmed,
}

impl Standing {
    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Standing::Confirmed => "confirmed",
            Standing::Flaky => "flaky",
            Standing::NotConfirmed => "not confirmed",
        }
    }
}

impl Tally {
    /// Counts the verdicts of runs.
    pub fn of(runs: impl IntoIterator<Item = Verdict>) -> Tally {
        let mut tally = Tally::default();
        for said in runs {
            match said {
                Verdict::Violated => tally.violated += 1,
                Verdict::Satisfied => tally.satisfied += 1,
                Verdict::Inconclusive => tally.inconclusive += 1,
            }
        }
        tally
    }

    /// Runs that violate or satisfy the requirement.
    pub fn conclusive(self) -> usize {
        self.violated + self.satisfied
    }

    /// The verdict of the test, given that of its first run.
    ///
    /// It violates the requirement if a fresh run does, and satisfies it if some fresh run satisfies it and none
    /// violates it. If all fresh runs are inconclusive, a violation by the first run stands, since nothing speaks
    /// against it, but a satisfied requirement becomes inconclusive. A test that was never run again has the verdict of
    /// its only run.
    pub fn verdict(self, first: Verdict) -> Verdict {
        match self {
            Tally { violated: 1.., .. } => Verdict::Violated,
            Tally { satisfied: 1.., .. } => Verdict::Satisfied,
            Tally { inconclusive: 1.., .. } if first == Verdict::Satisfied => Verdict::Inconclusive,
            _ => first,
        }
    }

    /// Whether fresh runs confirm the violation; `None` without a violation, and if all fresh runs are inconclusive.
    pub fn standing(self, first: Verdict) -> Option<Standing> {
        match self {
            Tally { violated: 1.., satisfied: 0, .. } => Some(Standing::Confirmed),
            Tally { violated: 1.., .. } => Some(Standing::Flaky),
            Tally { satisfied: 1.., .. } if first == Verdict::Violated => Some(Standing::NotConfirmed),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use Verdict::{Inconclusive, Satisfied, Violated};
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_requirement_that_only_the_first_run_satisfied_is_violated() {
        let tally = Tally::of([Violated; 4]);
        assert_eq!((tally.verdict(Satisfied), tally.standing(Satisfied)), (Violated, Some(Standing::Confirmed)));
        let tally = Tally::of([Satisfied, Violated, Satisfied, Violated]);
        assert_eq!((tally.verdict(Satisfied), tally.standing(Satisfied)), (Violated, Some(Standing::Flaky)));
    }

    #[test]
    fn a_violation_that_no_fresh_run_shows_is_none() {
        let tally = Tally::of([Satisfied, Inconclusive, Satisfied]);
        assert_eq!((tally.verdict(Violated), tally.standing(Violated)), (Satisfied, Some(Standing::NotConfirmed)));
    }

    #[test]
    fn inconclusive_runs_speak_neither_for_nor_against() {
        let tally = Tally::of([Violated, Inconclusive, Inconclusive]);
        assert_eq!((tally.conclusive(), tally.standing(Violated)), (1, Some(Standing::Confirmed)));
        let nothing = Tally::of([Inconclusive; 3]);
        assert_eq!((nothing.verdict(Violated), nothing.standing(Violated)), (Violated, None));
        assert_eq!(nothing.verdict(Satisfied), Inconclusive, "one lucky run is not enough where all others broke off");
    }

    fn said() -> impl Strategy<Value = Verdict> {
        prop::sample::select(vec![Satisfied, Violated, Inconclusive])
    }

    proptest! {
        /// The oracle follows the sentences of the documentation, one after the other.
        #[test]
        fn the_rule_is_that_of_a_naive_recount(first in said(), runs in prop::collection::vec(said(), 0..8)) {
            let any = |wanted: Verdict| runs.contains(&wanted);
            let verdict = if runs.is_empty() {
                first
            } else if any(Violated) {
                Violated
            } else if any(Satisfied) {
                Satisfied
            } else if first == Violated {
                Violated
            } else {
                Inconclusive
            };
            let standing = if any(Violated) && any(Satisfied) {
                Some(Standing::Flaky)
            } else if any(Violated) {
                Some(Standing::Confirmed)
            } else if any(Satisfied) && first == Violated {
                Some(Standing::NotConfirmed)
            } else {
                None
            };
            let tally = Tally::of(runs.iter().copied());
            prop_assert_eq!(tally.verdict(first), verdict);
            prop_assert_eq!(tally.standing(first), standing);
            prop_assert_eq!(tally.conclusive() + tally.inconclusive, runs.len());
        }
    }
}
