use proptest::prelude::*;
use sesame_interfaces::mavlink::{Definitions, LONGEST_PAYLOAD};
use sesame_plan::testing::{field, message, minimal};
use sesame_plan::{CampaignPlan, MessageId, Type};

use super::*;

// Frames that pymavlink 2.4.50 makes of the definitions beside these tests, from system 7 and component 3.
const HEARTBEAT: [u8; 21] = [253, 9, 0, 0, 41, 7, 3, 0, 0, 0, 64, 226, 1, 0, 2, 3, 81, 4, 3, 184, 80];
const HEARTBEAT_OF_VERSION_1: [u8; 17] = [254, 9, 41, 7, 3, 0, 64, 226, 1, 0, 2, 3, 81, 4, 3, 173, 104];
const HEARTBEAT_WITH_SIGNATURE: [u8; 34] = [
    253, 9, 1, 0, 9, 7, 3, 0, 0, 0, 64, 226, 1, 0, 2, 3, 81, 4, 3, 94, 227, 1, 1, 0, 0, 0, 0, 0, 94, 24, 109, 206, 220,
    55,
];
const EVERYTHING: [u8; 60] = [
    253, 48, 0, 0, 255, 7, 3, 81, 195, 0, 0, 0, 0, 0, 0, 0, 248, 191, 5, 0, 0, 0, 0, 1, 0, 0, 0, 0, 80, 64, 144, 238,
    254, 255, 1, 0, 254, 255, 44, 1, 200, 112, 111, 115, 105, 116, 105, 111, 110, 0, 0, 120, 248, 9, 0, 0, 0, 63, 18,
    85,
];
/// The same with `whole` larger by 500, and another name.
const EVERYTHING_CHANGED: [u8; 60] = [
    253, 48, 0, 0, 255, 7, 3, 81, 195, 0, 0, 0, 0, 0, 0, 0, 248, 191, 5, 0, 0, 0, 0, 1, 0, 0, 0, 0, 80, 64, 132, 240,
    254, 255, 1, 0, 254, 255, 44, 1, 200, 99, 104, 97, 110, 103, 101, 100, 32, 105, 116, 120, 248, 9, 0, 0, 0, 63, 54,
    251,
];
/// The same message with nothing but zeros.
const NOTHING: [u8; 13] = [253, 1, 0, 0, 0, 7, 3, 81, 195, 0, 0, 225, 200];

fn small() -> Definitions {
    let mut definitions = Definitions::default();
    definitions.add(include_str!("../../../interfaces/tests/small.xml")).unwrap();
    definitions
}

fn int() -> Type {
    Type::Int { unit: None }
}

fn real() -> Type {
    Type::Real { unit: None }
}

fn list(of: Type) -> Type {
    Type::List { of: Box::new(of) }
}

/// A plan whose only message has these fields.
fn plan(fields: &[(&str, Type)]) -> CampaignPlan {
    let fields = fields.iter().map(|(name, ty)| field(name, ty.clone())).collect();
    CampaignPlan { messages: vec![message("Message", fields)], ..minimal() }
}

fn layout(definition: &Definition, fields: &[(&str, Type)]) -> Result<Layout, String> {
    Layout::new(&plan(fields), &Type::Message { id: MessageId(0) }, definition)
}

fn everything() -> Layout {
    let fields = [
        ("small", int()),
        ("wide", real()),
        ("row", list(int())),
        ("name", Type::Text),
        ("time", int()),
        ("real", real()),
        ("whole", real()),
        ("letter", Type::Text),
        ("signed", int()),
        ("extra", int()),
        ("more", list(real())),
    ];
    layout(small().named("EVERYTHING").unwrap(), &fields).unwrap()
}

fn read(layout: &Layout, bytes: &[u8]) -> Result<Record, String> {
    let frame = Frame::first(bytes).unwrap();
    assert_eq!(frame.bytes, bytes);
    let Value::Record(record) = layout.read(&frame, bytes.into())? else { panic!("it is a record") };
    Ok(record)
}

