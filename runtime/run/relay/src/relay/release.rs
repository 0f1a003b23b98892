//! The release queue: messages that operations hold back, released in order of time, then in the order in which they
//! were held.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use sesame_base::time::SimTime;
use sesame_plan::NodeId;
use sesame_rng::derive_seed;

use crate::relay::MessageRef;
use crate::value::Value;
use crate::wire::Wire;

/// A message on its way through its pipeline.
#[derive(Debug, Clone)]
pub(super) struct Held {
    pub(super) wire: Wire,
    /// Who published it, if the transport can tell.
    pub(super) publisher: Option<NodeId>,
    /// Whether a monitor of the runner published it.
    pub(super) by_monitor: bool,
    /// Its index among the messages published on its wire; for an injected message, the index of the original one.
    pub(super) published: u64,
    /// The key of its random numbers: its index, or for an injected message a number of its own.
    pub(super) index: u64,
    pub(super) value: Value,
    /// The position in its wire's pipeline at which it continues.
    pub(super) next_stage: usize,
}

impl Held {
    /// Identifies the message for listeners.
    pub(super) fn message_ref(&self) -> MessageRef {
        MessageRef { wire: self.wire, index: self.published }
    }

    /// The `number`th message that an operation with this seed injects with this one. It continues at the same
    /// position, with a key of its own, so later operations draw other random numbers for it: the same ones whichever
    /// other operations the test has.
    pub(super) fn beside(&self, operation_seed: u64, number: u64, value: Value) -> Held {
        let index = derive_seed(self.index, "injected", &[operation_seed, number]);
        Held { index, value, ..*self }
    }
}

/// Why a message is held back, for the counters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Why {
    /// The operation delays it.
    Delayed,
    /// The operation is inactive, and the message waits behind held ones.
    Queued,
    /// Either, on a wire without a receiver.
    Unheard {
        /// Whether the operation is active.
        active: bool,
    },
}

struct Entry {
    release: SimTime,
    sequence: u64,
    operation: usize,
    why: Why,
    message: Held,
}

impl Entry {
    fn key(&self) -> (SimTime, u64) {
        (self.release, self.sequence)
    }
}

impl PartialEq for Entry {
    fn eq(&self, other: &Self) -> bool {
        self.key() == other.key()
    }
}
impl Eq for Entry {}
impl PartialOrd for Entry {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Entry {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.key().cmp(&other.key())
    }
}

#[derive(Default)]
pub(super) struct ReleaseQueue {
    heap: BinaryHeap<Reverse<Entry>>,
    sequence: u64,
    wires: usize,
    /// Per operation and wire: how many messages are held, and when the last one is released.
    tails: Vec<Vec<Tail>>,
    /// Per operation: how many are held on all wires.
    held: Vec<usize>,
}

#[derive(Clone, Copy, Default)]
struct Tail {
    held: usize,
    last: SimTime,
}

impl ReleaseQueue {
    pub(super) fn new(operations: usize, wires: usize) -> Self {
        ReleaseQueue {
            wires,
            tails: vec![vec![Tail::default(); wires]; operations],
            held: vec![0; operations],
            ..ReleaseQueue::default()
        }
    }

    /// Makes room for what another operation holds.
    pub(super) fn add_operation(&mut self) {
        self.tails.push(vec![Tail::default(); self.wires]);
        self.held.push(0);
    }

    pub(super) fn len(&self) -> usize {
        self.heap.len()
    }

    /// How many messages an operation holds.
    pub(super) fn holds(&self, operation: usize) -> usize {
        self.held[operation]
    }

    /// When the last message that an operation holds on a wire is released; `None` if it holds none.
    pub(super) fn last_release(&self, operation: usize, wire: Wire) -> Option<SimTime> {
        let tail = self.tails[operation][wire.index()];
        (tail.held > 0).then_some(tail.last)
    }

    pub(super) fn push(&mut self, release: SimTime, operation: usize, why: Why, message: Held) {
        self.held[operation] += 1;
        let tail = &mut self.tails[operation][message.wire.index()];
        tail.held += 1;
        tail.last = release;
        self.sequence += 1;
        self.heap.push(Reverse(Entry { release, sequence: self.sequence, operation, why, message }));
    }

    /// When the next message is due.
    pub(super) fn next_release(&self) -> Option<SimTime> {
        self.heap.peek().map(|entry| entry.0.release)
    }

    /// The next message, due or not, with the operation that held it.
    pub(super) fn pop(&mut self) -> Option<(usize, Held)> {
        let Reverse(entry) = self.heap.pop()?;
        self.tails[entry.operation][entry.message.wire.index()].held -= 1;
        self.held[entry.operation] -= 1;
        Some((entry.operation, entry.message))
    }

    /// Makes all messages that an operation holds due now, in the order in which they would have been released.
    pub(super) fn release_all(&mut self, operation: usize, now: SimTime) {
        for (why, message) in self.take_all(operation) {
            self.push(now, operation, why, message);
        }
    }

    /// All messages that an operation holds, in the order in which they would have been released.
    pub(super) fn take_all(&mut self, operation: usize) -> Vec<(Why, Held)> {
        let (mut taken, kept): (Vec<_>, Vec<_>) =
            std::mem::take(&mut self.heap).into_vec().into_iter().partition(|entry| entry.0.operation == operation);
        self.heap = kept.into();
        self.tails[operation].fill(Tail::default());
        self.held[operation] = 0;
        taken.sort_unstable_by_key(|entry| entry.0.key());
        taken.into_iter().map(|Reverse(entry)| (entry.why, entry.message)).collect()
    }
}
