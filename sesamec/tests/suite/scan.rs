//! `sesamec scan`, with real nodes if there are some.

use std::path::Path;
use std::process::{Command, Output};

fn sesamec(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sesamec"));
    command.current_dir(folder).args(arguments).env_remove("AMENT_PREFIX_PATH");
    command.output().unwrap()
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

/// What each middleware is told that it needs, besides options.
const MIDDLEWARES: [(&str, bool, &[&str]); 6] = [
    ("ros2", cfg!(feature = "ros2"), &[]),
    ("ros1", cfg!(feature = "ros1"), &[]),
    ("rosbridge", cfg!(feature = "rosbridge"), &["ws://127.0.0.1:1"]),
    ("mqtt", cfg!(feature = "mqtt"), &["mqtt://127.0.0.1:1"]),
    ("simlog", cfg!(feature = "simlog"), &["http://127.0.0.1:1"]),
    ("mavlink", cfg!(feature = "mavlink"), &["udp://127.0.0.1:1", "--types", "common.xml"]),
];

#[test]
fn without_a_middleware_it_says_how_to_get_a_sesamec_with_it() {
    let folder = tempfile::tempdir().unwrap();
    for (middleware, _, needed) in MIDDLEWARES.into_iter().filter(|(_, linked, _)| !linked) {
        let scanned = sesamec(folder.path(), &[&["scan", middleware], needed].concat());
        assert_eq!((scanned.status.code(), text(&scanned.stdout)), (Some(1), ""));
        let remedy = format!("--features {middleware}");
        assert!(text(&scanned.stderr).contains(&remedy), "{}", text(&scanned.stderr));
    }
}

#[test]
fn an_address_that_no_space_could_have_is_refused_before_anything_is_connected() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |arguments: &[&str], why: &str| {
        let scanned = sesamec(folder.path(), &[&["scan"], arguments].concat());
        assert_eq!((scanned.status.code(), text(&scanned.stdout)), (Some(1), ""), "{arguments:?}");
        assert!(text(&scanned.stderr).contains(why), "{}", text(&scanned.stderr));
    };
    if cfg!(feature = "rosbridge") {
        refused(&["rosbridge", "http://localhost"], "expected an address that begins with `ws://` or `wss://`");
        let secret = ["rosbridge", "ws://hall.example:9090", "--token-env", "NO_SUCH_SECRET"];
        refused(&secret, "a secret would go to `hall.example` in plain text");
        refused(&["rosbridge", "ws://127.0.0.1:1", "--topic", "/a:b"], "names no type of ROS");
        let nowhere = ["rosbridge", "ws://127.0.0.1:1", "--token-env", "SESAME_NO_SUCH_SECRET"];
        refused(&nowhere, "the secret in the environment variable `SESAME_NO_SUCH_SECRET` is missing");
    }
    if cfg!(feature = "mqtt") {
        refused(&["mqtt", "mqtt://user:word@localhost"], "a name or password in an address would be in every log");
        refused(&["mqtt", "mqtt://127.0.0.1:1", "--topics", ""], "`#` stands for all topics");
        refused(&["mqtt", "mqtt://127.0.0.1:1"], "no broker answers at `mqtt://127.0.0.1:1`");
    }
    if cfg!(feature = "simlog") {
        refused(&["simlog", "http://127.0.0.1:1"], "name each with `--topic NAME`");
        refused(&["simlog", "tcp://127.0.0.1:1", "--topic", "a"], "expected an address that begins with `http://`");
        refused(&["simlog", "http://127.0.0.1:1", "--topics-from", "nowhere"], "the topics in nowhere cannot be read");
    }
    if cfg!(feature = "mavlink") {
        let missing = "the definitions in `none.xml` cannot be used: there is no such file";
        refused(&["mavlink", "udp://127.0.0.1:1", "--types", "none.xml"], missing);
        let tcp = "`tcp://127.0.0.1:1` is not the address of a simulator of this kind";
        refused(&["mavlink", "tcp://127.0.0.1:1", "--types", "none.xml"], tcp);
    }
    if cfg!(feature = "ros1") {
        refused(&["ros1", "--master", "localhost"], "expected an address that begins with `http://`");
        refused(&["ros1", "--master", "http://127.0.0.1:1"], "start one with `roscore`");
    }
}

#[cfg(feature = "ros2")]
mod real {
    use std::fs;
    use std::path::PathBuf;
    use std::process::{Child, Stdio};

