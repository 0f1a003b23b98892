//! What runtime monitors did in tests, read back.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use rusqlite::params;

use sesame_base::observation::{ChangeCause, EvidenceChange, MonitorDecision, MonitorHazard, MonitorObservation};
use sesame_base::test_number::TestNumber;
use sesame_plan::{MonitorState, RequirementId};

use crate::columns::{finite, perhaps_finite, position, unsigned};
use crate::monitors::{are_in, have_hazards, have_hazards_of_repetitions};
use crate::{RecordError, Repository};

/// What each monitor of the plan did, per test.
type ByTest = BTreeMap<u32, Vec<MonitorObservation>>;

/// The hazards of each monitor of the plan, by test and position of a repetition.
type ByRepetition = BTreeMap<(u32, u32), Vec<Vec<MonitorHazard>>>;

impl Repository {
    /// What the monitors of the plan did in a test; nothing in results that were recorded without it.
    pub(super) fn monitors(&self, test: u32) -> Result<Vec<MonitorObservation>, RecordError> {
        let mut shown = self.decisions(test..=test)?;
        self.evidence(test..=test, &mut shown)?;
        Ok(shown.remove(&test).unwrap_or_default())
    }

    /// What the monitors of the plan decided in the tests whose numbers lie in this range, and the hazards that they
    /// were to foresee; without changes of evidence, which are most of what there is. Tests in which nothing was
    /// decided, and duplicates, are missing.
    pub fn decisions(&self, numbers: RangeInclusive<u32>) -> Result<ByTest, RecordError> {
        let plan = self.plan();
        let mut shown = ByTest::new();
        let is_in = |answer: rusqlite::Result<bool>| {
            answer.map_err(|e| RecordError::database("read the results", &self.path, e))
        };
        if plan.monitors.is_empty() || !is_in(are_in(&self.connection))? {
            return Ok(shown);
        }
        let within = params![numbers.start(), numbers.end()];
        let rows = self.read(
            "SELECT test, monitor, time_s, state FROM monitor_decisions WHERE test BETWEEN ?1 AND ?2 \
             ORDER BY test, monitor, position",
            within,
            |row| Ok((row.get(0)?, position(row, 1)?, finite(row, 2)?, position(row, 3)?)),
        )?;
        for (test, monitor, time, state) in rows {
            let unknown = || self.odd(test, "a decision for a state that no monitor has");
            let guarantees = plan.monitors.get(monitor).map(|monitor| monitor.guarantees.len()).ok_or_else(unknown)?;
            let state = match u32::try_from(state) {
                _ if state == guarantees => MonitorState::Otherwise,
                Ok(at) if state < guarantees => MonitorState::Guarantee(at),
                _ => return Err(unknown()),
            };
            self.of(&mut shown, test, monitor)?.decisions.push(MonitorDecision { time, state });
        }
        if is_in(have_hazards(&self.connection))? {
            let rows = self.read(
                "SELECT test, monitor, requirement, time_s, lead_s FROM monitor_hazards \
                 WHERE test BETWEEN ?1 AND ?2 ORDER BY test, monitor, time_s, requirement",
                within,
                |row| {
                    let requirement: u32 = row.get(2)?;
                    Ok((row.get(0)?, position(row, 1)?, requirement, finite(row, 3)?, perhaps_finite(row, 4)?))
                },
            )?;
            for (test, monitor, requirement, time, lead) in rows {
                let requirement = RequirementId(requirement);
                if requirement.index() >= plan.requirements.len() {
                    return Err(self.odd(test, "a hazard of a requirement that is not there"));
                }
                let hazard = MonitorHazard { requirement, time, lead };
                self.of(&mut shown, test, monitor)?.hazards.push(hazard);
            }
        }
        let rows = self.read(
            "SELECT test, monitor, omitted FROM monitor_omissions WHERE test BETWEEN ?1 AND ?2 ORDER BY test, monitor",
            within,
            |row| Ok((row.get(0)?, position(row, 1)?, unsigned(row, 2)?)),
        )?;
        for (test, monitor, omitted) in rows {
            self.of(&mut shown, test, monitor)?.omitted = omitted;
        }
        Ok(shown)
    }

