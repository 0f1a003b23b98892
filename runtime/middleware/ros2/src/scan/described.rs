//! `type_description_interfaces/srv/GetTypeDescription`: what is asked, and what is answered.

use std::sync::Arc;

use sesame_codec::cdr::Codec;
use sesame_plan::{Interface, InterfaceField, Primitive, WireType};
use sesame_relay::value::{Fields, Record, Text, Value};
use sesame_relay::wire::Wanted;

use crate::layouts::{Layout, interfaces};

/// The service.
pub(super) const SERVICE: &str = "type_description_interfaces/srv/GetTypeDescription";

/// Asks, and reads the answer.
pub(super) struct Descriptions {
    request: Codec,
    reply: Codec,
}

/// The layouts of the service's messages.
const LAYOUTS: &[Layout] = &[
    ("Request", &[("type_name", "string"), ("type_hash", "string"), ("include_type_sources", "bool")]),
    (
        "FieldType",
        &[("type_id", "uint8"), ("capacity", "uint64"), ("string_capacity", "uint64"), ("nested_type_name", "string")],
    ),
    ("Field", &[("name", "string"), ("type", "FieldType"), ("default_value", "string")]),
    ("Individual", &[("type_name", "string"), ("fields", "Field[]")]),
    ("Description", &[("type_description", "Individual"), ("referenced_type_descriptions", "Individual[]")]),
    ("Source", &[("type_name", "string"), ("encoding", "string"), ("raw_file_contents", "string")]),
    ("KeyValue", &[("key", "string"), ("value", "string")]),
    (
        "Response",
        &[
            ("successful", "bool"),
            ("failure_reason", "string"),
            ("type_description", "Description"),
            ("type_sources", "Source[]"),
            ("extra_information", "KeyValue[]"),
        ],
    ),
];

impl Descriptions {
    pub(super) fn new() -> Self {
        let interfaces = interfaces(LAYOUTS);
        let codec = |name| Codec::new(&interfaces, name, &Wanted::All).expect("the layout is known");
        Descriptions { request: codec("Request"), reply: codec("Response") }
    }

    /// A request for the layout of a type, without its source.
    pub(super) fn ask(&self, name: &str, hash: &str) -> Option<Arc<[u8]>> {
        let fields = Fields::new(["type_name", "type_hash", "include_type_sources"]);
        let values = vec![Value::Text(Text::from(name)), Value::Text(Text::from(hash)), Value::Bool(false)];
        self.request.write(&Record::new(&fields, values).into()).ok()
    }

    /// The layouts in an answer, that of the type itself first; `None` if there are none or they cannot be read.
    pub(super) fn read(&self, sample: Arc<[u8]>) -> Option<Vec<Interface>> {
        let answer = self.reply.read(sample).ok()?;
        if !matches!(answer.at(&["successful"])?, Value::Bool(true)) {
            return None;
        }
        let first = individual(answer.at(&["type_description", "type_description"])?)?;
        let contained = list(answer.at(&["type_description", "referenced_type_descriptions"])?)?;
        std::iter::once(Some(first)).chain(contained.iter().map(individual)).collect()
    }
}

fn individual(value: &Value) -> Option<Interface> {
    let field = |field: &Value| {
        let [id, capacity, of_text] =
            ["type_id", "capacity", "string_capacity"].map(|name| number(field.at(&["type", name])));
        let nested = text(field.at(&["type", "nested_type_name"])?)?;
        let ty = wire_type(id?, capacity?, of_text?, nested)?;
        Some(InterfaceField { name: text(field.at(&["name"])?)?.to_owned(), ty })
    };
    let fields = list(value.at(&["fields"])?)?.iter().map(field).collect::<Option<_>>()?;
    Some(Interface { name: text(value.at(&["type_name"])?)?.to_owned(), fields })
}

/// The type of an id of `type_description_interfaces/msg/FieldType`.
fn wire_type(id: i64, capacity: i64, of_text: i64, nested: &str) -> Option<WireType> {
    let of = Box::new(scalar(id % 48, of_text, nested)?);
    let length = u32::try_from(capacity).ok();
    match id / 48 {
        0 => Some(*of),
        1 => Some(WireType::Array { of, length: length? }),
        2 => Some(WireType::Sequence { of, bound: Some(length?) }),
        3 => Some(WireType::Sequence { of, bound: None }),
        _ => None,
    }
}

fn scalar(id: i64, of_text: i64, nested: &str) -> Option<WireType> {
    let primitive = match id {
        1 => return Some(WireType::Interface { name: nested.to_owned() }),
        2 => Primitive::Int8,
        // `char` and `byte` are bytes.
        3 | 13 | 16 => Primitive::Uint8,
        4 => Primitive::Int16,
        5 => Primitive::Uint16,
        6 => Primitive::Int32,
        7 => Primitive::Uint32,
        8 => Primitive::Int64,
        9 => Primitive::Uint64,
        10 => Primitive::Float32,
        11 => Primitive::Float64,
        15 => Primitive::Bool,
        17 => return Some(WireType::STRING),
        18 => return Some(WireType::WSTRING),
        21 => return Some(WireType::String { bound: Some(u32::try_from(of_text).ok()?) }),
        22 => return Some(WireType::WString { bound: Some(u32::try_from(of_text).ok()?) }),
        _ => return None,
    };
    Some(WireType::Primitive { primitive })
}

fn text(value: &Value) -> Option<&str> {
    if let Value::Text(text) = value { Some(text) } else { None }
}

fn list(value: &Value) -> Option<&[Value]> {
    if let Value::List(list) = value { Some(list) } else { None }
}

fn number(value: Option<&Value>) -> Option<i64> {
    if let Some(Value::Int(number)) = value { Some(*number) } else { None }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_of_types_are_those_of_ros() {
        let double = WireType::Primitive { primitive: Primitive::Float64 };
        assert_eq!(wire_type(11, 0, 0, ""), Some(double.clone()));
        assert_eq!(wire_type(59, 3, 0, ""), Some(WireType::Array { of: Box::new(double.clone()), length: 3 }));
        assert_eq!(wire_type(107, 9, 0, ""), Some(WireType::Sequence { of: Box::new(double.clone()), bound: Some(9) }));
        assert_eq!(wire_type(155, 0, 0, ""), Some(WireType::Sequence { of: Box::new(double), bound: None }));
        assert_eq!(wire_type(1, 0, 0, "a/msg/B"), Some(WireType::Interface { name: "a/msg/B".to_owned() }));
        assert_eq!(wire_type(21, 0, 5, ""), Some(WireType::String { bound: Some(5) }));
        assert_eq!(wire_type(22, 0, 3, ""), Some(WireType::WString { bound: Some(3) }));
        for wrong in [-1, 0, 12, 14, 48, 203, 255] {
            assert_eq!(wire_type(wrong, 0, 0, ""), None, "{wrong}");
        }
        assert_eq!(wire_type(59, i64::MAX, 0, ""), None);
    }

    #[test]
    fn what_is_asked_and_answered_is_in_the_layout_of_ros() {
        let descriptions = Descriptions::new();
        let request = descriptions.ask("a/msg/B", "RIHS01_0").unwrap();
        assert_eq!(&request[..12], b"\0\x01\0\0\x08\0\0\0a/ms");
        assert_eq!(request.last(), Some(&0), "the sources are not asked for");
        assert_eq!(descriptions.read(vec![0, 1, 0, 0, 1, 0, 0, 0].into()), None);
    }
}
