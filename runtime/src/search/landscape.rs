//! A fuzzing campaign that costs nothing to evaluate, on which the search is measured.
//!
//! A robot is vulnerable in a few hidden phases of its cycle, each to a bias of one signal or of two together. A test
//! hits a phase once per 0.2 s in which the signals' biases exceed the phase's thresholds; the bias of a signal is the
//! sum over the active operations on it of the middle of their sub-range. Hits are maximised, active time minimised.

use sesame_plan::{
    Activation, ActivationMode, Campaign, CampaignPlan, Choice, Count, Direction, Metric, MetricId, MetricSource,
    Operation, OperationId, OperationKind, Parameter, SCHEMA, Search, Shape, Simulator, Span, Test, TopicId, Transport,
    ValueMode,
};

use crate::search::{Evaluated, Fitness, Front, Strategy, Unfit, hypervolume::hypervolume};

/// Where and to what the robot is vulnerable.
pub(crate) struct Phase {
    start: f64,
    end: f64,
    /// Signals, and the bias that each must exceed, away from zero.
    thresholds: &'static [(usize, f64)],
}

/// One robot.
pub(crate) struct Landscape {
    pub(crate) name: &'static str,
    pub(crate) signals: usize,
    pub(crate) phases: &'static [Phase],
}

pub(crate) const LANDSCAPES: [Landscape; 4] = [
    Landscape {
        name: "three phases",
        signals: 2,
        phases: &[
            Phase { start: 8.0, end: 14.0, thresholds: &[(0, 0.15)] },
            Phase { start: 30.0, end: 33.0, thresholds: &[(1, 0.2)] },
            Phase { start: 50.0, end: 58.0, thresholds: &[(0, -0.1)] },
        ],
    },
    Landscape {
        name: "joint bias",
        signals: 2,
        phases: &[
            Phase { start: 12.0, end: 20.0, thresholds: &[(0, 0.1), (1, 0.1)] },
            Phase { start: 40.0, end: 46.0, thresholds: &[(0, -0.05), (1, 0.15)] },
        ],
    },
    Landscape {
        name: "many signals",
        signals: 6,
        phases: &[
            Phase { start: 5.0, end: 9.0, thresholds: &[(2, 0.1)] },
            Phase { start: 20.0, end: 26.0, thresholds: &[(4, 0.05), (5, 0.05)] },
            Phase { start: 44.0, end: 52.0, thresholds: &[(1, -0.12)] },
        ],
    },
    Landscape {
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

impl Landscape {
    /// A campaign on this robot: `random offset [-0.3, 0.3] within [0s, 65s]` on each signal, 1 to 5 per test.
    pub(crate) fn plan(&self, search: Search) -> CampaignPlan {
        let operation = |k: usize| Operation {
            name: format!("jitter{k}"),
            doc: String::new(),
            topic: TopicId(0),
            kind: OperationKind::RandomValue { path: Vec::new(), mode: ValueMode::Offset, integer: false },
            parameters: vec![Parameter {
                name: "offset".to_owned(),
                unit: Some("rad".to_owned()),
                low: -0.3,
                high: 0.3,
                shape: Shape::Range,
                integer: false,
            }],
            within: Span { start: 0.0, end: 65.0 },
            priority: 0,
            inclusion: 1.0,
        };
        let metric = |name: &str, direction| Metric {
            name: name.to_owned(),
            doc: String::new(),
            unit: None,
            direction: Some(direction),
            default: None,
            source: MetricSource::FuzzingTime,
            line: 1,
        };
        CampaignPlan {
            schema: SCHEMA,
            generator: "test".to_owned(),
            source: "landscape.sesame".to_owned(),
            space: "landscape".to_owned(),
            doc: String::new(),
            simulator: Simulator {
                name: "robot".to_owned(),
                transport: Transport::InProcess { path: "robot::Robot".to_owned(), step_ns: 20_000_000 },
            },
            messages: Vec::new(),
            topics: Vec::new(),
            nodes: Vec::new(),
            metrics: vec![metric("fuzzing_time", Direction::Minimise), metric("hits", Direction::Maximise)],
            requirements: Vec::new(),
            operations: (0..self.signals).map(operation).collect(),
            tests: Vec::new(),
            campaign: Campaign {
                name: self.name.to_owned(),
                doc: String::new(),
                objectives: vec![MetricId(0), MetricId(1)],
                operations: (0u32..).take(self.signals).map(OperationId).collect(),
                count: Count { min: 1, max: 5 },
                activation: ActivationMode::Time,
                search,
                seed: 0,
                end_after: 70.0,
            },
        }
    }

    /// Active time in seconds, and hits.
    pub(crate) fn measure(&self, test: &Test) -> (f64, f64) {
        let active: Vec<(usize, f64, f64, f64)> = test
            .operations
            .iter()
            .map(|operation| {
                let Activation::Time { start, end } = operation.activation;
                let Choice::Range { low, high } = operation.parameters[0] else { panic!("offsets are sub-ranges") };
                (operation.operation.index(), start, end, (low + high) / 2.0)
            })
            .collect();
        let time = active.iter().map(|(_, start, end, _)| end - start).sum();
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

    /// The share of the ideal hypervolume (all hits in no time) that the front of a whole campaign reaches.
    pub(crate) fn campaign(&self, strategy: &mut dyn Strategy) -> Run {
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
                    Evaluated { number, test: candidate.test, fitness }
                })
                .collect();
            results.iter().for_each(|result| _ = front.add(result.number, &result.fitness));
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
pub(crate) struct Run {
    pub(crate) tests: Vec<Evaluated>,
    pub(crate) volume: f64,
}

mod tune {
    use super::*;
    use crate::search::range::StepSizes;
    use crate::search::vary::Rates;
    use crate::search::{Nsga2, Permitted, Random, TestVariation, nsga2::Settings};

    fn score(rates: Option<Rates>, seeds: u64) -> Vec<f64> {
        LANDSCAPES
            .iter()
            .map(|l| {
                let mut v: Vec<f64> = (0..seeds)
                    .map(|seed| {
                        let plan = l.plan(Search::Nsga2 { population: 10, evaluations: 210 });
                        let p = Permitted::of(&plan).unwrap();
                        match rates {
                            None => l.campaign(&mut Random::new(p, 210, seed)).volume,
                            Some(r) => {
                                let s = Settings { population: 10, evaluations: 210, seed };
                                l.campaign(&mut Nsga2::new(s, TestVariation::new(p, r, seed))).volume
                            }
                        }
                    })
                    .collect();
                v.sort_by(f64::total_cmp);
                v.iter().sum::<f64>() / v.len() as f64
            })
            .collect()
    }

    #[test]
    fn tune() {
        let show = |name: &str, r: Option<Rates>| {
            let s = score(r, 100);
            println!("{name:<28} {:.3}  {:?}", s.iter().sum::<f64>() / 4.0, s.iter().map(|x| format!("{x:.3}")).collect::<Vec<_>>());
        };
        show("random", None);
        let d = Rates::default();
        show("default", Some(d));
        for x in [0.0, 0.5, 1.0] { show(&format!("crossover {x}"), Some(Rates { crossover: x, ..d })); }
        for x in [0.1, 0.2, 0.45, 0.666, 0.9] { show(&format!("window {x}"), Some(Rates { window: x, ..d })); }
        for x in [0.1, 0.2, 0.45, 0.666, 0.9] { show(&format!("parameter {x}"), Some(Rates { parameter: x, ..d })); }
        for x in [0.0, 0.1, 0.35, 0.5, 1.0] { show(&format!("fresh {x}"), Some(Rates { fresh: x, ..d })); }
        for x in [0.0, 0.02, 0.1, 0.2] { show(&format!("retarget {x}"), Some(Rates { retarget: x, ..d })); }
        for x in [0.0, 0.05, 0.2, 0.3] { show(&format!("add {x}"), Some(Rates { add: x, ..d })); }
        for x in [0.0, 0.1, 0.2, 0.3] { show(&format!("duplicate {x}"), Some(Rates { duplicate: x, ..d })); }
        for x in [0.0, 0.05, 0.25, 0.4] { show(&format!("drop {x}"), Some(Rates { drop: x, ..d })); }
        for (a, b) in [(0.001, 0.1), (0.01, 0.1), (0.03, 0.3), (0.1, 0.1001), (0.1, 0.5), (0.01, 1.0)] {
            show(&format!("steps {a} {b}"), Some(Rates { steps: StepSizes { finest: a, boldest: b }, ..d }));
        }
    }
}
