//! What goes wrong in simulators and hooks ends a test, never a campaign; what is wrong without any disturbance is
//! reported before anything is fuzzed.

use std::collections::BTreeMap;
use std::fs;

use sesame_base::observation::Outcome;
use sesame_record::{Origin, Repository};
use sesame_tests::{Done, Project, Runner, shared, workspace};

/// The runner of this campaign, with the faulty simulator and the hook filled in. It is shared, so tests that use it
/// must say where results go.
pub(crate) fn faulty(name: &str, campaign: &str) -> Runner {
    recording(name, campaign, "")
}

/// The same, with this clause in all campaigns.
pub(crate) fn recording(name: &str, campaign: &str, clause: &str) -> Runner {
    let key = format!("faulty {campaign} {clause}").trim_end().replace(' ', "-");
    shared(name, &key, campaign, |key| project(key, campaign, clause))
}

/// A project in a folder of this name, with such a runner.
pub(crate) fn project(name: &str, campaign: &str, clause: &str) -> Project {
    let space = fs::read_to_string(workspace().join("tests/simulators/faulty/space.sesame")).unwrap();
    let space = space.replace("  end        after 1s\n", &format!("  end        after 1s\n  {clause}\n"));
    let project = Project::new(name, &space.replace("NAME", "faulty"), "faulty");
    project.sesamec("generate", &["--campaign", campaign]).expect(0);
    let hook = project.runners.join("hooks/fragile.rs");
    let stub = fs::read_to_string(&hook).unwrap();
    let body = "match heard {
            1.0 => panic!(\"the hook was given a 1\"),
            2.0 => ctx.set(f64::NAN),
            _ => ctx.set(heard),
        }";
    fs::write(&hook, stub.replace("ctx.unimplemented();", body)).unwrap();
    project
}

#[test]
fn every_fault_is_the_outcome_of_its_test_and_the_campaign_goes_on() {
    let runner = faulty("breaking", "all_faults");
    let said = runner.run(&["--results", "all", "--timeout", "2", "--fail-on", "nothing"]).expect(0);
    let repository = Repository::open(&runner.folder.join("all/3")).unwrap();
    let plan = repository.plan().clone();
    let mut by_fault: BTreeMap<String, Vec<(u32, Outcome)>> = BTreeMap::new();
    for row in repository.tests().unwrap() {
        let fault = match row.origin {
            Origin::Search => plan.operation(row.test.operations[0].operation).name.clone(),
            _ => "none".to_owned(),
        };
        // An operation may end before the first message reaches it.
        if row.outcome != Outcome::NoEffect {
            by_fault.entry(fault).or_default().push((row.number, row.outcome));
        }
    }
    let expected = BTreeMap::from([
        ("none", ("completed", "")),
        ("do_nothing", ("completed", "")),
        ("do_hook_nan", ("completed", "")),
        ("do_panic", ("crash", "the simulator was disturbed at ")),
        ("do_error", ("crash", "a joint broke at ")),
        ("do_hook_panic", ("crash", "the hook was given a 1")),
        ("do_abort", ("crash", "the worker process ended: signal: 6 (SIGABRT)")),
        ("do_hang", ("timeout", "stopped after 2 s")),
    ]);
    assert_eq!(by_fault.keys().collect::<Vec<_>>(), expected.keys().collect::<Vec<_>>(), "each fault occurs");
    for (fault, tests) in &by_fault {
        let (word, detail) = expected[fault.as_str()];
        for (number, outcome) in tests {
            assert_eq!(outcome.word(), word, "{fault}: T{number} {outcome:?}");
            assert!(outcome.detail().unwrap_or_default().contains(detail), "{fault}: T{number} {outcome:?}");
            let warned = !repository.test(*number).unwrap().observation.warnings.is_empty();
            assert_eq!(warned, fault == "do_hook_nan", "{fault}: T{number}");
            let metrics = repository.test(*number).unwrap().observation.metrics;
            let not_finite = metrics.iter().any(|shown| shown.not_finite.is_some());
            assert_eq!(not_finite, fault == "do_hook_nan", "{fault}: T{number}");
            if matches!(word, "crash" | "timeout") {
                assert!(said.out.contains(&format!("T{number} ")), "T{number} is listed as a finding: {}", said.out);
            }
        }
    }
    let front = repository.latest_result_set().unwrap().unwrap().members;
    for (fault, tests) in &by_fault {
        let failed = matches!(expected[fault.as_str()].0, "crash" | "timeout");
        assert!(!failed || tests.iter().all(|(number, _)| !front.contains(number)), "{fault} on the front {front:?}");
    }
    let (aborted, _) = by_fault["do_abort"][0];
    let shown = runner.run(&["show", &format!("T{aborted}"), "--results", "all/3"]).expect(0).out;
    assert!(shown.contains("the last lines that the worker printed:\nabout to abort"), "{shown}");

    // Nothing of this depends on workers, on what a worker had printed before, or on the clock.
    let one = runner.run(&["--results", "one", "--timeout", "3", "--workers", "1", "--fail-on", "nothing"]).expect(0);
    assert_eq!(one.digest(), said.digest());
}

