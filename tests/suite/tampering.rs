//! Results files that are not what they were: a clear error, and nothing is changed.

use std::fs;
use std::path::{Path, PathBuf};

use nix::sys::signal::Signal;
use proptest::prelude::*;
use proptest::test_runner::{RngSeed, TestRunner};
use sesame_tests::{Runner, copy};

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

#[test]
fn whatever_is_done_to_a_file_it_is_read_or_refused() {
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
