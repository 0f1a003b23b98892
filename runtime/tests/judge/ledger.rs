//! All messages of a run, as they were published and as they were delivered.

use sesame_base::time::SimTime;
use sesame_relay::relay::{Listener, OperationEvent};
use sesame_relay::value::Value;
use sesame_relay::wire::{Wire, WireTable};

/// A message on a wire.
#[derive(Debug, Clone)]
pub(crate) struct Message {
    /// In nanoseconds.
    pub(crate) time: i64,
    /// The wire's name.
    pub(crate) path: String,
    pub(crate) value: Value,
}

impl Message {
    /// Whether two are the same; numbers that are none are so where their bits are.
    pub(crate) fn is(&self, other: &Message) -> bool {
        self.time == other.time && self.path == other.path && same(&self.value, &other.value)
    }
}

fn same(a: &Value, b: &Value) -> bool {
    match (a, b) {
        (Value::Real(a), Value::Real(b)) => a == b || a.to_bits() == b.to_bits(),
        (Value::Record(a), Value::Record(b)) => a.iter().zip(b.iter()).all(|((_, a), (_, b))| same(a, b)),
        _ => a == b,
    }
}

/// What a run left in writing.
#[derive(Debug, Clone)]
pub(crate) struct Ledger {
    pub(crate) paths: Vec<String>,
    pub(crate) published: Vec<Message>,
    pub(crate) delivered: Vec<Message>,
    /// In the order in which it happened: whether a message was delivered, or else published, and its place there.
    pub(crate) order: Vec<(bool, usize)>,
    /// When an operation held back a message, and until when it was to.
    pub(crate) deeds: Vec<(i64, usize, OperationEvent)>,
    /// When the run ended.
    pub(crate) end: i64,
    /// The last moment at which a step of the simulator can have been over.
    pub(crate) steps: i64,
}

impl Ledger {
    pub(crate) fn new(wires: &WireTable) -> Self {
        Ledger {
            paths: wires.iter().map(|wire| wires.path(wire).to_owned()).collect(),
            published: Vec::new(),
            delivered: Vec::new(),
            order: Vec::new(),
            deeds: Vec::new(),
            end: 0,
            steps: 0,
        }
    }

    /// The messages on one wire.
    pub(crate) fn on<'a>(messages: &'a [Message], path: &'a str) -> impl Iterator<Item = &'a Message> {
        messages.iter().filter(move |message| message.path == path)
    }
}

impl Listener for Ledger {
    fn published(&mut self, now: SimTime, wire: Wire, _: u64, value: &Value) {
        let path = self.paths[wire.index()].clone();
        self.order.push((false, self.published.len()));
        self.published.push(Message { time: now.nanos(), path, value: value.clone() });
    }
    fn delivered(&mut self, now: SimTime, wire: Wire, _: u64, value: &Value) {
        let path = self.paths[wire.index()].clone();
        self.order.push((true, self.delivered.len()));
        self.delivered.push(Message { time: now.nanos(), path, value: value.clone() });
    }
    fn operated(&mut self, now: SimTime, operation: usize, event: OperationEvent) {
        self.deeds.push((now.nanos(), operation, event));
    }
}
