//! Conditions, such as `near_zone1 < 3 and (2rad < link0_high or link0_high == 0rad)`.
//!
//! What is written reads back as the same condition: the same tree, the same order, every number bit for bit. `and`
//! binds tighter than `or`, and equal operators associate to the left, so parentheses only occur where the tree needs
//! them.

use std::iter::Peekable;

use sesame_plan::condition::{Comparison, Condition, Operand};
use sesame_plan::{Metric, MetricId};

use crate::unit::Unit;

/// A condition over these metrics. Numbers are in the unit of the variable with which they are compared.
pub fn write(condition: &Condition, metrics: &[Metric]) -> String {
    write_named(condition, &named(metrics))
}

/// The names and units of metrics.
pub(crate) fn named<'a>(metrics: &'a [Metric]) -> impl Fn(MetricId) -> (&'a str, Unit<'a>) {
    |id| {
        let metric = &metrics[id.index()];
        (&metric.name, Unit::named(metric.unit.as_deref()))
    }
}

/// As [`write()`], with the names and units of metrics from a function: for a caller that has no plan.
pub fn write_named<'a>(condition: &Condition, metric: &impl Fn(MetricId) -> (&'a str, Unit<'a>)) -> String {
    let enclosed = |condition: &Condition, parentheses: bool| {
        let text = write_named(condition, metric);
        if parentheses { format!("({text})") } else { text }
    };
    match condition {
        Condition::Compare { left, by, right } => {
            let unit = [left, right].into_iter().find_map(|operand| match *operand {
                Operand::Variable(id) => Some(metric(id).1),
                Operand::Number(_) => None,
            });
            let side = |operand: &Operand| match *operand {
                Operand::Variable(id) => metric(id).0.to_owned(),
                Operand::Number(number) => unit.unwrap_or(Unit::None).number(number),
            };
            format!("{} {} {}", side(left), by.sign(), side(right))
        }
        Condition::And(a, b) => {
            let left = matches!(**a, Condition::Or(..));
            let right = !matches!(**b, Condition::Compare { .. });
            format!("{} and {}", enclosed(a, left), enclosed(b, right))
        }
        Condition::Or(a, b) => format!("{} or {}", enclosed(a, false), enclosed(b, matches!(**b, Condition::Or(..)))),
    }
}

/// The most levels of a condition that is read, more than one of the language may have: what comes from a file must not
/// exhaust the stack.
const MOST_LEVELS: u32 = 100;

/// A condition, and how many levels its tree has.
type Levelled = (Condition, u32);

/// Reads what [`write()`] wrote. The error says what was found where something else was needed.
pub fn read(text: &str, metrics: &[Metric]) -> Result<Condition, String> {
    // Names, numbers and signs stand apart; parentheses touch what they enclose.
    let spaced = text.replace('(', "( ").replace(')', " )");
    let mut words = spaced.split_whitespace().peekable();
    let (condition, _) = either(&mut words, metrics, MOST_LEVELS)?;
    match words.next() {
        None => Ok(condition),
        Some(word) => Err(format!("`{word}` after the end of a condition")),
    }
}

fn joined(
    (a, levels_of_a): Levelled,
    (b, levels_of_b): Levelled,
    with: fn(Box<Condition>, Box<Condition>) -> Condition,
) -> Result<Levelled, String> {
    let levels = levels_of_a.max(levels_of_b) + 1;
    if levels > MOST_LEVELS { Err(too_deep()) } else { Ok((with(Box::new(a), Box::new(b)), levels)) }
}

fn too_deep() -> String {
    format!("a condition has more than {MOST_LEVELS} levels")
}

fn either<'a>(
    words: &mut Peekable<impl Iterator<Item = &'a str>>,
    metrics: &[Metric],
    room: u32,
) -> Result<Levelled, String> {
    let mut condition = both(words, metrics, room)?;
    while words.next_if_eq(&"or").is_some() {
        condition = joined(condition, both(words, metrics, room)?, Condition::Or)?;
    }
    Ok(condition)
}

fn both<'a>(
    words: &mut Peekable<impl Iterator<Item = &'a str>>,
    metrics: &[Metric],
    room: u32,
) -> Result<Levelled, String> {
    let mut condition = one(words, metrics, room)?;
    while words.next_if_eq(&"and").is_some() {
        condition = joined(condition, one(words, metrics, room)?, Condition::And)?;
    }
    Ok(condition)
}

