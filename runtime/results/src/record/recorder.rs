//! Writing results while a campaign runs.

use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use rusqlite::{Connection, ErrorCode, Transaction, params};

use sesame_base::observation::{Observation, Outcome};
use sesame_base::test_number::TestNumber;
use sesame_notation as notation;
use sesame_plan::condition::{Condition, Operand};
use sesame_plan::{Activation, CampaignPlan, Choice, Task};
use sesame_search as search;
use sesame_search::indicators::GenerationIndicators;

use crate::record::columns::index;
use crate::record::files::{BEGUN, DATABASE};
use crate::record::folder::Lock;
use crate::record::{
    Claim, Event, EventKind, GenerationCoverage, Origin, RecordError, Repository, ResultSet, TestRecord, schema, series,
};

/// Writes the results of one campaign run. There is one per folder: it holds the folder's lock.
///
/// Dropping it without [`Recorder::finish`] leaves the run unfinished, with all that was committed.
#[derive(Debug)]
pub struct Recorder {
    // Before the lock: the database is closed when the lock is let go.
    repository: Repository,
    session: i64,
    lock: Lock,
}

impl Recorder {
    /// Begins the results of a run in a folder, which is made if absent and must not hold results.
    pub fn create(folder: &Path, plan: &CampaignPlan, seed: u64, workers: u32) -> Result<Recorder, RecordError> {
        Recorder::create_for(folder, plan, &Task::Campaign, seed, workers)
    }

    /// As [`Recorder::create`], of a run that does this task.
    pub fn create_for(
        folder: &Path,
        plan: &CampaignPlan,
        task: &Task,
        seed: u64,
        workers: u32,
    ) -> Result<Recorder, RecordError> {
        std::fs::create_dir_all(folder).map_err(|e| RecordError::io("make the folder for results", folder, e))?;
        Recorder::create_locked(folder, Lock::acquire(folder)?, plan, task, seed, workers)
    }

    /// Begins the results of a run in a folder that was claimed for it.
    pub fn create_in(
        claim: Claim,
        plan: &CampaignPlan,
        task: &Task,
        seed: u64,
        workers: u32,
    ) -> Result<Recorder, RecordError> {
        Recorder::create_locked(&claim.folder, claim.lock, plan, task, seed, workers)
    }

