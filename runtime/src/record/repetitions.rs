//! Runs of tests again, written and read.

use std::collections::BTreeMap;

use rusqlite::params;
use sesame_plan::CampaignPlan;

use crate::observation::Outcome;
use crate::record::recorder::write_event;
use crate::record::schema::index;
use crate::record::{Event, EventKind, MetricValue, RecordError, Recorder, Repetition, Repository};
use crate::search::confirming::typical;
use crate::search::{self, Fitness};

/// What the repetitions of a test say of its fitness, by the campaign's way to sum them up; `None` where the campaign does
/// not confirm, or not all of its repetitions are there. Further ones, which a user asked for later, change nothing.
pub fn confirmed_fitness(plan: &CampaignPlan, repetitions: &[Repetition]) -> Option<Fitness> {
    let confirmation = plan.campaign.confirm?;
    let runs = repetitions.iter().take_while(|run| run.position <= confirmation.times);
    let runs: Vec<Fitness> =
        runs.map(|run| search::fitness_of(plan, &run.outcome, |metric| run.value(metric).value)).collect();
    (runs.len() == confirmation.times as usize).then(|| typical(&runs, confirmation.by))
}

impl Recorder {
    /// Records a repetition that has ended, of a test that was committed, and what its hooks warned of: all of it in one
    /// transaction, or nothing.
    pub fn put_repetition(&mut self, repetition: &Repetition, warnings: &[String]) -> Result<(), RecordError> {
        let Repetition { test, position, simulator_seed, outcome, end, messages, values } = repetition;
        let path = self.repository().path().to_owned();
        let unrecordable = |what: String| RecordError::Unrecordable { test: *test, what, path: path.clone() };
        let (detail, limit) = match outcome {
            Outcome::Completed | Outcome::Void | Outcome::Unknown => (None, None),
            Outcome::Crash { message } => (Some(message.as_str()), None),
            Outcome::Timeout { limit } => (None, Some(*limit)),
        };
        let numbers = values.iter().filter_map(|shown| shown.value).chain([*end]).chain(limit);
        if let Some(number) = numbers.into_iter().find(|number| !number.is_finite()) {
            return Err(unrecordable(format!("a number of repetition {position} is {number}")));
        }
        let messages = i64::try_from(*messages)
            .map_err(|_| unrecordable(format!("the count {messages}, which is beyond 63 bits,")))?;
        let written = self.connection().transaction().and_then(|transaction| {
            transaction
                .prepare_cached(
                    "INSERT INTO repetitions (test, position, simulator_seed, outcome, outcome_detail, time_limit_s, \
                     end_s, messages) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)",
                )?
                .execute(params![
                    test,
                    position,
                    simulator_seed.to_string(),
                    outcome.word(),
                    detail,
                    limit,
                    end,
                    messages
                ])?;
            for (metric, shown) in values.iter().enumerate() {
                transaction
                    .prepare_cached(
                        "INSERT INTO repetition_values (test, position, metric, value, is_set) \
                         VALUES (?1, ?2, ?3, ?4, ?5)",
                    )?
                    .execute(params![test, position, index(metric), shown.value, shown.set])?;
            }
            for warning in warnings {
                // Of the campaign: a test's own warnings are those of its own run.
                let text = format!("repetition {position} of T{test}: {warning}");
                write_event(&transaction, &Event { kind: EventKind::Warning, test: None, text })?;
            }
            transaction.commit()
        });
        written.map_err(|e| RecordError::database("record a repetition", &path, e))
    }
}

impl Repository {
    /// All repetitions of all tests: by test, and of each in their order.
    pub fn repetitions(&self) -> Result<BTreeMap<u32, Vec<Repetition>>, RecordError> {
        let values = self.read(
            "SELECT test, position, value, is_set FROM repetition_values ORDER BY test, position, metric",
            [],
            |row| {
                let at: (u32, u32) = (row.get(0)?, row.get(1)?);
                Ok((at, MetricValue { value: row.get(2)?, set: row.get(3)? }))
            },
        )?;
        let mut of: BTreeMap<(u32, u32), Vec<MetricValue>> = BTreeMap::new();
        for (at, value) in values {
            of.entry(at).or_default().push(value);
        }
        let rows = self.read(
            "SELECT test, position, simulator_seed, end_s, messages, outcome, outcome_detail, time_limit_s \
             FROM repetitions ORDER BY test, position",
            [],
            |row| {
                let at: (u32, u32) = (row.get(0)?, row.get(1)?);
                let ended: (f64, u64) = (row.get(3)?, super::repository::unsigned(row, 4)?);
                let outcome: (String, Option<String>, Option<f64>) = (row.get(5)?, row.get(6)?, row.get(7)?);
                Ok((at, row.get::<_, String>(2)?, ended, outcome))
            },
        )?;
        let mut repetitions: BTreeMap<u32, Vec<Repetition>> = BTreeMap::new();
        for ((test, position), seed, (end, messages), (word, detail, limit)) in rows {
            repetitions.entry(test).or_default().push(Repetition {
                test,
                position,
                simulator_seed: self.seed(&seed)?,
                outcome: self.outcome(&word, detail, limit)?,
                end,
                messages,
                values: of.remove(&(test, position)).unwrap_or_default(),
            });
        }
        Ok(repetitions)
    }
}
