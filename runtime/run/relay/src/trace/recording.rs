//! Recordings are read: their messages in order of time, and how the recorded run ended.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::{BufReader, Read as _};
use std::path::{Path, PathBuf};

use mcap::McapError;
use mcap::records::{Channel, MessageHeader, Metadata, Record};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;

use sesame_base::observation::OperationEffect;
use sesame_base::time::SimTime;
use sesame_base::visible::visible;
use sesame_plan::{CampaignPlan, OperationId, Span, Type};

use crate::json::{Shapes, decode};
use crate::message::Mismatch;
use crate::trace::records::records;
use crate::trace::{ROLE, ROLE_DELIVERED, ROLE_PUBLISHED, RUN, SUBJECT, TOPIC};
use crate::value::Value;
use crate::wire::{Wire, WireTable};

/// The largest record that is read, in bytes.
const LIMIT: usize = 1 << 26;

/// How much is read at once, in bytes.
const BLOCK: usize = 1 << 16;

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

/// Why a recording cannot be fed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// The file cannot be read.
    #[error("cannot read the recording: {reason}: {}", path.display())]
    Unreadable {
        /// The reason.
        reason: String,
        /// The file.
        path: PathBuf,
    },
    /// It is not an MCAP file.
    #[error("this is not an MCAP file: {}", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
    },
    /// It is truncated.
    #[error("this recording is cut off; `mcap recover` saves what is in it: {}", path.display())]
    CutOff {
        /// The file.
        path: PathBuf,
    },
    /// Its content contradicts itself, or violates the format.
    #[error("this recording is damaged ({problem}); restore the file from a copy, or record it again: {}", path.display())]
    Damaged {
        /// The problem.
        problem: String,
        /// The file.
        path: PathBuf,
    },
    /// Its chunks are compressed.
    #[error(
        "this recording is compressed (`{method}`), which runners do not read: write it without compression, \
         `mcap compress --compression none IN.mcap -o OUT.mcap`: {}", path.display()
    )]
    Compressed {
        /// The method.
        method: String,
        /// The file.
        path: PathBuf,
    },
    /// A topic of the space is recorded in another encoding than JSON.
    #[error("topic `{topic}` is recorded as `{encoding}`; only JSON can be fed to metrics: {}", path.display())]
    Encoding {
        /// The topic.
        topic: String,
        /// Its encoding.
        encoding: String,
        /// The file.
        path: PathBuf,
    },
    /// None of its topics is one of the space.
    #[error("none of the space's topics is in this recording; it has {}: {}", listed(found), path.display())]
    NoTopics {
        /// Topics it has.
        found: Vec<String>,
        /// The file.
        path: PathBuf,
    },
    /// A message is not of the type that the space declares.
    #[error("a message on `{topic}` at {time} is not of its declared type: {reason}: {}", path.display())]
    WrongType {
        /// The topic.
        topic: String,
        /// The time.
        time: SimTime,
        /// The mismatch.
        reason: String,
        /// The file.
        path: PathBuf,
    },
    /// Messages are not in order of time.
    #[error("a message on `{topic}` is earlier than the one before it in the file: put them in order with `mcap sort`: {}", path.display())]
    OutOfOrder {
        /// The topic.
        topic: String,
        /// The file.
        path: PathBuf,
    },
}

/// At most a few names, so that a file cannot fill a terminal.
fn listed(found: &[String]) -> String {
    const SHOWN: usize = 8;
    let mut names: Vec<String> = found.iter().take(SHOWN).map(|name| format!("`{}`", name.escape_debug())).collect();
    if found.len() > SHOWN {
        names.push(format!("{} more", found.len() - SHOWN));
    }
    if names.is_empty() { "none at all".to_owned() } else { names.join(", ") }
}

/// A message of a recording, as it passes.
pub(super) struct Passing<'v> {
    pub(super) time: SimTime,
    pub(super) wire: Wire,
    /// Whether this is the message as it was published.
    pub(super) published: bool,
    /// Whether this is the message as it was delivered.
    pub(super) delivered: bool,
    /// Its number among those published on its wire.
    pub(super) index: u64,
    pub(super) value: &'v Value,
}

/// What a recording says when all of its messages have passed.
pub(super) struct Ending {
    /// The recorded run, if a runner recorded it.
    pub(super) run: Option<RecordedRun>,
    pub(super) end: End,
    /// When operations that count in `fuzzing_time()` were active or held messages back; `None` where that is not
    /// known.
    pub(super) busy: Option<Vec<Span>>,
    /// Warnings for the user.
    pub(super) warnings: Vec<String>,
    /// Messages, as published.
    pub(super) messages: u64,
}

