//! What only CDR has: wide text, padding, and room that writers leave.

use sesame_plan::{Interface, Primitive, WireType};
use sesame_relay::value::{Fields, Record, Value};
use sesame_relay::wire::Wanted;

use super::*;
use crate::tests::{codec, field, nested, number, single};

#[test]
fn wide_text_is_as_the_nodes_of_ros_write_it() {
    let codec = codec::<Cdr>(&single(WireType::WSTRING), &Wanted::All);
    for (text, units) in [
        // The first field of `test_msgs/msg/WStrings`, as rclpy serialises it.
        ("aß𝄞", &[4, 0x61, 0xdf, 0xd834, 0xdd1e][..]),
        // The same in ROS 2 Kilted: the number of code units of UTF-16, and four bytes for each.
        ("aß€𝄞", &[5, 0x61, 0xdf, 0x20ac, 0xd834, 0xdd1e]),
    ] {
        let sample: Vec<u8> =
            [0, 1, 0, 0].into_iter().chain(units.iter().copied().flat_map(u32::to_le_bytes)).collect();
        let value = codec.read(sample.clone().into()).unwrap();
        assert_eq!(value.at(&["f0"]), Some(&Value::Text(text.into())));
        let anew = Record::new(&Fields::new(["f0"]), vec![Value::Text(text.into())]);
        assert_eq!(*codec.write(&anew.into()).unwrap(), *sample);
    }
}

#[test]
fn a_changed_message_does_not_announce_the_padding_of_its_sample() {
    let codec = codec::<Cdr>(&single(WireType::STRING), &Wanted::All);
    let mut value = codec.read([0, 1, 0, 2, 2, 0, 0, 0, b'a', 0, 0, 0][..].into()).unwrap();
    *value.at_mut(&["f0"]).unwrap() = Value::Text("abc".into());
    assert_eq!(&*codec.write(&value).unwrap(), &[0, 1, 0, 0, 4, 0, 0, 0, b'a', b'b', b'c', 0]);
}

#[test]
fn a_text_is_written_no_longer_than_its_type_permits() {
    let written = |ty: WireType, text: &str| {
        let codec = codec::<Cdr>(&single(ty), &Wanted::All);
        let before = codec.write(&Record::new(&Fields::new(["f0"]), vec![Value::Text("".into())]).into()).unwrap();
        let mut changed = codec.read(before).unwrap();
        *changed.at_mut(&["f0"]).unwrap() = Value::Text(text.into());
        let anew = Record::new(&Fields::new(["f0"]), vec![Value::Text(text.into())]).into();
        let [changed, anew] = [changed, anew].map(|message| {
            let read = codec.read(codec.write(&message).unwrap()).unwrap();
            let Some(Value::Text(text)) = read.at(&["f0"]) else { panic!("{read:?} has no text") };
            text.to_string()
        });
        assert_eq!(changed, anew);
        anew
    };
    assert_eq!(written(WireType::STRING, "as long as it is"), "as long as it is");
    assert_eq!(written(WireType::String { bound: Some(5) }, "five5"), "five5");
    assert_eq!(written(WireType::String { bound: Some(5) }, "sixsix"), "sixsi");
    assert_eq!(written(WireType::String { bound: Some(2) }, "aä"), "a", "two bytes for the last character");
    assert_eq!(written(WireType::WString { bound: Some(2) }, "aäö"), "aä");
    assert_eq!(written(WireType::WString { bound: Some(2) }, "a𝄞"), "a", "two units for the last character");
}

#[test]
fn points_and_times_are_what_they_are_in_the_language() {
    let real = |name: &str| number(name, Primitive::Float32);
    let all = [
        Interface { name: "g/msg/Point32".into(), fields: vec![real("x"), real("y"), real("z")] },
        Interface {
            name: "builtin_interfaces/msg/Time".into(),
            fields: vec![number("sec", Primitive::Int32), number("nanosec", Primitive::Uint32)],
        },
        Interface {
            name: "p/msg/M".into(),
            fields: vec![nested("stamp", "builtin_interfaces/msg/Time"), nested("at", "g/msg/Point32")],
        },
    ];
    let codec = codec::<Cdr>(&all, &Wanted::All);
    let mut sample = vec![0, 1, 0, 0, 254, 255, 255, 255, 0, 101, 205, 29];
    sample.extend([1.0f32, -2.0, 0.5].into_iter().flat_map(f32::to_le_bytes));
    let mut value = codec.read(sample.clone().into()).unwrap();
    assert_eq!(value.at(&["stamp"]), Some(&Value::Real(-1.5)), "two seconds before, and half a second after that");
    assert_eq!(value.at(&["at"]), Some(&Value::Point([1.0, -2.0, 0.5])));
    *value.at_mut(&["at"]).unwrap() = Value::Point([1.0, 3.0, 0.5]);
    *value.at_mut(&["stamp"]).unwrap() = Value::Real(2.25);
    let written = codec.read(codec.write(&value).unwrap()).unwrap();
    assert_eq!((written.at(&["stamp"]), written.at(&["at"])), (value.at(&["stamp"]), value.at(&["at"])));
    assert_eq!(codec.write(&Value::Bool(true)), Err(CodecError::NoMessage("bool")));
}

#[test]
fn room_that_rclpy_leaves_for_the_elements_of_empty_sequences_is_no_error() {
    let ty = WireType::Sequence { of: Box::new(WireType::Primitive { primitive: Primitive::Float64 }), bound: None };
    let interfaces = [Interface { name: "p/msg/M".to_owned(), fields: vec![field(0, ty.clone()), field(1, ty)] }];
    let codec = codec::<Cdr>(&interfaces, &Wanted::All);
    let mut sample = vec![0, 1, 0, 0];
    sample.extend([0; 8]);
    // Padding, and four bytes for each of both.
    sample.extend([0xaa; 15]);
    assert!(codec.read(sample.clone().into()).is_ok());
    sample.push(0xaa);
    assert_eq!(codec.read(sample.into()), Err(CodecError::Long { surplus: 16 }));
}
