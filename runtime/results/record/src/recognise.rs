//! Whether a database has the tables and views that this program makes.
//!
//! The file may come from anywhere, and SQLite executes what its schema says: a view with the name of a table can run
//! for ever, and a trigger can change what is written. So each table and view is compared with the statement that
//! creates it here, before it is queried. Anything else that users have added, such as an index or a view of their own,
//! is left alone.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::OnceLock;

use rusqlite::Connection;

use sesame_plan::CampaignPlan;

use crate::schema::{DDL, ROBUSTNESS, TRAFFIC, TRAFFIC_SINCE, has_robustness, wide_views};
use crate::{
    RecordError, altered_messages, course, lab_runs, left_out_operations, listed_messages, lost_requirements, machines,
    monitors, original_extents, relay_latencies, series_views, split_operations,
};

/// The objects of a schema by name: the kind of each, and the words of the statement that creates it.
type Objects = BTreeMap<String, (String, String)>;

/// When a test satisfies a requirement: in schema 8, and in schema 7.
const SATISFIED: [&str; 2] = [
    "WHEN (r.low IS NULL OR v.reach_low > r.low OR (v.reach_low = r.low AND NOT r.low_excluded))
                    AND (r.high IS NULL OR v.reach_high < r.high OR (v.reach_high = r.high AND NOT r.high_excluded))
                    THEN 'satisfied'
               ELSE 'inconclusive'",
    "WHEN v.value < r.low OR v.value > r.high OR (r.low_excluded AND v.value = r.low)
                    OR (r.high_excluded AND v.value = r.high) THEN 'inconclusive'
               ELSE 'satisfied'",
];

/// The outcomes that the tables of the first releases of schema 7 do not permit.
const OF_ENVIRONMENT: &str = ", 'launch_failed', 'disconnect', 'wrong_clock'";

/// The tables and views of schema 7.
fn ddl_7() -> String {
    let [now, before] = SATISFIED;
    DDL.replace(now, before)
}

/// Checks all tables and views that do not depend on the campaign, and that there are no triggers. Results may be of
/// any schema that this release reads.
pub(super) fn tables(connection: &Connection, path: &Path, schema: i64) -> Result<(), RecordError> {
    static CURRENT: OnceLock<Objects> = OnceLock::new();
    static SCHEMA_7: OnceLock<Objects> = OnceLock::new();
    static BEFORE_ROBUSTNESS: OnceLock<Objects> = OnceLock::new();
    let sound = |made: rusqlite::Result<Objects>| {
        made.unwrap_or_else(|error| unreachable!("the schema of this program is sound: {error}"))
    };
    let has_robustness =
        has_robustness(connection).map_err(|error| RecordError::database("read the results", path, error))?;
    let (series, robustness) = (series_views::views(), series_views::robustness_views());
    let ours = if schema >= TRAFFIC_SINCE {
        let statements = [DDL, TRAFFIC, &series, ROBUSTNESS, &robustness];
        CURRENT.get_or_init(|| sound(made_by(&statements)))
    } else if has_robustness {
        SCHEMA_7.get_or_init(|| sound(made_by(&[&ddl_7(), &series, ROBUSTNESS, &robustness])))
    } else {
        BEFORE_ROBUSTNESS.get_or_init(|| sound(made_by(&[&ddl_7(), &series])))
    };
    let found = objects(connection).map_err(|error| RecordError::database("read the results", path, error))?;
    if let Some((name, _)) = found.iter().find(|(_, (kind, _))| kind == "trigger") {
        return Err(RecordError::damaged(path, format!("there is a trigger `{name}`, which no run makes")));
    }
    same(ours, &found, path)?;
    // Tables that are only there if something is in them.
    let at_will = [
        (split_operations::TABLE, split_operations::DDL),
        (left_out_operations::TABLE, left_out_operations::DDL),
        (original_extents::TABLE, original_extents::DDL),
        (lab_runs::TABLE, lab_runs::DDL),
        (relay_latencies::TABLE, relay_latencies::DDL),
        (listed_messages::TABLE, listed_messages::DDL),
        (lost_requirements::TABLE, lost_requirements::DDL),
        (machines::TABLE, machines::DDL),
        (course::STATES, course::STATES_DDL),
    ];
    let of_monitors = monitors::OBJECTS.map(|name| (name, monitors::DDL));
    let hazards = if schema >= TRAFFIC_SINCE { monitors::HAZARDS } else { monitors::HAZARDS_7 };
    let of_hazards = monitors::HAZARD_OBJECTS.map(|name| (name, hazards));
    let of_course = course::TABLES.map(|name| (name, course::DDL));
    let of_listings = altered_messages::TABLES.map(|name| (name, altered_messages::DDL));
    for (name, ddl) in at_will.into_iter().chain(of_monitors).chain(of_hazards).chain(of_course).chain(of_listings) {
        if found.contains_key(name) {
            let mut ours = sound(made_by(&["CREATE TABLE tests (number INTEGER PRIMARY KEY)", ddl]));
            ours.retain(|ours, _| ours == name);
            same(&ours, &found, path)?;
        }
    }
    Ok(())
}

