//! The tables of the course of reference runs: when messages came on each wire, and what happened in their fields.
//!
//! Searches place windows by it, so a resumed search has to have it. It explains what they do, and the digest leaves it
//! out. The tables are only there if a run without operations was recorded for a search that reads them.

use rusqlite::{Transaction, params};

use sesame_base::observation::{Course, Entered, Heard, Signal, SignalEvent, States};
use sesame_base::silence::{PlannedWire, wires};
use sesame_plan::{CampaignPlan, Span};

use crate::columns::index;
use crate::monitors::is_in;

pub(super) const TABLES: [&str; 2] = ["heard", "happenings"];
/// A table of its own, since files of before have only the others.
pub(super) const STATES: &str = "states";

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

pub(super) const STATES_DDL: &str = "
-- Which value a field had when in a reference run, where it took few.
CREATE TABLE states (
    test            INTEGER NOT NULL REFERENCES tests,
    position        INTEGER NOT NULL,
    wire            INTEGER NOT NULL, -- position of the path among those of all topics
    topic           TEXT NOT NULL,
    path            TEXT NOT NULL,
    field           TEXT NOT NULL,  -- from the message inwards; empty for a message that is a single value
    at_s            REAL NOT NULL,  -- when a message had the value first, until the next row of the field
    value           TEXT NOT NULL,
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
        let Some(&PlannedWire { topic, path, .. }) = wires.get(*wire as usize) else { continue };
        let topic = &plan.topic(topic).name;
        happened.execute(params![test, index(position), wire, topic, path, field, what.word(), at])?;
    }
    if course.states.is_empty() {
        return Ok(());
    }
    if !is_in(transaction, STATES)? {
        transaction.execute_batch(STATES_DDL)?;
    }
    let mut entering = transaction.prepare_cached(
        "INSERT INTO states (test, position, wire, topic, path, field, at_s, value) \
         VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)",
    )?;
    let entered = course.states.iter().flat_map(|states| states.entered.iter().map(move |entered| (states, entered)));
    for (position, (States { wire, field, .. }, Entered { at, value })) in entered.enumerate() {
        let Some(&PlannedWire { topic, path, .. }) = wires.get(*wire as usize) else { continue };
        let topic = &plan.topic(topic).name;
        entering.execute(params![test, index(position), wire, topic, path, field, at, value])?;
    }
    Ok(())
}
