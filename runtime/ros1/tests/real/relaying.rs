//! Messages through the runner: nothing is lost, and nothing is changed that nobody changes.

use std::time::{Duration, Instant};

use nix::sys::signal::Signal;
use sesame_plan::testing::{at, evidence_above, field, guarantee, message, monitor, node, operation, test_of, use_of};
use sesame_plan::{
    Channel, Choice, Clock, Gate, MessageId, Node, NodeId, Operation, OperationKind, Test, TextTest, TopicId, Type,
};

use crate::core::{Core, Program};
use crate::system::{System, peers, plan, remapped, ros1};

const STRING: &str = "std_msgs/msg/String";
const JOINTS: &str = "sensor_msgs/msg/JointState";

fn nothing() -> Test {
    test_of(Vec::new())
}

/// Messages from a publisher to a subscriber through the runner, with nothing lost and nothing changed.
fn relay(interface: &str, ty: &str, count: u64, rate: u32) -> Option<(Core, System)> {
    let core = Core::start()?;
    let plan = peers(&core.uri(), interface);
    let (count_text, rate) = (count.to_string(), rate.to_string());
    let remapped = remapped(&plan, 0);
    let mut publisher = core.ready_peer("publisher.py", &["/peer", ty, &count_text, &rate, &remapped[0]]);
    let mut subscriber = core.ready_peer("subscriber.py", &["/peer", ty, &count_text, "20"]);
    let mut system = System::new(plan);
    let mut said = None;
    let finished = system.run(
        &nothing(),
        || publisher.go(),
        || {
            said = said.take().or_else(|| subscriber.said_already());
            said.is_some()
        },
    );
    let (said, sent) = (said.unwrap(), publisher.said());
    assert_eq!(said["received"], count, "{said}");
    assert_eq!(said["digest"], sent["digest"], "byte for byte");
    if let [half, most] = said["ages"].as_array().unwrap().as_slice() {
        eprintln!("half of {count} messages came within {half} µs, 99 % within {most} µs");
    }
    assert_eq!(said["callerid"], "/sesame_relay_1");
    assert_eq!(said["type"], ty);
    assert_eq!(finished.unwrap().messages, count);
    assert_eq!(system.incidents().notes, [""; 0]);
    Some((core, system))
}

#[test]
fn thirty_seconds_of_joint_states_at_200_hz_arrive_byte_for_byte() {
    relay(JOINTS, "sensor_msgs/JointState", 6_000, 200);
}

#[test]
fn many_messages_at_once_arrive_byte_for_byte() {
    relay(STRING, "std_msgs/String", 5_000, 2_000);
}

#[test]
fn tools_of_ros_count_what_passes_as_the_runner_does() {
    let Some(core) = Core::start() else { return };
    let plan = peers(&core.uri(), JOINTS);
    let remapped = remapped(&plan, 0);
    let ty = "sensor_msgs/JointState";
    let mut publisher = core.ready_peer("publisher.py", &["/peer", ty, "1000", "200", &remapped[0]]);
    let bag = core.home.path().join("peer.bag");
    let record = core.tool("rosbag", &["record", "-O", &bag.display().to_string(), "/peer", "/peer/undisturbed"]);
    let mut hz = core.tool("rostopic", &["hz", "/peer"]);
    // The recorder and the tool are subscribers that the plan does not know.
    let mut subscriber = core.ready_peer("subscriber.py", &["/peer", ty, "1000", "20"]);
    let mut system = System::new(plan);
    let mut said = None;
    let begun = Instant::now();
    let mut gone = false;
    let finished = system.run(
        &nothing(),
        || {},
        || {
            // They come a while after the others.
            if !gone && begun.elapsed() > Duration::from_secs(5) {
                publisher.go();
                gone = true;
            }
            said = said.take().or_else(|| subscriber.said_already());
            said.is_some()
        },
    );
    assert_eq!(finished.unwrap().messages, 1000);
    assert_eq!(said.unwrap()["received"], 1000);
    let rates: Vec<String> = (0..8).map(|_| hz.line()).filter(|line| line.starts_with("average rate")).collect();
    let rate = |line: &String| line.rsplit(' ').next().unwrap().parse::<f64>().unwrap();
    assert!(rates.iter().map(rate).all(|rate| (190.0..210.0).contains(&rate)), "{rates:?}");
    assert!(!rates.is_empty());
    record.end(Signal::SIGINT);
    assert_eq!(counted(&core, &bag.display().to_string()), ["1000", "1000"]);
}

