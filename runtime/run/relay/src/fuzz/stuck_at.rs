//! Stuck-at: replaces a value by a constant.

use crate::fuzz::action::{Action, MessageContext};
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

impl Stuck {
    /// Puts it in the place of a value of its type; whether that changes it.
    pub(super) fn put(&self, value: &mut Value) -> bool {
        match (self, value) {
            (Stuck::Amount(amount), value) => map(value, |axis, _| amount.on(axis)),
            (Stuck::Text(constant), Value::Text(text)) => put(text, constant.clone()),
            (Stuck::Truth(constant), Value::Bool(truth)) => put(truth, *constant),
            _ => false,
        }
    }
}

impl StuckAt {
    /// Replaces the values that the message has as declared.
    pub fn apply(&self, at: MessageContext, message: &mut Value) -> Action {
        self.places.change(at.on, message, |value, _| self.at.put(value))
    }
}
