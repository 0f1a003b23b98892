//! Stale: replaces values by older ones, as a cache that lags behind does.

use std::collections::VecDeque;

use sesame_base::time::SimTime;

use crate::fuzz::action::{Action, HELD_LIMIT, OnWire};
use crate::fuzz::per_wire::PerWire;
use crate::fuzz::places::{Memory, Places};
use crate::value::Value;

/// A stale operation.
#[derive(Debug)]
pub struct Stale {
    places: Places,
    age: SimTime,
    past: PerWire<VecDeque<(SimTime, Memory)>>,
}

impl Stale {
    /// An operation that replaces values by those of this age.
    pub fn new(places: Places, age: SimTime) -> Self {
        Stale { places, age, past: PerWire::default() }
    }

    /// A message passes, whether the operation is active or not.
    ///
    /// Stores the latest values that are old enough, and all newer ones.
    pub fn observe(&mut self, now: SimTime, on: OnWire, message: &Value) {
        let past = self.past.entry(on.member);
        let mut spare = None;
        while past.get(1).is_some_and(|(time, _)| *time + self.age <= now) || past.len() >= HELD_LIMIT {
            spare = past.pop_front();
        }
        let mut memory = spare.map_or_else(Memory::default, |(_, memory)| memory);
        self.places.remember(on, message, &mut memory);
        past.push_back((now, memory));
        // If the age is zero, the new message is old enough itself.
        while past.get(1).is_some_and(|(time, _)| *time + self.age <= now) {
            past.pop_front();
        }
    }

    /// Replaces the values by those of the latest earlier message that is old enough; before there is one, by those of
    /// the first message.
    pub fn apply(&mut self, now: SimTime, on: OnWire, message: &mut Value) -> Action {
        self.observe(now, on, message);
        match self.past.entry(on.member).front() {
            Some((_, memory)) => self.places.recall(on, message, memory),
            None => Action::Unchanged,
        }
    }
}
