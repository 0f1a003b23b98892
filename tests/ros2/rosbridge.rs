//! Nodes of ROS behind a real server of rosbridge: the runner is one of its clients.

use std::io::{BufRead as _, BufReader, Read as _};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use sesame_plan::Test;
use sesame_tests::{Port, workspace};

use crate::environment::{Domain, Vendor};
use crate::peer::Peer;
use crate::relaying::{Exchange, System, plan, space};

pub(crate) const JOINTS: &str = "sensor_msgs/msg/JointState";

/// A server of rosbridge. Dropping it ends it.
pub(crate) struct Server {
    child: Child,
}

impl Server {
    pub(crate) fn start(pythons: &Pythons, domain: &Domain, port: &Port) -> Self {
        let mut child = Command::new(&pythons.bridge)
            .arg(workspace().join("tests/ros2/peers/bridge.py"))
            .arg("--ros")
            .arg(Vendor::environment(&pythons.jazzy))
            .args(["--port", &port.to_string()])
            .env("ROS_DOMAIN_ID", domain.number.to_string())
            .env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("the Python of the server starts");
        let mut said = BufReader::new(child.stdout.take().expect("its output is a pipe"));
        let mut line = String::new();
        while !line.contains("listening\n") || line.contains("INFO") {
            line.clear();
            assert!(said.read_line(&mut line).expect("it speaks UTF-8") > 0, "the server has ended");
        }
        // What it logs is read, so that it never waits for that.
        std::thread::spawn(move || said.read_to_end(&mut Vec::new()));
        Server { child }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        drop(self.child.stdin.take());
        let ended = sesame_patience::comes(|| self.child.try_wait().expect("a child can be asked").is_some());
        if !ended {
            let _ = self.child.kill();
            let _ = self.child.wait();
        }
        assert!(ended || std::thread::panicking(), "the server does not end");
    }
}

pub(crate) struct Pythons {
    jazzy: PathBuf,
    pub(crate) bridge: PathBuf,
}

impl Pythons {
    pub(crate) fn find() -> Option<Self> {
        Some(Pythons { jazzy: Vendor::Jazzy.python()?, bridge: Vendor::Rosbridge.python()? })
    }

    /// The Python of the nodes behind the bridge.
    pub(crate) fn jazzy(&self) -> &Path {
        &self.jazzy
    }
}

/// A space with `/peer` behind a bridge.
fn bridged(domain: &Domain, port: &Port, settings: &str, operations: &str, seconds: u32) -> String {
    let text = space(domain, JOINTS, "", operations, &format!("{seconds}s"));
    let bridge = format!("rosbridge \"ws://127.0.0.1:{port}\" {{ {settings} domain");
    text.replacen("ros2 { domain", &bridge, 1)
}

/// How many messages are on their way through a bridge: its queues are short, and a full one drops what comes.
pub(crate) const BATCH: u64 = 5;

/// A subscriber of so many messages, which says when it has heard a few.
fn hearing(pythons: &Pythons, domain: &Domain, count: &str, more: &[&str]) -> Peer {
    let batch = BATCH.to_string();
    let arguments = ["--type", JOINTS, "--topic", "/peer", "--count", count, "--tell", &batch];
    Peer::start(&pythons.jazzy, domain, "subscriber.py", &[&arguments[..], more].concat())
}

/// A publisher of so many messages.
fn speaking(pythons: &Pythons, domain: &Domain, count: &str, more: &[&str]) -> Peer {
    let arguments = ["--type", JOINTS, "--topic", "/peer/undisturbed", "--count", count, "--short", "--hold"];
    Peer::start(&pythons.jazzy, domain, "publisher.py", &[&arguments[..], more].concat())
}

