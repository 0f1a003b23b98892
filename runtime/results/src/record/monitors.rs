//! The tables of what runtime monitors did. They are only there if the plan has monitors.
//!
//! Decisions follow from a run as its messages do, and explain the scores of monitors, which are metrics. So they are
//! no part of the digest, and may be missing.

use rusqlite::{Connection, Transaction, params};

use sesame_base::observation::{ChangeCause, EvidenceChange, MonitorDecision, MonitorObservation};
use sesame_base::test_number::TestNumber;
use sesame_plan::{CampaignPlan, Monitor, MonitorState};

use crate::record::columns::{finite, index, position, unsigned};
use crate::record::{RecordError, Repository};

pub(super) const DDL: &str = include_str!("monitors.sql");

/// The tables, and the views of them.
pub(super) const OBJECTS: [&str; 8] = [
    "monitors",
    "monitor_states",
    "monitor_evidence",
    "monitor_decisions",
    "evidence_changes",
    "monitor_omissions",
    "decisions",
    "evidence",
];

/// Whether results have the tables, which were [recognised](super::recognise).
pub(super) fn are_in(connection: &Connection) -> rusqlite::Result<bool> {
    connection.query_row(
        "SELECT EXISTS (SELECT 1 FROM sqlite_schema WHERE type = 'table' AND name = 'monitor_decisions')",
        [],
        |row| row.get(0),
    )
}

/// Makes the tables for a plan with monitors, unless they are there.
pub(super) fn install(connection: &Connection, plan: &CampaignPlan) -> rusqlite::Result<()> {
    if plan.monitors.is_empty() || are_in(connection)? {
        return Ok(());
    }
    connection.execute_batch(DDL)?;
    for (id, monitor) in plan.monitors.iter().enumerate() {
        let topic = monitor.publishes.map(|topic| &plan.topic(topic).name);
        let monitors = "INSERT INTO monitors (id, name, topic) VALUES (?1, ?2, ?3)";
        connection.execute(monitors, params![index(id), monitor.name, topic])?;
        let guarantees = monitor.guarantees.iter().map(|it| (&it.name, it.integrity));
        for (at, (name, integrity)) in guarantees.chain([(&monitor.otherwise.name, 0)]).enumerate() {
            let states = "INSERT INTO monitor_states (monitor, position, name, integrity) VALUES (?1, ?2, ?3, ?4)";
            connection.execute(states, params![index(id), index(at), name, integrity])?;
        }
        for (at, it) in monitor.evidence.iter().enumerate() {
            let evidence = "INSERT INTO monitor_evidence (monitor, position, name) VALUES (?1, ?2, ?3)";
            connection.execute(evidence, params![index(id), index(at), it.name])?;
        }
    }
    Ok(())
}

/// Writes what the monitors of a plan did in a test.
pub(super) fn write(
    transaction: &Transaction<'_>,
    plan: &CampaignPlan,
    test: u32,
    shown: &[MonitorObservation],
) -> rusqlite::Result<()> {
    for (id, (monitor, MonitorObservation { decisions, evidence, omitted })) in
        plan.monitors.iter().zip(shown).enumerate()
    {
        let id = index(id);
        for (at, &MonitorDecision { time, state }) in decisions.iter().enumerate() {
            transaction
                .prepare_cached(
                    "INSERT INTO monitor_decisions (test, monitor, position, time_s, state) VALUES (?1, ?2, ?3, ?4, ?5)",
                )?
                .execute(params![test, id, index(at), time, place(monitor, state)])?;
        }
        for (at, EvidenceChange { time, evidence, holds, cause }) in evidence.iter().enumerate() {
            let (path, message) = match cause {
                ChangeCause::Message { topic, index } => (Some(topic), i64::try_from(*index).ok()),
                ChangeCause::Held | ChangeCause::Stale => (None, None),
            };
            transaction
                .prepare_cached(
                    "INSERT INTO evidence_changes (test, monitor, position, time_s, evidence, holds, cause, path, message) \
                     VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9)",
                )?
                .execute(params![test, id, index(at), time, evidence, holds, cause.word(), path, message])?;
        }
        if *omitted > 0 {
            transaction
                .prepare_cached("INSERT INTO monitor_omissions (test, monitor, omitted) VALUES (?1, ?2, ?3)")?
                .execute(params![test, id, i64::try_from(*omitted).unwrap_or(i64::MAX)])?;
        }
    }
    Ok(())
}