    fn create_locked(
        folder: &Path,
        lock: Lock,
        plan: &CampaignPlan,
        task: &Task,
        seed: u64,
        workers: u32,
    ) -> Result<Recorder, RecordError> {
        let path = folder.join(DATABASE);
        if path.exists() {
            return Err(RecordError::Exists { path });
        }
        // Whole before it has its name: a run that is killed as it begins leaves no results, rather than some that are
        // none. What an earlier one left under the other name is not worth keeping.
        let begun = folder.join(BEGUN);
        for leftover in [begun.clone(), folder.join(format!("{BEGUN}-journal"))] {
            match std::fs::remove_file(&leftover) {
                Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                    return Err(RecordError::io("remove what a broken-off run left", &leftover, error));
                }
                _ => {}
            }
        }
        let failed = |error| RecordError::database("begin the results", &path, error);
        let mut connection = Connection::open(&begun).map_err(failed)?;
        schema::install(&mut connection, plan, task, seed).map_err(failed)?;
        connection.close().map_err(|(_, error)| failed(error))?;
        std::fs::rename(&begun, &path).map_err(|e| RecordError::io("begin the results", &path, e))?;
        let connection = Connection::open(&path).map_err(failed)?;
        tune(&connection).map_err(failed)?;
        let repository = Repository::from_connection(connection, path).map_err(|error| match error {
            // Reading back needs room for what SQLite keeps beside the file.
            RecordError::Database { source, path, doing: _ } => {
                RecordError::database("begin the results", &path, source)
            }
            other => other,
        })?;
        Recorder::begin_session(repository, lock, workers)
    }

    /// Continues the results of a run that was interrupted.
    pub fn resume(folder: &Path, workers: u32) -> Result<Recorder, RecordError> {
        Recorder::open(folder, workers, false)
    }

    /// Opens the results of a run that is finished, to record [repetitions](Recorder::put_repetition) beside them.
    pub fn reopen(folder: &Path, workers: u32) -> Result<Recorder, RecordError> {
        Recorder::open(folder, workers, true)
    }

    fn open(folder: &Path, workers: u32, finished: bool) -> Result<Recorder, RecordError> {
        let path = folder.join(DATABASE);
        if !path.exists() {
            return Err(RecordError::Missing { path });
        }
        let lock = Lock::acquire(folder)?;
        let connection = schema::open(&path, true)?;
        schema::check_whole(&connection, &path)?;
        let repository = Repository::from_connection(connection, path)?;
        match repository.campaign().stop {
            Some(_) if !finished => return Err(RecordError::Finished { path: repository.path }),
            None if finished => return Err(RecordError::Unfinished { path: repository.path }),
            _ => {}
        }
        tune(&repository.connection).map_err(|e| RecordError::database("open the results", &repository.path, e))?;
        Recorder::begin_session(repository, lock, workers)
    }

    fn begin_session(repository: Repository, lock: Lock, workers: u32) -> Result<Recorder, RecordError> {
        repository
            .connection
            .execute(
                "INSERT INTO sessions (started_at, host, pid, workers) VALUES (?1, ?2, ?3, ?4)",
                params![wall_clock(), host(), std::process::id(), workers],
            )
            .map_err(|e| RecordError::database("begin a session", &repository.path, e))?;
        let session = repository.connection.last_insert_rowid();
        Ok(Recorder { repository, session, lock })
    }

    /// What was recorded so far.
    pub fn repository(&self) -> &Repository {
        &self.repository
    }

    pub(super) fn check_lock(&self) -> Result<(), RecordError> {
        self.lock.check()
    }

    pub(super) fn connection(&mut self) -> &mut Connection {
        &mut self.repository.connection
    }

    /// Records a test that has ended: all of it in one transaction, or nothing.
    pub fn commit(&mut self, record: &TestRecord) -> Result<(), RecordError> {
        let plan = &self.repository.facts.plan;
        let path = self.repository.path.clone();
        self.lock.check()?;
        // What would be refused when it is read is never written.
        let unfit = || plan.validate_test(&record.test).err().map(|error| error.to_string());
        if let Some(what) = unrecordable(record).or_else(unfit) {
            return Err(RecordError::Unrecordable { test: TestNumber(record.number), what, path });
        }
        let written = self.repository.connection.transaction().and_then(|transaction| {
            write_test(&transaction, plan, record)?;
            transaction.commit()
        });
        written.map_err(|source| match source.sqlite_error() {
            Some(error) if error.extended_code == rusqlite::ffi::SQLITE_CONSTRAINT_PRIMARYKEY => {
                match self.repository.row(record.number) {
                    Err(RecordError::NoSuchTest { .. }) => self.repository.without_test(record.number),
                    _ => RecordError::TestExists { number: TestNumber(record.number), path },
                }
            }
            _ => RecordError::database("record a test", &path, source),
        })
    }

    /// Records what tests were called in the file they were imported from, each a test that was committed.
    pub fn put_original_names<'n>(
        &mut self,
        names: impl IntoIterator<Item = (u32, &'n str)>,
    ) -> Result<(), RecordError> {
        let written = self.repository.connection.transaction().and_then(|transaction| {
            for (test, name) in names {
                transaction
                    .prepare_cached("INSERT OR REPLACE INTO original_names (test, name) VALUES (?1, ?2)")?
                    .execute(params![test, name])?;
            }
            transaction.commit()
        });
        written.map_err(|e| RecordError::database("record the names of tests", &self.repository.path, e))
    }

    /// Records a set of results; one of the same name is replaced, unless it is this one.
    pub fn put_result_set(&mut self, set: &ResultSet) -> Result<(), RecordError> {
        if self.repository.has_result_set(set)? {
            return Ok(());
        }
        let written = self.repository.connection.transaction().and_then(|transaction| {
            transaction.execute("DELETE FROM result_set_members WHERE result_set = ?1", [&set.name])?;
            transaction.execute(
                "INSERT OR REPLACE INTO result_sets (name, generation, status) VALUES (?1, ?2, ?3)",
                params![set.name, set.generation, set.status.word()],
            )?;
            for (position, test) in set.members.iter().enumerate() {
                transaction
                    .prepare_cached("INSERT INTO result_set_members (result_set, position, test) VALUES (?1, ?2, ?3)")?
                    .execute(params![set.name, index(position), test])?;
            }
            transaction.commit()
        });
        written.map_err(|e| RecordError::database("record a set of results", &self.repository.path, e))
    }

    /// Records how much is covered after a generation; what was recorded for it before is replaced.
    pub fn put_coverage(&mut self, coverage: &GenerationCoverage) -> Result<(), RecordError> {
        let GenerationCoverage { generation, evaluations, covered, cells, feasible } = *coverage;
        self.repository
            .connection
            .execute(
                "INSERT OR REPLACE INTO coverage (generation, evaluations, covered, cells, feasible) \
                 VALUES (?1, ?2, ?3, ?4, ?5)",
                params![generation, evaluations, index(covered), index(cells), index(feasible)],
            )
            .map(drop)
            .map_err(|e| RecordError::database("record the coverage", &self.repository.path, e))
    }

    /// Records the indicators after a generation, and the point that hypervolumes are measured from, oriented as a
    /// fitness is, once there is one; what was recorded for the generation before is replaced.
    pub fn put_indicators(
        &mut self,
        indicators: &GenerationIndicators,
        reference: Option<&[f64]>,
    ) -> Result<(), RecordError> {
        let plan = &self.repository.facts.plan;
        let GenerationIndicators {
            generation,
            evaluations,
            unique,
            no_effect,
            crashes,
            timeouts,
            front,
            hypervolume,
            standard_error,
        } = *indicators;
        let written = self.repository.connection.transaction().and_then(|transaction| {
            transaction
                .prepare_cached(
                    "INSERT OR REPLACE INTO indicators (generation, evaluations, unique_tests, no_effect, crashes, timeouts, \
                     front, hypervolume, estimated, standard_error) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10)",
                )?
                .execute(params![
                    generation,
                    evaluations,
                    unique,
                    no_effect,
                    crashes,
                    timeouts,
                    front,
                    hypervolume,
                    standard_error.is_some(),
                    standard_error
                ])?;
            let objectives = plan.campaign.objectives.iter().zip(reference.unwrap_or_default()).enumerate();
            for (position, (&metric, &value)) in objectives {
                transaction
                    .prepare_cached(
                        "INSERT OR REPLACE INTO reference_point (objective, metric, value) VALUES (?1, ?2, ?3)",
                    )?
                    .execute(params![index(position), metric.0, search::in_unit(plan, metric, value)])?;
            }
            transaction.commit()
        });
        written.map_err(|e| RecordError::database("record the indicators", &self.repository.path, e))
    }

    /// Records an event. An equal warning is recorded once, so that a resumed run may repeat it.
    pub fn put_event(&mut self, event: &Event) -> Result<(), RecordError> {
        let written = self.repository.connection.transaction().and_then(|transaction| {
            let known: bool = transaction
                .prepare_cached(
                    "SELECT EXISTS (SELECT 1 FROM events WHERE kind = 'warning' AND test IS ?1 AND text = ?2)",
                )?
                .query_row(params![event.test, event.text], |row| row.get(0))?;
            if event.kind == EventKind::Session || !known {
                write_event(&transaction, event)?;
            }
            transaction.commit()
        });
        written.map_err(|e| RecordError::database("record an event", &self.repository.path, e))
    }

    /// Ends this session but not the run: `resume` can continue it. Dropping does the same without the time of day.
    pub fn interrupt(self) -> Result<(), RecordError> {
        self.end_session()
    }

    /// Ends the run, with why it ended in a few words, and leaves one plain file that needs nothing beside it.
    pub fn finish(mut self, stop: &str) -> Result<Repository, RecordError> {
        let failed = |source, path: &Path| RecordError::database("finish the results", path, source);
        self.repository
            .connection
            .execute("UPDATE campaign SET stop = ?1", [stop])
            .map_err(|e| failed(e, &self.repository.path))?;
        self.repository.facts.stop = Some(stop.to_owned());
        self.end_session()?;
        self.repository.connection.flush_prepared_statement_cache();
        // Leaving the write-ahead log needs the file for ourselves. With a reader at work the log stays, which loses
        // nothing: the last process that closes the file folds it in.
        let left: rusqlite::Result<String> =
            self.repository.connection.query_row("PRAGMA journal_mode = DELETE", [], |row| row.get(0));
        match left {
            Err(error)
                if !matches!(error.sqlite_error_code(), Some(ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked)) =>
            {
                Err(failed(error, &self.repository.path))
            }
            _ => Ok(self.repository),
        }
    }

    fn end_session(&self) -> Result<(), RecordError> {
        self.repository
            .connection
            .execute("UPDATE sessions SET ended_at = ?1 WHERE id = ?2", params![wall_clock(), self.session])
            .map(drop)
            .map_err(|e| RecordError::database("end a session", &self.repository.path, e))
    }
}

