//! Programs that print messages as others serialise them, one in JSON on each line.

use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;

use serde::de::DeserializeOwned;
use serde_json::Value as Json;
use sesame_relay::value::Value;

/// Calls a function with each line of an oracle, a script below `tests/` with these arguments, and returns how many
/// there were.
///
/// # Panics
///
/// When the oracle does not start, prints something else, or fails.
pub fn each_line<T: DeserializeOwned>(
    python: &Path,
    script: &str,
    arguments: &[&str],
    mut check: impl FnMut(&T),
) -> usize {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("this is a folder of `tests`").join(script);
    let mut oracle = Command::new(python);
    oracle.arg(script).args(arguments).stdout(Stdio::piped());
    let mut oracle = oracle.spawn().expect("a Python that is named starts");
    let mut found = 0;
    for line in BufReader::new(oracle.stdout.take().expect("it is piped")).lines() {
        let line = line.expect("an oracle prints text");
        check(&serde_json::from_str(&line).unwrap_or_else(|error| panic!("{error}: {line}")));
        found += 1;
    }
    assert!(oracle.wait().expect("a program that started ends").success(), "the oracle has a mistake");
    found
}

/// Bytes that are written as hexadecimal digits.
pub fn bytes(hex: &str) -> Arc<[u8]> {
    let byte = |at| u8::from_str_radix(&hex[at..at + 2], 16).expect("an oracle writes bytes as two digits");
    (0..hex.len()).step_by(2).map(byte).collect()
}

/// The bits of a real number, which are written as hexadecimal digits.
fn bits(shown: &Json) -> u64 {
    let digits = shown.as_str().expect("an oracle writes real numbers as texts");
    u64::from_str_radix(digits, 16).expect("an oracle writes real numbers as their bits")
}

/// Whether a value is what an oracle shows: real numbers bit for bit.
pub fn is(value: &Value, shown: &Json) -> bool {
    match (value, shown) {
        (Value::Bool(value), Json::Bool(shown)) => value == shown,
        (Value::Int(value), Json::Number(shown)) => Some(*value) == shown.as_i64(),
        (Value::Real(value), Json::String(_)) => value.to_bits() == bits(shown),
        (Value::Text(value), Json::String(shown)) => *value == **shown,
        (Value::List(values), Json::Array(shown)) => {
            values.len() == shown.len() && values.iter().zip(shown).all(|(value, shown)| is(value, shown))
        }
        (Value::Record(record), Json::Object(shown)) => {
            let mut fields = record.iter();
            record.fields().names().len() == shown.len() && fields.all(|(name, value)| is(value, &shown[name.as_str()]))
        }
        // What the language has values of its own for.
        (Value::Point(point), Json::Object(shown)) => {
            let shown = ["x", "y", "z"].map(|axis| bits(&shown[axis]));
            point.map(f64::to_bits) == shown
        }
        (Value::Real(time), Json::Object(shown)) => {
            let [seconds, nanos] =
                ["sec", "nanosec"].map(|part| shown[part].as_i64().expect("parts of a time are whole numbers") as f64);
            *time == seconds + nanos * 1e-9
        }
        _ => false,
    }
}
