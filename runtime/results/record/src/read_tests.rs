//! Reading tests: all tables are in their order, so that they are read side by side.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::time::Duration;

use rusqlite::{Row, params};

use sesame_base::observation::{Counters, Lost, MetricObservation, Observation, OperationEffect, Outcome, WallTime};
use sesame_base::test_number::TestNumber;
use sesame_notation as notation;
use sesame_plan::{Activation, Choice, KnownTestId, OperationId, RequirementId, Span, Test, TestOperation};

use crate::columns::{choice, finite, metric_value, perhaps_finite, position, span, unsigned};
use crate::cursor::Cursor;
use crate::lost_requirements;
use crate::monitors::is_in;
use crate::{MetricValue, Origin, RecordError, Repository, TestRecord, TestRow};

/// A recorded operation: position, name, seed of its draws, window and conditions.
type OperationColumns = (usize, String, String, Window, Conditions, bool);

/// Start and end of a planned window.
type Window = (Option<f64>, Option<f64>);

/// Start condition, end condition, length and times of an activation by condition.
type Conditions = (Option<String>, Option<String>, Option<f64>, Option<u32>);

/// The longest wall time of a run that is believed, in seconds: thirty years, of which programs can still count
/// multiples.
const LONGEST_RUN: f64 = 1e9;

/// The columns of a test's row that every reader of tests needs, in the order that [`Repository::head`] expects.
pub(super) const HEAD: &str =
    "number, origin, known_test, generation, outcome, outcome_detail, time_limit_s, duplicate_of";

/// How many columns [`HEAD`] has.
const HEAD_COLUMNS: usize = 8;

/// What the columns of [`HEAD`] say of a test.
pub(super) struct Head {
    pub(super) number: u32,
    pub(super) origin: Origin,
    pub(super) generation: Option<u32>,
    pub(super) outcome: Outcome,
    pub(super) duplicate_of: Option<u32>,
}

/// How often an operation was used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Uses {
    /// In all.
    pub all: usize,
    /// With an effect.
    pub effective: usize,
}

/// Which intervals of an operation a table has.
type SpansOf = fn(&mut OperationEffect) -> &mut Vec<Span>;

impl Repository {
    /// All tests, by number.
    pub fn tests(&self) -> Result<Vec<TestRow>, RecordError> {
        self.rows(0..=u32::MAX)
    }

    /// One test without its time series and effects.
    pub fn row(&self, number: u32) -> Result<TestRow, RecordError> {
        let missing = || RecordError::NoSuchTest { name: TestNumber(number).to_string(), path: self.path.clone() };
        self.rows(number..=number)?.pop().ok_or_else(missing)
    }

    /// One test, whole.
    pub fn test(&self, number: u32) -> Result<TestRecord, RecordError> {
        let missing = || RecordError::NoSuchTest { name: TestNumber(number).to_string(), path: self.path.clone() };
        self.records(number..=number, true)?.pop().ok_or_else(missing)
    }

    /// How often each operation was used in tests that ran to their end, and in how many of them it had an effect, by
    /// name. Reference runs, duplicates, and tests whose effects were not counted are left out.
    pub fn uses(&self) -> Result<BTreeMap<String, Uses>, RecordError> {
        let uses = self.read(
            "SELECT operation, count(*), sum(changed + dropped + delayed + queued + injected + side_effects > 0) \
             FROM operations JOIN tests ON number = test \
             WHERE outcome IN ('completed', 'no_effect') AND duplicate_of IS NULL AND changed IS NOT NULL \
             GROUP BY operation",
            [],
            |row| Ok((row.get(0)?, Uses { all: position(row, 1)?, effective: position(row, 2)? })),
        )?;
        Ok(uses.into_iter().collect())
    }

    /// The first reference run, with which all tests are compared; `None` where no test is one.
    pub fn reference_run(&self) -> Result<Option<TestRecord>, RecordError> {
        let first =
            self.read("SELECT number FROM tests WHERE origin = 'reference' ORDER BY number LIMIT 1", [], |row| {
                row.get::<_, u32>(0)
            })?;
        first.first().map(|&number| self.test(number)).transpose()
    }