#[test]
fn values_are_those_that_another_implementation_wrote() {
    let record = read(&everything(), &EVERYTHING).unwrap();
    let ints = |numbers: &[i64]| Value::List(numbers.iter().copied().map(Value::Int).collect());
    let wanted = [
        Value::Int(200),
        Value::Real(-1.5),
        ints(&[1, -2, 300]),
        Value::from("position"),
        Value::Int((1 << 40) + 5),
        Value::Real(3.25),
        Value::Real(-70_000.0),
        Value::from("x"),
        Value::Int(-8),
        Value::Int(9),
        Value::List(vec![Value::Real(0.5), Value::Real(0.0)]),
    ];
    assert_eq!(record.values(), wanted);
    assert_eq!(read(&everything(), &NOTHING).unwrap().values()[..2], [Value::Int(0), Value::Real(0.0)]);
    let armed = layout(small().named("HEARTBEAT").unwrap(), &[("base_mode", Type::Bool)]).unwrap();
    assert_eq!(read(&armed, &HEARTBEAT).unwrap().values(), [Value::Bool(true)]);
    let heartbeat = layout(small().named("HEARTBEAT").unwrap(), &[("custom_mode", int())]).unwrap();
    for bytes in [&HEARTBEAT[..], &HEARTBEAT_OF_VERSION_1, &HEARTBEAT_WITH_SIGNATURE] {
        assert_eq!(read(&heartbeat, bytes).unwrap().values(), [Value::Int(123_456)]);
    }
}

#[test]
fn frames_are_those_that_another_implementation_reads() {
    let layout = everything();
    let before = read(&layout, &EVERYTHING).unwrap();
    let mut now = before.clone();
    *now.get_mut("whole").unwrap() = Value::Real(-69_500.2);
    *now.get_mut("name").unwrap() = Value::from("changed it, and is too long");
    let frame = Frame::first(&EVERYTHING).unwrap();
    assert_eq!(layout.write(&frame, before.values(), now.values()), EVERYTHING_CHANGED);
    assert_eq!(layout.write(&frame, before.values(), before.values()), EVERYTHING);
    let sender = Sender { system: 7, component: 3, sequence: 255 };
    assert_eq!(layout.make(sender, before.values()), EVERYTHING);
    assert_eq!(layout.make(Sender { sequence: 0, ..sender }, read(&layout, &NOTHING).unwrap().values()), NOTHING);
}

#[test]
fn a_changed_frame_of_version_1_stays_one() {
    let layout = layout(small().named("HEARTBEAT").unwrap(), &[("type", int())]).unwrap();
    let frame = Frame::first(&HEARTBEAT_OF_VERSION_1).unwrap();
    let written = layout.write(&frame, &[Value::Int(2)], &[Value::Int(1000)]);
    let read = read(&layout, &written).unwrap();
    assert_eq!(read.values(), [Value::Int(255)], "a number is held inside the range of its field");
    assert_eq!((written.len(), written[0]), (17, 0xFE));
}

#[test]
fn frames_that_are_damaged_or_of_another_definition_are_not_read() {
    let layout = everything();
    let mut damaged = EVERYTHING;
    damaged[20] ^= 1;
    assert!(read(&layout, &damaged).unwrap_err().contains("its checksum is not that of a `EVERYTHING`"));
    let mut later = HEARTBEAT;
    later[2] = 2;
    assert!(read(&layout, &later).unwrap_err().contains("its flags ask for something"));
    for bytes in [&HEARTBEAT[..20], &HEARTBEAT_WITH_SIGNATURE[..33], &[0xFE], &[0xFD; 9], &[0x55; 30], &[]] {
        assert_eq!(Frame::first(bytes), None, "{bytes:?}");
    }
    let two = [&HEARTBEAT[..], &EVERYTHING].concat();
    assert_eq!(Frame::first(&two).unwrap().bytes, HEARTBEAT);
}

