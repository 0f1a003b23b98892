//! A system whose messages go over a bus: a middleware that has names for topics, and that nobody steps.
//!
//! A [`Bus`] is the connection to one middleware; [`on_bus`] makes the transport of it. So each middleware says how
//! messages come and go, and what a run is, is here: launched programs are awaited, time is the wall's or that of a
//! clock on the bus, held messages are released when they are due, and a run breaks off when the system falls silent.
//!
//! A service that is cut has two lines. At the source of its requests, the bus offers the service to its clients and
//! numbers their calls; at the sink of its requests, it calls the server. Replies go the other way, by the same
//! numbers.

#![expect(clippy::disallowed_methods, reason = "an adapter: it waits for other processes")]

pub mod echo;
#[cfg(test)]
mod faults;
pub mod secret;
mod system;
#[cfg(test)]
mod tests;
#[cfg(feature = "tls")]
pub mod tls;

use std::time::{Duration, Instant};

use sesame_plan::CampaignPlan;

use crate::transport::{Transport, TransportError};
use crate::value::Value;
use crate::wire::Line;
use sesame_lifecycle::launch::LaunchContext;

use self::system::System;

/// A connection to a middleware.
///
/// Errors end the run; what concerns one message only is an [`Event::Note`].
pub trait Bus {
    /// Opens what programs connect to that are launched after it. It is called before each launch, and what is open
    /// stays open until the bus is dropped. `address` is as for [`connect`](Self::connect).
    fn listen(&mut self, _address: &dyn Fn(&str) -> String) -> Result<(), TransportError> {
        Ok(())
    }

    /// Connects, listens to each source of the lines, and gets ready to publish on each sink. `address` fills
    /// placeholders of addresses (`{port}`, `{worker}`, `{domain}`) with what this worker has. If nothing answers yet,
    /// this returns false after a moment (at most 100 ms), and is called again until `connect` succeeds or time is up.
    fn connect(&mut self, lines: &[Line], address: &dyn Fn(&str) -> String) -> Result<bool, TransportError>;

    /// What keeps the system from being complete, in words; empty as soon as all that the bus can know of is there:
    /// publishers of sources, subscribers of sinks, servers of services.
    fn missing(&mut self) -> Vec<String> {
        Vec::new()
    }

    /// The next thing that happened, waited for at most this long. A connection that is lost and found again within
    /// [`FOUND_AGAIN_WITHIN`] is a note; everything is listened to again.
    fn receive(&mut self, timeout: Duration) -> Result<Option<Event>, TransportError>;

    /// Whether the connection stands at this moment. A run that ends without one is not one that came to its end.
    fn is_connected(&self) -> bool {
        true
    }

    /// Publishes a message on a sink of a line, by their positions. `call` is that of the message from which it comes.
    fn publish(&mut self, line: usize, sink: usize, value: &Value, call: Option<u64>) -> Result<(), TransportError>;

    /// Whether somebody may listen at the sinks of a line, or to a line that is not cut. A bus that cannot know says
    /// yes.
    fn is_heard(&self, _line: usize) -> bool {
        true
    }

    /// Whether it hears what it publishes on topics, so that the way through a server can be measured: only a bus with
    /// a server in the way does, and only for a plan with a relay budget.
    fn hears_itself(&self) -> bool {
        false
    }

    /// The message that was published last on a sink had come to the runner at this moment, and no operation delayed
    /// it. A bus that hears itself says in an [`Event::Returned`] how long it took until the message came back.
    fn came(&mut self, _line: usize, _sink: usize, _arrived: Instant) {}

    /// Sets the simulator to time zero, if the plan names a service for it.
    fn reset(&mut self, _within: Duration) -> Result<(), TransportError> {
        Ok(())
    }

    /// Ends the connection. It may be connected again.
    fn disconnect(&mut self);
}

/// How long a connection may be lost during a run.
pub const FOUND_AGAIN_WITHIN: Duration = Duration::from_secs(10);

/// Something that happened on a bus.
#[derive(Debug)]
pub enum Event {
    /// A message.
    Message {
        /// The position of its line.
        line: usize,
        /// The position of its source among those of the line.
        source: usize,
        /// What it says. A message that does not fit its declared type is a note instead, and goes on unchanged.
        value: Value,
        /// The call that it belongs to, in the numbers of the bus, if it is part of one.
        call: Option<u64>,
        /// When it arrived.
        arrived: Instant,
    },
    /// The clock of the simulator shows so many nanoseconds.
    Clock(i64),
    /// A message that was passed on came back through the server: what the relay and the server added to its way.
    Returned {
        /// The position of its line.
        line: usize,
        /// From its arrival at the runner until its return.
        added: Duration,
    },
    /// Something for the user to know, in a sentence.
    Note(String),
}

/// What a transport on a bus needs to know of the plan.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Whether simulation time is shown by a clock on the bus; otherwise it is wall time.
    pub has_clock: bool,
    /// Whether a service resets the simulator; otherwise it is launched again for each test.
    pub resets: bool,
    /// The addresses of the bus, as the plan has them. Without placeholders they are one worker's only.
    pub addresses: Vec<String>,
}

impl Settings {
    /// What a plan says of its system.
    pub fn of(plan: &CampaignPlan) -> Settings {
        let simulator = &plan.simulator;
        Settings {
            has_clock: simulator.has_a_clock(),
            resets: simulator.ros.as_ref().is_some_and(|ros| ros.reset.is_some()),
            addresses: simulator.addresses().into_iter().map(str::to_owned).collect(),
        }
    }
}

/// The transport to a system on a bus. Launched programs run in this context.
pub fn on_bus(
    plan: &CampaignPlan,
    bus: Box<dyn Bus>,
    settings: Settings,
    context: LaunchContext,
) -> Box<dyn Transport> {
    Box::new(System::new(plan, bus, settings, context))
}