#[test]
fn nodes_of_roscpp_are_relayed_too() {
    let Some(core) = Core::start() else { return };
    let ty = "sensor_msgs/JointState";
    let [bag, copy] = ["peer.bag", "copy.bag"].map(|name| core.home.path().join(name).display().to_string());
    // `rosbag record` and `rosbag play` are written with roscpp.
    let mut publisher = core.ready_peer("publisher.py", &["/peer", ty, "500", "200"]);
    let record = core.tool("rosbag", &["record", "-O", &bag, "/peer"]);
    await_subscriber(&core);
    publisher.go();
    publisher.said();
    std::thread::sleep(Duration::from_millis(500));
    record.end(Signal::SIGINT);
    drop(publisher);
    let mut plan = peers(&core.uri(), JOINTS);
    let remapped = remapped(&plan, 0);
    // It publishes as soon as somebody listens; the recorder comes after it is offered.
    plan.nodes.clear();
    let record = core.tool("rosbag", &["record", "-O", &copy, "/peer"]);
    let play = ["play", "-q", "--wait-for-subscribers", "-d", "6", &bag, &remapped[0]];
    let _play = core.tool("rosbag", &play);
    let mut system = System::new(plan);
    let begun = Instant::now();
    let finished = system.run(&nothing(), || {}, || begun.elapsed() > Duration::from_secs(12)).unwrap();
    assert_eq!(finished.messages, 500);
    record.end(Signal::SIGINT);
    assert_eq!(counted(&core, &copy), ["500"]);
}

