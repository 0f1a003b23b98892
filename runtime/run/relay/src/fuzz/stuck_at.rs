//! Stuck-at: replaces a value by a constant.

use crate::fuzz::action::Action;
use crate::fuzz::change::{Amount, map, put};
use crate::fuzz::places::Places;
use crate::value::{Text, Value};

/// A stuck-at operation.
#[derive(Debug, Clone)]
pub struct StuckAt {
    /// The values to replace.
    pub places: Places,
    /// The constant.
    pub at: Stuck,
}

/// The constant of a stuck-at operation.
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
    /// Replaces the values that the message has as declared.
    pub fn apply(&self, message: &mut Value) -> Action {
        self.places.change(message, |value, _| match (&self.at, value) {
            (Stuck::Amount(amount), value) => map(value, |axis, _| amount.on(axis)),
            (Stuck::Text(at), Value::Text(text)) => put(text, at.clone()),
            (Stuck::Truth(at), Value::Bool(truth)) => put(truth, *at),
            _ => false,
        })
    }
}
