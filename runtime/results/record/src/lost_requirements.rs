//! The table of when tests lost requirements on the robustness of temporal formulas.
//!
//! It follows from a run as its series do, and explains hazards. So the digest leaves it out. It is only there if
//! such a requirement was lost before a run ended.

use rusqlite::{Transaction, params};

use sesame_base::observation::{Lost, MetricObservation};

use crate::monitors::is_in;

pub(super) const TABLE: &str = "lost_requirements";

pub(super) const DDL: &str = "
-- When a test lost a requirement on the robustness of a temporal formula, where that was before its end.
CREATE TABLE lost_requirements (
    test            INTEGER NOT NULL REFERENCES tests,
    requirement     INTEGER NOT NULL REFERENCES requirements,
    time_s          REAL NOT NULL,    -- the first moment from which nothing could satisfy it
    PRIMARY KEY (test, requirement)
) STRICT, WITHOUT ROWID;
";

/// Writes what the metrics of a test lost.
pub(super) fn write(transaction: &Transaction<'_>, test: u32, metrics: &[MetricObservation]) -> rusqlite::Result<()> {
    for Lost { requirement, at } in metrics.iter().flat_map(|metric| &metric.lost) {
        if !is_in(transaction, TABLE)? {
            transaction.execute_batch(DDL)?;
        }
        transaction
            .prepare_cached("INSERT INTO lost_requirements (test, requirement, time_s) VALUES (?1, ?2, ?3)")?
            .execute(params![test, requirement.0, at])?;
    }
    Ok(())
}
