//! Plans for tests, and functions that make their parts.
//!
//! A function takes what every test gives of a part; all other fields have a default. A test that needs another value
//! of a field says so with struct update syntax: `Metric { unit, ..metric("speed", source) }`. So a new field of the
//! plan is filled in here, and in no test.

pub mod compact;

use crate::{
    Activation, ActivationMode, Bound, Campaign, CampaignPlan, Channel, Choice, ChoiceKind, Comparison, Compression,
    Copies, Count, Demand, Dialect, Distribution, Domain, Drain, Evidence, Expression, Field, FieldRef, Gate,
    Guarantee, Input, KnownTest, Lab, LabCost, Members, MessageId, MessageType, Metric, MetricId, MetricSource,
    Monitor, MonitorId, Node, Operation, OperationId, OperationKind, Parameter, Remote, Requirement, Ros, Ros1, Ros2,
    Rosbridge, SCHEMA, SafeState, Score, Search, Side, Simlog, SimlogVersion, Simulator, Span, Step, Strategy, Test,
    TestOperation, Topic, TopicId, TopicMembers, Transport, Type, ValueMode, WireNames, Wiring, formula,
};

/// The smallest valid plan: a simulator, and [a campaign](campaign) that may not use anything.
pub fn minimal() -> CampaignPlan {
    CampaignPlan {
        schema: SCHEMA,
        generator: "test".to_owned(),
        source: "test.sesame".to_owned(),
        space: "test".to_owned(),
        doc: String::new(),
        simulator: in_process("sim", "sim::Sim", 100_000_000),
        messages: Vec::new(),
        topics: Vec::new(),
        nodes: Vec::new(),
        metrics: Vec::new(),
        requirements: Vec::new(),
        operations: Vec::new(),
        tests: Vec::new(),
        campaign: campaign("campaign", 0),
        monitors: Vec::new(),
        labs: Vec::new(),
        compensation: None,
    }
}

/// A campaign of one random test of ten seconds, by time, with seed 1. It may use the first operations of the plan, so
/// many of them, and has no objective.
pub fn campaign(name: &str, operations: usize) -> Campaign {
    Campaign {
        name: name.to_owned(),
        doc: String::new(),
        objectives: Vec::new(),
        operations: (0..).take(operations).map(OperationId).collect(),
        count: Count { min: 1, max: 5 },
        copies: Copies::default(),
        activation: ActivationMode::Time,
        search: Search::new(Strategy::Random, 1),
        coverage: None,
        exploration: None,
        confirm: None,
        neighbours: None,
        stop: Vec::new(),
        seed: 1,
        end_after: 10.0,
        end_when: None,
        record: None,
        describes_when: false,
    }
}

/// A simulator that is a Rust type, with steps of so many nanoseconds.
pub fn in_process(name: &str, path: &str, step_ns: u64) -> Simulator {
    Simulator::new(name, Transport::InProcess { path: path.to_owned(), step_ns })
}

/// Nodes of ROS 2 in a domain, by wall time, whose messages have no layouts. The topics of the plan are cut so.
pub fn ros2(domain: u16, wiring: Vec<Wiring>) -> Simulator {
    let transport = Transport::Ros2(Ros2 { domain });
    Simulator { ros: Some(Ros::default()), wiring, ..Simulator::new("nodes", transport) }
}

/// The same behind a bridge of rosbridge at this address.
pub fn rosbridge(url: &str, wiring: Vec<Wiring>) -> Simulator {
    let remote = Remote { url: url.to_owned(), token: None, trust: None };
    let (dialect, compression) = (Dialect::Ros2, Compression::None);
    let settings = Rosbridge { remote, domain: 0, dialect, compression };
    Simulator { transport: Transport::Rosbridge(settings), ..ros2(0, wiring) }
}

/// The same of ROS 1, at a master.
pub fn ros1(master: &str, wiring: Vec<Wiring>) -> Simulator {
    Simulator { transport: Transport::Ros1(Ros1 { master: master.to_owned() }), ..ros2(0, wiring) }
}

