//! Runs that the environment broke off: recorded, and no findings.

use super::*;
use crate::DATABASE;

/// Results whose last tests ended so.
fn broken_off() -> (TempDir, Repository) {
    let folder = folder();
    let repository = sample::broken_off(folder.path());
    (folder, repository)
}

#[test]
fn a_run_that_the_environment_broke_off_is_read_as_it_was_recorded() {
    let (_folder, repository) = broken_off();
    let rows = repository.tests().unwrap();
    for (row, outcome) in rows.iter().rev().zip(sample::outcomes_of_environment()) {
        assert_eq!(row.outcome, outcome);
        assert!(outcome.is_of_environment() && !outcome.is_whole());
    }
    let last = rows.last().unwrap().number;
    assert_eq!(repository.repetitions().unwrap()[&last][0].outcome, sample::outcomes_of_environment()[1]);
}

#[test]
fn a_run_that_the_environment_broke_off_is_no_finding() {
    let (folder, _repository) = broken_off();
    let connection = Connection::open(folder.path().join(DATABASE)).unwrap();
    let findings: i64 = connection
        .query_row("SELECT count(*) FROM findings WHERE detail = 'the bridge is away'", [], |row| row.get(0))
        .unwrap();
    assert_eq!(findings, 0);
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
