//! Going through all tests of a run, one after the other, without holding them all: what analyses do.

use sesame_base::observation::Outcome;
use sesame_base::test_number::TestNumber;
use sesame_plan::{CampaignPlan, Choice, Dimension, OperationId, Span};
use sesame_search::coverage;
use sesame_search::sspr::{Convention, Disturbance, Point, disturbance};

use crate::columns::{choice, metric_value, perhaps_finite, position, span};
use crate::cursor::Cursor;
use crate::read_tests::{HEAD, Head};
use crate::{MetricValue, Origin, OriginalExtent, RecordError, Repository, split_operations};

/// One test as analyses see it: its operations, when they acted, and the results; without time series.
#[derive(Debug, Clone, PartialEq)]
pub struct ScannedTest {
    /// Its number in the campaign.
    pub number: u32,
    /// Where it comes from.
    pub origin: Origin,
    /// The generation of the search it belongs to.
    pub generation: Option<u32>,
    /// How its run ended.
    pub outcome: Outcome,
    /// The equal test whose result stands for this one.
    pub duplicate_of: Option<u32>,
    /// What it disturbed, in its order.
    pub operations: Vec<ScannedOperation>,
    /// Per metric of the plan, in its order; empty after a crash of the worker.
    pub values: Vec<MetricValue>,
    /// How many of its operations could not be imported, so that it did more than its operations say.
    pub left_out: u32,
}

/// Why a test has no point in the reduced parameter space.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum NoPoint {
    /// None of its operations was active with an effect.
    Inactive,
    /// Some of its operations could not be imported, so that a part of it is missing.
    LeftOut,
    /// It was imported, and acted or chose values beyond the windows and ranges of its operations, so that it lies
    /// outside of the space.
    Outside,
}

/// One operation of a scanned test.
#[derive(Debug, Clone, PartialEq)]
pub struct ScannedOperation {
    /// Which.
    pub operation: OperationId,
    /// When it was to be active; `None` where conditions switch it, and for one outside the run.
    pub planned: Option<Span>,
    /// What was chosen for its parameters.
    pub choices: Vec<Choice>,
    /// When it was seen to be active.
    pub intervals: Vec<Span>,
    /// Whether it had an effect, or the run cannot tell (it was imported).
    pub acted: bool,
    /// From its first effect to its last; `None` where it had none, and where the run cannot tell.
    pub touched: Option<Span>,
    /// The position of the first of the operations that were one with it in the file they were imported from, if it is
    /// not that one.
    pub part_of: Option<usize>,
    /// Its window and range in that file, where they are others in the plan.
    pub original: Option<OriginalExtent>,
}

impl ScannedTest {
    /// The value of the plan's metric at this position; unmeasured when the run reported none.
    pub fn value(&self, metric: sesame_plan::MetricId) -> MetricValue {
        self.values.get(metric.index()).copied().unwrap_or_default()
    }

    /// What this run says about a requirement.
    pub fn verdict(&self, requirement: &sesame_plan::Requirement) -> super::Verdict {
        super::verdict(requirement.bound, &self.outcome, self.value(requirement.metric))
    }

    /// Where it lies in the reduced parameter space, if it has a point.
    pub fn point(&self, plan: &CampaignPlan, convention: Convention) -> Option<Point> {
        self.placed(plan, convention).ok()
    }

    /// Where it lies in the reduced parameter space, or why it has no point.
    pub fn placed(&self, plan: &CampaignPlan, convention: Convention) -> Result<Point, NoPoint> {
        if self.left_out > 0 {
            return Err(NoPoint::LeftOut);
        }
        let mut disturbances: Vec<Disturbance> = Vec::with_capacity(self.operations.len());
        let mut places: Vec<usize> = Vec::with_capacity(self.operations.len());
        for operation in &self.operations {
            let intervals = if operation.acted { self.intervals(operation, plan, convention) } else { Vec::new() };
            let mut found = disturbance(plan, operation.operation, &operation.choices, intervals);
            if let Some(original) = operation.original.filter(|_| convention == Convention::Original) {
                found.window = original.window.unwrap_or(found.window);
                if let (Some(range), Some(first)) = (original.range, found.parameters.first_mut()) {
                    first.permitted = range;
                }
                // The original divided by the length of the window, which gave NaN for an empty one.
                if found.window.length() <= 0.0 && !found.intervals.is_empty() {
                    return Err(NoPoint::Outside);
                }
            }
            let whole = operation.part_of.and_then(|first| places.get(first)).copied();
            if let Some(place) = whole {
                disturbances[place].parameters.extend(found.parameters);
                places.push(place);
            } else {
                places.push(disturbances.len());
                disturbances.push(found);
            }
        }
        let point = Point::from_disturbances(&disturbances, convention).ok_or(NoPoint::Inactive)?;
        // Runs stay within what their plan permits. Nothing is known of what was imported.
        if self.outcome == Outcome::Unknown && !is_inside(&point, convention) {
            return Err(NoPoint::Outside);
        }
        Ok(point)
    }

