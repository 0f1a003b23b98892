//! Coverage as a user meets it: a search that stops where it suffices, and the analyses of its results.

use std::path::Path;

use nix::sys::signal::Signal;

use sesame_record::Repository;
use sesame_tests::{Done, Project, Runner, command, done, sesamec, shared};

use crate::interruption::Running;

/// A search over a simulator that does nothing wrong, which stops when most of 48 cells are covered.
const SPACE: &str = r#"
space covered
system {
  simulator faulty = in_process "faulty_sim::Faulty" { crate "simulator"  step 10ms }
  topic level  = "faulty/level"         : real[m]
}

metric fuzzing_time minimise = fuzzing_time()
metric highest maximise default 0m = max(level) outbound

operation lift on level = random offset [0m, 3m] within [0s, 1s]
operation cut on level = packet loss [0%, 100%] within [0s, 1s]

campaign covering {
  objectives fuzzing_time, highest
  operations lift, cut   1..3 per test
  search     random { evaluations 60  seed 3 }
  coverage   { T1 [0, 1] cells 6   T2 [0, 0.5] cells 4   P1 [0, 1] cells 2   hits 1   stop at 60%   failsafe 500 }
  end        after 1s
}
"#;

fn results(arguments: &[&str], file: &Path) -> Done {
    done(command(sesamec()).arg("results").args(arguments).arg(file)).expect(0)
}

fn build(name: &str) -> Runner {
    shared(name, "covering", "covering", |key| Project::new(key, SPACE, "faulty"))
}

#[test]
fn a_search_stops_at_its_coverage_after_any_interruption() {
    let runner = build("covered");
    let whole = runner.run(&["--results", "whole", "--workers", "2"]).expect(0);
    let repository = Repository::open(&runner.folder.join("whole/3")).unwrap();
    let stop = repository.campaign().stop.clone().unwrap();
    let generations = repository.coverage().unwrap();
    let last = generations.last().unwrap();
    assert_eq!(stop, format!("its coverage was reached: {} of 48 cells", last.covered));
    assert!(last.covered >= 29, "60 % of 48 cells");
    assert!(generations[..generations.len() - 1].iter().all(|earlier| earlier.covered < 29));
    assert!(last.evaluations > 60 && last.evaluations < 500, "{last:?}: past `evaluations`, before `failsafe`");
    assert!(last.evaluations.is_multiple_of(50), "after whole generations");
    // The search, and a reference run before and after it.
    assert_eq!(repository.tests().unwrap().len(), last.evaluations as usize + 2);
    assert!(whole.out.contains(&format!("{} of 48 cells covered", last.covered)), "{}", whole.out);

    // The same with one worker, and when it is stopped in the middle.
    assert_eq!(runner.run(&["--results", "alone", "--workers", "1"]).expect(0).digest(), whole.digest());
    let mut running = Running::start(&runner, "stopped", "2");
    running.until_recorded(70);
    running.signal(Signal::SIGKILL);
    running.ended();
    assert_eq!(runner.run(&["resume", "stopped/3"]).expect(0).digest(), whole.digest());
}