/// Commits append to a log that the system writes out when it likes: a killed process loses nothing that was
/// committed, a power cut may lose the last tests but damages nothing.
fn tune(connection: &Connection) -> rusqlite::Result<()> {
    connection.query_row("PRAGMA journal_mode = WAL", [], |_| Ok(()))?;
    connection.pragma_update(None, "synchronous", "NORMAL")?;
    // References are for readers: a test's rows are written together, so that checking two for each change point of a
    // series would cost time and find nothing.
    connection.pragma_update(None, "foreign_keys", false)?;
    Ok(())
}

#[expect(clippy::disallowed_methods, reason = "when a run began is recorded, and decides nothing")]
fn wall_clock() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |elapsed| elapsed.as_secs_f64())
}

fn host() -> Option<String> {
    let name =
        std::fs::read_to_string("/proc/sys/kernel/hostname").ok().or_else(|| std::env::var("COMPUTERNAME").ok())?;
    Some(name.trim().to_owned()).filter(|name| !name.is_empty())
}

/// What SQLite could not return as it was written: numbers that are not finite, counts beyond 63 bits.
fn unrecordable(record: &TestRecord) -> Option<String> {
    let Observation { outcome, end, operations, metrics, messages, wall, unheard: _, warnings: _ } =
        &record.observation;
    let mut numbers = vec![("the end of the run", *end), ("the wall time", wall.run)];
    if let Outcome::Timeout { limit } = outcome {
        numbers.push(("the time limit", *limit));
    }
    for operation in &record.test.operations {
        match &operation.activation {
            Activation::Time { start, end } => {
                numbers.extend([("the start of an operation", *start), ("the end of an operation", *end)]);
            }
            Activation::Condition { start, end, .. } => {
                for condition in [start, end] {
                    numbers_of(condition, &mut |number| numbers.push(("a number in a condition", number)));
                }
            }
            Activation::ConditionFor { start, length, .. } => {
                numbers.push(("the length of an activation", *length));
                numbers_of(start, &mut |number| numbers.push(("a number in a condition", number)));
            }
            Activation::Offline => {}
        }
        for choice in &operation.parameters {
            match choice {
                Choice::Value { value } => numbers.push(("a parameter", *value)),
                Choice::Range { low, high } => numbers.extend([("a parameter", *low), ("a parameter", *high)]),
                Choice::Point { point } => numbers.extend(point.map(|coordinate| ("a parameter", coordinate))),
                Choice::Text { .. } => {}
            }
        }
    }
    for effect in operations {
        numbers.extend(effect.busy().flat_map(|span| [("an interval", span.start), ("an interval", span.end)]));
        numbers.extend([effect.first_touch, effect.last_touch].into_iter().flatten().map(|time| ("a touch", time)));
    }
    for metric in metrics {
        let ends = [metric.value, metric.reach.low, metric.reach.high].into_iter().flatten();
        numbers.extend(ends.map(|value| ("the value of a metric", value)));
        numbers.extend(metric.not_finite.map(|time| ("the time of what was not finite", time)));
        numbers.extend(
            metric
                .series
                .iter()
                .flat_map(|point| [("the time of a change", point.0), ("a value in a series", point.1)]),
        );
    }
    if let Some((what, number)) = numbers.into_iter().find(|(_, number)| !number.is_finite()) {
        return Some(format!("{what} is {number}"));
    }
    let counts = operations.iter().flat_map(|effect| {
        let c = &effect.counters;
        [c.seen, c.changed, c.dropped, c.delayed, c.queued, c.injected, c.side_effects, c.unheard]
    });
    let count = counts.chain([*messages]).find(|&count| i64::try_from(count).is_err())?;
    Some(format!("the count {count}, which is beyond 63 bits,"))
}

