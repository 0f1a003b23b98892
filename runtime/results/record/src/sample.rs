//! A made-up campaign for tests: the shape of a real one (robot cell, four requirements, every outcome) without a
//! simulator.

mod earlier;
mod environment;
mod monitors;

use std::path::Path;

use sesame_base::observation::{Counters, MetricObservation, Observation, OperationEffect, Outcome, Reach, WallTime};
use sesame_plan::condition::{Comparison, Condition, ConditionEnd, ConditionSpace, Integers, Operand, Variable};
use sesame_plan::testing;
use sesame_plan::{
    Activation, ActivationMode, Bound, Campaign, CampaignPlan, Choice, ChoiceKind, CoverageGoal, Dimension, Direction,
    Domain, GridAxis, KnownTestId, Metric, MetricId, MetricSource, Moment, Operation, OperationId, OperationKind,
    Parameter, Requirement, Search, Span, Strategy, Test, TestOperation, TopicId, Trend, Type, ValueMode,
};
use sesame_rng::Stream;
use sesame_search as search;
use sesame_search::indicators::Indicators;

pub use earlier::{of_schema_7, recorded_again};
pub use environment::{broken_off, outcomes_of_environment};
pub use monitors::{mended_plan, monitored_plan};

use crate::{Event, EventKind, Origin, Recorder, Repository, ResultSet, Status, TestRecord};

fn metric(name: &str, unit: Option<&str>, direction: Direction, default: Option<f64>, source: MetricSource) -> Metric {
    let (unit, direction) = (unit.map(str::to_owned), Some(direction));
    Metric { unit, direction, default, trend: trends(name), ..testing::metric(name, source) }
}

fn operation(name: &str, topic: u32, kind: OperationKind, parameters: Vec<Parameter>) -> Operation {
    let within = Span { start: 0.0, end: 65.0 };
    Operation { within, ..testing::operation_with(name, topic, kind, parameters) }
}

/// The metrics of this plan that change in one direction only; a cycle time is set once.
fn trends(name: &str) -> Option<Trend> {
    match name {
        "collision_occurrence" | "fuzzing_time" | "top_speed" => Some(Trend::Rising),
        "arm_distance" => Some(Trend::Falling),
        _ => None,
    }
}

/// Makes a run one that broke off.
fn break_off(plan: &CampaignPlan, observation: &mut Observation, outcome: Outcome) {
    observation.outcome = outcome;
    for (shown, metric) in observation.metrics.iter_mut().zip(&plan.metrics) {
        shown.reach = Reach::onwards(metric.trend, shown.value.filter(|_| shown.set));
    }
}