/// A run of the harmless campaign in which the simulator has this fault also without disturbance.
fn with_faulty_reference_run(runner: &Runner, fault: &str) -> Done {
    sesame_tests::done(runner.command(&["--results", fault]).env("FAULT", fault))
}

#[test]
fn a_system_that_fails_without_disturbance_is_not_fuzzed() {
    let runner = faulty("unready", "harmless");
    for (fault, words) in [
        ("crash", "the reference run is to crash"),
        ("missing topic", "the simulator has no topic `faulty/level`; did you mean `faulty/lvel`?"),
        ("flood", "it publishes more than 100000 messages in the step to 0.010 s"),
        ("wrong type", "a message on `faulty/level` is not of its declared type: "),
    ] {
        let said = with_faulty_reference_run(&runner, fault).expect(1);
        assert!(said.err.contains("the reference run failed: "), "{}", said.err);
        assert!(said.err.contains(words), "{}", said.err);
        assert!(said.err.contains("nothing was fuzzed"), "{}", said.err);
        let repository = Repository::open(&runner.folder.join(fault).join("3")).unwrap();
        assert_eq!(repository.tests().unwrap().len(), 1);
        // There is nothing to go on with: the next run must not point back here.
        let next = sesame_tests::done(&mut runner.command(&["--results", fault])).expect(0);
        assert!(!next.err.contains("unfinished"), "{}", next.err);
    }
}

#[test]
fn a_run_that_the_simulator_ends_early_is_complete_at_its_own_end() {
    let runner = faulty("brief", "harmless");
    let said = with_faulty_reference_run(&runner, "early end").expect(0);
    let repository = Repository::open(&runner.folder.join("early end/3")).unwrap();
    let rows = repository.tests().unwrap();
    assert_eq!(rows.len(), 62, "{}", said.out);
    assert!(
        rows.iter().all(|row| row.end == 0.5 && matches!(row.outcome.word(), "completed" | "no_effect")),
        "{rows:?}"
    );
}

/// Where workers inherit their connection it is their standard input, until they put an empty one in its place.
#[test]
fn a_simulator_or_hook_that_reads_standard_input_finds_it_empty() {
    let runner = faulty("curious", "harmless");
    let whole = runner.run(&["--results", "whole", "--evaluations", "6"]).expect(0).digest();
    let mut curious = runner.command(&["--results", "curious", "--evaluations", "6", "--timeout", "120"]);
    let curious = sesame_tests::done(curious.env("FAULT", "reads input")).expect(0);
    assert_eq!(curious.digest(), whole);
}

#[test]
fn a_requirement_that_the_reference_run_violates_is_a_warning() {
    let runner = faulty("tilted", "harmless");
    let said = with_faulty_reference_run(&runner, "broken requirement").expect(0);
    let words = "requirement R1 is violated before anything is fuzzed: `highest` is 5";
    assert!(said.out.contains(words), "{}", said.out);
    let repository = Repository::open(&runner.folder.join("broken requirement/3")).unwrap();
    assert!(repository.events().unwrap().iter().any(|event| event.text == words));
}

#[test]
fn every_row_of_the_table_of_faults_names_a_test_that_exists() {
    let page = fs::read_to_string(workspace().join("docs/faults.md")).unwrap();
    let rows: Vec<&str> = page.lines().filter(|line| line.starts_with("| ") && line.contains("](../")).collect();
    assert!(rows.len() >= 20, "{} rows", rows.len());
    for row in rows {
        let (name, file) = row.rsplit_once("[`").unwrap().1.split_once("`](../").unwrap();
        let file = file.split(')').next().unwrap();
        let text = fs::read_to_string(workspace().join(file)).unwrap_or_else(|error| panic!("{error}: {row}"));
        let test = text.split(&format!("fn {name}(")).next().unwrap();
        let is_function = test.len() < text.len() && test.trim_end().ends_with(']');
        // A program that is its own harness lists its tests.
        assert!(is_function || text.contains(&format!("\"{name}")), "{file} has no test `{name}`: {row}");
    }
}
