//! A front of confirmed tests only, where a simulator does not always do the same.
//!
//! The best of many noisy runs is mostly one that was lucky, and a front keeps the lucky ones. So a test that a
//! generation would put on the front is run again, with fresh seeds of the simulator, and is from then on what those
//! runs say; the run that selected it is left out. A test that was only lucky leaves the front by that, those that it
//! had pushed out come back, and who is new among them is confirmed in turn, until every test on the front is
//! confirmed.
//!
//! Tests that violate a requirement can be confirmed too, wherever they lie: that changes what is known of them, and so
//! perhaps the front, by the same rule.
//!
//! Each test is confirmed once, so that this ends. Only tests of the latest generation ever are: what an earlier one
//! left behind is dominated by a confirmed test of the front, whose values change no more.

use std::collections::BTreeMap;

use sesame_optimise::dominance::{Fitness, Unfit};
use sesame_optimise::front::Front;
use sesame_plan::Statistic;

use sesame_optimise::falsify::Margin;

/// The front of a campaign that confirms its tests.
#[derive(Debug, Clone, Default)]
pub struct ConfirmedFront {
    /// The front of all generations before the latest; every test on it is confirmed.
    settled: Front,
    /// What the repetitions of each confirmed test say, by its number.
    confirmed: BTreeMap<u32, Fitness>,
    generation: Vec<GenerationTest>,
}

/// A test of the latest generation.
#[derive(Debug, Clone)]
pub struct GenerationTest {
    /// Its number.
    pub number: u32,
    /// The test whose result stands for it; itself unless it is a duplicate.
    pub stands_for: u32,
    /// The fitness of its first run.
    pub first: Fitness,
    /// Whether it is confirmed wherever it lies, since its first run violates a requirement and that was asked for.
    pub violates: bool,
}

impl ConfirmedFront {
    /// Takes the tests of the next generation.
    pub fn begin(&mut self, generation: impl IntoIterator<Item = GenerationTest>) {
        self.settled = self.front();
        self.generation = generation.into_iter().collect();
    }

    /// The front, by what is known of each test by now.
    pub fn front(&self) -> Front {
        let mut front = self.settled.clone();
        for test in &self.generation {
            front.add(test.number, self.judged(test));
        }
        front
    }

    /// The tests that are to be confirmed and are not: those on the front, and those that are wherever they lie. By
    /// number; none once the generation is settled. A campaign without objectives has no front.
    pub fn unconfirmed(&self) -> Vec<u32> {
        let front = self.front();
        let is_on_front = |test: &GenerationTest| {
            front.members().iter().any(|member| member.number == test.number && !member.objectives.is_empty())
        };
        let unsure = |test: &&GenerationTest| {
            !self.confirmed.contains_key(&test.stands_for)
                && (is_on_front(test) || test.violates && test.number == test.stands_for)
        };
        self.generation.iter().filter(unsure).map(|test| test.number).collect()
    }

    /// Takes what the repetitions of a test say.
    pub fn confirm(&mut self, number: u32, fitness: Fitness) {
        self.confirmed.insert(number, fitness);
    }

    /// What is known of each test of the latest generation, in its order.
    pub fn fitness(&self) -> impl Iterator<Item = &Fitness> {
        self.generation.iter().map(|test| self.judged(test))
    }

    fn judged<'a>(&'a self, test: &'a GenerationTest) -> &'a Fitness {
        self.confirmed.get(&test.stands_for).unwrap_or(&test.first)
    }
}

/// One fitness for several runs of a test, each objective for itself.
///
/// A run without objective values (a crash, a timeout, one in which no operation had any effect) reaches nothing: in a
/// median and a quantile it stands behind all others. A mean is that of the runs that have values, if these are more
/// than half of all. Where nothing is left, the test is as unfit as the first of the runs that are.
pub fn aggregate(runs: &[Fitness], by: Statistic) -> Fitness {
    let measured: Vec<&[f64]> = runs.iter().filter_map(Fitness::objectives).collect();
    let unfit = || {
        let why = runs.iter().find(|run| run.objectives().is_none());
        why.cloned().unwrap_or(Fitness::Unfit(Unfit::Unmeasured))
    };
    let Some(objectives) = measured.first().map(|values| values.len()) else { return unfit() };
    // Smaller is better, so the best come first.
    let sorted = |objective: usize| {
        let mut values: Vec<f64> = measured.iter().map(|run| run[objective]).collect();
        values.sort_by(f64::total_cmp);
        values
    };
    let at = |rank: usize, objective: usize| sorted(objective).get(rank).copied();
    let value = |objective: usize| match by {
        Statistic::Mean if 2 * measured.len() <= runs.len() => None,
        Statistic::Mean => {
            let sum: f64 = measured.iter().map(|run| run[objective]).sum();
            Some(sum / measured.len() as f64)
        }
        Statistic::Median => {
            let [lower, upper] = [(runs.len() - 1) / 2, runs.len() / 2].map(|rank| at(rank, objective));
            Some(f64::midpoint(lower?, upper?))
        }
        Statistic::Quantile { share } => at(reached_by(share, runs.len()) - 1, objective),
    };
    let values: Option<Vec<f64>> =
        (0..objectives).map(|objective| value(objective).filter(|number| !number.is_nan())).collect();
    values.map_or_else(unfit, Fitness::Measured)
}

