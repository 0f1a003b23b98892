//! Writes a trace while its test runs.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use mcap::records::MessageHeader;
use mcap::{McapError, McapResult, WriteOptions, Writer};

use sesame_base::observation::Observation;
use sesame_base::time::SimTime;
use sesame_plan::{CampaignPlan, Operation, Test, TopicId, Type};
use sesame_relay::json::{encode, number, quoted};
use sesame_relay::relay::{Listener, MessageRef, OperationEvent};
use sesame_relay::value::Value;
use sesame_relay::wire::{Wire, WireTable};

use crate::trace::{
    ROLE, ROLE_DELIVERED, ROLE_METRIC, ROLE_OPERATIONS, ROLE_PUBLISHED, Subject, TOPIC, TraceError, ending, owned,
    publish, schema,
};

/// How long written data may stay in memory: the trace of a test that hangs must contain its last messages.
const LATEST: Duration = Duration::from_millis(250);

/// The most bytes that are kept in memory before they are written.
const CHUNK: u64 = 1 << 20;

/// Options of all traces: no compression, which would need C libraries.
pub(super) fn options() -> WriteOptions {
    WriteOptions::new()
        .compression(None)
        .chunk_size(Some(CHUNK))
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
    /// The JSON of one message.
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
    /// Per wire: whether its messages are objects by themselves.
    objects: Vec<bool>,
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
        let mut writer = options().create(BufWriter::new(file)).map_err(failed)?;
        let channels = writer
            .write_metadata(&subject.metadata())
            .and_then(|()| Channels::declare(&mut writer, subject.plan, wires))
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
                self.payload.clear();
                self.payload.extend_from_slice(b"{\"value\":");
                number(value, &mut self.payload);
                self.payload.push(b'}');
                sink.message(*channel, at, SimTime::from_seconds(time), &self.payload);
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
    fn declare(writer: &mut Writer<BufWriter<File>>, plan: &CampaignPlan, wires: &WireTable) -> McapResult<Self> {
        let disturbed: BTreeSet<TopicId> = plan.operations.iter().flat_map(Operation::topics).collect();
        let mut channels = Channels {
            published: Vec::with_capacity(wires.len()),
            delivered: Vec::with_capacity(wires.len()),
            operations: 0,
            metrics: Vec::with_capacity(plan.metrics.len()),
            objects: Vec::with_capacity(wires.len()),
        };
        let mut add = |(name, schema): (String, Vec<u8>), topic: &str, role: &[(&str, String)]| {
            let schema = writer.add_schema(&name, "jsonschema", &schema)?;
            writer.add_channel(schema, topic, "json", &owned(role.iter().cloned()))
        };
        let role = |role: &str, name: &str| [(ROLE, role.to_owned()), ("sesame_name", name.to_owned())];
        for wire in wires.iter() {
            let topic = plan.topic(wires.topic(wire));
            // A service's request and reply have one name.
            let of_topic = |kind: &str, path: &str| {
                let [role, name] = role(kind, path);
                [role, name, (TOPIC, topic.name.clone())]
            };
            let (schema, path) = (schema::of_messages(plan, &topic.ty), wires.path(wire));
            channels.objects.push(matches!(topic.ty, Type::Message { .. }));
            channels.published.push(add(schema.clone(), path, &of_topic(ROLE_PUBLISHED, path))?);
            channels.delivered.push(if disturbed.contains(&wires.topic(wire)) {
                Some(add(schema, &format!("{path}/delivered"), &of_topic(ROLE_DELIVERED, path))?)
            } else {
                None
            });
        }
        channels.operations = add(schema::of_operations(), "sesame/operations", &role(ROLE_OPERATIONS, ""))?;
        for metric in &plan.metrics {
            let schema = schema::of_metric(metric.unit.as_deref());
            let topic = format!("sesame/metrics/{}", metric.name);
            channels.metrics.push(add(schema, &topic, &role(ROLE_METRIC, &metric.name))?);
        }
        Ok(channels)
    }
}

impl TraceWriter<'_> {
    fn payload(&mut self, wire: Wire, value: &Value) {
        self.payload.clear();
        if self.channels.objects[wire.index()] {
            encode(value, &mut self.payload);
        } else {
            self.payload.extend_from_slice(b"{\"value\":");
            encode(value, &mut self.payload);
            self.payload.push(b'}');
        }
    }
}

impl Listener for TraceWriter<'_> {
    fn published(&mut self, now: SimTime, wire: Wire, index: u64, value: &Value) {
        self.payload(wire, value);
        self.shared.lock().message(self.channels.published[wire.index()], index, now, &self.payload);
    }

    fn delivered(&mut self, now: SimTime, wire: Wire, index: u64, value: &Value) {
        let Some(channel) = self.channels.delivered[wire.index()] else { return };
        self.payload(wire, value);
        self.shared.lock().message(channel, index, now, &self.payload);
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
        let payload = &mut self.payload;
        payload.clear();
        payload.extend_from_slice(b"{\"operation\":");
        quoted(&self.plan.operation(self.test.operations[operation].operation).name, payload);
        payload.extend_from_slice(format!(",\"position\":{operation},\"did\":\"{did}\"").as_bytes());
        if let Some(MessageRef { wire, index }) = touched {
            payload.extend_from_slice(b",\"topic\":");
            quoted(self.wires.path(wire), payload);
            payload.extend_from_slice(format!(",\"message\":{index}").as_bytes());
        }
        if let Some(until) = until {
            payload.extend_from_slice(b",\"until_s\":");
            number(until.seconds(), payload);
        }
        payload.push(b'}');
        let sink = &mut *self.shared.lock();
        let sequence = sink.activities;
        sink.activities += 1;
        sink.message(self.channels.operations, sequence, now, payload);
    }
}
