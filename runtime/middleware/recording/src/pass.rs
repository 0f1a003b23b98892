//! Recordings are read: their messages in order of time, and how the recorded run ended.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use sesame_base::observation::OperationEffect;
use sesame_base::time::SimTime;
use sesame_base::visible::visible;
use sesame_plan::{CampaignPlan, Choice, OperationId, Span};
use sesame_relay::feed::{End, Passing};
use sesame_relay::json::Shapes;
use sesame_relay::metric::Scene;
use sesame_relay::wire::{Wire, WireTable};

use crate::container::{Channel, Entry, Message, read};
use crate::error::RecordingError;
use crate::layout::Unreadable;
use crate::order::Order;
use crate::payload::{Payloads, Reads};
use crate::trace::{CLOCK, ROLE, ROLE_DELIVERED, ROLE_PUBLISHED, RUN, SUBJECT, TOPIC, ZERO};

/// The run that a trace is of.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RecordedRun {
    /// The space.
    pub space: String,
    /// The campaign.
    pub campaign: String,
    /// The test's name.
    pub test: String,
    /// `completed`, `no_effect` (`void` in traces of earlier releases), `crash` or `timeout`.
    pub outcome: String,
    /// The metrics of the run; empty if its worker died.
    pub metrics: Vec<RecordedMetric>,
}

/// A metric as it was when the run was recorded.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RecordedMetric {
    /// Its name.
    pub name: String,
    /// Its value; `None` for no value.
    pub value: Option<f64>,
}

/// What a recording says when all of its messages have passed.
pub(crate) struct Ending {
    /// The recorded run, if a runner recorded it.
    pub(crate) run: Option<RecordedRun>,
    pub(crate) end: End,
    /// When operations that count in `fuzzing_time()` were active or held messages back; `None` where that is not
    /// known.
    pub(crate) busy: Option<Vec<Span>>,
    /// Warnings for the user.
    pub(crate) warnings: Vec<String>,
    /// Why there is no more of it, if it is cut off or damaged. The warnings say it too.
    pub(crate) damage: Option<RecordingError>,
    /// Messages, as published.
    pub(crate) messages: u64,
}

/// What a recording says, in its order.
pub(crate) enum Read<'v> {
    /// The parameters of the space for which the test chose a value, by the names that they had.
    Scene(Arc<Scene>),
    /// What the clock of the stamps showed at time zero, in seconds; not said if stamps are in simulation time.
    ClockAtZero(f64),
    Message(Passing<'v>),
}

