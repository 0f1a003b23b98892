//! The signals of a recording: every number in its messages, over time.

use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;

use mcap::records::{Metadata, Record};
use sesame_base::visible::visible;
use sesame_plan::CampaignPlan;

use crate::json::Shapes;
use crate::trace::recording::{RecordingError, payload, read};
use crate::trace::{ROLE, ROLE_PUBLISHED, SUBJECT, TOPIC};
use crate::value::Value;
use crate::wire::{Wire, WireTable};

/// The most samples that are read of a recording; with more, memory could run out.
const MOST_SAMPLES: usize = 50_000_000;

/// The most elements of a list that are signals.
const MOST_ELEMENTS: usize = 64;

/// A number in the messages of a topic, over time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Signal {
    /// Seconds since the start of the run, ascending.
    pub times: Vec<f64>,
    /// The value at each time; finite.
    pub values: Vec<f64>,
}

/// The signals of a recording by name, such as `zones/Z1.level`: every number in the messages that were published on
/// topics of the plan. Values that are not finite are left out.
///
/// In a recording that no runner made, times are those since its first message on a topic of the plan.
pub fn signals(
    path: &Path,
    plan: &CampaignPlan,
    wires: &WireTable,
) -> Result<BTreeMap<String, Signal>, RecordingError> {
    let file = File::open(path)
        .map_err(|error| RecordingError::Unreadable { reason: error.to_string(), path: path.to_owned() })?;
    let mut collector = Collector {
        plan,
        wires,
        channels: BTreeMap::new(),
        shapes: Shapes::default(),
        start: None,
        samples: 0,
        signals: BTreeMap::new(),
    };
    read(file, path, &mut |record| collector.record(record, path))?;
    Ok(collector.signals)
}

struct Collector<'a> {
    plan: &'a CampaignPlan,
    wires: &'a WireTable,
    /// The wires of channels with published messages, by their id.
    channels: BTreeMap<u16, Wire>,
    shapes: Shapes,
    start: Option<u64>,
    samples: usize,
    signals: BTreeMap<String, Signal>,
}

impl Collector<'_> {
    fn record(&mut self, record: Record<'_>, path: &Path) -> Result<(), RecordingError> {
        match record {
            Record::Metadata(Metadata { name, .. }) if name == SUBJECT => self.start = Some(0),
            Record::Channel(channel) if channel.message_encoding == "json" => {
                let name = match channel.metadata.get(ROLE).map(String::as_str) {
                    Some(ROLE_PUBLISHED) => channel.metadata.get("sesame_name"),
                    Some(_) => None,
                    None => Some(&channel.topic),
                };
                let topic = channel.metadata.get(TOPIC).map(String::as_str);
                if let Some(wire) = name.and_then(|name| self.wires.find_of(self.plan, name, topic)) {
                    self.channels.insert(channel.id, wire);
                }
            }
            Record::Message { header, data } => {
                let Some(&wire) = self.channels.get(&header.channel_id) else { return Ok(()) };
                let start = *self.start.get_or_insert(header.log_time);
                #[expect(clippy::cast_precision_loss, reason = "a run of 104 days has times to the nanosecond")]
                let time = header.log_time.saturating_sub(start) as f64 / 1e9;
                let ty = &self.plan.topic(self.wires.topic(wire)).ty;
                let value = payload(self.plan, &mut self.shapes, ty, &data).map_err(|reason| {
                    let problem = format!("a message on `{}`: {}", self.wires.path(wire), visible(&reason));
                    RecordingError::Damaged { problem, path: path.to_owned() }
                })?;
                let mut name = self.wires.path(wire).to_owned();
                self.collect(&mut name, time, &value);
                if self.samples > MOST_SAMPLES {
                    let problem = format!("it has more than {MOST_SAMPLES} numbers");
                    return Err(RecordingError::Damaged { problem, path: path.to_owned() });
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// Adds the numbers of a value, whose name this is.
    fn collect(&mut self, name: &mut String, time: f64, value: &Value) {
        let length = name.len();
        match value {
            Value::Bool(_) | Value::Text(_) | Value::Undeclared(_) | Value::Opaque(_) => {}
            #[expect(clippy::cast_precision_loss, reason = "signals are compared, not computed with")]
            Value::Int(number) => self.sample(name, time, *number as f64),
            Value::Real(number) => self.sample(name, time, *number),
            Value::Point(coordinates) => {
                for (axis, &number) in [".x", ".y", ".z"].iter().zip(coordinates) {
                    name.push_str(axis);
                    self.sample(name, time, number);
                    name.truncate(length);
                }
            }
            Value::List(elements) => {
                for (at, element) in elements.iter().take(MOST_ELEMENTS).enumerate() {
                    name.push('[');
                    name.push_str(&at.to_string());
                    name.push(']');
                    self.collect(name, time, element);
                    name.truncate(length);
                }
            }
            Value::Record(record) => {
                for (field, value) in record.fields().names().iter().zip(record.values()) {
                    name.push('.');
                    name.push_str(field);
                    self.collect(name, time, value);
                    name.truncate(length);
                }
            }
        }
    }

    fn sample(&mut self, name: &str, time: f64, value: f64) {
        if !value.is_finite() {
            return;
        }
        self.samples += 1;
        if !self.signals.contains_key(name) {
            self.signals.insert(name.to_owned(), Signal::default());
        }
        let Some(Signal { times, values }) = self.signals.get_mut(name) else { return };
        // The last message of an instant counts; an earlier one than before is out of order and left out.
        match times.last() {
            Some(&last) if time < last => {}
            #[expect(clippy::float_cmp, reason = "they are the same instant")]
            Some(&last) if time == last => {
                values.pop();
                values.push(value);
            }
            _ => {
                times.push(time);
                values.push(value);
            }
        }
    }
}
