//! The table of the only messages that operations of tests alter.
//!
//! It is only there if a test has such an operation, as a shrink that goes on to single messages makes them.

use rusqlite::{Transaction, params};

use sesame_plan::{MessageRun, Messages, Test};

use crate::columns::index;
use crate::monitors::is_in;

pub(super) const TABLE: &str = "listed_messages";

pub(super) const DDL: &str = "
-- The only messages that an operation of a test alters, where it does not alter all: runs of messages that follow each
-- other.
CREATE TABLE listed_messages (
    test            INTEGER NOT NULL REFERENCES tests,
    operation       INTEGER NOT NULL, -- position of the operation in the test
    position        INTEGER NOT NULL, -- of the run, from 0
    wire            INTEGER NOT NULL, -- position of the wire among those that the operation acts on, from 0
    first           INTEGER NOT NULL, -- number of the first message among those published on the wire, from 0
    last            INTEGER NOT NULL, -- number of the last
    PRIMARY KEY (test, operation, position)
) STRICT, WITHOUT ROWID;
";

/// What is read and hashed of them.
pub(super) const QUERY: &str =
    "SELECT test, operation, position, wire, first, last FROM listed_messages ORDER BY test, operation, position";

/// Writes which messages the operations of a test alter, if not all.
pub(super) fn write(transaction: &Transaction<'_>, number: u32, test: &Test) -> rusqlite::Result<()> {
    for (operation, used) in test.operations.iter().enumerate() {
        let runs = used.messages.iter().flat_map(Messages::runs);
        for (position, &MessageRun { wire, first, last }) in runs.enumerate() {
            if !is_in(transaction, TABLE)? {
                transaction.execute_batch(DDL)?;
            }
            let [first, last] = [first, last].map(|number| i64::try_from(number).unwrap_or(i64::MAX));
            transaction
                .prepare_cached(
                    "INSERT INTO listed_messages (test, operation, position, wire, first, last) \
                     VALUES (?1, ?2, ?3, ?4, ?5, ?6)",
                )?
                .execute(params![number, index(operation), index(position), wire, first, last])?;
        }
    }
    Ok(())
}
