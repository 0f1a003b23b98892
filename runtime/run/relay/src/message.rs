//! Conversion between dynamic payloads and the typed messages of generated code.

use sesame_plan::{CampaignPlan, Type};

use crate::value::{Fields, Record, Text, Value};

/// A type as which generated code and hooks read a payload.
pub trait FromValue: Sized {
    /// Reads the payload; the mismatch gives the place and the reason.
    fn from_value(value: &Value) -> Result<Self, Mismatch>;
}

/// A payload that is not of its declared type.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}expected {expected}, found {found}", at(path))]
pub struct Mismatch {
    /// Field names from the message inwards.
    pub path: Vec<String>,
    /// The declared type.
    pub expected: &'static str,
    /// The kind of value that came.
    pub found: &'static str,
}

fn at(path: &[String]) -> String {
    if path.is_empty() { String::new() } else { format!("field `{}`: ", path.join(".")) }
}

impl Mismatch {
    /// A mismatch of the value itself.
    pub fn new(expected: &'static str, value: &Value) -> Self {
        Mismatch { path: Vec::new(), expected, found: value.kind() }
    }

    /// A missing field.
    pub fn missing(name: &str) -> Self {
        Mismatch { path: vec![name.to_owned()], expected: "a value", found: "nothing" }
    }

    /// The same mismatch, inside of a message or list.
    pub fn inside(mut self, name: &str) -> Self {
        self.path.insert(0, name.to_owned());
        self
    }
}

/// Whether a payload is of a declared type. A message may have more fields than declared, and lack optional ones.
pub fn fits(plan: &CampaignPlan, ty: &Type, value: &Value) -> Result<(), Mismatch> {
    match ty {
        Type::Bool => bool::from_value(value).map(drop),
        Type::Int { .. } => i64::from_value(value).map(drop),
        Type::Real { .. } => f64::from_value(value).map(drop),
        Type::Text => Text::from_value(value).map(drop),
        Type::Point { .. } => <[f64; 3]>::from_value(value).map(drop),
        Type::List { of } => {
            let Value::List(items) = value else { return Err(Mismatch::new("list", value)) };
            items
                .iter()
                .enumerate()
                .try_for_each(|(at, item)| fits(plan, of, item).map_err(|m| m.inside(&format!("[{at}]"))))
        }
        Type::Message { id } => {
            let Value::Record(record) = value else { return Err(Mismatch::new("message", value)) };
            plan.message(*id).fields.iter().try_for_each(|field| {
                let value = match record.get(&field.name) {
                    None | Some(Value::Undeclared(_)) if field.optional => return Ok(()),
                    None => return Err(Mismatch::missing(&field.name)),
                    Some(value) => value,
                };
                fits(plan, &field.ty, value).map_err(|mismatch| mismatch.inside(&field.name))
            })
        }
    }
}

/// A field of a message, read as its declared type.
pub fn field<T: FromValue>(message: &Value, name: &str) -> Result<T, Mismatch> {
    let Value::Record(record) = message else { return Err(Mismatch::new("message", message)) };
    match record.get(name) {
        Some(value) => T::from_value(value).map_err(|mismatch| mismatch.inside(name)),
        None => Err(Mismatch::missing(name)),
    }
}

/// An optional field of a message: `None` if the message lacks it, or has `null` in its place.
pub fn optional_field<T: FromValue>(message: &Value, name: &str) -> Result<Option<T>, Mismatch> {
    match message {
        Value::Record(record) if record.get(name).is_none() => Ok(None),
        _ => field(message, name),
    }
}

impl<T: FromValue> FromValue for Option<T> {
    /// `null` is `None`.
    fn from_value(value: &Value) -> Result<Self, Mismatch> {
        match value {
            Value::Undeclared(_) => Ok(None),
            value => T::from_value(value).map(Some),
        }
    }
}

impl<T: ToValue> ToValue for Option<T> {
    fn to_value(&self) -> Value {
        self.as_ref().map_or_else(null, ToValue::to_value)
    }
    fn write_to(&self, value: &mut Value) -> bool {
        match (self, &value) {
            (None, Value::Undeclared(_)) => false,
            (Some(new), old) if !matches!(old, Value::Undeclared(_)) => new.write_to(value),
            (new, _) => replace(value, false, || new.to_value()),
        }
    }
}

/// What stands in JSON in the place of an optional value that is not there.
fn null() -> Value {
    Value::Undeclared(Text::from("null"))
}

impl FromValue for f64 {
    /// A whole number is a real number too: JSON does not distinguish them.
    fn from_value(value: &Value) -> Result<Self, Mismatch> {
        match value {
            Value::Real(x) => Ok(*x),
            Value::Int(n) => Ok(*n as f64),
            _ => Err(Mismatch::new("real", value)),
        }
    }
}

impl FromValue for i64 {
    fn from_value(value: &Value) -> Result<Self, Mismatch> {
        match value {
            Value::Int(n) => Ok(*n),
            _ => Err(Mismatch::new("int", value)),
        }
    }
}

impl FromValue for bool {
    fn from_value(value: &Value) -> Result<Self, Mismatch> {
        match value {
            Value::Bool(b) => Ok(*b),
            _ => Err(Mismatch::new("bool", value)),
        }
    }
}