/// A simulator that speaks version 2 of SimlogAPI, in steps of 20 ms.
pub fn simlog(url: &str) -> Simulator {
    let settings = Simlog {
        url: url.to_owned(),
        topics_url: None,
        step_ns: 20_000_000,
        protocol: SimlogVersion::V2,
        names: WireNames::default(),
        marker: None,
        cut: Vec::new(),
        settle_ns: 0,
        ca: None,
    };
    Simulator::new("there", Transport::Simlog(settings))
}

/// The settings of such a simulator.
pub fn simlog_mut(simulator: &mut Simulator) -> &mut Simlog {
    simulator.simlog_mut().expect("it speaks SimlogAPI")
}

/// A message type.
pub fn message(name: &str, fields: Vec<Field>) -> MessageType {
    MessageType { name: name.to_owned(), doc: String::new(), fields, constants: Vec::new() }
}

/// A field of a message type.
pub fn field(name: &str, ty: Type) -> Field {
    Field { name: name.to_owned(), doc: String::new(), ty, optional: false }
}

/// A topic, or a group of topics.
pub fn topic(name: &str, paths: &[&str], ty: Type) -> Topic {
    Topic {
        name: name.to_owned(),
        doc: String::new(),
        paths: paths.iter().map(|&path| path.to_owned()).collect(),
        members: Vec::new(),
        ty,
        interface: None,
        channel: Channel::default(),
    }
}

/// These topics, each with all members.
pub fn topics(ids: &[u32]) -> Vec<TopicMembers> {
    ids.iter().map(|&id| TopicMembers::All(TopicId(id))).collect()
}

/// A node that neither publishes nor subscribes.
pub fn node(name: &str) -> Node {
    Node {
        name: name.to_owned(),
        doc: String::new(),
        publishes: Vec::new(),
        subscribes: Vec::new(),
        named: None,
        launch: None,
        answers: Vec::new(),
        every_step: Vec::new(),
    }
}

/// A lab in which a test costs 1, and whose tests are chosen by hand.
pub fn lab(name: &str) -> Lab {
    Lab {
        name: name.to_owned(),
        doc: String::new(),
        simulator: None,
        repeats: 1,
        cost: LabCost::default(),
        exclude: Vec::new(),
        rank: Vec::new(),
        budget: None,
        tolerances: Vec::new(),
        interlock: Vec::new(),
        shapes: Vec::new(),
        fits: Vec::new(),
    }
}

/// A metric without a unit, a direction or a trend.
pub fn metric(name: &str, source: MetricSource) -> Metric {
    Metric {
        name: name.to_owned(),
        doc: String::new(),
        unit: None,
        direction: None,
        default: None,
        initial: None,
        source,
        trend: None,
        accepts_not_finite: false,
        line: 1,
    }
}

/// A metric of what there is to say of a monitor, with its unit and its trend.
pub fn score(name: &str, monitor: u32, score: Score) -> Metric {
    let source = MetricSource::Monitor { monitor: MonitorId(monitor), score };
    Metric { unit: score.unit().map(str::to_owned), trend: score.trend(), ..metric(name, source) }
}

/// A monitor that publishes its state on a topic, relies on no other monitor, and sends nothing: of this evidence and
/// these guarantees, and with the safe state `unsafe`.
pub fn monitor(name: &str, publishes: u32, evidence: Vec<Evidence>, guarantees: Vec<Guarantee>) -> Monitor {
    Monitor {
        name: name.to_owned(),
        doc: String::new(),
        publishes: Some(TopicId(publishes)),
        demands: Vec::new(),
        evidence,
        guarantees,
        otherwise: SafeState { name: "unsafe".to_owned(), doc: String::new(), mitigation: None },
        line: 1,
    }
}