#[test]
fn fields_that_do_not_fit_are_said() {
    let definitions = small();
    let said = |name: &str, ty: Type| layout(definitions.named("EVERYTHING").unwrap(), &[(name, ty)]).unwrap_err();
    assert!(said("height", int()).starts_with("`EVERYTHING` has no field `height`; it has `wide`, `time`, "));
    assert_eq!(said("real", int()), "field `real` of `EVERYTHING` is `real`");
    assert_eq!(said("small", Type::Text), "field `small` of `EVERYTHING` is `int`, `real` or `bool`");
    assert_eq!(said("name", list(int())), "field `name` of `EVERYTHING` is `text`");
    assert_eq!(said("row", int()), "field `row` of `EVERYTHING` is a `list of` `int`, `real` or `bool`, of 3 elements");
    let plan = minimal();
    let scalar = Layout::new(&plan, &int(), definitions.named("EVERYTHING").unwrap());
    assert_eq!(scalar.unwrap_err(), "its type is not a `message`");
}

#[test]
fn a_number_that_the_language_does_not_have_is_not_read() {
    let layout = everything();
    let mut payload = EVERYTHING[10..58].to_vec();
    payload[15] = 0x80;
    let frame = Frame::first(&EVERYTHING).unwrap();
    let bytes = frame.with_payload(&payload, small().named("EVERYTHING").unwrap().crc_extra);
    assert_eq!(read(&layout, &bytes).unwrap_err(), "field `time` holds a number of 2⁶³ or more");
}

/// A field as a file has it, its declared type, and bytes for it.
type Written = (String, Type, Vec<u8>);

fn any_field() -> impl Strategy<Value = Written> {
    let kinds = [
        ("char", 1, Type::Text),
        ("int8_t", 1, int()),
        ("uint8_t", 1, int()),
        ("int16_t", 2, int()),
        ("uint16_t", 2, int()),
        ("int32_t", 4, int()),
        ("uint32_t", 4, int()),
        ("int64_t", 8, int()),
        ("float", 4, real()),
        ("double", 8, real()),
    ];
    (proptest::sample::select(kinds.to_vec()), proptest::option::of(1_usize..4), any::<u64>()).prop_map(
        |((word, size, ty), elements, seed)| {
            let length = size * elements.unwrap_or(1);
            let mut bytes: Vec<u8> = seed.to_le_bytes().into_iter().cycle().take(length).collect();
            if word == "char" {
                bytes = bytes.iter().map(|byte| b'a' + byte % 26).collect();
            }
            match elements {
                Some(elements) if word == "char" => (format!("char[{elements}]"), ty, bytes),
                Some(elements) => (format!("{word}[{elements}]"), list(ty), bytes),
                None => (word.to_owned(), ty, bytes),
            }
        },
    )
}

/// The checksum bit by bit.
fn naive_crc(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0xFFFF, |crc, &byte| {
        (0..8).fold(crc ^ u16::from(byte), |crc, _| if crc & 1 == 1 { (crc >> 1) ^ 0x8408 } else { crc >> 1 })
    })
}

/// A frame of version 2 of these fields, without any table: the largest field that is left comes next.
fn naive_frame(id: u32, name: &str, base: &[Written], extensions: &[Written], header: [u8; 3]) -> Vec<u8> {
    let size = |ty: &str| match ty.split('[').next() {
        Some("int64_t" | "double") => 8,
        Some("int32_t" | "uint32_t" | "float") => 4,
        Some("int16_t" | "uint16_t") => 2,
        _ => 1,
    };
    let mut left: Vec<(usize, &Written)> = base.iter().enumerate().collect();
    let (mut payload, mut agreed) = (Vec::new(), format!("{name} ").into_bytes());
    while !left.is_empty() {
        let largest = left.iter().map(|(_, field)| size(&field.0)).max().unwrap();
        let (at, (ty, _, bytes)) = left.remove(left.iter().position(|(_, field)| size(&field.0) == largest).unwrap());
        payload.extend_from_slice(bytes);
        agreed.extend_from_slice(format!("{} f{at} ", ty.split('[').next().unwrap()).as_bytes());
        if ty.contains('[') {
            agreed.push(u8::try_from(bytes.len() / size(ty)).unwrap());
        }
    }
    payload.extend(extensions.iter().flat_map(|(_, _, bytes)| bytes));
    while payload.len() > 1 && payload.last() == Some(&0) {
        payload.pop();
    }
    let extra = naive_crc(&agreed);
    let [low, middle, high, _] = id.to_le_bytes();
    let [sequence, system, component] = header;
    let length = u8::try_from(payload.len()).unwrap();
    let mut frame = vec![0xFD, length, 0, 0, sequence, system, component, low, middle, high];
    frame.append(&mut payload);
    let mut checked = frame[1..].to_vec();
    checked.push((extra & 0xFF) as u8 ^ (extra >> 8) as u8);
    frame.extend_from_slice(&naive_crc(&checked).to_le_bytes());
    frame
}

