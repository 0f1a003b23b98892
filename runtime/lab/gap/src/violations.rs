//! False alarms and misses: events that occur in one of simulation and lab only.
//!
//! An event is the violation of a requirement, or what an interlocked metric records: where a safety system of the lab
//! ends what the simulation lets happen, values differ by design, and only whether the event occurred is comparable.
//! A run may be inconclusive, so whether an event occurred has three values.

use crate::proportion::{Share, fisher};

/// Whether an event occurred.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Occurrence {
    /// It did.
    Seen,
    /// It did not.
    Absent,
    /// The run, or every run, is inconclusive.
    Inconclusive,
}

/// In how many runs of one test, on one side, an event occurred.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Occurrences {
    /// Runs in which it did.
    pub seen: usize,
    /// Runs in which it did not.
    pub absent: usize,
    /// Inconclusive runs.
    pub inconclusive: usize,
}

impl Occurrences {
    /// Counts runs.
    pub fn of(runs: impl IntoIterator<Item = Occurrence>) -> Occurrences {
        let mut counts = Occurrences::default();
        for run in runs {
            match run {
                Occurrence::Seen => counts.seen += 1,
                Occurrence::Absent => counts.absent += 1,
                Occurrence::Inconclusive => counts.inconclusive += 1,
            }
        }
        counts
    }

    /// What is known of the test: the event occurs if it was seen in any run, and does not if some run was without it
    /// and none with it. That is the rule for verdicts of tests that were run again.
    pub fn occurrence(self) -> Occurrence {
        match self {
            Occurrences { seen: 1.., .. } => Occurrence::Seen,
            Occurrences { absent: 1.., .. } => Occurrence::Absent,
            _ => Occurrence::Inconclusive,
        }
    }

    /// The share of conclusive runs in which it occurred; `None` if there are none.
    pub fn share(self) -> Option<Share> {
        Share::new(self.seen, self.seen + self.absent)
    }
}

/// How often an event of one test occurs in the simulation and in the lab.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frequencies {
    /// In the simulation's conclusive runs.
    pub simulation: Option<Share>,
    /// In the lab's conclusive runs.
    pub lab: Option<Share>,
    /// The p value of Fisher's exact test that both probabilities are equal; `None` if a side has no conclusive run.
    pub p: Option<f64>,
}

/// Compares the two sides of one test.
pub fn frequencies(simulation: Occurrences, lab: Occurrences) -> Frequencies {
    let (simulation, lab) = (simulation.share(), lab.share());
    let p = simulation.zip(lab).map(|(a, b)| fisher((a.count, a.of), (b.count, b.of)));
    Frequencies { simulation, lab, p }
}

/// How many tests the simulation predicts well: the lab is the truth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Confusion {
    /// Tests in which the event occurs on both sides (true positives).
    pub both: usize,
    /// Tests in which it occurs in the simulation only (false positives).
    pub false_alarms: usize,
    /// Tests in which it occurs in the lab only (false negatives).
    pub misses: usize,
    /// Tests in which it occurs on neither side (true negatives).
    pub neither: usize,
    /// Tests of which one side is inconclusive: these are in none of the above.
    pub inconclusive: usize,
}

impl Confusion {
    /// Counts tests, each with its simulation and its lab.
    pub fn of(tests: impl IntoIterator<Item = (Occurrences, Occurrences)>) -> Confusion {
        let mut counts = Confusion::default();
        for (simulation, lab) in tests {
            let count = match (simulation.occurrence(), lab.occurrence()) {
                (Occurrence::Inconclusive, _) | (_, Occurrence::Inconclusive) => &mut counts.inconclusive,
                (Occurrence::Seen, Occurrence::Seen) => &mut counts.both,
                (Occurrence::Seen, Occurrence::Absent) => &mut counts.false_alarms,
                (Occurrence::Absent, Occurrence::Seen) => &mut counts.misses,
                (Occurrence::Absent, Occurrence::Absent) => &mut counts.neither,
            };
            *count += 1;
        }
        counts
    }

    /// How many tests with the event in the simulation have it in the lab too.
    pub fn precision(self) -> Option<Share> {
        Share::new(self.both, self.both + self.false_alarms)
    }

    /// How many tests with the event in the lab have it in the simulation too.
    pub fn recall(self) -> Option<Share> {
        Share::new(self.both, self.both + self.misses)
    }

    /// How many conclusive tests have the same answer on both sides.
    pub fn agreement(self) -> Option<Share> {
        let same = self.both + self.neither;
        Share::new(same, same + self.false_alarms + self.misses)
    }
}

#[cfg(test)]
mod tests {
    use sesame_rng::Stream;

    use super::*;

    fn counts(seen: usize, absent: usize, inconclusive: usize) -> Occurrences {
        Occurrences { seen, absent, inconclusive }
    }

    #[test]
    fn tests_are_counted_by_what_both_sides_show() {
        let tests = [
            (counts(3, 0, 0), counts(1, 2, 0)),
            (counts(1, 0, 2), counts(0, 3, 0)),
            (counts(2, 1, 0), counts(4, 0, 0)),
            (counts(0, 1, 1), counts(2, 0, 0)),
            (counts(0, 3, 0), counts(0, 1, 0)),
            (counts(0, 0, 3), counts(2, 0, 0)),
            (counts(1, 0, 0), counts(0, 0, 0)),
        ];
        let confusion = Confusion::of(tests);
        assert_eq!(confusion, Confusion { both: 2, false_alarms: 1, misses: 1, neither: 1, inconclusive: 2 });
        let [precision, recall] = [confusion.precision(), confusion.recall()].map(Option::unwrap);
        assert_eq!((precision.count, precision.of, recall.count, recall.of), (2, 3, 2, 3));
        assert_eq!(confusion.agreement().unwrap().value(), 0.6);
        let swapped = Confusion::of(tests.map(|(simulation, lab)| (lab, simulation)));
        assert_eq!(swapped, Confusion { false_alarms: confusion.misses, misses: confusion.false_alarms, ..confusion });
        assert_eq!(Confusion::default().recall(), None);
    }

    #[test]
    fn inconclusive_runs_are_no_part_of_a_frequency() {
        let runs = [Occurrence::Seen, Occurrence::Inconclusive, Occurrence::Absent, Occurrence::Absent];
        let of = frequencies(Occurrences::of(runs), counts(0, 0, 4));
        assert_eq!((of.simulation.unwrap().count, of.simulation.unwrap().of), (1, 3));
        assert_eq!((of.lab, of.p), (None, None));
        assert!((frequencies(counts(4, 0, 1), counts(0, 4, 0)).p.unwrap() - 2.0 / 70.0).abs() < 1e-12);
    }

    #[test]
    fn equal_probabilities_are_rarely_told_apart() {
        let wrong = (0..1000)
            .filter(|&seed| {
                let mut stream = Stream::derive(seed, "fisher", &[]);
                let mut runs = |count: usize| {
                    let seen = (0..count).filter(|_| stream.chance(0.4)).count();
                    counts(seen, count - seen, 0)
                };
                frequencies(runs(20), runs(12)).p.unwrap() <= 0.05
            })
            .count();
        assert!(wrong <= 50, "{wrong}: an exact test errs in at most 5 %");
    }
}
