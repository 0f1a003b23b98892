//! `sesamec scan` of what is not ROS 2 itself: a bridge to it, a master of ROS 1, and simulators that speak SimlogAPI.
//! Each space passes its check and is formatted.

use std::fs;
use std::io::{BufRead as _, BufReader};
use std::net::{Ipv4Addr, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::Value;
use sesame_tests::{Done, Port, command, done, fresh_folder, sesamec, workspace};

use crate::environment::{Domain, Vendor};
use crate::peer::{LIMIT, Peer};
use crate::rosbridge::{JOINTS, Pythons, Server};

fn in_folder(folder: &Path, arguments: &[&str]) -> Done {
    let mut sesamec = command(sesamec());
    for variable in ["AMENT_PREFIX_PATH", "ROS_PACKAGE_PATH", "ROS_MASTER_URI"] {
        sesamec.env_remove(variable);
    }
    done(sesamec.args(arguments).current_dir(folder))
}

/// Whether a scan has found all of these.
fn all_of(all: &[&str]) -> impl Fn(&str) -> bool {
    move |found| all.iter().all(|part| found.contains(part))
}

/// What a scan says when it has found enough. It listens longer each time but the first, for nodes may take
/// long to start and to answer on a busy machine.
#[track_caller]
pub(crate) fn looked(folder: &Path, arguments: &[&str], is_enough: impl Fn(&str) -> bool) -> String {
    let (begun, mut arguments) = (Instant::now(), arguments.to_vec());
    loop {
        let found = in_folder(folder, &arguments).expect(0).out;
        if is_enough(&found) {
            return found;
        }
        assert!(begun.elapsed() < LIMIT, "more is awaited:\n{found}");
        let at = arguments.iter().position(|argument| *argument == "--seconds").expect("it says how long it listens");
        arguments[at + 1] = "8";
    }
}

/// That a space passes its check and is formatted.
fn passes(folder: &Path, space: &str) {
    fs::write(folder.join("scanned.sesame"), space).expect("a space can be written");
    for arguments in [&["check", "scanned.sesame"][..], &["fmt", "--check", "scanned.sesame"]] {
        in_folder(folder, arguments).expect(0);
    }
}

fn has(space: &str, lines: &[&str]) {
    for line in lines {
        assert!(space.contains(line), "{line}\n{space}");
    }
}

/// A program that is asked to end with the test, and what it starts with it.
struct Program(Child);

impl Drop for Program {
    fn drop(&mut self) {
        let _ = kill(Pid::from_raw(self.0.id().cast_signed()), Signal::SIGINT);
        let limit = Instant::now() + LIMIT / 2;
        while self.0.try_wait().is_ok_and(|ended| ended.is_none()) {
            if Instant::now() > limit {
                let _ = self.0.kill();
            }
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

#[test]
fn a_bridge_without_rosapi_wants_topics_to_be_named() {
    let Some(pythons) = Pythons::find() else { return };
    let (folder, domain, port) = (fresh_folder("scan_rosbridge"), Domain::free(), Port::free());
    let _server = Server::start(&pythons, &domain, &port);
    let url = format!("ws://127.0.0.1:{port}");
    let refused = in_folder(&folder, &["scan", "rosbridge", &url]).expect(1);
    assert!(refused.err.contains("does not have the services of rosapi"), "{}", refused.err);
    assert!(refused.err.contains("--topic NAME:TYPE"), "{}", refused.err);
    let speaking = ["--type", JOINTS, "--topic", "/peer", "--count", "1000000", "--rate", "50", "--short", "--hold"];
    let publisher = Peer::start(pythons.jazzy(), &domain, "publisher.py", &speaking);
    publisher.go();
    let topic = format!("/peer:{JOINTS}");
    let named = ["scan", "rosbridge", &url, "--seconds", "2", "--topic", &topic, "--topic", "/nobody:std_msgs/Bool"];
    // The bridge finds the publisher when somebody listens to it, which may take a while.
    let space = looked(&folder, &named, all_of(&[" Hz"]));
    // No folder has the type, so it is what the messages have in common.
    has(
        &space,
        &[
            &format!("  simulator robots = rosbridge \"{url}\" {{"),
            "  message JointState = \"sensor_msgs/msg/JointState\" {",
            "    header: Header as \"std_msgs/msg/Header\"",
            "    name: list of text",
            "  topic peer = \"/peer\" : JointState",
            "  topic nobody = \"/nobody\" : Bool",
            " Hz\n",
        ],
    );
    passes(&folder, &space);
    // Where a folder has it, it is that of the folder.
    let share = Vendor::share(pythons.jazzy()).display().to_string();
    let with_types = [&named[..], &["--types", &share]].concat();
    let space = looked(&folder, &with_types, all_of(&[" Hz"]));
    has(&space, &["  message JointState = \"sensor_msgs/msg/JointState\"  // header: std_msgs/msg/Header"]);
    passes(&folder, &space);
}

#[test]
fn a_master_of_ros_1_and_its_nodes_say_what_they_are() {
    let Some(python) = Vendor::Ros1.python() else { return };
    let (folder, port) = (fresh_folder("scan_ros1"), Port::free());
    let uri = format!("http://127.0.0.1:{port}");
    let start = |program: &mut Command| {
        program.current_dir(&folder).env("ROS_MASTER_URI", &uri).env("ROS_IP", "127.0.0.1");
        program.env("ROS_HOME", folder.join("home")).env("ROS_LOG_DIR", folder.join("log"));
        // Peers wait for a line before they publish, and end at the end of their input.
        program.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::null());
        Program(program.spawn().expect("programs of ROS 1 start"))
    };
    let nobody = in_folder(&folder, &["scan", "ros1", "--master", &uri]).expect(1);
    assert!(nobody.err.contains("start one with `roscore`"), "{}", nobody.err);
    let _master = start(Command::new("roscore").args(["-p", &port.to_string()]));
    let limit = Instant::now() + LIMIT;
    while TcpStream::connect((Ipv4Addr::LOCALHOST, port.number())).is_err() {
        assert!(Instant::now() < limit, "roscore does not start");
        std::thread::sleep(Duration::from_millis(50));
    }
    let peer = |script: &str, arguments: &[&str]| {
        let script = workspace().join("tests/ros1/peers").join(script);
        start(Command::new(&python).arg(script).args(arguments))
    };
    let _peers = [
        peer("talker.py", &["__name:=talker"]),
        peer("publisher.py", &["/joints", "sensor_msgs/JointState", "1", "1", "latch", "__name:=arm"]),
        peer("server.py", &["__name:=cell"]),
    ];
    // A node is there before all that it offers is.
    let last = ["\"/talker\"", "\"/joints\"", "\"/switch\"", "\"/reset\"", " Hz"];
    let master = format!("{uri}/");
    let space = looked(&folder, &["scan", "ros1", "--master", &master, "--seconds", "2"], all_of(&last));
    has(
        &space,
        &[
            &format!("  simulator robots = ros1 \"{uri}\" {{"),
            "  // decide: the units of its fields; a publisher described them\n",
            "  message JointState = \"sensor_msgs/msg/JointState\" {",
            "    position: list of real\n",
            "  topic angle = \"/angle\" : Float64",
            "  topic joints = \"/joints\" : JointState",
            "1 publisher, no subscriber, latched, no message\n",
            "  service switch = \"/switch\" : \"std_srvs/srv/SetBool\"  // 1 server\n",
            "  node talker \"/talker\" {\n    publishes angle\n  }",
            "    // decide: `reset by service \"/reset\"`",
        ],
    );
    passes(&folder, &space);
    let arguments = ["scan", "ros1", "--master", &uri, "--types", "/usr/share", "--seconds", "2"];
    let space = looked(&folder, &arguments, all_of(&last));
    has(&space, &["    types \"/usr/share\"", "  // header: std_msgs/msg/Header, name: string[]"]);
    passes(&folder, &space);
    let arguments = ["scan", "ros1", "--master", &uri, "--seconds", "2", "--format", "json"];
    let json = |found: &str| serde_json::from_str::<Value>(found).expect("it is JSON");
    let is_quick = |found: &str| json(found)["topics"][0]["rate"].as_f64().is_some_and(|rate| rate > 10.0);
    let found = json(&looked(&folder, &arguments, is_quick));
    assert_eq!(found["system"]["kind"], "ros1");
}

#[test]
fn a_simulator_that_speaks_simlog_is_stepped_only_if_that_is_asked_for() {
    let Some(python) = Vendor::Simlog.python() else { return };
    let folder = fresh_folder("scan_simlog");
    for (script, version) in [("simulator2.py", "2"), ("simulator3.py", "3")] {
        let mut simulator = Command::new(&python);
        simulator.arg(script).current_dir(workspace().join("runtime/middleware/simlog/tests"));
        let mut simulator = Program(simulator.stdout(Stdio::piped()).spawn().expect("the peer starts"));
        let mut line = String::new();
        let output = simulator.0.stdout.take().expect("its output is a pipe");
        BufReader::new(output).read_line(&mut line).expect("it says its port");
        let port = line.trim().strip_prefix("port ").unwrap_or_else(|| panic!("{script} says {line:?}"));
        let url = format!("http://127.0.0.1:{port}");
        fs::write(folder.join("topics.txt"), "joint\ncart\n\nnowhere\n").expect("a file can be written");
        let scan = ["scan", "simlog", &url, "--version", version, "--seconds", "2", "--topics-from", "topics.txt"];
        let zone = if version == "2" { "safetyzones/Z1" } else { "zone" };
        let named = [&scan[..], &["--topic", zone]].concat();
        let none = in_folder(&folder, &named).expect(0).out;
        has(&none, &["without a step", "// decide: topic \"joint\" cannot be used: nothing came on it"]);
        passes(&folder, &none);
        let space = in_folder(&folder, &[&named[..], &["--steps", "10", "--step", "50"]].concat()).expect(0).out;
        has(
            &space,
            &[
                "which took 10 steps",
                &format!("  simulator robots = simlog \"{url}\" {{"),
                "    step 50ms",
                "= \"joint\" : real",
                "    level: real\n",
                "    zone: text\n",
                "// decide: topic \"nowhere\" cannot be used",
            ],
        );
        assert_eq!(space.contains("protocol 3"), version == "3");
        passes(&folder, &space);
    }
    let nothing = in_folder(&folder, &["scan", "simlog", "http://127.0.0.1:1"]).expect(1);
    assert!(nothing.err.contains("no topic is named, and the protocol lists none"), "{}", nothing.err);
}