/// A campaign on a robot cell: two objectives, four requirements, four operations, one regression test.
pub fn plan() -> CampaignPlan {
    let hook = || MetricSource::Hook { topics: vec![TopicId(2)] };
    let unit = || Some("rad".to_owned());
    let offset = Parameter { unit: unit(), ..testing::range("offset", -0.3, 0.3) };
    let loss = testing::value("loss", 0.0, 1.0);
    let jitter = || OperationKind::RandomValue { mode: ValueMode::Offset, integer: false };
    let topic = |name: &str, path: &str| testing::topic(name, &[path], Type::Real { unit: unit() });
    let requirement = |name: &str, text: &str, metric: u32, bound: Bound| Requirement {
        text: text.to_owned(),
        ..testing::requirement(name, metric, bound)
    };
    let known =
        Test { operations: vec![testing::use_of(1, 8.0, 57.0, vec![Choice::Range { low: 0.27, high: 0.29 }], 7)] };
    CampaignPlan {
        generator: "sesamec 0.1.0".to_owned(),
        source: "kuka_cell.sesame".to_owned(),
        space: "kuka_cell".to_owned(),
        doc: "The KUKA gearbox cell: three robots on sliding conveyors, workers around them.".to_owned(),
        simulator: testing::in_process("cell", "kuka_cell_sim::Cell", 20_000_000),
        topics: vec![
            topic("link0", "joints/R3200ProductMove/Link0/R/position"),
            topic("link1", "joints/R3200ProductMove/Link1/R/position"),
            topic("zones", "safetyzones/Z1"),
        ],
        metrics: vec![
            metric("collision_occurrence", None, Direction::Maximise, Some(0.0), hook()),
            metric("fuzzing_time", Some("s"), Direction::Minimise, None, MetricSource::FuzzingTime),
            metric("top_speed", Some("m/s"), Direction::Maximise, Some(0.0), hook()),
            metric("cycle_time", Some("s"), Direction::Maximise, Some(999.0), hook()),
            metric("arm_distance", Some("mm"), Direction::Minimise, None, hook()),
        ],
        requirements: vec![
            requirement("R1", "Grippers stay out of the safety zones", 0, Bound::AtMost { value: 0.0 }),
            requirement("R2", "Robots keep their speed limit", 2, Bound::AtMost { value: 2.5 }),
            requirement("R3", "Arms keep their distance", 4, Bound::Above { value: 150.0 }),
            requirement("R4", "The cell keeps its cycle time", 3, Bound::AtMost { value: 70.0 }),
        ],
        operations: vec![
            operation("jitter_link0", 0, jitter(), vec![offset.clone()]),
            operation("jitter_link1", 1, jitter(), vec![offset]),
            operation("lose_link0", 0, OperationKind::PacketLoss, vec![loss]),
            operation("cut_link1", 1, OperationKind::Blackhole, vec![]),
        ],
        tests: vec![testing::known_test("known_jitter", known)],
        campaign: Campaign {
            doc: "How short a disturbance drives a gripper into a safety zone?".to_owned(),
            objectives: vec![MetricId(1), MetricId(0)],
            search: Search::new(Strategy::Nsga2 { population: 10 }, 210),
            seed: 42,
            end_after: 70.0,
            ..testing::campaign("coverage_experiment", 4)
        },
        ..testing::minimal()
    }
}

/// When an operation is active: its window, or where conditions decide it a window that they might give.
fn window(operation: &TestOperation) -> (f64, f64) {
    match operation.activation {
        Activation::Time { start, end } => (start, end),
        Activation::Condition { .. } => (12.0, 33.0),
        Activation::ConditionFor { length, .. } => (30.0, 30.0 + length),
        Activation::Offline => (0.0, 0.0),
    }
}

/// The plan with an operation before the start, `spoil`, and a search that grows conditions over two metrics.
pub fn offline_plan(end: ConditionEnd) -> CampaignPlan {
    let mut plan = plan();
    let texts = ["cold", "warm", "hot"].map(str::to_owned).to_vec();
    let way = testing::parameter("way", Domain::Texts { texts });
    let kind = OperationKind::Custom { moment: Moment::BeforeStart };
    plan.operations.push(operation("spoil", 0, kind, vec![way]));
    plan.campaign.operations.push(OperationId(4));
    let variable = |metric: u32, high: f64| Variable {
        metric: MetricId(metric),
        unit: plan.metrics[metric as usize].unit.clone(),
        low: Some(0.0),
        high: Some(high),
        step: None,
    };
    let variables = vec![variable(2, 3.0), variable(4, 700.0)];
    let integers = Integers { lowest: 1, highest: 20 };
    plan.campaign.activation =
        ActivationMode::Condition { space: ConditionSpace { variables, depth: 3, integers, end, times: 2 } };
    plan
}

/// A test with every kind of activation in it that acts during the run.
pub fn conditional_test() -> Test {
    let compare = |left, by, right| Condition::Compare { left, by, right };
    let (speed, distance) = (Operand::Variable(MetricId(2)), Operand::Variable(MetricId(4)));
    let near = || compare(distance, Comparison::Below, Operand::Number(450.0));
    let fast = || compare(Operand::Number(1.5), Comparison::Below, speed);
    let use_of = |operation, activation, parameters| TestOperation {
        operation: OperationId(operation),
        activation,
        parameters,
        operation_seed: 11,
        messages: None,
    };
    let start = Condition::And(Box::new(near()), Box::new(Condition::Or(Box::new(fast()), Box::new(near()))));
    let offset = Choice::Range { low: -0.1, high: 0.2 };
    Test {
        operations: vec![
            use_of(0, Activation::Condition { start, end: fast(), times: 1 }, vec![offset.clone()]),
            use_of(1, Activation::Time { start: 1.5, end: 20.0 }, vec![offset]),
            use_of(3, Activation::ConditionFor { start: fast(), length: 0.1 + 0.2, times: 3 }, vec![]),
        ],
    }
}