    /// When an operation was active. The original platform did not cut windows at the end of a run.
    fn intervals(&self, operation: &ScannedOperation, plan: &CampaignPlan, convention: Convention) -> Vec<Span> {
        if let Some(planned) = operation.planned
            && convention == Convention::Original
            && self.outcome == Outcome::Unknown
        {
            let cut = Span { start: planned.start, end: planned.end.min(plan.campaign.end_after) };
            if operation.intervals.is_empty() || operation.intervals == [cut] {
                return vec![planned];
            }
        }
        operation.intervals.clone()
    }

    /// Its point, if it counts for coverage: it had an effect, and is not a duplicate.
    pub fn covering_point(&self, plan: &CampaignPlan, convention: Convention) -> Option<Point> {
        coverage::counts(&self.outcome, self.duplicate_of.is_some()).then(|| self.point(plan, convention)).flatten()
    }
}

/// Whether each coordinate is in `0..=1`, as far as it has to be: counts may be any, and by the paper's formulas so may
/// the intensity.
fn is_inside(point: &Point, convention: Convention) -> bool {
    let intensity: &[Dimension] = match convention {
        Convention::Paper => &[],
        Convention::Ours | Convention::Original => &[Dimension::P1, Dimension::P2],
    };
    let shares = [Dimension::T1, Dimension::T2, Dimension::T3].iter().chain(intensity);
    let mut known = shares.filter_map(|&dimension| point.get(dimension));
    known.all(|share| (-ROUNDING..=1.0 + ROUNDING).contains(&share))
}

/// By how much a share may be beyond its ends, since it is a quotient of rounded numbers.
const ROUNDING: f64 = 1e-9;

/// A row of `operations`: its position, the operation's name, when it was to be active, whether it had an effect or
/// effects were not counted, and from when to when it had them.
type PlannedRow = (usize, String, Option<Span>, bool, Option<Span>);

/// A row of `choices`: the position of its operation, and the choice; `None` if it is damaged.
type ChoiceRow = (usize, Option<Choice>);

