//! Traces of a campaign's tests: which there are, what is in them, and metrics fed from them.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use nix::sys::signal::Signal;
use serde_json::Value;

use sesame_record::{Origin, Repository, TestRow};
use sesame_tests::{Project, Runner, python_mcap, workspace};

use crate::faults::recording;
use crate::interruption::{Running, no_worker_is_left};

/// The traces in a run's folder, by the names of their tests.
fn traces(folder: &Path) -> BTreeSet<String> {
    let entries = fs::read_dir(folder.join("traces")).unwrap();
    entries
        .map(|entry| {
            let name = entry.unwrap().file_name().into_string().unwrap();
            name.strip_suffix(".mcap").unwrap_or_else(|| panic!("{name} is not a trace")).to_owned()
        })
        .collect()
}

fn names<'a>(rows: impl Iterator<Item = &'a TestRow>) -> BTreeSet<String> {
    rows.map(|row| format!("T{}", row.number)).collect()
}

/// Files below a folder whose name has this in it.
fn files_named(folder: &Path, part: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files_named(&path, part));
        } else if path.file_name().unwrap().to_string_lossy().contains(part) {
            found.push(path);
        }
    }
    found
}

fn fed(runner: &Runner, trace: &Path, code: i32) -> Value {
    runner.run(&["replay-recording", trace.to_str().unwrap(), "--format", "json"]).expect(code).json()
}

/// The number in a name such as `T17`.
fn number(name: &str) -> u32 {
    name[1..].parse().unwrap()
}

#[test]
fn failing_tests_have_traces_for_every_cause_of_failure_and_others_have_none() {
    let runner = recording("traced", "all_faults", "record mcap failing");
    runner.run(&["--results", "r", "--timeout", "2", "--fail-on", "nothing"]).expect(0);
    let folder = runner.folder.join("r/3");
    let repository = Repository::open(&folder).unwrap();
    let rows = repository.tests().unwrap();
    let failed = |row: &&TestRow| matches!(row.outcome.word(), "crash" | "timeout") || row.origin == Origin::Reference;
    let ran = |row: &&TestRow| row.duplicate_of.is_none();
    assert_eq!(traces(&folder), names(rows.iter().filter(failed).filter(ran)));
    assert_eq!(files_named(&folder, "unfinished"), <[PathBuf; 0]>::default(), "nothing half done is left");

    let link = fs::read_to_string(folder.join("report.html")).unwrap();
    assert!(link.contains("href=\"traces/T0.mcap\""), "the page leads to traces");
    let shown = runner.run(&["show", "reference", "--results", "r/3"]).expect(0).out;
    assert!(shown.contains("trace r/3/traces/T0.mcap"), "{shown}");
    let without = rows.iter().find(|row| !failed(row)).unwrap();
    let shown = runner.run(&["show", &format!("T{}", without.number), "--results", "r/3"]).expect(0).out;
    assert!(!shown.contains("mcap"), "{shown}");

    // Metrics come out as recorded, and what a run that hangs did last is in its trace.
    for row in rows.iter().filter(failed).filter(ran) {
        let trace = folder.join("traces").join(format!("T{}.mcap", row.number));
        if row.outcome.detail().is_some_and(|detail| detail.contains("the hook was given a 1")) {
            let said = runner.run(&["replay-recording", trace.to_str().unwrap()]).expect(1);
            assert!(said.err.contains("a hook cannot take this recording: panicked at"), "{}", said.err);
            assert!(said.err.contains("the hook was given a 1"), "{}", said.err);
            continue;
        }
        let fed = fed(&runner, &trace, 0);
        assert_eq!(fed["run"], format!("T{} of all_faults ({})", row.number, row.outcome.word()));
        let died = row.values.is_empty();
        let expected = if died { "not_recorded" } else { "equal" };
        assert!(fed["metrics"].as_array().unwrap().iter().all(|metric| metric["sameness"] == expected), "{fed}");
        if row.outcome.word() == "timeout" {
            assert!(fed["messages"].as_u64().unwrap() > 0, "{fed}");
        }
    }
    let missing = runner.run(&["replay-recording", "r/3/results.sqlite"]).expect(1);
    assert!(missing.err.contains("this is no recording that can be read"), "{}", missing.err);
}

