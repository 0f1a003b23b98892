//! One hash of the whole content of a results repository.

use std::fmt::Write as _;

use rusqlite::Connection;
use rusqlite::types::ValueRef;
use sesame_plan::{CampaignPlan, Test};
use sha2::{Digest as _, Sha256};

use crate::monitors::is_in;
use crate::{altered_messages, lab_runs, left_out_operations, listed_messages, original_extents, split_operations};

/// What is hashed, in this order: a name, and a query whose order of rows depends on nothing but the content. The
/// meaning of the plan is `?1`.
const CONTENT: &[(&str, &str)] = &[
    (
        "campaign",
        "SELECT space, name, generator, runtime, seed, evaluations, end_after_s, coalesce(?1 || task, ?1), stop \
         FROM campaign",
    ),
    ("metrics", "SELECT id, name, unit, direction, objective, default_value FROM metrics ORDER BY id"),
    ("requirements", "SELECT id, name, metric, low, low_excluded, high, high_excluded FROM requirements ORDER BY id"),
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
        "SELECT test, position, operation, start_s, end_s, start_condition, end_condition, length_s, times, operation_seed, \
         seen, changed, dropped, delayed, queued, injected, side_effects, unheard, first_touch_s, last_touch_s \
         FROM operations ORDER BY test, position",
    ),
    (
        "choices",
        "SELECT test, operation, position, parameter, unit, value, low, high, x, y, z, text FROM choices \
         ORDER BY test, operation, position",
    ),
    ("intervals", "SELECT test, operation, position, start_s, end_s FROM intervals ORDER BY test, operation, position"),
    (
        "metric_values",
        "SELECT test, metric, value, is_set, reach_low, reach_high, not_finite_s FROM metric_values ORDER BY test, metric",
    ),
    ("tails", "SELECT test, operation, position, start_s, end_s FROM tails ORDER BY test, operation, position"),
    ("unheard", "SELECT test, position, path FROM unheard ORDER BY test, position"),
    (
        "series_pieces",
        "SELECT test, metric, position, points, start_ns, tick_ns, times, numbers FROM series_pieces \
         ORDER BY test, metric, position",
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
        "SELECT generation, evaluations, unique_tests, no_effect, crashes, timeouts, front, hypervolume, estimated, \
         standard_error FROM indicators ORDER BY generation",
    ),
    ("reference_point", "SELECT objective, metric, value FROM reference_point ORDER BY objective"),
    // With another number of workers the campaign's own warnings may arrive in another order, so they are sorted by
    // text.
    ("events", "SELECT test, text FROM events WHERE kind = 'warning' ORDER BY test, text"),
];

/// Bytes that are collected before they are hashed: hashing each number by itself would be slow.
const PORTION: usize = 1 << 16;