/// Evidence that a number is above a limit: delivered by a topic of its own, of one member, that carries it alone.
/// Without a hold, never stale.
pub fn evidence_above(name: &str, topic: u32, limit: f64) -> Evidence {
    Evidence {
        name: name.to_owned(),
        doc: String::new(),
        inputs: vec![Input::new(FieldRef { topic: TopicId(topic), path: Vec::new() }, Members::Min)],
        condition: formula::Condition::Compare {
            left: Expression::Input(0),
            by: Comparison::Above,
            right: Expression::Constant(limit),
        },
        held: 0.0,
        stale: None,
        side: Side::Outbound,
    }
}

/// A guarantee of a monitor.
pub fn guarantee(name: &str, integrity: u32, gate: Gate) -> Guarantee {
    Guarantee { name: name.to_owned(), doc: String::new(), integrity, gate }
}

/// A demand of a monitor for a guarantee of another one, at its position there.
pub fn demand(name: &str, monitor: u32, guarantee: u32) -> Demand {
    Demand { name: name.to_owned(), monitor: MonitorId(monitor), guarantee }
}

/// A requirement on a metric.
pub fn requirement(name: &str, metric: u32, bound: Bound) -> Requirement {
    Requirement { name: name.to_owned(), text: String::new(), metric: MetricId(metric), bound }
}

/// A known test that expects nothing.
pub fn known_test(name: &str, test: Test) -> KnownTest {
    KnownTest { name: name.to_owned(), doc: String::new(), test, expectations: Vec::new(), simulator_seed: None }
}

/// An operation that is permitted in the first ten seconds, on whole messages of a topic; on no topic if it acts
/// outside the run.
pub fn operation_with(name: &str, topic: u32, kind: OperationKind, parameters: Vec<Parameter>) -> Operation {
    Operation {
        name: name.to_owned(),
        doc: String::new(),
        topic: kind.acts_on_messages().then_some(TopicId(topic)),
        members: None,
        from: Vec::new(),
        to: Vec::new(),
        places: Vec::new(),
        further: Vec::new(),
        kind,
        parameters,
        within: Span { start: 0.0, end: 10.0 },
        priority: 0,
        inclusion: 1.0,
        lengths: None,
        timed: true,
        counted: Vec::new(),
        wrapped: None,
        constraints: Vec::new(),
    }
}

/// A parameter without a unit.
pub fn parameter(name: &str, domain: Domain) -> Parameter {
    Parameter { name: name.to_owned(), unit: None, domain }
}

/// A parameter of which a test chooses one real number.
pub fn value(name: &str, low: f64, high: f64) -> Parameter {
    parameter(name, Domain::Number { low, high, shape: ChoiceKind::Value, integer: false })
}

/// A parameter of which a test chooses a sub-range of real numbers.
pub fn range(name: &str, low: f64, high: f64) -> Parameter {
    parameter(name, Domain::Number { low, high, shape: ChoiceKind::Range, integer: false })
}

/// A plan of topic `command` of reals and topic `zones` with two members of `Zone { level: real, count: int }`, and of
/// two metrics: the fuzzing time and the last command. Its campaign may use all of the operations.
pub fn plan(operations: Vec<Operation>) -> CampaignPlan {
    let (real, int) = (Type::Real { unit: None }, Type::Int { unit: None });
    let command = FieldRef { topic: TopicId(0), path: Vec::new() };
    CampaignPlan {
        messages: vec![message("Zone", vec![field("level", real.clone()), field("count", int)])],
        topics: vec![
            topic("command", &["arm/command"], real),
            topic("zones", &["zones/Z1", "zones/Z2"], Type::Message { id: MessageId(0) }),
        ],
        metrics: vec![
            metric("fuzzing_time", MetricSource::FuzzingTime),
            metric("last_command", MetricSource::Last { input: command }),
        ],
        campaign: campaign("campaign", operations.len()),
        operations,
        ..minimal()
    }
}

