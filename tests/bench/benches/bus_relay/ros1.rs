//! Between nodes of ROS 1.

use std::path::PathBuf;
use std::process::Command;
use std::thread;
use std::time::Duration;

use sesame_bench::ways::{Measured, beside, named, plan, print, rounds};
use sesame_tests::workspace;

use crate::processes::{Program, free_port, listens};
use crate::{JOINT, JOINTS, Size, space};

/// The forwarder of ROS.
const RELAY: &str = "/usr/lib/topic_tools/relay";

struct Way {
    name: &'static str,
    /// Publisher and subscriber, which measures.
    peer: Program,
}

impl Way {
    fn measure(&mut self, count: u64) -> Measured {
        self.peer.tell(&count.to_string());
        let said = self.peer.says("}");
        let said: serde_json::Value = serde_json::from_str(&said).expect("it speaks JSON");
        let mut latencies: Vec<u64> =
            serde_json::from_value(said["nanoseconds"].clone()).expect("it says how long messages took");
        assert_eq!(latencies.len() as u64, count, "{}: not all have come", self.name);
        latencies.sort_unstable();
        Measured { latencies, seconds: said["seconds"].as_f64().expect("it says how long all took") }
    }
}

pub(crate) fn run(size: Size) {
    let Some(python) = named("SESAME_ROS1") else { return };
    if !std::path::Path::new(RELAY).exists() {
        println!("skipped: there is no `{RELAY}`, which is part of Debian's topic-tools");
        return;
    }
    let home = tempfile::tempdir().expect("there is room");
    let port = free_port();
    let master = format!("http://127.0.0.1:{port}");
    let start = |command: &mut Command| {
        let command = command.env("ROS_MASTER_URI", &master).env("ROS_IP", "127.0.0.1").env("ROS_HOME", home.path());
        Program::start(command)
    };
    // Without the node that collects logs, which `roscore` starts besides.
    let _master = start(Command::new("rosmaster").args(["--core", "-p", &port.to_string()]));
    listens(port);
    let _relay = start(Command::new(RELAY).args(["/bare/undisturbed", "/bare"]));
    let plan = plan(&space(&format!("ros1 \"{master}\""), JOINTS, JOINT));
    let script = workspace().join("tests/ros1/peers/latency.py");
    let way =
        |name, from: &str, to: &str| Way { name, peer: start(Command::new(&python).arg(&script).args([from, to])) };
    let mut ways = [
        way("direct", "/direct", "/direct"),
        way("`relay` of ROS", "/bare/undisturbed", "/bare"),
        way("Sesame", "/peer/undisturbed", "/peer"),
    ];
    beside(
        &plan,
        &sesame_ros1::ros1(PathBuf::from(".")),
        |_| (),
        || {
            // Each sends until something comes back: nodes have to find each other.
            for way in &mut ways {
                way.peer.says("ready");
            }
            thread::sleep(Duration::from_secs(1));
            let names = ways.each_ref().map(|way| way.name);
            let results = rounds(&mut ways, size.rounds, |way| way.measure(size.messages));
            print("ROS 1, 200 Hz", &names, &results);
        },
    );
}
