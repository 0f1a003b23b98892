//! The codec beside a naive one that knows nothing of selections, origins and sizes.

#![expect(clippy::cast_possible_truncation, clippy::cast_possible_wrap, reason = "bits are cut to their primitive")]

use std::sync::Arc;

use proptest::collection::vec;
use proptest::prelude::*;
use sesame_plan::{Interface, InterfaceField, Primitive, WireType};
use sesame_relay::value::{Fields, Record, Value};

use super::{Codec, CodecError, LayoutError, Wanted};

const PRIMITIVES: [Primitive; 11] = [
    Primitive::Bool,
    Primitive::Int8,
    Primitive::Uint8,
    Primitive::Int16,
    Primitive::Uint16,
    Primitive::Int32,
    Primitive::Uint32,
    Primitive::Int64,
    Primitive::Uint64,
    Primitive::Float32,
    Primitive::Float64,
];

/// A value as it is on the wire: the bits of primitives.
#[derive(Debug, Clone, PartialEq)]
enum Raw {
    Bits(u64),
    Text(String),
    Items(Vec<Raw>),
    Message(Vec<Raw>),
}

fn field(at: usize, ty: WireType) -> InterfaceField {
    InterfaceField { name: format!("f{at}"), ty }
}

/// Interfaces, each of fields of any type over those before it.
fn interfaces() -> impl Strategy<Value = Vec<Interface>> {
    #[derive(Debug, Clone)]
    enum Shape {
        Primitive(usize),
        String,
        Before(prop::sample::Index),
        Array(Box<Shape>, u32),
        Sequence(Box<Shape>),
    }
    fn ty(shape: &Shape, before: &[Interface]) -> WireType {
        match shape {
            Shape::Primitive(at) => WireType::Primitive { primitive: PRIMITIVES[*at] },
            Shape::String => WireType::String,
            Shape::Before(_) if before.is_empty() => WireType::String,
            Shape::Before(at) => WireType::Interface { name: at.get(before).name.clone() },
            Shape::Array(of, length) => WireType::Array { of: Box::new(ty(of, before)), length: *length },
            Shape::Sequence(of) => WireType::Sequence { of: Box::new(ty(of, before)), bound: None },
        }
    }
    let leaf = prop_oneof![
        4 => (0..PRIMITIVES.len()).prop_map(Shape::Primitive),
        1 => Just(Shape::String),
        2 => any::<prop::sample::Index>().prop_map(Shape::Before),
    ];
    let shape = leaf.prop_recursive(2, 6, 1, |inner| {
        prop_oneof![
            (inner.clone(), 1u32..4).prop_map(|(of, length)| Shape::Array(Box::new(of), length)),
            inner.prop_map(|of| Shape::Sequence(Box::new(of))),
        ]
    });
    vec(vec(shape, 1..6), 1..4).prop_map(|interfaces| {
        let mut made = Vec::new();
        for (at, shapes) in interfaces.iter().enumerate() {
            let fields = shapes.iter().enumerate().map(|(at, shape)| field(at, ty(shape, &made))).collect();
            made.push(Interface { name: format!("p/msg/M{at}"), fields });
        }
        made
    })
}

/// A random value of a type, from a stream of numbers.
fn raw(ty: &WireType, all: &[Interface], draw: &mut impl FnMut() -> u64) -> Raw {
    match ty {
        WireType::Primitive { primitive } => {
            let bits = draw() >> (64 - 8 * primitive.size());
            Raw::Bits(match primitive {
                Primitive::Bool => bits & 1,
                // What can be read; larger ones have a test of their own.
                Primitive::Uint64 => bits >> 1,
                // A quiet NaN is kept by conversions; a signalling one need not be.
                Primitive::Float32 if f32::from_bits(bits as u32).is_nan() => 0,
                _ => bits,
            })
        }
        WireType::String | WireType::WString => {
            let length = draw() % 5;
            Raw::Text((0..length).map(|_| ['a', 'ß', '€', '𝄞', 'z'][(draw() % 5) as usize]).collect())
        }
        WireType::Interface { name } => {
            let interface = all.iter().find(|interface| interface.name == *name).unwrap();
            Raw::Message(interface.fields.iter().map(|field| raw(&field.ty, all, draw)).collect())
        }
        WireType::Array { of, length } => Raw::Items((0..*length).map(|_| raw(of, all, draw)).collect()),
        WireType::Sequence { of, .. } => {
            let length = draw() % 4;
            Raw::Items((0..length).map(|_| raw(of, all, draw)).collect())
        }
    }
}

