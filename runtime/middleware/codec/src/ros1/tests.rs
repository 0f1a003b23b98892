//! What only ROS 1 has: the numbers of headers, messages without bytes, and two kinds of seconds.

use sesame_plan::{Interface, Primitive, WireType};
use sesame_relay::value::{Fields, Record, Value};
use sesame_relay::wire::Wanted;

use super::*;
use crate::error::LayoutError;
use crate::tests::{codec, field, nested, number, single};

/// A header as ROS 2 has it, or as ROS 1 does, in a message with a time, a duration and a point.
fn stamped(seq: bool) -> Vec<Interface> {
    let time = |name: &str, sec| Interface {
        name: name.into(),
        fields: vec![number("sec", sec), number("nanosec", Primitive::Uint32)],
    };
    let seq = seq.then(|| number("seq", Primitive::Uint32));
    let rest = [nested("stamp", "builtin_interfaces/msg/Time"), field(1, WireType::STRING)];
    let real = |name: &str| number(name, Primitive::Float32);
    let fields = vec![
        nested("header", "std_msgs/msg/Header"),
        nested("for", "builtin_interfaces/msg/Duration"),
        nested("at", "g/msg/Point32"),
    ];
    vec![
        time("builtin_interfaces/msg/Time", Primitive::Int32),
        time("builtin_interfaces/msg/Duration", Primitive::Int32),
        Interface { name: "std_msgs/msg/Header".into(), fields: seq.into_iter().chain(rest).collect() },
        Interface { name: "g/msg/Point32".into(), fields: vec![real("x"), real("y"), real("z")] },
        Interface { name: "p/msg/M".into(), fields },
    ]
}

/// Such a message: number 7, 4,000,000,000.5 s, frame `ab`, -1.5 s, (1, -2, 0.5).
fn stamped_bytes() -> Vec<u8> {
    let mut bytes: Vec<u8> = [7, 4_000_000_000, 500_000_000, 2].into_iter().flat_map(u32::to_le_bytes).collect();
    bytes.extend(b"ab");
    bytes.extend((-2i32).to_le_bytes());
    bytes.extend(500_000_000u32.to_le_bytes());
    bytes.extend([1.0f32, -2.0, 0.5].into_iter().flat_map(f32::to_le_bytes));
    bytes
}

#[test]
fn points_and_times_are_what_they_are_in_the_language_and_headers_keep_their_number() {
    for seq in [false, true] {
        let codec = codec::<Ros1>(&stamped(seq), &Wanted::All);
        let mut value = codec.read(stamped_bytes().into()).unwrap();
        assert_eq!(value.at(&["header", "stamp"]), Some(&Value::Real(4_000_000_000.5)), "no sign");
        assert_eq!(value.at(&["header", "seq"]), seq.then_some(&Value::Int(7)));
        assert_eq!(value.at(&["for"]), Some(&Value::Real(-1.5)), "two seconds before, and half a second after that");
        assert_eq!(value.at(&["at"]), Some(&Value::Point([1.0, -2.0, 0.5])));
        *value.at_mut(&["header", "f1"]).unwrap() = Value::Text("c".into());
        *value.at_mut(&["header", "stamp"]).unwrap() = Value::Real(2.25);
        *value.at_mut(&["at"]).unwrap() = Value::Point([1.0, 3.0, 0.5]);
        let written = codec.write(&value).unwrap();
        let mut expected: Vec<u8> = [7, 2, 250_000_000, 1].into_iter().flat_map(u32::to_le_bytes).collect();
        expected.extend(b"c");
        expected.extend(&stamped_bytes()[18..26]);
        expected.extend([1.0f32, 3.0, 0.5].into_iter().flat_map(f32::to_le_bytes));
        assert_eq!(*written, *expected, "the number of the header is as it was");
    }
    let codec = codec::<Ros1>(&stamped(false), &Wanted::All);
    assert_eq!(codec.write(&Value::Bool(true)), Err(CodecError::NoMessage("bool")));
    let nothing = Record::new(&Fields::new([]), Vec::new());
    assert_eq!(*codec.write(&nothing.into()).unwrap(), [0; 36], "the header has a number all the same");
}

#[test]
fn what_is_one_byte_in_ros_2_because_it_has_no_fields_has_none() {
    let empty = [Interface {
        name: "std_srvs/srv/Empty_Request".into(),
        fields: vec![number("structure_needs_at_least_one_member", Primitive::Uint8)],
    }];
    let codec = Codec::new(&empty, "std_srvs/srv/Empty_Request", &Wanted::All).unwrap();
    let value = codec.read([][..].into()).unwrap();
    assert!(codec.write(&value).unwrap().is_empty());
    assert!(codec.read([0][..].into()).is_err());
}

#[test]
fn wide_text_is_refused_and_an_interface_is_found_without_the_middle_of_its_name() {
    let wide = Codec::new(&single(WireType::WSTRING), "p/M", &Wanted::All).unwrap_err();
    assert_eq!(wide, LayoutError::Wide { name: "p/msg/M".into(), field: "f0".into() });
    assert!(Codec::new(&single(WireType::STRING), "p/M", &Wanted::All).is_ok());
}