#[test]
fn analyses_of_a_results_file_say_what_the_campaign_said() {
    let runner = build("analysed");
    let said = runner.run(&["--results", "analysed", "--evaluations", "30"]).expect(0).out;
    let folder = runner.folder.join("analysed/3");
    let repository = Repository::open(&folder).unwrap();
    let counted = *repository.coverage().unwrap().last().unwrap();

    let curve = results(&["coverage", "--format", "csv"], &folder).out;
    let last: Vec<&str> = curve.lines().last().unwrap().split(',').collect();
    let [covered, cells, feasible] = [counted.covered, counted.cells, counted.feasible].map(|count| count.to_string());
    assert_eq!([last[1], last[2], last[4]], [&covered, &cells, &feasible]);
    let cells = results(&["coverage", "--cells", "--dims", "P1,T1", "--format", "json"], &folder).out;
    let cells: serde_json::Value = serde_json::from_str(&cells).unwrap();
    assert_eq!(cells.as_array().unwrap().len(), 12);

    let pairs = results(&["pairs", "--format", "json"], &folder);
    let sentence = "1 of 1 pair of operations acted together, 4 of 4 in the same quarter of the run";
    assert!(pairs.err.contains(&format!("note: {sentence}")), "{}", pairs.err);
    assert!(said.contains(sentence), "{said}");
    let pairs = pairs.json();
    let [lift, cut, both] = [0, 1, 2].map(|row| pairs[row]["together"].as_u64().unwrap());
    assert!(both <= lift.min(cut) && lift + cut - both <= 30, "{pairs}");
    assert_eq!((pairs[2]["first"].as_str(), pairs[2]["second"].as_str()), (Some("lift"), Some("cut")));

    let front = results(&["front", "--format", "json"], &folder).out;
    let front: serde_json::Value = serde_json::from_str(&front).unwrap();
    let standing = front.as_array().unwrap().iter().filter(|row| row["same_as"].is_null());
    let names: Vec<&str> = standing.map(|row| row["test"].as_str().unwrap()).collect();
    let members = repository.latest_result_set().unwrap().unwrap().members;
    assert_eq!(names, members.iter().map(|number| format!("T{number}")).collect::<Vec<_>>());

    let few = results(&["sspr", "--set", "final", "--dims", "T1,O0", "--format", "csv"], &folder).out;
    assert_eq!((few.lines().next().unwrap(), few.lines().count()), ("test,T1,O0", members.len() + 1));
    let original = results(&["sspr", "--compat", "original"], &folder).out;
    assert_ne!(original, results(&["sspr"], &folder).out);
    assert_eq!(results(&["tests"], &folder).out.lines().count(), 31);
    let found = results(&["campaigns", "--format", "json"], &runner.folder.join("analysed")).out;
    let found: serde_json::Value = serde_json::from_str(&found).unwrap();
    assert_eq!((found[0]["campaign"].as_str(), found[0]["tests"].as_u64()), (Some("covering"), Some(30)));

    let indicators = results(&["indicators", "--format", "json"], &folder);
    assert!(indicators.err.contains("note: hypervolumes are measured from fuzzing_time "), "{}", indicators.err);
    let indicators = indicators.json();
    let recorded = repository.indicators().unwrap();
    assert_eq!(indicators.as_array().unwrap().len(), recorded.len());
    let last = indicators.as_array().unwrap().last().unwrap();
    assert_eq!((last["hypervolume"].as_f64(), last["igd_plus"].as_f64()), (recorded[0].hypervolume, Some(0.0)));
    assert_eq!((last["covered"].as_u64(), last["evaluations"].as_u64()), (Some(counted.covered as u64), Some(30)));

    let refused = |arguments: &[&str]| {
        let mut asked = command(sesamec());
        done(asked.arg("results").args(arguments)).expect(1).err
    };
    let shown = folder.to_str().unwrap();
    assert!(refused(&["sspr", "--set", "finale", shown]).contains("no set of results `finale`"));
    assert!(refused(&["tests", "no/such/file"]).contains("no results here"));
    assert!(refused(&["coverage", "--dims", "T3", shown]).contains("no dimension T3"));
    assert!(refused(&["indicators", "--reference", "1,-2,3", shown]).contains("has 3 values for 2 objectives"));
    assert!(refused(&["compare", shown]).contains("there is only one run"));
    let nothing = refused(&["campaigns", tempfile::tempdir().unwrap().path().to_str().unwrap()]);
    assert!(nothing.contains("no results in"), "{nothing}");
}

#[test]
fn runs_are_compared_one_by_one_and_in_groups() {
    let runner = build("compared");
    for seed in ["1", "2", "3"] {
        runner.run(&["--results", "short", "--evaluations", "10", "--seed", seed]).expect(0);
        runner.run(&["--results", "long", "--evaluations", "40", "--seed", seed]).expect(0);
    }
    let ask = |arguments: &[&str]| {
        let mut asked = command(sesamec());
        done(asked.current_dir(&runner.folder).args(["results", "compare"]).args(arguments)).expect(0).out
    };
    let groups: serde_json::Value = serde_json::from_str(&ask(&["short", "long", "--format", "json"])).unwrap();
    let long =
        groups.as_array().unwrap().iter().find(|row| row["measure"] == "tests" && row["group"] == "long").unwrap();
    assert_eq!(
        (long["median"].as_f64(), long["a12"].as_f64(), long["runs"].as_u64()),
        (Some(40.0), Some(1.0), Some(3))
    );
    assert_eq!((long["p"].as_f64(), long["p_is"].as_str()), (Some(0.1), Some("exact")));
    let better =
        groups.as_array().unwrap().iter().filter(|row| row["group"] == "long" && row["measure"] == "hypervolume");
    assert!(better.map(|row| row["a12"].as_f64().unwrap()).all(|a12| a12 > 0.5));
    let two = ask(&["short/1", "long/1", "--format", "csv"]);
    assert!(two.starts_with("group,campaign,seed,tests,") && two.lines().count() == 3, "{two}");
    assert_eq!(ask(&["short", "long", "--by-campaign", "--runs"]).lines().count(), 7);
    assert_eq!(ask(&["short", "--pairs", "--format", "csv"]).lines().count(), 7);
}