/// Passes the messages of a recording on, in order of time and without a simulator.
///
/// The messages of a runner's trace come in the same order as in its run. In any other recording, the messages on
/// topics of the space count, with times since the first of them, both as published and as delivered; if it is cut off
/// or damaged, what comes before is passed on, with a warning. The file is read once from start to end, in bounded
/// memory. Messages in bytes have only those fields that are read.
pub(crate) fn pass(
    path: &Path,
    plan: &CampaignPlan,
    wires: &WireTable,
    reads: Reads,
    each: &mut dyn FnMut(Read<'_>) -> Result<(), RecordingError>,
) -> Result<Ending, RecordingError> {
    // Where traces are recorded, all is wanted.
    let mut unrecorded = plan.clone();
    unrecorded.campaign.record = None;
    let mut reader = Reader {
        plan: &unrecorded,
        reads,
        wires,
        path,
        file: 0,
        channels: BTreeMap::new(),
        other_topics: BTreeSet::new(),
        delivered_apart: vec![false; wires.len()],
        heard: BTreeSet::new(),
        lines: Vec::new(),
        order: Order::default(),
        counted: vec![0; wires.len()],
        shapes: Shapes::default(),
        start: None,
        now: SimTime::ZERO,
        messages: 0,
        subject: None,
        ending: None,
    };
    let mut failed = false;
    let read = read(path, &mut |entry| reader.entry(entry, each).inspect_err(|_| failed = true));
    let damage = match read {
        Ok(()) => None,
        // What a runner wrote is known to be whole, or is recovered.
        Err(error) if failed || reader.subject.is_some() || reader.heard.is_empty() => return Err(error),
        Err(error) => match error.damage() {
            Some(what) => Some((what, error)),
            None => return Err(error),
        },
    };
    while let Some(next) = reader.order.next() {
        reader.pass(next.channel, None, next.time, &next.data, each)?;
    }
    reader.finish(damage)
}

/// When operations that count in `fuzzing_time()` were active or held messages back, as the trace of a runner says at
/// its end; `None` of any other recording.
pub(crate) fn busy(path: &Path) -> Result<Option<Vec<Span>>, RecordingError> {
    let (mut subject, mut ending) = (None, None);
    let read = read(path, &mut |entry| {
        match entry {
            Entry::Metadata(name, metadata) if name == SUBJECT => subject = Some(metadata),
            Entry::Metadata(name, metadata) if name == RUN => ending = Some(metadata),
            _ => {}
        }
        Ok(())
    });
    let Some((subject, ending)) = subject.zip(ending) else { return Ok(None) };
    read?;
    busy_of(&subject, &ending, path)
}

fn busy_of(
    subject: &BTreeMap<String, String>,
    ending: &BTreeMap<String, String>,
    path: &Path,
) -> Result<Option<Vec<Span>>, RecordingError> {
    let Some(effects) = ending.get("operations") else { return Ok(None) };
    let damaged =
        |_| RecordingError::Damaged { problem: "what operations did cannot be read".to_owned(), path: path.to_owned() };
    timed(subject, effects).map(Some).map_err(damaged)
}

/// What a channel of the file carries.
struct Line {
    wire: Wire,
    delivered: bool,
    payloads: Payloads,
}

struct Reader<'a> {
    plan: &'a CampaignPlan,
    reads: Reads,
    wires: &'a WireTable,
    path: &'a Path,
    /// How many files of the recording have begun.
    file: u32,
    /// Positions in `lines` of the channels that matter, by file and number.
    channels: BTreeMap<(u32, u32), u32>,
    lines: Vec<Line>,
    /// Some of the topics that do not.
    other_topics: BTreeSet<String>,
    /// Per wire: whether what was delivered is on a channel of its own.
    delivered_apart: Vec<bool>,
    /// Wires with a channel.
    heard: BTreeSet<Wire>,
    /// Messages of a recording that no runner made.
    order: Order,
    /// Per wire: its messages in such a recording.
    counted: Vec<u64>,
    shapes: Shapes,
    /// Log time of the start of the run, in nanoseconds: zero in a trace, that of the first message elsewhere.
    start: Option<u64>,
    now: SimTime,
    messages: u64,
    subject: Option<BTreeMap<String, String>>,
    ending: Option<BTreeMap<String, String>>,
}

/// The most channels of topics of the space that all files of a recording have.
const MOST_LINES: usize = 1 << 20;

