//! The messages between runner and simulator: one JSON object per line. `docs/process.md` describes the protocol for
//! authors of simulators.

use std::borrow::Cow;
use std::io::{self, BufRead};

use serde::Deserialize;
use serde::de::IgnoredAny;
use serde_json::value::RawValue;

use sesame_base::time::SimTime;

use crate::json::{number, quoted};
use crate::simulator::{Offers, no_such_parameter};
use crate::transport::TransportError;

/// The longest line either side may write, in bytes.
pub(super) const LINE_LIMIT: usize = 16 << 20;

/// A line of the simulator.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum SimulatorMessage<'a> {
    /// It is at time zero: the answer to `reset`.
    #[serde(borrow)]
    Ready(Ready<'a>),
    /// Messages of the current step, whose deliveries it waits for.
    #[serde(borrow)]
    Publish(Vec<Message<'a>>),
    /// The step is over; for a free-running simulator, the scenario.
    #[serde(borrow)]
    Done(Done<'a>),
    /// The simulation time of a free-running simulator with a clock of its own, in seconds.
    Time(f64),
    /// It cannot continue, with its reason.
    Failed(String),
}

impl SimulatorMessage<'_> {
    /// The keyword of the line.
    pub(super) fn keyword(&self) -> &'static str {
        match self {
            SimulatorMessage::Ready(_) => "ready",
            SimulatorMessage::Publish(_) => "publish",
            SimulatorMessage::Done(_) => "done",
            SimulatorMessage::Time(_) => "time",
            SimulatorMessage::Failed(_) => "failed",
        }
    }
}

/// The answer to `reset`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Ready<'a> {
    /// Topics it publishes.
    #[serde(default)]
    pub(super) publishes: Vec<String>,
    /// Topics to which it subscribes.
    #[serde(default)]
    pub(super) subscribes: Vec<String>,
    /// Parameters that it takes with `reset`.
    #[serde(default)]
    pub(super) parameters: Vec<String>,
    /// Nodes that are parts of it, and what it can do to each of them.
    #[serde(default)]
    pub(super) nodes: Offers,
    /// Whether it can be reset again; if not, it is restarted for each test.
    #[serde(default)]
    pub(super) resets: bool,
    /// Whether a free-running simulator sends its simulation time; otherwise simulation time is wall time.
    #[serde(default)]
    pub(super) clock: bool,
    /// Whether it wants to know when each message was delivered.
    #[serde(default)]
    pub(super) times: bool,
    /// Messages of time zero.
    #[serde(default, borrow)]
    pub(super) messages: Vec<Message<'a>>,
}

impl Ready<'_> {
    /// Refuses a parameter that was sent and that the simulator does not take.
    pub(super) fn takes(&self, parameters: &[(String, f64)]) -> Result<(), TransportError> {
        match parameters.iter().find(|(name, _)| !self.parameters.contains(name)) {
            None => Ok(()),
            Some((unknown, _)) => Err(TransportError::Simulator(no_such_parameter(unknown, &self.parameters))),
        }
    }
}

/// The end of a step.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Done<'a> {
    /// Messages of the step that need no answer.
    #[serde(default, borrow)]
    pub(super) messages: Vec<Message<'a>>,
    /// Whether the scenario has ended.
    #[serde(default)]
    pub(super) ended: bool,
}

/// A message on a topic.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Message<'a> {
    /// The topic's name on the wire.
    #[serde(borrow)]
    pub(super) topic: Cow<'a, str>,
    /// The payload.
    #[serde(borrow)]
    pub(super) value: &'a RawValue,
    /// Whether the simulator has given it to its own subscribers.
    #[serde(default)]
    pub(super) delivered: bool,
}

/// The simulator's lines, counted from its last reset.
pub(super) struct Lines<R> {
    reader: R,
    line: Line,
    limit: usize,
}

impl<R: BufRead> Lines<R> {
    pub(super) fn new(reader: R, limit: usize) -> Self {
        Lines { reader, line: Line::default(), limit }
    }

    /// The stream of the lines.
    pub(super) fn reader(&self) -> &R {
        &self.reader
    }

    /// The last line that was read.
    pub(super) fn line(&self) -> &Line {
        &self.line
    }

    /// Counts from one again.
    pub(super) fn recount(&mut self) {
        self.line.number = 0;
    }

