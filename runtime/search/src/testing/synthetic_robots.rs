//! A fuzzing campaign that costs nothing to evaluate, on which the search is measured.
//!
//! A robot is vulnerable in a few hidden phases of its cycle, each to a bias of one signal or of two together. A test
//! hits a phase once per 0.2 s in which the signals' biases exceed the phase's thresholds; the bias of a signal is the
//! sum over the active operations on it of the middle of their sub-range. Hits are maximised, active time minimised.

use std::sync::Arc;

use sesame_base::activation::Activity;
use sesame_base::observation::{MetricObservation, Observation, Outcome};
use sesame_base::time::SimTime;
use sesame_optimise::dominance::{Fitness, Unfit};
use sesame_optimise::front::Front;
use sesame_optimise::hypervolume::hypervolume;
use sesame_plan::condition::{ConditionEnd, ConditionSpace, Integers, Variable};
use sesame_plan::testing;
use sesame_plan::{
    Activation, ActivationMode, Bound, Campaign, CampaignPlan, Choice, Copies, Direction, Metric, MetricId,
    MetricSource, Operation, OperationKind, Parameter, Requirement, Search, Span, Test, TestOperation, ValueMode,
};

use crate::sspr::{self, Convention, Point};
use crate::{Evaluated, Strategy};

/// Where and to what the robot is vulnerable.
pub struct Phase {
    start: f64,
    end: f64,
    /// Signals, and the bias that each must exceed, away from zero.
    thresholds: &'static [(usize, f64)],
}

/// One robot.
pub struct SyntheticRobot {
    /// What it is called in messages of tests.
    pub name: &'static str,
    /// How many signals it has, each with an operation of its own.
    pub signals: usize,
    /// Where it is vulnerable.
    pub phases: &'static [Phase],
}

/// Four robots, from one vulnerable to one signal at a time to one with many signals that do nothing.
pub const SYNTHETIC_ROBOTS: [SyntheticRobot; 4] = [
    SyntheticRobot {
        name: "three phases",
        signals: 2,
        phases: &[
            Phase { start: 8.0, end: 14.0, thresholds: &[(0, 0.15)] },
            Phase { start: 30.0, end: 33.0, thresholds: &[(1, 0.2)] },
            Phase { start: 50.0, end: 58.0, thresholds: &[(0, -0.1)] },
        ],
    },
    SyntheticRobot {
        name: "joint bias",
        signals: 2,
        phases: &[
            Phase { start: 12.0, end: 20.0, thresholds: &[(0, 0.1), (1, 0.1)] },
            Phase { start: 40.0, end: 46.0, thresholds: &[(0, -0.05), (1, 0.15)] },
        ],
    },
    SyntheticRobot {
        name: "many signals",
        signals: 6,
        phases: &[
            Phase { start: 5.0, end: 9.0, thresholds: &[(2, 0.1)] },
            Phase { start: 20.0, end: 26.0, thresholds: &[(4, 0.05), (5, 0.05)] },
            Phase { start: 44.0, end: 52.0, thresholds: &[(1, -0.12)] },
        ],
    },
    SyntheticRobot {
        name: "strong bias",
        signals: 2,
        phases: &[
            Phase { start: 15.0, end: 21.0, thresholds: &[(0, 0.26)] },
            Phase { start: 35.0, end: 45.0, thresholds: &[(1, -0.35)] },
        ],
    },
];

/// Active time beyond which a test is worth nothing, in seconds.
const REFERENCE_TIME: f64 = 130.0;