/// The naive encoding.
fn encode(ty: &WireType, raw: &Raw, all: &[Interface], out: &mut Vec<u8>) {
    let mut number = |bits: u64, size: usize| {
        for at in 0..size {
            out.push((bits >> (8 * at)) as u8);
        }
    };
    match (ty, raw) {
        (WireType::Primitive { primitive }, Raw::Bits(bits)) => number(*bits, primitive.size()),
        (WireType::String, Raw::Text(text)) => {
            number(text.len() as u64, 4);
            out.extend(text.bytes());
        }
        (WireType::Interface { name }, Raw::Message(fields)) => {
            let interface = all.iter().find(|interface| interface.name == *name).unwrap();
            for (field, raw) in interface.fields.iter().zip(fields) {
                encode(&field.ty, raw, all, out);
            }
        }
        (WireType::Array { of, .. }, Raw::Items(items)) => {
            for item in items {
                encode(of, item, all, out);
            }
        }
        (WireType::Sequence { of, .. }, Raw::Items(items)) => {
            number(items.len() as u64, 4);
            for item in items {
                encode(of, item, all, out);
            }
        }
        other => panic!("{other:?}"),
    }
}

fn bytes(all: &[Interface], raw: &Raw) -> Arc<[u8]> {
    let mut out = Vec::new();
    let name = all.last().unwrap().name.clone();
    encode(&WireType::Interface { name }, raw, all, &mut out);
    out.into()
}

/// The value that the naive reading has.
fn meant(ty: &WireType, raw: &Raw, all: &[Interface]) -> Value {
    match (ty, raw) {
        (WireType::Primitive { primitive }, Raw::Bits(bits)) => match primitive {
            Primitive::Bool => Value::Bool(*bits == 1),
            Primitive::Float32 => Value::Real(f64::from(f32::from_bits(*bits as u32))),
            Primitive::Float64 => Value::Real(f64::from_bits(*bits)),
            Primitive::Int8 => Value::Int(i64::from(*bits as i8)),
            Primitive::Int16 => Value::Int(i64::from(*bits as i16)),
            Primitive::Int32 => Value::Int(i64::from(*bits as i32)),
            _ => Value::Int(*bits as i64),
        },
        (_, Raw::Text(text)) => Value::Text(text.as_str().into()),
        (WireType::Interface { name }, Raw::Message(fields)) => {
            let interface = all.iter().find(|interface| interface.name == *name).unwrap();
            let names = Fields::new(interface.fields.iter().map(|field| field.name.as_str()));
            let values = interface.fields.iter().zip(fields).map(|(field, raw)| meant(&field.ty, raw, all));
            Record::new(&names, values.collect()).into()
        }
        (WireType::Array { of, .. } | WireType::Sequence { of, .. }, Raw::Items(items)) => {
            Value::List(items.iter().map(|item| meant(of, item, all)).collect())
        }
        other => panic!("{other:?}"),
    }
}

/// Numbers from a seed.
fn stream(mut state: u64) -> impl FnMut() -> u64 {
    move || {
        // Knuth's linear congruential generator, with its better bits in front.
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        state ^ state >> 32 | state << 32
    }
}

fn message(all: &[Interface], seed: u64) -> (WireType, Raw) {
    let ty = WireType::Interface { name: all.last().unwrap().name.clone() };
    let raw = raw(&ty, all, &mut stream(seed));
    (ty, raw)
}

/// How many values there are in a value, with itself.
fn count(value: &Value) -> usize {
    1 + match value {
        Value::List(items) => items.iter().map(count).sum(),
        Value::Record(record) => record.values().iter().map(count).sum(),
        _ => 0,
    }
}