impl FromValue for Text {
    fn from_value(value: &Value) -> Result<Self, Mismatch> {
        match value {
            Value::Text(text) => Ok(text.clone()),
            _ => Err(Mismatch::new("text", value)),
        }
    }
}

impl FromValue for [f64; 3] {
    fn from_value(value: &Value) -> Result<Self, Mismatch> {
        match value {
            Value::Point(point) => Ok(*point),
            _ => Err(Mismatch::new("point", value)),
        }
    }
}

impl<T: FromValue> FromValue for Vec<T> {
    fn from_value(value: &Value) -> Result<Self, Mismatch> {
        let Value::List(items) = value else { return Err(Mismatch::new("list", value)) };
        items
            .iter()
            .enumerate()
            .map(|(at, item)| T::from_value(item).map_err(|mismatch| mismatch.inside(&format!("[{at}]"))))
            .collect()
    }
}

/// A type from which generated code and hooks create payloads.
pub trait ToValue {
    /// A new payload.
    fn to_value(&self) -> Value;

    /// Writes this into a payload from which it was read, and returns whether this changed anything. Parts that the
    /// declared type does not know stay: further fields of a message, and that a number was written as a whole number.
    fn write_to(&self, value: &mut Value) -> bool;
}

/// A message of these fields, in order.
pub fn record(fields: &[(&str, Value)]) -> Value {
    let names = Fields::new(fields.iter().map(|(name, _)| *name));
    Record::new(&names, fields.iter().map(|(_, value)| value.clone()).collect()).into()
}

/// Writes a field of a message into a payload, as [`ToValue::write_to`] does.
pub fn write_field(message: &mut Value, name: &str, field: &impl ToValue) -> bool {
    match message {
        Value::Record(record) => record.get_mut(name).is_some_and(|value| field.write_to(value)),
        _ => false,
    }
}

fn replace(value: &mut Value, same: bool, new: impl FnOnce() -> Value) -> bool {
    if !same {
        *value = new();
    }
    !same
}

impl ToValue for f64 {
    fn to_value(&self) -> Value {
        Value::Real(*self)
    }
    /// Numbers are compared by their bits: a NaN that was not replaced is unchanged.
    fn write_to(&self, value: &mut Value) -> bool {
        let same = f64::from_value(value).is_ok_and(|old| old.to_bits() == self.to_bits());
        replace(value, same, || self.to_value())
    }
}

impl ToValue for i64 {
    fn to_value(&self) -> Value {
        Value::Int(*self)
    }
    fn write_to(&self, value: &mut Value) -> bool {
        let same = matches!(value, Value::Int(old) if old == self);
        replace(value, same, || self.to_value())
    }
}

impl ToValue for bool {
    fn to_value(&self) -> Value {
        Value::Bool(*self)
    }
    fn write_to(&self, value: &mut Value) -> bool {
        let same = matches!(value, Value::Bool(old) if old == self);
        replace(value, same, || self.to_value())
    }
}

impl ToValue for Text {
    fn to_value(&self) -> Value {
        Value::Text(self.clone())
    }
    fn write_to(&self, value: &mut Value) -> bool {
        let same = matches!(value, Value::Text(old) if old == self);
        replace(value, same, || self.to_value())
    }
}

impl ToValue for [f64; 3] {
    fn to_value(&self) -> Value {
        Value::Point(*self)
    }
    fn write_to(&self, value: &mut Value) -> bool {
        let same = matches!(value, Value::Point(old) if old.map(f64::to_bits) == self.map(f64::to_bits));
        replace(value, same, || self.to_value())
    }
}

impl<T: ToValue> ToValue for Vec<T> {
    fn to_value(&self) -> Value {
        Value::List(self.iter().map(T::to_value).collect())
    }
    fn write_to(&self, value: &mut Value) -> bool {
        let Value::List(items) = value else { return replace(value, false, || self.to_value()) };
        let mut changed = items.len() != self.len();
        items.truncate(self.len());
        for (item, new) in items.iter_mut().zip(self) {
            changed |= new.write_to(item);
        }
        let kept = items.len();
        items.extend(self[kept..].iter().map(T::to_value));
        changed
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn what_the_declared_type_does_not_know_of_stays() {
        let mut message = record(&[("level", Value::Int(3)), ("more", Value::Bool(true))]);
        assert!(!write_field(&mut message, "level", &3.0), "3 and 3.0 are one number in JSON");
        assert_eq!(message, record(&[("level", Value::Int(3)), ("more", Value::Bool(true))]));
        assert!(write_field(&mut message, "level", &3.5));
        assert_eq!(message, record(&[("level", Value::Real(3.5)), ("more", Value::Bool(true))]));
        let mut nan = Value::Real(f64::NAN);
        assert!(!f64::NAN.write_to(&mut nan), "a NaN that is left alone is unchanged");
    }

    proptest! {
        #[test]
        fn a_list_written_back_is_the_list_and_changed_exactly_if_it_differs(
            before in proptest::collection::vec(-3i64..3, 0..5), after in proptest::collection::vec(-3i64..3, 0..5),
        ) {
            let mut value = before.to_value();
            prop_assert_eq!(after.write_to(&mut value), before != after);
            prop_assert_eq!(Vec::<i64>::from_value(&value), Ok(after));
        }
    }
}
