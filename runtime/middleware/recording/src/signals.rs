//! The signals of a recording: every number in its messages, over time.

use std::collections::BTreeMap;
use std::path::Path;

use sesame_plan::CampaignPlan;
use sesame_relay::value::Value;
use sesame_relay::wire::WireTable;

use crate::error::RecordingError;
use crate::pass::{Read, pass};
use crate::payload::Reads;

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
/// In a recording that no runner made, times are those since its first message on a topic of the plan. One that is cut
/// off or damaged is refused: what is missing may be what matters in a lab.
pub fn signals(
    path: &Path,
    plan: &CampaignPlan,
    wires: &WireTable,
) -> Result<BTreeMap<String, Signal>, RecordingError> {
    let mut collector = Collector { samples: 0, signals: BTreeMap::new() };
    let ending = pass(path, plan, wires, Reads::Declared, &mut |read| {
        let Read::Message(message) = read else { return Ok(()) };
        if !message.published {
            return Ok(());
        }
        #[expect(clippy::cast_precision_loss, reason = "a run of 104 days has times to the nanosecond")]
        let time = message.time.nanos() as f64 / 1e9;
        collector.collect(&mut wires.path(message.wire).to_owned(), time, message.value);
        if collector.samples > MOST_SAMPLES {
            let problem = format!("it has more than {MOST_SAMPLES} numbers");
            return Err(RecordingError::TooLong { problem, path: path.to_owned() });
        }
        Ok(())
    })?;
    ending.damage.map_or(Ok(collector.signals), Err)
}

struct Collector {
    samples: usize,
    signals: BTreeMap<String, Signal>,
}

impl Collector {
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
