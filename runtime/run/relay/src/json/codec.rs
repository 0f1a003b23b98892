//! Messages of topics as texts in JSON.

use std::sync::Arc;

use serde_json::value::RawValue;

use sesame_plan::{CampaignPlan, TopicId};

use super::declared::{Shapes, decode};
use super::encode;
use crate::message::Mismatch;
use crate::value::{Record, Value};

/// Reads and writes messages of a plan's topics as texts in JSON. What nobody has changed is written byte for byte as
/// it was read; parts that the space does not declare are never changed.
pub struct Codec {
    plan: CampaignPlan,
    shapes: Shapes,
}

impl Codec {
    /// One for the topics of this plan.
    pub fn new(plan: &CampaignPlan) -> Self {
        Codec { plan: plan.clone(), shapes: Shapes::default() }
    }

    /// Reads a message of a topic.
    pub fn read(&mut self, topic: TopicId, text: &str) -> Result<Value, Mismatch> {
        let expected = "JSON";
        let found = "something else";
        let raw: &RawValue = serde_json::from_str(text).map_err(|_| Mismatch { path: Vec::new(), expected, found })?;
        let value = decode(&self.plan, &mut self.shapes, &self.plan.topic(topic).ty, raw)?;
        Ok(match value {
            Value::Record(record) => {
                let bytes = Arc::from(text.as_bytes());
                Value::Record(Record::decoded(record.fields(), record.values().to_vec(), bytes))
            }
            other => other,
        })
    }

    /// Writes a message.
    pub fn write(&self, value: &Value) -> String {
        let mut out = Vec::new();
        match value {
            Value::Record(record) => match record.unchanged() {
                Some(bytes) => out.extend_from_slice(bytes),
                None => encode(value, &mut out),
            },
            other => encode(other, &mut out),
        }
        String::from_utf8(out).expect("JSON was made of text")
    }
}
