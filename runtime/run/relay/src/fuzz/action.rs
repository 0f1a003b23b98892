//! When and where an operation acts on a message, and what it does with it.

use sesame_base::time::SimTime;

use crate::fuzz::draws::KeyedRng;

/// The most messages that operations may hold back at once; beyond it, the oldest is released early, with a warning.
pub const HELD_LIMIT: usize = 100_000;

/// The circumstances of a message: when, and on which wire of its topic, an operation acts on it.
#[derive(Debug, Clone, Copy)]
pub struct MessageContext {
    /// Simulation time.
    pub now: SimTime,
    /// How long the operation has been active.
    pub active: SimTime,
    /// The wire's position in the topic.
    pub member: u64,
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
