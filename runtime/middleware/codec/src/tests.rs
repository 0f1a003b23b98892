//! The codec of each dialect compared with a naive one that knows nothing of selections, origins and runs.

#![expect(clippy::cast_possible_truncation, clippy::cast_possible_wrap, reason = "bits are cut to their primitive")]

use std::sync::Arc;

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::test_runner::TestCaseResult;
use sesame_plan::{Interface, InterfaceField, Primitive, WireType};
use sesame_relay::value::{Fields, Record, Value};
use sesame_relay::wire::Wanted;

use crate::cdr::Cdr;
use crate::codec::Codec;
use crate::dialect::Dialect;
use crate::error::{CodecError, LayoutError};
use crate::ros1::Ros1;

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

/// A value as it is on the wire: the bits of primitives, the characters of texts.
#[derive(Debug, Clone, PartialEq)]
enum Raw {
    Bits(u64),
    Text(String),
    Items(Vec<Raw>),
    Message(Vec<Raw>),
}

/// What a dialect is to the naive encoding, apart from all that the codec says of it.
#[derive(Debug, Clone, Copy)]
struct Naive {
    /// The bytes before a message, by whether it is little-endian.
    header: fn(bool) -> Vec<u8>,
    aligned: bool,
    terminated: bool,
    /// Whether messages need not be little-endian, and end with their last field.
    cdr: bool,
}

const CDR: Naive =
    Naive { header: |little| vec![0, u8::from(little), 0, 0], aligned: true, terminated: true, cdr: true };

const ROS_1: Naive = Naive { header: |_| Vec::new(), aligned: false, terminated: false, cdr: false };

pub(crate) fn field(at: usize, ty: WireType) -> InterfaceField {
    InterfaceField { name: format!("f{at}"), ty }
}

pub(crate) fn single(ty: WireType) -> [Interface; 1] {
    [Interface { name: "p/msg/M".to_owned(), fields: vec![field(0, ty)] }]
}

pub(crate) fn number(name: &str, primitive: Primitive) -> InterfaceField {
    InterfaceField { name: name.to_owned(), ty: WireType::Primitive { primitive } }
}

pub(crate) fn nested(name: &str, of: &str) -> InterfaceField {
    InterfaceField { name: name.to_owned(), ty: WireType::Interface { name: of.to_owned() } }
}

pub(crate) fn codec<D: Dialect>(all: &[Interface], wanted: &Wanted) -> Codec<D> {
    Codec::new(all, &all.last().unwrap().name, wanted).unwrap()
}

/// Interfaces, each of fields of any type over those before it.
fn interfaces() -> impl Strategy<Value = Vec<Interface>> {
    #[derive(Debug, Clone)]
    enum AnyType {
        Primitive(usize),
        String,
        WString,
        Before(prop::sample::Index),
        Array(Box<AnyType>, u32),
        Sequence(Box<AnyType>),
    }
    fn ty(drawn: &AnyType, before: &[Interface]) -> WireType {
        match drawn {
            AnyType::Primitive(at) => WireType::Primitive { primitive: PRIMITIVES[*at] },
            AnyType::String => WireType::STRING,
            AnyType::WString => WireType::WSTRING,
            AnyType::Before(_) if before.is_empty() => WireType::STRING,
            AnyType::Before(at) => WireType::Interface { name: at.get(before).name.clone() },
            AnyType::Array(of, length) => WireType::Array { of: Box::new(ty(of, before)), length: *length },
            AnyType::Sequence(of) => WireType::Sequence { of: Box::new(ty(of, before)), bound: None },
        }
    }
    let leaf = prop_oneof![
        4 => (0..PRIMITIVES.len()).prop_map(AnyType::Primitive),
        1 => Just(AnyType::String),
        1 => Just(AnyType::WString),
        2 => any::<prop::sample::Index>().prop_map(AnyType::Before),
    ];
    let drawn = leaf.prop_recursive(2, 6, 1, |inner| {
        prop_oneof![
            (inner.clone(), 1u32..4).prop_map(|(of, length)| AnyType::Array(Box::new(of), length)),
            inner.prop_map(|of| AnyType::Sequence(Box::new(of))),
        ]
    });
    vec(vec(drawn, 1..6), 1..4).prop_map(|interfaces| {
        let mut made = Vec::new();
        for (at, drawn) in interfaces.iter().enumerate() {
            let fields = drawn.iter().enumerate().map(|(at, drawn)| field(at, ty(drawn, &made))).collect();
            made.push(Interface { name: format!("p/msg/M{at}"), fields });
        }
        made
    })
}

