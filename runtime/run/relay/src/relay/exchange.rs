//! What passes between the relay and a transport.

use sesame_base::time::SimTime;
use sesame_plan::NodeId;

use crate::fuzz::Order;
use crate::value::Value;
use crate::wire::{Wire, WireTable};

/// A message that is to reach its subscribers now.
#[derive(Debug, Clone, PartialEq)]
pub struct Delivery {
    /// The wire that it is on. A message on a wire that has links is for the subscribers without a link of their own.
    pub wire: Wire,
    /// It comes from the message with this number among those published on the wire, from 0.
    pub index: u64,
    /// When: a message that was held back may have been due before the time to which the relay was advanced.
    pub at: SimTime,
    /// Whether it comes from a message that a monitor of the runner published, so that no node sent it: a transport
    /// that only listens to the wire has to publish it.
    pub by_monitor: bool,
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
    /// Somebody subscribes to this wire and was found only now, so changes of its messages were effects all the time.
    fn found(&mut self, wire: Wire) {
        self.subscribed(wire);
    }
    /// The clock of the simulator's stamps showed so many seconds at time zero. A simulator whose transport does not
    /// call this has stamps in simulation time.
    fn clock_at_zero(&mut self, seconds: f64);
    /// Simulation time is `now` from here on; it never goes back.
    fn advance(&mut self, now: SimTime, deliveries: &mut Vec<Delivery>);
    /// A message was published at `now`, by this node if the transport can tell. It gets the next number of its wire,
    /// from 0; messages of monitors have numbers in between.
    fn message_from(
        &mut self,
        now: SimTime,
        wire: Wire,
        publisher: Option<NodeId>,
        value: Value,
        deliveries: &mut Vec<Delivery>,
    );
    /// A message was published at `now`, by whatever node.
    fn message(&mut self, now: SimTime, wire: Wire, value: Value, deliveries: &mut Vec<Delivery>) {
        self.message_from(now, wire, None, value, deliveries);
    }
    /// The number that the next message published on this wire gets.
    fn next_index(&self, wire: Wire) -> u64;
    /// Parameters of the simulator that have other values in this run than the simulator gives them, by name. They are
    /// set before the run begins; one that the simulator does not have is an error.
    fn parameters(&self) -> &[(String, f64)];
    /// What programs that are launched for this run have in their arguments, by the names of placeholders.
    fn arguments(&self) -> &[(String, String)];
    /// What operations on nodes want done since the last call, in this order. A transport without nodes has nothing to
    /// do with them.
    fn take_orders(&mut self) -> Vec<Order>;
    /// What the operation at this position of the test wanted was done, and made a difference: that is an effect.
    fn carried_out(&mut self, now: SimTime, operation: usize);
    /// The next moment at which the relay has something to do even without a message: a held message is due, or an
    /// operation may be switched. Until then, advancing time has no effect. `None` if only a message can cause
    /// anything.
    ///
    /// A transport that does not step its simulator waits until this moment or until the next message, whichever is
    /// first. A message may change the moment.
    fn next_due(&self) -> Option<SimTime>;
}