impl Repository {
    /// Shows every test to `each`, by number. Each table is read once from its beginning to its end, so that a large
    /// file takes as long as reading it, and memory for one test.
    pub fn scan(&self, each: &mut dyn FnMut(ScannedTest)) -> Result<(), RecordError> {
        let failed = |e| RecordError::database("read the results", &self.path, e);
        let damaged = |text: String| RecordError::damaged(&self.path, text);
        let prepare = |sql: &str| self.connection.prepare(sql).map_err(failed);
        // One read transaction, so that a run writing meanwhile is seen at one point.
        let _transaction = self.connection.unchecked_transaction().map_err(failed)?;

        let mut operations = prepare(
            "SELECT test, position, operation, start_s, end_s, \
             coalesce(changed + dropped + delayed + queued + injected + side_effects > 0, TRUE), \
             first_touch_s, last_touch_s FROM operations ORDER BY test, position",
        )?;
        let mut choices = prepare(
            "SELECT test, operation, value, low, high, x, y, z, text FROM choices ORDER BY test, operation, position",
        )?;
        let mut intervals =
            prepare("SELECT test, operation, start_s, end_s FROM intervals ORDER BY test, operation, position")?;
        let mut values = prepare(
            "SELECT test, metric, value, is_set, reach_low, reach_high, not_finite_s FROM metric_values \
             ORDER BY test, metric",
        )?;
        let mut tests = prepare(&format!("SELECT {HEAD} FROM tests ORDER BY number"))?;
        let mut operations =
            Cursor::over(operations.query([]).map_err(failed)?, |row| -> rusqlite::Result<PlannedRow> {
                let span = |start, end| -> rusqlite::Result<Option<Span>> {
                    let ends = perhaps_finite(row, start)?.zip(perhaps_finite(row, end)?);
                    Ok(ends.map(|(start, end)| Span { start, end }))
                };
                Ok((position(row, 1)?, row.get(2)?, span(3, 4)?, row.get(5)?, span(6, 7)?))
            })
            .map_err(failed)?;
        let mut choices = Cursor::over(choices.query([]).map_err(failed)?, |row| -> rusqlite::Result<ChoiceRow> {
            Ok((position(row, 1)?, choice(row, 2)?))
        })
        .map_err(failed)?;
        let mut intervals =
            Cursor::over(intervals.query([]).map_err(failed)?, |row| Ok((position(row, 1)?, span(row, 2)?)))
                .map_err(failed)?;
        let mut values =
            Cursor::over(values.query([]).map_err(failed)?, |row| Ok((position(row, 1)?, metric_value(row, 2)?)))
                .map_err(failed)?;

        let are_split = split_operations::are_in(&self.connection).map_err(failed)?;
        let mut split = if are_split { Some(prepare(split_operations::QUERY)?) } else { None };
        let mut split = match &mut split {
            Some(split) => Some(
                Cursor::over(split.query([]).map_err(failed)?, |row| Ok((position(row, 1)?, position(row, 2)?)))
                    .map_err(failed)?,
            ),
            None => None,
        };

        let ids = self.operation_ids();
        let left_out = self.left_out_operations(0..=u32::MAX)?;
        let originals = self.original_extents()?;
        let mut rows = tests.query([]).map_err(failed)?;
        while let Some(row) = rows.next().map_err(failed)? {
            let Head { number, origin, generation, outcome, duplicate_of } = self.head(row)?;
            let this = TestNumber(number);
            let mut test = ScannedTest {
                number,
                origin,
                generation,
                outcome,
                duplicate_of,
                operations: Vec::new(),
                values: Vec::new(),
                left_out: left_out.get(&number).copied().unwrap_or_default(),
            };
            for (metric, value) in values.of(number).map_err(failed)? {
                self.in_order(number, "values", metric, test.values.len())?;
                test.values.push(value);
            }
            for (at, name, planned, acted, touched) in operations.of(number).map_err(failed)? {
                self.in_order(number, "operations", at, test.operations.len())?;
                let operation = *ids
                    .get(name.as_str())
                    .ok_or_else(|| damaged(format!("{this} has an operation `{name}` that the plan lacks")))?;
                test.operations.push(ScannedOperation {
                    operation,
                    planned,
                    choices: Vec::new(),
                    intervals: Vec::new(),
                    acted,
                    touched,
                    part_of: None,
                    original: originals.get(&operation).copied(),
                });
            }
            let stray = |what: &str| damaged(format!("{this} has {what} without an operation"));
            for (at, choice) in choices.of(number).map_err(failed)? {
                let choice = choice.ok_or_else(|| {
                    damaged(format!("{this} has a choice that is neither value, range, point nor text"))
                })?;
                test.operations.get_mut(at).ok_or_else(|| stray("a choice"))?.choices.push(choice);
            }
            for (at, span) in intervals.of(number).map_err(failed)? {
                test.operations.get_mut(at).ok_or_else(|| stray("an interval"))?.intervals.push(span);
            }
            if let Some(split) = &mut split {
                for (at, first) in split.of(number).map_err(failed)? {
                    if at >= test.operations.len() || first >= at || test.operations[first].part_of.is_some() {
                        return Err(damaged(format!(
                            "{this} has no operation {at} that was one with operation {first}"
                        )));
                    }
                    test.operations[at].part_of = Some(first);
                }
            }
            for operation in &test.operations {
                let (needed, chosen) =
                    (self.plan().operation(operation.operation).parameters.len(), operation.choices.len());
                if needed != chosen {
                    return Err(damaged(format!("{this} has {chosen} choices for {needed} parameters")));
                }
            }
            if !test.values.is_empty() && test.values.len() != self.plan().metrics.len() {
                return Err(damaged(format!("{this} has {} values", test.values.len())));
            }
            each(test);
        }
        let split = split.as_ref().and_then(Cursor::orphan);
        let orphans = [operations.orphan(), choices.orphan(), intervals.orphan(), values.orphan(), split];
        match orphans.into_iter().flatten().min() {
            Some(orphan) => Err(self.without_test(orphan)),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample;

    #[test]
    fn a_scan_sees_what_reading_each_test_sees() {
        let folder = tempfile::tempdir().unwrap();
        let repository = sample::campaign(folder.path(), &sample::plan(), 150);
        let mut scanned = Vec::new();
        repository.scan(&mut |test| scanned.push(test)).unwrap();
        let rows = repository.tests().unwrap();
        assert_eq!(scanned.len(), rows.len());
        assert!(rows.len() > 100);
        for (test, row) in scanned.iter().zip(&rows) {
            let record = repository.test(row.number).unwrap();
            assert_eq!((test.number, test.origin, test.generation), (row.number, row.origin, row.generation));
            assert_eq!((&test.outcome, test.duplicate_of), (&row.outcome, row.duplicate_of));
            assert_eq!(test.values, row.values);
            let operations: Vec<ScannedOperation> = record
                .test
                .operations
                .iter()
                .enumerate()
                .map(|(at, operation)| ScannedOperation {
                    operation: operation.operation,
                    planned: match operation.activation {
                        sesame_plan::Activation::Time { start, end } => Some(Span { start, end }),
                        _ => None,
                    },
                    choices: operation.parameters.clone(),
                    intervals: record
                        .observation
                        .operations
                        .get(at)
                        .map_or(Vec::new(), |effect| effect.intervals.clone()),
                    acted: record.observation.operations.get(at).is_none_or(|effect| effect.counters.any_effect()),
                    touched: record.observation.operations.get(at).and_then(|effect| {
                        effect.first_touch.zip(effect.last_touch).map(|(start, end)| Span { start, end })
                    }),
                    part_of: None,
                    original: None,
                })
                .collect();
            assert_eq!(test.operations, operations);
            let point = sesame_search::sspr::observed_point(repository.plan(), &record.test, &record.observation);
            assert_eq!(test.point(repository.plan(), Convention::Ours), point);
        }
    }
}
