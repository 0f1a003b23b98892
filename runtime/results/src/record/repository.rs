//! Reading results.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::time::Duration;

use rusqlite::types::FromSql;
use rusqlite::{Connection, Row, params};

use sesame_base::condition;
use sesame_base::observation::{Counters, MetricObservation, Observation, OperationEffect, Outcome, Reach, WallTime};
use sesame_plan::{Activation, CampaignPlan, Choice, KnownTestId, OperationId, Span, Task, Test, TestOperation};
use sesame_search::indicators::GenerationIndicators;

use crate::record::folder::{DATABASE, trace_file};
use crate::record::scan::Cursor;
use crate::record::schema::STANDARD_WORDS_SINCE;
use crate::record::{
    Event, EventKind, GenerationCoverage, MetricValue, Origin, RecordError, ResultSet, Session, Status, TestRecord,
    TestRow, digest, earlier_plans, recognise, schema,
};

/// The results of one campaign run, to be read.
#[derive(Debug)]
pub struct Repository {
    pub(super) connection: Connection,
    pub(super) path: PathBuf,
    /// The schema of the file, which may be an earlier one.
    pub(super) schema: i64,
    pub(super) facts: CampaignFacts,
}

/// What is fixed for a campaign run.
#[derive(Debug, Clone, PartialEq)]
pub struct CampaignFacts {
    /// Everything the runner knew of the campaign.
    pub plan: CampaignPlan,
    /// What the run does with the plan.
    pub task: Task,
    /// The one seed that decided everything.
    pub seed: u64,
    /// Version of the runtime that ran it.
    pub runtime: String,
    /// Why the run ended; `None` while it is unfinished.
    pub stop: Option<String>,
}

/// How many statements are kept ready: more than reading and writing a test take together.
const STATEMENTS: usize = 64;

/// The recorded campaign: plan, seed, version of the runtime, why it ended, task.
type CampaignColumns = (String, String, String, Option<String>, Option<String>);

/// A recorded operation: position, name, seed of its draws, window and conditions.
type OperationColumns = (usize, String, String, Window, Conditions);

/// Start and end of a planned window.
type Window = (Option<f64>, Option<f64>);

/// Start condition, end condition, length and times of an activation by condition.
type Conditions = (Option<String>, Option<String>, Option<f64>, Option<u32>);

/// The longest wall time of a run that is believed, in seconds: thirty years, of which programs can still count multiples.
const LONGEST_RUN: f64 = 1e9;

/// Which intervals of an operation a table has.
type SpansOf = fn(&mut OperationEffect) -> &mut Vec<Span>;

impl Repository {
    /// Opens the results in a run's folder, or a results file itself, for reading only. A run may be writing them.
    pub fn open(path: &Path) -> Result<Repository, RecordError> {
        let path = if path.is_dir() { path.join(DATABASE) } else { path.to_owned() };
        let connection = schema::open(&path, false)?;
        Repository::from_connection(connection, path)
    }

