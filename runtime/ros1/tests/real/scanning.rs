//! What a scan finds at a master.

use std::time::Duration;

use nix::sys::signal::Signal;
use sesame_ros1::scan::scan;

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
    let mut facts = scan(&core.uri(), Duration::from_secs(20)).unwrap();
    facts.master.clear();
    insta::assert_snapshot!(serde_json::to_string_pretty(&facts).unwrap());
}

#[test]
fn without_a_master_there_is_nothing_to_scan() {
    let error = |master: &str| scan(master, Duration::from_secs(1)).unwrap_err().to_string();
    assert_eq!(error("localhost"), "`localhost` is not the address of a master, such as `http://127.0.0.1:11311`");
    let nobody = format!("127.0.0.1:{}", free_port());
    let said = error(&format!("http://{nobody}"));
    assert!(said.starts_with(&format!("`{nobody}` does not answer: ")), "{said}");
}