/// One margin for several runs of a test: aggregated like an objective that is minimised, so a quantile is the
/// margin that this share of the runs reach or go below. It counts as a violation if such a run violates.
pub(crate) fn aggregate_margin(runs: &[Margin], by: Statistic) -> Margin {
    let value =
        |run: &Margin| run.value.map_or(Fitness::Unfit(Unfit::Unmeasured), |number| Fitness::Measured(vec![number]));
    let values: Vec<Fitness> = runs.iter().map(value).collect();
    let value = aggregate(&values, by).objectives().map(|values| values[0]);
    // On the edge itself a bound decides, and so the runs that are there know.
    let on_edge = |value: f64| value == 0.0 && runs.iter().any(|run| run.value == Some(0.0) && run.violated);
    Margin { value, violated: value.is_some_and(|margin| margin < 0.0 || on_edge(margin)) }
}

/// The least number of runs that are at least this share of all; 1 or more.
fn reached_by(share: f64, runs: usize) -> usize {
    // A share such as 0.55 is not a binary fraction: 55 of 100 are 55 %.
    const SLACK: f64 = 1e-9;
    (1..runs).find(|&count| count as f64 >= share * runs as f64 - SLACK).unwrap_or(runs)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use sesame_optimise::dominance::dominates;

    use super::*;

    fn measured(values: &[f64]) -> Fitness {
        Fitness::Measured(values.to_vec())
    }

    /// A test that violates nothing.
    fn judged((number, stands_for, first): (u32, u32, Fitness)) -> GenerationTest {
        GenerationTest { number, stands_for, first, violates: false }
    }

    /// Confirms by what a landscape says until the front is settled; how many tests that took.
    fn settle(confirming: &mut ConfirmedFront, truth: impl Fn(u32) -> Fitness) -> usize {
        let mut count = 0;
        loop {
            let wanted = confirming.unconfirmed();
            if wanted.is_empty() {
                return count;
            }
            for number in wanted {
                confirming.confirm(number, truth(number));
                count += 1;
            }
        }
    }

    #[test]
    fn a_lucky_outlier_does_not_collapse_the_front() {
        // Ten honest tests on a line, and one that was lucky in both objectives.
        let truth = |number: u32| match number {
            11 => measured(&[20.0, 20.0]),
            n => measured(&[f64::from(n), 10.0 - f64::from(n)]),
        };
        let honest: Vec<u32> = (0..=10).collect();
        let generation = |tests: &[u32]| {
            let first = |&n: &u32| (n, n, if n == 11 { measured(&[-1.0, -1.0]) } else { truth(n) });
            tests.iter().map(first).collect::<Vec<_>>()
        };

        let mut believing = Front::default();
        for (number, _, fitness) in generation(&(0..=11).collect::<Vec<_>>()) {
            believing.add(number, &fitness);
        }
        assert_eq!(believing.numbers(), [11], "without confirmation, the front has one test");

        // In the same generation, and in a later one.
        let mut together = ConfirmedFront::default();
        together.begin(generation(&(0..=11).collect::<Vec<_>>()).into_iter().map(judged));
        assert_eq!(together.unconfirmed(), [11]);
        assert_eq!(settle(&mut together, truth), 12, "those that it hid are confirmed in turn");
        assert_eq!(together.front().numbers(), honest);

        let mut later = ConfirmedFront::default();
        later.begin(generation(&honest).into_iter().map(judged));
        assert_eq!(settle(&mut later, truth), 11);
        later.begin(generation(&[11]).into_iter().map(judged));
        assert_eq!(settle(&mut later, truth), 1, "the others are confirmed already");
        assert_eq!(later.front().numbers(), honest);
        assert_eq!(later.fitness().collect::<Vec<_>>(), [&measured(&[20.0, 20.0])]);
    }

    #[test]
    fn tests_that_violate_are_confirmed_wherever_they_lie_and_may_enter_the_front() {
        let violating = |number, first| GenerationTest { violates: true, ..judged((number, number, first)) };
        let mut confirming = ConfirmedFront::default();
        let unfit = Fitness::Unfit(Unfit::Crash);
        confirming.begin([judged((1, 1, measured(&[1.0]))), violating(2, measured(&[3.0])), violating(3, unfit)]);
        assert_eq!(confirming.unconfirmed(), [1, 2, 3]);
        for (number, value) in [(1, 1.0), (2, 4.0), (3, 0.5)] {
            confirming.confirm(number, measured(&[value]));
        }
        assert_eq!(confirming.unconfirmed(), [0; 0]);
        assert_eq!(confirming.front().numbers(), [3]);
        // A duplicate costs no runs: its original is confirmed.
        confirming.begin([GenerationTest { stands_for: 2, ..violating(4, measured(&[3.0])) }]);
        assert_eq!(confirming.unconfirmed(), [0; 0]);
    }

    #[test]
    fn without_objectives_only_violations_are_confirmed() {
        let mut confirming = ConfirmedFront::default();
        let violating = GenerationTest { violates: true, ..judged((2, 2, measured(&[]))) };
        confirming.begin([judged((1, 1, measured(&[]))), violating]);
        assert_eq!(confirming.unconfirmed(), [2]);
    }

    #[test]
    fn a_lucky_margin_gives_way_to_that_of_the_fresh_runs() {
        let kept = |value: f64| Margin { value: Some(value), violated: false };
        let broken = |value: f64| Margin { value: Some(value), violated: true };
        let silent = Margin { value: None, violated: false };
        let runs = [broken(-1.0), kept(3.0), kept(4.0)];
        assert_eq!(aggregate_margin(&runs, Statistic::Mean), kept(2.0));
        assert_eq!(aggregate_margin(&runs, Statistic::Median), kept(3.0));
        assert_eq!(aggregate_margin(&runs, Statistic::Quantile { share: 0.3 }), broken(-1.0));
        assert_eq!(
            aggregate_margin(&runs, Statistic::Quantile { share: 1.0 }),
            kept(4.0),
            "as near as in the worst run"
        );
        assert_eq!(aggregate_margin(&[silent, silent, broken(-1.0)], Statistic::Mean), silent, "too few say anything");
        assert_eq!(aggregate_margin(&[silent, broken(-1.0), broken(-3.0)], Statistic::Mean), broken(-2.0));
        // On the edge the kind of the bound decides.
        assert_eq!(aggregate_margin(&[broken(0.0)], Statistic::Mean), broken(0.0));
        assert_eq!(aggregate_margin(&[kept(0.0)], Statistic::Mean), kept(0.0));
    }

    #[test]
    fn a_duplicate_is_what_its_original_is() {
        let mut confirming = ConfirmedFront::default();
        confirming.begin([(1, 1, measured(&[0.0])), (2, 2, measured(&[3.0])), (3, 1, measured(&[0.0]))].map(judged));
        assert_eq!(confirming.unconfirmed(), [1]);
        confirming.confirm(1, measured(&[5.0]));
        assert_eq!(confirming.unconfirmed(), [2]);
        confirming.confirm(2, measured(&[4.0]));
        assert_eq!(confirming.unconfirmed(), [0u32; 0]);
        confirming.begin([(4, 1, measured(&[0.0]))].map(judged));
        assert_eq!(confirming.unconfirmed(), [0u32; 0], "its first run was not luck");
        assert_eq!((confirming.front().numbers(), confirming.fitness().next()), (vec![2], Some(&measured(&[5.0]))));
    }

    #[test]
    fn a_test_that_does_not_even_run_again_leaves_the_front() {
        let mut confirming = ConfirmedFront::default();
        confirming.begin([(1, 1, measured(&[0.0])), (2, 2, Fitness::Unfit(Unfit::Void))].map(judged));
        assert_eq!(settle(&mut confirming, |_| Fitness::Unfit(Unfit::Crash)), 1);
        assert_eq!(confirming.front().numbers(), [0u32; 0]);
    }

    #[test]
    fn a_quantile_is_reached_by_its_share_of_the_runs() {
        let runs: Vec<Fitness> = [5.0, 1.0, 4.0, 2.0, 3.0].map(|x| measured(&[x])).to_vec();
        let by = |by| aggregate(&runs, by);
        assert_eq!(by(Statistic::Mean), measured(&[3.0]));
        assert_eq!(by(Statistic::Median), measured(&[3.0]));
        // Smaller is better: four of five reach 4, and all reach 5.
        assert_eq!(by(Statistic::Quantile { share: 0.8 }), measured(&[4.0]));
        assert_eq!(by(Statistic::Quantile { share: 0.9 }), measured(&[5.0]));
        assert_eq!(by(Statistic::Quantile { share: 0.01 }), measured(&[1.0]));
        assert_eq!(aggregate(&runs[..4], Statistic::Median), measured(&[3.0]), "between 2 and 4");
        assert_eq!((reached_by(0.55, 100), reached_by(0.9, 10), reached_by(1.0, 7)), (55, 9, 7));
    }

    #[test]
    fn runs_without_values_reach_nothing() {
        let crash = Fitness::Unfit(Unfit::Crash);
        let runs = [measured(&[1.0]), crash.clone(), measured(&[3.0]), Fitness::Unfit(Unfit::Timeout)];
        assert_eq!(aggregate(&runs[..3], Statistic::Mean), measured(&[2.0]));
        assert_eq!(aggregate(&runs, Statistic::Mean), crash, "two of four are not more than half");
        assert_eq!(aggregate(&runs[..3], Statistic::Median), measured(&[3.0]));
        assert_eq!(aggregate(&runs, Statistic::Median), crash);
        assert_eq!(aggregate(&runs, Statistic::Quantile { share: 0.5 }), measured(&[3.0]));
        assert_eq!(aggregate(&runs, Statistic::Quantile { share: 0.75 }), crash);
        assert_eq!(aggregate(&runs[1..2], Statistic::Mean), crash);
    }

    proptest! {
        /// The oracle confirms every test that was ever on a front, and takes the front of all by definition.
        #[test]
        fn the_settled_front_is_that_of_all_tests_by_what_is_known_of_each(
            tests in prop::collection::vec(((0u8..8, 0u8..8), (0u8..8, 0u8..8)), 1..40),
            size in 1usize..9,
        ) {
            let fitness = |(a, b): (u8, u8)| measured(&[f64::from(a), f64::from(b)]);
            let truth = |number: u32| fitness(tests[number as usize].1);
            let mut confirming = ConfirmedFront::default();
            let numbers: Vec<u32> = (0u32..).take(tests.len()).collect();
            let mut confirmations = 0;
            for generation in numbers.chunks(size) {
                confirming.begin(generation.iter().map(|&n| judged((n, n, fitness(tests[n as usize].0)))));
                confirmations += settle(&mut confirming, truth);
            }
            let known = |number: u32| {
                confirming.confirmed.get(&number).cloned().unwrap_or_else(|| fitness(tests[number as usize].0))
            };
            let all: Vec<(u32, Fitness)> = numbers.iter().map(|&number| (number, known(number))).collect();
            let front = Front::from_tests(all.iter().map(|(number, fitness)| (*number, fitness)));
            prop_assert_eq!(confirming.front().numbers(), front.numbers());
            prop_assert!(front.numbers().iter().all(|number| confirming.confirmed.contains_key(number)));
            prop_assert_eq!(confirmations, confirming.confirmed.len(), "each once");
            for (number, fitness) in &all {
                let beaten = all.iter().any(|(_, other)| dominates(other, fitness));
                let stood_for = all.iter().any(|(other, equal)| other < number && equal == fitness);
                prop_assert!(beaten || stood_for || confirming.confirmed.contains_key(number));
            }
        }

        #[test]
        fn one_run_is_typical_of_itself_and_every_value_lies_between_the_runs(
            values in prop::collection::vec(-9.0..9.0f64, 1..12),
            share in 0.01..=1.0f64,
        ) {
            let runs: Vec<Fitness> = values.iter().map(|&x| measured(&[x])).collect();
            let (low, high) = values.iter().fold((f64::MAX, f64::MIN), |(low, high), &x| (low.min(x), high.max(x)));
            for by in [Statistic::Mean, Statistic::Median, Statistic::Quantile { share }] {
                let Fitness::Measured(found) = aggregate(&runs, by) else { panic!("all are measured") };
                prop_assert!(found[0] >= low - 1e-12 && found[0] <= high + 1e-12);
                if values.len() == 1 {
                    prop_assert_eq!(found[0], values[0]);
                }
                if let Statistic::Quantile { share } = by {
                    let reach = values.iter().filter(|&&x| x <= found[0]).count() as f64;
                    prop_assert!(reach >= share * values.len() as f64 - 1e-9);
                    let better = values.iter().filter(|&&x| x < found[0]).count() as f64;
                    prop_assert!(better < share * values.len() as f64);
                }
            }
        }
    }
}
