//! Messages of the space: with a type of ROS, or with the fields that payloads have in common.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use sesame_dsl::interfaces::in_words;
use sesame_dsl::units::Unit;
use sesame_notation::quoted;
use sesame_plan::{InterfaceField, Primitive, WireType};
use sesame_scan::{FoundField, System, TypeSource};

use super::comments::on_one_line;
use super::types::Types;

/// How many letters of a type's fields are shown in a comment.
const LONGEST: usize = 50;

/// How many fields are named that a message does not have in the space.
const MOST_LEFT_OUT: usize = 20;

/// A message of each type that needs one: in ROS with a block if no file has its layout, else with its fields in a
/// comment.
pub(super) fn messages(system: &System, types: &Types, names: &BTreeMap<&str, String>, order: &[&str]) -> String {
    let is_ros = system.is_ros();
    let mut text = String::new();
    let of_dialect = order.iter().any(|ty| types.source(ty) == TypeSource::Dialect);
    if of_dialect {
        text.push_str(
            "// decide: units that the language does not have, in comments; and `bool` where a number is a truth value.\n\
             // What follows `//` and the unit came in the first message.\n",
        );
    } else if !is_ros && !order.is_empty() {
        text.push_str(
            "// decide: units, such as `real[m]`; and `real` in the place of `int` where fractions may come, too: only\n\
             // whole numbers came there\n",
        );
    }
    if is_ros && order.iter().any(|ty| types.source(ty) == TypeSource::Payloads) {
        text.push_str(
            "// decide: of messages with a block, whose fields are those that their JSON has in common: the sizes of\n\
             // fields, `real` in the place of `int` where fractions may come, and the types of messages in messages\n",
        );
    }
    if is_ros && order.iter().any(|ty| !has_block(types, ty)) {
        text.push_str("// decide: units; `message NAME = \"TYPE\" { FIELD: real[m] }` gives a field its unit\n");
    }
    for ty in order {
        let Some(name) = names.get(ty) else { continue };
        let head = if is_ros { format!("message {name} = {}", quoted(ty)) } else { format!("message {name}") };
        if !has_block(types, ty) {
            _ = writeln!(text, "{head}  // {}", fields_in_words(types, ty));
            continue;
        }
        let who = match (is_ros, types.source(ty), system) {
            (false, ..) | (true, TypeSource::Payloads, _) => None,
            (_, _, System::Ros1 { .. }) => Some("a publisher"),
            (_, _, System::Rosbridge { .. }) => Some("the bridge"),
            _ => Some("a node"),
        };
        if let Some(who) = who {
            _ = writeln!(text, "// decide: the units of its fields; {who} described them");
        }
        _ = writeln!(text, "{head} {{");
        for field in types.fields(ty) {
            let said = in_language(is_ros, types, names, field);
            let detail = types.detail(ty, &field.name);
            let optional = if detail.is_some_and(|detail| detail.optional) { "optional " } else { "" };
            let said = detail.map_or(said.clone(), |detail| with_detail(&said, detail));
            _ = writeln!(text, "{optional}{}: {said}", field.name);
        }
        let left_out = types.left_out(ty);
        for out in left_out.iter().take(MOST_LEFT_OUT) {
            _ = writeln!(text, "// decide: {}", on_one_line(&format!("`{}` is left out: {}", out.name, out.why)));
        }
        if left_out.len() > MOST_LEFT_OUT {
            _ = writeln!(text, "// decide: {} more are left out", left_out.len() - MOST_LEFT_OUT);
        }
        text.push_str("}\n");
    }
    text
}

/// A type with its unit, if the language has it, and with the rest in a comment.
fn with_detail(ty: &str, detail: &FoundField) -> String {
    let has_unit = ty.ends_with("int") || ty.ends_with("real");
    let (known, unknown) = match &detail.unit {
        Some(unit) if has_unit && Unit::parse(unit).is_ok() => (format!("[{unit}]"), None),
        unit => (String::new(), unit.as_ref()),
    };
    let comment: Vec<String> = unknown.into_iter().chain(&detail.sample).map(|text| on_one_line(text)).collect();
    let comment = if comment.is_empty() { String::new() } else { format!("  // {}", comment.join(": ")) };
    format!("{ty}{known}{comment}")
}

/// Whether the space says the fields of a type.
fn has_block(types: &Types, ty: &str) -> bool {
    matches!(types.source(ty), TypeSource::Node | TypeSource::Payloads | TypeSource::Dialect)
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

/// The type of a topic in the language.
pub(super) fn topic_type(types: &Types, names: &BTreeMap<&str, String>, ty: &str) -> String {
    match types.wire(ty) {
        Some(wire) => language_type(types, names, wire),
        None => names.get(ty).cloned().unwrap_or_default(),
    }
}

/// The type of a field of a block. Only in ROS a field has a type of its own on the wire.
fn in_language(is_ros: bool, types: &Types, names: &BTreeMap<&str, String>, field: &InterfaceField) -> String {
    let of = language_type(types, names, &field.ty);
    if !is_ros || is_usual(&field.ty) { of } else { format!("{of} as {}", quoted(&in_words(&field.ty))) }
}

fn language_type(types: &Types, names: &BTreeMap<&str, String>, ty: &WireType) -> String {
    match ty {
        WireType::Primitive { primitive: Primitive::Bool } => "bool".to_owned(),
        WireType::Primitive { primitive: Primitive::Float32 | Primitive::Float64 } => "real".to_owned(),
        WireType::Primitive { .. } => "int".to_owned(),
        WireType::String { .. } | WireType::WString { .. } => "text".to_owned(),
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
        WireType::String { bound: None } => true,
        WireType::Sequence { of, bound: None } => is_usual(of),
        _ => false,
    }
}
