//! Preparatory testing of the KUKA cell: in its model, and in a stand-in for the lab.

use std::fs;
use std::path::PathBuf;

use serde_json::Value;
use sesame_tests::{Done, command, done, fresh_folder, kuka_cell_lab, sesamec, workspace};

/// The study of the example with a regression test, and a lab that differs so. Nothing of it is compiled.
struct Study {
    folder: PathBuf,
}

impl Study {
    fn new(name: &str, lab: &str) -> Study {
        let folder = fresh_folder(name);
        let text = fs::read_to_string(workspace().join("examples/kuka_cell/study.sesame")).unwrap();
        let program = kuka_cell_lab().display().to_string();
        let text = text
            .replace("process \"kuka_cell_lab\" {", &format!("process \"kuka_cell_lab\" {lab} {{"))
            .replace("\"kuka_cell_lab\"", &format!("\"{program}\""));
        let test = "test leaning { shift_link1 bias 0.2rad from 8s to 14s  expect top_speed <= 9m/s }\n";
        let text =
            text.replacen("/// Offsets on", &format!("{test}\n/// Offsets on"), 1).replace("after 70s", "after 15s");
        fs::write(folder.join("study.sesame"), text).unwrap();
        Study { folder }
    }

    fn sesamec(&self, arguments: &[&str]) -> Done {
        done(command(sesamec()).args(arguments).current_dir(&self.folder))
    }

    fn json(&self, arguments: &[&str], code: i32) -> Value {
        self.sesamec(&[arguments, &["--format", "json"]].concat()).expect(code).json()
    }
}

#[test]
fn a_lab_as_modelled_is_ready_and_the_page_has_all_steps() {
    let study = Study::new("prepared", "\"--as-modelled\"");
    let said = study.json(&["prepare", "study.sesame", "--runs", "2"], 0);
    assert_eq!((&said["passed"], &said["null"]["lab"]), (&true.into(), &"hall".into()));
    let stages = said["mitm"]["stages"].as_array().unwrap();
    assert_eq!(stages.len(), 2, "operations act on one topic");
    // With one seed the model is deterministic, and the relay changes nothing.
    assert!(stages.iter().all(|stage| stage["deterministic"] == true), "{stages:?}");
    assert!(stages[1]["metrics"].as_array().unwrap().iter().all(|metric| metric["drift"] == 0.0), "{stages:?}");
    assert_eq!(said["mitm"]["lock_stepped"], true);
    assert_eq!(said["known"]["tests"][0]["expectations"][0]["lab"], "satisfied");
    // The noise of the cell has another seed in each run of the null test.
    assert!(said["null"]["metrics"][0]["simulation"]["deviation"].as_f64().unwrap() > 0.0);
    let page = fs::read_to_string(study.folder.join("runners/study/results/prepare/report.html")).unwrap();
    assert!(["id=\"null\"", "id=\"mitm\"", "id=\"known\""].iter().all(|section| page.contains(section)));
}

#[test]
fn a_lab_whose_zones_are_elsewhere_is_found_before_anything_is_disturbed() {
    let study = Study::new("unprepared", "\"--zone-shift\" \"300,0,0\"");
    let said = study.sesamec(&["null", "study.sesame", "--runs", "2"]).expect(3);
    assert!(said.err.contains("not as required: `zone_distance` differs by "), "{}", said.err);
    assert!(said.err.contains("between the simulation and lab `hall`; the lab tolerates 10 mm"), "{}", said.err);
    let said = study.json(&["known", "study.sesame", "--lab", "hall"], 3);
    let objections = said["known"]["objections"].as_array().unwrap();
    assert_eq!(objections, &["R1 in `leaning` is satisfied in simulation and violated in lab `hall`"]);
    let metrics = said["known"]["tests"][0]["metrics"].as_array().unwrap();
    let zones = metrics.iter().find(|metric| metric["metric"] == "zone_distance").unwrap();
    assert_eq!(zones["beyond"], true, "it is shown, and one run each fails nothing");
}
