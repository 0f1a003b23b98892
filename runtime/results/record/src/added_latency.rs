//! What the relay added to the way of messages is recorded, and read.

use std::collections::BTreeMap;

use rusqlite::params;

use sesame_base::latency::Latencies;

use crate::relay_latencies::{DDL, are_in};
use crate::{RecordError, Recorder, Repository};

impl Recorder {
    /// Records how long the relay kept messages in a run, by the name of each wire; nothing if there is none.
    pub fn put_relay_latencies<'l>(
        &mut self,
        test: u32,
        wires: impl IntoIterator<Item = (&'l str, &'l Latencies)>,
    ) -> Result<(), RecordError> {
        let mut wires = wires.into_iter().peekable();
        if wires.peek().is_none() {
            return Ok(());
        }
        let path = self.repository().path().to_owned();
        let written = self.connection().transaction().and_then(|transaction| {
            if !are_in(&transaction)? {
                transaction.execute_batch(DDL)?;
            }
            for (path, latencies) in wires {
                let json = serde_json::to_string(latencies).expect("latencies are plain data");
                let messages = i64::try_from(latencies.messages()).unwrap_or(i64::MAX);
                transaction
                    .prepare_cached(
                        "INSERT OR REPLACE INTO relay_latencies (test, path, messages, latencies) \
                         VALUES (?1, ?2, ?3, ?4)",
                    )?
                    .execute(params![test, path, messages, json])?;
            }
            transaction.commit()
        });
        written.map_err(|source| RecordError::database("record what the relay added", &path, source))
    }
}

impl Repository {
    /// How long the relay kept messages in all runs together, by the name of each wire; empty where it was not
    /// measured.
    pub fn relay_latencies(&self) -> Result<BTreeMap<String, Latencies>, RecordError> {
        let failed = |source| RecordError::database("read what the relay added", &self.path, source);
        let mut all: BTreeMap<String, Latencies> = BTreeMap::new();
        if !are_in(&self.connection).map_err(failed)? {
            return Ok(all);
        }
        let rows = || -> rusqlite::Result<Vec<(String, String)>> {
            let mut statement = self.connection.prepare("SELECT path, latencies FROM relay_latencies ORDER BY test")?;
            statement.query_map([], |row| Ok((row.get(0)?, row.get(1)?)))?.collect()
        };
        for (wire, json) in rows().map_err(failed)? {
            let of_run: Latencies = serde_json::from_str(&json).map_err(|error| {
                RecordError::damaged(&self.path, format!("what the relay added on `{wire}` cannot be read: {error}"))
            })?;
            all.entry(wire).or_default().add(&of_run);
        }
        Ok(all)
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use rusqlite::Connection;

    use super::*;
    use crate::{DATABASE, Origin, sample};

    fn recorded(folder: &std::path::Path, measured: &[(u32, &str, u64)]) -> Repository {
        let plan = sample::plan();
        let mut recorder = Recorder::create(folder, &plan, 1, 0).unwrap();
        for number in 0..2 {
            recorder.commit(&sample::record(&plan, number, Origin::Reference, sesame_plan::Test::default())).unwrap();
        }
        for &(test, path, milliseconds) in measured {
            let mut latencies = Latencies::default();
            latencies.record(Duration::from_millis(milliseconds));
            recorder.put_relay_latencies(test, [(path, &latencies)]).unwrap();
        }
        recorder.finish("done").unwrap()
    }

    #[test]
    fn what_the_relay_added_is_taken_together_over_runs_and_is_no_part_of_the_digest() {
        let (plain, measured) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let plain = recorded(plain.path(), &[]);
        assert!(plain.relay_latencies().unwrap().is_empty());
        let folder = measured.path().to_owned();
        let measured = recorded(&folder, &[(0, "a", 1), (0, "b", 2), (1, "a", 3)]);
        let all = measured.relay_latencies().unwrap();
        let seen: Vec<(&str, u64, Option<f64>)> =
            all.iter().map(|(path, latencies)| (path.as_str(), latencies.messages(), latencies.longest())).collect();
        assert_eq!(seen, [("a", 2, Some(0.003)), ("b", 1, Some(0.002))]);
        assert_eq!(measured.digest().unwrap(), plain.digest().unwrap());
        drop(measured);
        let connection = Connection::open(folder.join(DATABASE)).unwrap();
        connection.execute("UPDATE relay_latencies SET latencies = '{}'", []).unwrap();
        drop(connection);
        let said = Repository::open(&folder).unwrap().relay_latencies().unwrap_err().to_string();
        assert!(said.contains("what the relay added on `a` cannot be read"), "{said}");
    }

    #[test]
    fn a_view_in_the_place_of_the_table_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        drop(recorded(folder.path(), &[]));
        let connection = Connection::open(folder.path().join(DATABASE)).unwrap();
        connection.execute_batch("CREATE VIEW relay_latencies AS SELECT 1 AS test").unwrap();
        drop(connection);
        let said = Repository::open(folder.path()).unwrap_err().to_string();
        assert!(said.contains("`relay_latencies` is not a table, but a view"), "{said}");
    }
}
