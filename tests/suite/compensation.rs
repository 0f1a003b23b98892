//! From a gap to its compensation, on the stand-in for the lab of the gearbox cell: nothing is compiled.

use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;

use sesame_analysis::gap::compensated_runs;
use sesame_patience as patience;
use sesame_record::Repository;
use sesame_tests::{Done, command, done, fresh_folder, kuka_cell_lab, sesamec, workspace};

/// The study of the example with few tests, and a lab that differs so.
struct Study {
    folder: PathBuf,
}

impl Study {
    /// With tests of so many seconds.
    fn new(name: &str, seconds: u32, lab: &str, fit: &str) -> Self {
        let folder = fresh_folder(name);
        let text = fs::read_to_string(workspace().join("examples/kuka_cell/study.sesame")).unwrap();
        let (before, _) = text.split_once("  fit ").unwrap();
        let program = kuka_cell_lab().display().to_string();
        let text = format!("{before}  fit {fit}\n}}\n")
            .replace("process \"kuka_cell_lab\" {", &format!("process \"kuka_cell_lab\" {lab} {{"))
            .replace("\"kuka_cell_lab\"", &format!("\"{program}\""))
            .replace("nsga2 { population 20  evaluations 120", "random { evaluations 4")
            .replace("repeats   5", "repeats   3")
            .replace("budget    5", "budget    3")
            .replace("end        after 70s", &format!("end        after {seconds}s"))
            .replace("within [0s, 65s]", &format!("within [0s, {}s]", seconds - 2));
        fs::write(folder.join("study.sesame"), text).unwrap();
        Study { folder }
    }

    fn sesamec(&self, arguments: &[&str]) -> Done {
        done(command(sesamec()).args(arguments).current_dir(&self.folder))
    }

    fn json(&self, arguments: &[&str]) -> serde_json::Value {
        self.sesamec(&[arguments, &["--format", "json"]].concat()).expect(0).json()
    }

    fn results(&self, folder: &str) -> String {
        self.folder.join("runners/study/results").join(folder).display().to_string()
    }

    /// The campaign, its tests run again, in the lab, and recorded.
    fn carried_out(self) -> Self {
        self.sesamec(&["run", "study.sesame"]).expect(0);
        let tests = ["T1", "T2", "T3", "T4"];
        self.sesamec(&[&["confirm", "study.sesame", "-n", "3", "--results", "42"][..], &tests].concat()).expect(0);
        self.sesamec(&["physical", "study.sesame", "T1", "T2", "T3", "--results", "42"]).expect(0);
        for test in tests {
            self.sesamec(&["replay", "study.sesame", test, "--record", "--results", "42"]).expect(0);
        }
        self
    }
}

#[test]
fn a_lag_shows_in_traces_and_a_fitted_delay_closes_the_gap() {
    let lab = "\"--as-modelled\" \"--latency\" \"180\" \"--zone-shift\" \"60,0,0\"";
    let fit = "relay delay on link1 [0ms, 400ms], parameter \"zone_shift_x\" [-0.1, 0.1]";
    let study = Study::new("compensation", 20, lab, fit).carried_out();
    let (run, hall) = (study.results("42"), study.results("42-hall"));

    // The arm is later by the latency, and by the step in which targets act.
    let extents = study.json(&["gap", &run, &hall, "--extents"]);
    let of = |of: &str, quantity: &str| {
        let rows = extents.as_array().unwrap().iter();
        rows.clone().find(|row| row["of"] == of && row["quantity"] == quantity).unwrap().clone()
    };
    let lag = of("arms/R3200ProductMove/state.link1", "lag");
    assert!((0.15..0.25).contains(&lag["difference"].as_f64().unwrap()), "{lag}");
    // Nobody changed what the PLC sends.
    assert_ne!(of("joints/R3200ProductMove/Link0/R/position", "lag")["extent"], "systematic", "{extents}");

    let arguments = ["compensate", "study.sesame", &hall, "--evaluations", "20"];
    let compensated = study.json(&arguments);
    let adjustments = compensated["compensation"]["adjustments"].as_array().unwrap();
    let level = |at: usize| adjustments[at]["levels"][0].as_f64().unwrap();
    assert!((0.13..0.27).contains(&level(0)), "{adjustments:?}");
    assert!((0.04..0.08).contains(&level(1)), "{adjustments:?}");
    // Of tests that nothing was fitted to, half of the discrepancy is what goes in the median of studies.
    for (judged, left) in [("fitted", 0.5), ("held_out", 0.65)] {
        let [before, after] =
            ["discrepancy_before", "discrepancy_after"].map(|name| compensated[judged][name].as_f64().unwrap());
        assert!(after < left * before, "{judged}: {before} and then {after}");
    }

    // What was simulated again says with what, and is what a gap is compared with.
    let (campaign, again) = (Repository::open(run.as_ref()).unwrap(), study.results("42-hall-compensated"));
    let again = Repository::open(again.as_ref()).unwrap();
    let runs = compensated_runs(&campaign, &again).unwrap();
    assert_eq!(runs.iter().map(|run| run.of).collect::<BTreeSet<_>>().len(), 3);
    assert_eq!(again.plan().compensation.as_ref().unwrap().adjustments.len(), 2);
    let after = study.json(&["gap", &run, &hall, "--simulation", &study.results("42-hall-compensated")]);
    let zone = after.as_array().unwrap().iter().filter(|row| row["metric"] == "zone_distance");
    assert!(zone.clone().count() == 3 && zone.clone().all(|row| row["verdict"] != "different"), "{after}");

    // The campaign again is another one, which is replayed and continued with the same compensation.
    let like = Repository::open(study.results("42-like-hall").as_ref()).unwrap();
    assert_eq!(like.plan().compensation, again.plan().compensation);
    assert_ne!(like.digest().unwrap(), campaign.digest().unwrap());
    page_of(&study, &run, &hall);
    study.sesamec(&["replay", "study.sesame", "T2", "--results", "42-like-hall"]).expect(0);
    let folder = study.results("42-hall-compensated");
    let run = ["run", "study.sesame", "--", "--compensation", &folder];
    assert_eq!(study.sesamec(&run).expect(0).digest(), like.digest().unwrap(), "by hand it is the same");
}