fn codec(all: &[Interface], wanted: &Wanted) -> Codec {
    Codec::new(all, &all.last().unwrap().name, wanted).unwrap()
}

proptest! {
    #[test]
    fn a_message_is_read_as_it_is_meant_and_written_back_byte_for_byte(all in interfaces(), seed: u64) {
        let (ty, raw) = message(&all, seed);
        let bytes = bytes(&all, &raw);
        let codec = codec(&all, &Wanted::All);
        codec.check(&bytes).unwrap();
        let value = codec.read(Arc::clone(&bytes)).unwrap();
        prop_assert!(value.is_same(&meant(&ty, &raw, &all)), "{value:?}");
        prop_assert!(Arc::ptr_eq(&codec.write(&value).unwrap(), &bytes), "it is not even copied");
        let anew = codec.write(&meant(&ty, &raw, &all)).unwrap();
        prop_assert_eq!(&*anew, &*bytes);
    }

    #[test]
    fn what_is_wanted_is_read_and_what_is_changed_is_all_that_changes(
        all in interfaces(), seeds: [u64; 2], chosen: prop::sample::Index,
    ) {
        let interface = all.last().unwrap();
        let at = chosen.index(interface.fields.len());
        let name = interface.fields[at].name.clone();
        let mut wanted = Wanted::nothing();
        wanted.add([name.as_str()].into_iter());
        let codec = codec(&all, &wanted);
        let [(ty, before), (_, other)] = seeds.map(|seed| message(&all, seed));
        let mut value = codec.read(bytes(&all, &before)).unwrap();
        let Value::Record(record) = &value else { panic!("{value:?}") };
        prop_assert_eq!(record.fields().names().len(), 1);
        // That field of the other message takes the place of this one's.
        let (Raw::Message(mut changed), Raw::Message(others)) = (before.clone(), other.clone()) else { panic!() };
        changed[at] = others[at].clone();
        let (Value::Record(theirs), Value::Record(mine)) = (meant(&ty, &other, &all), &mut value) else { panic!() };
        *mine.get_mut(&name).unwrap() = theirs.get(&name).unwrap().clone();
        let written = codec.write(&value).unwrap();
        prop_assert_eq!(&*written, &*bytes(&all, &Raw::Message(changed)));
    }

    #[test]
    fn broken_messages_are_refused_and_take_no_more_memory_than_they_have(
        all in interfaces(), seed: u64, cut: prop::sample::Index, hit: prop::sample::Index, byte: u8,
    ) {
        let (_, raw) = message(&all, seed);
        let whole = bytes(&all, &raw);
        let codec = codec(&all, &Wanted::All);
        prop_assert!(codec.read(whole[..cut.index(whole.len())].into()).is_err());
        prop_assert_eq!(
            codec.read([&whole[..], &[0]].concat().into()),
            Err(CodecError::Long { surplus: 1 })
        );
        let mut broken = whole.to_vec();
        broken[hit.index(whole.len())] = byte;
        if let Ok(value) = codec.read(broken.clone().into()) {
            // Each number and text has a byte at least, and these layouts nest less than ten deep.
            prop_assert!(count(&value) <= 10 * broken.len(), "{value:?}");
            prop_assert_eq!(&*codec.write(&value).unwrap(), &broken[..]);
        }
    }
}

fn single(ty: WireType) -> [Interface; 1] {
    [Interface { name: "p/msg/M".to_owned(), fields: vec![field(0, ty)] }]
}

fn number(name: &str, primitive: Primitive) -> InterfaceField {
    InterfaceField { name: name.to_owned(), ty: WireType::Primitive { primitive } }
}

fn nested(name: &str, of: &str) -> InterfaceField {
    InterfaceField { name: name.to_owned(), ty: WireType::Interface { name: of.to_owned() } }
}

