//! Freeze: repeats the values that were there last before the operation went on.

use crate::fuzz::places::Memory;
use crate::fuzz::{Action, PerWire, Places};
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

    /// A message passes while the operation is off.
    pub fn observe(&mut self, member: u64, message: &Value) {
        self.places.remember(message, self.last.entry(member).get_or_insert_default());
    }

    /// Puts the frozen values into the message. Where none passed before, its own are those that freeze.
    pub fn apply(&mut self, member: u64, message: &mut Value) -> Action {
        if let Some(memory) = self.last.entry(member) {
            return self.places.recall(message, memory);
        }
        self.observe(member, message);
        Action::Unchanged
    }
}
