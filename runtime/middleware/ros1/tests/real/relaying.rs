//! Messages through the runner: nothing is lost, and nothing is changed that nobody changes.

use std::time::Instant;

use sesame_plan::testing::{at, evidence_above, field, guarantee, message, monitor, node, operation, test_of, use_of};
use sesame_plan::{
    CampaignPlan, Channel, Choice, Clock, Gate, MessageId, Node, NodeId, Operation, OperationKind, Test, TextTest, Type,
};

use crate::core::{Core, Program};
use crate::system::{Seen, System, peers, plan, remapped, ros};

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
    let mut subscriber = core.ready_peer("subscriber.py", &["/peer", ty, &count_text, "120"]);
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
    assert_eq!(system.notes(), [""; 0]);
    Some((core, system))
}

#[test]
fn six_thousand_joint_states_arrive_byte_for_byte() {
    relay(JOINTS, "sensor_msgs/JointState", 6_000, 2_000);
}

#[test]
#[ignore = "long: how old messages are when they come, with nothing beside them"]
fn thirty_seconds_of_joint_states_at_200_hz_arrive_byte_for_byte() {
    relay(JOINTS, "sensor_msgs/JointState", 6_000, 200);
}

#[test]
fn many_messages_at_once_arrive_byte_for_byte() {
    relay(STRING, "std_msgs/String", 5_000, 2_000);
}

/// As many subscribers as these, by their names: the run begins when all of them are connected to the runner.
fn heard_by(mut plan: CampaignPlan, names: &[&str]) -> CampaignPlan {
    let subscriber = plan.nodes.pop().unwrap();
    plan.nodes.extend(names.iter().map(|name| Node { name: (*name).to_owned(), ..subscriber.clone() }));
    plan
}

/// How many messages `rosbag record` queues. On a busy machine it may be given so many at once, and drops what is
/// beyond.
const FEW: u64 = 100;

/// What `rostopic hz` says of so many messages at 200 Hz of which the runner, a subscriber and a bag have each one.
fn counted_by_tools(count: u64) -> Option<Vec<f64>> {
    let count_text = count.to_string();
    let core = Core::start()?;
    let plan = heard_by(peers(&core.uri(), JOINTS), &["subscriber", "recorder", "meter"]);
    let remapped = remapped(&plan, 0);
    let ty = "sensor_msgs/JointState";
    // It is heard by the runner and the recorder.
    let mut publisher = core.ready_peer("publisher.py", &["/peer", ty, &count_text, "200", "await=2", &remapped[0]]);
    let bag = core.home.path().join("peer.bag").display().to_string();
    // It ends with its last message.
    let record = core.tool("rosbag", &["record", "-l", &count_text, "-O", &bag, "/peer", "/peer/undisturbed"]);
    let mut hz = core.tool("rostopic", &["hz", "/peer"]);
    let mut subscriber = core.ready_peer("subscriber.py", &["/peer", ty, &count_text, "120"]);
    let mut system = System::new(plan);
    let (mut said, mut rates) = (None, Vec::new());
    let finished = system.run(
        &nothing(),
        || publisher.go(),
        || {
            said = said.take().or_else(|| subscriber.said_already());
            let rate = hz.line_already().and_then(|line| line.strip_prefix("average rate: ")?.parse::<f64>().ok());
            rates.extend(rate);
            said.is_some() && !rates.is_empty()
        },
    );
    assert_eq!(finished.unwrap().messages, count);
    assert_eq!(said.unwrap()["received"], count);
    record.ended();
    assert_eq!(counted(&core, &bag), [count_text.as_str(), &count_text]);
    Some(rates)
}

#[test]
fn tools_of_ros_count_what_passes_as_the_runner_does() {
    counted_by_tools(FEW);
}

#[test]
#[ignore = "long: a rate, and messages for which tools have no queue, with nothing beside them"]
fn tools_of_ros_measure_the_rate_at_which_a_thousand_messages_pass() {
    let Some(rates) = counted_by_tools(1_000) else { return };
    assert!(rates.iter().all(|rate| (190.0..210.0).contains(rate)), "{rates:?}");
}

