//! What ROS writes is read and changed, and ROS reads the change and nothing else. Whole messages of all types, beside
//! rosbags too, are compared in the tests of the codec itself.

use std::io::{Seek, Write};
use std::path::Path;
use std::process::{Command, Output};
use std::sync::Arc;

use serde_json::{Value as Json, json};
use sesame_codec::cdr::Codec;
use sesame_interfaces::Catalogue;
use sesame_plan::Interface;
use sesame_relay::value::Value;
use sesame_relay::wire::Wanted;
use sesame_tests::workspace;

use crate::environment::Vendor;

/// Runs a program of this folder to its good end, with this input.
fn printed(python: &Path, program: &str, arguments: &[&str], input: &str) -> String {
    let mut given = tempfile::tempfile().expect("there is room for a file");
    given.write_all(input.as_bytes()).and_then(|()| given.rewind()).expect("a file can be written");
    let Output { status, stdout, stderr } = Command::new(python)
        .arg(workspace().join("tests/ros2").join(program))
        .args(arguments)
        .stdin(given)
        .output()
        .unwrap_or_else(|error| panic!("{} does not start: {error}", python.display()));
    assert!(status.success(), "{program}: {}", String::from_utf8_lossy(&stderr));
    String::from_utf8(stdout).expect("it prints text")
}

/// A line of `real_messages.py` with the definitions of its type.
struct Sample {
    interfaces: Vec<Interface>,
    kind: String,
    cdr: Arc<[u8]>,
    fields: Json,
}

