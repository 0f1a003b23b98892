//! Samples that others serialised: rosbags for random definitions, rclpy for all interfaces of real distributions.
//!
//! `SESAME_ROS2_CYCLONE` names a Python with rosbags, `SESAME_ROS2_KILTED` and `SESAME_ROS2_JAZZY` those of ROS 2.

#![expect(clippy::unwrap_used, reason = "a test ends where something is missing")]
#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "it asks other programs, and reads their files"
)]

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;

use serde::Deserialize;
use serde_json::Value as Json;
use sesame_codec::cdr::Codec;
use sesame_interfaces::{Catalogue, msg, srv};
use sesame_plan::{Interface, Primitive, WireType};
use sesame_relay::value::{Fields, Record, Value};
use sesame_relay::wire::Wanted;

/// A line of `cdr_oracle.py`.
#[derive(Deserialize)]
struct Sample {
    /// The definitions, if they are not those of a distribution.
    #[serde(default)]
    files: BTreeMap<String, String>,
    #[serde(rename = "type")]
    interface: String,
    cdr: String,
    fields: Json,
}

/// The Python that a variable names.
fn python(variable: &str) -> Option<PathBuf> {
    if let Some(python) = std::env::var_os(variable) {
        return Some(python.into());
    }
    assert!(std::env::var("CI").as_deref() != Ok("true"), "{variable} names no Python");
    eprintln!("skipped: {variable} names no Python");
    None
}

/// Calls a function with each sample of the oracle, and returns how many there were.
fn each_sample(python: &Path, by: &str, count: usize, seed: u64, mut check: impl FnMut(&Sample)) -> usize {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../tests/ros2/cdr_oracle.py");
    let mut oracle = Command::new(python);
    oracle.arg(script).args([by, &count.to_string(), &seed.to_string()]).stdout(Stdio::piped());
    let mut oracle = oracle.spawn().unwrap();
    let lines = BufReader::new(oracle.stdout.take().unwrap()).lines();
    let mut found = 0;
    for line in lines {
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

/// A sample without what follows its last field, and with zeros where fields are aligned: as it is when it is written
/// anew. Decoded and encoded by nothing that is tested here.
struct Canonical<'a> {
    interfaces: &'a [Interface],
    sample: &'a [u8],
    at: usize,
    out: Vec<u8>,
}

impl Canonical<'_> {
    fn of(interfaces: &[Interface], sample: &[u8]) -> Vec<u8> {
        let mut walk = Canonical { interfaces, sample, at: 4, out: sample[..4].to_vec() };
        walk.message(&interfaces.last().unwrap().name);
        walk.out
    }

    fn copy(&mut self, align: usize, size: usize) -> &[u8] {
        while !(self.at - 4).is_multiple_of(align) {
            self.at += 1;
            self.out.push(0);
        }
        let copied = &self.sample[self.at..self.at + size];
        self.at += size;
        self.out.extend(copied);
        copied
    }

    fn length(&mut self) -> usize {
        let little = self.sample[1] == 1;
        let length: [u8; 4] = self.copy(4, 4).try_into().unwrap();
        (if little { u32::from_le_bytes(length) } else { u32::from_be_bytes(length) }) as usize
    }

    fn message(&mut self, name: &str) {
        let interfaces = self.interfaces;
        let interface = interfaces.iter().find(|interface| interface.name == name).unwrap();
        interface.fields.iter().for_each(|field| self.value(&field.ty));
    }

    fn value(&mut self, ty: &WireType) {
        match ty {
            WireType::Primitive { primitive } => {
                self.copy(primitive.size(), primitive.size());
            }
            WireType::String => {
                let length = self.length();
                self.copy(1, length);
            }
            WireType::WString => {
                let length = self.length();
                (0..length).for_each(|_| self.value(&WireType::Primitive { primitive: Primitive::Uint32 }));
            }
            WireType::Interface { name } => self.message(name),
            WireType::Array { of, length } => (0..*length).for_each(|_| self.value(of)),
            WireType::Sequence { of, .. } => {
                let length = self.length();
                (0..length).for_each(|_| self.value(of));
            }
        }
    }
}

/// The value without the sample it was read from, so that it is written anew.
fn without_origin(value: &Value) -> Value {
    let Value::Record(record) = value else { panic!("{value:?}") };
    Record::new(record.fields(), record.values().to_vec()).into()
}

fn has_time(interfaces: &[Interface]) -> bool {
    interfaces[..interfaces.len() - 1].iter().any(|interface| interface.name.starts_with("builtin_interfaces/msg/"))
}

