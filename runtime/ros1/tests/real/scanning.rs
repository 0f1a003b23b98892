//! What a scan finds at a master.

use std::time::Duration;

use nix::sys::signal::Signal;
use sesame_ros1::scan::{Found, scan};
use sesame_scan::System;

use crate::core::{Core, free_port};

#[test]
fn a_scan_finds_nodes_topics_services_and_the_layouts_of_messages() {
    let Some(core) = Core::start() else { return };
    let joints = "sensor_msgs/JointState";
    let _publisher = core.ready_peer("publisher.py", &["/joints", joints, "1", "1", "latch", "__name:=arm"]);
    let killed = core.ready_peer("publisher.py", &["/text", "std_msgs/String", "1", "1", "__name:=killed"]);
    killed.end(Signal::SIGKILL);
    let _subscriber = core.ready_peer("subscriber.py", &["/joints", joints, "1", "60", "__name:=view"]);
    let _any = core.ready_peer("subscriber.py", &["/nowhere", "*", "1", "60", "__name:=any"]);
    let _server = core.ready_peer("server.py", &[]);
    let _talker = core.peer("talker.py", &["__name:=talker"]);
    let mut found = scan(&core.uri(), Duration::from_secs(20), Duration::from_secs(2)).unwrap();
    // It may take long to start.
    for _ in 0..20 {
        if found.facts.topics.iter().any(|topic| topic.path == "/angle" && topic.messages > 0) {
            break;
        }
        found = scan(&core.uri(), Duration::from_secs(20), Duration::from_secs(2)).unwrap();
    }
    let Found { mut facts, layouts } = found;
    facts.system = System::Ros1 { master: String::new() };
    let angle = facts.topics.iter_mut().find(|topic| topic.path == "/angle").unwrap();
    let (messages, rate) = (std::mem::take(&mut angle.messages), angle.rate.take().unwrap());
    assert!(messages > 10 && rate > 10.0, "{messages} messages, {rate} per second");
    insta::assert_snapshot!(serde_json::to_string_pretty(&facts).unwrap());
    let described = layouts.iter().map(|(name, layout)| (name, layout.last().unwrap().fields.len()));
    let described: Vec<String> = described.map(|(name, fields)| format!("{name}: {fields}")).collect();
    assert_eq!(described, ["sensor_msgs/msg/JointState: 5", "std_msgs/msg/Float64: 1"]);
}

#[test]
fn without_a_master_there_is_nothing_to_scan() {
    let error = |master: &str| scan(master, Duration::from_secs(1), Duration::ZERO).unwrap_err().to_string();
    assert_eq!(error("localhost"), "`localhost` is not the address of a master, such as `http://127.0.0.1:11311`");
    let nobody = format!("127.0.0.1:{}", free_port());
    let said = error(&format!("http://{nobody}"));
    assert!(said.starts_with(&format!("`{nobody}` does not answer: ")), "{said}");
}
