//! Whether the formulas of metrics mention only inputs and signals that they have.

use crate::stl::{self, Robustness};
use crate::{Aggregate, CampaignPlan, Expression, Formula, Input, Members, Memory, Point, Reduction, Region, Span};

use super::check::{Checked, at, each, filled, finite, id, positive, require, span};

impl CampaignPlan {
    pub(super) fn sound_formula(&self, formula: &Formula) -> Checked {
        let inputs = formula.inputs.as_slice();
        at("inputs", filled(inputs))?;
        each("inputs", &formula.inputs, |input| self.sound_input(input))?;
        at("inputs", self.one_pair(&formula.inputs))?;
        let paired = formula.inputs.iter().any(|input| input.members == Members::First);
        at("per", require(!paired || formula.per.is_none(), || "pairs have no keys".to_owned()))?;
        let aggregate = match &formula.aggregate {
            Aggregate::Last { of } | Aggregate::Min { of } | Aggregate::Max { of } | Aggregate::Mean { of } => {
                expression(of, inputs)
            }
            Aggregate::Count { of } | Aggregate::Duration { of } => proposition(of, inputs),
        };
        at("aggregate.of", aggregate)?;
        at("when", formula.when.as_ref().map_or(Ok(()), |when| proposition(when, inputs)))?;
        at("every", formula.every.map_or(Ok(()), positive))?;
        at("per", formula.per.as_ref().map_or(Ok(()), |per| self.field(per)))
    }

    pub(super) fn sound_robustness(&self, robustness: &Robustness) -> Checked {
        let inputs = robustness.inputs.as_slice();
        at("inputs", filled(inputs))?;
        each("inputs", &robustness.inputs, |input| self.sound_input(input))?;
        at("inputs", self.one_pair(&robustness.inputs))?;
        let mut groups = robustness.inputs.iter().filter(|input| input.members == Members::Each);
        let members = |input: &Input| self.topic(input.field.topic).paths.len();
        let first = groups.next();
        let fit = groups.all(|input| first.is_some_and(|first| members(first) == members(input)));
        at("inputs", require(fit, || "members of groups of different sizes are to be paired".to_owned()))?;
        each("signals", &robustness.signals, |signal| expression(signal, inputs))?;
        at("formula", temporal(&robustness.formula, robustness.signals.len()))
    }

    /// A condition, and the inputs that it refers to. It is one condition, so it is of no single members.
    pub(super) fn sound_condition(&self, inputs: &[Input], condition: &crate::formula::Condition) -> Checked {
        at("inputs", filled(inputs))?;
        each("inputs", inputs, |input| {
            self.sound_input(input)?;
            let one = matches!(input.members, Members::Min | Members::Max | Members::Sum | Members::Only(_));
            at("members", require(one, || "are not taken together".to_owned()))
        })?;
        let alone = || "reads a parameter of the space, which monitors do not know".to_owned();
        at("condition", require(!condition.reads_scene(), alone))?;
        at("condition", proposition(condition, inputs))
    }

    fn sound_input(&self, input: &Input) -> Checked {
        at("field", self.field(&input.field))?;
        let members = self.topic(input.field.topic).paths.len();
        at("members", input.only().map_or(Ok(()), |only| id("member", only as usize, members)))?;
        at("memory", sound_memory(input, members))
    }

    /// Inputs that are of a pair are of pairs of one group, or of one group and another, and no others are of each
    /// member.
    fn one_pair(&self, inputs: &[Input]) -> Checked {
        let [mut first, mut second] = [Members::First, Members::Second].map(|side| {
            let of_side = inputs.iter().filter(move |input| input.members == side);
            of_side.map(|input| input.field.topic)
        });
        let (one, other) = match (first.next(), second.next()) {
            (None, None) => return Ok(()),
            (one, other) => {
                let group = one.or(other).expect("there is one of them");
                (one.unwrap_or(group), other.unwrap_or(group))
            }
        };
        let several = first.any(|topic| topic != one)
            || second.any(|topic| topic != other)
            || inputs.iter().any(|input| input.members == Members::Each);
        require(!several, || "members of more than one group are to be paired".to_owned())?;
        let members = self.topic(one).paths.len();
        require(members >= 2 || one != other, || format!("there is no pair in a group of {members}"))
    }
}

/// What an input remembers is of single values: those of an integral change between messages, so that of several the
/// least is not always the least, and elements of a list are others in each message.
fn sound_memory(input: &Input, members: usize) -> Checked {
    let Some((last, before)) = input.memory.split_last() else { return Ok(()) };
    let each = input.list.as_ref().is_some_and(|list| list.reduction == Reduction::Each);
    require(!each, || "is of each element of a list".to_owned())?;
    for memory in &input.memory {
        if let Memory::Unwrapped { turn } = memory {
            positive(turn.0)?;
        }
    }
    require(input.text.is_none() || input.memory.iter().all(|of| *of == Memory::Previous), || {
        "a text has no rate and no integral".to_owned()
    })?;
    require(!before.contains(&Memory::Integral), || "more is computed from an integral".to_owned())?;
    let joined = members > 1 && matches!(input.members, Members::Min | Members::Max | Members::Sum);
    require(*last != Memory::Integral || !joined, || "an integral is of several members".to_owned())?;
    require(input.memory.len() <= Input::DEEPEST_MEMORY, || format!("{} are nested", input.memory.len()))
}

/// An input that is read as it is.
fn value(index: u32, inputs: &[Input]) -> Checked {
    id("input", index as usize, inputs.len())?;
    require(!inputs[index as usize].is_integral(), || format!("input {index} is an integral, and is read as a value"))
}

