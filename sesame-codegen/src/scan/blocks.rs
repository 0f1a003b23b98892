//! Messages of the space, each with a type of ROS.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use sesame_dsl::interfaces::in_words;
use sesame_notation::quoted;
use sesame_plan::{InterfaceField, Primitive, WireType};
use sesame_ros2::scan::TypeSource;

use super::types::Types;

/// How many letters of a type's fields are shown in a comment.
const LONGEST: usize = 50;

/// A message of each type that needs one: with a block if no file has its layout, else with its fields in a comment.
pub(super) fn messages(types: &Types, names: &BTreeMap<&str, String>, order: &[&str]) -> String {
    let mut text = String::new();
    if order.iter().any(|ty| types.source(ty) != TypeSource::Node) {
        text.push_str("// decide: units; `message NAME = \"TYPE\" { FIELD: real[m] }` gives a field its unit\n");
    }
    for ty in order {
        let Some(name) = names.get(ty) else { continue };
        let head = format!("message {name} = {}", quoted(ty));
        if types.source(ty) != TypeSource::Node {
            _ = writeln!(text, "{head}  // {}", fields_in_words(types, ty));
            continue;
        }
        _ = writeln!(text, "// decide: the units of its fields; a node described them\n{head} {{");
        for field in types.fields(ty) {
            _ = writeln!(text, "{}: {}", field.name, in_language(types, names, field));
        }
        text.push_str("}\n");
    }
    text
}

/// The fields of a type in a few words.
fn fields_in_words(types: &Types, ty: &str) -> String {
    let mut words = String::new();
    for field in types.fields(ty) {
        if words.len() > LONGEST {
            words.push_str(", …");
            break;
        }
        let between = if words.is_empty() { "" } else { ", " };
        _ = write!(words, "{between}{}: {}", field.name, in_words(&field.ty));
    }
    if words.is_empty() { "no fields".to_owned() } else { words }
}

/// The type of a field of a block.
fn in_language(types: &Types, names: &BTreeMap<&str, String>, field: &InterfaceField) -> String {
    let of = language_type(types, names, &field.ty);
    if is_usual(&field.ty) { of } else { format!("{of} as {}", quoted(&in_words(&field.ty))) }
}

fn language_type(types: &Types, names: &BTreeMap<&str, String>, ty: &WireType) -> String {
    match ty {
        WireType::Primitive { primitive: Primitive::Bool } => "bool".to_owned(),
        WireType::Primitive { primitive: Primitive::Float32 | Primitive::Float64 } => "real".to_owned(),
        WireType::Primitive { .. } => "int".to_owned(),
        WireType::String | WireType::WString => "text".to_owned(),
        WireType::Array { of, .. } | WireType::Sequence { of, .. } => {
            format!("list of {}", language_type(types, names, of))
        }
        WireType::Interface { name } => match names.get(name.as_str()) {
            Some(message) => message.clone(),
            None => types.plain(name).unwrap_or("text").to_owned(),
        },
    }
}

/// Whether a field has this type on the wire without saying so.
fn is_usual(ty: &WireType) -> bool {
    match ty {
        WireType::Primitive { primitive } => {
            matches!(primitive, Primitive::Bool | Primitive::Int32 | Primitive::Float64)
        }
        WireType::String => true,
        WireType::Sequence { of, bound: None } => is_usual(of),
        _ => false,
    }
}