/// A comparison, or a condition in parentheses, of which as many more may be open as there is room.
fn one<'a>(
    words: &mut Peekable<impl Iterator<Item = &'a str>>,
    metrics: &[Metric],
    room: u32,
) -> Result<Levelled, String> {
    let mut next = || words.next().ok_or("a condition ends too early");
    let left = next()?;
    if left == "(" {
        let inside = either(words, metrics, room.checked_sub(1).ok_or_else(too_deep)?)?;
        return match words.next() {
            Some(")") => Ok(inside),
            other => Err(format!("`{}` where a parenthesis should close", other.unwrap_or("the end"))),
        };
    }
    let (sign, right) = (next()?, next()?);
    let by = [Comparison::Below, Comparison::Above, Comparison::Equal].into_iter().find(|by| by.sign() == sign);
    let by = by.ok_or_else(|| format!("`{sign}` is not a comparison operator"))?;
    let variable = |word: &str| (0u32..).zip(metrics).find(|(_, metric)| metric.name == word);
    let unit = variable(left).or_else(|| variable(right)).and_then(|(_, metric)| metric.unit.as_deref());
    let operand = |word: &str| match variable(word) {
        Some((id, _)) => Ok(Operand::Variable(MetricId(id))),
        None => word
            .strip_suffix(unit.unwrap_or_default())
            .and_then(|digits| digits.parse().ok())
            .map(Operand::Number)
            .ok_or_else(|| format!("`{word}` is neither a metric nor a number with its unit")),
    };
    Ok((Condition::Compare { left: operand(left)?, by, right: operand(right)? }, 1))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use sesame_base::condition::testing::{above, and, any_condition, below, compare, or, variable};
    use sesame_plan::{MetricSource, testing as fixture};

    use super::*;

    fn metrics() -> Vec<Metric> {
        let metric = |name: &str, unit: Option<&str>| Metric {
            unit: unit.map(str::to_owned),
            ..fixture::metric(name, MetricSource::FuzzingTime)
        };
        vec![metric("speed", Some("m/s")), metric("near_zone1", None), metric("e", Some("eV"))]
    }

    #[test]
    fn conditions_are_written_with_units_and_no_more_parentheses_than_needed() {
        let written = |condition| write(&condition, &metrics());
        assert_eq!(
            written(and(above(0, 0.1 + 0.2), below(1, 3.0))),
            "speed > 0.30000000000000004m/s and near_zone1 < 3"
        );
        let (a, b, c) = (|| above(1, 1.0), || above(1, 2.0), || above(1, 3.0));
        let text = "near_zone1 > 1 and near_zone1 > 2 or near_zone1 > 3";
        assert_eq!(written(or(and(a(), b()), c())), text);
        assert_eq!(written(or(a(), and(b(), c()))), "near_zone1 > 1 or near_zone1 > 2 and near_zone1 > 3");
        assert_eq!(written(and(a(), or(b(), c()))), "near_zone1 > 1 and (near_zone1 > 2 or near_zone1 > 3)");
        assert_eq!(written(and(a(), and(b(), c()))), "near_zone1 > 1 and (near_zone1 > 2 and near_zone1 > 3)");
        assert_eq!(written(and(and(a(), b()), c())), "near_zone1 > 1 and near_zone1 > 2 and near_zone1 > 3");
        assert_eq!(written(compare(Operand::Number(2e20), Comparison::Equal, variable(2))), "2e20eV == e");
    }

    #[test]
    fn text_that_is_not_a_condition_is_refused() {
        let refused = |text| read(text, &metrics()).unwrap_err();
        assert_eq!(refused("speed > 3"), "`3` is neither a metric nor a number with its unit");
        assert_eq!(refused("speed >= 3m/s"), "`>=` is not a comparison operator");
        assert_eq!(refused("(near_zone1 > 3 or"), "a condition ends too early");
        assert_eq!(refused("(near_zone1 > 3"), "`the end` where a parenthesis should close");
        assert_eq!(refused("near_zone1 > 3 speed"), "`speed` after the end of a condition");
    }

    #[test]
    fn what_is_deeper_than_any_condition_of_the_language_is_refused_before_the_stack_is_exhausted() {
        let many = 200_000;
        let nested = format!("{}near_zone1 > 1{}", "(".repeat(many), ")".repeat(many));
        let chained = vec!["near_zone1 > 1"; many].join(" and ");
        let either = vec!["near_zone1 > 1"; many].join(" or ");
        for text in [nested, "(".repeat(many), chained, either] {
            assert_eq!(read(&text, &metrics()).unwrap_err(), "a condition has more than 100 levels");
        }
        let within = format!("{}near_zone1 > 1{}", "(".repeat(100), ")".repeat(100));
        assert!(read(&within, &metrics()).is_ok());
        assert!(read(&vec!["near_zone1 > 1"; 100].join(" and "), &metrics()).is_ok());
    }

    proptest! {
        #[test]
        fn what_is_written_reads_back_as_it_was(condition in any_condition(3), bits: u64) {
            prop_assert_eq!(read(&write(&condition, &metrics()), &metrics()), Ok(condition));
            let number = f64::from_bits(bits);
            prop_assume!(number.is_finite());
            let exact = and(above(0, number), compare(Operand::Number(-number), Comparison::Equal, variable(2)));
            prop_assert_eq!(read(&write(&exact, &metrics()), &metrics()), Ok(exact));
        }
    }
}