#[test]
fn nodes_of_roscpp_are_relayed_too() {
    played(FEW);
}

#[test]
#[ignore = "long: messages for which tools have no queue, with nothing beside them"]
fn five_hundred_messages_of_nodes_of_roscpp_are_relayed() {
    played(500);
}

/// So many messages of a bag pass from a player to a recorder.
fn played(count: u64) {
    let Some(core) = Core::start() else { return };
    let count_text = count.to_string();
    let ty = "sensor_msgs/JointState";
    let [bag, copy] = ["peer.bag", "copy.bag"].map(|name| core.home.path().join(name).display().to_string());
    // `rosbag record` and `rosbag play` are written with roscpp. A recorder ends with its last message.
    let record = |bag: &str| core.tool("rosbag", &["record", "-l", &count_text, "-O", bag, "/peer"]);
    let mut publisher = core.ready_peer("publisher.py", &["/peer", ty, &count_text, "200"]);
    let recorded = record(&bag);
    publisher.go();
    publisher.said();
    recorded.ended();
    drop(publisher);
    let plan = heard_by(peers(&core.uri(), JOINTS), &["recorder"]);
    let remapped = remapped(&plan, 0);
    let recorded = record(&copy);
    let play = ["play", "-q", "--pause", "--queue", "1000", &bag, &remapped[0], "__name:=play"];
    let _play = core.tool("rosbag", &play);
    let mut system = System::new(plan);
    // Everybody is connected, so it may go on.
    let go_on = || core.tool("rosservice", &["call", "/play/pause_playback", "data: false"]).ended();
    let finished = system.run_seeing(&nothing(), go_on, |seen| seen.messages >= count).unwrap();
    assert_eq!(finished.messages, count);
    recorded.ended();
    assert_eq!(counted(&core, &copy), [count_text]);
}

/// How many messages of each topic a bag has.
fn counted(core: &Core, bag: &str) -> Vec<String> {
    let mut info = core.tool("rosbag", &["info", "-y", "-k", "topics", bag]);
    let lines = std::iter::from_fn(|| info.line_if_any()).take(20);
    lines.filter_map(|line| Some(line.trim().strip_prefix("messages: ")?.to_owned())).collect()
}

/// When messages are lost, in seconds.
const LOST: [f64; 2] = [0.5, 1.5];

/// Messages at 200 Hz, of which an operation drops some: how many. Those that come are all others.
fn dropped() -> Option<u64> {
    let core = Core::start()?;
    let mut plan = peers(&core.uri(), STRING);
    plan.operations = vec![operation(0, OperationKind::Blackhole)];
    let remapped = remapped(&plan, 0);
    let mut publisher = core.ready_peer("publisher.py", &["/peer", "std_msgs/String", "1000000", "200", &remapped[0]]);
    let mut subscriber = core.ready_peer("subscriber.py", &["/peer", "std_msgs/String", "1000000", "120"]);
    let mut system = System::new(plan);
    let test = test_of(vec![use_of(0, LOST[0], LOST[1], Vec::new(), 1)]);
    let (mut sent, mut begun, mut told, mut said) = (None, false, false, None);
    let finished = system.run_seeing(
        &test,
        || {},
        |seen: &Seen<'_>| {
            if !begun {
                begun = true;
                publisher.go();
            }
            if seen.now.seconds() > LOST[1] + 0.5 && !told {
                told = true;
                publisher.stop_publishing();
            }
            sent = sent.take().or_else(|| publisher.said_already());
            let all = sent.as_ref().and_then(|sent| sent["sent"].as_u64());
            if all == Some(seen.messages) && said.is_none() {
                subscriber.end_after(seen.messages - 1);
                said = Some(subscriber.said());
            }
            said.is_some()
        },
    );
    let (sent, said, finished) = (sent.unwrap(), said.unwrap(), finished.unwrap());
    let dropped = finished.operations[0].counters.dropped;
    assert_eq!(sent["sent"], finished.messages);
    assert_eq!(said["received"], finished.messages - dropped, "{said}");
    // They are numbers after each other.
    let [gap] = &said["gaps"].as_array().unwrap()[..] else { panic!("what is missing is in one place: {said}") };
    assert_eq!(gap[1], dropped);
    Some(dropped)
}

