//! What observes a run: the relay tells each listener everything that happens, in the order in which it happens.

use sesame_base::time::SimTime;

use crate::metric::Metrics;
use crate::monitor::Decided;
use crate::value::Value;
use crate::wire::Wire;

/// Observes one run and changes nothing. Metrics and traces are listeners.
///
/// The metrics of a run are part of its relay, since conditions read them; the relay calls them directly. Other
/// listeners, such as a trace, are added with [`Relay::tapped`](super::Relay::tapped); a run without them pays nothing
/// for them.
pub trait Listener {
    /// The `index`th message of this wire, counted from 0, was published. This is the message as the simulator sent it.
    fn published(&mut self, now: SimTime, wire: Wire, index: u64, value: &Value);
    /// A message is delivered. It comes from the `index`th message published on this wire, and operations may have
    /// changed it.
    fn delivered(&mut self, now: SimTime, wire: Wire, index: u64, value: &Value);
    /// The clock of the simulator's stamps showed so many seconds at time zero.
    fn clock_at_zero(&mut self, seconds: f64) {
        let _ = seconds;
    }
    /// Simulation time is `now` from here on: all messages of earlier moments are known.
    fn advanced(&mut self, now: SimTime) {
        let _ = now;
    }
    /// A monitor decided.
    fn decided(&mut self, decided: &Decided) {
        let _ = decided;
    }
    /// The operation at this position of the test did something.
    fn operated(&mut self, now: SimTime, operation: usize, event: OperationEvent) {
        let _ = (now, operation, event);
    }
}

impl Listener for Metrics<'_> {
    fn published(&mut self, now: SimTime, wire: Wire, _: u64, value: &Value) {
        self.message(now, wire, value);
    }

    fn delivered(&mut self, now: SimTime, wire: Wire, _: u64, value: &Value) {
        self.delivery(now, wire, value);
    }

    fn clock_at_zero(&mut self, seconds: f64) {
        Metrics::clock_at_zero(self, seconds);
    }

    fn advanced(&mut self, now: SimTime) {
        self.advance_to(now);
    }
}

/// What an operation did.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OperationEvent {
    /// It became active.
    Started,
    /// It became inactive.
    Ended,
    /// It changed a message.
    Changed(MessageRef),
    /// It dropped a message, or one that it held back when it ended.
    Dropped(MessageRef),
    /// It created a message, which follows this one.
    Injected(MessageRef),
    /// It holds a message back until this time.
    Delayed(MessageRef, SimTime),
}

/// The message on which an operation acted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MessageRef {
    /// Its wire.
    pub wire: Wire,
    /// Its number among the messages published there, from 0.
    pub index: u64,
}
