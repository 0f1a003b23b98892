//! Runs that the environment broke off: recorded and listed, and no findings.

use super::*;
use crate::record::DATABASE;

/// Of each kind.
fn outcomes() -> [Outcome; 3] {
    let message = || "the bridge is away".to_owned();
    [
        Outcome::LaunchFailed { message: message() },
        Outcome::Disconnect { message: message() },
        Outcome::WrongClock { message: message() },
    ]
}

/// Results whose last tests ended so.
fn broken_off() -> (TempDir, Repository) {
    let folder = folder();
    let plan = sample::plan();
    let mut records = sample::records(&plan, 20);
    for (record, outcome) in records.iter_mut().rev().zip(outcomes()) {
        record.observation = Observation::without_run(outcome);
        record.duplicate_of = None;
    }
    let mut recorder = commit_all(folder.path(), &records);
    let number = records.last().unwrap().number;
    let fresh = Repetition::of(number, 1, 7, &Observation::without_run(outcomes()[1].clone()));
    recorder.put_repetition(&fresh, &[]).unwrap();
    (folder, recorder.finish("all evaluations done").unwrap())
}

#[test]
fn a_run_that_the_environment_broke_off_is_read_as_it_was_recorded() {
    let (_folder, repository) = broken_off();
    let rows = repository.tests().unwrap();
    for (row, outcome) in rows.iter().rev().zip(outcomes()) {
        assert_eq!(row.outcome, outcome);
        assert!(outcome.is_of_environment() && !outcome.is_whole());
    }
    let last = rows.last().unwrap().number;
    assert_eq!(repository.repetitions().unwrap()[&last][0].outcome, outcomes()[1]);
}

#[test]
fn a_run_that_the_environment_broke_off_is_listed_and_no_finding() {
    let (folder, repository) = broken_off();
    let summary = crate::report::summary(&repository).unwrap();
    assert_eq!(summary.counts.environment, 3);
    let listed: Vec<&str> =
        summary.failures.iter().filter(|it| it.is_of_environment()).map(|it| &*it.outcome).collect();
    assert_eq!(listed, ["wrong_clock", "disconnect", "launch_failed", "disconnect"]);
    let connection = Connection::open(folder.path().join(DATABASE)).unwrap();
    let findings: i64 = connection
        .query_row("SELECT count(*) FROM findings WHERE detail = 'the bridge is away'", [], |row| row.get(0))
        .unwrap();
    assert_eq!(findings, 0);
    let junit = crate::report::junit(&summary);
    assert!(junit.contains("wrong_clock") && junit.contains("the bridge is away"), "{junit}");
    let page = crate::report::page(&repository).unwrap();
    assert!(page.contains("runs that the environment broke off") && page.contains("wrong clock"));
}

#[test]
fn results_of_a_release_that_did_not_know_these_outcomes_are_read() {
    let folder = folder();
    let plan = sample::plan();
    drop(commit_all(folder.path(), &sample::records(&plan, 5)));
    let connection = Connection::open(folder.path().join(DATABASE)).unwrap();
    let mut changed = 0;
    for table in ["tests", "repetitions"] {
        let sql: String =
            connection.query_row("SELECT sql FROM sqlite_schema WHERE name = ?1", [table], |row| row.get(0)).unwrap();
        let (before, after) = sql.split_once("'timeout',").unwrap();
        let after = after.split_once("'wrong_clock'").unwrap().1;
        connection.pragma_update(None, "writable_schema", true).unwrap();
        changed += connection
            .execute("UPDATE sqlite_schema SET sql = ?1 WHERE name = ?2", [&format!("{before}'timeout'{after}"), table])
            .unwrap();
    }
    drop(connection);
    assert_eq!(changed, 2);
    assert!(!Repository::open(folder.path()).unwrap().tests().unwrap().is_empty());
}