#[test]
fn what_an_operation_changes_is_all_that_changes() {
    assert_ne!(dropped(), Some(0), "messages come all the time");
}

#[test]
#[ignore = "long: a rate, with nothing beside it"]
fn an_operation_acts_for_as_long_as_it_is_to() {
    let Some(dropped) = dropped() else { return };
    assert!((190..=210).contains(&dropped), "a second of 200 Hz is missing: {dropped}");
}

#[test]
fn a_header_is_changed_in_its_place() {
    let Some(core) = Core::start() else { return };
    let mut plan = heard_by(peers(&core.uri(), JOINTS), &["subscriber", "tool"]);
    plan.operations = vec![at(&["header", "stamp"], operation(0, OperationKind::ClockSkew))];
    let remapped = remapped(&plan, 0);
    let ty = "sensor_msgs/JointState";
    let mut publisher = core.ready_peer("publisher.py", &["/peer", ty, "1", "10", &remapped[0]]);
    let mut echo = core.tool("rostopic", &["echo", "-p", "-n", "1", "/peer"]);
    let mut subscriber = core.ready_peer("subscriber.py", &["/peer", ty, "1", "120"]);
    let mut system = System::new(plan);
    let test = test_of(vec![use_of(0, 0.0, 1_000.0, vec![Choice::Value { value: 5.0 }], 1)]);
    let mut said = None;
    let before = now();
    let finished = system.run(
        &test,
        || publisher.go(),
        || {
            said = said.take().or_else(|| subscriber.said_already());
            said.is_some()
        },
    );
    finished.unwrap();
    let (names, values) = (echo.line(), echo.line());
    let value = |name: &str| {
        let at = names.split(',').position(|listed| listed == name).unwrap();
        values.split(',').nth(at).unwrap().to_owned()
    };
    let (received, stamp) = (value("%time"), value("field.header.stamp"));
    let [received, stamp] = [received, stamp].map(|nanos| nanos.parse::<i64>().unwrap());
    assert_eq!(value("field.header.seq"), "1", "rospy counts from one");
    assert_eq!(value("field.header.frame_id"), "base");
    assert_eq!(value("field.name6"), "joint_6");
    // It is the time of the stamp that `rostopic` shows.
    assert_eq!(received, stamp);
    let sent = stamp - 5_000_000_000;
    assert!((before..now()).contains(&sent), "five seconds ahead of when it was sent: {sent}");
}

/// The time of the system, in nanoseconds.
fn now() -> i64 {
    let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap().as_nanos();
    i64::try_from(now).unwrap()
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
    let listen = || core.peer("subscriber.py", &["/peer", "std_msgs/String", "1", "120"]);
    let said_by = |peer: &mut Program| peer.said_already().filter(|line| line["received"].is_u64());
    // What one has heard has passed, and the other comes after that.
    let (mut early, mut late, mut heard, mut said) = (listen(), None, None, None);
    let finished = system.run(
        &nothing(),
        || {},
        || {
            heard = heard.take().or_else(|| said_by(&mut early));
            if heard.is_some() {
                said = said_by(late.get_or_insert_with(listen));
            }
            said.is_some()
        },
    );
    finished.unwrap();
    let said = said.unwrap();
    assert_eq!((&said["received"], &said["latching"]), (&1.into(), &"1".into()), "{said}");
}

/// Twenty messages, one in each second of a clock that goes ten times as fast as the wall's: how long that took by the
/// clock and by the wall, in seconds.
fn by_a_clock() -> Option<[f64; 2]> {
    let core = Core::start()?;
    let mut plan = peers(&core.uri(), STRING);
    ros(&mut plan).clock = Clock::Topic { path: "/clock".to_owned() };
    let remapped = remapped(&plan, 0);
    let _clock = core.ready_peer("clock.py", &["/peer", &remapped[0]]);
    let mut subscriber = core.ready_peer("subscriber.py", &["/peer", "std_msgs/String", "20", "120"]);
    let mut system = System::new(plan);
    let (mut said, mut begun, mut sim) = (None, None, 0.0);
    let finished = system.run_seeing(
        &nothing(),
        || begun = Some(Instant::now()),
        |seen| {
            sim = seen.now.seconds();
            said = said.take().or_else(|| subscriber.said_already());
            said.is_some()
        },
    );
    let (messages, wall) = (finished.unwrap().messages, begun.unwrap().elapsed().as_secs_f64());
    assert!(messages as f64 >= sim - 2.0 && messages as f64 <= sim + 2.0, "one in each second: {messages} in {sim} s");
    Some([sim, wall])
}