    pub(super) fn from_connection(connection: Connection, path: PathBuf) -> Result<Repository, RecordError> {
        let schema = connection
            .pragma_query_value(None, "user_version", |row| row.get(0))
            .map_err(|e| RecordError::database("read the campaign", &path, e))?;
        // Before anything is asked of it: what has the name of a table may be something else that never comes to an end.
        recognise::tables(&connection, &path, schema)?;
        let sql = schema::query("SELECT plan, seed, runtime, stop, task FROM campaign", schema);
        let row: rusqlite::Result<CampaignColumns> = connection.query_row(&sql, [], |row| {
            let task = if schema >= schema::TASK_SINCE { row.get(4)? } else { None };
            Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?, task))
        });
        let (plan, seed, runtime, stop, task) = row.map_err(|source| match source {
            rusqlite::Error::QueryReturnedNoRows => RecordError::damaged(&path, "there is no campaign in it"),
            _ => RecordError::database("read the campaign", &path, source),
        })?;
        let (plan, task) =
            earlier_plans::read(&plan, task.as_deref()).map_err(|reason| RecordError::damaged(&path, reason))?;
        recognise::views(&connection, &path, &plan)?;
        let seed = seed.parse().map_err(|_| RecordError::damaged(&path, format!("`{seed}` is no seed")))?;
        connection.set_prepared_statement_cache_capacity(STATEMENTS);
        Ok(Repository { connection, path, schema, facts: CampaignFacts { plan, task, seed, runtime, stop } })
    }

    /// The database's file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The folder of the run, in which the database lies.
    pub fn folder(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new(""))
    }

    /// Makes the folder for traces, if there is none. Gives the run's folder as workers, which work elsewhere, need it.
    pub fn make_trace_folder(&self) -> Result<PathBuf, RecordError> {
        let traces = self.folder().join(crate::record::TRACES);
        let made = std::fs::create_dir_all(&traces).and_then(|()| std::path::absolute(self.folder()));
        made.map_err(|e| RecordError::io("make the folder for traces", &traces, e))
    }

    /// The trace of a test, or of the test whose result stands for it, if there is one.
    pub fn trace(&self, test: u32, duplicate_of: Option<u32>) -> Option<PathBuf> {
        Some(trace_file(self.folder(), duplicate_of.unwrap_or(test))).filter(|file| file.exists())
    }

    /// What is fixed for the run.
    pub fn campaign(&self) -> &CampaignFacts {
        &self.facts
    }

    /// Everything the runner knew of the campaign.
    pub fn plan(&self) -> &CampaignPlan {
        &self.facts.plan
    }

    /// What the run does with the plan.
    pub fn task(&self) -> &Task {
        &self.facts.task
    }

    /// Hash of the canonical content, see [`digest()`].
    pub fn digest(&self) -> Result<String, RecordError> {
        digest::of_connection(&self.connection, self.schema)
            .map_err(|e| RecordError::database("read the results", &self.path, e))
    }

    /// How many tests there are, without reference runs.
    pub fn evaluated(&self) -> Result<usize, RecordError> {
        let count = self.read("SELECT count(*) FROM tests WHERE origin <> 'reference'", [], |row| position(row, 0))?;
        Ok(count.into_iter().sum())
    }

    /// All tests, by number.
    pub fn tests(&self) -> Result<Vec<TestRow>, RecordError> {
        self.rows(0..=u32::MAX)
    }

    /// The numbers of all tests, ascending.
    pub fn numbers(&self) -> Result<Vec<u32>, RecordError> {
        self.read("SELECT number FROM tests ORDER BY number", [], |row| row.get(0))
    }

    /// One test without its time series and effects.
    pub fn row(&self, number: u32) -> Result<TestRow, RecordError> {
        let missing = || RecordError::NoSuchTest { name: format!("T{number}"), path: self.path.clone() };
        self.rows(number..=number)?.pop().ok_or_else(missing)
    }

    /// The number of the test that a user calls `T158`, `158`, by the name of a regression test or by its name before it was
    /// imported, or `reference` (the first reference run).
    pub fn find(&self, name: &str) -> Result<u32, RecordError> {
        let found = self.read(
            "SELECT min(number) FROM tests WHERE name = ?1 OR name = 'T' || ?1 OR known_test = ?1 \
             OR number = (SELECT min(test) FROM original_names WHERE name = ?1) \
             OR (origin = 'reference' AND ?1 = 'reference')",
            params![name],
            |row| row.get::<_, Option<u32>>(0),
        )?;
        found
            .into_iter()
            .flatten()
            .next()
            .ok_or_else(|| RecordError::NoSuchTest { name: name.to_owned(), path: self.path.clone() })
    }

    /// One test, whole.
    pub fn test(&self, number: u32) -> Result<TestRecord, RecordError> {
        let missing = || RecordError::NoSuchTest { name: format!("T{number}"), path: self.path.clone() };
        self.records(number..=number, true)?.pop().ok_or_else(missing)
    }

    /// The tests whose numbers lie in this range, in their order. Without their time series, which are most of what there is
    /// of a test, reading many at once takes a small part of the time that each takes by itself.
    pub fn records(&self, numbers: RangeInclusive<u32>, series: bool) -> Result<Vec<TestRecord>, RecordError> {
        let within = params![numbers.start(), numbers.end()];
        let heads = self.read(
            "SELECT number, simulator_seed, messages, run_s FROM tests JOIN wall_times ON test = number \
             WHERE number BETWEEN ?1 AND ?2 ORDER BY number",
            within,
            |row| Ok((row.get(0)?, (row.get::<_, String>(1)?, unsigned(row, 2)?, finite(row, 3)?))),
        )?;
        let mut heads: BTreeMap<u32, (String, u64, f64)> = heads.into_iter().collect();
        let mut parents: BTreeMap<u32, Vec<u32>> = self.by_test(
            "SELECT test, parent FROM parents WHERE test BETWEEN ?1 AND ?2 ORDER BY test, position",
            &numbers,
            |row| row.get(1),
        )?;
        let mut warnings: BTreeMap<u32, Vec<String>> = self.by_test(
            "SELECT test, text FROM events WHERE test BETWEEN ?1 AND ?2 AND kind = 'warning' ORDER BY test, position",
            &numbers,
            |row| row.get(1),
        )?;
        let mut unheard: BTreeMap<u32, Vec<String>> = self.by_test(
            "SELECT test, path FROM unheard WHERE test BETWEEN ?1 AND ?2 ORDER BY test, position",
            &numbers,
            |row| row.get(1),
        )?;
        let rows = self.rows(numbers.clone())?;
        let mut effects = self.effects(&numbers, &rows)?;
        let mut records = Vec::with_capacity(rows.len());
        for row in rows {
            let number = row.number;
            let missing = || RecordError::NoSuchTest { name: format!("T{number}"), path: self.path.clone() };
            let (simulator_seed, messages, run) = heads.remove(&number).ok_or_else(missing)?;
            if !(0.0..=LONGEST_RUN).contains(&run) {
                return Err(RecordError::damaged(&self.path, format!("the run of T{number} took {run} s")));
            }
            let mut metrics: Vec<MetricObservation> = row
                .values
                .iter()
                .map(|&MetricValue { value, set, reach, not_finite }| MetricObservation {
                    value,
                    set,
                    reach,
                    not_finite,
                    series: Vec::new(),
                })
                .collect();
            for (metric, points) in if series { self.series(row.duplicate_of.unwrap_or(number))? } else { Vec::new() } {
                let metric = metrics.get_mut(metric).ok_or_else(|| {
                    RecordError::damaged(&self.path, format!("T{number} has a series without a metric"))
                })?;
                metric.series = points;
            }
            records.push(TestRecord {
                number,
                origin: row.origin,
                generation: row.generation,
                parents: parents.remove(&number).unwrap_or_default(),
                test: row.test,
                simulator_seed: self.seed(&simulator_seed)?,
                duplicate_of: row.duplicate_of,
                observation: Observation {
                    operations: effects.remove(&number).unwrap_or_default(),
                    unheard: unheard.remove(&number).unwrap_or_default(),
                    outcome: row.outcome,
                    end: row.end,
                    metrics,
                    messages,
                    warnings: warnings.remove(&number).unwrap_or_default(),
                    wall: WallTime { run },
                },
            });
        }
        Ok(records)
    }

    /// What tests were called in the file they were imported from, by number; empty for a campaign that was run.
    pub fn original_names(&self) -> Result<BTreeMap<u32, String>, RecordError> {
        let names = self.read("SELECT test, name FROM original_names", [], |row| Ok((row.get(0)?, row.get(1)?)))?;
        Ok(names.into_iter().collect())
    }

    /// The sets of results, by generation, the final one last.
    pub fn result_sets(&self) -> Result<Vec<ResultSet>, RecordError> {
        let mut sets = Vec::new();
        for (mut set, _) in self.result_set_sizes()? {
            set.members = self.members(&set.name)?;
            sets.push(set);
        }
        Ok(sets)
    }

    /// The sets of results in the same order, without their members but with how many there are: the fronts of thousands
    /// of generations may have millions.
    pub fn result_set_sizes(&self) -> Result<Vec<(ResultSet, usize)>, RecordError> {
        self.read(
            "SELECT name, generation, status, coalesce((SELECT max(position) + 1 FROM result_set_members WHERE result_set = name), 0) \
             FROM result_sets ORDER BY status = 'final', generation, name",
            [],
            |row| {
                let last = row.get::<_, String>(2)? == Status::Final.word();
                let status = if last { Status::Final } else { Status::Intermediate };
                let set = ResultSet { name: row.get(0)?, generation: row.get(1)?, status, members: Vec::new() };
                Ok((set, position(row, 3)?))
            },
        )
    }

    /// The numbers of the tests of a set of results, in its order; empty where there is no such set.
    pub fn members(&self, set: &str) -> Result<Vec<u32>, RecordError> {
        self.read("SELECT test FROM result_set_members WHERE result_set = ?1 ORDER BY position", params![set], |row| {
            row.get(0)
        })
    }

    /// Whether just this set of results is recorded.
    pub(super) fn has_result_set(&self, set: &ResultSet) -> Result<bool, RecordError> {
        let sql = "SELECT generation IS ?2 AND status = ?3 FROM result_sets WHERE name = ?1";
        let same: Vec<bool> = self.read(sql, params![set.name, set.generation, set.status.word()], |row| row.get(0))?;
        Ok(same == [true] && self.members(&set.name)? == set.members)
    }

    /// The final set of results, or the latest one while there is no final one.
    pub fn latest_result_set(&self) -> Result<Option<ResultSet>, RecordError> {
        let Some((mut set, _)) = self.result_set_sizes()?.pop() else { return Ok(None) };
        set.members = self.members(&set.name)?;
        Ok(Some(set))
    }

    /// How much was covered after each generation; empty for a campaign that does not count it.
    pub fn coverage(&self) -> Result<Vec<GenerationCoverage>, RecordError> {
        self.read(
            "SELECT generation, evaluations, covered, cells, feasible FROM coverage ORDER BY generation",
            [],
            |row| {
                Ok(GenerationCoverage {
                    generation: row.get(0)?,
                    evaluations: row.get(1)?,
                    covered: position(row, 2)?,
                    cells: position(row, 3)?,
                    feasible: position(row, 4)?,
                })
            },
        )
    }

    /// The indicators after each generation; none of an imported campaign, whose tests are of no generation.
    pub fn indicators(&self) -> Result<Vec<GenerationIndicators>, RecordError> {
        self.read(
            "SELECT generation, evaluations, unique_tests, no_effect, crashes, timeouts, front, hypervolume, standard_error \
             FROM indicators ORDER BY generation",
            [],
            |row| {
                Ok(GenerationIndicators {
                    generation: row.get(0)?,
                    evaluations: row.get(1)?,
                    unique: row.get(2)?,
                    no_effect: row.get(3)?,
                    crashes: row.get(4)?,
                    timeouts: row.get(5)?,
                    front: row.get(6)?,
                    hypervolume: perhaps_finite(row, 7)?,
                    standard_error: perhaps_finite(row, 8)?,
                })
            },
        )
    }

    /// The point that the hypervolumes of [`Repository::indicators`] are measured from, a value per objective in its unit;
    /// `None` where there is none.
    pub fn reference_point(&self) -> Result<Option<Vec<f64>>, RecordError> {
        let point = self.read("SELECT value FROM reference_point ORDER BY objective", [], |row| finite(row, 0))?;
        let needed = self.plan().campaign.objectives.len();
        if !point.is_empty() && point.len() != needed {
            let problem = format!("its reference point has {} values for {needed} objectives", point.len());
            return Err(RecordError::damaged(&self.path, problem));
        }
        Ok(Some(point).filter(|point| !point.is_empty()))
    }

    /// Everything that happened that a user should know, warnings of tests included: first those of the campaign, then
    /// by test.
    pub fn events(&self) -> Result<Vec<Event>, RecordError> {
        self.read("SELECT kind, test, text FROM events ORDER BY test, position, id", [], |row| {
            let warning = row.get::<_, String>(0)? == EventKind::Warning.word();
            let kind = if warning { EventKind::Warning } else { EventKind::Session };
            Ok(Event { kind, test: row.get(1)?, text: row.get(2)? })
        })
    }

    /// When and where the campaign was worked on.
    pub fn sessions(&self) -> Result<Vec<Session>, RecordError> {
        self.read("SELECT started_at, ended_at, host, pid, workers FROM sessions ORDER BY id", [], |row| {
            Ok(Session {
                started_at: row.get(0)?,
                ended_at: row.get(1)?,
                host: row.get(2)?,
                pid: row.get(3)?,
                workers: row.get(4)?,
            })
        })
    }

    /// The tests whose numbers lie in this range: all tables are in their order, so that they are gone through side by side.
    fn rows(&self, numbers: RangeInclusive<u32>) -> Result<Vec<TestRow>, RecordError> {
        let failed = |error| RecordError::database("read the results", &self.path, error);
        // One read transaction, so that a run writing meanwhile is seen at one point; there is one already within others.
        let alone = self.connection.is_autocommit();
        let _transaction = alone.then(|| self.connection.unchecked_transaction()).transpose().map_err(failed)?;
        let damaged = |problem: String| RecordError::damaged(&self.path, problem);
        let prepare = |sql: &str| self.connection.prepare_cached(&schema::query(sql, self.schema)).map_err(failed);
        let within = params![numbers.start(), numbers.end()];
        let mut operations = prepare(
            "SELECT test, position, operation, operation_seed, start_s, end_s, start_condition, end_condition, length_s, times \
             FROM operations WHERE test BETWEEN ?1 AND ?2 ORDER BY test, position",
        )?;
        let mut choices = prepare(
            "SELECT test, operation, position, value, low, high, x, y, z, text FROM choices WHERE test BETWEEN ?1 AND ?2 \
             ORDER BY test, operation, position",
        )?;
        let mut values = prepare(
            "SELECT test, metric, value, is_set, reach_low, reach_high, not_finite_s FROM metric_values \
             WHERE test BETWEEN ?1 AND ?2 ORDER BY test, metric",
        )?;
        let mut tests = prepare(
            "SELECT number, origin, known_test, generation, outcome, outcome_detail, time_limit_s, end_s, duplicate_of \
             FROM tests WHERE number BETWEEN ?1 AND ?2 ORDER BY number",
        )?;
        let mut operations =
            Cursor::over(operations.query(within).map_err(failed)?, |row| -> rusqlite::Result<OperationColumns> {
                let window = (perhaps_finite(row, 4)?, perhaps_finite(row, 5)?);
                let conditions = (row.get(6)?, row.get(7)?, perhaps_finite(row, 8)?, row.get(9)?);
                Ok((position(row, 1)?, row.get(2)?, row.get(3)?, window, conditions))
            })
            .map_err(failed)?;
        let mut choices = Cursor::over(choices.query(within).map_err(failed)?, |row| -> rusqlite::Result<_> {
            Ok((position(row, 1)?, position(row, 2)?, choice(row, 3)?))
        })
        .map_err(failed)?;
        let mut values =
            Cursor::over(values.query(within).map_err(failed)?, |row| Ok((position(row, 1)?, metric_value(row, 2)?)))
                .map_err(failed)?;
        let ids = self.operation_ids();

        let mut found = Vec::new();
        let mut rows = tests.query(within).map_err(failed)?;
        while let Some(row) = rows.next().map_err(failed)? {
            let number: u32 = row.get(0).map_err(failed)?;
            let head = || -> rusqlite::Result<_> {
                let origin: (String, Option<String>) = (row.get(1)?, row.get(2)?);
                let outcome: (String, Option<String>, Option<f64>) =
                    (row.get(4)?, row.get(5)?, perhaps_finite(row, 6)?);
                Ok((origin, row.get(3)?, outcome, finite(row, 7)?, row.get(8)?))
            };
            let ((origin, known), generation, (outcome, detail, limit), end, duplicate_of) = head().map_err(failed)?;
            let mut chosen: BTreeMap<usize, Vec<Choice>> = BTreeMap::new();
            for (at, position, choice) in choices.of(number).map_err(failed)? {
                let choice = choice.ok_or_else(|| {
                    damaged(format!("T{number} has a choice that is neither value, range, point nor text"))
                })?;
                let of = chosen.entry(at).or_default();
                self.in_order(number, "choices", position, of.len())?;
                of.push(choice);
            }
            let mut used = Vec::new();
            for (at, name, operation_seed, window, conditions) in operations.of(number).map_err(failed)? {
                self.in_order(number, "operations", at, used.len())?;
                let operation = *ids
                    .get(name.as_str())
                    .ok_or_else(|| damaged(format!("T{number} has an operation `{name}` that the plan lacks")))?;
                let mut parameters = chosen.remove(&at).unwrap_or_default();
                parameters.shrink_to_fit();
                used.push(TestOperation {
                    operation,
                    activation: self.activation(number, operation, window, conditions)?,
                    parameters,
                    operation_seed: self.seed(&operation_seed)?,
                });
            }
            if !chosen.is_empty() {
                return Err(damaged(format!("T{number} has a choice without an operation")));
            }
            let mut measured = Vec::new();
            for (metric, value) in values.of(number).map_err(failed)? {
                self.in_order(number, "values", metric, measured.len())?;
                measured.push(value);
            }
            // Room to grow would be a third of what all tests take in memory.
            measured.shrink_to_fit();
            used.shrink_to_fit();
            let test = Test { operations: used };
            self.fitting(number, &test, measured.len())?;
            found.push(TestRow {
                number,
                origin: self.origin(&origin, known.as_deref())?,
                generation,
                test,
                outcome: self.outcome(&outcome, detail, limit)?,
                end,
                duplicate_of,
                values: measured,
            });
        }
        let orphans = [operations.orphan(), choices.orphan(), values.orphan()];
        match orphans.into_iter().flatten().min() {
            // A test that is asked for by itself is missing for whoever asked.
            Some(orphan) if numbers.start() < numbers.end() => Err(self.without_test(orphan)),
            _ => Ok(found),
        }
    }

    /// The plan's operations by name, as tests have them.
    pub(super) fn operation_ids(&self) -> BTreeMap<&str, OperationId> {
        (0u32..)
            .zip(&self.plan().operations)
            .map(|(id, operation)| (operation.name.as_str(), OperationId(id)))
            .collect()
    }

    /// Rows of a test are numbered from 0, none is missing.
    pub(super) fn in_order(&self, test: u32, what: &str, found: usize, expected: usize) -> Result<(), RecordError> {
        if found == expected {
            return Ok(());
        }
        Err(RecordError::damaged(&self.path, format!("of the {what} of T{test}, number {expected} is missing")))
    }

    /// A test is one of the plan, and has a value for each of its metrics or, after a crash of the worker, none.
    pub(super) fn fitting(&self, number: u32, test: &Test, values: usize) -> Result<(), RecordError> {
        let damaged = |problem: String| RecordError::damaged(&self.path, format!("T{number}: {problem}"));
        self.plan().validate_test(test).map_err(|error| damaged(error.to_string()))?;
        let metrics = self.plan().metrics.len();
        if values != 0 && values != metrics {
            return Err(damaged(format!("there are {values} values of {metrics} metrics")));
        }
        Ok(())
    }

    /// Something is recorded of a test, but not the test.
    pub(super) fn without_test(&self, number: impl std::fmt::Display) -> RecordError {
        RecordError::damaged(
            &self.path,
            format!("T{number} is gone, and some of what was recorded of it is still there"),
        )
    }

    fn activation(
        &self,
        test: u32,
        operation: OperationId,
        window: Window,
        conditions: Conditions,
    ) -> Result<Activation, RecordError> {
        let operation = self.plan().operation(operation);
        let read = |text: String| {
            condition::text::read(&text, &self.plan().metrics)
                .map_err(|problem| RecordError::damaged(&self.path, format!("a condition of T{test}: {problem}")))
        };
        match (window, conditions) {
            ((None, None), (None, None, None, None)) if operation.kind.is_offline() => Ok(Activation::Offline),
            _ if operation.kind.is_offline() => Err(RecordError::damaged(
                &self.path,
                format!("T{test} has `{}` during the run, which acts before or after it", operation.name),
            )),
            ((Some(start), Some(end)), (None, None, None, None)) => Ok(Activation::Time { start, end }),
            ((None, None), (Some(start), Some(end), None, Some(times))) => {
                Ok(Activation::Condition { start: read(start)?, end: read(end)?, times })
            }
            ((None, None), (Some(start), None, Some(length), Some(times))) => {
                Ok(Activation::ConditionFor { start: read(start)?, length, times })
            }
            _ => Err(RecordError::damaged(
                &self.path,
                format!("T{test} has an operation that is switched neither by time nor by condition"),
            )),
        }
    }

    /// What the operations of these tests did, by test.
    fn effects(
        &self,
        numbers: &RangeInclusive<u32>,
        rows: &[TestRow],
    ) -> Result<BTreeMap<u32, Vec<OperationEffect>>, RecordError> {
        let mut counted: BTreeMap<u32, Vec<Option<OperationEffect>>> = self.by_test(
            "SELECT test, seen, changed, dropped, delayed, queued, injected, side_effects, unheard, first_touch_s, \
             last_touch_s FROM operations WHERE test BETWEEN ?1 AND ?2 ORDER BY test, position",
            numbers,
            |row| {
                if row.get_ref(1)? == rusqlite::types::ValueRef::Null {
                    return Ok(None);
                }
                Ok(Some(OperationEffect {
                    intervals: Vec::new(),
                    tails: Vec::new(),
                    counters: Counters {
                        seen: unsigned(row, 1)?,
                        changed: unsigned(row, 2)?,
                        dropped: unsigned(row, 3)?,
                        delayed: unsigned(row, 4)?,
                        queued: unsigned(row, 5)?,
                        injected: unsigned(row, 6)?,
                        side_effects: unsigned(row, 7)?,
                        unheard: unsigned(row, 8)?,
                    },
                    first_touch: perhaps_finite(row, 9)?,
                    last_touch: perhaps_finite(row, 10)?,
                }))
            },
        )?;
        // A run that could not report what its operations did has no effects; of an imported one nobody counted them.
        let mut effects: BTreeMap<u32, Vec<OperationEffect>> = BTreeMap::new();
        for row in rows {
            let of = counted.remove(&row.number).unwrap_or_default();
            let of = if row.outcome == Outcome::Unknown {
                of.into_iter().map(Option::unwrap_or_default).collect()
            } else {
                of.into_iter().flatten().collect()
            };
            effects.insert(row.number, of);
        }
        let tables: [(&str, SpansOf); 2] = [
            (
                "SELECT test, operation, start_s, end_s FROM intervals WHERE test BETWEEN ?1 AND ?2 \
                 ORDER BY test, operation, position",
                |effect| &mut effect.intervals,
            ),
            (
                "SELECT test, operation, start_s, end_s FROM tails WHERE test BETWEEN ?1 AND ?2 \
                 ORDER BY test, operation, position",
                |effect| &mut effect.tails,
            ),
        ];
        for (sql, spans_of) in tables {
            let spans = self.by_test(sql, numbers, |row| Ok((position(row, 1)?, span(row, 2)?)))?;
            for (number, spans) in spans {
                // What belongs to no test is nobody's.
                let Some(effects) = effects.get_mut(&number) else { continue };
                for (operation, span) in spans {
                    let effect = effects.get_mut(operation).ok_or_else(|| {
                        RecordError::damaged(&self.path, format!("T{number} has an interval without an operation"))
                    })?;
                    spans_of(effect).push(span);
                }
            }
        }
        Ok(effects)
    }

    pub(super) fn origin(&self, origin: &str, known: Option<&str>) -> Result<Origin, RecordError> {
        match (origin, known) {
            ("reference", None) => Ok(Origin::Reference),
            ("search", None) => Ok(Origin::Search),
            ("known", Some(name)) => (0u32..)
                .zip(&self.plan().tests)
                .find(|(_, test)| test.name == name)
                .map(|(id, _)| Origin::Known(KnownTestId(id)))
                .ok_or_else(|| RecordError::damaged(&self.path, format!("the plan has no regression test `{name}`"))),
            _ => Err(RecordError::damaged(&self.path, format!("a test cannot come from `{origin}`"))),
        }
    }

    pub(super) fn outcome(
        &self,
        word: &str,
        detail: Option<String>,
        limit: Option<f64>,
    ) -> Result<Outcome, RecordError> {
        match (word, detail, limit) {
            ("completed", None, None) => Ok(Outcome::Completed),
            ("no_effect", None, None) if self.schema >= STANDARD_WORDS_SINCE => Ok(Outcome::NoEffect),
            ("void", None, None) if self.schema < STANDARD_WORDS_SINCE => Ok(Outcome::NoEffect),
            ("unknown", None, None) => Ok(Outcome::Unknown),
            ("crash", Some(message), None) => Ok(Outcome::Crash { message }),
            // A length of wall time, as programs count it.
            ("timeout", None, Some(limit)) if Duration::try_from_secs_f64(limit).is_ok() => {
                Ok(Outcome::Timeout { limit })
            }
            _ => Err(RecordError::damaged(&self.path, format!("a test cannot have ended as `{word}`"))),
        }
    }

    pub(super) fn seed(&self, text: &str) -> Result<u64, RecordError> {
        text.parse().map_err(|_| RecordError::damaged(&self.path, format!("`{text}` is no seed")))
    }

    /// Rows of the tests in this range, by test, which is their first column.
    fn by_test<T>(
        &self,
        sql: &str,
        numbers: &RangeInclusive<u32>,
        mut row: impl FnMut(&Row<'_>) -> rusqlite::Result<T>,
    ) -> Result<BTreeMap<u32, Vec<T>>, RecordError> {
        let rows =
            self.read(sql, params![numbers.start(), numbers.end()], |it| Ok((it.get::<_, u32>(0)?, row(it)?)))?;
        let mut found: BTreeMap<u32, Vec<T>> = BTreeMap::new();
        for (number, row) in rows {
            found.entry(number).or_default().push(row);
        }
        Ok(found)
    }

    pub(super) fn read<T>(
        &self,
        sql: &str,
        parameters: impl rusqlite::Params,
        row: impl FnMut(&Row<'_>) -> rusqlite::Result<T>,
    ) -> Result<Vec<T>, RecordError> {
        let rows = self
            .connection
            .prepare_cached(&schema::query(sql, self.schema))
            .and_then(|mut statement| statement.query_map(parameters, row)?.collect::<rusqlite::Result<Vec<T>>>());
        rows.map_err(|e| RecordError::database("read the results", &self.path, e))
    }
}

/// A count; a negative one is an error of conversion, not a huge number.
pub(super) fn unsigned(row: &Row<'_>, column: usize) -> rusqlite::Result<u64> {
    let value = row.get_ref(column)?;
    let count = i64::column_result(value)
        .map_err(|e| rusqlite::Error::FromSqlConversionFailure(column, value.data_type(), Box::new(e)))?;
    u64::try_from(count).map_err(|_| rusqlite::Error::IntegralValueOutOfRange(column, count))
}

/// The five columns of a metric's value from `first` on: value, whether it was set, both ends of its reach, and when it read
/// what was not finite.
pub(super) fn metric_value(row: &Row<'_>, first: usize) -> rusqlite::Result<MetricValue> {
    Ok(MetricValue {
        value: perhaps_finite(row, first)?,
        set: row.get(first + 1)?,
        reach: Reach { low: perhaps_finite(row, first + 2)?, high: perhaps_finite(row, first + 3)? },
        not_finite: perhaps_finite(row, first + 4)?,
    })
}

/// A number; infinity, which is never recorded, is an error of conversion.
pub(super) fn finite(row: &Row<'_>, column: usize) -> rusqlite::Result<f64> {
    let number: f64 = row.get(column)?;
    if number.is_finite() {
        return Ok(number);
    }
    let words = format!("{number} is recorded where only finite numbers are");
    Err(rusqlite::Error::FromSqlConversionFailure(column, rusqlite::types::Type::Real, words.into()))
}

/// A number, if there is one.
pub(super) fn perhaps_finite(row: &Row<'_>, column: usize) -> rusqlite::Result<Option<f64>> {
    match row.get_ref(column)? {
        rusqlite::types::ValueRef::Null => Ok(None),
        _ => finite(row, column).map(Some),
    }
}

/// A stretch of time, from the columns of its ends.
pub(super) fn span(row: &Row<'_>, first: usize) -> rusqlite::Result<Span> {
    Ok(Span { start: finite(row, first)?, end: finite(row, first + 1)? })
}

/// A position in a list.
pub(super) fn position(row: &Row<'_>, column: usize) -> rusqlite::Result<usize> {
    let count = unsigned(row, column)?;
    usize::try_from(count).map_err(|_| rusqlite::Error::IntegralValueOutOfRange(column, i64::MAX))
}

/// What was chosen for a parameter, from the columns value, low, high, x, y, z and text that begin here; `None` where it
/// is neither value, range, point nor text.
pub(super) fn choice(row: &Row<'_>, first: usize) -> rusqlite::Result<Option<Choice>> {
    let number = |column: usize| perhaps_finite(row, first + column);
    let point = [number(3)?, number(4)?, number(5)?];
    Ok(match (number(0)?, number(1)?, number(2)?, point, row.get(first + 6)?) {
        (Some(value), None, None, [None, None, None], None) => Some(Choice::Value { value }),
        (None, Some(low), Some(high), [None, None, None], None) => Some(Choice::Range { low, high }),
        (None, None, None, [Some(x), Some(y), Some(z)], None) => Some(Choice::Point { point: [x, y, z] }),
        (None, None, None, [None, None, None], Some(text)) => Some(Choice::Text { text }),
        _ => None,
    })
}
