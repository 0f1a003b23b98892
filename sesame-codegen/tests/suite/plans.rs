//! Plans to generate from, for these tests and for those in which their runners are compiled.

use sesame_codegen::plan::{HookPlan, RunnerPlan};
use sesame_plan::testing;
use sesame_plan::{
    Campaign, CampaignPlan, Direction, Field, FieldRef, MessageId, MessageType, Metric, MetricId, MetricSource, Node,
    Search, Strategy, Topic, TopicId, Transport, Type,
};

fn field(name: &str, doc: &str, ty: Type) -> Field {
    Field { doc: doc.into(), ..testing::field(name, ty) }
}

fn real(unit: &str) -> Type {
    Type::Real { unit: Some(unit.into()) }
}

fn topic(name: &str, doc: &str, paths: &[&str], ty: Type) -> Topic {
    Topic { doc: doc.into(), ..testing::topic(name, paths, ty) }
}

fn message(name: &str, doc: &str, fields: Vec<Field>) -> MessageType {
    MessageType { doc: doc.into(), ..testing::message(name, fields) }
}

pub(crate) fn hook(metric: &str, line: u32, inputs: &[u32]) -> HookPlan {
    HookPlan {
        metric: metric.into(),
        doc: String::new(),
        unit: None,
        direction: None,
        source: "kuka_cell.sesame".into(),
        line,
        inputs: inputs.iter().map(|&input| TopicId(input)).collect(),
    }
}

/// Measures the hook in the campaign of the plan.
pub(crate) fn measured(runner: &mut RunnerPlan, metric: &str) {
    let hook = runner.hooks.iter().find(|hook| hook.metric == metric).expect("the space has the hook");
    let source = MetricSource::Hook { topics: hook.inputs.clone() };
    runner.plan.metrics.push(Metric {
        doc: hook.doc.clone(),
        unit: hook.unit.clone(),
        direction: hook.direction,
        default: Some(0.0),
        line: hook.line,
        ..testing::metric(&hook.metric, source)
    });
}

/// A small space like that of the language's first example, with the campaign's name to choose.
pub(crate) fn small(campaign: &str) -> RunnerPlan {
    let mut runner = RunnerPlan {
        plan: CampaignPlan {
            generator: "sesamec 0.1.0".into(),
            source: "kuka_cell.sesame".into(),
            space: "kuka_cell".into(),
            doc: "The gearbox cell.".into(),
            simulator: testing::in_process("cell", "kuka_cell_sim::Cell", 20_000_000),
            messages: vec![message(
                "SafetyZone",
                "A zone that people may be in.",
                vec![
                    field("zone", "Its name.", Type::Text),
                    field("level", "Distance of the gripper sphere's surface, negative inside.", real("mm")),
                ],
            )],
            topics: vec![
                topic("link0", "", &["joints/R3200/Link0/position"], real("rad")),
                topic("zones", "", &["safetyzones/Z1", "safetyzones/Z2"], Type::Message { id: MessageId(0) }),
                topic("speed", "Of the fastest gripper.", &["cell/gripper_speed"], real("m/s")),
            ],
            nodes: vec![Node {
                publishes: testing::topics(&[0]),
                subscribes: testing::topics(&[1]),
                ..testing::node("plc")
            }],
            metrics: vec![Metric {
                unit: Some("s".into()),
                direction: Some(Direction::Minimise),
                line: 30,
                ..testing::metric("fuzzing_time", MetricSource::FuzzingTime)
            }],
            campaign: Campaign {
                doc: "Finds tests.".into(),
                objectives: vec![MetricId(0)],
                search: Search::new(Strategy::Random, 10),
                seed: 42,
                end_after: 70.0,
                ..testing::campaign(campaign, 0)
            },
            ..testing::minimal()
        },
        operations: vec![],
        hooks: vec![
            HookPlan {
                doc: "R1: intervals of 0.2 s in which the gripper was inside a safety zone.".into(),
                direction: Some(Direction::Maximise),
                ..hook("collision_occurrence", 31, &[1])
            },
            HookPlan { unit: Some("m/s".into()), direction: Some(Direction::Maximise), ..hook("top_speed", 35, &[2]) },
        ],
        simulator_crate: Some("simulator".into()),
        system_file: "kuka_cell.sesame".into(),
    };
    measured(&mut runner, "collision_occurrence");
    runner
}