impl SyntheticRobot {
    /// A campaign on this robot: `random offset [-0.3, 0.3] within [0s, 65s]` on each signal, 1 to 5 per test,
    /// which may overlap.
    pub fn plan(&self, search: Search) -> CampaignPlan {
        let offset = || Parameter { unit: Some("rad".to_owned()), ..testing::range("offset", -0.3, 0.3) };
        let jitter = || OperationKind::RandomValue { mode: ValueMode::Offset, integer: false };
        let operation = |k: usize| Operation {
            within: Span { start: 0.0, end: 65.0 },
            ..testing::operation_with(&format!("jitter{k}"), 0, jitter(), vec![offset()])
        };
        let metric = |name: &str, direction| Metric {
            direction: Some(direction),
            ..testing::metric(name, MetricSource::FuzzingTime)
        };
        CampaignPlan {
            source: "landscape.sesame".to_owned(),
            space: "landscape".to_owned(),
            simulator: testing::in_process("robot", "robot::Robot", 20_000_000),
            metrics: vec![metric("fuzzing_time", Direction::Minimise), metric("hits", Direction::Maximise)],
            operations: (0..self.signals).map(operation).collect(),
            campaign: Campaign {
                objectives: vec![MetricId(0), MetricId(1)],
                // As in the paper.
                copies: Copies::MayOverlap,
                search,
                seed: 0,
                end_after: 70.0,
                ..testing::campaign(self.name, self.signals)
            },
            ..testing::minimal()
        }
    }

    /// A requirement on the hits of a test.
    pub fn fewer_hits_than(value: f64) -> Requirement {
        testing::requirement("R1", 1, Bound::Below { value })
    }

    /// The same campaign with operations switched by conditions over where the robot is in its cycle: how far each of
    /// two arms is out (which tells most phases, but none alone), and a count of what it has done.
    pub fn plan_by_condition(&self, search: Search, end: ConditionEnd) -> CampaignPlan {
        let mut plan = self.plan(search);
        for name in ["reach", "turn", "parts"] {
            let signal = Metric { name: name.to_owned(), direction: None, ..plan.metrics[0].clone() };
            plan.metrics.push(signal);
        }
        let variable = |n, high| Variable { metric: MetricId(n), unit: None, low: Some(0.0), high, step: None };
        plan.campaign.activation = ActivationMode::Condition {
            space: ConditionSpace {
                variables: vec![variable(2, Some(20.0)), variable(3, Some(20.0)), variable(4, None)],
                depth: 4,
                integers: Integers { lowest: 1, highest: 20 },
                end,
                times: 1,
            },
        };
        plan
    }

    /// The value of a condition variable at a time.
    fn signal(metric: MetricId, t: f64) -> f64 {
        match metric.0 {
            2 => 10.0 - 10.0 * libm::cos(t / 4.0),
            3 => 10.0 + 10.0 * libm::sin(t / 9.0),
            _ => libm::floor(t / 5.0),
        }
    }

    /// When an operation of a test is active, in seconds.
    fn active(operation: &TestOperation) -> Vec<(f64, f64)> {
        if let Activation::Time { start, end } = operation.activation {
            return vec![(start, end)];
        }
        let mut activity = Activity::new(&operation.activation, Span { start: 0.0, end: 65.0 });
        for slot in 0u32..350 {
            let now = SimTime::from_seconds(f64::from(slot) * 0.2);
            while let Some(edge) = activity.next_edge().filter(|&edge| edge <= now) {
                activity.advance_to(edge);
                activity.evaluate(edge, &|metric| Some(Self::signal(metric, edge.seconds())));
            }
            activity.evaluate(now, &|metric| Some(Self::signal(metric, now.seconds())));
        }
        activity.intervals(SimTime::from_seconds(65.0)).into_iter().map(|span| (span.start, span.end)).collect()
    }

    /// Active time in seconds, and hits.
    pub fn measure(&self, test: &Test) -> (f64, f64) {
        let active: Vec<(usize, f64, f64, f64)> = test
            .operations
            .iter()
            .flat_map(|operation| {
                let Choice::Range { low, high } = operation.parameters[0] else { panic!("offsets are sub-ranges") };
                let active = Self::active(operation).into_iter();
                active.map(move |(start, end)| (operation.operation.index(), start, end, f64::midpoint(low, high)))
            })
            .collect();
        // As the relay sums it: active equally long is equal.
        let length = |&(_, start, end, _): &_| SimTime::from_seconds(end) - SimTime::from_seconds(start);
        let time = active.iter().map(length).fold(SimTime::ZERO, |sum, length| sum + length).seconds();
        let hit = |phase: &Phase, t: f64| {
            phase.thresholds.iter().all(|&(signal, threshold)| {
                let on = active.iter().filter(|(s, start, end, _)| *s == signal && *start <= t && t < *end);
                let bias: f64 = on.map(|(.., bias)| bias).sum();
                if threshold > 0.0 { bias > threshold } else { bias < threshold }
            })
        };
        let slots = (0..350).map(|slot| f64::from(slot) * 0.2);
        let hits = slots.filter(|&t| self.phases.iter().any(|p| p.start <= t && t < p.end && hit(p, t))).count();
        (time, hits as f64)
    }

