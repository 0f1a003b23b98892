//! Results files that are not what they were: a clear error, and nothing is changed.

use std::fs;
use std::path::{Path, PathBuf};

use nix::sys::signal::Signal;
use proptest::prelude::*;
use proptest::test_runner::{RngSeed, TestRunner};
use sesame_tests::{Done, Runner, command, copy, done, sesamec};

use crate::faults::faulty;

const READERS: [&[&str]; 3] = [&["list", "--results"], &["show", "T2", "--results"], &["digest", "--results"]];

/// A copy of a run's folder to spoil.
fn spoiled(runner: &Runner, from: &str, name: &str, spoil: impl FnOnce(&Path)) -> PathBuf {
    let folder = runner.folder.join(name);
    drop(fs::remove_dir_all(&folder));
    copy(&runner.folder.join(from), &folder);
    spoil(&folder.join("results.sqlite"));
    folder
}

/// What all commands that read or go on say of a folder; the results file must stay as it is.
#[track_caller]
fn refused(runner: &Runner, folder: &Path, words: &str) {
    let file = folder.join("results.sqlite");
    let before = fs::read(&file).ok();
    let name = folder.to_str().unwrap();
    for command in READERS.iter().copied().chain([&["resume"][..]]) {
        let said = runner.run(&[command, &[name]].concat()).expect(1);
        assert!(said.err.starts_with("error: ") && said.err.contains(words), "{command:?}: {}", said.err);
        assert_eq!(said.out, "", "{command:?}");
        assert!(fs::read(&file).ok() == before, "{command:?} changed the file");
    }
}

/// The folder of an unfinished run, so that `resume` would go on with it.
fn unfinished(runner: &Runner) -> &'static str {
    let mut running = crate::interruption::Running::start(runner, "unfinished", "1");
    running.until_recorded(20);
    running.signal(Signal::SIGINT);
    let (_, said) = running.ended();
    said.expect(130);
    "unfinished/3"
}

#[test]
fn foreign_newer_and_damaged_results_are_refused_and_left_alone() {
    let runner = faulty("tampered", "harmless");
    let run = unfinished(&runner);
    let sql = |path: &Path, sql: &str| rusqlite::Connection::open(path).unwrap().execute_batch(sql).unwrap();

    let missing = runner.folder.join("nothing_here");
    fs::create_dir_all(&missing).unwrap();
    refused(&runner, &missing, "no results here");
    assert_eq!(fs::read_dir(&missing).unwrap().count(), 0, "not even a lock");

    refused(
        &runner,
        &spoiled(&runner, run, "text", |path| fs::write(path, "My notes\n".repeat(500)).unwrap()),
        "not an SQLite file",
    );
    refused(
        &runner,
        &spoiled(&runner, run, "other", |path| {
            fs::remove_file(path).unwrap();
            sql(path, "CREATE TABLE mine (x)");
        }),
        "another program",
    );
    refused(&runner, &spoiled(&runner, run, "newer", |path| sql(path, "PRAGMA user_version = 99")), "schema 99");
    refused(&runner, &spoiled(&runner, run, "empty", |path| fs::write(path, "").unwrap()), "empty");
    refused(
        &runner,
        &spoiled(&runner, run, "cut", |path| {
            let whole = fs::read(path).unwrap();
            fs::write(path, &whole[..whole.len() / 2]).unwrap();
        }),
        "damaged",
    );
    refused(
        &runner,
        &spoiled(&runner, run, "no_campaign", |path| sql(path, "DELETE FROM campaign")),
        "there is no campaign",
    );
}

/// What everything that reads results or goes on with them says of a folder, each with its words.
fn everybody(runner: &Runner, folder: &Path) -> Vec<(String, Done)> {
    let name = folder.to_str().unwrap();
    let page = folder.join("page.html");
    let runners: [&[&str]; 11] = [
        &["list", "--results", name],
        &["show", "T2", "--results", name],
        &["digest", "--results", name],
        &["report", "--results", name, "--output", page.to_str().unwrap()],
        &["export", "T2", "--results", name],
        &["replay", "T2", "--results", name],
        &["repeat", "T2", "1", "--results", name],
        &["confirm", "T2", "-n", "1", "--results", name],
        &["confirm", "--violations", "--results", name],
        &["shrink", "T2", "--evaluations", "2", "--results", name],
        &["resume", name],
    ];
    let analyses = ["campaigns", "tests", "front", "sspr", "regions", "coverage", "pairs", "indicators", "compare"];
    let said_of_runs = runners.map(|arguments| (arguments.join(" "), runner.run(arguments)));
    let said_of_files = analyses.map(|analysis| {
        let mut sesamec = command(sesamec());
        sesamec.args(["results", analysis, name]);
        if analysis == "compare" {
            sesamec.arg(name);
        }
        (format!("results {analysis}"), done(&mut sesamec))
    });
    said_of_runs.into_iter().chain(said_of_files).collect()
}

