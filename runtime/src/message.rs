//! From dynamic payloads to the typed messages of generated code.

use sesame_plan::{CampaignPlan, Type};

use crate::value::{Text, Value};

/// A type that generated code and hooks see a payload as.
pub trait FromValue: Sized {
    /// Reads the payload; a mismatch says where and what.
    fn from_value(value: &Value) -> Result<Self, Mismatch>;
}

/// A payload that is not of its declared type.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}expected {expected}, found {found}", at(path))]
pub struct Mismatch {
    /// Field names from the message inwards.
    pub path: Vec<String>,
    /// What the space declares.
    pub expected: &'static str,
    /// What came.
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

    /// A declared field that is not there.
    pub(crate) fn missing(name: &str) -> Self {
        Mismatch { path: vec![name.to_owned()], expected: "a value", found: "nothing" }
    }

    /// The same, seen from the message or list around it.
    pub(crate) fn inside(mut self, name: &str) -> Self {
        self.path.insert(0, name.to_owned());
        self
    }
}

/// Whether a payload is of a declared type. A message may have more fields than declared, never fewer.
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
                let value = record.get(&field.name).ok_or_else(|| Mismatch::missing(&field.name))?;
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

impl FromValue for f64 {
    /// A whole number is a real number too: JSON does not tell them apart.
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
