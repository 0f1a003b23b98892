//! Monitors verified on two recordings, and tests compared with their twins without mitigation.

use std::fs;

use serde_json::Value;
use sesame_tests::{Project, fresh_folder, workspace};

/// A copy of a space with its simulator.
fn copied(simulator: &str, name: &str) -> Project {
    let folder = fresh_folder(name);
    let (script, space) = ("sim.py", format!("{simulator}.sesame"));
    for file in [script, &space] {
        fs::copy(workspace().join("tests/simulators").join(simulator).join(file), folder.join(file)).unwrap();
    }
    Project { space: folder.join(space), runners: folder.join("runners"), folder }
}

fn json(project: &Project, command: &str, arguments: &[&str], code: i32) -> Value {
    project.sesamec(command, &[arguments, &["--format", "json"]].concat()).expect(code).json()
}

#[test]
fn a_camera_that_is_late_in_the_lab_is_found_with_the_decision_that_it_costs() {
    let project = copied("late", "late_camera");
    // Preparatory testing records its regression tests on both sides, and compares what monitors decide.
    let said = json(&project, "prepare", &["--runs", "1", "--keep-going"], 3);
    assert_eq!(said["known"]["objections"], Value::Array(vec![]), "no metric shows it: {said}");
    let objections = said["monitors"]["objections"].as_array().unwrap();
    let objection = objections[0].as_str().unwrap();
    assert_eq!(objections.len(), 1, "{said}");
    let because = "in `nearer` monitor `guard` decides differently: decision 2 is `halted` at 2.22 s on the first \
                   recording and none on the second, because `guard.lit` is false since 2.2 s (message 1 on \
                   camera/light) on the first and true since 0.1 s (message 0 on camera/light) on the second, where it \
                   follows 0.05 s later, at 2.25 s (message 1 on camera/light)";
    assert_eq!(objection, because);
    let page = fs::read_to_string(project.runners.join("study/results/prepare/report.html")).unwrap();
    assert!(page.contains("id=\"monitors\"") && page.contains("2.25 s"), "the page has the difference");

    // The same by the names of the tests.
    let sides = ["prepare/known/simulation/nearer", "prepare/known/lab/nearer"];
    let found = json(&project, "monitors", &sides, 3);
    let guard = &found["monitors"][0];
    assert_eq!((&guard["first"], &guard["second"]), (&4.into(), &2.into()));
    assert_eq!(
        (&guard["difference"]["decision"], &guard["difference"]["because"][0]["late"]),
        (&2.into(), &0.05.into())
    );
    // The dark may come 40 ms later, when the robot is far again, and the robot 80 ms, when it is light again.
    let tolerances = found["topics"].as_array().unwrap();
    let tolerances: Vec<(&str, f64)> = tolerances
        .iter()
        .map(|tolerance| (tolerance["topic"].as_str().unwrap(), tolerance["first"]["delay"].as_f64().unwrap()))
        .collect();
    assert_eq!(tolerances, [("camera/light", 0.04), ("cell/gap", 0.08)]);
    let same = project.sesamec("monitors", &[sides[0], sides[0]]).expect(0);
    assert!(same.out.contains("All monitors decide the same in the same order."), "{}", same.out);
    let text = project.sesamec("monitors", &sides).expect(3);
    assert!(text.out.contains("on the first up to 0.04 s (`camera/light`)"), "{}", text.out);

    let none = project.sesamec("monitors", &[sides[0], "prepare/null/lab/T0"]).expect(1);
    assert!(none.err.contains("T0 has no recording") && none.err.contains("replay"), "{}", none.err);
    let unknown = project.sesamec("monitors", &[sides[0], sides[0], "--monitor", "gaurd"]).expect(1);
    assert!(unknown.err.contains("there is no monitor `gaurd`, there is `guard`"), "{}", unknown.err);
}

#[test]
fn a_twin_without_mitigation_shows_what_it_was_worth() {
    let project = copied("watched", "twins");
    project.sesamec("known", &["-c", "attacks"]).expect(0);
    let twin = |test: &str, code: i32| json(&project, "twin", &["-c", "attacks", test, "--results", "known"], code);
    // Undisturbed, the robot is stopped when the light is gone, long before it would be too near.
    let in_time = twin("T0", 0);
    let [of_gap] = in_time["requirements"].as_array().unwrap().as_slice() else { panic!("{in_time}") };
    assert_eq!((&of_gap["requirement"], &of_gap["verdict"]), (&"R1".into(), &"mitigated_in_time".into()));
    assert_eq!((&of_gap["hazard"], &of_gap["hazard_of_twin"]), (&Value::Null, &9.1.into()));
    assert_eq!(of_gap["mitigation"], 5.0);
    assert!((of_gap["lead"].as_f64().unwrap() - 4.1).abs() < 1e-9, "{in_time}");
    // Blinded, the monitor stops it when it is too near already.
    let too_late = twin("T1", 3);
    let of_gap = &too_late["requirements"][0];
    assert_eq!((&of_gap["verdict"], &of_gap["hazard"]), (&"mitigated_too_late".into(), &9.1.into()));
    assert!((of_gap["lead"].as_f64().unwrap() + 0.5).abs() < 1e-9, "half a second after the hazard: {too_late}");
    let text = project.sesamec("twin", &["-c", "attacks", "T0", "--results", "known"]).expect(0);
    assert!(text.out.contains("mitigated in time"), "{}", text.out);
    // The twin is recorded where that is asked for, and over nothing.
    let record = ["-c", "attacks", "T0", "--results", "known", "--record", "twin.mcap"];
    project.sesamec("twin", &record).expect(0);
    let fed = project.sesamec("replay-recording", &["-c", "attacks", "twin.mcap"]).expect(0);
    assert!(!fed.out.contains("differ"), "{}", fed.out);
    let again = project.sesamec("twin", &record).expect(1);
    assert!(again.err.contains("twin.mcap exists already"), "{}", again.err);
    let refused =
        project.sesamec("twin", &["-c", "attacks", "T0", "--results", "known", "--without", "camera"]).expect(1);
    assert!(refused.err.contains("monitor `camera` has no mitigation"), "{}", refused.err);
}
