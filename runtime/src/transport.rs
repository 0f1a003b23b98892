//! How a runner reaches its simulator.
//!
//! A transport is a thin adapter: it moves the simulation on, hands every message and every moment of time to the
//! relay, and carries out the relay's deliveries. It decides nothing.

#[cfg(feature = "in-process")]
mod in_process;

use sesame_plan::CampaignPlan;

use crate::relay::Exchange;
use crate::simulator::Progress;
use crate::time::SimTime;

#[cfg(feature = "in-process")]
pub use in_process::in_process;

/// A connection to a simulator.
pub trait Transport {
    /// What the simulator on the other side can do.
    fn capabilities(&self) -> Capabilities;

    /// Brings the simulator to time zero for a new run, with this seed for its own randomness. Messages that it
    /// publishes on the way go through the relay.
    fn reset(&mut self, seed: u64, relay: &mut dyn Exchange) -> Result<(), TransportError>;

    /// Moves the simulation on by one step (lock-stepped), or waits for what comes next (free running). Never goes
    /// beyond `until`: a step that would is not taken, and the run has ended.
    fn advance(&mut self, until: SimTime, relay: &mut dyn Exchange) -> Result<Progress, TransportError>;

    /// Simulation time now.
    fn now(&self) -> SimTime;

    /// Ends the connection; whatever the transport started is stopped.
    fn close(&mut self);
}

/// What a simulator can do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Capabilities {
    /// It is stepped by us: equal tests give equal results.
    pub lock_stepped: bool,
    /// It can be brought back to time zero without being started anew.
    pub resets: bool,
}

/// What went wrong between runner and simulator, in words for the user.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TransportError {
    /// The simulator reported a failure.
    #[error("the simulator failed: {0}")]
    Simulator(String),
    /// The space names a topic that the simulator does not have.
    #[error("the simulator has no topic `{path}`{}", hint(near.as_deref(), known))]
    UnknownTopic {
        /// The name in the space.
        path: String,
        /// The simulator's topic with the most similar name.
        near: Option<String>,
        /// All the simulator's topics.
        known: Vec<String>,
    },
    /// A message is not of the type that the space declares for its topic.
    #[error("a message on `{path}` is not of its declared type: {reason}")]
    WrongType {
        /// The topic.
        path: String,
        /// What does not fit.
        reason: String,
    },
}

fn hint(near: Option<&str>, known: &[String]) -> String {
    match near {
        Some(near) => format!("; did you mean `{near}`?"),
        None => format!("; it has {}", known.join(", ")),
    }
}

/// Makes a connection to the simulator; generated code names the one its space declares.
#[derive(Clone, Copy)]
pub struct Connect(fn(&CampaignPlan) -> Box<dyn Transport>);

impl Connect {
    /// A transport as the plan describes it.
    pub fn transport(self, plan: &CampaignPlan) -> Box<dyn Transport> {
        (self.0)(plan)
    }
}

impl std::fmt::Debug for Connect {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Connect")
    }
}
