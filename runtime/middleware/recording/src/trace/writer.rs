//! Writes a trace while its test runs.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use mcap::records::{MessageHeader, Metadata};
use mcap::{McapError, McapResult, WriteOptions, Writer};

use sesame_base::observation::Observation;
use sesame_base::time::SimTime;
use sesame_codec::error::CodecError;
use sesame_plan::{CampaignPlan, Channel, Operation, Test, TopicId};
use sesame_relay::json::{number, quoted};
use sesame_relay::relay::{Listener, MessageRef, OperationEvent};
use sesame_relay::value::Value;
use sesame_relay::wire::{Wire, WireTable};

use crate::trace::encoding::{Encoder, Encoding};
use crate::trace::{
    CLOCK, ROLE, ROLE_DELIVERED, ROLE_METRIC, ROLE_OPERATIONS, ROLE_PUBLISHED, Subject, TOPIC, TraceError, ZERO,
    ending, owned, publish,
};

/// How long written data may stay in memory: the trace of a test that hangs must contain its last messages.
const LATEST: Duration = Duration::from_millis(250);

/// The most bytes that are kept in memory before they are written.
const CHUNK: u64 = 1 << 20;

/// Options of all traces of this profile: no compression, which would cost time while a test runs.
pub(super) fn options(profile: &str) -> WriteOptions {
    WriteOptions::new()
        .compression(None)
        .chunk_size(Some(CHUNK))
        .profile(profile)
        .library(concat!("sesame-runtime ", env!("CARGO_PKG_VERSION")))
}

/// Writes the trace of one run. Dropping it without [`TraceWriter::keep`] discards the trace.
pub struct TraceWriter<'a> {
    plan: &'a CampaignPlan,
    test: &'a Test,
    wires: &'a WireTable,
    path: PathBuf,
    shared: Arc<Shared>,
    flusher: Option<JoinHandle<()>>,
    channels: Channels,
    /// One message.
    payload: Vec<u8>,
    kept: bool,
}

struct Channels {
    /// Per wire.
    published: Vec<u16>,
    /// Per wire that an operation of the campaign may touch.
    delivered: Vec<Option<u16>>,
    operations: u16,
    /// Per metric of the plan.
    metrics: Vec<u16>,
    /// Per wire, how its messages are written.
    encoders: Vec<Encoder>,
    of_operations: Encoder,
    of_metrics: Encoder,
}

/// The state shared between the run's thread and the one that flushes.
struct Shared {
    sink: Mutex<Sink>,
    wake: Condvar,
}

