//! The payload of a message: a small dynamic value.
//!
//! The relay handles all topics, but only the generated crate knows their types; so payloads are dynamic in the relay,
//! and generated code converts them to typed messages for the user's hooks.

use std::fmt;
use std::ops::Deref;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

/// Text that is cheap to clone. Compares with and dereferences to `str`.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Text(Arc<str>);

impl Text {
    /// The text itself.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl Deref for Text {
    type Target = str;
    fn deref(&self) -> &str {
        &self.0
    }
}

impl From<&str> for Text {
    fn from(text: &str) -> Self {
        Text(Arc::from(text))
    }
}

impl From<String> for Text {
    fn from(text: String) -> Self {
        Text(Arc::from(text))
    }
}

impl PartialEq<str> for Text {
    fn eq(&self, other: &str) -> bool {
        &*self.0 == other
    }
}

impl PartialEq<&str> for Text {
    fn eq(&self, other: &&str) -> bool {
        &*self.0 == *other
    }
}

impl fmt::Display for Text {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl fmt::Debug for Text {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(&*self.0, f)
    }
}

/// The field names shared by all records of one type, so that a record only has its values.
#[derive(Debug, PartialEq, Eq)]
pub struct Fields(Box<[Text]>);

impl Fields {
    /// Names in order.
    pub fn new<'a>(names: impl IntoIterator<Item = &'a str>) -> Arc<Fields> {
        Arc::new(Fields(names.into_iter().map(Text::from).collect()))
    }

    /// The names, in order.
    pub fn names(&self) -> &[Text] {
        &self.0
    }

    /// The position of a name.
    pub fn position(&self, name: &str) -> Option<usize> {
        self.0.iter().position(|field| *field == *name)
    }
}

/// A structured message: named values.
#[derive(Debug, Clone)]
pub struct Record {
    fields: Arc<Fields>,
    values: Vec<Value>,
    origin: Option<Arc<Origin>>,
}

/// Where a record was decoded from. The record may have only some of the fields that are there.
#[derive(Debug)]
pub struct Origin {
    /// The message as it came.
    pub bytes: Arc<[u8]>,
    /// The values of the record's fields as they were decoded.
    pub values: Vec<Value>,
}

/// Records with equal fields and values are equal, wherever they come from.
impl PartialEq for Record {
    fn eq(&self, other: &Self) -> bool {
        self.fields == other.fields && self.values == other.values
    }
}

impl Record {
    /// A record of these fields. There must be a value for each field.
    pub fn new(fields: &Arc<Fields>, values: Vec<Value>) -> Self {
        assert_eq!(fields.names().len(), values.len(), "a record has a value for each of its fields");
        Record { fields: Arc::clone(fields), values, origin: None }
    }

    /// A record that was decoded from a message. There must be a value for each field.
    pub fn decoded(fields: &Arc<Fields>, values: Vec<Value>, bytes: Arc<[u8]>) -> Self {
        let origin = Origin { bytes, values: values.clone() };
        Record { origin: Some(Arc::new(origin)), ..Record::new(fields, values) }
    }

    /// What it was decoded from, if it was.
    pub fn origin(&self) -> Option<&Origin> {
        self.origin.as_deref()
    }

    /// The message that it was decoded from, if no value was changed since, not even the sign of a zero.
    pub fn unchanged(&self) -> Option<&Arc<[u8]>> {
        let origin = self.origin.as_ref()?;
        let same = origin.values.len() == self.values.len()
            && origin.values.iter().zip(&self.values).all(|(before, now)| before.is_same(now));
        same.then_some(&origin.bytes)
    }

    /// Its values, in the order of its fields.
    pub fn values(&self) -> &[Value] {
        &self.values
    }

    /// The names of the fields.
    pub fn fields(&self) -> &Arc<Fields> {
        &self.fields
    }

    /// The value of a field.
    pub fn get(&self, name: &str) -> Option<&Value> {
        self.fields.position(name).map(|at| &self.values[at])
    }

    /// The value of a field, mutable.
    pub fn get_mut(&mut self, name: &str) -> Option<&mut Value> {
        self.fields.position(name).map(|at| &mut self.values[at])
    }

    /// Names and mutable values, in order.
    #[cfg(test)]
    pub(crate) fn each_mut(&mut self) -> impl Iterator<Item = (&str, &mut Value)> {
        self.fields.names().iter().map(Text::as_str).zip(&mut self.values)
    }

    /// Names and values, in order.
    pub fn iter(&self) -> impl Iterator<Item = (&Text, &Value)> {
        self.fields.names().iter().zip(&self.values)
    }
}

/// The payload of a message.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// True or false.
    Bool(bool),
    /// A whole number.
    Int(i64),
    /// A real number, in the unit the topic's type declares.
    Real(f64),
    /// Text.
    Text(Text),
    /// A point in space.
    Point([f64; 3]),
    /// A list.
    List(Vec<Value>),
    /// Named values.
    Record(Record),
    /// A part of a message that the space does not declare, in the format of the wire (JSON, for simulators that are
    /// programs). It is neither read nor changed, and passed on as it came.
    Undeclared(Text),
    /// A whole message that is not of its declared type, as it came. Nothing reads it and no value in it is changed,
    /// but it can be lost, late, repeated or replaced like any other message.
    Opaque(Arc<[u8]>),
}

