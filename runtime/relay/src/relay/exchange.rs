//! What passes between the relay and a transport.

use sesame_base::time::SimTime;

use crate::value::Value;
use crate::wire::{Wire, WireTable};

/// A message that is to reach its subscribers now.
#[derive(Debug, Clone, PartialEq)]
pub struct Delivery {
    /// On which wire.
    pub wire: Wire,
    /// What.
    pub value: Value,
}

/// The relay as a transport sees it.
pub trait Exchange {
    /// The wires that it knows; messages of other topics do not go through it.
    fn wires(&self) -> &WireTable;
    /// Whether messages of this wire must pass through it, because an operation may disturb them.
    fn intercepts(&self, wire: Wire) -> bool;
    /// From now on the simulator subscribes to this wire, so changes of its messages are effects.
    fn subscribed(&mut self, wire: Wire);
    /// Simulation time is `now` from here on; it never goes back.
    fn advance(&mut self, now: SimTime, deliveries: &mut Vec<Delivery>);
    /// A message was published at `now`.
    fn message(&mut self, now: SimTime, wire: Wire, value: Value, deliveries: &mut Vec<Delivery>);
    /// The next moment at which the relay has something to do even without a message: a held message is due, or an
    /// operation may be switched. Until then, advancing time has no effect. `None` if only a message can cause
    /// anything.
    ///
    /// A transport that does not step its simulator waits until this moment or until the next message, whichever is
    /// first. A message may change the moment.
    fn next_due(&self) -> Option<SimTime>;
}
