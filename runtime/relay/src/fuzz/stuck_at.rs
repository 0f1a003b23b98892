//! Stuck-at: a value is one and the same, whatever it was.

use crate::fuzz::change::{Amount, map, put};
use crate::fuzz::{Action, Places};
use crate::value::{Text, Value};

/// A stuck-at operation.
#[derive(Debug, Clone)]
pub struct StuckAt {
    /// What is replaced.
    pub places: Places,
    /// By what.
    pub at: Stuck,
}

/// What values are stuck at.
#[derive(Debug, Clone, PartialEq)]
pub enum Stuck {
    /// A number, or a point.
    Amount(Amount),
    /// A text.
    Text(Text),
    /// A truth value.
    Truth(bool),
}

impl StuckAt {
    /// Replaces the values, where the message has them as the space says.
    pub fn apply(&self, message: &mut Value) -> Action {
        self.places.change(message, |value, _| match (&self.at, value) {
            (Stuck::Amount(amount), value) => map(value, |axis, _| amount.on(axis)),
            (Stuck::Text(at), Value::Text(text)) => put(text, at.clone()),
            (Stuck::Truth(at), Value::Bool(truth)) => put(truth, *at),
            _ => false,
        })
    }
}
