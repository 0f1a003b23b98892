//! Reading which messages operations may alter, and which they altered.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use rusqlite::params;

use sesame_base::observation::{ALTERED_LISTED, AlteredMessage, AlteredMessages};
use sesame_base::test_number::TestNumber;
use sesame_plan::{MessageRun, Messages};

use crate::columns::{finite, position, unsigned};
use crate::monitors::is_in;
use crate::{RecordError, Repository, altered_messages, listed_messages};

impl Repository {
    /// The lists of tests whose numbers lie in this range, by test and position of the operation.
    pub(super) fn listed_messages(
        &self,
        numbers: &RangeInclusive<u32>,
    ) -> Result<BTreeMap<(u32, usize), Messages>, RecordError> {
        let failed = |error| RecordError::database("read the results", &self.path, error);
        if !is_in(&self.connection, listed_messages::TABLE).map_err(failed)? {
            return Ok(BTreeMap::new());
        }
        let rows = self.read(
            "SELECT test, operation, wire, first, last FROM listed_messages WHERE test BETWEEN ?1 AND ?2 \
             ORDER BY test, operation, position",
            params![numbers.start(), numbers.end()],
            |row| {
                let run = MessageRun { wire: row.get(2)?, first: unsigned(row, 3)?, last: unsigned(row, 4)? };
                Ok(((row.get::<_, u32>(0)?, position(row, 1)?), run))
            },
        )?;
        let mut lists: BTreeMap<(u32, usize), Vec<MessageRun>> = BTreeMap::new();
        for (operation, run) in rows {
            lists.entry(operation).or_default().push(run);
        }
        let list = |((test, operation), runs)| {
            let messages = Messages::try_from(runs).map_err(|problem| {
                let this = TestNumber(test);
                RecordError::damaged(&self.path, format!("the listed messages of {this} {problem}"))
            })?;
            Ok(((test, operation), messages))
        };
        lists.into_iter().map(list).collect()
    }

    /// Which messages operations altered in the tests whose numbers lie in this range, where their runs list them.
    pub fn altered_messages(
        &self,
        numbers: &RangeInclusive<u32>,
    ) -> Result<BTreeMap<u32, AlteredMessages>, RecordError> {
        let failed = |error| RecordError::database("read the results", &self.path, error);
        if !is_in(&self.connection, altered_messages::TABLES[0]).map_err(failed)? {
            return Ok(BTreeMap::new());
        }
        let within = params![numbers.start(), numbers.end()];
        let listings =
            self.read("SELECT test, too_many FROM listings WHERE test BETWEEN ?1 AND ?2", within, |row| {
                Ok((row.get(0)?, row.get::<_, bool>(1)?))
            })?;
        let nothing = |too_many| if too_many { AlteredMessages::TooMany } else { AlteredMessages::Listed(Vec::new()) };
        let mut found: BTreeMap<u32, AlteredMessages> =
            listings.into_iter().map(|(test, too_many)| (test, nothing(too_many))).collect();
        let rows = self.read(
            "SELECT test, position, operation, wire, number, time_s FROM altered_messages \
             WHERE test BETWEEN ?1 AND ?2 ORDER BY test, position",
            within,
            |row| {
                let (operation, wire, number) = (row.get(2)?, row.get(3)?, unsigned(row, 4)?);
                let message = AlteredMessage { operation, wire, number, time: finite(row, 5)? };
                Ok((row.get::<_, u32>(0)?, position(row, 1)?, message))
            },
        )?;
        for (test, at, message) in rows {
            let listed = match found.get_mut(&test) {
                Some(AlteredMessages::Listed(listed)) if listed.len() < ALTERED_LISTED => listed,
                _ => {
                    let this = TestNumber(test);
                    return Err(RecordError::damaged(&self.path, format!("{this} lists messages that it cannot list")));
                }
            };
            self.in_order(test, "altered messages", at, listed.len())?;
            listed.push(message);
        }
        Ok(found)
    }
}
