//! When and where an operation acts on a message, and what it does with it.

use sesame_base::time::SimTime;

use crate::fuzz::draws::KeyedRng;

/// The most messages that operations may hold back at once; beyond it, the oldest is released early, with a warning.
pub const HELD_LIMIT: usize = 100_000;

/// A wire, as an operation that acts on it counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct OnWire {
    /// Its position among the wires on which the operation may act.
    pub member: u64,
    /// The position of its topic among those on which the operation acts.
    pub target: usize,
}

/// The circumstances of a message: when, and on which wire, an operation acts on it.
#[derive(Debug, Clone, Copy)]
pub struct MessageContext {
    /// Simulation time.
    pub now: SimTime,
    /// How long the operation has been active.
    pub active: SimTime,
    /// The wire.
    pub on: OnWire,
    /// The operation's random numbers for the message.
    pub draws: KeyedRng,
}

/// What an operation does with a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Action {
    /// Passes it on unchanged.
    Unchanged,
    /// Passes it on, changed.
    Changed,
    /// Drops it.
    Dropped,
    /// Passes it on this much later; with latency, not before messages that are held already.
    Delayed(SimTime),
    /// Passes it on, followed by this many copies.
    Duplicated(u32),
}
