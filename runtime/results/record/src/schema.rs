//! The database's schema: made new, and recognised.

use std::fmt::Write as _;
use std::io::Read as _;
use std::path::Path;

use rusqlite::{Connection, OpenFlags};

use sesame_base::verdict::ends;
use sesame_plan::{CampaignPlan, Direction, Task};

use crate::columns::index;
use crate::{RecordError, monitors, series_views};

/// The schema's version, in the file's `user_version`.
pub const SCHEMA: i64 = 8;

/// The earliest schema that is still read. Nothing is written into results of an earlier schema than [`SCHEMA`].
pub(crate) const EARLIEST: i64 = 7;

/// Marks an SQLite file as ours, in its `application_id`: "SESM".
pub(crate) const APPLICATION_ID: i64 = 0x5345_534D;

pub(super) const DDL: &str = include_str!("schema.sql");

/// The tables of what was published in tests.
pub(super) const TRAFFIC: &str = include_str!("traffic.sql");

/// The table of robustness signals. Results that the first releases of schema 7 wrote have none.
pub(super) const ROBUSTNESS: &str = include_str!("robustness.sql");

/// The first schema with the traffic of tests, and with verdicts that follow what a metric could have been also where a
/// run came to its end.
pub(super) const TRAFFIC_SINCE: i64 = 8;
/// Makes all tables and views, and fills in what is fixed for a campaign; all or nothing.
pub(crate) fn install(
    connection: &mut Connection,
    plan: &CampaignPlan,
    task: &Task,
    seed: u64,
) -> rusqlite::Result<()> {
    let text = |value| serde_json::to_string(value).expect("a task is plain data with text keys");
    let transaction = connection.transaction()?;
    transaction.execute_batch(DDL)?;
    transaction.execute_batch(TRAFFIC)?;
    transaction.execute_batch(&series_views::views())?;
    transaction.execute_batch(ROBUSTNESS)?;
    transaction.execute_batch(&series_views::robustness_views())?;
    monitors::install(&transaction, plan)?;
    transaction.execute_batch(&wide_views(plan))?;
    transaction.execute(
        "INSERT INTO campaign (id, space, name, source, generator, runtime, seed, evaluations, end_after_s, plan, task) \
         VALUES (1, ?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10)",
        rusqlite::params![
            plan.space,
            plan.campaign.name,
            plan.source,
            plan.generator,
            env!("CARGO_PKG_VERSION"),
            seed.to_string(),
            task.evaluations(plan),
            plan.campaign.end_after,
            serde_json::to_string(plan).expect("a plan is plain data with text keys"),
            (*task != Task::Campaign).then(|| text(task)),
        ],
    )?;
    for (id, metric) in plan.metrics.iter().enumerate() {
        let objective = plan.campaign.objectives.iter().position(|objective| objective.index() == id);
        transaction.execute(
            "INSERT INTO metrics (id, name, unit, direction, objective, default_value) VALUES (?1, ?2, ?3, ?4, ?5, ?6)",
            rusqlite::params![
                index(id),
                metric.name,
                metric.unit,
                metric.direction.map(|direction| match direction {
                    Direction::Maximise => "maximise",
                    Direction::Minimise => "minimise",
                }),
                objective.map(index),
                metric.default,
            ],
        )?;
    }
    for (id, requirement) in plan.requirements.iter().enumerate() {
        let (low, low_excluded, high, high_excluded) = ends(requirement.bound);
        transaction.execute(
            "INSERT INTO requirements (id, name, text, metric, low, low_excluded, high, high_excluded) \
             VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)",
            rusqlite::params![
                index(id),
                requirement.name,
                requirement.text,
                requirement.metric.0,
                low,
                low_excluded,
                high,
                high_excluded
            ],
        )?;
    }
    transaction.pragma_update(None, "application_id", APPLICATION_ID)?;
    transaction.pragma_update(None, "user_version", SCHEMA)?;
    transaction.commit()
}

/// Whether there is a table of robustness signals.
pub(super) fn has_robustness(connection: &Connection) -> rusqlite::Result<bool> {
    connection
        .query_row("SELECT EXISTS (SELECT 1 FROM sqlite_schema WHERE name = 'robustness_pieces')", [], |row| row.get(0))
}

/// The views with a column per metric, which only a plan can name: `results` has a row per test, `front` those of the
/// final front, or of the latest one while the campaign is unfinished.
pub(super) fn wide_views(plan: &CampaignPlan) -> String {
    let mut columns = String::new();
    for (id, metric) in plan.metrics.iter().enumerate() {
        let name = metric.name.replace('"', "\"\"");
        let value = format!("(SELECT value FROM metric_values WHERE test = t.number AND metric = {id})");
        let _ = write!(columns, ",\n           {value} AS \"{name}\"");
    }
    format!(
        "-- One row per test with a column per metric.\n\
         CREATE VIEW results AS\n    SELECT t.number AS number, t.name AS name, t.origin AS origin, \
         t.known_test AS known_test, t.generation AS generation, t.outcome AS outcome{columns}\n      \
         FROM tests t ORDER BY t.number;\n\
         -- The tests no other test is better than.\n\
         CREATE VIEW front AS\n    SELECT r.* FROM results r JOIN result_set_members m ON m.test = r.number\n     \
         WHERE m.result_set = (SELECT name FROM result_sets ORDER BY status = 'final' DESC, generation DESC LIMIT 1)\n     \
         ORDER BY r.number;\n"
    )
}

