//! Types as genmsg describes them, and messages as genpy serialises them: all that Debian has, and random ones.
//!
//! `SESAME_ROS1` names a Python that has rospy.

#![expect(clippy::unwrap_used, reason = "a test ends where something is missing")]
#![expect(clippy::disallowed_methods, clippy::disallowed_types, reason = "it asks another program")]

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;

use serde::Deserialize;
use serde_json::Value as Json;
use sesame_codec::ros1::Codec;
use sesame_plan::{Interface, WireType};
use sesame_relay::value::{Fields, Record, Value};
use sesame_relay::wire::Wanted;
use sesame_ros1::definition::Texts;

/// A line of `oracle.py`.
#[derive(Deserialize)]
struct Described {
    #[serde(rename = "type")]
    name: String,
    md5: String,
    definition: String,
    files: BTreeMap<String, String>,
    #[serde(default)]
    service: Option<String>,
    samples: Vec<Sample>,
}

#[derive(Deserialize)]
struct Sample {
    bytes: String,
    fields: Json,
}

/// The Python that has rospy.
fn python() -> Option<PathBuf> {
    let python = std::env::var_os("SESAME_ROS1").map(PathBuf::from);
    assert!(python.is_some() || std::env::var("CI").as_deref() != Ok("true"), "SESAME_ROS1 names no Python");
    if python.is_none() {
        eprintln!("skipped: SESAME_ROS1 names no Python that has rospy");
    }
    python
}

/// Calls a function with each line of the oracle, and returns how many there were.
fn each(python: &Path, which: &str, count: usize, seed: u64, mut check: impl FnMut(&Described)) -> usize {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../tests/ros1/oracle.py");
    let mut oracle = Command::new(python);
    oracle.arg(script).args([which, &count.to_string(), &seed.to_string()]).stdout(Stdio::piped());
    let mut oracle = oracle.spawn().unwrap();
    let mut found = 0;
    for line in BufReader::new(oracle.stdout.take().unwrap()).lines() {
        check(&serde_json::from_str(&line.unwrap()).unwrap());
        found += 1;
    }
    assert!(oracle.wait().unwrap().success(), "the oracle has a mistake");
    found
}

fn bytes(hex: &str) -> Arc<[u8]> {
    (0..hex.len()).step_by(2).map(|at| u8::from_str_radix(&hex[at..at + 2], 16).unwrap()).collect()
}

fn real(shown: &Json) -> u64 {
    u64::from_str_radix(shown.as_str().unwrap(), 16).unwrap()
}

/// Whether a value is what the oracle says.
fn is(value: &Value, shown: &Json) -> bool {
    match (value, shown) {
        (Value::Bool(value), Json::Bool(shown)) => value == shown,
        (Value::Int(value), Json::Number(shown)) => Some(*value) == shown.as_i64(),
        (Value::Real(value), Json::String(_)) => value.to_bits() == real(shown),
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
            let shown = ["x", "y", "z"].map(|axis| real(&shown[axis]));
            point.map(f64::to_bits) == shown
        }
        (Value::Real(time), Json::Object(shown)) => {
            let [seconds, nanos] = ["sec", "nanosec"].map(|part| shown[part].as_i64().unwrap() as f64);
            *time == seconds + nanos * 1e-9
        }
        _ => false,
    }
}

/// Times are read as one number, which need not have all their digits.
fn has_time(interfaces: &[Interface]) -> bool {
    interfaces.iter().any(|interface| interface.name.starts_with("builtin_interfaces/"))
}

/// The layout as ROS 2 has it: without the numbers of headers, and with a byte in empty messages.
fn in_ros2(mut interfaces: Vec<Interface>) -> Vec<Interface> {
    for interface in &mut interfaces {
        if interface.name == "std_msgs/msg/Header" {
            interface.fields.retain(|field| field.name != "seq");
        }
        if interface.fields.is_empty() {
            let ty = WireType::Primitive { primitive: sesame_plan::Primitive::Uint8 };
            let name = "structure_needs_at_least_one_member".to_owned();
            interface.fields.push(sesame_plan::InterfaceField { name, ty });
        }
    }
    interfaces
}