impl Sample {
    /// With the definitions of a folder.
    fn read(line: &str, share: &Path) -> Self {
        let line: Json = serde_json::from_str(line).expect("each line is JSON");
        let kind = line["type"].as_str().expect("types have names").to_owned();
        let mut catalogue = Catalogue::default();
        let mut missing = vec![kind.clone()];
        while let Some(name) = missing.pop() {
            let file = share.join(format!("{name}.msg"));
            let text = std::fs::read_to_string(&file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
            let (package, rest) = name.split_once('/').expect("a name has a package");
            let last = rest.rsplit('/').next().expect("a name has a last part");
            let layout = sesame_interfaces::msg(package, last, &text);
            catalogue.add(layout.unwrap_or_else(|error| panic!("{error}: {text}")));
            missing = catalogue.missing();
        }
        let interfaces = catalogue.layout(&kind).unwrap_or_else(|error| panic!("{error}"));
        let cdr = bytes(line["cdr"].as_str().expect("samples are digits"));
        Sample { interfaces, kind, cdr, fields: line["fields"].clone() }
    }

    fn codec(&self) -> Codec {
        Codec::new(&self.interfaces, &self.kind, &Wanted::All).unwrap_or_else(|error| panic!("{error}"))
    }

    fn value(&self) -> Value {
        self.codec().read(Arc::clone(&self.cdr)).unwrap_or_else(|error| panic!("{error}: {}", self.fields))
    }
}

fn bytes(digits: &str) -> Arc<[u8]> {
    let pairs = digits.as_bytes().chunks(2).map(|pair| std::str::from_utf8(pair).expect("digits are ASCII"));
    pairs.map(|pair| u8::from_str_radix(pair, 16).expect("they are digits")).collect()
}

/// Whether a value that was read is what another wrote.
fn is_same(value: &Value, expected: &Json) -> bool {
    let real = |real: f64, expected: &Json| {
        let bits = expected["real"].as_str().and_then(|digits| u64::from_str_radix(digits, 16).ok());
        bits.is_some_and(|bits| bits == real.to_bits() || (real.is_nan() && f64::from_bits(bits).is_nan()))
    };
    match (value, expected) {
        (Value::Bool(truth), Json::Bool(expected)) => truth == expected,
        (Value::Int(number), Json::Number(expected)) => Some(*number) == expected.as_i64(),
        (Value::Text(text), Json::String(expected)) => text.as_str() == expected,
        (Value::Real(number), _) if expected.get("real").is_some() => real(*number, expected),
        // A time.
        (Value::Real(seconds), _) => {
            let part = |name| expected[name].as_f64();
            part("sec").zip(part("nanosec")).is_some_and(|(sec, nanosec)| *seconds == sec + nanosec * 1e-9)
        }
        (Value::Point(point), Json::Object(_)) => {
            point.iter().zip(["x", "y", "z"]).all(|(number, axis)| real(*number, &expected[axis]))
        }
        (Value::List(items), Json::Array(expected)) => {
            items.len() == expected.len() && items.iter().zip(expected).all(|(item, expected)| is_same(item, expected))
        }
        (Value::Record(record), Json::Object(expected)) => {
            record.values().len() == expected.len()
                && record
                    .iter()
                    .all(|(name, value)| expected.get(name.as_str()).is_some_and(|expected| is_same(value, expected)))
        }
        _ => false,
    }
}

/// Changes the first number or text that is found when a message is walked, leaf by leaf, from the one at `skip`; in
/// the message and in what is expected of it.
fn change(value: &mut Value, expected: &mut Json, skip: &mut usize) -> bool {
    let real = |real: f64| json!({ "real": format!("{:016x}", real.to_bits()) });
    match value {
        Value::List(items) => {
            let expected = expected.as_array_mut().expect("a list is a list");
            return items.iter_mut().zip(expected).any(|(item, expected)| change(item, expected, skip));
        }
        Value::Record(record) => {
            let names: Vec<String> = record.fields().names().iter().map(|name| name.as_str().to_owned()).collect();
            return names.iter().any(|name| {
                record.get_mut(name).is_some_and(|value| change(value, &mut expected[name.as_str()], skip))
            });
        }
        _ if *skip > 0 => {
            *skip -= 1;
            return false;
        }
        Value::Bool(truth) => {
            *truth = !*truth;
            *expected = json!(truth);
        }
        Value::Int(number) => {
            *number = if *number == 1 { 2 } else { 1 };
            *expected = json!(number);
        }
        Value::Text(text) => {
            *text = "another text, 日本".into();
            *expected = json!("another text, 日本");
        }
        Value::Point(point) => {
            point[1] = 0.75;
            expected["y"] = real(0.75);
        }
        Value::Real(number) if expected.get("sec").is_some() => {
            *number = 7.25;
            *expected = json!({ "sec": 7, "nanosec": 250_000_000 });
        }
        Value::Real(number) => {
            *number = 1.5;
            *expected = real(1.5);
        }
        Value::Undeclared(_) | Value::Opaque(_) => return false,
    }
    true
}

/// Samples of at least so many types.
fn rclpy(vendor: Vendor, least: usize) {
    let Some(python) = vendor.python() else { return };
    let share = Vendor::share(&python);
    let mut changed = Vec::new();
    for (number, line) in printed(&python, "real_messages.py", &["write"], "").lines().enumerate() {
        let mut sample = Sample::read(line, &share);
        let mut value = sample.value();
        assert!(is_same(&value, &sample.fields), "{line}\n{value:?}");
        let leaf = number % 6;
        let found =
            change(&mut value, &mut sample.fields, &mut leaf.clone()) || change(&mut value, &mut sample.fields, &mut 0);
        assert!(found, "{line}");
        let written = sample.codec().write(&value).unwrap_or_else(|error| panic!("{error}: {line}"));
        let digits: Vec<String> = written.iter().map(|byte| format!("{byte:02x}")).collect();
        changed.push(json!({ "type": sample.kind, "cdr": digits.concat(), "fields": sample.fields }));
    }
    assert!(changed.len() >= 3 * least, "{} samples", changed.len());
    let lines: Vec<String> = changed.iter().map(|line| format!("{line}\n")).collect();
    let read = printed(&python, "real_messages.py", &["read"], &lines.concat());
    for (line, changed) in read.lines().zip(&changed) {
        let line: Json = serde_json::from_str(line).expect("each line is JSON");
        assert_eq!(line["fields"], changed["fields"], "{changed}");
    }
    assert_eq!(read.lines().count(), changed.len());
}

#[test]
fn what_kilted_writes_is_read_and_kilted_reads_what_was_changed_in_it() {
    rclpy(Vendor::Kilted, 20);
}

#[test]
fn what_jazzy_writes_is_read_and_jazzy_reads_what_was_changed_in_it() {
    rclpy(Vendor::Jazzy, 20);
}