/// Opens an existing database, after making sure that it is ours, readable by this release, and whole.
///
/// What a kill in the middle of writing left behind is put right first, for reading too, as SQLite does it: the file is
/// then what it was at the last commit.
pub(crate) fn open(path: &Path, writable: bool) -> Result<Connection, RecordError> {
    let length = match std::fs::metadata(path) {
        Ok(metadata) if metadata.is_file() => metadata.len(),
        Ok(_) => return Err(RecordError::Foreign { found: "not a file".to_owned(), path: path.to_owned() }),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            return Err(RecordError::Missing { path: path.to_owned() });
        }
        Err(error) => return Err(RecordError::io("read the results", path, error)),
    };
    if length == 0 {
        return Err(RecordError::damaged(path, "the file is empty"));
    }
    std::fs::File::open(path).map_err(|e| RecordError::io("read the results", path, e))?;
    let foreign =
        || RecordError::Foreign { found: "an SQLite file of another program".to_owned(), path: path.to_owned() };
    let opened = match begin(path, writable) {
        Err(error) if !writable && needs_rollback(&error) => {
            if !claims_to_be_ours(path) {
                return Err(foreign());
            }
            // SQLite itself makes sure that the journal is not that of a process at work.
            begin(path, true)
                .and_then(|(connection, _)| connection.close().map_err(|(_, error)| error))
                .and_then(|()| begin(path, false))
        }
        opened => opened,
    };
    let (connection, application_id) = opened.map_err(|source| {
        use rusqlite::ErrorCode::{CannotOpen, ReadOnly};
        match source.sqlite_error_code() {
            Some(CannotOpen | ReadOnly) => RecordError::Unsettled { source, path: path.to_owned() },
            _ => RecordError::database(OPENING, path, source),
        }
    })?;
    if application_id != APPLICATION_ID {
        return Err(foreign());
    }
    let version: i64 = connection
        .pragma_query_value(None, "user_version", |row| row.get(0))
        .map_err(|e| RecordError::database(OPENING, path, e))?;
    match version {
        SCHEMA => {}
        found if (EARLIEST..SCHEMA).contains(&found) && writable => {
            return Err(RecordError::ReadOnly { found, known: SCHEMA, path: path.to_owned() });
        }
        found if (EARLIEST..SCHEMA).contains(&found) => {}
        found if found > SCHEMA => return Err(RecordError::Newer { found, known: SCHEMA, path: path.to_owned() }),
        found if found >= 1 => return Err(RecordError::Older { found, known: SCHEMA, path: path.to_owned() }),
        found => return Err(RecordError::damaged(path, format!("there is no schema {found}"))),
    }
    Ok(connection)
}

const OPENING: &str = "open the results";

/// A connection, and the mark of the program whose file it is: reading it is what makes SQLite look at the file at all.
fn begin(path: &Path, writable: bool) -> rusqlite::Result<(Connection, i64)> {
    let flags = OpenFlags::SQLITE_OPEN_NO_MUTEX
        | if writable { OpenFlags::SQLITE_OPEN_READ_WRITE } else { OpenFlags::SQLITE_OPEN_READ_ONLY };
    let connection = Connection::open_with_flags(path, flags)?;
    connection.busy_timeout(std::time::Duration::from_secs(5))?;
    let application_id = connection.pragma_query_value(None, "application_id", |row| row.get(0))?;
    Ok((connection, application_id))
}

/// Whether a transaction broke off in the middle, which only a process that may write can undo.
fn needs_rollback(error: &rusqlite::Error) -> bool {
    use rusqlite::ffi::{SQLITE_READONLY_RECOVERY, SQLITE_READONLY_ROLLBACK};
    error
        .sqlite_error()
        .is_some_and(|error| matches!(error.extended_code, SQLITE_READONLY_ROLLBACK | SQLITE_READONLY_RECOVERY))
}

/// Whether the file has our mark as it lies there, so that nothing is done to the files of others.
fn claims_to_be_ours(path: &Path) -> bool {
    /// Where an SQLite file has its `application_id`, which is big-endian.
    const AT: usize = 68;
    let mut header = [0; AT + 4];
    let read = std::fs::File::open(path).and_then(|mut file| file.read_exact(&mut header));
    read.is_ok() && header[AT..].iter().fold(0, |id, &byte| id << 8 | i64::from(byte)) == APPLICATION_ID
}

/// Makes sure that no part of the file was overwritten or cut off. Reading all of it is worth its time only before
/// something is written behind it.
pub(crate) fn check_whole(connection: &Connection, path: &Path) -> Result<(), RecordError> {
    let found: String = connection
        .query_row("PRAGMA quick_check(1)", [], |row| row.get(0))
        .map_err(|e| RecordError::database("check the results", path, e))?;
    if found == "ok" { Ok(()) } else { Err(RecordError::damaged(path, found.replace('\n', " "))) }
}