/// Every number that something is compared with.
fn numbers_of(condition: &Condition, take: &mut impl FnMut(f64)) {
    match condition {
        Condition::Compare { left, right, .. } => {
            for operand in [left, right] {
                if let Operand::Number(number) = *operand {
                    take(number);
                }
            }
        }
        Condition::And(a, b) | Condition::Or(a, b) => {
            numbers_of(a, take);
            numbers_of(b, take);
        }
    }
}

/// An activation as columns: start, end, start condition, end condition, length, times.
type Switched = (Option<f64>, Option<f64>, Option<String>, Option<String>, Option<f64>, Option<u32>);

fn switched(activation: &Activation, plan: &CampaignPlan) -> Switched {
    let text = |condition| Some(notation::condition::write(condition, &plan.metrics));
    match activation {
        Activation::Time { start, end } => (Some(*start), Some(*end), None, None, None, None),
        Activation::Condition { start, end, times } => (None, None, text(start), text(end), None, Some(*times)),
        Activation::ConditionFor { start, length, times } => {
            (None, None, text(start), None, Some(*length), Some(*times))
        }
        Activation::Offline => (None, None, None, None, None, None),
    }
}

fn count(count: u64) -> i64 {
    i64::try_from(count).expect("`unrecordable` refused larger counts")
}