fn expression(of: &Expression, inputs: &[Input]) -> Checked {
    let input = |index: u32| value(index, inputs);
    for point in of.points() {
        match point {
            Point::Input(index) => input(index)?,
            Point::Constant(coordinates) => coordinates.into_iter().try_for_each(finite)?,
        }
    }
    match of {
        Expression::Constant(number) => finite(*number)?,
        Expression::Input(index) => input(*index)?,
        Expression::Integral(index) => {
            id("input", *index as usize, inputs.len())?;
            require(inputs[*index as usize].is_integral(), || format!("input {index} is not an integral"))?;
        }
        Expression::Min(of) | Expression::Max(of) => filled(of)?,
        Expression::Distance(distance) => finite(distance.scale)?,
        Expression::Scene { operation: _, usual } => finite(*usual)?,
        Expression::SignedDistance(distance) => region(&distance.to)?,
        _ => {}
    }
    of.parts().into_iter().try_for_each(|part| expression(part, inputs))
}

fn region(of: &Region) -> Checked {
    match of {
        Region::Box { low, high } => {
            low.iter().chain(high).try_for_each(|&end| finite(end))?;
            let flat = low.iter().zip(high).any(|(low, high)| low >= high);
            require(!flat, || "a box has no inside".to_owned())
        }
        Region::Polygon { corners } => {
            corners.iter().flatten().try_for_each(|&coordinate| finite(coordinate))?;
            require(corners.len() >= 3, || format!("a polygon has {} corners", corners.len()))
        }
    }
}

fn proposition(of: &crate::formula::Condition, inputs: &[Input]) -> Checked {
    use crate::formula::Condition;
    match of {
        Condition::Constant(_) => Ok(()),
        Condition::Input(index) => value(*index, inputs),
        Condition::Compare { left, right, by: _ } => {
            expression(left, inputs)?;
            expression(right, inputs)
        }
        Condition::Same { left, right } => {
            proposition(left, inputs)?;
            proposition(right, inputs)
        }
        Condition::All(of) | Condition::Any(of) => of.iter().try_for_each(|of| proposition(of, inputs)),
        Condition::Not(of) => proposition(of, inputs),
    }
}

fn temporal(formula: &stl::Formula, signals: usize) -> Checked {
    use stl::Formula;
    match formula {
        Formula::Predicate { signal, constant, comparison: _ } => {
            id("signal", *signal as usize, signals)?;
            finite(*constant)
        }
        Formula::Not { of } => temporal(of, signals),
        Formula::And { left, right } | Formula::Or { left, right } | Formula::Implies { left, right } => {
            temporal(left, signals)?;
            temporal(right, signals)
        }
        Formula::Always { interval: within, of } | Formula::Eventually { interval: within, of } => {
            interval(*within)?;
            temporal(of, signals)
        }
        Formula::Until { interval: within, left, right, weak: _ } => {
            interval(*within)?;
            temporal(left, signals)?;
            temporal(right, signals)
        }
    }
}

fn interval(interval: stl::Interval) -> Checked {
    span(Span { start: interval.from, end: interval.to.unwrap_or(interval.from) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{FieldRef, InList, TextTest, TopicId};

    fn remembering(memory: &[Memory], members: Members) -> Input {
        let field = FieldRef { topic: TopicId(0), path: Vec::new() };
        Input { field, members, list: None, text: None, memory: memory.to_vec() }
    }

    #[test]
    fn what_is_remembered_is_of_single_values_and_an_integral_is_the_last_of_it() {
        use Memory::{Integral, Previous, Rate};
        let sound = |memory: &[Memory], members| sound_memory(&remembering(memory, members), 2).is_ok();
        assert!(sound(&[Previous, Rate, Rate], Members::Max));
        assert!(sound(&[Rate, Integral], Members::Each));
        assert!(sound(&[Integral], Members::Only(1)));
        assert!(!sound(&[Integral], Members::Max));
        assert!(!sound(&[Integral, Rate], Members::Each));
        assert!(!sound(&[Rate; Input::DEEPEST_MEMORY + 1], Members::Each));
        let list = Some(InList { steps: Vec::new(), reduction: Reduction::Each });
        assert!(sound_memory(&Input { list, ..remembering(&[Rate], Members::Min) }, 1).is_err());
        let text = Some(TextTest::Is("a".to_owned()));
        assert!(sound_memory(&Input { text: text.clone(), ..remembering(&[Previous], Members::Min) }, 1).is_ok());
        assert!(sound_memory(&Input { text, ..remembering(&[Rate], Members::Min) }, 1).is_err());
    }

    #[test]
    fn an_integral_is_read_as_one_and_nothing_else_is() {
        let inputs = [remembering(&[Memory::Integral], Members::Each), remembering(&[Memory::Rate], Members::Each)];
        let sound = |of: Expression| expression(&of, &inputs).is_ok();
        assert!(sound(Expression::Integral(0)) && sound(Expression::Input(1)));
        assert!(!sound(Expression::Integral(1)) && !sound(Expression::Input(0)) && !sound(Expression::Integral(2)));
    }

    #[test]
    fn the_usual_value_of_a_scene_is_a_number() {
        let sound = |usual| expression(&Expression::Scene { operation: "start_x".to_owned(), usual }, &[]).is_ok();
        assert!(sound(-1.5));
        assert!(!sound(f64::NAN) && !sound(f64::INFINITY));
    }
}
