//! Layouts of the messages that ROS itself exchanges, whatever the space declares.

use sesame_plan::{Interface, InterfaceField, Primitive, WireType};

/// A message: its name, and its fields, each with its name and its type as in a `.msg` file. Interfaces have their
/// whole names.
pub(crate) type Layout = (&'static str, &'static [(&'static str, &'static str)]);

/// The interfaces of these layouts, in their order.
pub(crate) fn interfaces(layouts: &[Layout]) -> Vec<Interface> {
    let field = |&(name, written): &(&str, &str)| InterfaceField { name: name.to_owned(), ty: wire_type(written) };
    let interface =
        |&(name, fields): &Layout| Interface { name: name.to_owned(), fields: fields.iter().map(field).collect() };
    layouts.iter().map(interface).collect()
}

fn wire_type(written: &str) -> WireType {
    if let Some((of, length)) = written.strip_suffix(']').and_then(|list| list.split_once('[')) {
        let of = Box::new(wire_type(of));
        return match length.parse() {
            Ok(length) => WireType::Array { of, length },
            Err(_) => WireType::Sequence { of, bound: None },
        };
    }
    match Primitive::named(written) {
        Some(primitive) => WireType::Primitive { primitive },
        None if written == "string" => WireType::STRING,
        None => WireType::Interface { name: written.to_owned() },
    }
}