#[test]
fn a_hook_that_is_changed_is_compared_with_what_was_recorded() {
    let project = Project::kuka_cell("kuka_cell_traced");
    let space = fs::read_to_string(&project.space).unwrap();
    let simulator = workspace().join("examples/kuka_cell/simulator");
    let space = space.replace("crate \"simulator\"", &format!("crate \"{}\"", simulator.display())).replacen(
        "  end        after 70s\n",
        "  end        after 70s\n  record     mcap all\n",
        1,
    );
    let project = Project { space: project.folder.join("kuka_cell.sesame"), ..project };
    fs::write(&project.space, space).unwrap();
    let runner = project.build("coverage_experiment");
    runner.run(&["--results", "r", "--seed", "5", "--evaluations", "10"]).expect(0);
    let trace = runner.folder.join("r/5/traces/T3.mcap");
    let unchanged = fed(&runner, &trace, 0);
    assert!(unchanged["metrics"].as_array().unwrap().iter().all(|metric| metric["sameness"] == "equal"), "{unchanged}");

    let hook = project.runners.join("hooks/collision_occurrence.rs");
    let text = fs::read_to_string(&hook).unwrap();
    let changed = text.replace("ctx.add(1.0)", "ctx.add(2.0)");
    assert_ne!(text, changed);
    fs::write(&hook, changed).unwrap();
    let runner = project.build("coverage_experiment");
    let mut differing = Vec::new();
    for name in traces(&runner.folder.join("r/5")) {
        let trace = runner.folder.join(format!("r/5/traces/{name}.mcap"));
        let said = runner.run(&["replay-recording", trace.to_str().unwrap(), "--format", "json"]);
        let fed = said.json();
        let metric = fed["metrics"]
            .as_array()
            .unwrap()
            .iter()
            .find(|metric| metric["metric"] == "collision_occurrence")
            .unwrap();
        let (now, recorded) = (metric["now"]["value"].as_f64().unwrap(), metric["recorded"].as_f64().unwrap());
        assert_eq!(now, recorded * 2.0, "{fed}");
        assert_eq!(said.code, Some(if recorded > 0.0 { 3 } else { 0 }), "{fed}");
        differing.extend((recorded > 0.0).then_some(name));
    }
    let [first, ..] = &differing[..] else { panic!("some test has collisions") };
    let said = runner.run(&["replay-recording", &format!("r/5/traces/{first}.mcap")]).expect(3);
    assert!(said.out.contains("differs"), "{}", said.out);
}

#[test]
fn a_killed_run_goes_on_to_one_whole_trace_per_test() {
    let runner = recording("traced_killed", "harmless", "record mcap all");
    let whole = runner.run(&["--results", "whole"]).expect(0).digest();
    let mut running = Running::start(&runner, "killed", "2");
    running.until_recorded(20);
    running.signal(Signal::SIGKILL);
    running.ended();
    no_worker_is_left(&runner);
    assert_eq!(runner.run(&["resume", "killed/3"]).expect(0).digest(), whole);
    let folder = runner.folder.join("killed/3");
    let rows = Repository::open(&folder).unwrap().tests().unwrap();
    let ran = names(rows.iter().filter(|row| row.duplicate_of.is_none()));
    assert_eq!(traces(&folder), ran);
    for name in ran {
        let fed = fed(&runner, &folder.join("traces").join(format!("{name}.mcap")), 0);
        assert!(fed["metrics"].as_array().unwrap().iter().all(|metric| metric["sameness"] == "equal"), "{fed}");
    }
}

#[test]
#[ignore = "long: needs Python's mcap"]
fn python_reads_in_traces_what_the_results_say() {
    let runner = recording("traced_python", "all_faults", "record mcap all");
    runner.run(&["--results", "r", "--timeout", "2", "--fail-on", "nothing"]).expect(0);
    let folder = runner.folder.join("r/3");
    let repository = Repository::open(&folder).unwrap();
    let plan = repository.plan().clone();
    let files: Vec<PathBuf> =
        traces(&folder).iter().map(|name| folder.join("traces").join(format!("{name}.mcap"))).collect();
    let Some(found) = python_mcap::read(&files) else {
        assert!(std::env::var("CI").is_err(), "{} is not set: run `./test --long`", python_mcap::PYTHON);
        eprintln!("skipped: {} names no Python that has mcap; `./test --long` makes one", python_mcap::PYTHON);
        return;
    };
    let mut compared = 0;
    for found in found {
        let record = repository.test(number(found["test"].as_str().unwrap())).unwrap();
        let observed = &record.observation;
        assert_eq!(found["run"]["outcome"], observed.outcome.word());
        let sum = |of: &Value| of.as_object().unwrap().values().map(|count| count.as_u64().unwrap()).sum::<u64>();
        if observed.metrics.is_empty() {
            // Its worker died: there is what was written until then, and no result to compare with.
            let hung = observed.outcome.word() == "timeout";
            assert!(!hung || found["deeds"]["0"]["changed"] == 1, "{found}");
            continue;
        }
        compared += 1;
        assert_eq!(sum(&found["topics"]["published"]), observed.messages);
        for (at, operation) in observed.operations.iter().enumerate() {
            let count = |did: &str| found["deeds"][at.to_string()][did].as_u64().unwrap_or(0);
            assert_eq!(count("changed"), operation.counters.changed);
            assert_eq!(count("dropped"), operation.counters.dropped);
            assert_eq!(count("started"), operation.intervals.len() as u64);
        }
        for (metric, observed) in plan.metrics.iter().zip(&observed.metrics) {
            let series = found["series"].get(&metric.name).cloned().unwrap_or(Value::Array(vec![]));
            assert_eq!(series, serde_json::to_value(&observed.series).unwrap(), "{} of {found}", metric.name);
        }
    }
    println!("{compared} traces compared with results by Python, {} in all", files.len());
    assert!(compared >= 20);
}