/// The page of the study has all parts, and no file of the user's is overwritten by it.
fn page_of(study: &Study, run: &str, hall: &str) {
    let again = study.results("42-hall-compensated");
    let all = ["study", run, hall, "--simulation", &again, "--reaction", "0.3", "--deceleration", "2", "--svg", "svg"];
    let said = study.sesamec(&all).expect(0).err;
    assert!(said.contains("Wrote study.html") && said.contains("figures into svg"), "{said}");
    let page = fs::read_to_string(study.folder.join("study.html")).unwrap();
    for part in ["id=\"space-data\"", "id=\"gap\"", "id=\"traces\"", "id=\"compensation\"", "class=\"briefing\""] {
        assert!(page.contains(part), "{part}");
    }
    assert!(page.contains("Safety zones must be wider by"), "the conditions are on the sheets");
    for figure in ["space.svg", "gap-zone_distance-T1.svg", "compensation-zone_distance.svg"] {
        assert!(study.folder.join("svg").join(figure).is_file(), "{figure}");
    }
    study.sesamec(&["study", run]).expect(0);
    fs::write(study.folder.join("notes.html"), "mine").unwrap();
    let said = study.sesamec(&["study", run, "-o", "notes.html"]).expect(1).err;
    assert!(said.contains("notes.html is not the page of a study; name another file with `--out`"), "{said}");
    assert_eq!(fs::read_to_string(study.folder.join("notes.html")).unwrap(), "mine");
}

#[test]
fn noise_is_fitted_by_how_much_runs_differ_and_varied_from_run_to_run() {
    // The model has torque noise; without it, noise on targets has to stand for it.
    let study = Study::new(
        "compensation_noise",
        5,
        "\"--as-modelled\" \"--noise\" \"8\"",
        "relay noise on link1 [0rad, 0.2rad]",
    );
    let study = study.carried_out();
    let hall = study.results("42-hall");
    let asked = ["compensate", "study.sesame", &hall, "--evaluations", "5", "--no-campaign"];
    let compensated = study.json(&asked);
    let levels = compensated["compensation"]["adjustments"][0]["levels"].as_array().unwrap();
    assert_eq!(levels.len(), 2, "one of each test that it was fitted to: {compensated}");
    assert!(levels.iter().all(|level| level.as_f64().unwrap() > 0.0), "{levels:?}");
    assert_eq!(compensated["held_out"]["tests"].as_array().unwrap().len(), 1);

    // Killed and started again, it goes on with what was tried, and reaches the same result.
    let asked = [&asked[..3], &["--evaluations", "2", "--no-campaign", "--hold-out", "T1,T2"]].concat();
    let compensated = study.json(&asked);
    let tried = PathBuf::from(&hall).join("fit.jsonl");
    assert!(!tried.exists(), "a fit that is complete leaves nothing behind");
    let mut child = command(sesamec()).args(&asked).current_dir(&study.folder).spawn().unwrap();
    let lines = || fs::read_to_string(&tried).map_or(0, |text| text.lines().count());
    patience::until("four simulations were tried", || {
        assert!(child.try_wait().unwrap().is_none(), "it ended before it was killed");
        lines() >= 4
    });
    child.kill().unwrap();
    child.wait().unwrap();
    let again = study.sesamec(&[&asked[..], &["--format", "json"]].concat()).expect(0);
    assert!(again.err.contains("Continuing a fit of which"), "{}", again.err);
    let again = again.json();
    assert_eq!(again["compensation"], compensated["compensation"]);
    assert_eq!(again["held_out"], compensated["held_out"]);
    assert!(!tried.exists());
}

