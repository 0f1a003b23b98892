//! What runtime monitors did in a test, read back.

use sesame_base::observation::{ChangeCause, EvidenceChange, MonitorDecision, MonitorObservation};
use sesame_base::test_number::TestNumber;
use sesame_plan::MonitorState;

use crate::record::columns::{finite, position, unsigned};
use crate::record::monitors::are_in;
use crate::record::{RecordError, Repository};

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