impl Reader<'_> {
    fn entry(
        &mut self,
        entry: Entry<'_>,
        each: &mut dyn FnMut(Read<'_>) -> Result<(), RecordingError>,
    ) -> Result<(), RecordingError> {
        match entry {
            Entry::File => self.file += 1,
            Entry::Metadata(name, metadata) if name == SUBJECT => {
                let scene = chosen(&metadata).map_err(|_| self.damaged("its test cannot be read"))?;
                self.subject = Some(metadata);
                self.start = Some(0);
                return each(Read::Scene(scene));
            }
            Entry::Metadata(name, metadata) if name == RUN => self.ending = Some(metadata),
            Entry::Metadata(name, metadata) if name == CLOCK => {
                let zero = metadata.get(ZERO).and_then(|zero| zero.parse().ok());
                return each(Read::ClockAtZero(zero.ok_or_else(|| self.damaged("its clock cannot be read"))?));
            }
            Entry::Metadata(..) => {}
            Entry::Channel(channel) => self.channel(&channel)?,
            Entry::Message(Message { channel, sequence, time, data }) => {
                let Some(&line) = self.channels.get(&(self.file, channel)) else { return Ok(()) };
                if self.subject.is_some() {
                    return self.pass(line, Some(sequence), time, data, each);
                }
                self.order.add(time, line, data);
                while let Some(next) = self.order.due() {
                    self.pass(next.channel, None, next.time, &next.data, each)?;
                }
            }
        }
        Ok(())
    }

    fn channel(&mut self, channel: &Channel) -> Result<(), RecordingError> {
        const REMEMBERED: usize = 100;
        let role = channel.metadata.get(ROLE).map(String::as_str);
        let name = match role {
            Some(ROLE_PUBLISHED | ROLE_DELIVERED) => channel.metadata.get("sesame_name"),
            Some(_) => None,
            None => Some(&channel.topic),
        };
        let topic = channel.metadata.get(TOPIC).map(String::as_str);
        let Some(wire) = name.and_then(|name| self.wires.find_of(self.plan, name, topic)) else {
            if self.other_topics.len() < REMEMBERED {
                self.other_topics.insert(channel.topic.clone());
            }
            return Ok(());
        };
        let path = || self.path.to_owned();
        let topic = || visible(&channel.topic);
        let payloads =
            Payloads::new(self.plan, self.wires.topic(wire), channel, self.reads).map_err(
                |unreadable| match unreadable {
                    Unreadable::Encoding => RecordingError::Encoding {
                        topic: topic(),
                        encoding: channel.encoding.escape_debug().to_string(),
                        path: path(),
                    },
                    Unreadable::Layout(reason) => {
                        RecordingError::Layout { topic: topic(), reason: visible(&reason), path: path() }
                    }
                },
            )?;
        let delivered = role == Some(ROLE_DELIVERED);
        self.delivered_apart[wire.index()] |= delivered;
        self.heard.insert(wire);
        let at = u32::try_from(self.lines.len()).ok().filter(|_| self.lines.len() < MOST_LINES);
        let too_long = || RecordingError::TooLong { problem: "it has too many channels".to_owned(), path: path() };
        self.channels.insert((self.file, channel.id), at.ok_or_else(too_long)?);
        self.lines.push(Line { wire, delivered, payloads });
        Ok(())
    }

    /// A message whose turn it is. One without a number is numbered here.
    fn pass(
        &mut self,
        line: u32,
        sequence: Option<u32>,
        log_time: u64,
        data: &[u8],
        each: &mut dyn FnMut(Read<'_>) -> Result<(), RecordingError>,
    ) -> Result<(), RecordingError> {
        let &Line { wire, delivered, ref payloads } = &self.lines[line as usize];
        if self.start.is_none() {
            // The clock of other recorders is that of their messages.
            each(Read::ClockAtZero(Duration::from_nanos(log_time).as_secs_f64()))?;
        }
        let start = *self.start.get_or_insert(log_time);
        let since = log_time.checked_sub(start).and_then(|since| i64::try_from(since).ok());
        let time = since.map(SimTime::from_nanos).filter(|&time| time >= self.now);
        let Some(time) = time else {
            return Err(RecordingError::OutOfOrder {
                topic: self.wires.path(wire).to_owned(),
                path: self.path.to_owned(),
            });
        };
        self.now = time;
        let ty = &self.plan.topic(self.wires.topic(wire)).ty;
        let value =
            payloads.read(self.plan, &mut self.shapes, ty, data).map_err(|reason| RecordingError::WrongType {
                topic: self.wires.path(wire).to_owned(),
                time,
                reason: visible(&reason),
                path: self.path.to_owned(),
            })?;
        self.messages += u64::from(!delivered);
        let counted = &mut self.counted[wire.index()];
        let index = sequence.map_or(*counted, u64::from);
        *counted += 1;
        each(Read::Message(Passing {
            time,
            wire,
            published: !delivered,
            delivered: delivered || !self.delivered_apart[wire.index()],
            index,
            value: &value,
        }))
    }

    fn damaged(&self, problem: &str) -> RecordingError {
        RecordingError::Damaged { problem: problem.to_owned(), path: self.path.to_owned() }
    }

    fn finish(self, damage: Option<(String, RecordingError)>) -> Result<Ending, RecordingError> {
        if self.heard.is_empty() {
            return Err(RecordingError::NoTopics {
                found: self.other_topics.into_iter().collect(),
                path: self.path.to_owned(),
            });
        }
        let damaged = |problem: &str| self.damaged(problem);
        let missing = self.wires.iter().filter(|wire| !self.heard.contains(wire)).map(|wire| self.wires.path(wire));
        let mut warnings: Vec<String> = missing.map(|path| format!("topic `{path}` is not in the recording")).collect();
        let (what, damage) = damage.unzip();
        warnings.extend(what.map(|what| format!("{what}; what comes before, up to {}, is used", self.now)));
        let end = End::Whole(self.now);
        let mut found = Ending { run: None, end, busy: None, warnings, damage, messages: self.messages };
        let (subject, ending) = match (&self.subject, &self.ending) {
            (Some(subject), Some(ending)) => (subject, ending),
            (Some(_), None) => return Err(damaged("it does not say how its run ended")),
            (None, _) => return Ok(found),
        };
        let text = |entries: &BTreeMap<String, String>, key: &str| entries.get(key).cloned().unwrap_or_default();
        let metrics = match ending.get("metrics") {
            Some(metrics) => serde_json::from_str(metrics).map_err(|_| damaged("its metrics cannot be read"))?,
            None => Vec::new(),
        };
        found.busy = busy_of(subject, ending, self.path)?;
        let outcome = text(ending, "outcome");
        found.end = match ending.get("end_s") {
            Some(end) if matches!(outcome.as_str(), "completed" | "no_effect" | "void") => {
                let seconds = end.parse().map_err(|_| damaged("its end is not a number"))?;
                End::Whole(SimTime::from_seconds(seconds).max(self.now))
            }
            end => End::BrokenOff(end.and_then(|end| end.parse().ok()).map(SimTime::from_seconds)),
        };
        found.run = Some(RecordedRun {
            space: text(subject, "space"),
            campaign: text(subject, "campaign"),
            test: text(subject, "test"),
            outcome,
            metrics,
        });
        Ok(found)
    }
}

/// Operations as a trace has them: those of its plan, or those that its test uses.
#[derive(Deserialize)]
struct Recorded<T> {
    operations: Vec<T>,
}

impl<T: DeserializeOwned> Recorded<T> {
    fn read(subject: &BTreeMap<String, String>, key: &str) -> serde_json::Result<Self> {
        serde_json::from_str(subject.get(key).map_or("", String::as_str))
    }
}

/// The parameters of the space for which the test of a trace chose a value.
fn chosen(subject: &BTreeMap<String, String>) -> serde_json::Result<Arc<Scene>> {
    #[derive(Deserialize)]
    struct Declared {
        name: String,
        kind: Kind,
    }
    #[derive(Deserialize)]
    struct Kind {
        kind: String,
    }
    #[derive(Deserialize)]
    struct Use {
        operation: OperationId,
        parameters: Vec<serde_json::Value>,
    }
    let declared: Recorded<Declared> = Recorded::read(subject, "plan")?;
    let test: Recorded<Use> = Recorded::read(subject, "definition")?;
    let mut chosen = Vec::new();
    for Use { operation, parameters } in test.operations {
        let declared = declared.operations.get(operation.index());
        let Some(scene) = declared.filter(|declared| declared.kind.kind == "scene") else { continue };
        for parameter in parameters {
            if let Choice::Value { value } = serde_json::from_value(parameter)? {
                chosen.push((scene.name.clone(), value));
            }
        }
    }
    Ok(chosen.into())
}

/// When operations that count in `fuzzing_time()` were active or held messages back, according to a trace.
fn timed(subject: &BTreeMap<String, String>, effects: &str) -> serde_json::Result<Vec<Span>> {
    #[derive(Deserialize)]
    struct Declared {
        /// As in a plan: omitted if it is true.
        timed: Option<bool>,
    }
    #[derive(Deserialize)]
    struct Use {
        operation: OperationId,
    }
    let declared: Recorded<Declared> = Recorded::read(subject, "plan")?;
    let test: Recorded<Use> = Recorded::read(subject, "definition")?;
    let effects: Vec<OperationEffect> = serde_json::from_str(effects)?;
    let counts =
        |id: OperationId| declared.operations.get(id.index()).is_none_or(|operation| operation.timed != Some(false));
    let counted = test.operations.iter().zip(effects).filter(|(used, _)| counts(used.operation));
    Ok(counted.flat_map(|(_, effect)| effect.busy().collect::<Vec<_>>()).collect())
}
