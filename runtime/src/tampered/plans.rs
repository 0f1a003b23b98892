//! Plans in which one thing is wrong that later code relies on: each is refused with the place of it.

use sesame_plan::condition::{ConditionEnd, ConditionSpace};
use sesame_plan::testing::{self, field, lab, message, minimal, node, ros2, simlog_mut, topic, topics};
use sesame_plan::{
    Activation, ActivationMode, Adjustment, Answer, Bound, CampaignPlan, Channel, Clock, Command, Dimension, Domain,
    Endpoint, Fitted, Interface, InterfaceField, KnownTestId, LabBudget, Launch, Lifecycle, MembersOf, MessageId,
    MessageType, MetricId, MetricSource, Node, NodeId, OperationId, OperationKind, Proxy, RankOrder, Ready, ReadyWhen,
    RelayBudget, Ros, Search, ShapeForm, ShapePlace, Simlog, SimlogVersion, Simulator, StepBy, Stepping, Strategy,
    Target, Topic, TopicId, TopicMembers, Type, WireNames, WireType, Wiring,
};
use sesame_record::sample;

use super::whole::rich;

fn budget(plan: &mut CampaignPlan) -> &mut LabBudget {
    plan.labs[0].budget.as_mut().expect("its lab has one")
}

fn adjustments(plan: &mut CampaignPlan) -> &mut Vec<Adjustment> {
    &mut plan.compensation.as_mut().expect("it has one").adjustments
}

/// Another topic that an operation disturbs, as a whole.
fn further(topic: u32) -> Target {
    Target { topic: TopicId(topic), members: None, places: Vec::new() }
}

/// Makes an operation a scene.
fn scene(plan: &mut CampaignPlan, parameter: Option<&str>, usual: Option<f64>) {
    let operation = &mut plan.operations[2];
    "start_x".clone_into(&mut operation.name);
    operation.topic = None;
    operation.members = None;
    operation.kind = OperationKind::Scene { parameter: parameter.map(str::to_owned), usual };
}