impl Value {
    /// Whether it is a message that nobody reads.
    pub fn is_opaque(&self) -> bool {
        matches!(self, Value::Opaque(_))
    }

    /// The value at the end of a path of field names. The coordinates of a point are only numbers: see
    /// [`Value::number_at`].
    pub fn at<S: AsRef<str>>(&self, path: &[S]) -> Option<&Value> {
        path.iter().try_fold(self, |value, name| match value {
            Value::Record(record) => record.get(name.as_ref()),
            _ => None,
        })
    }

    /// As [`Value::at`], mutable.
    pub fn at_mut<S: AsRef<str>>(&mut self, path: &[S]) -> Option<&mut Value> {
        path.iter().try_fold(self, |value, name| match value {
            Value::Record(record) => record.get_mut(name.as_ref()),
            _ => None,
        })
    }

    /// The number at the end of a path: a real, a whole number, a truth value as 0 or 1. The path may end with `x`, `y`
    /// or `z` of a point.
    pub fn number_at<S: AsRef<str>>(&self, path: &[S]) -> Option<f64> {
        match self.at(path) {
            Some(value) => value.number(),
            None => self.coordinate_at(path),
        }
    }

    /// This value as a number: a real, a whole number, a truth value as 0 or 1.
    pub(crate) fn number(&self) -> Option<f64> {
        match self {
            Value::Real(x) => Some(*x),
            Value::Int(n) => Some(*n as f64),
            Value::Bool(b) => Some(f64::from(u8::from(*b))),
            _ => None,
        }
    }

    /// The coordinate of a point at the end of a path: `x`, `y` or `z`.
    pub(crate) fn coordinate_at<S: AsRef<str>>(&self, path: &[S]) -> Option<f64> {
        let (coordinate, before) = path.split_last()?;
        let axis = ["x", "y", "z"].iter().position(|axis| *axis == coordinate.as_ref())?;
        match self.at(before)? {
            Value::Point(point) => Some(point[axis]),
            _ => None,
        }
    }

    /// Whether all declared numbers in it are finite.
    pub(crate) fn is_finite(&self) -> bool {
        match self {
            Value::Real(x) => x.is_finite(),
            Value::Point(point) => point.iter().all(|x| x.is_finite()),
            Value::List(items) => items.iter().all(Value::is_finite),
            Value::Record(record) => record.values.iter().all(Value::is_finite),
            Value::Bool(_) | Value::Int(_) | Value::Text(_) | Value::Undeclared(_) | Value::Opaque(_) => true,
        }
    }

    /// Whether it is equal in every bit; so NaNs in the same places are equal.
    pub fn is_same(&self, other: &Value) -> bool {
        let all = |left: &[Value], right: &[Value]| {
            left.len() == right.len() && left.iter().zip(right).all(|(left, right)| left.is_same(right))
        };
        match (self, other) {
            (Value::Real(left), Value::Real(right)) => left.to_bits() == right.to_bits(),
            (Value::Point(left), Value::Point(right)) => left.map(f64::to_bits) == right.map(f64::to_bits),
            (Value::List(left), Value::List(right)) => all(left, right),
            (Value::Record(left), Value::Record(right)) => {
                let origins = [left, right].map(|record| record.origin().map(|origin| &origin.bytes));
                let other_message = matches!(origins, [Some(left), Some(right)] if left != right);
                left.fields == right.fields && all(&left.values, &right.values) && !other_message
            }
            _ => self == other,
        }
    }

    /// The kind of this value, as the language names it.
    pub fn kind(&self) -> &'static str {
        match self {
            Value::Bool(_) => "bool",
            Value::Int(_) => "int",
            Value::Real(_) => "real",
            Value::Text(_) => "text",
            Value::Point(_) => "point",
            Value::List(_) => "list",
            Value::Record(_) => "message",
            Value::Undeclared(_) => "something undeclared",
            Value::Opaque(_) => "something else",
        }
    }
}

impl From<f64> for Value {
    fn from(x: f64) -> Self {
        Value::Real(x)
    }
}
impl From<i64> for Value {
    fn from(n: i64) -> Self {
        Value::Int(n)
    }
}
impl From<bool> for Value {
    fn from(b: bool) -> Self {
        Value::Bool(b)
    }
}
impl From<&str> for Value {
    fn from(text: &str) -> Self {
        Value::Text(text.into())
    }
}
impl From<Text> for Value {
    fn from(text: Text) -> Self {
        Value::Text(text)
    }
}
impl From<[f64; 3]> for Value {
    fn from(point: [f64; 3]) -> Self {
        Value::Point(point)
    }
}
impl From<Record> for Value {
    fn from(record: Record) -> Self {
        Value::Record(record)
    }
}