struct Sink {
    /// `None` once the file is complete.
    writer: Option<Writer<BufWriter<File>>>,
    /// Something was written since the last flush.
    waiting: bool,
    over: bool,
    /// The first error; nothing is written after it.
    error: Option<McapError>,
    activities: u64,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Sink> {
        // A panic in another thread leaves the sink consistent.
        self.sink.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Sink {
    fn attempt(&mut self, write: impl FnOnce(&mut Writer<BufWriter<File>>) -> McapResult<()>) {
        if let (Some(writer), None) = (&mut self.writer, &self.error) {
            self.waiting = true;
            self.error = write(writer).err();
        }
    }

    /// A message, if it could be written as bytes. That of a hook, say, may be none of its type.
    fn written(
        &mut self,
        written: Result<(), CodecError>,
        of: &str,
        channel: u16,
        sequence: u64,
        time: SimTime,
        payload: &[u8],
    ) {
        match written {
            Ok(()) => self.message(channel, sequence, time, payload),
            Err(error) if self.error.is_none() => {
                self.error =
                    Some(std::io::Error::other(format!("a message of {of} cannot be written: {error}")).into());
            }
            Err(_) => {}
        }
    }

    fn message(&mut self, channel: u16, sequence: u64, time: SimTime, payload: &[u8]) {
        let time = u64::try_from(time.nanos()).unwrap_or(0);
        let header = MessageHeader {
            channel_id: channel,
            sequence: u32::try_from(sequence).unwrap_or(u32::MAX),
            log_time: time,
            publish_time: time,
        };
        self.attempt(|writer| writer.write_to_known_channel(&header, payload));
    }
}

impl<'a> TraceWriter<'a> {
    /// Begins a trace in this file, which must be one of the writer's own and is replaced if it exists.
    pub fn create(path: &Path, subject: Subject<'a>, wires: &'a WireTable) -> Result<Self, TraceError> {
        let failed = |error: McapError| TraceError::new(path, error);
        let file = File::create(path).map_err(|error| failed(error.into()))?;
        let encoding = Encoding::of(subject.plan);
        let mut writer = options(encoding.profile()).create(BufWriter::new(file)).map_err(failed)?;
        let channels = writer
            .write_metadata(&subject.metadata())
            .and_then(|()| Channels::declare(&mut writer, encoding, subject.plan, wires))
            .map_err(failed)?;
        // So that a process that dies at once leaves a trace that identifies its run.
        writer.flush().map_err(failed)?;
        let sink = Sink { writer: Some(writer), waiting: false, over: false, error: None, activities: 0 };
        let shared = Arc::new(Shared { sink: Mutex::new(sink), wake: Condvar::new() });
        let flusher = std::thread::Builder::new().name("trace".to_owned()).spawn({
            let shared = Arc::clone(&shared);
            move || write_out(&shared)
        });
        Ok(TraceWriter {
            plan: subject.plan,
            test: subject.test,
            wires,
            path: path.to_owned(),
            shared,
            flusher: Some(flusher.map_err(|error| failed(error.into()))?),
            channels,
            payload: Vec::new(),
            kept: false,
        })
    }

    /// Completes the trace with the result of the run and gives it this name, in a folder that exists.
    pub fn keep(mut self, observation: &Observation, file: &Path) -> Result<(), TraceError> {
        self.stop_flusher();
        let written = self.complete(observation);
        written.map_err(|error| TraceError::new(&self.path, error))?;
        publish(&self.path, file)?;
        self.kept = true;
        Ok(())
    }

    fn complete(&mut self, observation: &Observation) -> McapResult<()> {
        let sink = &mut *self.shared.lock();
        for (channel, metric) in self.channels.metrics.iter().zip(&observation.metrics) {
            for (at, &(time, value)) in (0u64..).zip(&metric.series) {
                let written = self.channels.of_metrics.number(value, &mut self.payload);
                sink.written(written, "a metric", *channel, at, SimTime::from_seconds(time), &self.payload);
            }
        }
        sink.attempt(|writer| writer.write_metadata(&ending(self.plan, observation)));
        match (sink.error.take(), sink.writer.take()) {
            (None, Some(writer)) => finish(writer),
            (Some(error), _) => Err(error),
            (None, None) => unreachable!("a trace is completed once"),
        }
    }

    fn stop_flusher(&mut self) {
        self.shared.lock().over = true;
        self.shared.wake.notify_all();
        if let Some(flusher) = self.flusher.take() {
            // The thread does not panic; if it did, there would be nothing left to do.
            flusher.join().ok();
        }
    }
}

impl Drop for TraceWriter<'_> {
    fn drop(&mut self) {
        self.stop_flusher();
        self.shared.lock().writer = None;
        if !self.kept {
            // If it cannot be removed, the next trace overwrites it.
            fs::remove_file(&self.path).ok();
        }
    }
}

/// Ends a file and flushes its buffer, so that an error is reported.
pub(super) fn finish(mut writer: Writer<BufWriter<File>>) -> McapResult<()> {
    writer.finish()?;
    writer.into_inner().into_inner().map_err(std::io::IntoInnerError::into_error)?;
    Ok(())
}

/// Flushes data that was in memory for too long, until the trace is over.
fn write_out(shared: &Shared) {
    let mut sink = shared.lock();
    while !sink.over {
        if std::mem::take(&mut sink.waiting) {
            sink.attempt(Writer::flush);
            sink.waiting = false;
        }
        let waited = shared.wake.wait_timeout(sink, LATEST);
        sink = waited.unwrap_or_else(PoisonError::into_inner).0;
    }
}

impl Channels {
    fn declare(
        writer: &mut Writer<BufWriter<File>>,
        encoding: Encoding,
        plan: &CampaignPlan,
        wires: &WireTable,
    ) -> McapResult<Self> {
        let disturbed: BTreeSet<TopicId> = plan.operations.iter().flat_map(Operation::topics).collect();
        let mut channels = Channels {
            published: Vec::with_capacity(wires.len()),
            delivered: Vec::with_capacity(wires.len()),
            operations: 0,
            metrics: Vec::with_capacity(plan.metrics.len()),
            encoders: Vec::with_capacity(wires.len()),
            of_operations: encoding.operations(),
            of_metrics: encoding.metric(None),
        };
        let mut add = |encoder: &Encoder, topic: &str, role: &[(&str, String)]| {
            let (name, of_schema, text) = encoder.schema();
            let schema = writer.add_schema(name, of_schema, text)?;
            writer.add_channel(schema, topic, encoder.encoding(), &owned(role.iter().cloned()))
        };
        let role = |role: &str, name: &str| [(ROLE, role.to_owned()), ("sesame_name", name.to_owned())];
        for wire in wires.iter() {
            let topic = plan.topic(wires.topic(wire));
            // A service's request and reply have one name.
            let of_topic = |kind: &str, path: &str| {
                let [role, name] = role(kind, path);
                [role, name, (TOPIC, topic.name.clone())]
            };
            let path = wires.path(wire);
            let encoder = encoding.topic(plan, wires.topic(wire));
            let encoder = encoder.map_err(|reason| std::io::Error::other(format!("`{path}`: {reason}")))?;
            // Players of ROS take a name for that of one topic.
            let shown = match topic.channel {
                Channel::Request if encoding.is_of_ros() => format!("{path}/request"),
                Channel::Reply if encoding.is_of_ros() => format!("{path}/reply"),
                _ => path.to_owned(),
            };
            channels.published.push(add(&encoder, &shown, &of_topic(ROLE_PUBLISHED, path))?);
            channels.delivered.push(if disturbed.contains(&wires.topic(wire)) {
                Some(add(&encoder, &format!("{shown}/delivered"), &of_topic(ROLE_DELIVERED, path))?)
            } else {
                None
            });
            channels.encoders.push(encoder);
        }
        let root = if encoding.is_of_ros() { "/" } else { "" };
        let name = format!("{root}sesame/operations");
        channels.operations = add(&channels.of_operations, &name, &role(ROLE_OPERATIONS, ""))?;
        for metric in &plan.metrics {
            let encoder = encoding.metric(metric.unit.as_deref());
            let topic = format!("{root}sesame/metrics/{}", metric.name);
            channels.metrics.push(add(&encoder, &topic, &role(ROLE_METRIC, &metric.name))?);
        }
        Ok(channels)
    }
}

impl TraceWriter<'_> {
    fn message(&mut self, channel: u16, now: SimTime, wire: Wire, index: u64, value: &Value) {
        let written = self.channels.encoders[wire.index()].message(value, &mut self.payload);
        self.shared.lock().written(written, self.wires.path(wire), channel, index, now, &self.payload);
    }
}

