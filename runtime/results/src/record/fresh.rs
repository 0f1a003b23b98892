//! What a test says once it was run again with fresh seeds of the simulator.
//!
//! This is the one place that decides it, for requirements as for crashes and timeouts. The fresh runs count, the run that
//! selected the test does not: it was chosen for what it showed. A fresh run that says nothing is neither for nor against.

use serde::Serialize;

use crate::record::Verdict;

/// What the fresh runs of one test say about one requirement.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Tally {
    /// Runs that violate it.
    pub violated: usize,
    /// Runs that keep it.
    pub satisfied: usize,
    /// Runs that say nothing about it.
    pub inconclusive: usize,
}

/// Whether a finding is to be believed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Standing {
    /// Every fresh run that says anything shows it.
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
    /// Counts what runs say.
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

    /// Runs that say anything.
    pub fn conclusive(self) -> usize {
        self.violated + self.satisfied
    }

    /// What the test says, whose first run said this.
    ///
    /// It violates the requirement if a fresh run does, and keeps it if fresh runs say something and none violates it.
    /// Where no fresh run says anything, a violation by the first run stands, since nothing speaks against it, but that the
    /// first run satisfied it is not enough. A test that was never run again says what its one run said.
    pub fn verdict(self, first: Verdict) -> Verdict {
        match self {
            Tally { violated: 1.., .. } => Verdict::Violated,
            Tally { satisfied: 1.., .. } => Verdict::Satisfied,
            Tally { inconclusive: 1.., .. } if first == Verdict::Satisfied => Verdict::Inconclusive,
            _ => first,
        }
    }

    /// Whether the violation is to be believed; `None` where there is none, and where no fresh run says anything.
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
    fn a_requirement_that_only_the_first_run_kept_is_violated() {
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
    fn runs_that_say_nothing_are_neither_for_nor_against() {
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
        /// The oracle goes by the sentences of the documentation, one after the other.
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