/// What a run of a test might show: collisions in three phases of the cycle when a link is disturbed enough there.
pub fn observe(plan: &CampaignPlan, test: &Test, seed: u64) -> Observation {
    let mut stream = Stream::derive(seed, "observation", &[]);
    let (mut fuzzing, mut effects) = (0.0, Vec::new());
    for operation in &test.operations {
        let (start, end) = window(operation);
        fuzzing += end - start;
        let seen = count_of((end - start) * 50.0);
        let whole = Counters { seen, ..Counters::default() };
        let counters = match plan.operation(operation.operation).kind {
            OperationKind::RandomValue { .. } => Counters { changed: seen, ..whole },
            OperationKind::PacketLoss => Counters { dropped: seen / 3, ..whole },
            _ => Counters { dropped: seen, ..whole },
        };
        effects.push(OperationEffect {
            intervals: if start < end { vec![Span { start, end }] } else { Vec::new() },
            tails: Vec::new(),
            counters,
            first_touch: counters.any_effect().then_some(start),
            last_touch: counters.any_effect().then_some(end - 0.02),
        });
    }
    let mut collisions = Vec::new();
    let (mut speeds, mut distances) = (vec![(0.02, 0.4)], vec![(0.02, 640.0)]);
    let mut top: f64 = 0.4;
    let mut nearest: f64 = 640.0;
    for tick in 0..350u32 {
        let time = f64::from(tick) * 0.2;
        let push: f64 = test
            .operations
            .iter()
            .map(|operation| {
                let (start, end) = window(operation);
                if time < start || time >= end {
                    0.0
                } else {
                    operation.parameters.first().map_or(0.2, |choice| match choice {
                        Choice::Range { low, high } => (low + (high - low) * stream.unit()).abs(),
                        Choice::Value { value } => value * 0.2,
                        other => panic!("{other:?} is none of this plan's"),
                    })
                }
            })
            .sum();
        let phase = [(11.0, 17.0, 0.10), (29.0, 36.0, 0.17), (50.0, 58.0, 0.24)]
            .into_iter()
            .any(|(from, to, threshold)| (from..to).contains(&time) && push > threshold);
        if phase && stream.chance(0.25) {
            collisions.push((time, collisions.len() as f64 + 1.0));
        }
        let speed = libm::round((1.4 + push * 1.6 + 0.3 * libm::sin(time / 3.0)) * 100.0) / 100.0;
        if speed > top {
            top = speed;
            speeds.push((time + 0.02, speed));
        }
        let distance = libm::round(420.0 + 180.0 * libm::cos(time / 7.0) - push * 300.0);
        if distance < nearest {
            nearest = distance;
            distances.push((time + 0.02, distance));
        }
    }
    let cycle = libm::round((68.2 + fuzzing / 40.0) * 100.0) / 100.0;
    let cycle = if cycle < 70.0 { vec![(cycle, cycle)] } else { vec![] };
    let shown = |series: Vec<(f64, f64)>, default: Option<f64>| {
        let value = series.last().map(|point| point.1).or(default);
        MetricObservation::whole(value, !series.is_empty(), series)
    };
    let disturbs = test.operations.is_empty() || effects.iter().any(|effect| effect.counters.any_effect());
    Observation {
        outcome: if disturbs { Outcome::Completed } else { Outcome::NoEffect },
        end: 70.0,
        operations: effects,
        unheard: Vec::new(),
        unreached: Vec::new(),
        traffic: Vec::new(),
        course: None,
        altered: None,
        metrics: vec![
            shown(collisions, Some(0.0)),
            MetricObservation::whole(Some(fuzzing), true, vec![]),
            shown(speeds, Some(0.0)),
            shown(cycle, Some(999.0)),
            shown(distances, None),
        ],
        monitors: Vec::new(),
        messages: 10_500,
        warnings: vec![],
        wall: WallTime { run: 0.031 },
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small count of messages")]
fn count_of(messages: f64) -> u64 {
    messages as u64
}

/// A random test of the plan's campaign.
fn random_test(plan: &CampaignPlan, seed: u64, number: u32) -> Test {
    let mut stream = Stream::derive(seed, "test", &[u64::from(number)]);
    let operations = (0..=stream.below(3))
        .map(|_| {
            let id = [0, 0, 1, 1, 2, 3][stream.below(6)];
            let start = stream.uniform(0.0, 60.0);
            let longest = (65.0 - start) * stream.unit();
            let length = if number % 29 == 5 { 0.004 } else { stream.uniform(0.0, longest) };
            let parameters = plan.operations[id]
                .parameters
                .iter()
                .map(|parameter| {
                    let Domain::Number { low, high, shape, .. } = parameter.domain else {
                        panic!("this plan has numbers only")
                    };
                    let (a, b) = (stream.uniform(low, high), stream.uniform(low, high));
                    match shape {
                        ChoiceKind::Value => Choice::Value { value: a },
                        ChoiceKind::Range => Choice::Range { low: a.min(b), high: a.max(b) },
                    }
                })
                .collect();
            TestOperation {
                operation: OperationId(u32::try_from(id).expect("what is made up here can be recorded")),
                activation: Activation::Time { start, end: start + length },
                parameters,
                operation_seed: stream.bits(),
                messages: None,
            }
        })
        .collect();
    Test { operations }
}

/// The record of a test of this plan that was run.
pub fn record(plan: &CampaignPlan, number: u32, origin: Origin, test: Test) -> TestRecord {
    let mut observation = observe(plan, &test, u64::from(number));
    monitors::watch(plan, &test, &mut observation);
    TestRecord {
        number,
        origin,
        generation: (origin == Origin::Search).then_some(number / 10),
        parents: vec![],
        test,
        simulator_seed: u64::MAX - u64::from(number),
        duplicate_of: None,
        observation,
    }
}

/// A campaign's records: the reference run, the regression test, and random tests with every outcome among them.
pub fn records(plan: &CampaignPlan, searched: u32) -> Vec<TestRecord> {
    let mut records = vec![
        record(plan, 0, Origin::Reference, Test::default()),
        record(plan, 1, Origin::Known(KnownTestId(0)), plan.tests[0].test.clone()),
    ];
    for number in 2..searched + 2 {
        let mut record = record(plan, number, Origin::Search, random_test(plan, 42, number));
        if number > 12 {
            record.parents = vec![number - 11, number - 7];
        }
        match number {
            17 => {
                let crash = Outcome::Crash { message: "the simulator panicked: index out of bounds".to_owned() };
                break_off(plan, &mut record.observation, crash);
                record.observation.end = 31.42;
                monitors::watch(plan, &record.test, &mut record.observation);
                record.observation.warnings = vec!["`top_speed` refused the value NaN at 12.000 s".to_owned()];
            }
            23 => {
                record.observation = Observation {
                    outcome: Outcome::Crash { message: "the worker process died (signal 9)".to_owned() },
                    end: 0.0,
                    operations: vec![],
                    unheard: vec![],
                    unreached: Vec::new(),
                    traffic: Vec::new(),
                    course: None,
                    altered: None,
                    metrics: vec![],
                    monitors: Vec::new(),
                    messages: 0,
                    warnings: vec![],
                    wall: WallTime { run: 1.5 },
                }
            }
            31 => break_off(plan, &mut record.observation, Outcome::Timeout { limit: 30.0 }),
            44 => {
                record.test = records_test(&records, 40);
                record.observation = records
                    .iter()
                    .find(|other| other.number == 40)
                    .expect("what is made up here can be recorded")
                    .observation
                    .clone();
                record.duplicate_of = Some(40);
            }
            _ => {}
        }
        records.push(record);
    }
    records
}

fn records_test(records: &[TestRecord], number: u32) -> Test {
    records.iter().find(|record| record.number == number).expect("what is made up here can be recorded").test.clone()
}

/// Numbers of the tests that no other is better than, by the campaign's objectives.
pub fn front(plan: &CampaignPlan, records: &[TestRecord]) -> Vec<u32> {
    let oriented = |record: &TestRecord| -> Option<Vec<f64>> {
        if record.origin == Origin::Reference
            || record.observation.outcome != Outcome::Completed
            || record.duplicate_of.is_some()
        {
            return None;
        }
        plan.objectives()
            .map(|objective| {
                record.observation.metrics.get(objective.metric.index())?.value.map(|value| objective.oriented(value))
            })
            .collect()
    };
    let points: Vec<(u32, Vec<f64>)> =
        records.iter().filter_map(|record| Some((record.number, oriented(record)?))).collect();
    let better = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(x, y)| x <= y) && a != b;
    points.iter().filter(|(_, point)| !points.iter().any(|(_, other)| better(other, point))).map(|(n, _)| *n).collect()
}

/// Records a campaign as a runner does, but for the fronts of most generations, and finishes it.
pub fn campaign(folder: &Path, plan: &CampaignPlan, searched: u32) -> Repository {
    recorded(folder, plan, searched, false)
}

/// Records a campaign of 60 tests that counts the cells it covers: six by six, of when tests disturb and for how long.
pub fn covering(folder: &Path) -> Repository {
    let mut plan = plan();
    let axis = |dimension, high| GridAxis { dimension, low: 0.0, high, cells: 6 };
    let axes = vec![axis(Dimension::T1, 1.0), axis(Dimension::T2, 0.5)];
    plan.campaign.coverage = Some(CoverageGoal { axes, hits: 1, stop_at: None });
    campaign(folder, &plan, 60)
}

/// Records a campaign with the fronts of all generations, and finishes it.
pub fn campaign_with_fronts(folder: &Path, plan: &CampaignPlan, searched: u32) -> Repository {
    recorded(folder, plan, searched, true)
}

fn recorded(folder: &Path, plan: &CampaignPlan, searched: u32, fronts: bool) -> Repository {
    let mut recorder =
        Recorder::create(folder, plan, plan.campaign.seed, 2).expect("what is made up here can be recorded");
    let records = records(plan, searched);
    let mut indicators = Indicators::new(Some(&search::fitness(plan, &records[0].observation)));
    let mut front_so_far = sesame_optimise::front::Front::default();
    recorder.commit(&records[0]).expect("what is made up here can be recorded");
    for (at, record) in records.iter().enumerate().skip(1) {
        recorder.commit(record).expect("what is made up here can be recorded");
        let fitness = search::fitness(plan, &record.observation);
        indicators.add(&record.observation.outcome, record.duplicate_of.is_some(), &fitness);
        front_so_far.add(record.number, &fitness);
        let next = records.get(at + 1).map(|next| next.generation);
        if let Some(generation) = record.generation.filter(|&generation| next != Some(Some(generation))) {
            recorder
                .put_indicators(&indicators.after(generation, &front_so_far), indicators.reference())
                .expect("what is made up here can be recorded");
            if fronts {
                let (name, members) = (format!("generation-{generation}"), front_so_far.numbers());
                let status = Status::Intermediate;
                recorder
                    .put_result_set(&ResultSet { name, generation: Some(generation), status, members })
                    .expect("what is made up here can be recorded");
            }
        }
    }
    let set =
        |name: &str, generation, status, members| ResultSet { name: String::from(name), generation, status, members };
    recorder
        .put_result_set(&set("generation-0", Some(0), Status::Intermediate, front(plan, &records[..12])))
        .expect("what is made up here can be recorded");
    recorder
        .put_result_set(&set("front", None, Status::Final, front(plan, &records)))
        .expect("what is made up here can be recorded");
    let warning = "`jitter_link0` and `lose_link0` disturb the same topic".to_owned();
    recorder
        .put_event(&Event { kind: EventKind::Warning, test: None, text: warning })
        .expect("what is made up here can be recorded");
    recorder.finish("all evaluations done").expect("what is made up here can be recorded")
}