/// The position of a state among those of its monitor.
fn place(monitor: &Monitor, state: MonitorState) -> i64 {
    match state {
        MonitorState::Guarantee(at) => i64::from(at),
        MonitorState::Otherwise => index(monitor.guarantees.len()),
    }
}

impl Repository {
    /// What the monitors of the plan did in a test; nothing in results that were recorded without it.
    pub(super) fn monitors(&self, test: u32) -> Result<Vec<MonitorObservation>, RecordError> {
        let plan = self.plan();
        let there = || are_in(&self.connection).map_err(|e| RecordError::database("read the results", &self.path, e));
        if plan.monitors.is_empty() || !there()? {
            return Ok(Vec::new());
        }
        let damaged = |what: &str| RecordError::damaged(&self.path, format!("{} has {what}", TestNumber(test)));
        let mut shown = vec![MonitorObservation::default(); plan.monitors.len()];
        let rows = self.read(
            "SELECT monitor, time_s, state FROM monitor_decisions WHERE test = ?1 ORDER BY monitor, position",
            [test],
            |row| Ok((position(row, 0)?, finite(row, 1)?, position(row, 2)?)),
        )?;
        for (monitor, time, state) in rows {
            let unknown = || damaged("a decision for a state that no monitor has");
            let guarantees = plan.monitors.get(monitor).map(|it| it.guarantees.len()).ok_or_else(unknown)?;
            let state = match u32::try_from(state) {
                _ if state == guarantees => MonitorState::Otherwise,
                Ok(at) if state < guarantees => MonitorState::Guarantee(at),
                _ => return Err(unknown()),
            };
            shown[monitor].decisions.push(MonitorDecision { time, state });
        }
        let rows = self.read(
            "SELECT monitor, time_s, evidence, holds, cause, path, message FROM evidence_changes WHERE test = ?1 \
             ORDER BY monitor, position",
            [test],
            |row| {
                let message = (row.get::<_, Option<String>>(5)?, row.get::<_, Option<i64>>(6)?);
                let (at, cause) = (position(row, 2)?, row.get::<_, String>(4)?);
                Ok((position(row, 0)?, finite(row, 1)?, at, row.get::<_, Option<bool>>(3)?, cause, message))
            },
        )?;
        for (monitor, time, evidence, holds, cause, message) in rows {
            let unknown = || damaged("a change of evidence that cannot be read");
            let known = plan.monitors.get(monitor).is_some_and(|it| evidence < it.evidence.len());
            let cause = match (cause.as_str(), message) {
                ("message", (Some(topic), Some(index))) => {
                    ChangeCause::Message { topic, index: u64::try_from(index).map_err(|_| unknown())? }
                }
                ("held", _) => ChangeCause::Held,
                ("stale", _) => ChangeCause::Stale,
                _ => return Err(unknown()),
            };
            let evidence = u32::try_from(evidence).ok().filter(|_| known).ok_or_else(unknown)?;
            shown[monitor].evidence.push(EvidenceChange { time, evidence, holds, cause });
        }
        let rows = self.read(
            "SELECT monitor, omitted FROM monitor_omissions WHERE test = ?1 ORDER BY monitor",
            [test],
            |row| Ok((position(row, 0)?, unsigned(row, 1)?)),
        )?;
        for (monitor, omitted) in rows {
            let unknown = || damaged("decisions of a monitor that is not there");
            shown.get_mut(monitor).ok_or_else(unknown)?.omitted = omitted;
        }
        Ok(shown)
    }
}
