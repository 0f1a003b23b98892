//! What a scan finds at a master.

use std::time::{Duration, Instant};

use nix::sys::signal::Signal;
use sesame_ros1::scan::{Found, scan};
use sesame_scan::System;

use crate::core::{Core, LIMIT};

#[test]
fn a_scan_finds_nodes_topics_services_and_the_layouts_of_messages() {
    let Some(core) = Core::start() else { return };
    let joints = "sensor_msgs/JointState";
    let _publisher = core.ready_peer("publisher.py", &["/joints", joints, "1", "1", "latch", "__name:=arm"]);
    let killed = core.ready_peer("publisher.py", &["/text", "std_msgs/String", "1", "1", "__name:=killed"]);
    killed.end(Signal::SIGKILL);
    let _subscriber = core.ready_peer("subscriber.py", &["/joints", joints, "1", "600", "__name:=view"]);
    let _any = core.ready_peer("subscriber.py", &["/nowhere", "*", "1", "600", "__name:=any"]);
    let _server = core.ready_peer("server.py", &[]);
    let _talker = core.peer("talker.py", &["__name:=talker"]);
    // It may take long to start, and speak slowly where the machine is busy.
    let begun = Instant::now();
    let found = loop {
        let found = scan(&core.uri(), LIMIT, Duration::from_secs(2)).unwrap();
        let is_quick = |rate: Option<f64>| rate.is_some_and(|rate| rate > 10.0);
        let topics = &found.facts.topics;
        if topics.iter().any(|topic| topic.path == "/angle" && topic.messages > 10 && is_quick(topic.rate)) {
            break found;
        }
        assert!(begun.elapsed() < LIMIT, "more is awaited: {:#?}", found.facts);
    };
    let Found { mut facts, layouts } = found;
    facts.system = System::Ros1 { master: String::new() };
    let angle = facts.topics.iter_mut().find(|topic| topic.path == "/angle").unwrap();
    // They are what the machine makes of it.
    (angle.messages, angle.rate) = (0, None);
    insta::assert_snapshot!(serde_json::to_string_pretty(&facts).unwrap());
    let described = layouts.iter().map(|(name, layout)| (name, layout.last().unwrap().fields.len()));
    let described: Vec<String> = described.map(|(name, fields)| format!("{name}: {fields}")).collect();
    assert_eq!(described, ["sensor_msgs/msg/JointState: 5", "std_msgs/msg/Float64: 1"]);
}

#[test]
fn without_a_master_there_is_nothing_to_scan() {
    let error = |master: &str| scan(master, Duration::from_secs(1), Duration::ZERO).unwrap_err().to_string();
    assert_eq!(error("localhost"), "`localhost` is not the address of a master, such as `http://127.0.0.1:11311`");
    // Below the ports that the system gives to whoever asks for any, and not one of the masters here.
    let nobody = "127.0.0.1:11999";
    let said = error(&format!("http://{nobody}"));
    assert!(said.starts_with(&format!("`{nobody}` does not answer: ")), "{said}");
}