    use sesame_patience as patience;

    use super::*;

    /// Python with what the nodes of `examples/iiwa_cell` need.
    const PYTHON: &str = "SESAME_ROS2_KILTED";

    /// Programs that end with the test.
    struct Programs(Vec<Child>);

    impl Drop for Programs {
        fn drop(&mut self) {
            for program in &mut self.0 {
                let _ = program.kill();
                let _ = program.wait();
            }
        }
    }

    #[test]
    fn a_wrong_domain_folder_or_time_is_said_before_anything_is_listened_to() {
        let folder = tempfile::tempdir().unwrap();
        let code = |arguments: &[&str]| sesamec(folder.path(), &[&["scan", "ros2"], arguments].concat()).status.code();
        assert_eq!(code(&["--types", "nowhere"]), Some(1));
        assert_eq!(code(&["--domain", "233"]), Some(2));
        assert_eq!(code(&["--seconds", "0"]), Some(2));
    }

    #[test]
    fn the_space_of_a_running_cell_passes_its_check() {
        let Some(python) = std::env::var_os(PYTHON).map(PathBuf::from) else {
            let ci = std::env::var_os("CI").is_some_and(|ci| ci == "true");
            assert!(!ci, "{PYTHON} names the Python of examples/iiwa_cell/venv");
            eprintln!("skipped: {PYTHON} does not name the Python of examples/iiwa_cell/venv");
            return;
        };
        let folder = tempfile::tempdir().unwrap();
        let domain = (120 + std::process::id() % 20).to_string();
        let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/iiwa_cell");
        let start = |arguments: &[&str]| {
            let mut command = Command::new(&python);
            command.current_dir(&example).args(arguments).env("ROS_DOMAIN_ID", &domain);
            command.env("ROS_LOG_DIR", folder.path().join("log")).stdout(Stdio::null()).stderr(Stdio::null());
            command.spawn().unwrap()
        };
        let _programs = Programs(vec![
            start(&["cell.py"]),
            start(&["controller.py", "--arm", "left"]),
            start(&["controller.py", "--arm", "right"]),
        ]);
        // They may take long to start, so it is listened until all are there.
        let scanned_with = |more: &[&str], parts: &[&str]| {
            patience::until_some("all nodes of the cell in one scan", || {
                let scanned = sesamec(folder.path(), &[&["scan", "ros2", "--domain", &domain], more].concat());
                assert!(scanned.status.success(), "{}", text(&scanned.stderr));
                let said = text(&scanned.stdout).to_owned();
                parts.iter().all(|part| said.contains(part)).then_some(said)
            })
        };
        let space = scanned_with(&[], &["/cell\"", "/left_controller\"", "/right_controller\"", " Hz"]);
        for line in [
            "clock  \"/clock\"",
            "message Float64 = \"std_msgs/msg/Float64\"",
            "message JointState = \"sensor_msgs/msg/JointState\" {",
            "    position: list of real\n",
            "topic workers_distance = \"/workers/{a,b}/distance\" : Float64",
            "topic left_joint_states = \"/left/joint_states\" : JointState",
            "service cell_reset = \"/cell/reset\" : \"std_srvs/srv/Trigger\"",
            "node left_controller \"/left_controller\" {",
            "// decide: `reset by service \"/cell/reset\"`",
        ] {
            assert!(space.contains(line), "{line}\n{space}");
        }
        fs::write(folder.path().join("cell.sesame"), &space).unwrap();
        for arguments in [&["check", "cell.sesame"][..], &["fmt", "--check", "cell.sesame"]] {
            let checked = sesamec(folder.path(), arguments);
            assert!(checked.status.success(), "{}\n{space}", text(&checked.stderr));
        }
        let nodes = ["\"/cell\"", "\"/left_controller\"", "\"/right_controller\""];
        let json = scanned_with(&["--format", "json"], &nodes);
        let json: serde_json::Value = serde_json::from_str(&json).unwrap();
        assert_eq!(json["nodes"][0]["name"], "/cell");
        let states =
            json["topics"].as_array().unwrap().iter().find(|topic| topic["path"] == "/left/joint_states").unwrap();
        assert_eq!(states["type"], "sensor_msgs/msg/JointState");
        assert_eq!(states["publishers"], serde_json::json!(["/cell"]));
        assert!(states["rate"].as_f64().unwrap() > 1.0, "{states}");
    }
}