/// An operation of this kind with the parameters that the kind needs, named after it; otherwise as
/// [`operation_with`].
pub fn operation(topic: u32, kind: OperationKind) -> Operation {
    let whole =
        |name: &str, low, high| parameter(name, Domain::Number { low, high, shape: ChoiceKind::Value, integer: true });
    let parameters = match &kind {
        OperationKind::RandomValue { integer, mode } => {
            let domain = Domain::Number { low: -9.0, high: 9.0, shape: ChoiceKind::Range, integer: *integer };
            vec![parameter(random_word(*mode), domain)]
        }
        OperationKind::PacketLoss => vec![value("loss", 0.0, 1.0)],
        OperationKind::Latency { distribution: Distribution::Fixed, .. } => vec![value("delay", 0.0, 5.0)],
        OperationKind::Latency { .. } => vec![range("delay", 0.0, 5.0)],
        OperationKind::Bias => vec![value("bias", -9.0, 9.0)],
        OperationKind::ClockSkew => vec![value("skew", -9.0, 9.0)],
        OperationKind::Set { values, .. } if !values.is_empty() => {
            let texts = (0..values.len()).map(|at| format!("value {at}")).collect();
            vec![parameter("value", Domain::Texts { texts })]
        }
        OperationKind::StuckAt { truth: None } | OperationKind::Set { .. } | OperationKind::Scene { .. } => {
            vec![value("value", -9.0, 9.0)]
        }
        OperationKind::Drift => vec![value("rate", -9.0, 9.0)],
        OperationKind::Noise | OperationKind::RandomWalk => vec![value("sigma", 0.0, 9.0)],
        OperationKind::Scale => vec![value("factor", -9.0, 9.0)],
        OperationKind::Stale => vec![value("age", 0.0, 5.0)],
        OperationKind::BurstLoss => ["enter", "leave", "loss"].map(|name| value(name, 0.0, 1.0)).to_vec(),
        OperationKind::RateLimit => vec![value("rate", 0.1, 100.0)],
        OperationKind::Reorder { .. } => vec![value("window", 0.0, 5.0)],
        OperationKind::Duplicate => vec![whole("copies", 1.0, 100.0)],
        OperationKind::Slow { .. } => vec![value("share", 0.1, 0.9)],
        OperationKind::StuckAtConstant { numbers } => {
            let texts = (0..numbers.len()).map(|at| format!("C{at}")).collect();
            vec![parameter("value", Domain::Texts { texts })]
        }
        OperationKind::RandomText { .. }
        | OperationKind::RandomConstant { .. }
        | OperationKind::StuckAt { truth: Some(_) }
        | OperationKind::NotFinite { .. }
        | OperationKind::Freeze
        | OperationKind::Blackhole
        | OperationKind::Transition { .. }
        | OperationKind::Pause { .. }
        | OperationKind::Kill { .. }
        | OperationKind::Custom { .. } => Vec::new(),
    };
    operation_with(&kind.words().replace(' ', "_"), topic, kind, parameters)
}

/// The same operation on a field.
pub fn at(path: &[&str], operation: Operation) -> Operation {
    let place = path.iter().map(|&name| Step::Field(name.to_owned())).collect();
    Operation { places: vec![place], ..operation }
}

/// A random value, added or put in its place.
pub fn offset(mode: ValueMode, integer: bool) -> OperationKind {
    OperationKind::RandomValue { mode, integer }
}

fn random_word(mode: ValueMode) -> &'static str {
    if mode == ValueMode::Offset { "offset" } else { "value" }
}

/// A latency of random length.
pub fn latency(distribution: Distribution, drain: Drain) -> OperationKind {
    OperationKind::Latency { distribution, drain }
}

/// A use of an operation between two times.
pub fn use_of(operation: u32, start: f64, end: f64, parameters: Vec<Choice>, operation_seed: u64) -> TestOperation {
    TestOperation {
        operation: OperationId(operation),
        activation: Activation::Time { start, end },
        parameters,
        operation_seed,
        messages: None,
    }
}

/// A test of these operations.
pub fn test_of(operations: Vec<TestOperation>) -> Test {
    Test { operations }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_plans_for_tests_are_valid() {
        minimal().validate().unwrap();
        plan(vec![operation(0, OperationKind::Bias), operation(1, OperationKind::Blackhole)]).validate().unwrap();
    }
}