/// The same space with a simulator that is a program.
pub(crate) fn with_program(campaign: &str) -> RunnerPlan {
    let mut runner = small(campaign);
    runner.simulator_crate = None;
    runner.plan.simulator.transport = Transport::Process {
        program: "python3".into(),
        arguments: vec!["sim.py".into(), "a \"quoted\" {{ one }}".into()],
        step_ns: Some(20_000_000),
    };
    runner
}

/// A plan with every type and every awkward name there is.
pub(crate) fn awkward() -> RunnerPlan {
    let mut runner = small("type");
    let plan = &mut runner.plan;
    plan.messages.push(message(
        "Text",
        "Called like a type of the runtime.\n*/ fn evil() {} // {{ evil }} \u{2028}\" r#\"",
        vec![
            field("type", "A keyword.", Type::Bool),
            field("self", "A keyword that cannot be escaped.", Type::Int { unit: None }),
            field("frameId", "Not in snake case.", Type::Text),
            field("frame_id", "The same in snake case.", Type::Text),
            field("where", "", Type::Point { unit: Some("m".into()) }),
            field("values", "", Type::List { of: Box::new(real("N")) }),
            field("zones", "", Type::List { of: Box::new(Type::Message { id: MessageId(0) }) }),
            field("matrix", "", Type::List { of: Box::new(Type::List { of: Box::new(Type::Int { unit: None }) }) }),
            field("gen", "Reserved since edition 2024.", Type::Message { id: MessageId(0) }),
        ],
    ));
    plan.messages.push(message("empty", "", Vec::new()));
    plan.messages.push(message("Metric", "A hook of the same name takes it.", vec![field("ok", "", Type::Bool)]));
    let unit = |unit: &str| Some(unit.to_owned());
    let first = u32::try_from(plan.topics.len()).expect("few topics");
    let list = |of: Type| Type::List { of: Box::new(of) };
    plan.topics.extend([
        topic("start", "Clashes with the start of a run.", &["a"], Type::Bool),
        topic("end", "", &["b"], Type::Int { unit: unit("V") }),
        topic("ctx", "", &["c"], Type::Text),
        topic("fn", "", &["d"], Type::Point { unit: unit("m") }),
        topic("texts", "", &["e"], list(Type::Text)),
        topic("zoneList", "", &["f"], list(Type::Message { id: MessageId(0) })),
        topic("text", "", &["path \" with \\ quotes \n and */ lines {{ x }}"], Type::Message { id: MessageId(1) }),
        topic("nothing", "", &["h"], Type::Message { id: MessageId(2) }),
        topic("metric_in", "", &["i/1", "j/2"], Type::Message { id: MessageId(3) }),
    ]);
    let all: Vec<u32> = (0..u32::try_from(plan.topics.len()).expect("few topics")).collect();
    runner.hooks.push(HookPlan {
        doc: "Takes everything.\n\nIn two paragraphs. {% raw %}".into(),
        unit: unit("V"),
        direction: Some(Direction::Minimise),
        ..hook("everything", 50, &all)
    });
    for (line, name) in (51..).zip(["self", "match", "metric", "messages", "context", "std", "sesame_runtime", "box"]) {
        runner.hooks.push(hook(name, line, &[first + 8]));
    }
    runner.hooks.push(HookPlan { direction: Some(Direction::Maximise), ..hook("unused", 70, &[0]) });
    for name in ["everything", "self", "match", "metric", "messages", "context", "std", "sesame_runtime", "box"] {
        measured(&mut runner, name);
    }
    let level = FieldRef { topic: TopicId(1), path: vec!["level".into()] };
    runner.plan.metrics.push(Metric {
        unit: unit("mm"),
        line: 71,
        ..testing::metric("last_level", MetricSource::Last { input: level })
    });
    runner
}
