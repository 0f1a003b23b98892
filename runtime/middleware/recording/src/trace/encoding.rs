//! How the messages of a trace are written: in the format of the system's own recordings, where it has one.

use sesame_codec::error::CodecError;
use sesame_codec::{cdr, ros1};
use sesame_interfaces::bundle::{self, Notation};
use sesame_interfaces::ros1::type_name;
use sesame_plan::{CampaignPlan, Interface, InterfaceField, Primitive, SimulatorKind, TopicId, Type, WireType};
use sesame_relay::json::{encode, number};
use sesame_relay::value::{Fields, Record, Text, Value};
use sesame_relay::wire::{Wanted, wanted};

use super::schema;

/// A format of messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    /// JSON with a JSON Schema.
    Json,
    /// As ROS 2 has it.
    Cdr,
    /// As ROS 1 has it.
    Ros1,
}

/// How a format is named in a file.
struct Names {
    profile: &'static str,
    messages: &'static str,
    schemas: &'static str,
}

impl Encoding {
    /// The format for the messages of a plan's system. Behind a bridge, messages are in JSON.
    pub(super) fn of(plan: &CampaignPlan) -> Self {
        match plan.simulator.transport.kind() {
            SimulatorKind::Ros2 => Encoding::Cdr,
            SimulatorKind::Ros1 => Encoding::Ros1,
            _ => Encoding::Json,
        }
    }

    /// What kind of file a trace is.
    pub(super) fn profile(self) -> &'static str {
        self.names().profile
    }

    /// Whether names of topics begin with a slash.
    pub(super) fn is_of_ros(self) -> bool {
        self != Encoding::Json
    }

    fn names(self) -> Names {
        match self {
            Encoding::Json => Names { profile: "", messages: "json", schemas: "jsonschema" },
            Encoding::Cdr => Names { profile: "ros2", messages: "cdr", schemas: "ros2msg" },
            Encoding::Ros1 => Names { profile: "ros1", messages: "ros1", schemas: "ros1msg" },
        }
    }

    /// The messages of a topic.
    pub(super) fn topic(self, plan: &CampaignPlan, topic: TopicId) -> Result<Encoder, String> {
        let declared = plan.topic(topic);
        let known = plan.simulator.ros.as_ref().map_or(&[][..], |ros| &ros.interfaces);
        match &declared.interface {
            Some(interface) if self.is_of_ros() => self.of_interface(known, interface, &wanted(plan, topic)),
            _ => {
                let (name, text) = schema::of_messages(plan, &declared.ty);
                Ok(Encoder::json(name, text, matches!(declared.ty, Type::Message { .. })))
            }
        }
    }

    /// What operations did: texts in JSON.
    pub(super) fn operations(self) -> Encoder {
        if self.is_of_ros() {
            return self.simple("String", WireType::STRING);
        }
        let (name, text) = schema::of_operations();
        Encoder::json(name, text, true)
    }

    /// The change points of a metric.
    pub(super) fn metric(self, unit: Option<&str>) -> Encoder {
        if self.is_of_ros() {
            return self.simple("Float64", WireType::Primitive { primitive: Primitive::Float64 });
        }
        let (name, text) = schema::of_metric(unit);
        Encoder::json(name, text, false)
    }

    /// One of the plain messages of `std_msgs`.
    fn simple(self, name: &str, ty: WireType) -> Encoder {
        let name = format!("std_msgs/msg/{name}");
        let interface = Interface { name: name.clone(), fields: vec![InterfaceField { name: "data".to_owned(), ty }] };
        self.of_interface(&[interface], &name, &Wanted::All).expect("the layout is known")
    }

    fn of_interface(self, known: &[Interface], name: &str, wanted: &Wanted) -> Result<Encoder, String> {
        let needed = contained(known, name);
        let wrong = |error: sesame_codec::error::LayoutError| error.to_string();
        let (codec, notation, name) = match self {
            Encoding::Ros1 => {
                let codec = ros1::Codec::new(&needed, name, wanted).map_err(wrong)?;
                (Codec::Ros1(Box::new(codec)), Notation::Ros1, type_name(name))
            }
            Encoding::Cdr | Encoding::Json => {
                let codec = cdr::Codec::new(&needed, name, wanted).map_err(wrong)?;
                (Codec::Cdr(Box::new(codec)), Notation::Msg, name.to_owned())
            }
        };
        Ok(Encoder { encoding: self, schema: (name, bundle::written(notation, &needed).into_bytes()), codec })
    }
}

/// An interface preceded by those that it contains, out of many, in their order.
fn contained(known: &[Interface], name: &str) -> Vec<Interface> {
    let mut needed = vec![name];
    let mut found = Vec::new();
    for interface in known.iter().rev().filter(|interface| {
        let is_needed = needed.contains(&interface.name.as_str());
        if is_needed {
            needed.extend(interface.fields.iter().filter_map(|field| field.ty.interface()));
        }
        is_needed
    }) {
        found.push(interface.clone());
    }
    found.reverse();
    found
}

/// Writes the messages of one channel.
pub(super) struct Encoder {
    encoding: Encoding,
    /// Name and text of the schema.
    schema: (String, Vec<u8>),
    codec: Codec,
}

enum Codec {
    /// Whether the messages are objects by themselves.
    Json(bool),
    Cdr(Box<cdr::Codec>),
    Ros1(Box<ros1::Codec>),
}

impl Encoder {
    fn json(name: String, text: Vec<u8>, is_object: bool) -> Self {
        Encoder { encoding: Encoding::Json, schema: (name, text), codec: Codec::Json(is_object) }
    }

    /// The schema: name, encoding and text.
    pub(super) fn schema(&self) -> (&str, &'static str, &[u8]) {
        (&self.schema.0, self.encoding.names().schemas, &self.schema.1)
    }

    /// The name of the encoding of messages.
    pub(super) fn encoding(&self) -> &'static str {
        self.encoding.names().messages
    }

    /// Writes a message into a buffer, which it replaces. Of one that came as bytes, everything that nobody changed is
    /// written as it came.
    pub(super) fn message(&self, value: &Value, out: &mut Vec<u8>) -> Result<(), CodecError> {
        out.clear();
        match &self.codec {
            Codec::Json(true) => encode(value, out),
            Codec::Json(false) => in_object(out, |out| encode(value, out)),
            Codec::Cdr(codec) => out.extend_from_slice(&codec.write(value)?),
            Codec::Ros1(codec) => out.extend_from_slice(&codec.write(value)?),
        }
        Ok(())
    }

    /// Writes a number, as [`Encoder::message`] does.
    pub(super) fn number(&self, value: f64, out: &mut Vec<u8>) -> Result<(), CodecError> {
        if let Codec::Json(_) = self.codec {
            out.clear();
            in_object(out, |out| number(value, out));
            return Ok(());
        }
        self.message(&data(Value::Real(value)), out)
    }

    /// Writes an object in JSON, as [`Encoder::message`] does.
    pub(super) fn object(&self, json: &str, out: &mut Vec<u8>) -> Result<(), CodecError> {
        if let Codec::Json(_) = self.codec {
            out.clear();
            out.extend_from_slice(json.as_bytes());
            return Ok(());
        }
        self.message(&data(Value::Text(Text::from(json))), out)
    }
}

/// A message with the one field `data`.
fn data(value: Value) -> Value {
    Record::new(&Fields::new(["data"]), vec![value]).into()
}

fn in_object(out: &mut Vec<u8>, value: impl FnOnce(&mut Vec<u8>)) {
    out.extend_from_slice(b"{\"value\":");
    value(out);
    out.push(b'}');
}
