//! The table of runs in a lab that people entered by hand.
//!
//! It is only there if runs were entered: results of a campaign, and those that a runner made in a lab, have none.

use rusqlite::Connection;

pub(super) const TABLE: &str = "lab_runs";

pub(super) const DDL: &str = "
-- Runs in a lab that were entered by hand; each is a test.
CREATE TABLE lab_runs (
    test            INTEGER PRIMARY KEY REFERENCES tests,
    run             INTEGER NOT NULL, -- which run of the same test in the lab, from 1
    -- Where the run comes from, as far as people said it; no part of the digest.
    operator        TEXT,
    hardware        TEXT,
    software        TEXT,
    date            TEXT
) STRICT;
";

/// What is read and hashed of the runs.
pub(super) const QUERY: &str = "SELECT test, run FROM lab_runs ORDER BY test";

/// Whether results have the table, which was [recognised](super::recognise).
pub(super) fn are_in(connection: &Connection) -> rusqlite::Result<bool> {
    connection.query_row(
        "SELECT EXISTS (SELECT 1 FROM sqlite_schema WHERE type = 'table' AND name = ?1)",
        [TABLE],
        |row| row.get(0),
    )
}
