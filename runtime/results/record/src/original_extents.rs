//! Windows and ranges as they are in the file that results were imported from, where the plan has others.
//!
//! A space cannot have a window that is empty, begins before the test or after its end, nor a range beyond what its
//! operation permits; the import drops or cuts those. The original platform measured tests in the windows and ranges of
//! its file all the same, and points by its formulas are measured in them here. The table is only there if there are
//! such windows or ranges: results of a run have none.

use rusqlite::{Connection, params};

use sesame_plan::{OperationId, Span};

pub(super) const TABLE: &str = "original_extents";

pub(super) const DDL: &str = "
-- Windows and ranges of operations in the file they were imported from, where they are others in the plan.
CREATE TABLE original_extents (
    operation       TEXT PRIMARY KEY, -- its name
    start_s         REAL,             -- the window; NULL where the plan has it
    end_s           REAL,
    low             REAL,             -- the range of its first parameter, in the plan's unit; NULL where the plan has it
    high            REAL
) STRICT, WITHOUT ROWID;
";

/// What is read and hashed of them.
pub(super) const QUERY: &str = "SELECT operation, start_s, end_s, low, high FROM original_extents ORDER BY operation";

/// The window and the range of an operation in the file it was imported from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OriginalExtent {
    /// Which.
    pub operation: OperationId,
    /// Its window, which may have no length; `None` where it is that of the plan.
    pub window: Option<Span>,
    /// The range of its first parameter, lower end first; `None` where it is that of the plan.
    pub range: Option<(f64, f64)>,
}

pub(super) fn are_in(connection: &Connection) -> rusqlite::Result<bool> {
    connection.query_row(
        "SELECT EXISTS (SELECT 1 FROM sqlite_schema WHERE type = 'table' AND name = ?1)",
        [TABLE],
        |row| row.get(0),
    )
}

pub(super) fn write(connection: &mut Connection, extents: &[(&str, OriginalExtent)]) -> rusqlite::Result<()> {
    if extents.is_empty() {
        return Ok(());
    }
    let transaction = connection.transaction()?;
    if !are_in(&transaction)? {
        transaction.execute_batch(DDL)?;
    }
    for (name, OriginalExtent { window, range, .. }) in extents {
        transaction
            .prepare_cached(
                "INSERT OR REPLACE INTO original_extents (operation, start_s, end_s, low, high) \
                 VALUES (?1, ?2, ?3, ?4, ?5)",
            )?
            .execute(params![
                name,
                window.map(|window| window.start),
                window.map(|window| window.end),
                range.map(|(low, _)| low),
                range.map(|(_, high)| high)
            ])?;
    }
    transaction.commit()
}

#[cfg(test)]
mod tests {
    use sesame_base::observation::Outcome;
    use sesame_plan::{Activation, Choice, Dimension};
    use sesame_search::sspr::Convention;

    use super::*;
    use crate::{Origin, Recorder, sample};

    /// The coordinates T1 and P1 of an imported test of one operation, by the original's formulas and by ours.
    fn points(planned: Span, extent: Option<OriginalExtent>) -> [Option<(f64, Option<f64>)>; 2] {
        let plan = sample::plan();
        let mut test = plan.tests[0].test.clone();
        test.operations.truncate(1);
        test.operations[0].activation = Activation::Time { start: planned.start, end: planned.end };
        let parameter = &plan.operation(test.operations[0].operation).parameters[0];
        let sesame_plan::Domain::Number { low, high, .. } = parameter.domain else { panic!("{parameter:?}") };
        test.operations[0].parameters = vec![Choice::Range { low, high: f64::midpoint(low, high) }];
        let folder = tempfile::tempdir().unwrap();
        let mut recorder = Recorder::create(folder.path(), &plan, 1, 0).unwrap();
        let mut record = sample::record(&plan, 1, Origin::Search, test);
        record.observation.outcome = Outcome::Unknown;
        record.observation.operations.truncate(1);
        record.observation.operations[0].intervals.clear();
        if planned.start < plan.campaign.end_after {
            record.observation.operations[0].intervals.push(planned);
        }
        recorder.commit_all([record]).unwrap();
        recorder.put_original_extents(&extent.into_iter().collect::<Vec<_>>()).unwrap();
        let repository = recorder.finish("imported").unwrap();
        let mut tests = Vec::new();
        repository.scan(&mut |test| tests.push(test)).unwrap();
        [Convention::Original, Convention::Ours].map(|convention| {
            let point = tests[0].point(repository.plan(), convention)?;
            Some((point.get(Dimension::T1).unwrap(), point.get(Dimension::P1)))
        })
    }

    fn first_operation() -> OperationId {
        sample::plan().tests[0].test.operations[0].operation
    }

    #[test]
    fn points_of_the_original_are_measured_in_the_windows_of_its_file() {
        let late = Span { start: 100_000.25, end: 100_000.75 };
        let window = Some(Span { start: 100_000.0, end: 100_001.0 });
        let extent = OriginalExtent { operation: first_operation(), window, range: None };
        assert_eq!(points(late, None), [None, None], "it lies far beyond the window of the plan");
        let [original, ours] = points(late, Some(extent));
        assert_eq!((original.map(|(t1, _)| t1), ours), (Some(0.5), None));
    }

    #[test]
    fn a_window_without_length_has_no_point() {
        let now = Span { start: 10.0, end: 20.0 };
        let [original, ours] = points(now, None);
        assert!(original.is_some() && ours.is_some());
        let window = Some(Span { start: 10.0, end: 10.0 });
        let extent = OriginalExtent { operation: first_operation(), window, range: None };
        assert_eq!(points(now, Some(extent))[0], None);
    }

    #[test]
    fn points_of_the_original_are_measured_in_the_ranges_of_its_file() {
        let now = Span { start: 10.0, end: 20.0 };
        let plan = sample::plan();
        let parameter = &plan.operation(first_operation()).parameters[0];
        let sesame_plan::Domain::Number { low, high, .. } = parameter.domain else { panic!("{parameter:?}") };
        let range = Some((low, low + 2.0 * (high - low)));
        let extent = OriginalExtent { operation: first_operation(), window: None, range };
        let p1 = |point: Option<(f64, Option<f64>)>| point.and_then(|(_, p1)| p1);
        let [original, ours] = points(now, Some(extent));
        assert_eq!((p1(original), p1(ours)), (Some(0.25), Some(0.5)));
    }
}