/// Checks all that the codec does with a message.
fn check_sample(name: &str, interfaces: &[Interface], sample: &Sample) {
    let bytes = bytes(&sample.bytes);
    let codec = Codec::new(interfaces, name, &Wanted::All).unwrap();
    let value = codec.read(Arc::clone(&bytes)).unwrap_or_else(|error| panic!("{name}: {error}: {}", sample.bytes));
    assert!(is(&value, &sample.fields), "{name}: {value:?}, not {}", sample.fields);
    assert!(Arc::ptr_eq(&codec.write(&value).unwrap(), &bytes), "{name}");
    let Value::Record(record) = &value else { panic!("{value:?}") };
    if !has_time(interfaces) {
        let anew = Record::new(record.fields(), record.values().to_vec());
        assert_eq!(codec.write(&anew.into()).unwrap(), bytes, "{name}");
    }
    // A layout of ROS 2 is as good, and what is changed and changed back is as it was.
    let other = Codec::new(&in_ros2(interfaces.to_vec()), name, &Wanted::All).unwrap();
    other.check(&bytes).unwrap();
    for field in &interfaces.last().unwrap().fields {
        let mut wanted = Wanted::nothing();
        wanted.add([field.name.as_str()].into_iter());
        let codec = Codec::new(interfaces, name, &wanted).unwrap();
        let some = codec.read(Arc::clone(&bytes)).unwrap();
        let Value::Record(record) = &some else { panic!("{some:?}") };
        assert_eq!(record.fields(), &Fields::new([field.name.as_str()]), "{name}");
        assert!(is(&record.values()[0], &sample.fields[&field.name]), "{name}.{}: {some:?}", field.name);
        if let (Value::List(items), WireType::Sequence { .. }) = (&record.values()[0], &field.ty)
            && let Some(first) = items.first()
        {
            let longer = [&items[..], std::slice::from_ref(first)].concat();
            let mut changed = some.clone();
            *changed.at_mut(&[&field.name]).unwrap() = Value::List(longer);
            let mut changed = codec.read(codec.write(&changed).unwrap()).unwrap();
            let Some(Value::List(longer)) = changed.at_mut(&[&field.name]) else { panic!("{changed:?}") };
            longer.pop();
            assert_eq!(codec.write(&changed).unwrap(), bytes, "{name}.{}", field.name);
        }
    }
}

fn check(described: &Described) {
    let name = &described.name;
    let mut texts = Texts::default();
    for (name, text) in &described.files {
        texts.add(name, text);
    }
    if let Some(service) = &described.service {
        assert_eq!(texts.service_md5(name, service).unwrap(), described.md5, "{name}");
        return;
    }
    assert_eq!(texts.md5(name).unwrap(), described.md5, "{name}");
    assert_eq!(texts.definition(name).unwrap(), described.definition, "{name}");
    let again = Texts::of_definition(name, &described.definition).unwrap();
    assert_eq!(again.definition(name).unwrap(), described.definition, "{name}");
    assert_eq!(again.md5(name).unwrap(), described.md5, "{name}");
    let layout = texts.layout(name).unwrap();
    described.samples.iter().for_each(|sample| check_sample(name, &layout, sample));
}

#[test]
fn all_installed_types_and_their_messages_are_as_genmsg_and_genpy_have_them() {
    let Some(python) = python() else { return };
    let found = each(&python, "installed", 5, 7, check);
    assert!(found > 100, "{found}");
}

#[test]
fn random_types_and_their_messages_are_as_genmsg_and_genpy_have_them() {
    let Some(python) = python() else { return };
    assert_eq!(each(&python, "random", 300, 7, check), 300);
}

#[test]
#[ignore = "takes minutes"]
fn many_random_types_and_their_messages_are_as_genmsg_and_genpy_have_them() {
    let Some(python) = python() else { return };
    assert_eq!(each(&python, "random", 5_000, 8, check), 5_000);
}
