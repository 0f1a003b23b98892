//! The values of a message that an operation changes.

use sesame_plan::{Step, Turn, ValuePath};

use crate::angle::wrapped;
use crate::elements::{self, Found, chosen, positions};
use crate::fuzz::action::{Action, OnWire};
use crate::fuzz::change::map;
use crate::value::Value;

/// How many random numbers each value of a message may use.
const DRAWS_PER_VALUE: u64 = 8;

/// The places of an operation in messages of each of its topics.
#[derive(Debug, Clone)]
pub struct Places {
    of_each: Vec<Vec<ValuePath>>,
    /// The turn in which changed numbers stay, which are angles.
    turn: Option<Turn>,
}

impl Places {
    /// The places in messages of each topic, or whole messages where the list is empty.
    pub fn new<'a>(of_each: impl IntoIterator<Item = &'a [ValuePath]>) -> Self {
        let places = |places: &[ValuePath]| if places.is_empty() { vec![Vec::new()] } else { places.to_vec() };
        Places { of_each: of_each.into_iter().map(places).collect(), turn: None }
    }

    /// The same places, where numbers are angles that stay within this turn when they are changed.
    pub fn within(self, turn: Option<Turn>) -> Self {
        Places { turn, ..self }
    }

    fn of(&self, on: OnWire) -> &[ValuePath] {
        self.of_each.get(on.target).map_or(&[], Vec::as_slice)
    }

    /// Visits the values at these places in order, and returns what was done with the message. `change` returns whether
    /// it changed the value; it also gets the number of the value's first random number. This number only depends on
    /// the place and on the position in its list, so other places and longer lists do not shift it.
    ///
    /// Parts that a message does not have are skipped: elements beyond the end of a list, and values that are not of
    /// their declared type.
    pub fn change(&self, on: OnWire, message: &mut Value, mut change: impl FnMut(&mut Value, u64) -> bool) -> Action {
        let mut changed = false;
        let mut change = |value: &mut Value, draw: u64| match self.turn {
            None => change(value, draw),
            Some(turn) => {
                let before = value.clone();
                change(value, draw) && {
                    map(value, |_, angle| wrapped(angle, turn.low, turn.high - turn.low));
                    !value.is_same(&before)
                }
            }
        };
        for (at, place) in (0u64..).zip(self.of(on)) {
            let mut next = (at << 32) * DRAWS_PER_VALUE;
            changed |= visit(message, place, &mut next, &mut change);
        }
        if changed { Action::Changed } else { Action::Unchanged }
    }

    /// Stores the values at these places and discards those stored before.
    pub fn remember(&self, on: OnWire, message: &Value, memory: &mut Memory) {
        memory.0.clear();
        for (at, place) in (0u64..).zip(self.of(on)) {
            let mut next = (at << 32) * DRAWS_PER_VALUE;
            collect(message, place, &mut next, memory);
        }
    }

    /// Restores stored values to their places; elements that the list did not have before are left unchanged.
    pub fn recall(&self, on: OnWire, message: &mut Value, memory: &Memory) -> Action {
        let mut remembered = memory.0.iter().peekable();
        self.change(on, message, |value, at| {
            while remembered.next_if(|(before, _)| *before < at).is_some() {}
            match remembered.next_if(|(same, _)| *same == at) {
                Some((_, old)) if !value.is_same(old) => {
                    value.clone_from(old);
                    true
                }
                _ => false,
            }
        })
    }
}

/// The values at an operation's places in one message, by the numbers of their random numbers.
#[derive(Debug, Clone, Default)]
pub struct Memory(Vec<(u64, Value)>);

fn visit(value: &mut Value, path: &[Step], next: &mut u64, change: &mut impl FnMut(&mut Value, u64) -> bool) -> bool {
    let Some((step, rest)) = path.split_first() else {
        let draw = *next;
        *next += DRAWS_PER_VALUE;
        return change(value, draw);
    };
    match (step, value) {
        (Step::Field(name), Value::Record(record)) => match (rest, record.get(name)) {
            // Which elements a filter chooses may depend on another list of the record.
            ([filter @ Step::Filter(_), inner @ ..], Some(Value::List(items))) => {
                let chosen: Vec<usize> = chosen(filter, items, Some(record)).collect();
                let Some(Value::List(items)) = record.get_mut(name) else { return false };
                chosen.iter().fold(false, |changed, &at| visit(&mut items[at], inner, next, change) | changed)
            }
            _ => record.get_mut(name).is_some_and(|field| visit(field, rest, next, change)),
        },
        (filter @ Step::Filter(_), Value::List(items)) => {
            let chosen: Vec<usize> = chosen(filter, items, None).collect();
            chosen.iter().fold(false, |changed, &at| visit(&mut items[at], rest, next, change) | changed)
        }
        (step, Value::List(items)) => {
            let positions = positions(step, items.len());
            items[positions].iter_mut().fold(false, |changed, item| visit(item, rest, next, change) | changed)
        }
        _ => false,
    }
}

fn collect(value: &Value, path: &[Step], next: &mut u64, memory: &mut Memory) {
    elements::visit(value, None, path, &mut |found| {
        // A path to what an operation changes does not end at a coordinate.
        if let Found::Value(value) = found {
            memory.0.push((*next, value.clone()));
            *next += DRAWS_PER_VALUE;
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fuzz::change::add;

    /// What a value becomes, and whether it was changed, if this is added to it within a turn from 0 to 360.
    fn added(by: f64, to: impl Into<Value>) -> (Value, bool) {
        let mut value = to.into();
        let places = Places::new([&[][..]]).within(Some(Turn { low: 0.0, high: 360.0 }));
        let on = OnWire { member: 0, target: 0 };
        let action = places.change(on, &mut value, |value, _| add(value, |_| by));
        (value, matches!(action, Action::Changed))
    }

    #[test]
    fn angles_stay_within_their_turn_and_whole_turns_change_nothing() {
        assert_eq!(added(20.0, Value::Real(350.0)), (Value::Real(10.0), true));
        assert_eq!(added(-20.0, Value::Int(10)), (Value::Int(350), true));
        assert_eq!(added(720.0, Value::Real(5.0)), (Value::Real(5.0), false));
        assert_eq!(added(0.0, Value::Real(-90.0)), (Value::Real(-90.0), false), "as it came");
    }
}