#[test]
fn a_thousand_messages_reach_nodes_through_a_bridge_and_the_relay_however_they_are_written() {
    let Some(pythons) = Pythons::find() else { return };
    let domain = Domain::free();
    let port = Port::free();
    let _server = Server::start(&pythons, &domain, &port);
    for settings in ["", "compression cbor"] {
        let plan = plan(&bridged(&domain, &port, settings, "", 60));
        let subscriber = hearing(&pythons, &domain, "1000", &["--content"]);
        let publisher = speaking(&pythons, &domain, "1000", &["--batch", &BATCH.to_string()]);
        // Until the bridge has discovered the publisher, it subscribes as best effort, and messages may be lost. So the
        // first connection lasts until something came through, and the test uses a second one, for which the bridge
        // subscribes anew.
        System::new(plan.clone()).introduce(&publisher, &[&subscriber]);
        publisher.await_alone();
        let mut system = System::new(plan);
        let to = [&subscriber];
        let exchange = Exchange { batch: Some(BATCH), ..Exchange::new(&publisher, &to) };
        let passed = system.exchange(&Test::default(), &exchange).messages();
        let [(_, said), (_, heard)] = [publisher.end(), subscriber.end()];
        assert_eq!(said["reliable"], true, "{settings}: {said}");
        assert_eq!((passed, &heard["count"]), (1000, &1000.into()), "{settings}: {said} {:?}", system.all_notes());
        assert_eq!(said["content"], heard["content"], "{settings}");
        assert_eq!(system.all_notes(), [""; 0]);
    }
}

#[test]
fn what_a_monitor_says_reaches_nodes_behind_a_bridge() {
    let Some(pythons) = Pythons::find() else { return };
    let domain = Domain::free();
    let port = Port::free();
    let _server = Server::start(&pythons, &domain, &port);
    let text = bridged(&domain, &port, "", "", 60);
    let state = "message State = \"std_msgs/msg/String\" { data: text }\ntopic state = \"/state\" : State\n";
    let monitor = "eddi arm publishes state {\n\
                   evidence stamped = peer.header.stamp > 0s\n\
                   guarantee moves integrity 1 = stamped\n\
                   otherwise rests\n}\n";
    let text = text.replacen("topic peer", &format!("{state}topic peer"), 1);
    let mut system = System::new(plan(&text.replacen("metric disturbed", &format!("{monitor}metric disturbed"), 1)));
    let listening = ["--type", "std_msgs/msg/String", "--count", "2", "--topic", "/state"];
    let subscriber = Peer::start(&pythons.jazzy, &domain, "subscriber.py", &listening);
    let publisher = speaking(&pythons, &domain, "1000000", &["--rate", "50"]);
    // The state at time zero comes after this.
    let ready = || {
        subscriber.await_match();
        publisher.await_match();
        publisher.go();
    };
    system.relay_until(&Test::default(), ready, |_| subscriber.is_done());
    assert_eq!(subscriber.end().1["count"], 2, "`rests` at time zero, and `moves`: {:?}", system.all_notes());
    assert_eq!(system.all_notes(), [""; 0]);
}

#[test]
fn after_a_bridge_restarts_every_topic_is_back() {
    let Some(pythons) = Pythons::find() else { return };
    let domain = Domain::free();
    let port = Port::free();
    let server = std::cell::RefCell::new(Some(Server::start(&pythons, &domain, &port)));
    let mut system = System::new(plan(&bridged(&domain, &port, "", "", 60)));
    let subscriber = hearing(&pythons, &domain, "400", &[]);
    let publisher = speaking(&pythons, &domain, "1000000", &["--rate", "100"]);
    let ready = || {
        publisher.await_match();
        publisher.go();
    };
    let mut heard_before = None;
    system.relay_until(&Test::default(), ready, |_| {
        if heard_before.is_none() && subscriber.told("count") >= 50 {
            server.borrow_mut().take();
            *server.borrow_mut() = Some(Server::start(&pythons, &domain, &port));
            heard_before = Some(subscriber.told("count"));
        }
        subscriber.is_done()
    });
    assert!(heard_before.is_some_and(|count| count < 400), "the server was restarted before all had come");
    assert_eq!(subscriber.end().1["count"], 400);
    let notes = system.all_notes();
    let lost = format!("the connection to the bridge at `ws://127.0.0.1:{port}` was lost for ");
    assert!(notes.iter().any(|note| note.starts_with(&lost)), "{notes:?}");
}
