//! Which run is meant when none is named.

use std::fs;

use nix::sys::signal::Signal;
use sesame_tests::{Runner, workspace};

use crate::faults::project;
use crate::interruption::Running;

/// The folder of results that a runner has by default, without what an earlier run of these tests left there.
fn results(runner: &Runner) -> std::path::PathBuf {
    assert!(runner.folder.starts_with(workspace().join("target")) || !runner.folder.starts_with(workspace()));
    let results = runner.folder.join("runners/harmless/results");
    drop(fs::remove_dir_all(&results));
    results
}

#[test]
fn without_a_folder_the_killed_run_is_gone_on_with_and_the_latest_one_reported() {
    let runner = project("latest", "harmless", "").build("harmless");
    let results = results(&runner);
    let nothing = runner.run(&["resume"]).expect(1);
    assert!(nothing.err.contains("there is nothing to go on with"), "{}", nothing.err);

    let mut killed = Running::start(&runner, results.to_str().unwrap(), "1");
    killed.until_recorded(2);
    // Finished while the other one goes on: its database is written after that of the other was made.
    let finished = runner.run(&["--seed", "8", "--evaluations", "3"]).expect(0).digest();
    let at_work = runner.run(&["resume"]).expect(1);
    assert!(at_work.err.contains("is writing these results"), "{}", at_work.err);
    killed.until_recorded(20);
    killed.signal(Signal::SIGKILL);
    let _ = killed.ended();

    let listed = runner.run(&["list", "--format", "json"]).expect(0).out;
    let named =
        runner.run(&["list", "--format", "json", "--results", results.join("3").to_str().unwrap()]).expect(0).out;
    assert_eq!(listed, named, "the killed run was written last");
    let report = runner.run(&["report"]).expect(0);
    assert!(report.out.contains("results/3/report.html"), "{}", report.out);

    let resumed = runner.run(&["resume"]).expect(0);
    assert!(resumed.out.contains("results/3/report.html"), "{}", resumed.out);
    let digest = resumed.digest();
    assert_ne!(digest, finished);
    assert_eq!(runner.run(&["digest"]).expect(0).out.trim(), digest, "it was written last");
    let nothing = runner.run(&["resume"]).expect(1);
    assert!(nothing.err.contains("no run in") && nothing.err.contains("is unfinished"), "{}", nothing.err);

    // What was killed as it began is nothing to go on with, and its folder is taken by the next run of that seed.
    fs::create_dir(results.join("9")).unwrap();
    let begun = runner.run(&["--seed", "9", "--evaluations", "3"]).expect(0);
    assert!(begun.out.contains("results/9/report.html"), "{}", begun.out);
}
