//! Operations of a test that were one operation in the file they were imported from.
//!
//! An operation of the original platform may draw several values of a message, each from a range of its own; here it is
//! an operation for each. Points and counts see one operation, as that platform did. The table is only there if there
//! are such operations: results of a run have none.

use rusqlite::{Connection, params};

use crate::columns::index;

pub(super) const TABLE: &str = "split_operations";

pub(super) const DDL: &str = "
-- Operations of a test that were one operation in the file they were imported from: all but the first of them.
CREATE TABLE split_operations (
    test            INTEGER NOT NULL REFERENCES tests,
    position        INTEGER NOT NULL, -- of the operation in the test
    first           INTEGER NOT NULL, -- position of the first of those that were one
    PRIMARY KEY (test, position)
) STRICT, WITHOUT ROWID;
";

/// What is read and hashed of them.
pub(super) const QUERY: &str = "SELECT test, position, first FROM split_operations ORDER BY test, position";

/// An operation of a test that was one operation with an earlier one of the same test in the file it was imported from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SplitOperation {
    /// The number of the test.
    pub test: u32,
    /// The position of the operation in the test.
    pub position: usize,
    /// The position of the first of those that were one; less than `position`.
    pub first: usize,
}

/// Whether results have the table, which was [recognised](super::recognise).
pub(super) fn are_in(connection: &Connection) -> rusqlite::Result<bool> {
    connection.query_row(
        "SELECT EXISTS (SELECT 1 FROM sqlite_schema WHERE type = 'table' AND name = ?1)",
        [TABLE],
        |row| row.get(0),
    )
}

pub(super) fn write(connection: &mut Connection, split: &[SplitOperation]) -> rusqlite::Result<()> {
    if split.is_empty() {
        return Ok(());
    }
    let transaction = connection.transaction()?;
    if !are_in(&transaction)? {
        transaction.execute_batch(DDL)?;
    }
    for &SplitOperation { test, position, first } in split {
        transaction
            .prepare_cached("INSERT OR REPLACE INTO split_operations (test, position, first) VALUES (?1, ?2, ?3)")?
            .execute(params![test, index(position), index(first)])?;
    }
    transaction.commit()
}

#[cfg(test)]
mod tests {
    use sesame_base::observation::Outcome;
    use sesame_plan::Dimension;
    use sesame_search::sspr::Convention;

    use super::*;
    use crate::{DATABASE, Origin, Recorder, Repository, ScannedTest, sample};

    /// Results of an import, of one test with the same operation twice; which were one in the file is given.
    fn imported(folder: &std::path::Path, split: &[SplitOperation]) -> Repository {
        let plan = sample::plan();
        let mut test = plan.tests[0].test.clone();
        test.operations.truncate(1);
        test.operations.push(test.operations[0].clone());
        let mut record = sample::record(&plan, 1, Origin::Search, test);
        record.observation.outcome = Outcome::Unknown;
        let mut recorder = Recorder::create(folder, &plan, 1, 0).unwrap();
        recorder.commit_all([record]).unwrap();
        recorder.put_split_operations(split).unwrap();
        recorder.finish("imported").unwrap()
    }

    fn scanned(repository: &Repository) -> Result<Vec<ScannedTest>, String> {
        let mut tests = Vec::new();
        repository.scan(&mut |test| tests.push(test)).map_err(|error| error.to_string())?;
        Ok(tests)
    }

    const SECOND: SplitOperation = SplitOperation { test: 1, position: 1, first: 0 };

    #[test]
    fn operations_that_were_one_count_as_one() {
        let (apart, together) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let (apart, together) = (imported(apart.path(), &[]), imported(together.path(), &[SECOND]));
        let count = |repository: &Repository| {
            let tests = scanned(repository).unwrap();
            let point = tests[0].point(repository.plan(), Convention::Ours).unwrap();
            (tests[0].operations[1].part_of, point.get(Dimension::O0))
        };
        assert_eq!(count(&apart), (None, Some(2.0)));
        assert_eq!(count(&together), (Some(0), Some(1.0)));
        assert_ne!(apart.digest().unwrap(), together.digest().unwrap());
        assert!(!are_in(&apart.connection).unwrap(), "results without such operations are as they were");
    }

    #[test]
    fn what_was_one_with_no_earlier_operation_is_damaged() {
        for (position, first) in [(1, 1), (0, 1), (2, 0)] {
            let folder = tempfile::tempdir().unwrap();
            let repository = imported(folder.path(), &[SplitOperation { test: 1, position, first }]);
            let said = scanned(&repository).unwrap_err();
            assert!(
                said.contains(&format!("T1 has no operation {position} that was one with operation {first}")),
                "{said}"
            );
        }
        let folder = tempfile::tempdir().unwrap();
        let said = scanned(&imported(folder.path(), &[SplitOperation { test: 9, ..SECOND }])).unwrap_err();
        assert!(said.contains("T9"), "{said}");
    }

    #[test]
    fn a_view_in_the_place_of_the_table_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        drop(imported(folder.path(), &[]));
        let connection = Connection::open(folder.path().join(DATABASE)).unwrap();
        connection.execute_batch("CREATE VIEW split_operations AS SELECT 1 AS test").unwrap();
        drop(connection);
        let said = Repository::open(folder.path()).unwrap_err().to_string();
        assert!(said.contains("`split_operations` is not a table, but a view"), "{said}");
    }
}