/// SHA-256 over the canonical content of results with this plan, as 64 hexadecimal digits.
///
/// Wall times and limits of wall time, hosts, processes, session notes, paths, and the order of writing are left out,
/// and so is what a plan says to people only: only the plan's [meaning](CampaignPlan::meaning) is hashed. The rest is
/// hashed in the order of this module's list: for each table its name as a text, then its rows, then the byte `;`. A
/// row is the byte `(` and the content of its columns: `N` for null, `I` and 8 bytes (little endian) for an integer,
/// `F` and the 8 bytes of the IEEE 754 double (little endian, zero without sign), `T`, the length in bytes as 8 bytes
/// (little endian) and the UTF-8 bytes for a text, `B`, the length likewise and the bytes for a blob. Everything is
/// read from the file each time: no stored hash is used.
///
/// The task of a run that is not the campaign is hashed with the plan, which it follows.
///
/// Operations that were one operation in an imported file are hashed last, if there are any, then operations that could
/// not be imported, and windows and ranges of the file that are others in the plan. So are runs of a lab that were
/// entered by hand: which run of its test each is, but not who made it; and the only messages that operations alter,
/// and those that runs say they altered.
///
/// Names of columns and verdicts are not hashed.
pub(super) fn of_connection(connection: &Connection, plan: &CampaignPlan) -> rusqlite::Result<String> {
    let meaning = serde_json::to_string(&plan.meaning()).expect("a plan is plain data with text keys");
    // One read transaction, so that a run writing meanwhile is seen at one point.
    let transaction = connection.unchecked_transaction()?;
    let mut hash = Sha256::new();
    let mut portion = Vec::with_capacity(2 * PORTION);
    let split = split_operations::are_in(&transaction)?;
    let split = split.then_some((split_operations::TABLE, split_operations::QUERY));
    let left_out = left_out_operations::are_in(&transaction)?;
    let left_out = left_out.then_some((left_out_operations::TABLE, left_out_operations::QUERY));
    let extents = original_extents::are_in(&transaction)?;
    let extents = extents.then_some((original_extents::TABLE, original_extents::QUERY));
    let entered = lab_runs::are_in(&transaction)?;
    let entered = entered.then_some((lab_runs::TABLE, lab_runs::QUERY));
    let listed = is_in(&transaction, listed_messages::TABLE)?;
    let listed = listed.then_some((listed_messages::TABLE, listed_messages::QUERY));
    let altered = is_in(&transaction, altered_messages::TABLES[0])?;
    let altered = altered.then(|| altered_messages::TABLES.into_iter().zip(altered_messages::QUERIES));
    let at_will =
        [split, left_out, extents, entered, listed].into_iter().flatten().chain(altered.into_iter().flatten());
    for (name, sql) in CONTENT.iter().copied().chain(at_will) {
        feed(&mut portion, ValueRef::Text(name.as_bytes()));
        let mut statement = transaction.prepare(sql)?;
        let columns = statement.column_count();
        let parameters = std::iter::repeat_n(&meaning, statement.parameter_count());
        let mut rows = statement.query(rusqlite::params_from_iter(parameters))?;
        while let Some(row) = rows.next()? {
            portion.push(b'(');
            for column in 0..columns {
                feed(&mut portion, row.get_ref(column)?);
            }
            if portion.len() >= PORTION {
                hash.update(&portion);
                portion.clear();
            }
        }
        portion.push(b';');
    }
    hash.update(&portion);
    Ok(digits(hash))
}

/// SHA-256 over which tests results have, as 64 hexadecimal digits: over the names of the space and the campaign, the
/// seed, and each test with its number, as JSON.
pub(super) fn of_tests<'t>(plan: &CampaignPlan, seed: u64, tests: impl IntoIterator<Item = (u32, &'t Test)>) -> String {
    let mut hash = Sha256::new();
    let mut feed = |json: serde_json::Result<Vec<u8>>| hash.update(json.expect("a test is plain data with text keys"));
    feed(serde_json::to_vec(&(&plan.space, &plan.campaign.name, seed)));
    for numbered in tests {
        feed(serde_json::to_vec(&numbered));
    }
    digits(hash)
}

fn digits(hash: Sha256) -> String {
    let mut digits = String::with_capacity(64);
    for byte in hash.finalize() {
        write!(digits, "{byte:02x}").expect("a string takes all that is written");
    }
    digits
}

fn feed(portion: &mut Vec<u8>, value: ValueRef<'_>) {
    let mut sized = |kind: u8, bytes: &[u8]| {
        portion.push(kind);
        portion.extend((bytes.len() as u64).to_le_bytes());
        portion.extend(bytes);
    };
    match value {
        ValueRef::Text(bytes) => sized(b'T', bytes),
        ValueRef::Blob(bytes) => sized(b'B', bytes),
        ValueRef::Null => portion.push(b'N'),
        ValueRef::Integer(n) => {
            portion.push(b'I');
            portion.extend(n.to_le_bytes());
        }
        ValueRef::Real(x) => {
            portion.push(b'F');
            // SQLite stores whole numbers as integers and so forgets the sign of zero; the hash must not depend on it.
            portion.extend((x + 0.0).to_le_bytes());
        }
    }
}
