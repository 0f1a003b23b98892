//! What imports record in addition to what runs record, as it is read: operations that were left out, and windows and
//! ranges that are others in the plan.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use rusqlite::params;

use sesame_plan::{OperationId, Span};

use crate::columns::perhaps_finite;
use crate::{OriginalExtent, RecordError, Repository, left_out_operations, original_extents};

impl Repository {
    /// How many operations could not be imported, by the number of the test: of all tests in this range of which some
    /// could not. It is empty for a campaign that was run.
    pub fn left_out_operations(&self, tests: RangeInclusive<u32>) -> Result<BTreeMap<u32, u32>, RecordError> {
        if !left_out_operations::are_in(&self.connection).map_err(|e| self.unread(e))? {
            return Ok(BTreeMap::new());
        }
        let sql = "SELECT test, operations FROM left_out_operations WHERE test BETWEEN ?1 AND ?2 ORDER BY test";
        let all = self.read(sql, params![tests.start(), tests.end()], |row| Ok((row.get(0)?, row.get(1)?)))?;
        Ok(all.into_iter().collect())
    }

    /// The operations whose windows or ranges were others in the file they were imported from; empty for a campaign
    /// that was run.
    pub(super) fn original_extents(&self) -> Result<BTreeMap<OperationId, OriginalExtent>, RecordError> {
        if !original_extents::are_in(&self.connection).map_err(|e| self.unread(e))? {
            return Ok(BTreeMap::new());
        }
        let ids = self.operation_ids();
        let rows = self.read(original_extents::QUERY, [], |row| {
            let pair = |at| Ok::<_, rusqlite::Error>(perhaps_finite(row, at)?.zip(perhaps_finite(row, at + 1)?));
            Ok((row.get::<_, String>(0)?, pair(1)?, pair(3)?))
        })?;
        let extents = rows.into_iter().map(|(name, window, range)| {
            let problem = || format!("the window of an operation `{name}` is recorded, which the plan lacks");
            let id = ids.get(name.as_str()).ok_or_else(|| RecordError::damaged(&self.path, problem()))?;
            let window = window.map(|(start, end)| Span { start, end });
            Ok((*id, OriginalExtent { operation: *id, window, range }))
        });
        extents.collect()
    }

    fn unread(&self, source: rusqlite::Error) -> RecordError {
        RecordError::database("read the results", &self.path, source)
    }
}