#[test]
fn the_budget_chooses_tests_and_variations_of_one_are_named_by_where_they_are() {
    let study = Study::new("explore", 12, "", "relay delay [0ms, 100ms]");
    study.sesamec(&["run", "study.sesame"]).expect(0);
    // Without names, the lab's budget chooses among the tests of the front.
    let said = study.sesamec(&["physical", "study.sesame", "--results", "42"]).expect(0).err;
    assert!(said.contains("Chosen T1 T2 for 2 of 3: proved to be the best"), "{said}");
    let explore = ["explore", "study.sesame", "T2", "--vary", "P1", "-n", "5", "--from", "0.5", "--to", "0.9"];
    let said = study.sesamec(&explore).expect(0).err;
    assert!(said.contains("note: recorded already, and nearest to T2: T"), "{said}");
    let folder = study.results("42-T2-P1");
    let points = study.json(&["results", "sspr", &folder]);
    let p1: Vec<f64> = points.as_array().unwrap().iter().filter_map(|row| row["P1"].as_f64()).collect();
    let expected = [0.5, 0.6, 0.7, 0.8, 0.9];
    assert!(p1.len() == 5 && p1.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9), "{points}");
    let refused = |arguments: &[&str]| study.sesamec(&[&explore[..3], arguments].concat());
    let wrong = refused(&["--vary", "P1", "--from", "0.9", "--to", "0.1", "--results", "42"]).expect(1).err;
    assert!(wrong.contains("P1 of T2 can be from 0.000 to 1.000"), "{wrong}");
    let wrong = refused(&["--vary", "O0"]).expect(2).err;
    assert!(wrong.contains("tests are varied along P1 (how strong), T1 (when) or T2 (how long)"), "{wrong}");
}

#[test]
fn what_cannot_be_fitted_is_refused_with_what_to_do() {
    let study =
        Study::new("compensation_refused", 8, "\"--as-modelled\"", "parameter \"zone_shift_w\" [0, 1]").carried_out();
    let (run, hall) = (study.results("42"), study.results("42-hall"));
    let refused =
        |arguments: &[&str]| study.sesamec(&[&["compensate", "study.sesame"][..], arguments].concat()).expect(1).err;
    let said = refused(&[&run]);
    assert!(said.contains("has no results of a lab: `physical` runs tests in one"), "{said}");
    let said = refused(&[&hall]);
    let known = "it has no parameter `zone_shift_w` that a compensation can set; it has `zone_shift_x`, `zone_shift_y`, \
                 `zone_shift_z`";
    assert!(said.contains(known), "{said}");
    let of_lab = study.json(&["results", "tests", &hall]);
    let of_lab: BTreeSet<&str> = of_lab.as_array().unwrap().iter().filter_map(|row| row["run_of"].as_str()).collect();
    let of_lab: Vec<&str> = of_lab.into_iter().collect();
    let said = refused(&[&hall, "--hold-out", &of_lab.join(",")]);
    assert!(said.contains("all tests of the lab are held out; leave one to fit to"), "{said}");
    let space = study.folder.join("study.sesame");
    let text = fs::read_to_string(&space).unwrap();
    fs::write(&space, text.split_once("  fit ").unwrap().0.to_owned() + "}\n").unwrap();
    let said = refused(&[&hall]);
    assert!(said.contains("lab `hall` does not say what may be fitted"), "{said}");
    let said = study.sesamec(&["run", "study.sesame", "--", "--compensation", &run]).expect(1).err;
    assert!(said.contains("has no compensation: `compensate` fits the simulation to a lab and records one"), "{said}");
}