/// Waits until a program listens to `/peer`.
fn await_subscriber(core: &Core) {
    let limit = Instant::now() + Duration::from_secs(20);
    loop {
        let facts = sesame_ros1::scan::scan(&core.uri(), Duration::ZERO, Duration::ZERO).unwrap().facts;
        if facts.topics.iter().any(|topic| topic.path == "/peer" && !topic.subscribers.is_empty()) {
            // It is registered, and connects next.
            std::thread::sleep(Duration::from_secs(1));
            return;
        }
        assert!(Instant::now() < limit, "nobody listens");
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// How many messages of each topic a bag has.
fn counted(core: &Core, bag: &str) -> Vec<String> {
    let mut info = core.tool("rosbag", &["info", "-y", "-k", "topics", bag]);
    let lines = std::iter::from_fn(|| info.line_if_any()).take(20);
    lines.filter_map(|line| Some(line.trim().strip_prefix("messages: ")?.to_owned())).collect()
}

#[test]
fn what_an_operation_changes_is_all_that_changes() {
    let Some(core) = Core::start() else { return };
    let mut plan = peers(&core.uri(), STRING);
    plan.operations = vec![operation(0, OperationKind::Blackhole)];
    let remapped = remapped(&plan, 0);
    let mut publisher = core.ready_peer("publisher.py", &["/peer", "std_msgs/String", "400", "200", &remapped[0]]);
    let mut subscriber = core.ready_peer("subscriber.py", &["/peer", "std_msgs/String", "400", "3"]);
    let mut system = System::new(plan);
    let test = test_of(vec![use_of(0, 0.5, 1.0, Vec::new(), 1)]);
    let mut said = None;
    let finished = system.run(
        &test,
        || publisher.go(),
        || {
            said = said.take().or_else(|| subscriber.said_already());
            said.is_some()
        },
    );
    let received = said.unwrap()["received"].as_u64().unwrap();
    assert!((290..=310).contains(&received), "half a second of 200 Hz is missing: {received}");
    assert_eq!(finished.unwrap().messages, 400);
}

#[test]
fn a_header_is_changed_in_its_place() {
    let Some(core) = Core::start() else { return };
    let mut plan = peers(&core.uri(), JOINTS);
    plan.operations = vec![at(&["header", "stamp"], operation(0, OperationKind::ClockSkew))];
    let remapped = remapped(&plan, 0);
    let ty = "sensor_msgs/JointState";
    let mut publisher = core.ready_peer("publisher.py", &["/peer", ty, "1", "10", &remapped[0]]);
    let mut echo = core.tool("rostopic", &["echo", "-p", "-n", "1", "/peer"]);
    let mut subscriber = core.ready_peer("subscriber.py", &["/peer", ty, "1", "20"]);
    let mut system = System::new(plan);
    let test = test_of(vec![use_of(0, 0.0, 1_000.0, vec![Choice::Value { value: 5.0 }], 1)]);
    let (mut said, begun, mut gone) = (None, Instant::now(), false);
    let finished = system.run(
        &test,
        || {},
        || {
            if !gone && begun.elapsed() > Duration::from_secs(4) {
                publisher.go();
                gone = true;
            }
            said = said.take().or_else(|| subscriber.said_already());
            said.is_some()
        },
    );
    finished.unwrap();
    let (names, values) = (echo.line(), echo.line());
    let value = |name: &str| {
        let at = names.split(',').position(|it| it == name).unwrap();
        values.split(',').nth(at).unwrap().to_owned()
    };
    let (received, stamp) = (value("%time"), value("field.header.stamp"));
    let [received, stamp] = [received, stamp].map(|nanos| nanos.parse::<i64>().unwrap());
    assert_eq!(value("field.header.seq"), "1", "rospy counts from one");
    assert_eq!(value("field.header.frame_id"), "base");
    assert_eq!(value("field.name6"), "joint_6");
    // It is the time of the stamp that `rostopic` shows.
    assert_eq!(received, stamp);
    let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap().as_nanos();
    let ahead = stamp - i64::try_from(now).unwrap();
    assert!((0..5_000_000_000).contains(&ahead), "five seconds ahead of when it was sent: {ahead}");
}

#[test]
fn latched_messages_are_there_for_those_who_come_later() {
    let Some(core) = Core::start() else { return };
    let mut plan = peers(&core.uri(), STRING);
    plan.nodes.truncate(1);
    let remapped = remapped(&plan, 0);
    let latched = ["/peer", "std_msgs/String", "3", "100", "latch", "at-once", &remapped[0]];
    let mut publisher = core.ready_peer("publisher.py", &latched);
    assert_eq!(publisher.said()["sent"], 3);
    let mut system = System::new(plan);
    let (mut subscriber, mut said, begun) = (None, None, Instant::now());
    let finished = system.run(
        &nothing(),
        || {},
        || {
            if begun.elapsed() > Duration::from_secs(1) {
                let late = subscriber
                    .get_or_insert_with(|| core.peer("subscriber.py", &["/peer", "std_msgs/String", "1", "20"]));
                said = late.said_already().filter(|it| it["received"].is_u64()).or(said.take());
            }
            said.is_some()
        },
    );
    finished.unwrap();
    let said = said.unwrap();
    assert_eq!((&said["received"], &said["latching"]), (&1.into(), &"1".into()), "{said}");
}

#[test]
fn time_is_that_of_the_clock() {
    let Some(core) = Core::start() else { return };
    let mut plan = peers(&core.uri(), STRING);
    ros1(&mut plan).clock = Clock::Topic { path: "/clock".to_owned() };
    let remapped = remapped(&plan, 0);
    let _clock = core.ready_peer("clock.py", &["/peer", &remapped[0]]);
    let mut subscriber = core.ready_peer("subscriber.py", &["/peer", "std_msgs/String", "20", "20"]);
    let mut system = System::new(plan);
    let (mut said, mut begun) = (None, None);
    let finished = system.run(
        &nothing(),
        || begun = Some(Instant::now()),
        || {
            said = said.take().or_else(|| subscriber.said_already());
            said.is_some()
        },
    );
    let (messages, wall) = (finished.unwrap().messages, begun.unwrap().elapsed().as_secs_f64());
    let sim = system.now().nanos() as f64 / 1e9;
    assert!(messages as f64 >= sim - 2.0 && messages as f64 <= sim + 2.0, "one in each second: {messages} in {sim} s");
    // A busy machine may hold the clock back, but never makes it faster.
    assert!((3.0 * wall..=10.5 * wall).contains(&sim), "{sim} s in {wall} s");
}

#[test]
fn a_system_that_is_reset_starts_again_at_zero() {
    let Some(core) = Core::start() else { return };
    let mut plan = peers(&core.uri(), STRING);
    plan.nodes.truncate(1);
    ros1(&mut plan).clock = Clock::Topic { path: "/clock".to_owned() };
    ros1(&mut plan).reset = Some("/reset".to_owned());
    let remapped = remapped(&plan, 0);
    let _clock = core.ready_peer("clock.py", &["/peer", &remapped[0]]);
    let mut system = System::new(plan);
    for _ in 0..5 {
        let begun = Instant::now();
        system.run(&nothing(), || {}, || begun.elapsed() > Duration::from_secs(1)).unwrap();
        let seconds = system.now().nanos() as f64 / 1e9;
        assert!((1.0..=15.0).contains(&seconds), "a second at ten times its speed: {seconds}");
    }
    assert_eq!(system.incidents().notes, [""; 0]);
}

#[test]
fn nodes_that_operations_tell_apart_have_ways_of_their_own() {
    let Some(core) = Core::start() else { return };
    let mut plan = peers(&core.uri(), STRING);
    let [publisher, subscriber] = [plan.nodes[0].clone(), plan.nodes[1].clone()];
    let named = |node: &Node, name: &str| Node { name: name.to_owned(), ..node.clone() };
    plan.nodes = vec![
        named(&publisher, "left"),
        named(&publisher, "right"),
        named(&subscriber, "near"),
        named(&subscriber, "far"),
    ];
    let wiring = &mut ros1(&mut plan).wiring[0];
    (wiring.publishers, wiring.subscribers) = (vec![NodeId(0), NodeId(1)], vec![NodeId(2)]);
    // What is from the left one never reaches the near one.
    let hole = Operation { from: vec![NodeId(0)], to: vec![NodeId(2)], ..operation(0, OperationKind::Blackhole) };
    plan.operations = vec![hole];
    let rules: Vec<Vec<String>> = (0..4).map(|node| remapped(&plan, node)).collect();
    assert_eq!(rules[0], ["/peer:=/peer/from/left"]);
    assert_eq!(rules[2], ["/peer:=/peer/to/near"]);
    assert!(rules[3].is_empty());
    let publish = |name: &str, rule: &str, count: &str| {
        core.ready_peer("publisher.py", &["/peer", "std_msgs/String", count, "200", rule, &format!("__name:={name}")])
    };
    let (mut left, mut right) = (publish("left", &rules[0][0], "300"), publish("right", &rules[1][0], "200"));
    let take = |name: &str, rule: &str, count: &str| {
        core.ready_peer("subscriber.py", &["/peer", "std_msgs/String", count, "4", rule, &format!("__name:={name}")])
    };
    let (mut near, mut far) = (take("near", &rules[2][0], "500"), take("far", "__log:=far.log", "500"));
    let mut system = System::new(plan);
    let test = test_of(vec![use_of(0, 0.0, 1_000.0, Vec::new(), 1)]);
    let mut said = [None, None];
    let finished = system.run(
        &test,
        || [&mut left, &mut right].into_iter().for_each(Program::go),
        || {
            said[0] = said[0].take().or_else(|| near.said_already());
            said[1] = said[1].take().or_else(|| far.said_already());
            said.iter().all(Option::is_some)
        },
    );
    assert_eq!(finished.unwrap().messages, 500);
    let received = said.map(|said| said.unwrap()["received"].as_u64().unwrap());
    assert_eq!(received, [200, 500]);
}

#[test]
fn a_state_reaches_its_subscribers_although_no_publisher_says_of_which_type_it_is() {
    let Some(core) = Core::start() else { return };
    let topics = [("count", "/count", STRING, Channel::Topic), ("state", "/state", STRING, Channel::Topic)];
    let mut plan = plan(&core.uri(), &topics);
    ros1(&mut plan).wiring[0].cut = false;
    plan.messages = vec![message("Text", vec![field("data", Type::Text)])];
    for topic in &mut plan.topics {
        topic.ty = Type::Message { id: MessageId(0) };
    }
    plan.nodes = vec![
        Node { publishes: vec![TopicId(0)], ..node("publisher") },
        Node { subscribes: vec![TopicId(1)], ..node("subscriber") },
    ];
    let mut third = evidence_above("third", 0, 0.5);
    third.inputs[0].field.path = vec!["data".to_owned()];
    third.inputs[0].text = Some(TextTest::Is("3".to_owned()));
    plan.monitors = vec![monitor("arm", 1, vec![third], vec![guarantee("moves", 1, Gate::Evidence(0))])];
    plan.validate().expect("the plan is sound");
    let mut publisher = core.ready_peer("publisher.py", &["/count", "std_msgs/String", "4", "20"]);
    let mut subscriber = core.ready_peer("subscriber.py", &["/state", "std_msgs/String", "2", "20"]);
    let (mut system, mut said) = (System::new(plan), None);
    let finished = system.run(
        &nothing(),
        || publisher.go(),
        || {
            said = said.take().or_else(|| subscriber.said_already());
            said.is_some()
        },
    );
    let (said, finished) = (said.unwrap(), finished.unwrap());
    assert_eq!(said["received"], 2, "`unsafe` at time zero, and `moves`: {said}");
    assert_eq!(said["md5sum"], "992ce8a1687cec8c8bd883ec73ca41d1", "that of the real definition");
    assert_eq!(finished.messages, 6, "four numbers and two states");
    assert_eq!(system.incidents().notes, [""; 0]);
}
