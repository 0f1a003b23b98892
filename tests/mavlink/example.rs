//! The example as its users run it: `sesamec` launches drones and station, disturbs what they say, and leaves nothing
//! behind.

use std::fs;
use std::os::unix::fs::symlink;

use serde_json::Value;
use sesame_tests::{Port, command, done, fresh_folder, sesamec, workspace};

use crate::peers::python;

#[test]
fn drones_come_too_close_if_the_station_hears_late_of_one_of_them() {
    let Some(python) = python() else { return };
    let (folder, example) = (fresh_folder("two_drones"), workspace().join("examples/two_drones"));
    for program in ["drone.py", "station.py"] {
        fs::copy(example.join(program), folder.join(program)).unwrap();
    }
    let environment = python.ancestors().nth(2).expect("a Python lies in `bin` of its environment");
    symlink(environment, folder.join("venv")).unwrap();
    let mut text = fs::read_to_string(example.join("two_drones.sesame")).unwrap();
    let held = [(); 3].map(|()| Port::free_of_udp());
    for (written, port) in ["14550", "14551", "14552"].iter().zip(&held) {
        text = text.replace(written, &port.number().to_string());
    }
    let space = folder.join("two_drones.sesame");
    fs::write(&space, text.replace("5 times", "2 times")).unwrap();
    let run = |subcommand: &str, arguments: &[&str]| {
        let mut command = command(sesamec());
        command.arg(subcommand).arg(&space).args(["--campaign", "repeated"]).args(arguments);
        done(command.current_dir(&folder)).expect(0).out
    };
    run("run", &[]);
    let listed: Value = serde_json::from_str(&run("list", &["--format", "json"])).unwrap();
    let separation = |test: &Value| test["measured"]["separation"].as_f64().unwrap();
    let tests: Vec<f64> = listed["tests"].as_array().unwrap().iter().map(separation).collect();
    let [reference, first, second, ..] = tests[..] else { panic!("{listed}") };
    assert!(reference > 4.0, "{tests:?}");
    assert!(first < 2.0 && second < 2.0, "{tests:?}");
}
