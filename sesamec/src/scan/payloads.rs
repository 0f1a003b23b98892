//! Types of topics whose messages nobody describes: what their payloads have in common.

use std::collections::BTreeMap;

use heck::ToUpperCamelCase as _;
use sesame_plan::{InterfaceField, Primitive, WireType};
use sesame_scan::{Conventions, Facts, Guess, GuessedField, LeftOut, Payloads, Samples};

use super::types::{POINT, Types};

/// Times and points of ROS.
const TIME: &str = "builtin_interfaces/msg/Time";
const ROS_POINT: &str = "geometry_msgs/msg/Point";
const HEADER: &str = "std_msgs/msg/Header";

/// Topics that look alike: those that differ in one part of their paths, not the last, and whose payloads resemble each
/// other.
struct Alike {
    topics: Vec<usize>,
    samples: Samples,
}

/// Gives each topic the type that its payloads have in common with those of topics that look alike.
pub fn by_payloads(facts: &mut Facts, payloads: &Payloads, conventions: Conventions) -> Types {
    let mut types = Types::default();
    for alike in alike(facts, payloads) {
        let first = &facts.topics[alike.topics[0]].path;
        let ty = alike.samples.guess(conventions).map(|guess| match guess {
            Guess::Message { fields, left_out } => {
                let last = first.rsplit('/').next().unwrap_or_default().to_upper_camel_case();
                message(&mut types, &last, fields, left_out)
            }
            other => {
                let last = first.rsplit('/').next().unwrap_or_default().to_upper_camel_case();
                let wire = wire(&mut types, &last, other);
                types.add_plain(wire)
            }
        });
        for at in alike.topics {
            let topic = &mut facts.topics[at];
            match &ty {
                Ok(ty) => topic.ty = Some(ty.clone()),
                Err(why) if topic.problem.is_none() => topic.problem = Some(format!("of its payloads: {why}")),
                Err(_) => {}
            }
        }
    }
    types
}

/// Sorts topics by what looks alike.
fn alike(facts: &Facts, payloads: &Payloads) -> Vec<Alike> {
    let mut all: Vec<Alike> = Vec::new();
    // By the path without one of its parts.
    let mut known = BTreeMap::<(usize, String), usize>::new();
    for (at, topic) in facts.topics.iter().enumerate() {
        let Some(samples) = payloads.get(&topic.path) else { continue };
        let parts: Vec<&str> = topic.path.split('/').collect();
        let without = |part: usize| {
            let rest = [&parts[..part], &parts[part + 1..]].concat();
            (part, rest.join("/"))
        };
        let keys: Vec<_> = (0..parts.len() - 1).map(without).collect();
        let of = keys.iter().filter_map(|key| known.get(key)).find(|of| all[**of].samples.resemble(samples)).copied();
        let of = of.unwrap_or_else(|| {
            all.push(Alike { topics: Vec::new(), samples: Samples::default() });
            all.len() - 1
        });
        all[of].topics.push(at);
        all[of].samples.merge(samples);
        for key in keys {
            known.entry(key).or_insert(of);
        }
    }
    all
}

/// Layouts of types of ROS that nobody described, from the payloads of their topics.
pub fn types_by_payloads(types: &mut Types, facts: &Facts, payloads: &Payloads) {
    for name in types.missing() {
        let mut samples = Samples::default();
        let of_type = facts.topics.iter().filter(|topic| topic.ty.as_deref() == Some(&name));
        of_type.filter_map(|topic| payloads.get(&topic.path)).for_each(|of_topic| samples.merge(of_topic));
        if samples.count() == 0 {
            continue;
        }
        match samples.guess(Conventions::Rosbridge) {
            Ok(Guess::Message { fields, left_out }) => {
                message_of_ros(types, &name, fields, left_out);
            }
            Ok(Guess::Point) => {
                let axis = |name: &str| InterfaceField { name: name.to_owned(), ty: real() };
                types.add_payload(&name, ["x", "y", "z"].map(axis).into(), Vec::new());
            }
            Ok(_) => types.refuse(&name, "its messages are not objects".to_owned()),
            Err(why) => types.refuse(&name, format!("of its messages: {why}")),
        }
    }
}

