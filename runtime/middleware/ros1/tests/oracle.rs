//! Types as genmsg describes them, and messages as genpy serialises them: all that Debian has, and random ones.
//!
//! `SESAME_ROS1` names a Python that has rospy.

#![expect(clippy::unwrap_used, reason = "a test ends where something is missing")]

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::Deserialize;
use serde_json::Value as Json;
use sesame_codec::ros1::Codec;
use sesame_peers::named;
use sesame_peers::oracle::{bytes, each_line, is};
use sesame_plan::{Interface, WireType};
use sesame_relay::value::{Fields, Record, Value};
use sesame_relay::wire::Wanted;
use sesame_ros1::definition::Texts;

/// The script of all.
const ORACLE: &str = "ros1/oracle.py";

/// A line of it.
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
    let Some(python) = named("SESAME_ROS1") else { return };
    let found = each_line(&python, ORACLE, &["installed", "5", "7"], check);
    assert!(found > 100, "{found}");
}

#[test]
fn random_types_and_their_messages_are_as_genmsg_and_genpy_have_them() {
    let Some(python) = named("SESAME_ROS1") else { return };
    assert_eq!(each_line(&python, ORACLE, &["random", "300", "7"], check), 300);
}

#[test]
#[ignore = "takes minutes"]
fn many_random_types_and_their_messages_are_as_genmsg_and_genpy_have_them() {
    let Some(python) = named("SESAME_ROS1") else { return };
    assert_eq!(each_line(&python, ORACLE, &["random", "5000", "8"], check), 5_000);
}