/// How a recording ends.
pub(super) enum End {
    /// The run came to its end then; a recording that no runner made ends with its last message.
    Whole(SimTime),
    /// The run broke off, if that is known, then.
    BrokenOff(Option<SimTime>),
}

/// Passes the messages of a recording on, in order of time and without a simulator.
///
/// The messages of a runner's trace come in the same order as in its run. In any other recording, the JSON messages on
/// topics of the space count, with times since the first of them, both as published and as delivered. The file is read
/// once from start to end; memory holds one record at a time.
pub(super) fn pass(
    path: &Path,
    plan: &CampaignPlan,
    wires: &WireTable,
    each: &mut dyn FnMut(&Passing<'_>) -> Result<(), RecordingError>,
) -> Result<Ending, RecordingError> {
    let file = open(path)?;
    let mut reader = Reader {
        plan,
        wires,
        path,
        channels: BTreeMap::new(),
        other_topics: BTreeSet::new(),
        delivered_apart: vec![false; wires.len()],
        heard: BTreeSet::new(),
        shapes: Shapes::default(),
        start: None,
        now: SimTime::ZERO,
        messages: 0,
        subject: None,
        ending: None,
    };
    read(file, path, &mut |record| reader.record(record, each))?;
    reader.finish()
}

/// When operations that count in `fuzzing_time()` were active or held messages back, as the trace of a runner says at
/// its end; `None` of any other recording.
pub(super) fn busy(path: &Path) -> Result<Option<Vec<Span>>, RecordingError> {
    let (mut subject, mut ending) = (None, None);
    read(open(path)?, path, &mut |record| {
        match record {
            Record::Metadata(Metadata { name, metadata }) if name == SUBJECT => subject = Some(metadata),
            Record::Metadata(Metadata { name, metadata }) if name == RUN => ending = Some(metadata),
            _ => {}
        }
        Ok(())
    })?;
    let Some((subject, ending)) = subject.zip(ending) else { return Ok(None) };
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

fn open(path: &Path) -> Result<File, RecordingError> {
    File::open(path).map_err(|error| RecordingError::Unreadable { reason: error.to_string(), path: path.to_owned() })
}

/// Reads a file from start to end, a record at a time.
pub(super) fn read(
    file: File,
    path: &Path,
    each: &mut dyn FnMut(Record<'_>) -> Result<(), RecordingError>,
) -> Result<(), RecordingError> {
    let mut file = BufReader::with_capacity(BLOCK, file);
    let reading = LinearReaderOptions::default()
        .with_emit_chunks(true)
        .with_validate_data_section_crc(true)
        .with_validate_summary_section_crc(true)
        .with_record_length_limit(LIMIT);
    let mut reader = LinearReader::new_with_options(reading);
    while let Some(event) = reader.next_event() {
        match event.map_err(|error| sorted(error, path))? {
            LinearReadEvent::ReadRequest(wanted) => {
                // Memory for a length that may be damaged is not allocated in advance.
                let block = reader.insert(wanted.min(BLOCK));
                let read = file
                    .read(block)
                    .map_err(|error| RecordingError::Unreadable { reason: error.to_string(), path: path.to_owned() })?;
                reader.notify_read(read);
            }
            LinearReadEvent::Record { opcode, data } => {
                for record in records(opcode, data).map_err(|error| sorted(error, path))? {
                    each(record)?;
                }
            }
        }
    }
    Ok(())
}

/// Converts a problem with a file into an error with a remedy.
fn sorted(error: McapError, path: &Path) -> RecordingError {
    let path = path.to_owned();
    match error {
        McapError::BadMagic => RecordingError::Foreign { path },
        McapError::UnexpectedEof => RecordingError::CutOff { path },
        McapError::UnsupportedCompression(method) => RecordingError::Compressed { method: visible(&method), path },
        McapError::Io(error) => RecordingError::Unreadable { reason: error.to_string(), path },
        other => RecordingError::Damaged { problem: visible(&other.to_string()), path },
    }
}

/// What a channel of the file carries.
#[derive(Clone, Copy)]
struct Line {
    wire: Wire,
    delivered: bool,
}

struct Reader<'a> {
    plan: &'a CampaignPlan,
    wires: &'a WireTable,
    path: &'a Path,
    /// Channels that matter, by their id.
    channels: BTreeMap<u16, Line>,
    /// Some of the topics that do not.
    other_topics: BTreeSet<String>,
    /// Per wire: whether what was delivered is on a channel of its own.
    delivered_apart: Vec<bool>,
    /// Wires with a channel.
    heard: BTreeSet<Wire>,
    shapes: Shapes,
    /// Log time of the start of the run, in nanoseconds: zero in a trace, that of the first message elsewhere.
    start: Option<u64>,
    now: SimTime,
    messages: u64,
    subject: Option<BTreeMap<String, String>>,
    ending: Option<BTreeMap<String, String>>,
}

impl Reader<'_> {
    fn record(
        &mut self,
        record: Record<'_>,
        each: &mut dyn FnMut(&Passing<'_>) -> Result<(), RecordingError>,
    ) -> Result<(), RecordingError> {
        match record {
            Record::Metadata(Metadata { name, metadata }) if name == SUBJECT => {
                self.subject = Some(metadata);
                self.start = Some(0);
            }
            Record::Metadata(Metadata { name, metadata }) if name == RUN => self.ending = Some(metadata),
            Record::Channel(channel) => self.channel(&channel)?,
            Record::Message { header, data } => self.message(header, &data, each)?,
            _ => {}
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
        if channel.message_encoding != "json" {
            return Err(RecordingError::Encoding {
                topic: visible(&channel.topic),
                encoding: channel.message_encoding.escape_debug().to_string(),
                path: self.path.to_owned(),
            });
        }
        let delivered = role == Some(ROLE_DELIVERED);
        self.delivered_apart[wire.index()] |= delivered;
        self.heard.insert(wire);
        self.channels.insert(channel.id, Line { wire, delivered });
        Ok(())
    }

    fn message(
        &mut self,
        header: MessageHeader,
        data: &[u8],
        each: &mut dyn FnMut(&Passing<'_>) -> Result<(), RecordingError>,
    ) -> Result<(), RecordingError> {
        let Some(&Line { wire, delivered }) = self.channels.get(&header.channel_id) else { return Ok(()) };
        let start = *self.start.get_or_insert(header.log_time);
        let since = header.log_time.checked_sub(start).and_then(|since| i64::try_from(since).ok());
        let time = since.map(SimTime::from_nanos).filter(|&time| time >= self.now);
        let Some(time) = time else {
            return Err(RecordingError::OutOfOrder {
                topic: self.wires.path(wire).to_owned(),
                path: self.path.to_owned(),
            });
        };
        self.now = time;
        let ty = &self.plan.topic(self.wires.topic(wire)).ty;
        let value = payload(self.plan, &mut self.shapes, ty, data).map_err(|reason| RecordingError::WrongType {
            topic: self.wires.path(wire).to_owned(),
            time,
            reason: visible(&reason),
            path: self.path.to_owned(),
        })?;
        self.messages += u64::from(!delivered);
        each(&Passing {
            time,
            wire,
            published: !delivered,
            delivered: delivered || !self.delivered_apart[wire.index()],
            index: u64::from(header.sequence),
            value: &value,
        })
    }

    fn finish(self) -> Result<Ending, RecordingError> {
        if self.heard.is_empty() {
            return Err(RecordingError::NoTopics {
                found: self.other_topics.into_iter().collect(),
                path: self.path.to_owned(),
            });
        }
        let damaged =
            |problem: &str| RecordingError::Damaged { problem: problem.to_owned(), path: self.path.to_owned() };
        let missing = self.wires.iter().filter(|wire| !self.heard.contains(wire)).map(|wire| self.wires.path(wire));
        let warnings = missing.map(|path| format!("topic `{path}` is not in the recording")).collect();
        let mut found = Ending { run: None, end: End::Whole(self.now), busy: None, warnings, messages: self.messages };
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

/// When operations that count in `fuzzing_time()` were active or held messages back, according to a trace.
fn timed(subject: &BTreeMap<String, String>, effects: &str) -> serde_json::Result<Vec<Span>> {
    #[derive(Deserialize)]
    struct Recorded<T> {
        operations: Vec<T>,
    }
    #[derive(Deserialize)]
    struct Declared {
        /// As in a plan: omitted if it is true.
        timed: Option<bool>,
    }
    #[derive(Deserialize)]
    struct Use {
        operation: OperationId,
    }
    let entry = |key: &str| subject.get(key).map_or("", String::as_str);
    let declared: Recorded<Declared> = serde_json::from_str(entry("plan"))?;
    let test: Recorded<Use> = serde_json::from_str(entry("definition"))?;
    let effects: Vec<OperationEffect> = serde_json::from_str(effects)?;
    let counts =
        |id: OperationId| declared.operations.get(id.index()).is_none_or(|operation| operation.timed != Some(false));
    let counted = test.operations.iter().zip(effects).filter(|(used, _)| counts(used.operation));
    Ok(counted.flat_map(|(_, effect)| effect.busy().collect::<Vec<_>>()).collect())
}

/// Reads a payload. If it is not an object, it may also stand alone, without the object around it.
pub(super) fn payload(plan: &CampaignPlan, shapes: &mut Shapes, ty: &Type, data: &[u8]) -> Result<Value, String> {
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
    decode(plan, shapes, ty, inner).map_err(|mismatch: Mismatch| mismatch.to_string())
}