fn real() -> WireType {
    WireType::Primitive { primitive: Primitive::Float64 }
}

/// Adds a message of this name, or of a similar one; gives the name.
fn message(types: &mut Types, wanted: &str, fields: Vec<GuessedField>, left_out: Vec<LeftOut>) -> String {
    let name = free(types, if wanted.is_empty() { "Message" } else { wanted });
    // The name is taken before those of messages in it.
    types.add_payload(&name, Vec::new(), Vec::new());
    let (mut of, mut lacking) = (Vec::new(), Vec::new());
    for GuessedField { name: field, guess, optional } in fields {
        let ty = wire(types, &format!("{name}{}", field.to_upper_camel_case()), guess);
        if optional {
            lacking.push(field.clone());
        }
        of.push(InterfaceField { name: field, ty });
    }
    types.set_payload(&name, of, left_out);
    types.set_optional(&name, lacking);
    name
}

/// A name that no type has: this one, or one with a number behind it.
fn free(types: &Types, wanted: &str) -> String {
    let numbered = (2..).map(|number| format!("{wanted}{number}"));
    let mut names = std::iter::once(wanted.to_owned()).chain(numbered);
    names.find(|name| !types.has(name)).expect("there are more numbers than types")
}

/// A type without ROS. The name is that of a message in it.
fn wire(types: &mut Types, name: &str, guess: Guess) -> WireType {
    match guess {
        Guess::Bool => WireType::Primitive { primitive: Primitive::Bool },
        Guess::Int => WireType::Primitive { primitive: Primitive::Int64 },
        Guess::Real | Guess::Time => real(),
        Guess::Text => WireType::STRING,
        Guess::Point => WireType::Interface { name: POINT.to_owned() },
        Guess::List(of) => WireType::Sequence { of: Box::new(wire(types, name, *of)), bound: None },
        Guess::Message { fields, left_out } => WireType::Interface { name: message(types, name, fields, left_out) },
    }
}

/// Adds a message with this type of ROS. Messages in it have types that are made up, since JSON does not name them.
fn message_of_ros(types: &mut Types, name: &str, fields: Vec<GuessedField>, left_out: Vec<LeftOut>) {
    let mut of = Vec::new();
    for GuessedField { name: field, guess, .. } in fields {
        let ty = wire_of_ros(types, &format!("{name}{}", field.to_upper_camel_case()), guess);
        of.push(InterfaceField { name: field, ty });
    }
    types.add_payload(name, of, left_out);
}

fn wire_of_ros(types: &mut Types, name: &str, guess: Guess) -> WireType {
    let mut known = |name: &str| {
        types.add_known(name);
        WireType::Interface { name: name.to_owned() }
    };
    match guess {
        Guess::Bool => WireType::Primitive { primitive: Primitive::Bool },
        Guess::Int => WireType::Primitive { primitive: Primitive::Int32 },
        Guess::Real => real(),
        Guess::Text => WireType::STRING,
        Guess::Time => known(TIME),
        Guess::Point => known(ROS_POINT),
        Guess::List(of) => WireType::Sequence { of: Box::new(wire_of_ros(types, name, *of)), bound: None },
        Guess::Message { fields, .. } if is_header(&fields) => known(HEADER),
        Guess::Message { fields, left_out } => {
            let name = free(types, name);
            message_of_ros(types, &name, fields, left_out);
            WireType::Interface { name }
        }
    }
}

/// Whether these are the fields of a `std_msgs/msg/Header`, in ROS 1 with `seq`.
fn is_header(fields: &[GuessedField]) -> bool {
    let fields = fields.iter().filter(|field| field.name != "seq");
    fields.map(|field| (field.name.as_str(), &field.guess)).eq([("frame_id", &Guess::Text), ("stamp", &Guess::Time)])
}