#[test]
fn a_plan_with_one_altered_digit_is_refused_by_everybody_with_the_place_in_it() {
    let runner = faulty("altered", "harmless");
    let run = unfinished(&runner);
    let altered = [
        (r#""objectives":["#, r#""objectives":[4"#, "campaign.objectives[0]: there is no metric 4"),
        (r#""direction":"maximise""#, r#""direction":null"#, "has no direction"),
        (r#""population":"#, r#""population":-"#, "its plan cannot be read"),
        (r#""end_after":1"#, r#""end_after":-1"#, "campaign.end_after: -1 is not above 0"),
        (r#""name":""#, "\"name\":\"\u{1b}[31m", "its plan cannot be read"),
    ];
    let changed = |name: &str, from: &str, to: &str| {
        spoiled(&runner, run, name, |path| {
            let connection = rusqlite::Connection::open(path).unwrap();
            let plan: String = connection.query_row("SELECT plan FROM campaign", [], |row| row.get(0)).unwrap();
            assert!(plan.contains(from), "{from} in {plan}");
            connection.execute("UPDATE campaign SET plan = ?1", [plan.replacen(from, to, 1)]).unwrap();
        })
    };
    for (at, (from, to, words)) in altered.into_iter().enumerate() {
        let folder = changed(&format!("altered-{at}"), from, to);
        let file = folder.join("results.sqlite");
        let before = fs::read(&file).unwrap();
        for (command, said) in everybody(&runner, &folder) {
            assert_eq!(said.code, Some(1), "{command} of {to}: {said:?}");
            assert!(
                said.err.contains("error: ") && said.err.contains("these results are damaged"),
                "{command}: {said:?}"
            );
            assert!(said.err.contains(words), "{command}: {said:?}");
            assert!(!said.err.contains("panicked") && !said.err.contains('\u{1b}'), "{command}: {said:?}");
            assert_eq!(said.out, "", "{command}");
            assert!(fs::read(&file).unwrap() == before, "{command} changed the file");
        }
    }
}

#[test]
fn results_with_changed_bytes_are_read_or_refused() {
    let runner = faulty("scribbled", "harmless");
    let run = unfinished(&runner);
    let length = fs::metadata(runner.folder.join(run).join("results.sqlite")).unwrap().len();
    let config =
        ProptestConfig { cases: 25, failure_persistence: None, rng_seed: RngSeed::Fixed(2), ..Default::default() };
    let scribbles = prop::collection::vec((0..length, any::<u8>(), 1..300usize), 1..4);
    TestRunner::new(config)
        .run(&(scribbles, prop::option::of(1..length)), |(scribbles, cut)| {
            let folder = spoiled(&runner, run, "scribbled", |path| {
                let mut bytes = fs::read(path).unwrap();
                for (at, byte, count) in scribbles {
                    let from = usize::try_from(at).unwrap().min(bytes.len());
                    let to = (from + count).min(bytes.len());
                    bytes[from..to].fill(byte);
                }
                bytes.truncate(cut.map_or(bytes.len(), |cut| usize::try_from(cut).unwrap()));
                fs::write(path, bytes).unwrap();
            });
            let file = folder.join("results.sqlite");
            let before = fs::read(&file).unwrap();
            for command in READERS {
                let said = runner.run(&[command, &[folder.to_str().unwrap()]].concat());
                let clear = match said.code {
                    Some(0) => said.err.is_empty(),
                    Some(1) => said.err.starts_with("error: ") && said.out.is_empty(),
                    _ => false,
                };
                prop_assert!(clear, "{command:?}: {said:?}");
                prop_assert!(fs::read(&file).unwrap() == before, "{command:?} changed the file");
            }
            let said = runner.run(&["resume", folder.to_str().unwrap()]);
            match said.code {
                Some(0) => {}
                // Even what looks whole may have become another campaign's.
                Some(1) => prop_assert!(said.err.contains("error: ") && !said.err.contains("panicked"), "{said:?}"),
                _ => prop_assert!(false, "{said:?}"),
            }
            Ok(())
        })
        .unwrap();
}
