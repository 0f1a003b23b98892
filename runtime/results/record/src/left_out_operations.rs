//! Operations of tests that could not be imported.
//!
//! Such a test did more than its operations say. It has no point, since a part of it is missing, and wherever a
//! test is shown, this is mentioned. The table is only there if there are such tests: results of a run have none.

use rusqlite::{Connection, params};

pub(super) const TABLE: &str = "left_out_operations";

pub(super) const DDL: &str = "
-- Tests that held more operations in the file they were imported from than they have here.
CREATE TABLE left_out_operations (
    test            INTEGER PRIMARY KEY REFERENCES tests,
    operations      INTEGER NOT NULL -- how many could not be imported
) STRICT;
";

/// What is read and hashed of them.
pub(super) const QUERY: &str = "SELECT test, operations FROM left_out_operations ORDER BY test";

/// How the warning of a test begins of which operations could not be imported.
pub const NOT_IMPORTED: &str = "not imported: ";

/// How many operations of a test could not be imported.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LeftOutOperations {
    /// The number of the test.
    pub test: u32,
    /// How many; at least 1.
    pub operations: u32,
}

impl LeftOutOperations {
    /// The warning of the test, with these reasons.
    pub fn warning(self, reasons: &[String]) -> String {
        let operations = match self.operations {
            1 => "1 operation of this test, which".to_owned(),
            count => format!("{count} operations of this test, which"),
        };
        format!("{NOT_IMPORTED}{operations} disturbed more than is shown here ({})", reasons.join("; "))
    }
}

/// How many operations of a test could not be imported, as in `2 not imported`; nothing if all were.
pub fn not_imported(left_out: u32) -> Option<String> {
    (left_out > 0).then(|| format!("{left_out} not imported"))
}

pub(super) fn are_in(connection: &Connection) -> rusqlite::Result<bool> {
    connection.query_row(
        "SELECT EXISTS (SELECT 1 FROM sqlite_schema WHERE type = 'table' AND name = ?1)",
        [TABLE],
        |row| row.get(0),
    )
}

pub(super) fn write(connection: &mut Connection, left_out: &[LeftOutOperations]) -> rusqlite::Result<()> {
    if left_out.is_empty() {
        return Ok(());
    }
    let transaction = connection.transaction()?;
    if !are_in(&transaction)? {
        transaction.execute_batch(DDL)?;
    }
    for LeftOutOperations { test, operations } in left_out {
        transaction
            .prepare_cached("INSERT OR REPLACE INTO left_out_operations (test, operations) VALUES (?1, ?2)")?
            .execute(params![test, operations])?;
    }
    transaction.commit()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{DATABASE, Origin, Recorder, Repository, sample};

    fn imported(folder: &std::path::Path, left_out: &[LeftOutOperations]) -> Repository {
        let plan = sample::plan();
        let mut recorder = Recorder::create(folder, &plan, 1, 0).unwrap();
        let empty = || sesame_plan::Test::default();
        recorder.commit_all([1, 2].map(|number| sample::record(&plan, number, Origin::Search, empty()))).unwrap();
        recorder.put_left_out_operations(left_out).unwrap();
        recorder.finish("imported").unwrap()
    }

    #[test]
    fn tests_are_read_with_how_many_of_their_operations_were_left_out() {
        let (whole, partly) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let (whole, partly) =
            (imported(whole.path(), &[]), imported(partly.path(), &[LeftOutOperations { test: 2, operations: 3 }]));
        let counts = |repository: &Repository| {
            let mut scanned = Vec::new();
            repository.scan(&mut |test| scanned.push(test.left_out)).unwrap();
            let rows: Vec<u32> = repository.tests().unwrap().iter().map(|row| row.left_out).collect();
            assert_eq!(scanned, rows);
            rows
        };
        assert_eq!((counts(&whole), counts(&partly)), (vec![0, 0], vec![0, 3]));
        assert_ne!(whole.digest().unwrap(), partly.digest().unwrap());
        assert!(!are_in(&whole.connection).unwrap(), "results without such tests are as they were");
    }

    #[test]
    fn a_view_in_the_place_of_the_table_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        drop(imported(folder.path(), &[]));
        let connection = Connection::open(folder.path().join(DATABASE)).unwrap();
        connection.execute_batch("CREATE VIEW left_out_operations AS SELECT 1 AS test").unwrap();
        drop(connection);
        let said = Repository::open(folder.path()).unwrap_err().to_string();
        assert!(said.contains("`left_out_operations` is not a table, but a view"), "{said}");
    }
}
