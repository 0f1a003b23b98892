//! Reading the courses of reference runs.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use sesame_base::observation::{Course, Entered, Happening, Heard, Signal, SignalEvent, States};
use sesame_plan::Span;

use crate::columns::finite;
use crate::course::{STATES, TABLES};
use crate::monitors::is_in;
use crate::{RecordError, Repository};

impl Repository {
    /// The courses of the reference runs whose numbers lie in this range.
    pub(super) fn courses(&self, numbers: &RangeInclusive<u32>) -> Result<BTreeMap<u32, Course>, RecordError> {
        let failed = |error| RecordError::database("read the results", &self.path, error);
        if !is_in(&self.connection, TABLES[0]).map_err(failed)? {
            return Ok(BTreeMap::new());
        }
        let mut courses: BTreeMap<u32, Course> = BTreeMap::new();
        let heard = self.by_test(
            "SELECT test, wire, start_s, end_s FROM heard WHERE test BETWEEN ?1 AND ?2 ORDER BY test, wire, position",
            numbers,
            |row| Ok((row.get::<_, u32>(1)?, Span { start: finite(row, 2)?, end: finite(row, 3)? })),
        )?;
        for (test, stretches) in heard {
            let of = &mut courses.entry(test).or_default().heard;
            for (wire, span) in stretches {
                match of.last_mut().filter(|last| last.wire == wire) {
                    Some(last) => last.stretches.push(span),
                    None => of.push(Heard { wire, stretches: vec![span] }),
                }
            }
        }
        let happened = self.by_test(
            "SELECT test, wire, field, kind, at_s FROM happenings WHERE test BETWEEN ?1 AND ?2 ORDER BY test, position",
            numbers,
            |row| {
                let kind: String = row.get(3)?;
                Ok((row.get::<_, u32>(1)?, row.get::<_, String>(2)?, Happening::from_word(&kind), finite(row, 4)?))
            },
        )?;
        for (test, events) in happened {
            let of = &mut courses.entry(test).or_default().signals;
            for (wire, field, what, at) in events {
                let what = what.ok_or_else(|| self.odd(test, "something in a field that no run can show"))?;
                let event = SignalEvent { at, what };
                // The field has no name if a message is a single value, and if an event is about when messages come.
                let same = |last: &&mut Signal| {
                    last.wire == wire && last.field == field && last.is_of_messages() == what.is_of_messages()
                };
                match of.last_mut().filter(same) {
                    Some(last) => last.events.push(event),
                    None => of.push(Signal { wire, field, events: vec![event] }),
                }
            }
        }
        if !is_in(&self.connection, STATES).map_err(failed)? {
            return Ok(courses);
        }
        let entered = self.by_test(
            "SELECT test, wire, field, at_s, value FROM states WHERE test BETWEEN ?1 AND ?2 ORDER BY test, position",
            numbers,
            |row| {
                let entered = Entered { at: finite(row, 3)?, value: row.get(4)? };
                Ok((row.get::<_, u32>(1)?, row.get::<_, String>(2)?, entered))
            },
        )?;
        for (test, states) in entered {
            let of = &mut courses.entry(test).or_default().states;
            for (wire, field, entered) in states {
                match of.last_mut().filter(|last| last.wire == wire && last.field == field) {
                    Some(last) => last.entered.push(entered),
                    None => of.push(States { wire, field, entered: vec![entered] }),
                }
            }
        }
        Ok(courses)
    }
}
