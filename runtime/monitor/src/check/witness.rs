//! Values of inputs under which something happens, checked by computing the conditions with them.

use std::collections::BTreeMap;

use sesame_base::differences::Bound;
use sesame_plan::{Condition, Evidence, TextTest};

use super::arithmetic::number;
use super::atoms::{Atoms, Known};
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

/// Values for all inputs about which the search found something, or anything else where it did not matter.
pub(super) fn values(atoms: &Atoms, found: &[Option<bool>], mut theory: Theory) -> Option<BTreeMap<usize, Value>> {
    let mut values = BTreeMap::new();
    for (&input, &term) in &atoms.input_terms {
        let number = choose(theory.bounds(term), atoms.terms[term].whole)?;
        // What the others can be depends on it.
        let fits = theory.add(Comparison::AtMost(term, number), true)
            && theory.add(
                Comparison::AtMost(term, if atoms.terms[term].whole { number - 1.0 } else { number.next_down() }),
                false,
            );
        fits.then_some(())?;
        values.insert(input, Value::Number(number));
    }
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

/// A number between bounds: 0, else a whole one, else one at a bound, else one between.
fn choose((least, most): (Bound, Bound), whole: bool) -> Option<f64> {
    let low = -least.most;
    let high = most.most;
    let fits = |number: f64| {
        let above = if least.below { number > low } else { number >= low };
        let below = if most.below { number < high } else { number <= high };
        above && below && number.is_finite() && (!whole || number.floor() == number)
    };
    let (low_next, high_next) = (low.next_up(), high.next_down());
    let between = f64::midpoint(low, high);
    let numbers =
        [0.0, low.ceil(), low.floor() + 1.0, high.floor(), high.ceil() - 1.0, low, high, between, low_next, high_next];
    numbers.into_iter().find(|&number| fits(number)).map(|number| if number == 0.0 { 0.0 } else { number })
}

/// The truth of the condition of evidence under values of inputs, by what [`Atoms`] calls them; unknown if it needs what
/// is not known.
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

/// The value that conditions may rely on: none for an input whose value proves nothing.
pub(super) fn reliable(known: &Known, value: Option<&Value>) -> Option<Value> {
    value.filter(|_| !known.loose).cloned()
}
