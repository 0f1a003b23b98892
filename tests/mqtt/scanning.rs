//! `sesamec scan mqtt` at a real broker: vehicles that speak VDA 5050, retained messages, passwords.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

use sesame_peers::Ended;
use sesame_tests::{Done, command, done, fresh_folder, sesamec, workspace};

use crate::peers::{Broker, Client, LIMIT, packages};
use crate::refusals::{SECRET, passwords};

fn in_folder(folder: &Path, arguments: &[&str]) -> Done {
    done(command(sesamec()).args(arguments).current_dir(folder))
}

/// Vehicles or their control, which end with the test.
fn start(packages: &Path, part: &str, port: u16) -> Ended {
    let mut node = Command::new("node");
    node.arg(workspace().join("tests/mqtt/fleet.js")).args([part, &port.to_string()]);
    node.env("NODE_PATH", packages.join("node_modules")).stdout(Stdio::null());
    Ended(node.spawn().expect("node starts"))
}

#[test]
fn the_space_of_a_fleet_passes_its_check() {
    let Some(packages) = packages() else { return };
    let folder = fresh_folder("mqtt_scan");
    let broker = Broker::start(&folder);
    let url = format!("mqtt://127.0.0.1:{}", broker.port);
    // It is built before it is to listen.
    sesamec();
    let _vehicles = start(&packages, "vehicles", broker.port);
    // The last of these stays at the broker.
    let mut publisher =
        Client::start(&packages, &["publish", &broker.port.to_string(), "peers/one/speed", "3", "3", "2", "retain"]);
    publisher.go();
    publisher.end();
    // The control sends each order once, soon after it has started, so it is started when somebody listens; and again,
    // while it is listened for longer, if it or the vehicles took too long for that.
    let mut listening = ["5", "10", "20", "40", "80"].into_iter();
    let space = loop {
        let seconds = listening.next().expect("vehicles and their control are heard");
        let space = std::thread::scope(|scope| {
            let scan = scope.spawn(|| in_folder(&folder, &["scan", "mqtt", &url, "--seconds", seconds]).expect(0).out);
            let _control = start(&packages, "control", broker.port);
            scan.join().expect("it scans")
        });
        let all = ["/order\"", "{agv0,agv1,agv2}/state\"", "/connection\"", "    agvPosition: StateAgvPosition"];
        if all.iter().all(|part| space.contains(part)) {
            break space;
        }
        println!("in {seconds} s not all was heard:\n{space}");
    };
    let begun = Instant::now();
    for line in [
        format!("  simulator robots = mqtt \"{url}\" {{"),
        "    quality exactly_once".to_owned(),
        "topic uagv_v2_acme_state = \"uagv/v2/acme/{agv0,agv1,agv2}/state\" : State".to_owned(),
        "  message State {".to_owned(),
        "    driving: bool".to_owned(),
        "    agvPosition: StateAgvPosition".to_owned(),
        "topic peers_one_speed = \"peers/one/speed\" : Speed".to_owned(),
        "// retained, quality 2, 1 message".to_owned(),
        // It is `[1, {}]`.
        "// decide: `more` is left out: of its elements: it came as a number and an object".to_owned(),
    ] {
        assert!(space.contains(&line), "{line}\n{space}");
    }
    fs::write(folder.join("fleet.sesame"), &space).expect("a space can be written");
    for arguments in [&["check", "fleet.sesame"][..], &["fmt", "--check", "fleet.sesame"]] {
        in_folder(&folder, arguments).expect(0);
    }
    let arguments = ["scan", "mqtt", &url, "--topics", "uagv/v2/+/+/state", "--seconds", "3", "--format", "json"];
    let found = loop {
        let found = in_folder(&folder, &arguments).expect(0).json();
        if found["topics"].as_array().is_some_and(|topics| topics.len() == 3) {
            break found;
        }
        assert!(begun.elapsed() < LIMIT, "three vehicles are awaited: {found:#}");
    };
    assert_eq!(found["system"], serde_json::json!({ "kind": "mqtt", "url": url }));
    let topics = found["topics"].as_array().expect("topics are a list");
    assert_eq!((&topics[0]["type"], &topics[0]["retained"]), (&"State".into(), &false.into()));
    assert_eq!(found["types"][0]["source"], "payloads");
}

#[test]
fn a_scan_logs_in_and_says_how_to() {
    if packages().is_none() {
        return;
    }
    let folder = fresh_folder("mqtt_scan_password");
    let broker = Broker::with(&folder, &passwords(&folder));
    let url = format!("mqtt://127.0.0.1:{}", broker.port);
    fs::write(folder.join("right"), SECRET).expect("a file can be written");
    let scan = |more: &[&str]| in_folder(&folder, &[&["scan", "mqtt", &url, "--seconds", "2"], more].concat());
    let nobody = scan(&[]).expect(1);
    assert!(nobody.err.contains("or `--user` and `--password-env` to a scan"), "{}", nobody.err);
    let space = scan(&["--user", "relay", "--password-file", "right"]).expect(0);
    assert!(space.out.contains("    user \"relay\"\n    password from file \"right\"\n"), "{}", space.out);
    assert!(!space.out.contains(SECRET) && !space.err.contains(SECRET));
    assert!(space.err.contains("nothing was published meanwhile"), "{}", space.err);
    let elsewhere = ["scan", "mqtt", "mqtt://fleet.example", "--user", "relay", "--password-file", "right"];
    let refused = in_folder(&folder, &elsewhere).expect(1);
    assert!(refused.err.contains("a secret would go to `fleet.example` in plain text"), "{}", refused.err);
}
