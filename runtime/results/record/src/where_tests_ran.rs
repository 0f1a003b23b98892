//! On which machines tests ran: writes and reads the [table](super::machines).

use std::collections::BTreeMap;

use rusqlite::params;

use crate::machines::{DDL, are_in};
use crate::{RecordError, Recorder, Repository};

impl Recorder {
    /// Records on which machine an agent ran a test, which is recorded already.
    pub fn put_machine(&mut self, test: u32, machine: &str) -> Result<(), RecordError> {
        let path = self.repository().path().to_owned();
        let written = self.connection().transaction().and_then(|transaction| {
            if !are_in(&transaction)? {
                transaction.execute_batch(DDL)?;
            }
            transaction
                .prepare_cached("INSERT OR REPLACE INTO machines (test, machine) VALUES (?1, ?2)")?
                .execute(params![test, machine])?;
            transaction.commit()
        });
        written.map_err(|source| RecordError::database("record where a test ran", &path, source))
    }
}

impl Repository {
    /// The machine of each test that an agent ran.
    pub fn machines(&self) -> Result<BTreeMap<u32, String>, RecordError> {
        let read = || -> rusqlite::Result<BTreeMap<u32, String>> {
            if !are_in(&self.connection)? {
                return Ok(BTreeMap::new());
            }
            let mut statement = self.connection.prepare("SELECT test, machine FROM machines ORDER BY test")?;
            statement.query_map([], |row| Ok((row.get(0)?, row.get(1)?)))?.collect()
        };
        read().map_err(|source| RecordError::database("read where tests ran", &self.path, source))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Origin, sample};

    fn recorded(folder: &std::path::Path, machines: &[&str]) -> Repository {
        let plan = sample::plan();
        let mut recorder = Recorder::create(folder, &plan, 1, 0).unwrap();
        for number in 0..2 {
            recorder.commit(&sample::record(&plan, number, Origin::Reference, sesame_plan::Test::default())).unwrap();
        }
        for (number, machine) in (0..).zip(machines) {
            recorder.put_machine(number, machine).unwrap();
        }
        recorder.finish("done").unwrap()
    }

    #[test]
    fn the_machines_of_tests_are_read_as_they_were_recorded_and_change_no_digest() {
        let folders = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
        let alone = recorded(folders[0].path(), &[]);
        let many = recorded(folders[1].path(), &["lab", "laptop"]);
        assert_eq!(alone.machines().unwrap(), BTreeMap::new());
        assert_eq!(many.machines().unwrap(), BTreeMap::from([(0, "lab".to_owned()), (1, "laptop".to_owned())]));
        assert_eq!(alone.digest().unwrap(), many.digest().unwrap());
        Repository::open(folders[1].path()).unwrap();
    }
}
