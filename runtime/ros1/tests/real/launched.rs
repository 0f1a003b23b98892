//! Systems that the runner launches: a master on a port of its own, and nodes at it.

use sesame_plan::testing::test_of;
use sesame_plan::{Command, Launch, Ready, ReadyWhen};

use crate::core::python;
use crate::system::{System, peers};

#[test]
fn a_launched_master_and_nodes_find_each_other_and_are_remapped() {
    let Some(python) = python() else { return };
    let mut plan = peers("http://127.0.0.1:{port}", "std_msgs/msg/String");
    let launch = |program: &str, arguments: &[&str], when: Option<ReadyWhen>| Launch {
        command: Command {
            program: program.to_owned(),
            arguments: arguments.iter().map(|&it| it.to_owned()).collect(),
        },
        ready: when.map(|when| Ready { when, within: 30.0 }),
    };
    let port = ReadyWhen::Port { port: "{port}".to_owned() };
    plan.simulator.lifecycle.launch = Some(launch("roscore", &["-p", "{port}"], Some(port)));
    let peers = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/ros1/peers");
    let script = |name: &str| peers.join(name).display().to_string();
    let ready = || Some(ReadyWhen::Line { text: "ready".to_owned() });
    let publisher = script("publisher.py");
    let publisher = [publisher.as_str(), "/peer", "std_msgs/String", "100000", "100", "at-once", "{ros-args}"];
    plan.nodes[0].launch = Some(launch(&python.display().to_string(), &publisher, ready()));
    let subscriber = script("subscriber.py");
    let subscriber = [subscriber.as_str(), "/peer", "std_msgs/String", "100000", "20", "{ros-args}"];
    plan.nodes[1].launch = Some(launch(&python.display().to_string(), &subscriber, ready()));
    plan.validate().unwrap();
    let mut system = System::new(plan);
    for _ in 0..2 {
        let mut rounds = 0;
        let finished = system.run(&test_of(Vec::new()), || {}, || {
            rounds += 1;
            rounds > 100
        });
        let messages = finished.unwrap().messages;
        assert!((150..=260).contains(&messages), "two seconds of 100 Hz: {messages}");
    }
    assert_eq!(system.incidents().notes, [""; 0]);
}