fn write_test(transaction: &Transaction<'_>, plan: &CampaignPlan, record: &TestRecord) -> rusqlite::Result<()> {
    let TestRecord { number, origin, generation, parents, simulator_seed, duplicate_of, observation, test: _ } = record;
    let known_test = match origin {
        Origin::Known(id) => Some(plan.test(*id).name.as_str()),
        Origin::Reference | Origin::Search => None,
    };
    let (detail, limit) = match &observation.outcome {
        Outcome::Completed | Outcome::NoEffect | Outcome::Unknown => (None, None),
        Outcome::Crash { message } => (Some(message.as_str()), None),
        Outcome::Timeout { limit } => (None, Some(*limit)),
    };
    transaction
        .prepare_cached(
            "INSERT INTO tests (number, name, origin, known_test, generation, simulator_seed, outcome, \
             outcome_detail, time_limit_s, end_s, messages, duplicate_of) \
             VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12)",
        )?
        .execute(params![
            number,
            TestNumber(*number).to_string(),
            origin.word(),
            known_test,
            generation,
            simulator_seed.to_string(),
            observation.outcome.word(),
            detail,
            limit,
            observation.end,
            count(observation.messages),
            duplicate_of
        ])?;
    for (position, parent) in parents.iter().enumerate() {
        transaction
            .prepare_cached("INSERT INTO parents (test, position, parent) VALUES (?1, ?2, ?3)")?
            .execute(params![number, index(position), parent])?;
    }
    write_operations(transaction, plan, record)?;
    for (position, path) in observation.unheard.iter().enumerate() {
        transaction
            .prepare_cached("INSERT INTO unheard (test, position, path) VALUES (?1, ?2, ?3)")?
            .execute(params![number, index(position), path])?;
    }
    for (metric, shown) in observation.metrics.iter().enumerate() {
        transaction
            .prepare_cached(
                "INSERT INTO metric_values (test, metric, value, is_set, reach_low, reach_high, not_finite_s) \
                 VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)",
            )?
            .execute(params![
                number,
                index(metric),
                shown.value,
                shown.set,
                shown.reach.low,
                shown.reach.high,
                shown.not_finite
            ])?;
        if duplicate_of.is_some() {
            continue;
        }
        series::write(transaction, *number, metric, &shown.series)?;
    }
    for (position, text) in observation.warnings.iter().enumerate() {
        transaction
            .prepare_cached("INSERT INTO events (kind, test, position, text) VALUES ('warning', ?1, ?2, ?3)")?
            .execute(params![number, index(position), text])?;
    }
    transaction
        .prepare_cached("INSERT INTO wall_times (test, run_s) VALUES (?1, ?2)")?
        .execute(params![number, observation.wall.run])
        .map(drop)
}

