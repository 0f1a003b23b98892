//! Tests of a campaign in a lab: run in a stand-in for one, or entered by hand, recorded apart, and compared with the
//! campaign.

use std::fs;
use std::path::PathBuf;

use sesame_analysis::gap::lab_runs;
use sesame_plan::Transport;
use sesame_record::{Origin, Repository};
use sesame_tests::{Project, Runner, command, done, kuka_cell_lab, sesamec};

/// A campaign of a few tests of the noisy cell, and two labs: one as modelled, and one with other drives and zones.
fn project(name: &str) -> Project {
    let program = kuka_cell_lab();
    let lab = |name: &str, arguments: &str| {
        format!(
            "physical {name} {{\n  simulator cell = process \"{}\"{arguments} {{ step 20ms }}\n  repeats 3\n  \
             tolerance collision_occurrence 3, top_speed 0.1m/s, closest_approach 20mm\n}}\n",
            program.display()
        )
    };
    let labs = [lab("twin", " \"--as-modelled\""), lab("hall", " \"--zone-shift\" \"300,0,0\" \"--latency\" \"200\"")];
    let campaign = "campaign study {\n  objectives fuzzing_time, collision_occurrence\n  operations jitter_link0, \
                    jitter_link1   1..2 per test\n  activate by time\n  search random { evaluations 3  seed 5 }\n  \
                    end after 40s\n}\n";
    let project = Project::kuka_cell_with(name, &format!("{}{campaign}", labs.concat()));
    let text = fs::read_to_string(&project.space).unwrap().replace("kuka_cell_sim::Cell", "kuka_cell_sim::NoisyCell");
    fs::write(&project.space, text).unwrap();
    project
}

const TESTS: [&str; 3] = ["T1", "T2", "T3"];

/// Runs the tests in a lab, and gives the folder of what came of it.
fn in_lab(runner: &Runner, lab: &str, into: &str) -> PathBuf {
    let arguments = ["physical", "--lab", lab, "--results", "results/5", "--into", into];
    runner.run(&[&arguments[..], &TESTS].concat()).expect(0);
    runner.folder.join(into).join(format!("5-{lab}"))
}

/// `sesamec gap` of the campaign and a lab, as JSON.
fn gap(runner: &Runner, lab: &PathBuf) -> Vec<serde_json::Value> {
    let mut sesamec = command(sesamec());
    sesamec.arg("gap").arg(runner.folder.join("results/5")).arg(lab).args(["--format", "json"]);
    serde_json::from_str(&done(&mut sesamec).expect(0).out).unwrap()
}

#[test]
fn recorded_tests_are_run_in_a_lab_and_a_gap_shows_where_one_was_built_in() {
    let runner = project("physical").build("study");
    runner.run(&["--results", "results"]).expect(0);
    runner.run(&[&["confirm", "--results", "results/5", "-n", "4"][..], &TESTS].concat()).expect(0);

    let twin = in_lab(&runner, "twin", "labs");
    let campaign = Repository::open(&runner.folder.join("results/5")).unwrap();
    let recorded = Repository::open(&twin).unwrap();
    let task = recorded.task().in_lab().unwrap();
    assert_eq!((task.lab.as_str(), task.repeats, task.tests.len()), ("twin", 3, 3));
    let runs = lab_runs(&campaign, &recorded).unwrap();
    let of: Vec<u32> = runs.iter().map(|run| run.of).collect();
    assert_eq!(of, [1, 2, 3, 1, 2, 3, 1, 2, 3], "all are run once before any is run again");
    assert!(recorded.tests().unwrap().iter().any(|row| row.origin == Origin::Reference));
    let mut tests = command(sesamec());
    let tests = done(tests.args(["results", "tests", "--format", "csv"]).arg(&twin)).expect(0).out;
    let mut lines = tests.lines();
    assert!(lines.next().unwrap().starts_with("test,run_of,origin"), "{tests}");
    assert!(lines.nth(3).unwrap().starts_with("T4,T1,search"), "{tests}");
    // The lab as modelled differs by its noise only: no run is one of the simulation, and no metric is different.
    for run in &runs {
        assert!(campaign.judge().unwrap().runs(run.of).iter().all(|fresh| fresh.values != run.row.values));
    }
    let compared = gap(&runner, &twin);
    assert!(compared.iter().all(|row| row["verdict"] != "different"), "{compared:?}");
    assert_eq!(compared.iter().filter(|row| row["metric"] == "closest_approach").count(), 3);

    // The same again is the same, and the campaign's results are as they were.
    let again = in_lab(&runner, "twin", "labs again");
    assert_eq!(Repository::open(&again).unwrap().digest().unwrap(), recorded.digest().unwrap());

    let hall = in_lab(&runner, "hall", "labs");
    let compared = gap(&runner, &hall);
    let different: Vec<&str> =
        compared.iter().filter(|row| row["verdict"] == "different").filter_map(|row| row["metric"].as_str()).collect();
    assert!(!different.is_empty(), "{compared:?}");
    // The metric of what is disturbed does not depend on where it is disturbed.
    assert!(!different.contains(&"fuzzing_time"), "{different:?}");
}

