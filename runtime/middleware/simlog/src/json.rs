//! Trees as JSON, which has neither NaN nor infinity: instead of a real they are the strings `"NaN"`, `"Infinity"` and
//! `"-Infinity"`.

use std::borrow::Cow;

use serde_json::{Number, Value};

use crate::tree::Tree;

/// What a text says, if it is JSON.
pub(crate) fn read(text: &str) -> Option<Tree> {
    serde_json::from_str(text).ok().map(of)
}

/// A tree as text.
pub(crate) fn written(tree: &Tree) -> String {
    json(tree).to_string()
}

fn of(json: Value) -> Tree {
    match json {
        Value::Null => Tree::Nothing,
        Value::Bool(truth) => Tree::Bool(truth),
        Value::Number(number) => match number.as_i128() {
            Some(whole) => Tree::Int(whole),
            None => Tree::Real(number.as_f64().unwrap_or(f64::NAN)),
        },
        Value::String(text) => Tree::Text(text),
        Value::Array(items) => Tree::List(items.into_iter().map(of).collect()),
        Value::Object(fields) => {
            Tree::Fields(fields.into_iter().map(|(name, value)| (Cow::Owned(name), of(value))).collect())
        }
    }
}

/// A tree as a value of JSON.
pub(crate) fn json(tree: &Tree) -> Value {
    match tree {
        Tree::Nothing => Value::Null,
        Tree::Bool(truth) => Value::Bool(*truth),
        // Only texts bring whole numbers, and those are of 64 bits.
        Tree::Int(whole) => Number::from_i128(*whole).map_or(Value::Null, Value::Number),
        Tree::Real(x) => match Number::from_f64(*x) {
            Some(number) => Value::Number(number),
            None if x.is_nan() => Value::String("NaN".to_owned()),
            None => Value::String(if *x > 0.0 { "Infinity" } else { "-Infinity" }.to_owned()),
        },
        Tree::Text(text) => Value::String(text.clone()),
        Tree::List(items) => Value::Array(items.iter().map(json).collect()),
        Tree::Fields(fields) => {
            Value::Object(fields.iter().map(|(name, tree)| (name.to_string(), json(tree))).collect())
        }
    }
}
