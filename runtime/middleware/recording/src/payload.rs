//! Messages of recordings as values: bytes are read by the layout that the file says, else by that of the space.

use std::sync::Arc;

use serde::Deserialize;
use serde_json::value::RawValue;

use sesame_codec::{cdr, ros1};
use sesame_interfaces::bundle::{self, Notation};
use sesame_plan::{CampaignPlan, Interface, TopicId, Type};
use sesame_relay::json::{Shapes, decode};
use sesame_relay::message::fits;
use sesame_relay::value::{Fields, Record, Value};
use sesame_relay::wire::Wanted;

use crate::container::{Channel, Schema};

/// Reads the messages of a channel.
pub(crate) enum Reader {
    Json,
    Cdr(Box<cdr::Codec>),
    Ros1(Box<ros1::Codec>),
}

/// Why the messages of a channel cannot be read.
pub(crate) enum Unreadable {
    /// Nobody knows the encoding.
    Encoding,
    /// The layout is not known, in words for the user.
    Layout(String),
}

impl Reader {
    /// For the messages of a channel, which are those of a topic of the plan.
    pub(crate) fn new(plan: &CampaignPlan, topic: TopicId, channel: &Channel) -> Result<Self, Unreadable> {
        let declared = &plan.topic(topic).ty;
        let wrong = |reason: String| Unreadable::Layout(reason);
        match channel.encoding.as_str() {
            "json" => Ok(Reader::Json),
            "cdr" => {
                let (interfaces, name) = layout(plan, topic, channel.schema.as_ref()).map_err(wrong)?;
                let codec = cdr::Codec::new(&interfaces, &name, &declared_fields(plan, declared));
                codec.map(|codec| Reader::Cdr(Box::new(codec))).map_err(|error| wrong(error.to_string()))
            }
            "ros1" => {
                let (interfaces, name) = layout(plan, topic, channel.schema.as_ref()).map_err(wrong)?;
                let codec = ros1::Codec::new(&interfaces, &name, &declared_fields(plan, declared));
                codec.map(|codec| Reader::Ros1(Box::new(codec))).map_err(|error| wrong(error.to_string()))
            }
            _ => Err(Unreadable::Encoding),
        }
    }

    /// Reads a message of the declared type.
    pub(crate) fn read(
        &self,
        plan: &CampaignPlan,
        shapes: &mut Shapes,
        ty: &Type,
        data: &[u8],
    ) -> Result<Value, String> {
        let bytes = || Arc::<[u8]>::from(data);
        let mut value = match self {
            Reader::Json => return json(plan, shapes, ty, data),
            Reader::Cdr(codec) => codec.read(bytes()),
            Reader::Ros1(codec) => codec.read(bytes()),
        }
        .map_err(|error| error.to_string())?;
        shape(plan, ty, &mut value);
        fits(plan, ty, &value).map_err(|mismatch| mismatch.to_string())?;
        Ok(value)
    }
}

/// The layout of the messages on a channel: what the file says, else what the space knows.
fn layout(plan: &CampaignPlan, topic: TopicId, schema: Option<&Schema>) -> Result<(Vec<Interface>, String), String> {
    if let Some(schema) = schema.filter(|schema| !schema.text.trim().is_empty() || !schema.encoding.is_empty()) {
        let known: Vec<&str> = Notation::ALL.iter().map(|(_, name)| *name).collect();
        let notation = Notation::named(&schema.encoding).ok_or_else(|| {
            let encoding = schema.encoding.escape_debug();
            format!("its schema is written as `{encoding}`; only {} can be read", known.join(", "))
        })?;
        let wrong =
            |problem: String| format!("the definition of `{}` in the file: {problem}", schema.name.escape_debug());
        let (catalogue, name) =
            bundle::read(notation, &schema.name, &schema.text).map_err(|error| wrong(error.to_string()))?;
        let interfaces = catalogue.layout(&name).map_err(|error| wrong(error.to_string()))?;
        return Ok((interfaces, name));
    }
    let of_space = plan.simulator.ros.as_ref().map_or(&[][..], |ros| &ros.interfaces);
    let named = schema.map(|schema| schema.name.as_str());
    let candidates = named.into_iter().chain(plan.topic(topic).interface.as_deref());
    let known = candidates.filter_map(|name| {
        let at = of_space.iter().position(|interface| interface.name == name)?;
        Some((of_space[..=at].to_vec(), name.to_owned()))
    });
    known.into_iter().next().ok_or_else(|| {
        let ty = named.map_or_else(|| "its type".to_owned(), |name| format!("`{}`", name.escape_debug()));
        format!(
            "neither the file nor the space defines {ty}: declare the topic with that type in a system of `ros2` or \
             `ros1`, whose `types` name the folders with its definitions"
        )
    })
}

