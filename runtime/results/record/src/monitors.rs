//! The tables of what runtime monitors did. They are only there if the plan has monitors.
//!
//! Decisions follow from a run as its messages do, and explain the scores of monitors, which are metrics. So they are
//! no part of the digest, and may be missing.

use rusqlite::{Connection, Transaction, params};

use sesame_base::observation::{ChangeCause, EvidenceChange, MonitorDecision, MonitorHazard, MonitorObservation};
use sesame_plan::{CampaignPlan, Monitor, MonitorState};

use crate::columns::index;

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

/// The tables of hazards, and the view of them: the first results with monitors have none.
pub(super) const HAZARDS: &str = include_str!("hazards.sql");

/// The tables of schema 7, which knows the hazards of first runs only.
pub(super) const HAZARDS_7: &str = include_str!("hazards_7.sql");

pub(super) const HAZARD_OBJECTS: [&str; 3] = ["monitor_hazards", "repetition_hazards", "hazards"];

/// Whether results have the tables, which were [recognised](super::recognise).
pub(super) fn are_in(connection: &Connection) -> rusqlite::Result<bool> {
    is_in(connection, "monitor_decisions")
}

/// Whether they have the table of hazards.
pub(super) fn have_hazards(connection: &Connection) -> rusqlite::Result<bool> {
    is_in(connection, "monitor_hazards")
}

/// Whether they have the table of hazards in repetitions.
pub(super) fn have_hazards_of_repetitions(connection: &Connection) -> rusqlite::Result<bool> {
    is_in(connection, "repetition_hazards")
}

/// Whether a database has a table.
pub(super) fn is_in(connection: &Connection, table: &str) -> rusqlite::Result<bool> {
    let there = "SELECT EXISTS (SELECT 1 FROM sqlite_schema WHERE type = 'table' AND name = ?1)";
    connection.query_row(there, [table], |row| row.get(0))
}

/// Makes the tables for a plan with monitors, unless they are there.
pub(super) fn install(connection: &Connection, plan: &CampaignPlan) -> rusqlite::Result<()> {
    if plan.monitors.is_empty() {
        return Ok(());
    }
    if !have_hazards(connection)? {
        connection.execute_batch(HAZARDS)?;
    }
    if are_in(connection)? {
        return Ok(());
    }
    connection.execute_batch(DDL)?;
    for (id, monitor) in plan.monitors.iter().enumerate() {
        let topic = monitor.publishes.map(|topic| &plan.topic(topic).name);
        let monitors = "INSERT INTO monitors (id, name, topic) VALUES (?1, ?2, ?3)";
        connection.execute(monitors, params![index(id), monitor.name, topic])?;
        let guarantees = monitor.guarantees.iter().map(|guarantee| (&guarantee.name, guarantee.integrity));
        for (at, (name, integrity)) in guarantees.chain([(&monitor.otherwise.name, 0)]).enumerate() {
            let states = "INSERT INTO monitor_states (monitor, position, name, integrity) VALUES (?1, ?2, ?3, ?4)";
            connection.execute(states, params![index(id), index(at), name, integrity])?;
        }
        for (at, declared) in monitor.evidence.iter().enumerate() {
            let evidence = "INSERT INTO monitor_evidence (monitor, position, name) VALUES (?1, ?2, ?3)";
            connection.execute(evidence, params![index(id), index(at), declared.name])?;
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
    for (id, (monitor, MonitorObservation { decisions, evidence, hazards, omitted })) in
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
        for MonitorHazard { requirement, time, lead } in hazards {
            transaction
                .prepare_cached(
                    "INSERT INTO monitor_hazards (test, monitor, requirement, time_s, lead_s) VALUES (?1, ?2, ?3, ?4, ?5)",
                )?
                .execute(params![test, id, requirement.0, time, lead])?;
        }
        if *omitted > 0 {
            transaction
                .prepare_cached("INSERT INTO monitor_omissions (test, monitor, omitted) VALUES (?1, ?2, ?3)")?
                .execute(params![test, id, i64::try_from(*omitted).unwrap_or(i64::MAX)])?;
        }
    }
    Ok(())
}

/// Writes the hazards in a repetition, per monitor of a plan.
pub(super) fn write_hazards(
    transaction: &Transaction<'_>,
    (test, position): (u32, u32),
    hazards: &[Vec<MonitorHazard>],
) -> rusqlite::Result<()> {
    if hazards.iter().all(Vec::is_empty) || !have_hazards_of_repetitions(transaction)? {
        return Ok(());
    }
    for (id, hazards) in hazards.iter().enumerate() {
        for MonitorHazard { requirement, time, lead } in hazards {
            transaction
                .prepare_cached(
                    "INSERT INTO repetition_hazards (test, position, monitor, requirement, time_s, lead_s) \
                     VALUES (?1, ?2, ?3, ?4, ?5, ?6)",
                )?
                .execute(params![test, position, index(id), requirement.0, time, lead])?;
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