fn write_operations(transaction: &Transaction<'_>, plan: &CampaignPlan, record: &TestRecord) -> rusqlite::Result<()> {
    let number = record.number;
    for (position, operation) in record.test.operations.iter().enumerate() {
        let kind = plan.operation(operation.operation);
        let (start, end, start_condition, end_condition, length, times) = switched(&operation.activation, plan);
        let effect = record.observation.operations.get(position);
        let counted = record.observation.outcome != Outcome::Unknown;
        let counters = effect.filter(|_| counted).map(|effect| effect.counters);
        transaction
            .prepare_cached(
                "INSERT INTO operations (test, position, operation, start_s, end_s, start_condition, end_condition, \
                 length_s, times, operation_seed, seen, changed, dropped, delayed, queued, injected, side_effects, unheard, \
                 first_touch_s, last_touch_s) \
                 VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, ?14, ?15, ?16, ?17, ?18, ?19, ?20)",
            )?
            .execute(params![
                number,
                index(position),
                kind.name,
                start,
                end,
                start_condition,
                end_condition,
                length,
                times,
                operation.operation_seed.to_string(),
                counters.map(|c| count(c.seen)),
                counters.map(|c| count(c.changed)),
                counters.map(|c| count(c.dropped)),
                counters.map(|c| count(c.delayed)),
                counters.map(|c| count(c.queued)),
                counters.map(|c| count(c.injected)),
                counters.map(|c| count(c.side_effects)),
                counters.map(|c| count(c.unheard)),
                effect.and_then(|effect| effect.first_touch),
                effect.and_then(|effect| effect.last_touch),
            ])?;
        for (at, (choice, parameter)) in operation.parameters.iter().zip(&kind.parameters).enumerate() {
            let (mut value, mut low, mut high, mut point, mut text) = (None, None, None, None, None);
            match choice {
                Choice::Value { value: chosen } => value = Some(*chosen),
                Choice::Range { low: from, high: to } => (low, high) = (Some(*from), Some(*to)),
                Choice::Point { point: chosen } => point = Some(*chosen),
                Choice::Text { text: chosen } => text = Some(chosen.as_str()),
            }
            let axis = |axis: usize| point.map(|point| point[axis]);
            transaction
                .prepare_cached(
                    "INSERT INTO choices (test, operation, position, parameter, unit, value, low, high, x, y, z, text) \
                     VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12)",
                )?
                .execute(params![
                    number,
                    index(position),
                    index(at),
                    parameter.name,
                    parameter.unit,
                    value,
                    low,
                    high,
                    axis(0),
                    axis(1),
                    axis(2),
                    text
                ])?;
        }
        for (at, span) in effect.into_iter().flat_map(|effect| &effect.intervals).enumerate() {
            transaction
                .prepare_cached(
                    "INSERT INTO intervals (test, operation, position, start_s, end_s) VALUES (?1, ?2, ?3, ?4, ?5)",
                )?
                .execute(params![number, index(position), index(at), span.start, span.end])?;
        }
        for (at, span) in effect.into_iter().flat_map(|effect| &effect.tails).enumerate() {
            transaction
                .prepare_cached(
                    "INSERT INTO tails (test, operation, position, start_s, end_s) VALUES (?1, ?2, ?3, ?4, ?5)",
                )?
                .execute(params![number, index(position), index(at), span.start, span.end])?;
        }
    }
    Ok(())
}

pub(super) fn write_event(transaction: &Transaction<'_>, event: &Event) -> rusqlite::Result<()> {
    transaction
        .prepare_cached(
            "INSERT INTO events (kind, test, position, text) \
             VALUES (?1, ?2, (SELECT coalesce(max(position) + 1, 0) FROM events WHERE test IS ?2), ?3)",
        )?
        .execute(params![event.kind.word(), event.test, event.text])
        .map(drop)
}