/// The fields that a plan declares of a message.
fn declared_fields(plan: &CampaignPlan, ty: &Type) -> Wanted {
    let Type::Message { id } = ty else { return Wanted::All };
    let fields = plan.message(*id).fields.iter();
    Wanted::Fields(fields.map(|field| (field.name.clone(), declared_fields(plan, &field.ty))).collect())
}

/// Gives a value the shape that the plan declares, where another one means the same: points and messages of their
/// coordinates, and a message of one field that stands for its value.
fn shape(plan: &CampaignPlan, ty: &Type, value: &mut Value) {
    const AXES: [&str; 3] = ["x", "y", "z"];
    match (ty, &mut *value) {
        (Type::Message { id }, Value::Point(point)) => {
            let declared = plan.message(*id).fields.iter().map(|field| field.name.as_str());
            let there: Vec<(&str, f64)> =
                declared.filter_map(|name| Some((name, point[AXES.iter().position(|axis| *axis == name)?]))).collect();
            let fields = Fields::new(there.iter().map(|(name, _)| *name));
            *value = Record::new(&fields, there.iter().map(|(_, number)| Value::Real(*number)).collect()).into();
        }
        (Type::Message { id }, Value::Record(record)) => {
            for field in &plan.message(*id).fields {
                if let Some(inner) = record.get_mut(&field.name) {
                    shape(plan, &field.ty, inner);
                }
            }
        }
        (Type::List { of }, Value::List(items)) if has_shape(of) => {
            items.iter_mut().for_each(|item| shape(plan, of, item));
        }
        (Type::Point { .. }, Value::Record(record)) => {
            let coordinates = AXES.map(|axis| record.get(axis).and_then(|value| value.number_at::<&str>(&[])));
            if let [Some(x), Some(y), Some(z)] = coordinates {
                *value = Value::Point([x, y, z]);
            }
        }
        (Type::Message { .. }, _) => {}
        (_, Value::Record(record)) => {
            if let [alone] = record.values() {
                *value = alone.clone();
            }
        }
        _ => {}
    }
}

/// Whether values of a type may be of another shape than the plan declares.
fn has_shape(ty: &Type) -> bool {
    matches!(ty, Type::Message { .. } | Type::Point { .. } | Type::List { .. })
}

/// Reads a payload in JSON. If it is not an object, it may also stand alone, without the object around it.
fn json(plan: &CampaignPlan, shapes: &mut Shapes, ty: &Type, data: &[u8]) -> Result<Value, String> {
    #[derive(Deserialize)]
    struct Alone<'a> {
        #[serde(borrow)]
        value: &'a RawValue,
    }
    let json: &RawValue = serde_json::from_slice(data).map_err(|error| format!("not JSON ({error})"))?;
    let inner = match ty {
        Type::Message { .. } => json,
        _ => serde_json::from_str(json.get()).map_or(json, |Alone { value }| value),
    };
    decode(plan, shapes, ty, inner).map_err(|mismatch| mismatch.to_string())
}