proptest! {
    #[test]
    fn frames_are_those_of_a_naive_encoder(
        base in proptest::collection::vec(any_field(), 1..8),
        extensions in proptest::collection::vec(any_field(), 0..3),
        id in 0_u32..1 << 24,
        header: [u8; 3],
        changed in any::<prop::sample::Index>(),
    ) {
        let names: Vec<String> = (0..base.len() + extensions.len()).map(|at| format!("f{at}")).collect();
        let all: Vec<&Written> = base.iter().chain(&extensions).collect();
        let pair = |(field, name): (&'_ Written, &'_ String)| (field.0.clone(), name.clone());
        let written: Vec<(String, String)> = all.iter().copied().zip(&names).map(pair).collect();
        let written: Vec<(&str, &str)> = written.iter().map(|(ty, name)| (ty.as_str(), name.as_str())).collect();
        let definition = Definition::new(id, "ANY", &written[..base.len()], &written[base.len()..]).unwrap();
        let declared: Vec<(&str, Type)> =
            names.iter().map(String::as_str).zip(all.iter().map(|field| field.1.clone())).collect();
        let layout = layout(&definition, &declared).unwrap();

        let bytes = naive_frame(id, "ANY", &base, &extensions, header);
        let [sequence, system, component] = header;
        let record = read(&layout, &bytes).unwrap();
        prop_assert_eq!(record.unchanged().map(|unchanged| unchanged.to_vec()), Some(bytes.clone()));
        let frame = Frame::first(&bytes).unwrap();
        prop_assert_eq!((frame.system, frame.component, frame.id), (system, component, id));
        // Every NaN in a single precision number is written as the nearest one, so those are left out here.
        let has_nan = record.values().iter().any(|value| format!("{value:?}").contains("NaN"));
        if !has_nan {
            prop_assert_eq!(&layout.make(Sender { system, component, sequence }, record.values()), &bytes);
        }
        prop_assert_eq!(&layout.write(&frame, record.values(), record.values()), &bytes);

        // One field is changed to zero: no other byte of the payload is.
        let at = changed.index(all.len());
        let zero = |value: &Value| match value {
            Value::Int(_) => Value::Int(0),
            Value::Real(_) => Value::Real(0.0),
            Value::Text(_) => Value::from(""),
            other => other.clone(),
        };
        let mut now = record.values().to_vec();
        now[at] = match &now[at] {
            Value::List(items) => Value::List(items.iter().map(zero).collect()),
            value => zero(value),
        };
        let mut fields: Vec<Written> = all.iter().copied().cloned().collect();
        fields[at].2.fill(0);
        let wanted = naive_frame(id, "ANY", &fields[..base.len()], &fields[base.len()..], header);
        prop_assert_eq!(layout.write(&frame, record.values(), &now), wanted);
    }

    #[test]
    fn no_bytes_are_too_much(bytes in proptest::collection::vec(any::<u8>(), 0..400), magic: bool, length: u8) {
        let mut bytes = bytes;
        // Most bytes do not begin like a frame.
        if let [first, second, ..] = bytes.as_mut_slice() {
            (*first, *second) = (if magic { 0xFD } else { 0xFE }, length);
        }
        let mut rest = bytes.as_slice();
        while let Some(frame) = Frame::first(rest) {
            let _ = everything().read(&frame, frame.bytes.into());
            let intact = frame.with_payload(&frame.bytes[frame.payload()], 192);
            // With the right checksum the payload is looked at.
            if let Some(frame) = Frame::first(&intact)
                && let Ok(Value::Record(record)) = everything().read(&frame, frame.bytes.into())
            {
                let written = everything().write(&frame, record.values(), record.values());
                prop_assert!(written.len() <= 12 + LONGEST_PAYLOAD);
            }
            rest = &rest[frame.bytes.len()..];
        }
    }
}