/// The same interfaces with text in place of wide text.
fn without_wide(all: &[Interface]) -> Vec<Interface> {
    fn narrow(ty: &WireType) -> WireType {
        match ty {
            WireType::WString { .. } => WireType::STRING,
            WireType::Array { of, length } => WireType::Array { of: Box::new(narrow(of)), length: *length },
            WireType::Sequence { of, bound } => WireType::Sequence { of: Box::new(narrow(of)), bound: *bound },
            other => other.clone(),
        }
    }
    let field = |field: &InterfaceField| InterfaceField { name: field.name.clone(), ty: narrow(&field.ty) };
    let fields = |interface: &Interface| interface.fields.iter().map(field).collect();
    all.iter().map(|interface| Interface { name: interface.name.clone(), fields: fields(interface) }).collect()
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
        WireType::String { .. } | WireType::WString { .. } => {
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

/// The naive encoding: without a header, so that places are counted from the first field.
fn encode(naive: Naive, ty: &WireType, raw: &Raw, all: &[Interface], little: bool, out: &mut Vec<u8>) {
    let mut number = |bits: u64, size: usize| {
        while naive.aligned && !out.len().is_multiple_of(size) {
            out.push(0);
        }
        for at in 0..size {
            let shift = if little { at } else { size - 1 - at };
            out.push((bits >> (8 * shift)) as u8);
        }
    };
    match (ty, raw) {
        (WireType::Primitive { primitive }, Raw::Bits(bits)) => number(*bits, primitive.size()),
        (WireType::String { .. }, Raw::Text(text)) => {
            let zero: &[u8] = if naive.terminated { &[0] } else { &[] };
            number((text.len() + zero.len()) as u64, 4);
            out.extend([text.as_bytes(), zero].concat());
        }
        (WireType::WString { .. }, Raw::Text(text)) => {
            number(text.encode_utf16().count() as u64, 4);
            text.encode_utf16().for_each(|unit| number(u64::from(unit), 4));
        }
        (WireType::Interface { name }, Raw::Message(fields)) => {
            let interface = all.iter().find(|interface| interface.name == *name).unwrap();
            for (field, raw) in interface.fields.iter().zip(fields) {
                encode(naive, &field.ty, raw, all, little, out);
            }
        }
        (WireType::Array { of, .. }, Raw::Items(items)) => {
            for item in items {
                encode(naive, of, item, all, little, out);
            }
        }
        (WireType::Sequence { of, .. }, Raw::Items(items)) => {
            number(items.len() as u64, 4);
            for item in items {
                encode(naive, of, item, all, little, out);
            }
        }
        other => panic!("{other:?}"),
    }
}

fn bytes(naive: Naive, all: &[Interface], raw: &Raw, little: bool) -> Arc<[u8]> {
    let mut out = Vec::new();
    let name = all.last().unwrap().name.clone();
    encode(naive, &WireType::Interface { name }, raw, all, little, &mut out);
    [(naive.header)(little), out].concat().into()
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

fn is_read_and_written_back<D: Dialect>(naive: Naive, all: &[Interface], seed: u64, little: bool) -> TestCaseResult {
    let (ty, raw) = message(all, seed);
    let bytes = bytes(naive, all, &raw, little);
    let codec = codec::<D>(all, &Wanted::All);
    codec.check(&bytes).unwrap();
    let value = codec.read(Arc::clone(&bytes)).unwrap();
    prop_assert!(value.is_same(&meant(&ty, &raw, all)), "{value:?}");
    prop_assert!(Arc::ptr_eq(&codec.write(&value).unwrap(), &bytes), "it is not even copied");
    // Without its bytes the message is encoded anew, in the byte order of most machines.
    let anew = codec.write(&meant(&ty, &raw, all)).unwrap();
    prop_assert_eq!(&*anew, &*self::bytes(naive, all, &raw, true));
    Ok(())
}

fn only_what_is_changed_changes<D: Dialect>(
    naive: Naive,
    all: &[Interface],
    seeds: [u64; 2],
    little: bool,
    chosen: prop::sample::Index,
) -> TestCaseResult {
    let interface = all.last().unwrap();
    let at = chosen.index(interface.fields.len());
    let name = interface.fields[at].name.clone();
    let mut wanted = Wanted::nothing();
    wanted.add([name.as_str()].into_iter());
    let codec = codec::<D>(all, &wanted);
    let [(ty, before), (_, other)] = seeds.map(|seed| message(all, seed));
    let mut value = codec.read(bytes(naive, all, &before, little)).unwrap();
    let Value::Record(record) = &value else { panic!("{value:?}") };
    prop_assert_eq!(record.fields().names().len(), 1);
    // That field of the other message takes the place of this one's.
    let (Raw::Message(mut changed), Raw::Message(others)) = (before.clone(), other.clone()) else { panic!() };
    changed[at] = others[at].clone();
    let (Value::Record(theirs), Value::Record(mine)) = (meant(&ty, &other, all), &mut value) else { panic!() };
    *mine.get_mut(&name).unwrap() = theirs.get(&name).unwrap().clone();
    let written = codec.write(&value).unwrap();
    prop_assert_eq!(&*written, &*bytes(naive, all, &Raw::Message(changed), little));
    Ok(())
}

fn broken_ones_are_refused<D: Dialect>(
    naive: Naive,
    all: &[Interface],
    seed: u64,
    little: bool,
    [cut, hit]: [prop::sample::Index; 2],
    byte: u8,
) -> TestCaseResult {
    let (_, raw) = message(all, seed);
    let whole = bytes(naive, all, &raw, little);
    let codec = codec::<D>(all, &Wanted::All);
    // In CDR, padding may be missing behind the last field, or follow it; whatever is read, it does not panic.
    let short = codec.read(whole[..cut.index(whole.len())].into());
    prop_assert!(naive.cdr || short.is_err());
    let long = codec.read([&whole[..], &[0]].concat().into());
    prop_assert!(naive.cdr || long == Err(CodecError::Long { surplus: 1 }), "{long:?}");
    let mut broken = whole.to_vec();
    broken[hit.index(whole.len())] = byte;
    if let Ok(value) = codec.read(broken.clone().into()) {
        // Each number and text has a byte at least, and these layouts nest less than ten deep.
        prop_assert!(count(&value) <= 10 * broken.len(), "{value:?}");
        prop_assert_eq!(&*codec.write(&value).unwrap(), &broken[..]);
    }
    Ok(())
}

proptest! {
    #[test]
    fn a_message_is_read_as_it_is_meant_and_written_back_byte_for_byte(all in interfaces(), seed: u64, little: bool) {
        is_read_and_written_back::<Cdr>(CDR, &all, seed, little)?;
        is_read_and_written_back::<Ros1>(ROS_1, &without_wide(&all), seed, true)?;
    }

    #[test]
    fn what_is_wanted_is_read_and_what_is_changed_is_all_that_changes(
        all in interfaces(), seeds: [u64; 2], little: bool, chosen: prop::sample::Index,
    ) {
        only_what_is_changed_changes::<Cdr>(CDR, &all, seeds, little, chosen)?;
        only_what_is_changed_changes::<Ros1>(ROS_1, &without_wide(&all), seeds, true, chosen)?;
    }

    #[test]
    fn broken_messages_are_refused_and_take_no_more_memory_than_they_have(
        all in interfaces(), seed: u64, little: bool, places: [prop::sample::Index; 2], byte: u8,
    ) {
        broken_ones_are_refused::<Cdr>(CDR, &all, seed, little, places, byte)?;
        broken_ones_are_refused::<Ros1>(ROS_1, &without_wide(&all), seed, true, places, byte)?;
    }
}

/// The errors of these messages, each of one field.
fn errors<D: Dialect>(messages: &[(WireType, &[u8])]) -> String {
    let read = |(ty, bytes): &(WireType, &[u8])| {
        codec::<D>(&single(ty.clone()), &Wanted::All).read((*bytes).into()).unwrap_err().to_string()
    };
    messages.iter().map(read).collect::<Vec<_>>().join("\n")
}

fn of(primitive: Primitive) -> WireType {
    WireType::Primitive { primitive }
}

fn sequence(of: WireType, bound: Option<u32>) -> WireType {
    WireType::Sequence { of: Box::new(of), bound }
}

#[test]
fn errors_in_cdr_say_where() {
    insta::assert_snapshot!(errors::<Cdr>(&[
        (of(Primitive::Float64), &[0, 1, 0, 0, 1, 2, 3]),
        (of(Primitive::Uint64), &[0, 1, 0, 0, 255, 255, 255, 255, 255, 255, 255, 255]),
        (of(Primitive::Int8), &[0, 7, 0, 0, 1]),
        (of(Primitive::Int8), &[0]),
        (of(Primitive::Int8), &[0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0]),
        (sequence(of(Primitive::Int8), Some(2)), &[0, 1, 0, 0, 3, 0, 0, 0, 1, 2, 3]),
        (sequence(WireType::STRING, Some(2)), &[0, 1, 0, 0, 2, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 255, 255, 255, 255],),
        (sequence(of(Primitive::Float64), None), &[0, 1, 0, 0, 255, 255, 255, 127]),
    ]));
}

#[test]
fn errors_in_ros_1_say_where() {
    insta::assert_snapshot!(errors::<Ros1>(&[
        (of(Primitive::Float64), &[1, 2, 3]),
        (of(Primitive::Uint64), &[255, 255, 255, 255, 255, 255, 255, 255]),
        (of(Primitive::Int8), &[1, 0]),
        (sequence(of(Primitive::Int8), Some(2)), &[3, 0, 0, 0, 1, 2, 3]),
        (sequence(WireType::STRING, None), &[2, 0, 0, 0, 1, 0, 0, 0, 0, 255, 255, 255]),
        (sequence(of(Primitive::Float64), None), &[255, 255, 255, 127]),
    ]));
}

fn are_refused_beyond_all_measure<D: Dialect>() {
    let interface =
        |at: usize, ty: &WireType| Interface { name: format!("p/msg/M{at}"), fields: vec![field(0, ty.clone())] };
    let array = |of: WireType| WireType::Array { of: Box::new(of), length: 1 << 20 };
    let nothing = Interface { name: "p/msg/M0".to_owned(), fields: Vec::new() };
    let byte = interface(0, &of(Primitive::Uint8));
    let [once, twice] = [0, 1].map(|at| array(WireType::Interface { name: format!("p/msg/M{at}") }));
    // Nothing at all, or a byte, 2^20 times, and 2^20 times that.
    for least in [nothing, byte] {
        let all = [least, interface(1, &once), interface(2, &twice)];
        let error = Codec::<D>::new(&all, "p/msg/M2", &Wanted::All).unwrap_err().to_string();
        assert_eq!(error, "interface `p/msg/M2` is larger than 268435456 bytes");
        assert!(Codec::<D>::new(&all, "p/msg/M1", &Wanted::All).is_ok());
    }
    let missing = Codec::<D>::new(&[], "p/M", &Wanted::All).unwrap_err();
    assert_eq!(missing, LayoutError::Missing { name: "p/M".into() });
}

#[test]
fn layouts_beyond_all_measure_are_refused() {
    are_refused_beyond_all_measure::<Cdr>();
    are_refused_beyond_all_measure::<Ros1>();
}

fn nothing_is_not_there_without_end<D: Dialect>(naive: Naive) {
    let nothing = Interface { name: "p/msg/Nothing".into(), fields: Vec::new() };
    let many = sequence(WireType::Interface { name: "p/msg/Nothing".into() }, None);
    let all = [nothing, Interface { name: "p/msg/M".into(), fields: vec![field(0, many)] }];
    let codec = codec::<D>(&all, &Wanted::All);
    let read = |length: [u8; 4]| codec.read([(naive.header)(true), length.to_vec()].concat().into());
    assert_eq!(read([3, 0, 0, 0]).unwrap().at(&["f0"]).map(count), Some(4));
    let error = read([255; 4]).unwrap_err().to_string();
    assert_eq!(error, "field `f0`: 4294967295 elements are more than the 65536 that it may have");
}

#[test]
fn what_has_no_bytes_is_not_there_without_end() {
    nothing_is_not_there_without_end::<Cdr>(CDR);
    nothing_is_not_there_without_end::<Ros1>(ROS_1);
}

fn written_as<D: Dialect>(primitive: Primitive, value: Value) -> f64 {
    let codec = codec::<D>(&single(of(primitive)), &Wanted::All);
    let message = Record::new(&Fields::new(["f0"]), vec![value]);
    let read = codec.read(codec.write(&message.into()).unwrap()).unwrap();
    read.number_at(&["f0"]).unwrap()
}

#[test]
fn numbers_beyond_the_range_of_their_field_become_its_nearest() {
    for written in [written_as::<Cdr>, written_as::<Ros1>] {
        assert_eq!(written(Primitive::Uint8, Value::Int(300)), 255.0);
        assert_eq!(written(Primitive::Uint32, Value::Int(-1)), 0.0);
        assert_eq!(written(Primitive::Int16, Value::Int(-40_000)), -32_768.0);
        assert_eq!(written(Primitive::Float32, Value::Real(0.1)), f64::from(0.1f32));
    }
}