    /// Where a test lies when it is run.
    pub fn point(plan: &CampaignPlan, test: &Test) -> Option<Point> {
        let disturbances = test.operations.iter().map(|operation| {
            let intervals = Self::active(operation).into_iter().map(|(start, end)| Span { start, end }).collect();
            sspr::disturbance(plan, operation.operation, &operation.parameters, intervals)
        });
        Point::from_disturbances(&disturbances.collect::<Vec<_>>(), Convention::Ours)
    }

    /// What is recorded of a run: nothing that a test does changes what conditions see.
    pub fn without_disturbance(plan: &CampaignPlan) -> Observation {
        let series =
            |metric| (0u32..350).map(|slot| f64::from(slot) * 0.2).map(|t| (t, Self::signal(metric, t))).collect();
        let metrics = (0u32..).map(MetricId).take(plan.metrics.len());
        Observation {
            end: 70.0,
            metrics: metrics.map(|id| MetricObservation::whole(None, false, series(id))).collect(),
            ..Observation::without_run(Outcome::Completed)
        }
    }

    /// The share of the ideal hypervolume (all hits in no time) that the front of a whole campaign reaches.
    pub fn campaign(&self, strategy: &mut dyn Strategy) -> Run {
        self.campaign_of(&self.plan(Search::new(sesame_plan::Strategy::Random, 1)), strategy)
    }

    /// As [`SyntheticRobot::campaign`], of a plan that is by condition perhaps.
    pub fn campaign_of(&self, plan: &CampaignPlan, strategy: &mut dyn Strategy) -> Run {
        let reference = Self::without_disturbance(plan);
        strategy.begin(&reference);
        // Series are the same in all runs, and most of the work.
        let recorded = if strategy.reads_series() { reference } else { reference.without_series() };
        let mut front = Front::default();
        let mut tests = Vec::new();
        loop {
            let batch = strategy.ask();
            if batch.is_empty() {
                break;
            }
            let first = u32::try_from(tests.len()).expect("few tests") + 1;
            let results: Vec<Evaluated> = (first..)
                .zip(batch)
                .map(|(number, candidate)| {
                    let (time, hits) = self.measure(&candidate.test);
                    // As in a real campaign, a disturbance too weak to be noticed has no effect at all.
                    let fitness =
                        if time < 0.05 { Fitness::Unfit(Unfit::Void) } else { Fitness::Measured(vec![time, -hits]) };
                    let point = if time < 0.05 { None } else { Self::point(plan, &candidate.test) };
                    let mut run = recorded.clone();
                    for (metric, value) in run.metrics.iter_mut().zip([time, hits]) {
                        *metric = MetricObservation::whole(Some(value), true, Vec::new());
                    }
                    let fresh_runs = Vec::new();
                    Evaluated { number, test: candidate.test, fitness, point, run: Arc::new(run), fresh_runs }
                })
                .collect();
            for result in &results {
                front.add(result.number, &result.fitness);
            }
            strategy.tell(&results);
            tests.extend(results);
        }
        let most: f64 = self.phases.iter().map(|phase| (phase.end - phase.start) / 0.2).sum();
        let points: Vec<&[f64]> = front.members().iter().map(|member| member.objectives.as_slice()).collect();
        let volume = hypervolume(&points, &[REFERENCE_TIME, 0.0]) / (REFERENCE_TIME * most);
        Run { tests, volume }
    }
}

