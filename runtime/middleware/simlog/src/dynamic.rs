//! Payloads of version 3: `google.protobuf.Value`, which is JSON with numbers of 64 bits that may be NaN.

use std::borrow::Cow;

use prost_types::value::Kind;
use prost_types::{ListValue, Struct, Timestamp, Value as Dynamic};
use sesame_relay::message::Mismatch;
use sesame_relay::value::Value;

use crate::expected_type::ExpectedType;
use crate::json;
use crate::proto::v3::{SimlogHeader, SimlogMessage, ValueType};
use crate::tree::Tree;

/// The largest whole number up to which the numbers of the wire are exact.
const EXACT: i128 = 1 << 53;

/// The value of a message.
pub(crate) fn read(expected: &ExpectedType, message: &SimlogMessage) -> Result<Value, Mismatch> {
    message.value.as_ref().map_or(Tree::Nothing, tree).read(expected)
}

/// What a message says, as JSON.
pub(crate) fn payload(message: &SimlogMessage) -> serde_json::Value {
    json::json(&message.value.as_ref().map_or(Tree::Nothing, tree))
}

/// The same message with another value.
pub(crate) fn write(value: &Value, like: &SimlogMessage) -> Result<SimlogMessage, Mismatch> {
    let mut all = like.value.as_ref().map_or(Tree::Nothing, tree);
    all.write(value);
    Ok(SimlogMessage { value: Some(dynamic(&all)?), ..like.clone() })
}

/// A message for a value of which no other message says how it is written.
pub(crate) fn message(value: &Value, now: u64) -> Result<SimlogMessage, Mismatch> {
    let seconds = i64::try_from(now / 1_000_000_000).unwrap_or(i64::MAX);
    let nanos = (now % 1_000_000_000) as i32;
    let header = SimlogHeader { timestamp: Some(Timestamp { seconds, nanos }), ..SimlogHeader::default() };
    let kind = match value {
        Value::Bool(_) => ValueType::Bool,
        Value::Int(_) | Value::Real(_) => ValueType::Number,
        Value::Text(_) | Value::Undeclared(_) | Value::Opaque(_) => ValueType::String,
        Value::Point(_) | Value::List(_) | Value::Record(_) => ValueType::Undefined,
    };
    Ok(SimlogMessage { header: Some(header), r#type: kind.into(), value: Some(dynamic(&Tree::of(value))?) })
}

/// When a message was published, by its own stamp, in nanoseconds.
pub(crate) fn stamp(message: &SimlogMessage) -> Option<u64> {
    let Timestamp { seconds, nanos } = message.header.as_ref()?.timestamp.as_ref()?;
    let (seconds, nanos) = (u64::try_from(*seconds).ok()?, u64::try_from(*nanos).ok()?);
    Some(seconds.saturating_mul(1_000_000_000).saturating_add(nanos))
}

fn tree(value: &Dynamic) -> Tree {
    match &value.kind {
        None | Some(Kind::NullValue(_)) => Tree::Nothing,
        Some(Kind::BoolValue(truth)) => Tree::Bool(*truth),
        Some(Kind::NumberValue(x)) => Tree::Real(*x),
        Some(Kind::StringValue(text)) => Tree::Text(text.clone()),
        Some(Kind::ListValue(list)) => Tree::List(list.values.iter().map(tree).collect()),
        Some(Kind::StructValue(fields)) => {
            Tree::Fields(fields.fields.iter().map(|(name, value)| (Cow::Owned(name.clone()), tree(value))).collect())
        }
    }
}

fn dynamic(tree: &Tree) -> Result<Dynamic, Mismatch> {
    let kind = match tree {
        Tree::Nothing => Kind::NullValue(0),
        Tree::Bool(truth) => Kind::BoolValue(*truth),
        Tree::Int(whole) if whole.abs() <= EXACT => Kind::NumberValue(*whole as f64),
        Tree::Int(_) => {
            let found = "a number that is too large";
            return Err(Mismatch { path: Vec::new(), expected: "an int of 53 bits", found });
        }
        Tree::Real(x) => Kind::NumberValue(*x),
        Tree::Text(text) => Kind::StringValue(text.clone()),
        Tree::List(items) => {
            let items = items.iter().enumerate();
            let values = items.map(|(at, item)| dynamic(item).map_err(|error| error.inside(&format!("[{at}]"))));
            Kind::ListValue(ListValue { values: values.collect::<Result<_, _>>()? })
        }
        Tree::Fields(fields) => {
            let fields = fields.iter().map(|(name, tree)| {
                let value = dynamic(tree).map_err(|mismatch| mismatch.inside(name))?;
                Ok((name.to_string(), value))
            });
            Kind::StructValue(Struct { fields: fields.collect::<Result<_, _>>()? })
        }
    };
    Ok(Dynamic { kind: Some(kind) })
}

#[cfg(test)]
mod tests;