    /// The seed that the simulator had in each test.
    pub fn simulator_seeds(&self) -> Result<BTreeMap<u32, u64>, RecordError> {
        let seeds = self.read("SELECT number, simulator_seed FROM tests ORDER BY number", [], |row| {
            Ok((row.get(0)?, row.get::<_, String>(1)?))
        })?;
        seeds.into_iter().map(|(number, seed)| Ok((number, self.seed(&seed)?))).collect()
    }

    /// The tests whose numbers lie in this range, in their order. Without their time series, which are most of what
    /// there is of a test, reading many at once takes a small part of the time that each takes by itself.
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
        let mut unreached = self.unreached(&numbers)?;
        let mut traffic = self.traffic(&numbers)?;
        let mut courses = self.courses(&numbers)?;
        let mut altered = self.altered_messages(&numbers)?;
        let rows = self.rows(numbers.clone())?;
        let mut effects = self.effects(&numbers, &rows)?;
        let mut records = Vec::with_capacity(rows.len());
        for row in rows {
            let (number, this) = (row.number, TestNumber(row.number));
            let missing = || RecordError::NoSuchTest { name: TestNumber(number).to_string(), path: self.path.clone() };
            let (simulator_seed, messages, run) = heads.remove(&number).ok_or_else(missing)?;
            if !(0.0..=LONGEST_RUN).contains(&run) {
                return Err(RecordError::damaged(&self.path, format!("the run of {this} took {run} s")));
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
                    robustness: Vec::new(),
                    lost: Vec::new(),
                })
                .collect();
            let mut monitors = Vec::new();
            if series {
                let ran = row.duplicate_of.unwrap_or(number);
                let lacking = || RecordError::damaged(&self.path, format!("{this} has a series without a metric"));
                for (metric, points) in self.series(ran)? {
                    metrics.get_mut(metric).ok_or_else(lacking)?.series = points;
                }
                for (metric, points) in self.robustness(ran)? {
                    metrics.get_mut(metric).ok_or_else(lacking)?.robustness = points;
                }
                for lost in self.lost(ran)? {
                    let metric = self.plan().requirement(lost.requirement).metric;
                    metrics.get_mut(metric.index()).ok_or_else(lacking)?.lost.push(lost);
                }
                monitors = self.monitors(ran)?;
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
                    unreached: unreached.remove(&number).unwrap_or_default(),
                    traffic: traffic.remove(&number).unwrap_or_default(),
                    course: courses.remove(&number),
                    altered: altered.remove(&number),
                    outcome: row.outcome,
                    end: row.end,
                    metrics,
                    monitors,
                    messages,
                    warnings: warnings.remove(&number).unwrap_or_default(),
                    wall: WallTime { run },
                },
            });
        }
        Ok(records)
    }

    /// The tests whose numbers lie in this range: all tables are in their order, so that they are gone through side by
    /// side.
    fn rows(&self, numbers: RangeInclusive<u32>) -> Result<Vec<TestRow>, RecordError> {
        let failed = |error| RecordError::database("read the results", &self.path, error);
        // One read transaction, so that a run writing meanwhile is seen at one point; there is one already within
        // others.
        let alone = self.connection.is_autocommit();
        let _transaction = alone.then(|| self.connection.unchecked_transaction()).transpose().map_err(failed)?;
        let damaged = |problem: String| RecordError::damaged(&self.path, problem);
        let prepare = |sql: &str| self.connection.prepare_cached(sql).map_err(failed);
        let within = params![numbers.start(), numbers.end()];
        let mut operations = prepare(
            "SELECT test, position, operation, operation_seed, start_s, end_s, start_condition, end_condition, length_s, times, \
             coalesce(changed + dropped + delayed + queued + injected + side_effects = 0, FALSE) \
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
        let mut tests =
            prepare(&format!("SELECT {HEAD}, end_s FROM tests WHERE number BETWEEN ?1 AND ?2 ORDER BY number"))?;
        let mut operations =
            Cursor::over(operations.query(within).map_err(failed)?, |row| -> rusqlite::Result<OperationColumns> {
                let window = (perhaps_finite(row, 4)?, perhaps_finite(row, 5)?);
                let conditions = (row.get(6)?, row.get(7)?, perhaps_finite(row, 8)?, row.get(9)?);
                Ok((position(row, 1)?, row.get(2)?, row.get(3)?, window, conditions, row.get(10)?))
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
        let left_out = self.left_out_operations(numbers.clone())?;
        let mut listed = self.listed_messages(&numbers)?;

        let mut found = Vec::new();
        let mut rows = tests.query(within).map_err(failed)?;
        while let Some(row) = rows.next().map_err(failed)? {
            let Head { number, origin, generation, outcome, duplicate_of } = self.head(row)?;
            let end = finite(row, HEAD_COLUMNS).map_err(failed)?;
            let this = TestNumber(number);
            let mut chosen: BTreeMap<usize, Vec<Choice>> = BTreeMap::new();
            for (at, position, choice) in choices.of(number).map_err(failed)? {
                let choice = choice.ok_or_else(|| {
                    damaged(format!("{this} has a choice that is neither value, range, point nor text"))
                })?;
                let of = chosen.entry(at).or_default();
                self.in_order(number, "choices", position, of.len())?;
                of.push(choice);
            }
            let (mut used, mut idle) = (Vec::new(), Vec::new());
            for (at, name, operation_seed, window, conditions, had_no_effect) in
                operations.of(number).map_err(failed)?
            {
                self.in_order(number, "operations", at, used.len())?;
                let operation = *ids
                    .get(name.as_str())
                    .ok_or_else(|| damaged(format!("{this} has an operation `{name}` that the plan lacks")))?;
                idle.push(had_no_effect);
                let mut parameters = chosen.remove(&at).unwrap_or_default();
                parameters.shrink_to_fit();
                used.push(TestOperation {
                    operation,
                    activation: self.activation(number, operation, window, conditions)?,
                    parameters,
                    operation_seed: self.seed(&operation_seed)?,
                    messages: listed.remove(&(number, at)),
                });
            }
            if !chosen.is_empty() {
                return Err(damaged(format!("{this} has a choice without an operation")));
            }
            let mut measured = Vec::new();
            for (metric, value) in values.of(number).map_err(failed)? {
                self.in_order(number, "values", metric, measured.len())?;
                measured.push(value);
            }
            // Room to grow would be a third of what all tests take in memory.
            measured.shrink_to_fit();
            used.shrink_to_fit();
            idle.shrink_to_fit();
            let test = Test { operations: used };
            self.fitting(number, &test, measured.len())?;
            found.push(TestRow {
                number,
                origin,
                generation,
                test,
                idle,
                outcome,
                end,
                duplicate_of,
                values: measured,
                left_out: left_out.get(&number).copied().unwrap_or_default(),
            });
        }
        if let Some(((test, _), _)) = listed.pop_first() {
            return Err(damaged(format!("{} lists messages without an operation", TestNumber(test))));
        }
        let orphans = [operations.orphan(), choices.orphan(), values.orphan()];
        match orphans.into_iter().flatten().min() {
            // A single test is missing for the caller, who gets an error of its own.
            Some(orphan) if numbers.start() < numbers.end() => Err(self.without_test(orphan)),
            _ => Ok(found),
        }
    }

    /// Reads a row that begins with the columns of [`HEAD`].
    pub(super) fn head(&self, row: &Row<'_>) -> Result<Head, RecordError> {
        let columns = || -> rusqlite::Result<_> {
            let origin: (String, Option<String>) = (row.get(1)?, row.get(2)?);
            let outcome: (String, Option<String>, Option<f64>) = (row.get(4)?, row.get(5)?, perhaps_finite(row, 6)?);
            Ok((row.get(0)?, origin, row.get(3)?, outcome, row.get(7)?))
        };
        let (number, (origin, known), generation, (outcome, detail, limit), duplicate_of) =
            columns().map_err(|e| RecordError::database("read the results", &self.path, e))?;
        Ok(Head {
            number,
            origin: self.origin(&origin, known.as_deref())?,
            generation,
            outcome: self.outcome(&outcome, detail, limit)?,
            duplicate_of,
        })
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
        let this = TestNumber(test);
        Err(RecordError::damaged(&self.path, format!("of the {what} of {this}, number {expected} is missing")))
    }

    /// A test is one of the plan, and has a value for each of its metrics or, after a crash of the worker, none.
    pub(super) fn fitting(&self, number: u32, test: &Test, values: usize) -> Result<(), RecordError> {
        let this = TestNumber(number);
        let damaged = |problem: String| RecordError::damaged(&self.path, format!("{this}: {problem}"));
        self.plan().validate_test(test).map_err(|error| damaged(error.to_string()))?;
        let metrics = self.plan().metrics.len();
        if values != 0 && values != metrics {
            return Err(damaged(format!("there are {values} values of {metrics} metrics")));
        }
        Ok(())
    }

    /// Something is recorded of a test, but not the test.
    pub(super) fn without_test(&self, number: u32) -> RecordError {
        let this = TestNumber(number);
        RecordError::damaged(&self.path, format!("{this} is gone, and some of what was recorded of it is still there"))
    }

    fn activation(
        &self,
        test: u32,
        operation: OperationId,
        window: Window,
        conditions: Conditions,
    ) -> Result<Activation, RecordError> {
        let (this, operation) = (TestNumber(test), self.plan().operation(operation));
        let read = |text: String| {
            notation::condition::read(&text, &self.plan().metrics)
                .map_err(|problem| RecordError::damaged(&self.path, format!("a condition of {this}: {problem}")))
        };
        match (window, conditions) {
            ((None, None), (None, None, None, None)) if operation.kind.is_offline() => Ok(Activation::Offline),
            _ if operation.kind.is_offline() => Err(RecordError::damaged(
                &self.path,
                format!("{this} has `{}` during the run, which acts before or after it", operation.name),
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
                format!("{this} has an operation that is switched neither by time nor by condition"),
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
        // A run that could not report what its operations did has no effects; imported runs have effects without
        // counts.
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
                let this = TestNumber(number);
                // Rows that belong to no test are ignored.
                let Some(effects) = effects.get_mut(&number) else { continue };
                for (operation, span) in spans {
                    let effect = effects.get_mut(operation).ok_or_else(|| {
                        RecordError::damaged(&self.path, format!("{this} has an interval without an operation"))
                    })?;
                    spans_of(effect).push(span);
                }
            }
        }
        Ok(effects)
    }

    fn origin(&self, origin: &str, known: Option<&str>) -> Result<Origin, RecordError> {
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
            ("no_effect", None, None) => Ok(Outcome::NoEffect),
            ("unknown", None, None) => Ok(Outcome::Unknown),
            ("crash", Some(message), None) => Ok(Outcome::Crash { message }),
            ("launch_failed", Some(message), None) => Ok(Outcome::LaunchFailed { message }),
            ("disconnect", Some(message), None) => Ok(Outcome::Disconnect { message }),
            ("wrong_clock", Some(message), None) => Ok(Outcome::WrongClock { message }),
            // A length of wall time, as programs count it.
            ("timeout", None, Some(limit)) if Duration::try_from_secs_f64(limit).is_ok() => {
                Ok(Outcome::Timeout { limit })
            }
            _ => Err(RecordError::damaged(&self.path, format!("a test cannot have ended as `{word}`"))),
        }
    }

    /// The requirements that a test lost before its end, in order of declaration.
    fn lost(&self, test: u32) -> Result<Vec<Lost>, RecordError> {
        if !is_in(&self.connection, lost_requirements::TABLE)
            .map_err(|e| RecordError::database("read the results", &self.path, e))?
        {
            return Ok(Vec::new());
        }
        let sql = "SELECT requirement, time_s FROM lost_requirements WHERE test = ?1 ORDER BY requirement";
        let lost =
            self.read(sql, [test], |row| Ok(Lost { requirement: RequirementId(row.get(0)?), at: finite(row, 1)? }))?;
        if lost.iter().any(|lost| lost.requirement.index() >= self.plan().requirements.len()) {
            return Err(self.odd(test, "a lost requirement that is not there"));
        }
        Ok(lost)
    }

    /// Rows of the tests in this range, by test, which is their first column.
    pub(super) fn by_test<T>(
        &self,
        sql: &str,
        numbers: &RangeInclusive<u32>,
        mut row: impl FnMut(&Row<'_>) -> rusqlite::Result<T>,
    ) -> Result<BTreeMap<u32, Vec<T>>, RecordError> {
        let rows = self.read(sql, params![numbers.start(), numbers.end()], |columns| {
            Ok((columns.get::<_, u32>(0)?, row(columns)?))
        })?;
        let mut found: BTreeMap<u32, Vec<T>> = BTreeMap::new();
        for (number, row) in rows {
            found.entry(number).or_default().push(row);
        }
        Ok(found)
    }
}