#[test]
fn time_is_that_of_the_clock() {
    let Some([sim, wall]) = by_a_clock() else { return };
    // A busy machine may hold the clock back, but never makes it faster.
    assert!(sim <= 10.5 * wall, "{sim} s in {wall} s");
}

#[test]
#[ignore = "long: how fast a clock goes, with nothing beside it"]
fn time_goes_as_fast_as_that_of_the_clock() {
    let Some([sim, wall]) = by_a_clock() else { return };
    assert!((3.0 * wall..=10.5 * wall).contains(&sim), "{sim} s in {wall} s");
}

#[test]
fn a_system_that_is_reset_starts_again_at_zero() {
    let Some(core) = Core::start() else { return };
    let mut plan = peers(&core.uri(), STRING);
    plan.nodes.truncate(1);
    ros(&mut plan).clock = Clock::Topic { path: "/clock".to_owned() };
    ros(&mut plan).reset = Some("/reset".to_owned());
    let remapped = remapped(&plan, 0);
    let _clock = core.ready_peer("clock.py", &["/peer", &remapped[0]]);
    let mut system = System::new(plan);
    for _ in 0..5 {
        let mut times = Vec::new();
        system
            .run_seeing(
                &nothing(),
                || {},
                |seen| {
                    times.push(seen.now.seconds());
                    seen.now.seconds() >= 5.0
                },
            )
            .unwrap();
        assert_eq!(times[0], 0.0);
        // It is asked every 20 ms of the clock.
        assert!(times.is_sorted() && times[1] <= 0.02, "{times:?}");
    }
    assert_eq!(system.notes(), [""; 0]);
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
    let wiring = &mut plan.simulator.wiring[0];
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
        core.ready_peer("subscriber.py", &["/peer", "std_msgs/String", count, "120", rule, &format!("__name:={name}")])
    };
    let (mut near, mut far) = (take("near", &rules[2][0], "500"), take("far", "__log:=far.log", "500"));
    let mut system = System::new(plan);
    let test = test_of(vec![use_of(0, 0.0, 1_000.0, Vec::new(), 1)]);
    let mut said = [None, None];
    let finished = system.run(
        &test,
        || [&mut left, &mut right].into_iter().for_each(Program::go),
        || {
            said[1] = said[1].take().or_else(|| far.said_already());
            // All have passed. The last one for the near one is its last.
            if said[1].is_some() {
                near.end_after(199);
                said[0] = Some(near.said());
            }
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
    plan.simulator.wiring[0].cut = false;
    plan.messages = vec![message("Text", vec![field("data", Type::Text)])];
    for topic in &mut plan.topics {
        topic.ty = Type::Message { id: MessageId(0) };
    }
    plan.nodes = vec![
        Node { publishes: sesame_plan::testing::topics(&[0]), ..node("publisher") },
        Node { subscribes: sesame_plan::testing::topics(&[1]), ..node("subscriber") },
    ];
    let mut third = evidence_above("third", 0, 0.5);
    third.inputs[0].field.path = vec!["data".to_owned()];
    third.inputs[0].text = Some(TextTest::Is("3".to_owned()));
    plan.monitors = vec![monitor("arm", 1, vec![third], vec![guarantee("moves", 1, Gate::Evidence(0))])];
    plan.validate().expect("the plan is sound");
    let mut publisher = core.ready_peer("publisher.py", &["/count", "std_msgs/String", "4", "20"]);
    let mut subscriber = core.ready_peer("subscriber.py", &["/state", "std_msgs/String", "2", "120"]);
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
    assert_eq!(system.notes(), [""; 0]);
}
