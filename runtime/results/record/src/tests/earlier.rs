//! Results of earlier releases: they are read with the digest they were given, and nothing is added to them.

use std::path::Path;

use rusqlite::Connection;
use tempfile::TempDir;

use super::folder;
use crate::{DATABASE, Recorder, Repository, SCHEMA, sample};

/// What a runner of schema 7 recorded, in a folder of its own.
fn of_schema_7(robustness: bool) -> TempDir {
    let folder = folder();
    sample::of_schema_7(folder.path(), robustness);
    folder
}

/// Changes a file of results.
fn change(folder: &Path, sql: &str) {
    Connection::open(folder.join(DATABASE)).unwrap().execute_batch(sql).unwrap();
}

#[test]
fn results_of_schema_7_are_read_with_the_digest_they_were_given_and_nothing_is_added_to_them() {
    for robustness in [true, false] {
        let folder = of_schema_7(robustness);
        let before = std::fs::read(folder.path().join(DATABASE)).unwrap();
        let repository = Repository::open(folder.path()).unwrap();
        let given = "1b2d60613842ea6fa43f672b75e4fd90b32d2817391d30f8b423c9e50bc3da44";
        assert_eq!(repository.digest().unwrap(), given);
        let record = repository.test(1).unwrap();
        assert!(record.observation.traffic.is_empty(), "nobody wrote down what was heard");
        assert_eq!(
            repository
                .decisions(0..=20)
                .unwrap()
                .values()
                .flatten()
                .map(|decisions| decisions.hazards.len())
                .sum::<usize>(),
            8
        );
        drop(repository);
        refuses_writers(folder.path(), 7);
        assert_eq!(std::fs::read(folder.path().join(DATABASE)).unwrap(), before);
    }
}

#[test]
fn the_same_results_keep_their_digest_in_later_releases() {
    let (earlier, again) = (of_schema_7(true), folder());
    sample::recorded_again(again.path(), &Repository::open(earlier.path()).unwrap()).unwrap();
    // The version is part of the content.
    change(again.path(), "UPDATE campaign SET runtime = '0.1.0'");
    let given = "1b2d60613842ea6fa43f672b75e4fd90b32d2817391d30f8b423c9e50bc3da44";
    assert_eq!(Repository::open(again.path()).unwrap().digest().unwrap(), given);
}

#[test]
fn a_schema_has_its_own_words_and_tables() {
    let changes = [
        ("UPDATE tests SET outcome = 'void' WHERE number = 3", "cannot have ended as `void`"),
        ("PRAGMA user_version = 8", "is not the one that a run makes"),
    ];
    for (sql, words) in changes {
        let folder = of_schema_7(true);
        change(folder.path(), &format!("PRAGMA ignore_check_constraints = 1; {sql}"));
        let said = Repository::open(folder.path()).and_then(|repository| repository.tests()).unwrap_err().to_string();
        assert!(said.contains(words), "{said}");
    }
}

fn refuses_writers(folder: &Path, schema: i64) {
    for added in [Recorder::resume(folder, 1), Recorder::reopen(folder, 1)] {
        let said = added.unwrap_err().to_string();
        assert!(said.contains(&format!("schema {schema}, this release writes {SCHEMA}: they can be read")), "{said}");
    }
}
