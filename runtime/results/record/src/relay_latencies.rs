//! The table of what the relay added to the way of messages, run by run and wire by wire.
//!
//! It is wall time, so it is not part of the digest. It is only there if it was measured: in runs without disturbance,
//! of a simulator that nobody steps.

use rusqlite::Connection;

pub(super) const TABLE: &str = "relay_latencies";

pub(super) const DDL: &str = "
-- How long messages were kept by the relay in each run, in wall time; no part of the digest.
CREATE TABLE relay_latencies (
    test            INTEGER NOT NULL REFERENCES tests,
    path            TEXT NOT NULL,    -- the name on the wire
    messages        INTEGER NOT NULL,
    latencies       TEXT NOT NULL,    -- JSON: how many messages by the logarithm of the time, and the longest one in ns
    PRIMARY KEY (test, path)
) STRICT, WITHOUT ROWID;
";

/// Whether results have the table, which was [recognised](super::recognise).
pub(super) fn are_in(connection: &Connection) -> rusqlite::Result<bool> {
    connection.query_row(
        "SELECT EXISTS (SELECT 1 FROM sqlite_schema WHERE type = 'table' AND name = ?1)",
        [TABLE],
        |row| row.get(0),
    )
}
