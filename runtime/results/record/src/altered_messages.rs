//! The tables of which messages operations altered, in runs that were asked for them.
//!
//! They are only there if a run was asked, as a shrink asks before it goes on to single messages. Which tests it tries
//! next follows from them, so they are part of the digest.

use rusqlite::{Transaction, params};

use sesame_base::observation::{AlteredMessage, AlteredMessages};

use crate::columns::index;
use crate::monitors::is_in;

pub(super) const TABLES: [&str; 2] = ["listings", "altered_messages"];

pub(super) const DDL: &str = "
-- The tests whose runs list which messages their operations altered.
CREATE TABLE listings (
    test            INTEGER PRIMARY KEY REFERENCES tests,
    too_many        INTEGER NOT NULL  -- whether they are too many to be listed
) STRICT;

-- The messages that operations of these tests altered, each once for each operation.
CREATE TABLE altered_messages (
    test            INTEGER NOT NULL REFERENCES tests,
    position        INTEGER NOT NULL, -- in the list, from 0
    operation       INTEGER NOT NULL, -- position of the operation in the test
    wire            INTEGER NOT NULL, -- position of the wire among those that the operation acts on, from 0
    number          INTEGER NOT NULL, -- number of the message among those published on the wire, from 0
    time_s          REAL NOT NULL,    -- when the operation first altered it
    PRIMARY KEY (test, position)
) STRICT, WITHOUT ROWID;
";

/// What is read and hashed of them.
pub(super) const QUERIES: [&str; 2] = [
    "SELECT test, too_many FROM listings ORDER BY test",
    "SELECT test, position, operation, wire, number, time_s FROM altered_messages ORDER BY test, position",
];

/// Writes which messages operations altered in the run of a test.
pub(super) fn write(transaction: &Transaction<'_>, test: u32, altered: &AlteredMessages) -> rusqlite::Result<()> {
    if !is_in(transaction, TABLES[0])? {
        transaction.execute_batch(DDL)?;
    }
    let listed: &[AlteredMessage] = match altered {
        AlteredMessages::Listed(messages) => messages,
        AlteredMessages::TooMany => &[],
    };
    transaction
        .prepare_cached("INSERT INTO listings (test, too_many) VALUES (?1, ?2)")?
        .execute(params![test, *altered == AlteredMessages::TooMany])?;
    for (position, &AlteredMessage { operation, wire, number, time }) in listed.iter().enumerate() {
        let number = i64::try_from(number).unwrap_or(i64::MAX);
        transaction
            .prepare_cached(
                "INSERT INTO altered_messages (test, position, operation, wire, number, time_s) \
                 VALUES (?1, ?2, ?3, ?4, ?5, ?6)",
            )?
            .execute(params![test, index(position), operation, wire, number, time])?;
    }
    Ok(())
}
