//! A test as rows of the results repository.

use rusqlite::{Transaction, params};

use sesame_base::observation::{AlteredMessages, Observation, Outcome};
use sesame_base::test_number::TestNumber;
use sesame_notation as notation;
use sesame_plan::condition::{Condition, Operand};
use sesame_plan::{Activation, CampaignPlan, Choice};

use crate::columns::index;
use crate::series::{self, Pieces};
use crate::{
    Event, Origin, TestRecord, altered_messages, course, listed_messages, lost_requirements, monitors, traffic,
};

/// What SQLite could not return as it was written: numbers that are not finite, counts beyond 63 bits.
pub(super) fn unrecordable(record: &TestRecord) -> Option<String> {
    let Observation {
        outcome,
        end,
        operations,
        unheard: _,
        unreached,
        traffic,
        course,
        altered,
        metrics,
        monitors,
        messages,
        warnings: _,
        wall,
    } = &record.observation;
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
                .chain(&metric.robustness)
                .flat_map(|point| [("the time of a change", point.0), ("a value in a series", point.1)]),
        );
        numbers.extend(metric.lost.iter().map(|lost| ("the time at which a requirement was lost", lost.at)));
    }
    for monitor in monitors {
        let decisions = monitor.decisions.iter().map(|decision| ("the time of a decision", decision.time));
        numbers.extend(
            decisions.chain(monitor.evidence.iter().map(|change| ("the time of a change of evidence", change.time))),
        );
        let hazards = monitor.hazards.iter().flat_map(|hazard| [Some(hazard.time), hazard.lead]).flatten();
        numbers.extend(hazards.map(|time| ("the time of a hazard", time)));
    }
    let traffic =
        traffic.iter().flat_map(|heard| [heard.first, heard.last, heard.gap.start, heard.gap.end, heard.median_gap]);
    let nearest = unreached.iter().filter_map(|unreached| unreached.nearest);
    let stretches = course.iter().flat_map(|course| course.heard.iter().flat_map(|heard| &heard.stretches));
    let heard = stretches.flat_map(|span| [span.start, span.end]);
    numbers.extend(traffic.chain(nearest).chain(heard).map(|time| ("the time of a message", time)));
    if let Some(AlteredMessages::Listed(messages)) = altered {
        numbers.extend(messages.iter().map(|message| ("the time of an altered message", message.time)));
    }
    let happened = course.iter().flat_map(|course| course.signals.iter().flat_map(|signal| &signal.events));
    numbers.extend(happened.map(|event| ("the time of what happened in a message", event.at)));
    if let Some((what, number)) = numbers.into_iter().find(|(_, number)| !number.is_finite()) {
        return Some(format!("{what} is {number}"));
    }
    let counts = operations.iter().flat_map(|effect| {
        let c = &effect.counters;
        [c.seen, c.changed, c.dropped, c.delayed, c.queued, c.injected, c.side_effects, c.unheard]
    });
    let altered = altered.iter().filter_map(|altered| match altered {
        AlteredMessages::Listed(messages) => messages.iter().map(|message| message.number).max(),
        AlteredMessages::TooMany => None,
    });
    let count = counts.chain([*messages]).chain(altered).find(|&count| i64::try_from(count).is_err())?;
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

pub(super) fn write_test(
    transaction: &Transaction<'_>,
    plan: &CampaignPlan,
    record: &TestRecord,
) -> rusqlite::Result<()> {
    let TestRecord { number, origin, generation, parents, simulator_seed, duplicate_of, observation, test: _ } = record;
    let known_test = match origin {
        Origin::Known(id) => Some(plan.test(*id).name.as_str()),
        Origin::Reference | Origin::Search => None,
    };
    let (detail, limit) = match &observation.outcome {
        Outcome::Timeout { limit } => (None, Some(*limit)),
        outcome => (outcome.message(), None),
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
    listed_messages::write(transaction, *number, &record.test)?;
    if let Some(altered) = &observation.altered {
        altered_messages::write(transaction, *number, altered)?;
    }
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
        series::write(transaction, Pieces::Series, *number, metric, &shown.series)?;
        series::write(transaction, Pieces::Robustness, *number, metric, &shown.robustness)?;
    }
    if duplicate_of.is_none() {
        lost_requirements::write(transaction, *number, &observation.metrics)?;
        monitors::write(transaction, plan, *number, &observation.monitors)?;
        traffic::write(transaction, plan, *number, observation)?;
        if let Some(course) = &observation.course {
            course::write(transaction, plan, *number, course)?;
        }
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
