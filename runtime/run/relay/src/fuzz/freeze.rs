//! Freeze: repeats the last values from before the operation became active.

use crate::fuzz::action::{Action, OnWire};
use crate::fuzz::per_wire::PerWire;
use crate::fuzz::places::{Memory, Places};
use crate::value::Value;

/// A freeze operation.
#[derive(Debug)]
pub struct Freeze {
    places: Places,
    last: PerWire<Option<Memory>>,
}

impl Freeze {
    /// A freeze of the values at these places.
    pub fn new(places: Places) -> Self {
        Freeze { places, last: PerWire::default() }
    }

    /// A message passes while the operation is inactive.
    pub fn observe(&mut self, on: OnWire, message: &Value) {
        self.places.remember(on, message, self.last.entry(on.member).get_or_insert_default());
    }

    /// Replaces the values by the frozen ones. If no message passed before, the values of this one are frozen.
    pub fn apply(&mut self, on: OnWire, message: &mut Value) -> Action {
        if let Some(memory) = self.last.entry(on.member) {
            return self.places.recall(on, message, memory);
        }
        self.observe(on, message);
        Action::Unchanged
    }
}
