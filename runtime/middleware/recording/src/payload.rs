//! Messages of recordings as values of the types that a plan declares.

use serde::Deserialize;
use serde_json::value::RawValue;

use sesame_plan::{CampaignPlan, TopicId, Type};
use sesame_relay::json::{Shapes, decode};
use sesame_relay::message::{Mismatch, fits};
use sesame_relay::value::{Fields, Record, Value};
use sesame_relay::wire::{Wanted, wanted};

use crate::container::Channel;
use crate::layout::{Bytes, Unreadable};

/// What of each message somebody reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Reads {
    /// All that the space declares.
    Declared,
    /// What metrics and monitors read: of a cloud of points that nobody reads, no point becomes a value.
    Used,
}

/// Reads the messages of a channel as those of a topic of a plan.
pub(crate) enum Payloads {
    Json,
    /// Of these fields.
    Bytes(Bytes, Wanted),
}

impl Payloads {
    /// For the messages of a channel, which are those of this topic.
    pub(crate) fn new(plan: &CampaignPlan, id: TopicId, channel: &Channel, reads: Reads) -> Result<Self, Unreadable> {
        if channel.encoding == "json" {
            return Ok(Payloads::Json);
        }
        let topic = plan.topic(id);
        let known = plan.simulator.ros.as_ref().map_or(&[][..], |ros| &ros.interfaces);
        let wanted = match reads {
            Reads::Declared => Wanted::All,
            Reads::Used => wanted(plan, id),
        };
        let wanted = declared_fields(plan, &topic.ty, &wanted);
        let bytes = Bytes::new(channel, known, topic.interface.as_deref(), &wanted)?;
        Ok(Payloads::Bytes(bytes, wanted))
    }

    /// Reads a message of the declared type.
    pub(crate) fn read(
        &self,
        plan: &CampaignPlan,
        shapes: &mut Shapes,
        ty: &Type,
        data: &[u8],
    ) -> Result<Value, String> {
        let Payloads::Bytes(bytes, wanted) = self else { return json(plan, shapes, ty, data) };
        let mut value = bytes.read(data)?;
        shape(plan, ty, &mut value);
        has(plan, ty, wanted, &value).map_err(|mismatch| mismatch.to_string())?;
        Ok(value)
    }
}

/// The fields that a plan declares of a message, as far as they are wanted.
fn declared_fields(plan: &CampaignPlan, ty: &Type, wanted: &Wanted) -> Wanted {
    let Type::Message { id } = ty else { return Wanted::All };
    let fields = plan.message(*id).fields.iter().filter_map(|field| {
        let wanted = match wanted {
            Wanted::All => &Wanted::All,
            Wanted::Fields(fields) => fields.get(&field.name)?,
        };
        Some((field.name.clone(), declared_fields(plan, &field.ty, wanted)))
    });
    Wanted::Fields(fields.collect())
}

/// Whether a value has what is wanted, of its declared types.
fn has(plan: &CampaignPlan, ty: &Type, wanted: &Wanted, value: &Value) -> Result<(), Mismatch> {
    let (Type::Message { id }, Wanted::Fields(wanted)) = (ty, wanted) else { return fits(plan, ty, value) };
    let Value::Record(record) = value else { return Err(Mismatch::new("message", value)) };
    let declared = plan.message(*id).fields.iter();
    declared.filter_map(|field| Some((field, wanted.get(&field.name)?))).try_for_each(|(field, wanted)| {
        let value = record.get(&field.name).ok_or_else(|| Mismatch::missing(&field.name))?;
        has(plan, &field.ty, wanted, value).map_err(|mismatch| mismatch.inside(&field.name))
    })
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
            for item in items {
                shape(plan, of, item);
            }
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
