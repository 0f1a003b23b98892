//! The codec beside a naive one that knows nothing of selections, origins and runs.

#![expect(clippy::cast_possible_truncation, clippy::cast_possible_wrap, reason = "bits are cut to their primitive")]

use std::sync::Arc;

use proptest::collection::vec;
use proptest::prelude::*;
use sesame_plan::{Interface, InterfaceField, Primitive, WireType};
use sesame_relay::value::{Fields, Record, Value};

use super::{Codec, CodecError, Wanted};

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

/// A value as it is on the wire: the bits of primitives, the code units of texts.
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
        WString,
        Before(prop::sample::Index),
        Array(Box<Shape>, u32),
        Sequence(Box<Shape>),
    }
    fn ty(shape: &Shape, before: &[Interface]) -> WireType {
        match shape {
            Shape::Primitive(at) => WireType::Primitive { primitive: PRIMITIVES[*at] },
            Shape::String => WireType::String,
            Shape::WString => WireType::WString,
            Shape::Before(_) if before.is_empty() => WireType::String,
            Shape::Before(at) => WireType::Interface { name: at.get(before).name.clone() },
            Shape::Array(of, length) => WireType::Array { of: Box::new(ty(of, before)), length: *length },
            Shape::Sequence(of) => WireType::Sequence { of: Box::new(ty(of, before)), bound: None },
        }
    }
    let leaf = prop_oneof![
        4 => (0..PRIMITIVES.len()).prop_map(Shape::Primitive),
        1 => Just(Shape::String),
        1 => Just(Shape::WString),
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
fn encode(ty: &WireType, raw: &Raw, all: &[Interface], little: bool, out: &mut Vec<u8>) {
    let mut number = |bits: u64, size: usize| {
        while !(out.len() - 4).is_multiple_of(size) {
            out.push(0);
        }
        for at in 0..size {
            let shift = if little { at } else { size - 1 - at };
            out.push((bits >> (8 * shift)) as u8);
        }
    };
    match (ty, raw) {
        (WireType::Primitive { primitive }, Raw::Bits(bits)) => number(*bits, primitive.size()),
        (WireType::String, Raw::Text(text)) => {
            number(text.len() as u64 + 1, 4);
            out.extend(text.bytes().chain([0]));
        }
        (WireType::WString, Raw::Text(text)) => {
            number(text.encode_utf16().count() as u64, 4);
            text.encode_utf16().for_each(|unit| number(u64::from(unit), 4));
        }
        (WireType::Interface { name }, Raw::Message(fields)) => {
            let interface = all.iter().find(|interface| interface.name == *name).unwrap();
            for (field, raw) in interface.fields.iter().zip(fields) {
                encode(&field.ty, raw, all, little, out);
            }
        }
        (WireType::Array { of, .. }, Raw::Items(items)) => {
            for item in items {
                encode(of, item, all, little, out);
            }
        }
        (WireType::Sequence { of, .. }, Raw::Items(items)) => {
            number(items.len() as u64, 4);
            for item in items {
                encode(of, item, all, little, out);
            }
        }
        other => panic!("{other:?}"),
    }
}

fn sample(all: &[Interface], raw: &Raw, little: bool) -> Arc<[u8]> {
    let mut out = vec![0, u8::from(little), 0, 0];
    let name = all.last().unwrap().name.clone();
    encode(&WireType::Interface { name }, raw, all, little, &mut out);
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
    fn a_sample_is_read_as_it_is_meant_and_written_back_byte_for_byte(
        all in interfaces(), seed: u64, little: bool,
    ) {
        let (ty, raw) = message(&all, seed);
        let sample = sample(&all, &raw, little);
        let value = codec(&all, &Wanted::All).read(Arc::clone(&sample)).unwrap();
        prop_assert!(value.is_same(&meant(&ty, &raw, &all)), "{value:?}");
        let written = codec(&all, &Wanted::All).write(&value).unwrap();
        prop_assert!(Arc::ptr_eq(&written, &sample), "it is not even copied");
        // Without its sample the message is encoded anew, in the byte order of most machines.
        let anew = codec(&all, &Wanted::All).write(&meant(&ty, &raw, &all)).unwrap();
        prop_assert_eq!(&*anew, &*self::sample(&all, &raw, true));
    }

    #[test]
    fn what_is_wanted_is_read_and_what_is_changed_is_all_that_changes(
        all in interfaces(), seeds: [u64; 2], little: bool, chosen: prop::sample::Index,
    ) {
        let interface = all.last().unwrap();
        let at = chosen.index(interface.fields.len());
        let name = interface.fields[at].name.clone();
        let mut wanted = Wanted::nothing();
        wanted.add([name.as_str()].into_iter());
        let codec = codec(&all, &wanted);
        let [(ty, before), (_, other)] = seeds.map(|seed| message(&all, seed));
        let mut value = codec.read(sample(&all, &before, little)).unwrap();
        let Value::Record(record) = &value else { panic!("{value:?}") };
        prop_assert_eq!(record.fields().names().len(), 1);
        // That field of the other message takes the place of this one's.
        let (Raw::Message(mut changed), Raw::Message(others)) = (before.clone(), other.clone()) else { panic!() };
        changed[at] = others[at].clone();
        let (Value::Record(theirs), Value::Record(mine)) = (meant(&ty, &other, &all), &mut value) else { panic!() };
        *mine.get_mut(&name).unwrap() = theirs.get(&name).unwrap().clone();
        let written = codec.write(&value).unwrap();
        prop_assert_eq!(&*written, &*sample(&all, &Raw::Message(changed), little));
    }

    #[test]
    fn broken_samples_are_refused_and_take_no_more_memory_than_they_have(
        all in interfaces(), seed: u64, little: bool, cut: prop::sample::Index, hit: prop::sample::Index, byte: u8,
    ) {
        let (_, raw) = message(&all, seed);
        let whole = sample(&all, &raw, little);
        let codec = codec(&all, &Wanted::All);
        let short: Arc<[u8]> = whole[..cut.index(whole.len())].into();
        // Padding may be missing at the end of nothing only; whatever is read, it does not panic.
        let _ = codec.read(short);
        let mut broken = whole.to_vec();
        broken[hit.index(whole.len())] = byte;
        if let Ok(value) = codec.read(broken.clone().into()) {
            // Each number and text has a byte at least, and these layouts nest less than ten deep.
            prop_assert!(count(&value) <= 10 * broken.len(), "{value:?}");
            prop_assert_eq!(&*codec.write(&value).unwrap(), &broken[..]);
        }
    }
}

#[test]
fn wide_text_is_as_the_nodes_of_ros_write_it() {
    // The first field of `test_msgs/msg/WStrings`, as rclpy serialises it.
    let units = [0x61u32, 0xdf, 0xd834, 0xdd1e];
    let mut sample = vec![0, 1, 0, 0, 4, 0, 0, 0];
    sample.extend(units.into_iter().flat_map(u32::to_le_bytes));
    let codec = codec(&single(WireType::WString), &Wanted::All);
    let value = codec.read(sample.clone().into()).unwrap();
    assert_eq!(value.at(&["f0"]), Some(&Value::Text("aß𝄞".into())));
    let anew = Record::new(&Fields::new(["f0"]), vec![Value::Text("aß𝄞".into())]);
    assert_eq!(&*codec.write(&anew.into()).unwrap(), &sample[..]);
}

#[test]
fn a_changed_message_does_not_announce_the_padding_of_its_sample() {
    let codec = codec(&single(WireType::String), &Wanted::All);
    let mut value = codec.read([0, 1, 0, 2, 2, 0, 0, 0, b'a', 0, 0, 0][..].into()).unwrap();
    *value.at_mut(&["f0"]).unwrap() = Value::Text("abc".into());
    assert_eq!(&*codec.write(&value).unwrap(), &[0, 1, 0, 0, 4, 0, 0, 0, b'a', b'b', b'c', 0]);
}

fn single(ty: WireType) -> [Interface; 1] {
    [Interface { name: "p/msg/M".to_owned(), fields: vec![field(0, ty)] }]
}

#[test]
fn errors_say_where() {
    let read = |ty: WireType, sample: &[u8]| codec(&single(ty), &Wanted::All).read(sample.into()).unwrap_err();
    let number = |primitive| WireType::Primitive { primitive };
    let sequence = |of| WireType::Sequence { of: Box::new(of), bound: Some(2) };
    let shown = [
        read(number(Primitive::Float64), &[0, 1, 0, 0, 1, 2, 3]),
        read(number(Primitive::Uint64), &[0, 1, 0, 0, 255, 255, 255, 255, 255, 255, 255, 255]),
        read(number(Primitive::Int8), &[0, 7, 0, 0, 1]),
        read(number(Primitive::Int8), &[0]),
        read(number(Primitive::Int8), &[0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0]),
        read(sequence(number(Primitive::Int8)), &[0, 1, 0, 0, 3, 0, 0, 0, 1, 2, 3]),
        read(sequence(WireType::String), &[0, 1, 0, 0, 2, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 255, 255, 255, 255]),
        read(
            WireType::Sequence { of: Box::new(number(Primitive::Float64)), bound: None },
            &[0, 1, 0, 0, 255, 255, 255, 127],
        ),
    ]
    .map(|error| error.to_string());
    insta::assert_snapshot!(shown.join("\n"));
}

#[test]
fn layouts_beyond_all_measure_are_refused() {
    let interface =
        |at: usize, ty: &WireType| Interface { name: format!("p/msg/M{at}"), fields: vec![field(0, ty.clone())] };
    let array = |of: WireType| WireType::Array { of: Box::new(of), length: 1 << 20 };
    // Nothing at all, 2^20 times, and 2^20 times that.
    let nothing = Interface { name: "p/msg/M0".to_owned(), fields: Vec::new() };
    let [once, twice] = [0, 1].map(|at| array(WireType::Interface { name: format!("p/msg/M{at}") }));
    let all = [nothing, interface(1, &once), interface(2, &twice)];
    let error = Codec::new(&all, "p/msg/M2", &Wanted::All).unwrap_err().to_string();
    assert_eq!(error, "interface `p/msg/M2` is larger than 268435456 bytes");
    assert!(Codec::new(&all, "p/msg/M1", &Wanted::All).is_ok());
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
    assert_eq!(written(Primitive::Uint32, Value::Int(-1)), 0.0);
    assert_eq!(written(Primitive::Int16, Value::Int(-40_000)), -32_768.0);
    assert_eq!(written(Primitive::Float32, Value::Real(0.1)), f64::from(0.1f32));
}

#[test]
fn points_and_times_are_what_they_are_in_the_language() {
    let real = |name: &str| InterfaceField {
        name: name.to_owned(),
        ty: WireType::Primitive { primitive: Primitive::Float32 },
    };
    let number =
        |name: &str, primitive| InterfaceField { name: name.to_owned(), ty: WireType::Primitive { primitive } };
    let nested = |name: &str, of: &str| InterfaceField {
        name: name.to_owned(),
        ty: WireType::Interface { name: of.to_owned() },
    };
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
    let codec = codec(&all, &Wanted::All);
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
    let codec = Codec::new(&interfaces, "p/msg/M", &Wanted::All).unwrap();
    let mut sample = vec![0, 1, 0, 0];
    sample.extend([0; 8]);
    // Padding, and four bytes for each of both.
    sample.extend([0xaa; 15]);
    assert!(codec.read(sample.clone().into()).is_ok());
    sample.push(0xaa);
    assert_eq!(codec.read(sample.into()), Err(CodecError::Long { surplus: 16 }));
}

#[test]
fn wide_text_is_what_fast_dds_writes() {
    let interfaces = [Interface { name: "p/msg/M".to_owned(), fields: vec![field(0, WireType::WString)] }];
    let codec = Codec::new(&interfaces, "p/msg/M", &Wanted::All).unwrap();
    // `test_msgs/msg/WStrings` in ROS 2 Kilted: the number of code units of UTF-16, and four bytes for each.
    let units = [5, 0x61, 0xdf, 0x20ac, 0xd834, 0xdd1e];
    let sample: Vec<u8> = [0, 1, 0, 0].into_iter().chain(units.into_iter().flat_map(u32::to_le_bytes)).collect();
    let value = codec.read(sample.clone().into()).unwrap();
    assert_eq!(value.at(&["f0"]), Some(&Value::Text("aß€𝄞".into())));
    let Value::Record(record) = &value else { panic!("a message is a record") };
    let anew = Record::new(record.fields(), record.values().to_vec());
    assert_eq!(*codec.write(&anew.into()).unwrap(), *sample);
}