#[test]
fn a_campaign_is_performed_in_a_lab_in_place_of_its_simulator() {
    let runner = project("elsewhere").build("study");
    runner.run(&["--results", "results", "--simulator", "twin"]).expect(0);
    let elsewhere = Repository::open(&runner.folder.join("results/5-with-twin")).unwrap();
    let plan = elsewhere.campaign().plan.clone();
    assert!(matches!(plan.simulator.transport, Transport::Process { .. }), "{:?}", plan.simulator);
    assert_eq!(elsewhere.tests().unwrap().iter().filter(|row| row.origin == Origin::Search).count(), 3);
    // What was found there is run again there, and the simulator knows nothing of it.
    let again = ["confirm", "T1", "-n", "1", "--results", "results/5-with-twin"];
    runner.run(&[&again[..], &["--simulator", "twin"]].concat()).expect(0);
    let said = runner.run(&again).expect(1).err;
    assert!(said.contains("simulator"), "{said}");
    let said = runner.run(&["--simulator", "attic"]).expect(1).err;
    assert!(said.contains("there is no lab `attic`, there is `twin`, `hall`"), "{said}");
}

#[test]
fn tests_that_people_ran_are_entered_in_a_form_and_compared_like_those_of_a_runner() {
    let runner = project("entered").build("study");
    runner.run(&["--results", "results"]).expect(0);
    let said = |arguments: &[&str]| {
        let mut sesamec = command(sesamec());
        done(sesamec.current_dir(&runner.folder).args(arguments)).expect(0)
    };
    said(&["lab", "form", "results/5", "T1", "T2", "--lab", "hall", "-o", "form.csv"]);
    let form = fs::read_to_string(runner.folder.join("form.csv")).unwrap();
    assert_eq!(form.lines().filter(|line| line.starts_with('T')).count(), 6, "3 repeats of 2 tests: {form}");
    let plan = Repository::open(&runner.folder.join("results/5")).unwrap().plan().clone();
    let blank = ",".repeat(plan.metrics.len());
    let mut runs = 0;
    let fill = |line: &str| match line.strip_suffix(&format!(",{blank}")) {
        Some(run) => {
            runs += 1;
            let values = plan.metrics.iter().map(|metric| match metric.name.as_str() {
                "collision_occurrence" => format!("{}", 1000 + runs % 2),
                _ => "unmeasured".to_owned(),
            });
            format!("{run},completed,{}", values.collect::<Vec<_>>().join(","))
        }
        None => line.replace("# operator:", "# operator: Ada"),
    };
    let filled: Vec<String> = form.lines().map(fill).collect();
    fs::write(runner.folder.join("form.csv"), filled.join("\n")).unwrap();
    let added = said(&["lab", "add", "results/5", "form.csv", "--lab", "hall"]).err;
    assert!(added.contains("results/5-hall: 6 runs of 2 tests in lab `hall`"), "{added}");

    let tests = said(&["results", "tests", "results/5-hall", "--format", "csv"]).out;
    assert!(tests.starts_with("test,run_of,run,origin"), "{tests}");
    assert!(tests.lines().nth(3).unwrap().starts_with("T3,T1,2,search") && tests.contains(",Ada"), "{tests}");
    let compared = gap(&runner, &runner.folder.join("results/5-hall"));
    let metrics: Vec<_> = compared.iter().filter_map(|row| row["metric"].as_str()).collect();
    assert_eq!(metrics, ["collision_occurrence"; 2], "only what was measured is compared");
    let digest = Repository::open(&runner.folder.join("results/5-hall")).unwrap().digest().unwrap();
    assert!(runner.run(&["digest", "--results", "results/5-hall"]).expect(0).out.contains(&digest));
    runner.run(&["report", "--results", "results/5-hall"]).expect(0);
    let page = fs::read_to_string(runner.folder.join("results/5-hall/report.html")).unwrap();
    assert!(page.contains("Operator") && page.contains("Ada"));
}

#[test]
fn what_cannot_be_run_in_a_lab_or_compared_is_refused_with_what_to_do() {
    let runner = project("physical_refused").build("study");
    runner.run(&["--results", "results"]).expect(0);
    let refused = |arguments: &[&str]| {
        runner.run(&[&["physical", "--results", "results/5"][..], arguments].concat()).expect(1).err
    };
    let labs = "the space has several labs; name one with `--lab`: `twin`, `hall`";
    assert!(refused(&["T1"]).contains(labs), "{}", refused(&["T1"]));
    assert!(refused(&["T1", "--lab", "attic"]).contains("there is no lab `attic`, there is `twin`, `hall`"));
    assert!(refused(&["T1", "T1", "--lab", "twin"]).contains("T1 is named twice"));
    let said = refused(&["--lab", "twin"]);
    assert!(said.contains("lab `twin` has no `budget` by which tests are chosen; name the tests"), "{said}");
    assert!(refused(&["reference", "--lab", "twin"]).contains("T0 disturbs nothing"));

    let mut sesamec = command(sesamec());
    sesamec.arg("gap").args([runner.folder.join("results/5"), runner.folder.join("results/5")]);
    assert!(done(&mut sesamec).expect(1).err.contains("has no results of a lab: `physical` runs tests in one"));
}
