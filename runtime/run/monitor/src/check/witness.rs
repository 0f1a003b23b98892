//! Values of inputs under which something happens, checked by computing the conditions with them.

use std::collections::BTreeMap;

use sesame_base::differences::Bound;
use sesame_plan::{Condition, Evidence, TextTest};

use super::arithmetic::number;
use super::atoms::Atoms;
use super::theory::{Comparison, Theory};
use crate::truth::{Truth, at_least};

/// The value of an input.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// A number.
    Number(f64),
    /// True or false.
    Flag(bool),
    /// A text; one that no condition mentions stands for any such.
    Text(String),
}

/// Values for all inputs about which the search found something, or anything else where it did not matter. `None` if
/// none were found: numbers that are apart in theory may have no number of floating point between them.
pub(super) fn values(atoms: &Atoms, found: &[Option<bool>], theory: &Theory) -> Option<BTreeMap<usize, Value>> {
    // Numbers amid others leave room for those that are chosen after them; numbers at bounds are the last resort.
    let mut values = [true, false].into_iter().find_map(|amid| numbers(atoms, theory.clone(), amid))?;
    for (&input, flag) in &atoms.flags {
        values.insert(input, Value::Flag(found[flag.node()].unwrap_or(false) == flag.is_positive()));
    }
    for (&input, texts) in &atoms.texts {
        let is = texts.iter().find(|(_, literal)| found[literal.node()] == Some(literal.is_positive()));
        let mut text = is.map_or("other", |(text, _)| text).to_owned();
        while is.is_none() && texts.contains_key(&text) {
            text.push('_');
        }
        values.insert(input, Value::Text(text));
    }
    Some(values)
}

/// Numbers for all inputs that are numbers, chosen one after another.
fn numbers(atoms: &Atoms, mut theory: Theory, amid: bool) -> Option<BTreeMap<usize, Value>> {
    let mut numbers = BTreeMap::new();
    for (&input, &term) in &atoms.input_terms {
        let whole = atoms.terms[term].whole;
        let number = choose(theory.bounds(term), whole, amid)?;
        let before = if whole { number - 1.0 } else { number.next_down() };
        // What the others can be depends on it.
        let fits =
            theory.add(Comparison::AtMost(term, number), true) && theory.add(Comparison::AtMost(term, before), false);
        fits.then_some(())?;
        numbers.insert(input, Value::Number(number));
    }
    Some(numbers)
}

/// A number between bounds, simple ones first.
fn choose((least, most): (Bound, Bound), whole: bool, amid: bool) -> Option<f64> {
    let low = -least.most;
    let high = most.most;
    let fits = |number: f64| {
        let above = if least.below { number > low } else { number >= low };
        let below = if most.below { number < high } else { number <= high };
        above && below && number.is_finite() && (!whole || number.floor() == number)
    };
    let between = [0.0, low.floor() + 1.0, high.ceil() - 1.0, f64::midpoint(low, high)];
    let at_bounds =
        [0.0, low.ceil(), high.floor(), low, high, f64::midpoint(low, high), low.next_up(), high.next_down()];
    let inside = between.into_iter().filter(|&number| amid && low < number && number < high);
    inside.chain(at_bounds).find(|&number| fits(number)).map(|number| if number == 0.0 { 0.0 } else { number })
}

/// The truth of the condition of evidence under values of its inputs, by position; unknown if it needs one that is not
/// known.
pub(super) fn truth(of: &Condition, evidence: &Evidence, known: &dyn Fn(u32) -> Option<Value>) -> Truth {
    let of_part = |part: &Condition| truth(part, evidence, known);
    match of {
        Condition::Constant(holds) => Truth::from(*holds),
        Condition::Input(at) => match (known(*at), &evidence.inputs[*at as usize].text) {
            (Some(Value::Flag(holds)), None) => Truth::from(holds),
            (Some(Value::Text(text)), Some(TextTest::Is(wanted))) => Truth::from(text == *wanted),
            (Some(Value::Text(text)), Some(TextTest::IsNot(other))) => Truth::from(text != *other),
            _ => Truth::Unknown,
        },
        Condition::Compare { left, by, right } => {
            let input = |at: u32| match known(at) {
                Some(Value::Number(number)) => Some(number),
                _ => None,
            };
            match (number(left, &input), number(right, &input)) {
                (Some(left), Some(right)) => Truth::from(by.holds(left, right)),
                _ => Truth::Unknown,
            }
        }
        Condition::Same { left, right } => match (of_part(left), of_part(right)) {
            (Truth::Unknown, _) | (_, Truth::Unknown) => Truth::Unknown,
            (left, right) => Truth::from(left == right),
        },
        Condition::All(parts) => at_least(parts.len(), parts.iter().map(of_part)),
        Condition::Any(parts) => at_least(1, parts.iter().map(of_part)),
        Condition::Not(of) => match of_part(of) {
            Truth::True => Truth::False,
            Truth::False => Truth::True,
            Truth::Unknown => Truth::Unknown,
        },
    }
}