    /// Reads the next line; `false` at the end of the output, even in the middle of a line.
    pub(super) fn read(&mut self) -> Result<bool, TransportError> {
        self.line.number += 1;
        match read_line(&mut self.reader, self.limit, &mut self.line.bytes) {
            Read::Line => Ok(true),
            Read::End => Ok(false),
            Read::TooLong => Err(self.line.too_long(self.limit)),
        }
    }
}

/// What was read of a stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Read {
    Line,
    /// The stream has ended, perhaps in the middle of a line.
    End,
    /// The line is longer than permitted, and was not read completely.
    TooLong,
}

/// Reads a line of at most `limit` bytes, without its line feed.
pub(super) fn read_line(reader: &mut impl BufRead, limit: usize, line: &mut Vec<u8>) -> Read {
    line.clear();
    loop {
        let available = match reader.fill_buf() {
            Ok(available) => available,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            // The other end is closed; errors differ between systems.
            Err(_) => return Read::End,
        };
        if available.is_empty() {
            return Read::End;
        }
        let end = available.iter().position(|&byte| byte == b'\n');
        let taken = end.unwrap_or(available.len());
        if line.len() + taken > limit {
            return Read::TooLong;
        }
        line.extend_from_slice(&available[..taken]);
        reader.consume(taken + usize::from(end.is_some()));
        if end.is_some() {
            return Read::Line;
        }
    }
}

/// A line of the simulator, with its number since the last reset.
#[derive(Debug, Default)]
pub(super) struct Line {
    pub(super) bytes: Vec<u8>,
    pub(super) number: u64,
}

impl Line {
    /// The beginning of the line, for an error message.
    pub(super) fn shown(&self) -> String {
        shown(&String::from_utf8_lossy(&self.bytes))
    }

    /// Parses the line.
    pub(super) fn parse(&self) -> Result<SimulatorMessage<'_>, TransportError> {
        let Ok(text) = std::str::from_utf8(&self.bytes) else {
            return Err(self.wrong("is not UTF-8".to_owned(), "the protocol is JSON in UTF-8"));
        };
        serde_json::from_str(text).map_err(|error| self.not_understood(text, &error))
    }

    /// The error about a line that is longer than permitted.
    pub(super) fn too_long(&self, limit: usize) -> TransportError {
        self.wrong(format!("is longer than {limit} bytes"), "send less in one line, or several lines")
    }

    fn not_understood(&self, text: &str, error: &serde_json::Error) -> TransportError {
        let shown = shown(text);
        if serde_json::from_str::<IgnoredAny>(text).is_ok() {
            let why = error.to_string();
            let why = why.split(" at line ").next().unwrap_or_default();
            let remedy = "a simulator sends `ready`, `publish`, `done` or `failed`, as docs/process.md describes";
            return self.wrong(format!("is not of the protocol ({why}): {shown}"), remedy);
        }
        // As Python and JavaScript write numbers that JSON does not have.
        if ["NaN", "Infinity"].iter().any(|name| has_bare_word(text, name)) {
            let remedy = "write such a number as the string \"NaN\", \"Infinity\" or \"-Infinity\"";
            return self.wrong(format!("holds a number that JSON does not have: {shown}"), remedy);
        }
        let remedy = "standard output is reserved for the protocol, print everything else to standard error";
        self.wrong(format!("is not JSON: {shown}"), remedy)
    }

    /// An error about this line.
    pub(super) fn wrong(&self, problem: String, remedy: impl Into<String>) -> TransportError {
        TransportError::Protocol { line: self.number, problem, remedy: remedy.into() }
    }

    /// The error about a message that was not expected now.
    pub(super) fn out_of_turn(&self, message: &SimulatorMessage<'_>, awaited: &str, remedy: &str) -> TransportError {
        self.wrong(format!("says `{}` while {awaited} was awaited", message.keyword()), remedy)
    }
}

/// Whether a word occurs in JSON outside of strings; an approximation that is good enough for an error message.
fn has_bare_word(text: &str, word: &str) -> bool {
    text.split('"').step_by(2).any(|outside| outside.contains(word))
}

/// The beginning of a line, for an error message.
fn shown(text: &str) -> String {
    const LENGTH: usize = 100;
    let start: String = text.chars().take(LENGTH).collect();
    let rest = if start.len() < text.len() { "…" } else { "" };
    let plain: String = start.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect();
    format!("`{plain}`{rest}")
}

