//! One hash for the whole content of a results repository.

use std::fmt::Write as _;
use std::path::Path;

use rusqlite::Connection;
use rusqlite::types::ValueRef;
use sha2::{Digest as _, Sha256};

use crate::record::{RecordError, Repository};

/// What is hashed, in this order: a name, and the rows in an order that depends on nothing but the content.
const CONTENT: &[(&str, &str)] = &[
    (
        "campaign",
        "SELECT space, name, source, generator, runtime, seed, evaluations, end_after_s, plan, stop FROM campaign",
    ),
    ("metrics", "SELECT id, name, unit, direction, objective, default_value FROM metrics ORDER BY id"),
    (
        "requirements",
        "SELECT id, name, text, metric, low, low_excluded, high, high_excluded FROM requirements ORDER BY id",
    ),
    (
        "tests",
        // Without the limit that a timeout ran into: it is wall time.
        "SELECT number, name, origin, known_test, generation, simulator_seed, outcome, outcome_detail, end_s, messages, \
         duplicate_of FROM tests ORDER BY number",
    ),
    ("original_names", "SELECT test, name FROM original_names ORDER BY test"),
    ("parents", "SELECT test, position, parent FROM parents ORDER BY test, position"),
    (
        "operations",
        "SELECT test, position, operation, start_s, end_s, start_condition, end_condition, length_s, times, draw_seed, \
         seen, changed, dropped, delayed, queued, injected, side_effects, unheard, first_touch_s, last_touch_s \
         FROM operations ORDER BY test, position",
    ),
    (
        "choices",
        "SELECT test, operation, position, parameter, unit, value, low, high, x, y, z, text FROM choices \
         ORDER BY test, operation, position",
    ),
    ("intervals", "SELECT test, operation, position, start_s, end_s FROM intervals ORDER BY test, operation, position"),
    ("tails", "SELECT test, operation, position, start_s, end_s FROM tails ORDER BY test, operation, position"),
    ("unheard", "SELECT test, position, path FROM unheard ORDER BY test, position"),
    (
        "metric_values",
        "SELECT test, metric, value, is_set, reach_low, reach_high, not_finite_s FROM metric_values ORDER BY test, metric",
    ),
    (
        "change_points",
        "SELECT test, metric, position, time_s, value FROM change_points ORDER BY test, metric, position",
    ),
    (
        "repetitions",
        "SELECT test, position, simulator_seed, outcome, outcome_detail, end_s, messages FROM repetitions \
         ORDER BY test, position",
    ),
    (
        "repetition_values",
        "SELECT test, position, metric, value, is_set, reach_low, reach_high, not_finite_s FROM repetition_values \
         ORDER BY test, position, metric",
    ),
    ("result_sets", "SELECT name, generation, status FROM result_sets ORDER BY name"),
    ("result_set_members", "SELECT result_set, position, test FROM result_set_members ORDER BY result_set, position"),
    ("coverage", "SELECT generation, evaluations, covered, cells, feasible FROM coverage ORDER BY generation"),
    (
        "indicators",
        "SELECT generation, evaluations, unique_tests, void, crashes, timeouts, front, hypervolume FROM indicators \
         ORDER BY generation",
    ),
    ("reference_point", "SELECT objective, metric, value FROM reference_point ORDER BY objective"),
    // Warnings of the campaign itself may come in another order with other workers, so their order is their text's.
    ("events", "SELECT test, text FROM events WHERE kind = 'warning' ORDER BY test, text"),
];

/// SHA-256 over the canonical content of a results repository, as 64 hexadecimal digits.
///
/// Left out are wall times and limits of wall time, hosts, processes, session notes, paths, and the order in which things were written. The
/// rest is hashed in the order of this module's list: for each table its name as a text, then its rows, then the byte
/// `;`. A row is the byte `(` and its columns: `N` for null, `I` and 8 bytes (little endian) for an integer, `F` and
/// the 8 bytes of the IEEE 754 double (little endian, zero without sign), `T`, the length in bytes as 8 bytes (little
/// endian) and the UTF-8 bytes for a text.
pub fn digest(path: &Path) -> Result<String, RecordError> {
    Repository::open(path)?.digest()
}

pub(super) fn of_connection(connection: &Connection) -> rusqlite::Result<String> {
    // One read transaction, so that a run writing meanwhile is seen at one point.
    let transaction = connection.unchecked_transaction()?;
    let mut hash = Sha256::new();
    for (name, sql) in CONTENT {
        feed(&mut hash, ValueRef::Text(name.as_bytes()));
        let mut statement = transaction.prepare(sql)?;
        let columns = statement.column_count();
        let mut rows = statement.query([])?;
        while let Some(row) = rows.next()? {
            hash.update(b"(");
            for column in 0..columns {
                feed(&mut hash, row.get_ref(column)?);
            }
        }
        hash.update(b";");
    }
    let mut digits = String::with_capacity(64);
    for byte in hash.finalize() {
        write!(digits, "{byte:02x}").expect("a string takes all that is written");
    }
    Ok(digits)
}

fn feed(hash: &mut Sha256, value: ValueRef<'_>) {
    match value {
        ValueRef::Null => hash.update(b"N"),
        ValueRef::Integer(n) => {
            hash.update(b"I");
            hash.update(n.to_le_bytes());
        }
        ValueRef::Real(x) => {
            hash.update(b"F");
            // SQLite stores whole numbers as integers and so forgets the sign of zero; the hash must not depend on it.
            hash.update((x + 0.0).to_le_bytes());
        }
        ValueRef::Text(bytes) | ValueRef::Blob(bytes) => {
            hash.update(b"T");
            hash.update((bytes.len() as u64).to_le_bytes());
            hash.update(bytes);
        }
    }
}