/// A change to a plan, and what is then said of it.
type Altered = (fn(&mut CampaignPlan), &'static str);

#[test]
fn each_thing_that_later_code_relies_on_is_asked_for() {
    let by_time: &[Altered] = &[
        (|plan| plan.schema += 1, "schema: is 3, this release knows 2"),
        (
            |plan| plan.campaign.objectives[0] = MetricId(40),
            "campaign.objectives[0]: there is no metric 40, there are 5",
        ),
        (|plan| plan.metrics[1].direction = None, "campaign.objectives[0]: the metric `fuzzing_time` has no direction"),
        (
            |plan| plan.campaign.objectives[1] = plan.campaign.objectives[0],
            "campaign.objectives: MetricId(1) is there twice",
        ),
        (|plan| plan.campaign.operations[2] = OperationId(4), "campaign.operations[2]: there is no operation 4"),
        (|plan| plan.campaign.count.min = 6, "campaign.count: runs from 6 to 5"),
        (|plan| plan.campaign.end_after = 0.0, "campaign.end_after: 0 is not above 0"),
        (
            |plan| plan.campaign.search = Search::new(Strategy::Nsga2 { population: 0 }, 1),
            "campaign.search.strategy.population: must be at least 1",
        ),
        (
            |plan| plan.campaign.search = Search::Repeat { test: KnownTestId(1), times: 1 },
            "campaign.search.test: there is no test 1",
        ),
        (|plan| plan.campaign.neighbours = Some(0), "campaign.neighbours: must be at least 1"),
        (|plan| plan.campaign.confirm.as_mut().unwrap().times = 0, "campaign.confirm.times: must be at least 1"),
        (|plan| plan.campaign.coverage.as_mut().unwrap().axes[1].cells = 0, "campaign.coverage.axes[1].cells: must be"),
        (
            |plan| plan.campaign.coverage.as_mut().unwrap().axes[1].dimension = Dimension::T1,
            "campaign.coverage.axes: T1 is there twice",
        ),
        (|plan| plan.requirements[3].metric = MetricId(5), "requirements[3].metric: there is no metric 5"),
        (
            |plan| plan.requirements[0].bound = Bound::Within { low: 1.0, high: 0.0 },
            "requirements[0].bound: runs from 1 to 0",
        ),
        (
            |plan| plan.requirements[1].bound = Bound::Above { value: f64::NAN },
            "requirements[1].bound: NaN is not finite",
        ),
        (
            |plan| plan.metrics[0].source = MetricSource::Hook { topics: vec![TopicId(3)] },
            "metrics[0].source.topics[0]: there is no topic 3",
        ),
        (|plan| plan.metrics[2].name = "fuzzing_time".to_owned(), "metrics: \"fuzzing_time\" is there twice"),
        (
            |plan| plan.metrics[2].name = "\u{1b}[2J".to_owned(),
            "metrics[2].name: \"\\u{1b}[2J\" has control characters",
        ),
        (|plan| plan.topics[0].ty = Type::Message { id: MessageId(0) }, "topics[0].type.id: there is no message 0"),
        (|plan| plan.topics[0].paths.clear(), "topics[0].paths: there is none"),
        (
            |plan| plan.messages.push(containing_itself()),
            "messages[0].fields[0].type.of.id: message 0 contains message 0",
        ),
        (|plan| plan.operations[0].further = vec![further(70)], "operations[0].further[0].topic: there is no topic 70"),
        (
            |plan| plan.operations[0].further = vec![further(1), further(1)],
            "operations[0].further: TopicId(1) is there twice",
        ),
        (
            |plan| {
                let members = Some(MembersOf::Chosen(vec![vec![0]]));
                plan.operations[0].further = vec![Target { members, ..further(1) }];
            },
            "operations[0].further[0].members: are not chosen by the last parameter",
        ),
        (|plan| plan.operations[0].topic = None, "operations[0].topic: it acts on one"),
        (
            |plan| plan.operations[0].members = Some(MembersOf::These(vec![70])),
            "operations[0].members: there is no member 70",
        ),
        (
            |plan| plan.operations[0].members = Some(MembersOf::These(Vec::new())),
            "operations[0].members: there is none",
        ),
        (
            |plan| plan.operations[0].members = Some(MembersOf::Chosen(vec![vec![0]])),
            "operations[0].members: are not chosen by the last parameter",
        ),
        (|plan| scene(plan, None, None), "operations[2].kind.usual: is not there, and programs are launched with it"),
        (
            |plan| scene(plan, None, Some(1.0)),
            "operations[2].kind.parameter: `start_x` has neither this nor a place in the arguments",
        ),
        (
            |plan| {
                scene(plan, Some("x"), Some(1.0));
                let arguments = vec!["x:={start_x}".to_owned()];
                let command = Command { program: "./arm".to_owned(), arguments };
                plan.simulator.lifecycle.launch = Some(Launch { command, ready: None });
            },
            "operations[2].kind.parameter: `start_x` has both this and a place in the arguments",
        ),
        (|plan| plan.operations[2].within.end = -1.0, "operations[2].within: runs from 0 to -1"),
        (|plan| plan.operations[2].inclusion = 1.5, "operations[2].inclusion: 1.5 is not in 0..=1"),
        (
            |plan| plan.tests[0].test.operations[0].parameters.clear(),
            "tests[0].test.operations[0].parameters: there are 0",
        ),
        (
            |plan| plan.tests[0].test.operations[0].activation = Activation::Offline,
            "tests[0].test.operations[0].activation: `jitter_link1` acts during the run",
        ),
        (
            |plan| plan.tests[0].expectations[0].metric = MetricId(9),
            "tests[0].expectations[0].metric: there is no metric 9",
        ),
        (|plan| plan.labs.push(lab("lab")), "labs: \"lab\" is there twice"),
        (|plan| plan.labs[0].repeats = 0, "labs[0].repeats: must be at least 1"),
        (|plan| plan.labs[0].cost.per_operation = -1.0, "labs[0].cost.per_operation: -1 is below 0"),
        (|plan| plan.labs[0].cost.base = 0.0, "labs[0].cost: 0 is not above 0"),
        (|plan| plan.labs[0].exclude[0].metric = MetricId(9), "labs[0].exclude[0].metric: there is no metric 9"),
        (|plan| plan.labs[0].rank[0].order = RankOrder::ClosestTo { value: f64::NAN }, "labs[0].rank[0].value: NaN"),
        (|plan| budget(plan).limit = 0.0, "labs[0].budget.limit: 0 is not above 0"),
        (|plan| budget(plan).lambda = 1.5, "labs[0].budget.lambda: 1.5 is not in 0..=1"),
        (|plan| budget(plan).over.push(Dimension::T1), "labs[0].budget.over: T1 is there twice"),
        (|plan| plan.labs[0].tolerances[0].value = -1.0, "labs[0].tolerances[0].value: -1 is below 0"),
        (|plan| plan.labs[0].interlock.push(MetricId(0)), "labs[0].interlock: MetricId(0) is there twice"),
        (
            |plan| plan.labs[0].shapes[0].form = ShapeForm::Sphere { radius: 0.0 },
            "labs[0].shapes[0].form.radius: 0 is not above 0",
        ),
        (
            |plan| plan.labs[0].shapes[1].form = ShapeForm::Box { edges: [1.0, 1.0, f64::NAN] },
            "labs[0].shapes[1].form.edges[2]: NaN is not above 0",
        ),
        (
            |plan| plan.labs[0].shapes[1].place = ShapePlace::Fixed { centre: [f64::INFINITY, 0.0, 0.0] },
            "labs[0].shapes[1].place.centre[0]: inf is not finite",
        ),
        (
            |plan| plan.labs[0].shapes[0].place = ShapePlace::Pose { pose: String::new() },
            "labs[0].shapes[0].place.pose: is empty",
        ),
        (|plan| plan.labs[0].shapes[1].expand = -0.1, "labs[0].shapes[1].expand: -0.1 is below 0"),
        (|plan| plan.labs[0].shapes[1].name = "gripper".to_owned(), "labs[0].shapes: \"gripper\" is there twice"),
        (|plan| plan.labs[0].fits[0].low = -0.1, "labs[0].fits[0].low: -0.1 is below 0"),
        (|plan| plan.labs[0].fits[0].low = 0.6, "labs[0].fits[0]: 0.6 is above 0.5"),
        (
            |plan| plan.labs[0].fits[0].what = Fitted::Delay { topic: Some(TopicId(99)) },
            "labs[0].fits[0].what.topic: there is no topic 99",
        ),
        (|plan| adjustments(plan)[1].levels.clear(), "compensation.adjustments[1].levels: there is none"),
        (|plan| adjustments(plan)[1].levels[0] = f64::NAN, "compensation.adjustments[1].levels[0]: NaN"),
        (|plan| adjustments(plan)[0].levels[0] = -1.0, "compensation.adjustments[0].levels[0]: -1 is below 0"),
    ];
    let by_condition: &[Altered] = &[
        (
            |plan| space_of(plan).variables[1].metric = MetricId(7),
            "activation.space.variables[1].metric: there is no metric 7",
        ),
        (|plan| space_of(plan).variables.clear(), "campaign.activation.space.variables: there is none"),
        (
            |plan| space_of(plan).integers.highest = 0,
            "campaign.activation.space.integers: there are no whole numbers from 1 to 0",
        ),
        (|plan| space_of(plan).integers.highest = i64::MAX, "campaign.activation.space.integers: there are no"),
        (|plan| space_of(plan).depth = 0, "campaign.activation.space.depth: must be at least 1"),
        (|plan| space_of(plan).depth = 2_000_000, "campaign.activation.space.depth: is 2000000, more than 10"),
        (
            |plan| plan.operations[4].parameters[0].domain = Domain::Texts { texts: Vec::new() },
            "operations[4].parameters[0].domain: there is none",
        ),
        (|plan| plan.operations[4].topic = Some(TopicId(0)), "operations[4].topic: it acts on none"),
    ];
    let of_ros: &[Altered] = &[
        (|plan| in_domain(plan, 233), "simulator.transport.domain: is 233, more than 232"),
        (|plan| plan.simulator.ros = None, "simulator.transport: has no `clock`, or no `interfaces`"),
        (
            |plan| plan.simulator.proxies.push(proxy()),
            "simulator.transport: a simulator of kind `ros2` has no `proxies`",
        ),
        (|plan| ros(plan).step.as_mut().unwrap().step_ns = 0, "simulator.transport.step_ns: must be positive"),
        (|plan| ros(plan).interfaces.reverse(), "interfaces[0].fields[0].type: `test_msgs/msg/Inner` is not before it"),
        (
            |plan| ros(plan).interfaces[0].name = "test_msgs/msg/Outer".to_owned(),
            "interfaces[1].fields[0].type: `test_msgs/msg/Inner` is not before it",
        ),
        (
            |plan| {
                let first = ros(plan).interfaces[0].clone();
                ros(plan).interfaces.push(first);
            },
            "interfaces[2].name: `test_msgs/msg/Inner` is there twice",
        ),
        (|plan| plan.simulator.wiring.clear(), "simulator.transport.wiring: there are 0 for 1 topics"),
        (|plan| plan.simulator.wiring[0].publishers[0] = NodeId(1), "wiring[0].publishers[0]: there is no node 1"),
        (|plan| plan.simulator.wiring[0].subscribers.push(NodeId(7)), "wiring[0].subscribers[0]: there is no node 7"),
        (|plan| plan.simulator.wiring[0].cut = false, "wiring[0]: distinguishes nodes of a topic that is not cut"),
        (|plan| plan.topics[0].interface = None, "topics[0].interface: there is none"),
        (
            |plan| plan.topics[0].interface = Some("test_msgs/msg/Other".to_owned()),
            "topics[0].interface: there is no interface `test_msgs/msg/Other`",
        ),
        (|plan| plan.nodes[0].answers[0].to = TopicId(1), "nodes[0].answers[0].to: there is no topic 1"),
        (|plan| plan.nodes[0].answers[0].with = TopicId(2), "nodes[0].answers[0].with: there is no topic 2"),
        (|plan| plan.nodes[0].subscribes.clear(), "nodes[0].answers[0].to: is not a topic that the node subscribes to"),
        (|plan| plan.nodes[0].publishes.clear(), "nodes[0].answers[0].with: is not a topic that the node publishes"),
        (
            |plan| {
                let node = &mut plan.nodes[0];
                node.every_step = vec![TopicId(0)];
                node.answers.clear();
                node.publishes.clear();
            },
            "nodes[0].every_step[0]: is not a topic that the node publishes",
        ),
        (
            |plan| plan.nodes[0].publishes = vec![TopicMembers::Only { topic: TopicId(0), members: vec![1] }],
            "nodes[0].publishes[0].members[0]: there is no member 1",
        ),
        (
            |plan| plan.nodes[0].publishes = vec![TopicMembers::Only { topic: TopicId(0), members: vec![0] }],
            "nodes[0].publishes[0].members: are not some of a group",
        ),
        (|plan| ready(plan).within = 0.0, "nodes[0].launch.ready.within: 0 is not above 0"),
        (|plan| ready(plan).within = f64::INFINITY, "nodes[0].launch.ready.within: inf is not above 0"),
        (|plan| ready(plan).when = ReadyWhen::Topic { topic: TopicId(9) }, "launch.ready.when: there is no topic 9"),
        (|plan| ros(plan).clock = Clock::Wall, "simulator.lifecycle.launch.ready.when: the simulator has no clock"),
        (
            |plan| plan.simulator.lifecycle.relay_budget.as_mut().unwrap().jitter = Some(-1.0),
            "simulator.lifecycle.relay_budget.jitter: -1 is not above 0",
        ),
    ];
    let of_simlog: &[Altered] = &[
        (
            |plan| plan.simulator.ros = Some(Ros::default()),
            "simulator.transport: a simulator of kind `simlog` has no `clock` and no `interfaces`",
        ),
        (|plan| plan.simulator.wiring.push(Wiring::default()), "simulator.transport.wiring: there are 1 for 0 topics"),
        (|plan| simlog(plan).step_ns = 0, "simulator.transport.step_ns: must be positive"),
        (|plan| simlog(plan).step_ns = 1_500_000, "step_ns: is 1500000, which is not a whole number of milliseconds"),
        (|plan| simlog(plan).url = "localhost:8089".to_owned(), "simulator.transport.url: is `localhost:8089`, not"),
        (|plan| simlog(plan).url = "https://".to_owned(), "simulator.transport.url: is `https://`, not"),
        (|plan| simlog(plan).topics_url = Some("there".to_owned()), "simulator.transport.topics_url: is `there`, not"),
        (
            |plan| simlog(plan).protocol = SimlogVersion::V2,
            "simulator.transport.marker: is there, but version 2 of the protocol has none",
        ),
        (
            |plan| simlog(plan).names.injected = simlog(plan).names.cut.clone(),
            "simulator.transport.names.injected: names the same topic as what it replaces",
        ),
        (|plan| simlog(plan).names.bare.push(String::new()), "simulator.transport.names.bare[0]: is in every name"),
        (|plan| simlog(plan).cut[0] = TopicId(1), "simulator.transport.cut[0]: there is no topic 1"),
        (|plan| plan.topics[0].interface = Some(String::new()), "topics[0].interface: is empty"),
        (|plan| plan.topics[0].channel = Channel::Request, "simulator.transport: has no services, and `joints` is one"),
    ];
    let conditional = sample::offline_plan(ConditionEnd::Condition);
    for (whole, altered) in
        [(rich(), by_time), (conditional, by_condition), (arm(), of_ros), (over_simlog(), of_simlog)]
    {
        whole.validate().unwrap();
        for (alter, words) in altered {
            let mut plan = whole.clone();
            alter(&mut plan);
            let said = plan.validate().unwrap_err().to_string();
            assert!(said.contains(words), "{said:?} does not say {words:?}");
            // What is not finite cannot be written in JSON, and does not come out of it.
            let read = serde_json::from_str::<CampaignPlan>(&serde_json::to_string(&plan).unwrap());
            let read = read.unwrap_err().to_string();
            assert!(read.contains(words) || read.contains("null"), "{read:?} does not say {words:?}");
        }
    }
}

/// A plan of a ROS 2 system.
fn arm() -> CampaignPlan {
    let interface = |name: &str, ty: WireType| Interface {
        name: format!("test_msgs/msg/{name}"),
        fields: vec![InterfaceField { name: "value".to_owned(), ty }],
    };
    let inner = WireType::Interface { name: "test_msgs/msg/Inner".to_owned() };
    let launch = |when| Launch {
        command: Command { program: "./arm".to_owned(), arguments: Vec::new() },
        ready: Some(Ready { when, within: 5.0 }),
    };
    let answers = vec![Answer { to: TopicId(0), with: TopicId(0) }];
    let path = "/clock".to_owned();
    let ros = Ros {
        clock: Clock::Topic { path: path.clone() },
        step: Some(Stepping { step_ns: 1, by: StepBy::Topic { path } }),
        interfaces: vec![
            interface("Inner", WireType::STRING),
            interface("Outer", WireType::Sequence { of: Box::new(inner), bound: None }),
        ],
        ..Ros::default()
    };
    let wiring = vec![Wiring { cut: true, publishers: vec![NodeId(0)], ..Wiring::default() }];
    let lifecycle = Lifecycle {
        launch: Some(launch(ReadyWhen::Clock)),
        terminate: None,
        relay_budget: Some(RelayBudget { latency: None, jitter: Some(1.0) }),
    };
    let topic =
        Topic { interface: Some("test_msgs/msg/Outer".to_owned()), ..topic("joints", &["/joints"], Type::Bool) };
    let ready_at = ReadyWhen::Topic { topic: TopicId(0) };
    CampaignPlan {
        simulator: Simulator { ros: Some(ros), lifecycle, ..ros2(232, wiring) },
        topics: vec![topic],
        nodes: vec![Node {
            publishes: topics(&[0]),
            subscribes: topics(&[0]),
            launch: Some(launch(ready_at)),
            answers,
            ..node("arm")
        }],
        ..minimal()
    }
}

/// A plan of a simulator that speaks SimlogAPI.
fn over_simlog() -> CampaignPlan {
    let mut simulator = testing::simlog("http://localhost:8089");
    let settings = simlog_mut(&mut simulator);
    (settings.protocol, settings.names) = (SimlogVersion::V3, WireNames::of_version_3());
    (settings.marker, settings.cut) = (Some("SIMLOG://step".to_owned()), vec![TopicId(0)]);
    CampaignPlan {
        simulator,
        topics: vec![Topic { interface: Some("STRING".to_owned()), ..topic("joints", &["joints"], Type::Bool) }],
        ..minimal()
    }
}

fn simlog(plan: &mut CampaignPlan) -> &mut Simlog {
    simlog_mut(&mut plan.simulator)
}

fn ros(plan: &mut CampaignPlan) -> &mut Ros {
    plan.simulator.ros.as_mut().expect("it is a system of ROS 2")
}

fn in_domain(plan: &mut CampaignPlan, wanted: u16) {
    let Some(Endpoint::Domain(domain)) = plan.simulator.endpoint() else { panic!("it is a system of ROS 2") };
    *domain = wanted;
}

fn proxy() -> Proxy {
    Proxy { node: NodeId(0), url: "ws://127.0.0.1:9190".to_owned(), token: None, identity: None, public: false }
}

fn ready(plan: &mut CampaignPlan) -> &mut Ready {
    plan.nodes[0].launch.as_mut().and_then(|launch| launch.ready.as_mut()).expect("the node is launched")
}

fn containing_itself() -> MessageType {
    let ty = Type::List { of: Box::new(Type::Message { id: MessageId(0) }) };
    message("Loop", vec![field("again", ty)])
}

/// JSON has no such numbers, so only code could make these plans.
#[test]
fn bounds_of_a_variable_are_finite_and_in_order() {
    for (low, high, words) in [
        (Some(f64::NAN), None, "activation.space.variables[0].low: NaN is not finite"),
        (None, Some(f64::INFINITY), "activation.space.variables[0].high: inf is not finite"),
        (Some(2.0), Some(1.0), "activation.space.variables[0]: runs from 2 to 1"),
    ] {
        let mut plan = sample::offline_plan(ConditionEnd::Condition);
        let variable = &mut space_of(&mut plan).variables[0];
        (variable.low, variable.high) = (low, high);
        let said = plan.validate().unwrap_err().to_string();
        assert!(said.contains(words), "{said:?} does not say {words:?}");
    }
}

fn space_of(plan: &mut CampaignPlan) -> &mut ConditionSpace {
    match &mut plan.campaign.activation {
        ActivationMode::Condition { space } => space,
        ActivationMode::Time => panic!("conditions switch its operations"),
    }
}
