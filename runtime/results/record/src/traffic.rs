//! What was published on each wire in tests, written and read back.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use rusqlite::{Transaction, params};

use sesame_base::observation::{Observation, Traffic, Unreached};
use sesame_base::silence::{PlannedWire, wires};
use sesame_plan::{CampaignPlan, OperationId, Span};

use crate::columns::{finite, perhaps_finite, unsigned};
use crate::schema::TRAFFIC_SINCE;
use crate::{RecordError, Repository};

/// Writes the traffic of a test that is no duplicate.
pub(super) fn write(
    transaction: &Transaction<'_>,
    plan: &CampaignPlan,
    test: u32,
    observation: &Observation,
) -> rusqlite::Result<()> {
    let wires = wires(plan);
    for traffic in &observation.traffic {
        let Some(&PlannedWire { topic, path, .. }) = wires.get(traffic.wire as usize) else { continue };
        transaction
            .prepare_cached(
                "INSERT INTO traffic (test, wire, topic, path, messages, first_s, last_s, gap_start_s, gap_end_s, \
                 median_gap_s) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10)",
            )?
            .execute(params![
                test,
                traffic.wire,
                plan.topic(topic).name,
                path,
                i64::try_from(traffic.messages).unwrap_or(i64::MAX),
                traffic.first,
                traffic.last,
                traffic.gap.start,
                traffic.gap.end,
                traffic.median_gap
            ])?;
    }
    for unreached in &observation.unreached {
        let name = &plan.operation(unreached.operation).name;
        transaction
            .prepare_cached("INSERT INTO unreached (test, operation, name, nearest_s) VALUES (?1, ?2, ?3, ?4)")?
            .execute(params![test, unreached.operation.0, name, unreached.nearest])?;
    }
    Ok(())
}

impl Repository {
    /// The traffic of the tests whose numbers lie in this range; duplicates are missing, and so are all tests of
    /// results that were recorded without it.
    pub(super) fn traffic(&self, numbers: &RangeInclusive<u32>) -> Result<BTreeMap<u32, Vec<Traffic>>, RecordError> {
        if self.schema < TRAFFIC_SINCE {
            return Ok(BTreeMap::new());
        }
        self.by_test(
            "SELECT test, wire, messages, first_s, last_s, gap_start_s, gap_end_s, median_gap_s FROM traffic \
             WHERE test BETWEEN ?1 AND ?2 ORDER BY test, wire",
            numbers,
            |row| {
                Ok(Traffic {
                    wire: row.get(1)?,
                    messages: unsigned(row, 2)?,
                    first: finite(row, 3)?,
                    last: finite(row, 4)?,
                    gap: Span { start: finite(row, 5)?, end: finite(row, 6)? },
                    median_gap: finite(row, 7)?,
                })
            },
        )
    }

    /// The operations that met no message in the reference runs whose numbers lie in this range.
    pub(super) fn unreached(
        &self,
        numbers: &RangeInclusive<u32>,
    ) -> Result<BTreeMap<u32, Vec<Unreached>>, RecordError> {
        if self.schema < TRAFFIC_SINCE {
            return Ok(BTreeMap::new());
        }
        let operations = self.plan().operations.len();
        let found = self.by_test(
            "SELECT test, operation, nearest_s FROM unreached WHERE test BETWEEN ?1 AND ?2 ORDER BY test, operation",
            numbers,
            |row| Ok(Unreached { operation: OperationId(row.get(1)?), nearest: perhaps_finite(row, 2)? }),
        )?;
        let known = |unreached: &Unreached| unreached.operation.index() < operations;
        match found.iter().find(|(_, unreached)| !unreached.iter().all(known)) {
            Some((test, _)) => Err(self.odd(*test, "an operation without messages that the plan does not have")),
            None => Ok(found),
        }
    }
}
