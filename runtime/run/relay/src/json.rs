//! Payloads as JSON, by the types that the space declares.
//!
//! Reals and whole numbers are numbers, points are `[x, y, z]`, messages are objects. JSON has neither NaN nor
//! infinity: instead of a real they are the strings `"NaN"`, `"Infinity"` and `"-Infinity"`. Parts that the space does
//! not declare are kept byte for byte.

#[cfg(feature = "process")]
mod codec;
#[cfg(any(feature = "process", feature = "recordings"))]
mod declared;

use std::io::Write as _;

use crate::message::Mismatch;
use crate::value::Value;

#[cfg(feature = "process")]
pub use codec::Codec;
#[cfg(any(feature = "process", feature = "recordings"))]
pub use declared::{Shapes, decode};

/// The largest whole number up to which JSON's reals are exact.
const EXACT: f64 = 9_007_199_254_740_992.0;

pub(crate) fn real(text: &str) -> Result<f64, Mismatch> {
    match text {
        "\"NaN\"" => Ok(f64::NAN),
        "\"Infinity\"" => Ok(f64::INFINITY),
        "\"-Infinity\"" => Ok(f64::NEG_INFINITY),
        _ => serde_json::from_str(text).map_err(|_| mismatch("real", text)),
    }
}

/// A whole number in any notation: some languages have no other numbers than reals.
pub(crate) fn int(text: &str) -> Result<i64, Mismatch> {
    if let Ok(whole) = serde_json::from_str(text) {
        return Ok(whole);
    }
    match serde_json::from_str::<f64>(text) {
        #[expect(clippy::cast_possible_truncation, reason = "it is whole and within the exact range")]
        Ok(number) if number.fract() == 0.0 && number.abs() <= EXACT => Ok(number as i64),
        _ => Err(mismatch("int", text)),
    }
}

fn mismatch(expected: &'static str, text: &str) -> Mismatch {
    let found = match text.as_bytes().first() {
        Some(b'"') => "text",
        Some(b'{') => "an object",
        Some(b'[') if expected == "point" => "a list that is not [x, y, z]",
        Some(b'[') => "a list",
        Some(b't' | b'f') => "bool",
        Some(b'n') => "null",
        _ if expected == "int" && text.contains(['.', 'e', 'E']) => "a number that is not whole",
        _ if expected == "int" || expected == "real" => "a number that is too large",
        _ => "a number",
    };
    Mismatch { path: Vec::new(), expected, found }
}

/// Writes a payload.
pub fn encode(value: &Value, out: &mut Vec<u8>) {
    match value {
        Value::Bool(b) => out.extend_from_slice(if *b { b"true" } else { b"false" }),
        Value::Int(n) => write!(out, "{n}").expect("memory takes all that is written"),
        Value::Real(x) => number(*x, out),
        Value::Text(text) => quoted(text, out),
        Value::Point(axes) => row(axes, out, |axis, out| number(*axis, out)),
        Value::List(items) => row(items, out, encode),
        Value::Record(record) => {
            out.push(b'{');
            for (at, (name, value)) in record.iter().enumerate() {
                if at > 0 {
                    out.push(b',');
                }
                quoted(name, out);
                out.push(b':');
                encode(value, out);
            }
            out.push(b'}');
        }
        Value::Undeclared(text) => out.extend_from_slice(text.as_bytes()),
        // What is not JSON is written as a text: a trace has JSON only.
        Value::Opaque(bytes) => match serde_json::from_slice::<serde::de::IgnoredAny>(bytes) {
            Ok(_) => out.extend_from_slice(bytes),
            Err(_) => quoted(&String::from_utf8_lossy(bytes), out),
        },
    }
}

fn row<T>(items: &[T], out: &mut Vec<u8>, each: fn(&T, &mut Vec<u8>)) {
    out.push(b'[');
    for (at, item) in items.iter().enumerate() {
        if at > 0 {
            out.push(b',');
        }
        each(item, out);
    }
    out.push(b']');
}

/// Writes a real number, or the string that represents it.
pub fn number(x: f64, out: &mut Vec<u8>) {
    if x.is_finite() {
        serde_json::to_writer(out, &x).expect("memory takes all that is written");
    } else {
        let name: &[u8] = if x.is_nan() {
            b"\"NaN\""
        } else if x > 0.0 {
            b"\"Infinity\""
        } else {
            b"\"-Infinity\""
        };
        out.extend_from_slice(name);
    }
}

/// Writes a string in quotes.
pub fn quoted(text: &str, out: &mut Vec<u8>) {
    serde_json::to_writer(out, text).expect("memory takes all that is written");
}