/// Checks all that the codec does with a sample.
fn check(interfaces: &[Interface], sample: &Sample, cdr: &[u8]) {
    let name = &sample.interface;
    let cdr: Arc<[u8]> = cdr.into();
    let codec = Codec::new(interfaces, name, &Wanted::All).unwrap();
    let value = codec.read(Arc::clone(&cdr)).unwrap_or_else(|error| panic!("{name}: {error}: {}", sample.cdr));
    assert!(is(&value, &sample.fields), "{name}: {value:?}, not {}", sample.fields);
    assert!(Arc::ptr_eq(&codec.write(&value).unwrap(), &cdr), "{name}");

    let canonical = Canonical::of(interfaces, &cdr);
    // Times are read as one number, which need not have all their digits.
    if cdr[1] == 1 && !has_time(interfaces) {
        assert_eq!(*codec.write(&without_origin(&value)).unwrap(), *canonical, "{name}");
    }

    // A field that is read alone, and whose value changes to nothing and back, is all that is touched.
    for field in &interfaces.last().unwrap().fields {
        let mut wanted = Wanted::nothing();
        wanted.add([field.name.as_str()].into_iter());
        let codec = Codec::new(interfaces, name, &wanted).unwrap();
        let some = codec.read(Arc::clone(&cdr)).unwrap();
        let Value::Record(record) = &some else { panic!("{some:?}") };
        assert_eq!(record.fields(), &Fields::new([field.name.as_str()]), "{name}");
        assert!(is(&record.values()[0], &sample.fields[&field.name]), "{name}.{}: {some:?}", field.name);
        if let Value::List(items) = &record.values()[0]
            && let WireType::Sequence { bound, .. } = &field.ty
            && bound.is_none_or(|bound| items.len() < bound as usize)
            && let Some(first) = items.first()
        {
            let (longer, first) = ([&items[..], std::slice::from_ref(first)].concat(), first.clone());
            let changed = Record::decoded(record.fields(), record.values().to_vec(), Arc::clone(&cdr));
            let mut changed = Value::from(changed);
            *changed.at_mut(&[&field.name]).unwrap() = Value::List(longer);
            let mut changed = codec.read(codec.write(&changed).unwrap()).unwrap();
            let Some(Value::List(longer)) = changed.at_mut(&[&field.name]) else { panic!("{changed:?}") };
            let last = longer.pop().unwrap();
            assert!(has_time(interfaces) || last.is_same(&first), "{name}.{}", field.name);
            assert_eq!(*codec.write(&changed).unwrap(), *canonical, "{name}.{}", field.name);
        }
    }
}

fn check_rosbags(count: usize, seed: u64) {
    let Some(python) = python("SESAME_ROS2_CYCLONE") else { return };
    let found = each_sample(&python, "rosbags", count, seed, |sample| {
        let mut catalogue = Catalogue::default();
        for (name, text) in &sample.files {
            catalogue.add(msg("oracle", name, text).unwrap_or_else(|error| panic!("{error}: {text}")));
        }
        check(&catalogue.layout(&sample.interface).unwrap(), sample, &bytes(&sample.cdr));
    });
    assert_eq!(found, count);
}

#[test]
fn random_messages_are_read_and_written_as_rosbags_does() {
    check_rosbags(1_000, 7);
}

#[test]
#[ignore = "takes minutes"]
fn many_random_messages_are_read_and_written_as_rosbags_does() {
    check_rosbags(10_000, 8);
}

/// All interfaces of the distribution that a Python belongs to.
fn installed(python: &Path) -> Catalogue {
    let mut catalogue = Catalogue::default();
    for package in std::fs::read_dir(python.parent().unwrap().parent().unwrap().join("share")).unwrap() {
        let package = package.unwrap();
        let package_name = package.file_name().into_string().unwrap();
        for kind in ["msg", "srv"] {
            let Ok(files) = std::fs::read_dir(package.path().join(kind)) else { continue };
            for path in files.map(|file| file.unwrap().path()) {
                let name = path.file_stem().unwrap().to_str().unwrap();
                match path.extension().and_then(|extension| extension.to_str()) {
                    Some("msg") => {
                        catalogue.add(msg(&package_name, name, &std::fs::read_to_string(&path).unwrap()).unwrap());
                    }
                    Some("srv") => {
                        let both = srv(&package_name, name, &std::fs::read_to_string(&path).unwrap()).unwrap();
                        for part in both {
                            catalogue.add(part);
                        }
                    }
                    _ => {}
                }
            }
        }
    }
    catalogue
}

#[test]
fn all_installed_messages_are_read_and_written_as_rclpy_does() {
    for variable in ["SESAME_ROS2_KILTED", "SESAME_ROS2_JAZZY"] {
        let Some(python) = python(variable) else { continue };
        let catalogue = installed(&python);
        let found = each_sample(&python, "rclpy", 5, 7, |sample| {
            let interfaces = catalogue.layout(&sample.interface).unwrap();
            // `serialize_message` hands out a buffer of the size it estimated before. What nodes publish ends with the
            // last field.
            let length = Canonical::of(&interfaces, &bytes(&sample.cdr)).len();
            check(&interfaces, sample, &bytes(&sample.cdr)[..length]);
        });
        assert!(found > 500, "{variable}: {found}");
    }
}
