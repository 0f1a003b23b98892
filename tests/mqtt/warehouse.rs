//! The warehouse over MQTT as its users run it: `sesamec` launches a broker, the vehicles and their control, and
//! disturbs what the vehicles hear of where they are.

use std::fs;
use std::os::unix::fs::symlink;

use serde_json::Value;
use sesame_tests::{command, completed_with_delays, done, fresh_folder, sesamec, workspace};

use crate::peers::python;

/// The reference run and both runs of the known test, in which robot 5 is located late, each of so many seconds.
fn repeated(name: &str, seconds: u32) -> Option<[Value; 3]> {
    let python = python()?;
    let (folder, example) = (fresh_folder(name), workspace().join("examples/warehouse"));
    for program in ["vda5050.py", "warehouse.py"] {
        fs::copy(example.join(program), folder.join(program)).expect("a program can be copied");
    }
    let text = fs::read_to_string(example.join("vda5050.sesame")).expect("the space can be read");
    let text =
        text.replace("after 40s", &format!("after {seconds}s")).replace("[0s, 40s]", &format!("[0s, {seconds}s]"));
    fs::write(folder.join("vda5050.sesame"), text).expect("a space can be written");
    let environment = python.ancestors().nth(2).expect("a Python lies in `bin` of its environment");
    symlink(environment, folder.join("venv")).expect("an environment can be linked");
    let run = |subcommand: &str, arguments: &[&str]| {
        let mut sesamec = command(sesamec());
        sesamec.args([subcommand, "vda5050.sesame", "--campaign", "repeated"]).args(arguments).current_dir(&folder);
        done(&mut sesamec)
    };
    run("run", &["--", "--workers", "2"]).ended_freely();
    let tests = completed_with_delays(run);
    for test in &tests {
        assert!(measured(test, "reached") > 0.0 && measured(test, "closest") < 99.0, "the vehicles drive: {test}");
    }
    Some(tests)
}

fn measured(test: &Value, metric: &str) -> f64 {
    test["measured"][metric].as_f64().unwrap_or_else(|| panic!("no `{metric}` in {test}"))
}

/// Nobody steps vehicles and control: on a busy machine all of them may be late. Undisturbed, the first order is
/// finished after 17 s.
#[test]
fn vehicles_finish_the_orders_of_their_control_and_one_of_them_is_located_late() {
    repeated("warehouse_vda5050", 24);
}

#[test]
#[ignore = "long: how close vehicles come depends on the load of the machine"]
fn a_vehicle_that_is_located_late_meets_another_one() {
    let Some([reference, late @ ..]) = repeated("warehouse_vda5050_alone", 40) else { return };
    assert!(measured(&reference, "closest") > 1.1 && measured(&reference, "reached") >= 10.0, "{reference}");
    for test in &late {
        assert!(measured(test, "r2_r5") <= 0.7 && measured(test, "r1_r4") > 0.8, "{test}");
    }
}
