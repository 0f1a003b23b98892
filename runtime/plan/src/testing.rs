//! Small plans for tests of the runtime.

use crate::{
    Activation, ActivationMode, Campaign, CampaignPlan, Choice, Count, Distribution, Domain, Drain, Field, FieldRef,
    MessageId, MessageType, Metric, MetricSource, Operation, OperationId, OperationKind, Parameter, SCHEMA, Search,
    Shape, Simulator, Span, Step, Strategy, Test, TestOperation, Topic, TopicId, Transport, Type, ValueMode,
};

/// Topic `command` of reals, topic `zones` with two members of `Zone { level: real, count: int }`.
pub fn plan(operations: Vec<Operation>) -> CampaignPlan {
    let ids = (0u32..).take(operations.len()).map(OperationId).collect();
    let topic = |name: &str, paths: &[&str], ty| Topic {
        name: name.to_owned(),
        doc: String::new(),
        paths: paths.iter().map(|&path| path.to_owned()).collect(),
        ty,
    };
    let field = |name: &str, ty| Field { name: name.to_owned(), doc: String::new(), ty };
    let metric = |name: &str, source| Metric {
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
    };
    CampaignPlan {
        schema: SCHEMA,
        generator: "test".to_owned(),
        source: "test.sesame".to_owned(),
        space: "test".to_owned(),
        doc: String::new(),
        simulator: Simulator {
            name: "sim".to_owned(),
            transport: Transport::InProcess { path: "sim::Sim".to_owned(), step_ns: 100_000_000 },
        },
        messages: vec![MessageType {
            name: "Zone".to_owned(),
            doc: String::new(),
            fields: vec![field("level", Type::Real { unit: None }), field("count", Type::Int { unit: None })],
        }],
        topics: vec![
            topic("command", &["arm/command"], Type::Real { unit: None }),
            topic("zones", &["zones/Z1", "zones/Z2"], Type::Message { id: MessageId(0) }),
        ],
        nodes: Vec::new(),
        metrics: vec![
            metric("fuzzing_time", MetricSource::FuzzingTime),
            metric("last_command", MetricSource::Last { input: FieldRef { topic: TopicId(0), path: Vec::new() } }),
        ],
        requirements: Vec::new(),
        operations,
        tests: Vec::new(),
        campaign: Campaign {
            name: "campaign".to_owned(),
            doc: String::new(),
            objectives: Vec::new(),
            operations: ids,
            count: Count { min: 1, max: 5 },
            copies: crate::Copies::default(),
            activation: ActivationMode::Time,
            search: Search::new(Strategy::Random, 1),
            coverage: None,
            exploration: None,
            confirm: None,
            neighbours: None,
            stop: Vec::new(),
            seed: 1,
            end_after: 10.0,
            record: None,
        },
    }
}

/// An operation on a topic, permitted in the first ten seconds.
pub fn operation(topic: u32, kind: OperationKind) -> Operation {
    let parameter = |name: &str, low, high, shape, integer| Parameter {
        name: name.to_owned(),
        unit: None,
        domain: Domain::Number { low, high, shape, integer },
    };
    let parameters = match &kind {
        OperationKind::RandomValue { integer, mode } => {
            vec![parameter(random_word(*mode), -9.0, 9.0, Shape::Range, *integer)]
        }
        OperationKind::PacketLoss => vec![parameter("loss", 0.0, 1.0, Shape::Value, false)],
        OperationKind::Latency { distribution: Distribution::Fixed, .. } => {
            vec![parameter("delay", 0.0, 5.0, Shape::Value, false)]
        }
        OperationKind::Latency { .. } => vec![parameter("delay", 0.0, 5.0, Shape::Range, false)],
        OperationKind::Bias => vec![parameter("bias", -9.0, 9.0, Shape::Value, false)],
        OperationKind::ClockSkew => vec![parameter("skew", -9.0, 9.0, Shape::Value, false)],
        OperationKind::StuckAt { truth: None } => vec![parameter("value", -9.0, 9.0, Shape::Value, false)],
        OperationKind::Drift => vec![parameter("rate", -9.0, 9.0, Shape::Value, false)],
        OperationKind::Noise | OperationKind::RandomWalk => vec![parameter("sigma", 0.0, 9.0, Shape::Value, false)],
        OperationKind::Scale => vec![parameter("factor", -9.0, 9.0, Shape::Value, false)],
        OperationKind::Stale => vec![parameter("age", 0.0, 5.0, Shape::Value, false)],
        OperationKind::BurstLoss => {
            ["enter", "leave", "loss"].map(|name| parameter(name, 0.0, 1.0, Shape::Value, false)).to_vec()
        }
        OperationKind::RateLimit => vec![parameter("rate", 0.1, 100.0, Shape::Value, false)],
        OperationKind::Reorder { .. } => vec![parameter("window", 0.0, 5.0, Shape::Value, false)],
        OperationKind::Duplicate => vec![parameter("copies", 1.0, 100.0, Shape::Value, true)],
        OperationKind::RandomText { .. }
        | OperationKind::StuckAt { truth: Some(_) }
        | OperationKind::NotFinite { .. }
        | OperationKind::Freeze
        | OperationKind::Blackhole
        | OperationKind::Custom { .. } => Vec::new(),
    };
    Operation {
        name: kind.words().replace(' ', "_"),
        doc: String::new(),
        topic: (!kind.is_offline()).then_some(TopicId(topic)),
        places: Vec::new(),
        kind,
        parameters,
        within: Span { start: 0.0, end: 10.0 },
        priority: 0,
        inclusion: 1.0,
        timed: true,
        constraints: Vec::new(),
    }
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
    }
}

/// A test of these operations.
pub fn test_of(operations: Vec<TestOperation>) -> Test {
    Test { operations }
}
