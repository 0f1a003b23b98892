//! The tables of the course of reference runs: when messages came on each wire, and what happened in their fields.
//!
//! Searches place windows by it, so a resumed search has to have it. It explains what they do, and the digest leaves it
//! out. The tables are only there if a run without operations was recorded.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use rusqlite::{Transaction, params};

use sesame_base::observation::{Course, Happening, Heard, Signal, SignalEvent};
use sesame_base::silence::wires;
use sesame_plan::{CampaignPlan, Span};

use crate::columns::{finite, index};
use crate::monitors::is_in;
use crate::{RecordError, Repository};

pub(super) const TABLES: [&str; 2] = ["heard", "happenings"];

pub(super) const DDL: &str = "
-- When messages were published on a wire in a reference run: from the first to the last message of each stretch, which
-- are one and the same where there are few.
CREATE TABLE heard (
    test            INTEGER NOT NULL REFERENCES tests,
    wire            INTEGER NOT NULL, -- position of the path among those of all topics
    position        INTEGER NOT NULL,
    start_s         REAL NOT NULL,
    end_s           REAL NOT NULL,
    PRIMARY KEY (test, wire, position)
) STRICT, WITHOUT ROWID;
-- What happened in the messages of a reference run.
CREATE TABLE happenings (
    test            INTEGER NOT NULL REFERENCES tests,
    position        INTEGER NOT NULL,
    wire            INTEGER NOT NULL, -- position of the path among those of all topics
    topic           TEXT NOT NULL,
    path            TEXT NOT NULL,
    field           TEXT NOT NULL,  -- from the message inwards; empty for the messages as such
    kind            TEXT NOT NULL,  -- 'message', 'begins', 'ends', 'changes', 'jumps', 'sets_out', 'rests', …
    at_s            REAL NOT NULL,
    PRIMARY KEY (test, position)
) STRICT, WITHOUT ROWID;
";

/// Writes the course of a run.
pub(super) fn write(
    transaction: &Transaction<'_>,
    plan: &CampaignPlan,
    test: u32,
    course: &Course,
) -> rusqlite::Result<()> {
    if !is_in(transaction, TABLES[0])? {
        transaction.execute_batch(DDL)?;
    }
    let wires = wires(plan);
    let mut heard = transaction
        .prepare_cached("INSERT INTO heard (test, wire, position, start_s, end_s) VALUES (?1, ?2, ?3, ?4, ?5)")?;
    for Heard { wire, stretches } in &course.heard {
        for (position, Span { start, end }) in stretches.iter().enumerate() {
            heard.execute(params![test, wire, index(position), start, end])?;
        }
    }
    let mut happened = transaction.prepare_cached(
        "INSERT INTO happenings (test, position, wire, topic, path, field, kind, at_s) \
         VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)",
    )?;
    let events = course.signals.iter().flat_map(|signal| signal.events.iter().map(move |event| (signal, event)));
    for (position, (Signal { wire, field, .. }, SignalEvent { at, what })) in events.enumerate() {
        let Some((topic, path)) = wires.get(*wire as usize) else { continue };
        let topic = &plan.topic(*topic).name;
        happened.execute(params![test, index(position), wire, topic, path, field, what.word(), at])?;
    }
    Ok(())
}

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
                match of.last_mut().filter(|last| last.wire == wire && last.field == field) {
                    Some(last) => last.events.push(event),
                    None => of.push(Signal { wire, field, events: vec![event] }),
                }
            }
        }
        Ok(courses)
    }
}