/// Checks the views that have a column for each metric of the campaign.
pub(super) fn views(connection: &Connection, path: &Path, plan: &CampaignPlan) -> Result<(), RecordError> {
    let failed = |error| RecordError::database("read the results", path, error);
    // SQLite cannot create the views of a plan without the tables that they read.
    let mut ours = made_by(&[DDL, &wide_views(plan)]).map_err(failed)?;
    ours.retain(|name, _| ["results", "front"].contains(&name.as_str()));
    same(&ours, &objects(connection).map_err(failed)?, path)
}

fn same(ours: &Objects, found: &Objects, path: &Path) -> Result<(), RecordError> {
    for (name, (kind, words)) in ours {
        let problem = match found.get(name) {
            None => format!("the {kind} `{name}` is missing"),
            Some((other, _)) if other != kind => format!("`{name}` is not a {kind}, but a {other}"),
            Some((_, other)) if other != words => format!("the {kind} `{name}` is not the one that a run makes"),
            Some(_) => continue,
        };
        return Err(RecordError::damaged(path, problem));
    }
    Ok(())
}

/// The objects that these statements create.
fn made_by(statements: &[&str]) -> rusqlite::Result<Objects> {
    let connection = Connection::open_in_memory()?;
    statements.iter().try_for_each(|sql| connection.execute_batch(sql))?;
    objects(&connection)
}

/// All objects except those that SQLite creates itself. The table that is read here is always SQLite's own.
fn objects(connection: &Connection) -> rusqlite::Result<Objects> {
    let mut statement = connection.prepare("SELECT name, type, sql FROM sqlite_schema WHERE sql IS NOT NULL")?;
    let rows = statement.query_map([], |row| {
        let (kind, sql): (String, String) = (row.get(1)?, row.get(2)?);
        // No results of the first releases of a schema hold these words, so their tables are as good.
        let words = words(&sql);
        let words = if kind == "table" { words.replace(OF_ENVIRONMENT, "") } else { words };
        Ok((row.get(0)?, (kind, words)))
    })?;
    rows.collect()
}

/// The words of a statement, without comments, which a later release of the same schema may improve.
fn words(sql: &str) -> String {
    let lines = sql.lines().map(|line| line.split_once("--").map_or(line, |(code, _)| code));
    lines.flat_map(str::split_whitespace).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{DATABASE, Repository, sample};

    /// What opening results says after this was done to them; `None` where they are read.
    fn said_after(sql: &str) -> Option<String> {
        let folder = tempfile::tempdir().unwrap();
        drop(sample::campaign(folder.path(), &sample::plan(), 12));
        let connection = Connection::open(folder.path().join(DATABASE)).unwrap();
        connection.execute_batch(&format!("PRAGMA foreign_keys = OFF; {sql}")).unwrap();
        Repository::open(folder.path()).err().map(|error| error.to_string())
    }

    #[test]
    fn a_view_that_never_ends_in_the_place_of_a_table_is_refused_at_once() {
        let endless = "WITH RECURSIVE n(number) AS (SELECT 1 UNION ALL SELECT number + 1 FROM n) SELECT * FROM n";
        for name in ["tests", "campaign", "sessions"] {
            let said = said_after(&format!("DROP TABLE {name}; CREATE VIEW {name} AS {endless}")).unwrap();
            assert!(said.contains(&format!("`{name}` is not a table, but a view")), "{said}");
        }
        let said = said_after(&format!("DROP VIEW results; CREATE VIEW results AS {endless}")).unwrap();
        assert!(said.contains("the view `results` is not the one that a run makes"), "{said}");
    }

    #[test]
    fn tables_of_another_shape_and_triggers_are_refused() {
        let said = said_after("ALTER TABLE tests ADD COLUMN more TEXT").unwrap();
        assert!(said.contains("the table `tests` is not the one that a run makes"), "{said}");
        let said = said_after("DROP TABLE wall_times").unwrap();
        assert!(said.contains("the table `wall_times` is missing"), "{said}");
        let trigger = "CREATE TRIGGER quiet AFTER INSERT ON tests BEGIN DELETE FROM tests; END";
        let said = said_after(trigger).unwrap();
        assert!(said.contains("there is a trigger `quiet`"), "{said}");
    }

    #[test]
    fn what_others_have_added_is_left_alone() {
        let added = "CREATE INDEX by_outcome ON tests (outcome); CREATE VIEW crashes AS SELECT * FROM tests; \
                     CREATE TABLE notes (test INTEGER, note TEXT); ANALYZE";
        assert_eq!(said_after(added), None);
    }
}
