//! The example as its users run it: `sesamec` or a generated runner launches drones and station, disturbs what they
//! say, and leaves nothing behind.

use std::fs;
use std::os::unix::fs::symlink;

use serde_json::Value;
use sesame_tests::{Done, Port, Project, command, done, fresh_folder, sesamec, workspace};

use crate::peers::python;

/// The example with two repetitions, in a folder and at ports of its own, which are held.
fn example(name: &str) -> Option<(Project, [Port; 3])> {
    let python = python()?;
    let (folder, example) = (fresh_folder(name), workspace().join("examples/two_drones"));
    for program in ["drone.py", "station.py"] {
        fs::copy(example.join(program), folder.join(program)).expect("a program can be copied");
    }
    let environment = python.ancestors().nth(2).expect("a Python lies in `bin` of its environment");
    symlink(environment, folder.join("venv")).expect("an environment can be linked");
    let mut text = fs::read_to_string(example.join("two_drones.sesame")).expect("the space can be read");
    let held = [(); 3].map(|()| Port::free_of_udp());
    for (written, port) in ["14550", "14551", "14552"].iter().zip(&held) {
        text = text.replace(written, &port.number().to_string());
    }
    let space = folder.join("two_drones.sesame");
    fs::write(&space, text.replace("5 times", "2 times")).expect("a space can be written");
    Some((Project { space, runners: folder.join("runners"), folder }, held))
}

/// Insists that the drones come too close only if the station hears late of one of them.
fn finds_the_danger(run: impl Fn(&str, &[&str]) -> Done) {
    run("run", &[]).expect(0);
    let listed: Value = serde_json::from_str(&run("list", &["--format", "json"]).expect(0).out).expect("it is JSON");
    let separation = |test: &Value| test["measured"]["separation"].as_f64().expect("it was measured");
    let tests: Vec<f64> = listed["tests"].as_array().expect("tests are listed").iter().map(separation).collect();
    let [reference, first, second, ..] = tests[..] else { panic!("{listed}") };
    assert!(reference > 4.0, "{tests:?}");
    assert!(first < 2.0 && second < 2.0, "{tests:?}");
}

#[test]
fn drones_come_too_close_if_the_station_hears_late_of_one_of_them() {
    let Some((project, _held)) = example("two_drones") else { return };
    finds_the_danger(|subcommand, arguments| {
        let mut command = command(sesamec());
        command.arg(subcommand).arg(&project.space).args(["--campaign", "repeated"]).args(arguments);
        done(command.current_dir(&project.folder))
    });
}

#[test]
fn a_generated_runner_flies_the_drones_as_sesamec_does() {
    let Some((project, _held)) = example("two_drones_generated") else { return };
    let runner = project.build("repeated");
    finds_the_danger(|subcommand, arguments| runner.run(&[&[subcommand], arguments].concat()));
}