impl Listener for TraceWriter<'_> {
    fn published(&mut self, now: SimTime, wire: Wire, index: u64, value: &Value) {
        self.message(self.channels.published[wire.index()], now, wire, index, value);
    }

    fn delivered(&mut self, now: SimTime, wire: Wire, index: u64, value: &Value) {
        let Some(channel) = self.channels.delivered[wire.index()] else { return };
        self.message(channel, now, wire, index, value);
    }

    fn clock_at_zero(&mut self, seconds: f64) {
        let metadata = Metadata { name: CLOCK.to_owned(), metadata: owned([(ZERO, seconds.to_string())]) };
        self.shared.lock().attempt(|writer| writer.write_metadata(&metadata));
    }

    fn operated(&mut self, now: SimTime, operation: usize, event: OperationEvent) {
        let (did, touched, until) = match event {
            OperationEvent::Started => ("started", None, None),
            OperationEvent::Ended => ("ended", None, None),
            OperationEvent::Changed(touched) => ("changed", Some(touched), None),
            OperationEvent::Dropped(touched) => ("dropped", Some(touched), None),
            OperationEvent::Injected(touched) => ("injected", Some(touched), None),
            OperationEvent::Delayed(touched, until) => ("delayed", Some(touched), Some(until)),
        };
        let mut json = Vec::new();
        json.extend_from_slice(b"{\"operation\":");
        quoted(&self.plan.operation(self.test.operations[operation].operation).name, &mut json);
        json.extend_from_slice(format!(",\"position\":{operation},\"did\":\"{did}\"").as_bytes());
        if let Some(MessageRef { wire, index }) = touched {
            json.extend_from_slice(b",\"topic\":");
            quoted(self.wires.path(wire), &mut json);
            json.extend_from_slice(format!(",\"message\":{index}").as_bytes());
        }
        if let Some(until) = until {
            json.extend_from_slice(b",\"until_s\":");
            number(until.seconds(), &mut json);
        }
        json.push(b'}');
        let written = self.channels.of_operations.object(&String::from_utf8_lossy(&json), &mut self.payload);
        let sink = &mut *self.shared.lock();
        let sequence = sink.activities;
        sink.activities += 1;
        sink.written(written, "operations", self.channels.operations, sequence, now, &self.payload);
    }
}
