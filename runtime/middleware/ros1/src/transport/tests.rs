//! Systems that the runner launches: a master on a port of its own, and nodes at it.

use sesame_base::time::SimTime;
use sesame_lifecycle::launch::Part;
use sesame_plan::testing::{minimal, node, test_of, topic};
use sesame_plan::{
    Command, Interface, InterfaceField, Launch, Node, NodeId, Ready, ReadyWhen, Ros1, Type, WireType, Wiring,
};
use sesame_relay::metric::MetricTable;
use sesame_relay::relay::{Exchange as _, Relay};
use sesame_relay::wire::WireTable;

use super::*;

/// The address of the master, which has a port of its own.
const MASTER: &str = "http://127.0.0.1:{port}";

/// A topic that is cut, `/peer`, from a node to another, at such a master.
fn plan() -> CampaignPlan {
    let mut plan = minimal();
    let string = "std_msgs/msg/String";
    plan.topics =
        vec![sesame_plan::Topic { interface: Some(string.to_owned()), ..topic("peer", &["/peer"], Type::Bool) }];
    plan.nodes = vec![
        Node { publishes: sesame_plan::testing::topics(&[0]), ..node("publisher") },
        Node { subscribes: sesame_plan::testing::topics(&[0]), ..node("subscriber") },
    ];
    let data = InterfaceField { name: "data".to_owned(), ty: WireType::STRING };
    let interfaces = vec![Interface { name: string.to_owned(), fields: vec![data] }];
    plan.simulator.transport = sesame_plan::Transport::Ros1(Ros1 { master: MASTER.to_owned() });
    plan.simulator.ros = Some(Ros { interfaces, ..Ros::default() });
    plan.simulator.wiring = vec![Wiring { cut: true, ..Wiring::default() }];
    plan
}

/// The context of a second worker in a folder of its own; a test is not a runner.
fn context_in(folder: &Path) -> LaunchContext {
    let folder = folder.to_owned();
    LaunchContext { worker: 2, folder: folder.clone(), in_runner: false, ..LaunchContext::of_worker(folder) }
}

#[test]
fn launched_programs_find_the_master_of_their_worker_and_write_into_its_folder() {
    let plan = plan();
    let context = in_ros(&plan, MASTER, context_in(Path::new("folder")));
    let value =
        |name: &str| context.environment.iter().find(|(other, _)| other == name).map(|(_, value)| value.as_str());
    assert_eq!(value("ROS_MASTER_URI"), Some("http://127.0.0.1:{port}"), "which is filled in at the launch");
    assert_eq!(value("ROS_HOME"), Some("folder/ros"));
    assert_eq!(value("ROS_LOG_DIR"), Some("folder/ros/log"));
    assert_eq!(context.ros_args[&Part::Node(NodeId(0))], ["/peer:=/peer/undisturbed"]);
    assert!(context.ros_args[&Part::Node(NodeId(1))].is_empty());
}

/// With a master and nodes of an installed ROS 1.
mod real {
    use super::*;

    /// Two runs of a launched system whose publisher publishes at 100 Hz, each until something holds of how many
    /// messages there were and of the time: how many there were at the end of each.
    fn launched_twice(is_over: impl Fn(u64, SimTime) -> bool) -> Option<[u64; 2]> {
        let python = sesame_peers::named("SESAME_ROS1")?;
        let mut plan = plan();
        let launch = |program: &str, arguments: &[&str], when: ReadyWhen| Launch {
            command: Command {
                program: program.to_owned(),
                arguments: arguments.iter().map(|&argument| argument.to_owned()).collect(),
            },
            ready: Some(Ready { when, within: 120.0 }),
        };
        let port = ReadyWhen::Port { port: "{port}".to_owned() };
        plan.simulator.lifecycle.launch = Some(launch("roscore", &["-p", "{port}"], port));
        let peers = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../tests/ros1/peers");
        let peer = |name: &str, more: &[&str]| {
            let script = peers.join(name).display().to_string();
            let arguments = [&[script.as_str(), "/peer", "std_msgs/String", "100000"], more, &["{ros-args}"]].concat();
            launch(&python.display().to_string(), &arguments, ReadyWhen::Line { text: "ready".to_owned() })
        };
        plan.nodes[0].launch = Some(peer("publisher.py", &["100", "at-once"]));
        plan.nodes[1].launch = Some(peer("subscriber.py", &["600"]));
        plan.validate().unwrap();
        let folder = tempfile::tempdir().unwrap();
        let mut transport = in_context(&plan, context_in(folder.path()));
        // The second run has a master of its own again.
        let both = [(), ()].map(|()| {
            let wires = WireTable::new(&plan);
            let metrics = MetricTable::new(&plan, &wires, &[]).unwrap();
            let mut relay = Relay::new(&plan, &wires, &test_of(Vec::new()), metrics.start(), &[]).unwrap();
            relay.begin();
            transport.reset(1, &mut relay).unwrap();
            let peer = wires.find("/peer").unwrap();
            while !is_over(relay.next_index(peer), transport.now()) {
                assert!(transport.now() < SimTime::from_seconds(120.0), "messages are awaited");
                // Not a moment away: no message is noted later than the end, even if this process looks at it later.
                transport.advance(SimTime::from_seconds(3_600.0), &mut relay).unwrap();
            }
            relay.finish(transport.now()).messages
        });
        transport.close();
        assert_eq!(transport.incidents().notes, [""; 0]);
        assert!(folder.path().join("ros/log").is_dir());
        Some(both)
    }

    #[test]
    fn a_launched_master_and_nodes_find_each_other_and_are_remapped() {
        let both = launched_twice(|messages, _| messages >= 150);
        assert!(both.is_none_or(|both| both.iter().all(|&messages| messages >= 150)), "{both:?}");
    }

    #[test]
    #[ignore = "long: a rate, with nothing beside it"]
    fn two_seconds_of_a_launched_system_have_what_is_published_in_them() {
        let Some(both) = launched_twice(|_, now| now >= SimTime::from_seconds(2.0)) else { return };
        assert!(both.iter().all(|messages| (150..=220).contains(messages)), "two seconds of 100 Hz: {both:?}");
    }
}
