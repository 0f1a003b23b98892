//! Where a relay tells what happens, as it happens, to whoever records a run.

use sesame_base::time::SimTime;

use crate::value::Value;
use crate::wire::Wire;

/// Listens to a run. It hears everything in the order in which it happens and changes nothing.
pub trait Tap {
    /// The `index`th message of this wire, from 0, was published.
    fn published(&mut self, now: SimTime, wire: Wire, index: u64, value: &Value);
    /// What became of the `index`th message of this wire is delivered.
    fn delivered(&mut self, now: SimTime, wire: Wire, index: u64, value: &Value);
    /// The operation at this position of the test did something.
    fn operated(&mut self, now: SimTime, operation: usize, deed: Deed);
}

/// What an operation did.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Deed {
    /// It went on.
    Started,
    /// It went off.
    Ended,
    /// It changed a message.
    Changed(Touched),
    /// It dropped a message, or one that it held back when it ended.
    Dropped(Touched),
    /// It made up a message, which goes on after this one.
    Injected(Touched),
    /// It holds a message back until then.
    Delayed(Touched, SimTime),
}

/// Which message an operation touched.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Touched {
    /// Its wire.
    pub wire: Wire,
    /// Its number among the messages published there, from 0.
    pub index: u64,
}