/// The runner's requests, written to a line.
pub(super) mod request {
    use super::{SimTime, number, quoted};
    use crate::simulator::OrderToNode;

    /// `{"reset":{"seed":1,"step":0.02,"parameters":{"gain":0.9},"intercepted":["a"],"topics":["a","b"]}}`, without
    /// `step` for a free-running simulator, without `parameters` if there are none, and without `intercepted` where all
    /// messages have to come back from the runner.
    pub(in super::super) fn reset<'a>(
        line: &mut Vec<u8>,
        seed: u64,
        step: Option<SimTime>,
        parameters: &[(String, f64)],
        intercepted: Option<impl Iterator<Item = &'a str>>,
        topics: impl Iterator<Item = &'a str>,
    ) {
        line.extend_from_slice(format!("{{\"reset\":{{\"seed\":{seed},").as_bytes());
        if let Some(step) = step {
            line.extend_from_slice(b"\"step\":");
            number(step.seconds(), line);
            line.push(b',');
        }
        if !parameters.is_empty() {
            line.extend_from_slice(b"\"parameters\":{");
            for (at, (name, value)) in parameters.iter().enumerate() {
                if at > 0 {
                    line.push(b',');
                }
                quoted(name, line);
                line.push(b':');
                number(*value, line);
            }
            line.extend_from_slice(b"},");
        }
        if let Some(intercepted) = intercepted {
            line.extend_from_slice(b"\"intercepted\":");
            list_of_names(line, intercepted);
            line.push(b',');
        }
        line.extend_from_slice(b"\"topics\":");
        list_of_names(line, topics);
        line.extend_from_slice(b"}}\n");
    }

    fn list_of_names<'a>(line: &mut Vec<u8>, names: impl Iterator<Item = &'a str>) {
        line.push(b'[');
        for (at, name) in names.enumerate() {
            if at > 0 {
                line.push(b',');
            }
            quoted(name, line);
        }
        line.push(b']');
    }

    /// `{"step":{"time":0.02,"orders":[{"node":"arm","order":"pause"}],"messages":[…]}}`, with messages as [`message`]
    /// wrote them, and without `orders` if there are none.
    pub(in super::super) fn step(line: &mut Vec<u8>, time: SimTime, orders: &[OrderToNode], messages: &[u8]) {
        line.extend_from_slice(b"{\"step\":{\"time\":");
        number(time.seconds(), line);
        if !orders.is_empty() {
            line.extend_from_slice(b",\"orders\":");
            list_of_orders(line, orders);
        }
        line.extend_from_slice(b",\"messages\":[");
        line.extend_from_slice(messages);
        line.extend_from_slice(b"]}}\n");
    }

    /// `{"deliver":[…]}`, with messages as [`message`] wrote them.
    pub(in super::super) fn deliver(line: &mut Vec<u8>, messages: &[u8]) {
        line.extend_from_slice(b"{\"deliver\":[");
        line.extend_from_slice(messages);
        line.extend_from_slice(b"]}\n");
    }

    /// `{"orders":[{"node":"arm","order":"slow","share":0.25}]}`, to a simulator that runs freely.
    pub(in super::super) fn orders(line: &mut Vec<u8>, orders: &[OrderToNode]) {
        line.extend_from_slice(b"{\"orders\":");
        list_of_orders(line, orders);
        line.extend_from_slice(b"}\n");
    }

    fn list_of_orders(line: &mut Vec<u8>, orders: &[OrderToNode]) {
        let list = serde_json::to_vec(orders).expect("names and numbers are plain data");
        line.extend_from_slice(&list);
    }

    /// Adds `{"topic":"a","value":…}` to messages, or `{"topic":"a","time":0.02,"value":…}` if its time is to be there.
    pub(in super::super) fn message(
        messages: &mut Vec<u8>,
        topic: &str,
        time: Option<SimTime>,
        value: impl FnOnce(&mut Vec<u8>),
    ) {
        if !messages.is_empty() {
            messages.push(b',');
        }
        messages.extend_from_slice(b"{\"topic\":");
        quoted(topic, messages);
        if let Some(time) = time {
            messages.extend_from_slice(b",\"time\":");
            number(time.seconds(), messages);
        }
        messages.extend_from_slice(b",\"value\":");
        value(messages);
        messages.push(b'}');
    }
}
