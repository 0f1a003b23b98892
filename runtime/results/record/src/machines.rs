//! The table of machines on which tests ran, where agents of other machines ran them.
//!
//! Results do not depend on it, so it is not part of the digest. The table is only there if there were agents.

use rusqlite::Connection;

pub(super) const TABLE: &str = "machines";

pub(super) const DDL: &str = "
-- The machine on which an agent ran a test; no part of the digest.
CREATE TABLE machines (
    test            INTEGER PRIMARY KEY REFERENCES tests,
    machine         TEXT NOT NULL
) STRICT;
";

/// Whether results have the table, which was [recognised](super::recognise).
pub(super) fn are_in(connection: &Connection) -> rusqlite::Result<bool> {
    connection.query_row(
        "SELECT EXISTS (SELECT 1 FROM sqlite_schema WHERE type = 'table' AND name = ?1)",
        [TABLE],
        |row| row.get(0),
    )
}