    /// Adds the changes of evidence in these tests.
    fn evidence(&self, numbers: RangeInclusive<u32>, shown: &mut ByTest) -> Result<(), RecordError> {
        let plan = self.plan();
        if shown.is_empty() {
            return Ok(());
        }
        let rows = self.read(
            "SELECT test, monitor, time_s, evidence, holds, cause, path, message FROM evidence_changes \
             WHERE test BETWEEN ?1 AND ?2 ORDER BY test, monitor, position",
            params![numbers.start(), numbers.end()],
            |row| {
                let message = (row.get::<_, Option<String>>(6)?, row.get::<_, Option<i64>>(7)?);
                let (at, cause) = (position(row, 3)?, row.get::<_, String>(5)?);
                let place = (row.get(0)?, position(row, 1)?);
                Ok((place, finite(row, 2)?, at, row.get::<_, Option<bool>>(4)?, cause, message))
            },
        )?;
        for ((test, monitor), time, evidence, holds, cause, message) in rows {
            let unknown = || self.odd(test, "a change of evidence that cannot be read");
            let known = plan.monitors.get(monitor).is_some_and(|monitor| evidence < monitor.evidence.len());
            let cause = match (cause.as_str(), message) {
                ("message", (Some(topic), Some(index))) => {
                    ChangeCause::Message { topic, index: u64::try_from(index).map_err(|_| unknown())? }
                }
                ("held", _) => ChangeCause::Held,
                ("stale", _) => ChangeCause::Stale,
                _ => return Err(unknown()),
            };
            let evidence = u32::try_from(evidence).ok().filter(|_| known).ok_or_else(unknown)?;
            self.of(shown, test, monitor)?.evidence.push(EvidenceChange { time, evidence, holds, cause });
        }
        Ok(())
    }

    /// The hazards in repetitions, by test and position: per monitor of the plan.
    pub(super) fn repeated_hazards(&self) -> Result<ByRepetition, RecordError> {
        let plan = self.plan();
        let mut found = BTreeMap::new();
        let there = have_hazards_of_repetitions(&self.connection);
        if !there.map_err(|e| RecordError::database("read the results", &self.path, e))? {
            return Ok(found);
        }
        let rows = self.read(
            "SELECT test, position, monitor, requirement, time_s, lead_s FROM repetition_hazards \
             ORDER BY test, position, monitor, time_s, requirement",
            [],
            |row| {
                let (at, requirement): ((u32, u32), u32) = ((row.get(0)?, row.get(1)?), row.get(3)?);
                Ok((at, position(row, 2)?, requirement, finite(row, 4)?, perhaps_finite(row, 5)?))
            },
        )?;
        for (at, monitor, requirement, time, lead) in rows {
            let requirement = RequirementId(requirement);
            let of_run = found.entry(at).or_insert_with(|| vec![Vec::new(); plan.monitors.len()]);
            match of_run.get_mut(monitor).filter(|_| requirement.index() < plan.requirements.len()) {
                Some(hazards) => hazards.push(MonitorHazard { requirement, time, lead }),
                None => return Err(self.odd(at.0, "a hazard in a repetition that cannot be read")),
            }
        }
        Ok(found)
    }

    /// Where what a monitor did in a test is collected.
    fn of<'a>(
        &self,
        shown: &'a mut ByTest,
        test: u32,
        monitor: usize,
    ) -> Result<&'a mut MonitorObservation, RecordError> {
        let count = self.plan().monitors.len();
        let of_test = shown.entry(test).or_insert_with(|| vec![MonitorObservation::default(); count]);
        of_test.get_mut(monitor).ok_or_else(|| self.odd(test, "decisions of a monitor that is not there"))
    }

    pub(super) fn odd(&self, test: u32, what: &str) -> RecordError {
        RecordError::damaged(&self.path, format!("{} has {what}", TestNumber(test)))
    }
}