/// What a whole campaign came to.
pub struct Run {
    /// All tests, in their order.
    pub tests: Vec<Evaluated>,
    /// The hypervolume of their front.
    pub volume: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Candidate, strategy};

    fn nsga2() -> Search {
        Search::new(sesame_plan::Strategy::Nsga2 { population: 10 }, 210)
    }

    fn median_volume(landscape: &SyntheticRobot, search: &Search) -> f64 {
        median_volume_of(landscape, &landscape.plan(search.clone()))
    }

    fn median_volume_of(landscape: &SyntheticRobot, plan: &CampaignPlan) -> f64 {
        let run = |seed| landscape.campaign(strategy(plan, seed).unwrap().as_mut()).volume;
        let mut volumes: Vec<f64> = (1..=10).map(run).collect();
        volumes.sort_by(f64::total_cmp);
        f64::midpoint(volumes[4], volumes[5])
    }

    #[test]
    fn evolution_beats_chance_on_every_landscape() {
        let ratios = SYNTHETIC_ROBOTS.map(|landscape| {
            let random = median_volume(&landscape, &Search::new(sesame_plan::Strategy::Random, 210));
            (landscape.name, median_volume(&landscape, &nsga2()) / random)
        });
        assert!(ratios.iter().all(|(_, ratio)| *ratio > 1.1), "{ratios:?}");
    }

    /// On "joint bias" two signals must be out together: often none of the first ten tests hits anything, and evolution
    /// then has only the active time to go by.
    #[test]
    fn evolution_beats_chance_where_conditions_switch_and_one_signal_is_enough() {
        for landscape in [&SYNTHETIC_ROBOTS[0], &SYNTHETIC_ROBOTS[2], &SYNTHETIC_ROBOTS[3]] {
            let by_condition = |search| landscape.plan_by_condition(search, ConditionEnd::Condition);
            let random = median_volume_of(landscape, &by_condition(Search::new(sesame_plan::Strategy::Random, 210)));
            let evolved = median_volume_of(landscape, &by_condition(nsga2()));
            assert!(evolved > 1.1 * random, "{}: {evolved} and {random}", landscape.name);
        }
    }

    /// The table of docs/search.md.
    #[test]
    #[ignore = "long: 240 searches of 210 tests"]
    fn shares_of_the_ideal_where_conditions_switch() {
        println!("| robot | random | NSGA-II | seeds ahead |\n|---|---:|---:|---:|");
        for landscape in &SYNTHETIC_ROBOTS {
            let volumes = |search: Search| -> Vec<f64> {
                let plan = landscape.plan_by_condition(search, ConditionEnd::Condition);
                (1..=30).map(|seed| landscape.campaign(strategy(&plan, seed).unwrap().as_mut()).volume).collect()
            };
            let median = |volumes: &[f64]| {
                let mut sorted = volumes.to_vec();
                sorted.sort_by(f64::total_cmp);
                f64::midpoint(sorted[14], sorted[15])
            };
            let (random, evolved) = (volumes(Search::new(sesame_plan::Strategy::Random, 210)), volumes(nsga2()));
            let ahead = evolved.iter().zip(&random).filter(|(evolved, random)| evolved > random).count();
            println!("| {} | {:.3} | {:.3} | {ahead} of 30 |", landscape.name, median(&random), median(&evolved));
            assert!(landscape.name == "joint bias" || ahead > 15, "{}: {ahead}", landscape.name);
        }
    }

    #[test]
    fn no_test_is_asked_twice() {
        for landscape in SYNTHETIC_ROBOTS {
            let plan = landscape.plan(nsga2());
            let run = landscape.campaign(strategy(&plan, 5).unwrap().as_mut());
            for (i, result) in run.tests.iter().enumerate() {
                assert!(!run.tests[..i].iter().any(|earlier| earlier.test == result.test), "{}", landscape.name);
            }
        }
    }

    #[test]
    fn the_seed_decides_everything() {
        for plan in
            [SYNTHETIC_ROBOTS[1].plan(nsga2()), SYNTHETIC_ROBOTS[1].plan_by_condition(nsga2(), ConditionEnd::Condition)]
        {
            let run = |seed| SYNTHETIC_ROBOTS[1].campaign(strategy(&plan, seed).unwrap().as_mut()).tests;
            assert_eq!(run(3), run(3));
            assert_ne!(run(3), run(4));
        }
    }

    #[test]
    fn a_resumed_search_goes_on_as_if_never_stopped() {
        let landscape = &SYNTHETIC_ROBOTS[0];
        let plan = landscape.plan(nsga2());
        let whole = landscape.campaign(strategy(&plan, 8).unwrap().as_mut()).tests;
        let mut resumed = strategy(&plan, 8).unwrap();
        for stored in whole.chunks(10).take(7) {
            let asked: Vec<Test> = resumed.ask().into_iter().map(|candidate| candidate.test).collect();
            assert_eq!(asked, stored.iter().map(|result| result.test.clone()).collect::<Vec<_>>());
            resumed.tell(stored);
        }
        let next: Vec<Test> = resumed.ask().into_iter().map(|candidate| candidate.test).collect();
        assert_eq!(next, whole[70..80].iter().map(|result| result.test.clone()).collect::<Vec<_>>());
    }

    /// All generations of a search in which nothing can be measured.
    fn generations(search: Search) -> Vec<Vec<Candidate>> {
        let mut plan = SYNTHETIC_ROBOTS[0].plan(search);
        plan.tests = vec![testing::known_test("known", Test::default())];
        let mut strategy = strategy(&plan, 1).unwrap();
        let mut generations: Vec<Vec<Candidate>> = Vec::new();
        loop {
            let batch = strategy.ask();
            if batch.is_empty() {
                return generations;
            }
            let first = generations.iter().map(Vec::len).sum::<usize>();
            let results: Vec<Evaluated> = (0u32..)
                .skip(first)
                .zip(&batch)
                .map(|(number, candidate)| Evaluated {
                    number,
                    test: candidate.test.clone(),
                    fitness: Fitness::Unfit(Unfit::Unmeasured),
                    point: None,
                    run: crate::testing::no_run(),
                    fresh_runs: Vec::new(),
                })
                .collect();
            strategy.tell(&results);
            generations.push(batch);
        }
    }

    #[test]
    fn exactly_the_evaluations_asked_for_are_made() {
        let sizes = |search| generations(search).iter().map(Vec::len).collect::<Vec<_>>();
        assert_eq!(sizes(Search::new(sesame_plan::Strategy::Nsga2 { population: 7 }, 24)), [7, 7, 7, 3]);
        assert_eq!(sizes(Search::new(sesame_plan::Strategy::Nsga2 { population: 1 }, 3)), [1, 1, 1]);
        assert_eq!(sizes(Search::new(sesame_plan::Strategy::Nsga2 { population: 10 }, 4)), [4]);
        assert_eq!(sizes(Search::new(sesame_plan::Strategy::Nsga2 { population: 10 }, 0)), [0; 0]);
        assert_eq!(sizes(Search::new(sesame_plan::Strategy::Random, 120)), [50, 50, 20]);
        assert_eq!(sizes(Search::Repeat { test: sesame_plan::KnownTestId(0), times: 30 }), [30]);
        assert_eq!(sizes(Search::Repeat { test: sesame_plan::KnownTestId(0), times: 0 }), [0; 0]);
    }

    #[test]
    fn parents_are_earlier_tests_and_generations_are_counted() {
        let generations = generations(Search::new(sesame_plan::Strategy::Nsga2 { population: 6 }, 30));
        let mut earlier = 0;
        for (n, generation) in (0u32..).zip(&generations) {
            for candidate in generation {
                assert_eq!(candidate.generation, n);
                assert_eq!(candidate.parents.is_empty(), n == 0);
                assert!(candidate.parents.len() <= 2 && candidate.parents.iter().all(|&parent| parent < earlier));
            }
            earlier += u32::try_from(generation.len()).unwrap();
        }
    }

    #[test]
    fn the_random_tests_are_those_an_evolution_begins_with() {
        let random = &generations(Search::new(sesame_plan::Strategy::Random, 10))[0];
        let first = &generations(Search::new(sesame_plan::Strategy::Nsga2 { population: 10 }, 20))[0];
        assert_eq!(random, first);
    }

    #[test]
    fn a_population_of_0_is_refused() {
        let plan = SYNTHETIC_ROBOTS[0].plan(Search::new(sesame_plan::Strategy::Nsga2 { population: 0 }, 10));
        let Err(refusal) = strategy(&plan, 1) else { panic!("a population of 0 was accepted") };
        assert_eq!(refusal.to_string(), "campaign `three phases` has a population of 0; it must be at least 1");
    }
}