#[test]
fn errors_say_where() {
    let read = |ty: WireType, bytes: &[u8]| codec(&single(ty), &Wanted::All).read(bytes.into()).unwrap_err();
    let number = |primitive| WireType::Primitive { primitive };
    let sequence = |of, bound| WireType::Sequence { of: Box::new(of), bound };
    let shown = [
        read(number(Primitive::Float64), &[1, 2, 3]),
        read(number(Primitive::Uint64), &[255, 255, 255, 255, 255, 255, 255, 255]),
        read(number(Primitive::Int8), &[1, 0]),
        read(sequence(number(Primitive::Int8), Some(2)), &[3, 0, 0, 0, 1, 2, 3]),
        read(sequence(WireType::String, None), &[2, 0, 0, 0, 1, 0, 0, 0, 0, 255, 255, 255]),
        read(sequence(number(Primitive::Float64), None), &[255, 255, 255, 127]),
    ]
    .map(|error| error.to_string());
    insta::assert_snapshot!(shown.join("\n"));
}

#[test]
fn layouts_beyond_all_measure_are_refused() {
    let interface =
        |at: usize, ty: &WireType| Interface { name: format!("p/msg/M{at}"), fields: vec![field(0, ty.clone())] };
    let array = |of: WireType| WireType::Array { of: Box::new(of), length: 1 << 20 };
    let once = array(WireType::Primitive { primitive: Primitive::Uint8 });
    let twice = array(WireType::Interface { name: "p/msg/M0".to_owned() });
    let error = Codec::new(&[interface(0, &once), interface(1, &twice)], "p/msg/M1", &Wanted::All).unwrap_err();
    assert_eq!(error.to_string(), "interface `p/msg/M1` is larger than 268435456 bytes");
    let wide = Codec::new(&single(WireType::WString), "p/M", &Wanted::All).unwrap_err();
    assert_eq!(wide, LayoutError::Wide { name: "p/msg/M".into(), field: "f0".into() });
    let missing = Codec::new(&[], "p/M", &Wanted::All).unwrap_err();
    assert_eq!(missing, LayoutError::Missing { name: "p/M".into() });
}

#[test]
fn what_has_no_bytes_is_not_there_without_end() {
    let nothing = Interface { name: "p/msg/Nothing".into(), fields: Vec::new() };
    let of = WireType::Interface { name: "p/Nothing".into() };
    let many = WireType::Sequence { of: Box::new(of), bound: None };
    let all = [nothing, Interface { name: "p/msg/M".into(), fields: vec![field(0, many)] }];
    let codec = codec(&all, &Wanted::All);
    assert_eq!(codec.read([3, 0, 0, 0][..].into()).unwrap().at(&["f0"]).map(count), Some(4));
    let error = codec.read([255; 4][..].into()).unwrap_err().to_string();
    assert_eq!(error, "field `f0`: 4294967295 elements are more than the 65536 that it may have");
}

#[test]
fn numbers_beyond_the_range_of_their_field_become_its_nearest() {
    let written = |primitive, value: Value| {
        let codec = codec(&single(WireType::Primitive { primitive }), &Wanted::All);
        let message = Record::new(&Fields::new(["f0"]), vec![value]);
        let read = codec.read(codec.write(&message.into()).unwrap()).unwrap();
        read.number_at(&["f0"]).unwrap()
    };
    assert_eq!(written(Primitive::Uint8, Value::Int(300)), 255.0);
    assert_eq!(written(Primitive::Int16, Value::Int(-40_000)), -32_768.0);
    assert_eq!(written(Primitive::Float32, Value::Real(0.1)), f64::from(0.1f32));
}

/// A header as ROS 2 has it, or as ROS 1 does, in a message with a time, a duration and a point.
fn stamped(seq: bool) -> Vec<Interface> {
    let time = |name: &str, sec| Interface {
        name: name.into(),
        fields: vec![number("sec", sec), number("nanosec", Primitive::Uint32)],
    };
    let seq = seq.then(|| number("seq", Primitive::Uint32));
    let rest = [nested("stamp", "builtin_interfaces/msg/Time"), field(1, WireType::String)];
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
        let codec = codec(&stamped(seq), &Wanted::All);
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
    let codec = codec(&stamped(false), &Wanted::All);
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
