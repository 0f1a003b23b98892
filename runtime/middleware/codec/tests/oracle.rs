//! Samples that others serialised: rosbags for random definitions, rclpy for all interfaces of real distributions.
//!
//! `SESAME_ROS2_CYCLONE` names a Python with rosbags, `SESAME_ROS2_KILTED` and `SESAME_ROS2_JAZZY` those of ROS 2.

#![expect(clippy::unwrap_used, reason = "a test ends where something is missing")]
#![expect(clippy::disallowed_methods, reason = "it reads the files of distributions")]

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use serde::Deserialize;
use serde_json::Value as Json;
use sesame_codec::cdr::Codec;
use sesame_interfaces::{Catalogue, msg, srv};
use sesame_peers::named;
use sesame_peers::oracle::{bytes, each_line, is};
use sesame_plan::{Interface, Primitive, WireType};
use sesame_relay::value::{Fields, Record, Value};
use sesame_relay::wire::Wanted;

/// The script of both.
const ORACLE: &str = "ros2/cdr_oracle.py";

/// A line of it.
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
            WireType::String { .. } => {
                let length = self.length();
                self.copy(1, length);
            }
            WireType::WString { .. } => {
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
    let Some(python) = named("SESAME_ROS2_CYCLONE") else { return };
    let found = each_line(&python, ORACLE, &["rosbags", &count.to_string(), &seed.to_string()], |sample: &Sample| {
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
        let Some(python) = named(variable) else { continue };
        let catalogue = installed(&python);
        let found = each_line(&python, ORACLE, &["rclpy", "5", "7"], |sample: &Sample| {
            let interfaces = catalogue.layout(&sample.interface).unwrap();
            // `serialize_message` hands out a buffer of the size it estimated before. What nodes publish ends with the
            // last field.
            let length = Canonical::of(&interfaces, &bytes(&sample.cdr)).len();
            check(&interfaces, sample, &bytes(&sample.cdr)[..length]);
        });
        assert!(found > 500, "{variable}: {found}");
    }
}
