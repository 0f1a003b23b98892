//! How a runner reaches its simulator.
//!
//! A transport is a thin adapter: it advances the simulation, passes every message and every moment of time to the
//! relay, and carries out the relay's deliveries. It decides nothing.

#[cfg(feature = "process")]
pub mod bus;
#[cfg(feature = "process")]
pub mod clock;
#[cfg(feature = "in-process")]
mod in_process;
#[cfg(feature = "in-process")]
pub mod node_orders;
#[cfg(feature = "process")]
mod process;
pub mod relay_latency;
pub mod round;
#[cfg(feature = "in-process")]
pub mod topics;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::{Instant, SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};

use sesame_base::time::SimTime;
use sesame_plan::CampaignPlan;

#[cfg(feature = "process")]
use sesame_lifecycle::launch::LaunchError;

use crate::relay::Exchange;
use crate::simulator::{NodeFault, Offers, Progress};
use crate::transport::relay_latency::AddedOnWire;

#[cfg(feature = "in-process")]
pub use in_process::in_process;
#[cfg(feature = "process")]
pub use process::end_simulators;
#[cfg(feature = "process")]
pub use process::{Beside, BesideError, beside, process};
#[cfg(all(feature = "process", target_os = "linux"))]
pub use process::{become_simulator, keep_simulator};

/// Simulation time where it is wall time since the start of a run.
pub fn wall_time_since(start: Instant) -> SimTime {
    SimTime::from_nanos(i64::try_from(start.elapsed().as_nanos()).unwrap_or(i64::MAX))
}

/// What the wall clock shows, in seconds since 1970.
#[expect(clippy::disallowed_methods, reason = "an adapter: systems without a clock of their own stamp messages by it")]
pub fn wall_clock() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs_f64()
}

/// A connection to a simulator.
pub trait Transport {
    /// What the simulator can do.
    fn capabilities(&self) -> Capabilities;

    /// Sets the simulator to time zero for a new run, with this seed for its own randomness. Messages that it publishes
    /// meanwhile go through the relay.
    fn reset(&mut self, seed: u64, relay: &mut dyn Exchange) -> Result<(), TransportError>;

    /// Moves the simulation on by one step (lock-stepped), or waits for what comes next (free running). Never goes
    /// beyond `until`: a step that would is not taken, and the run has ended.
    fn advance(&mut self, until: SimTime, relay: &mut dyn Exchange) -> Result<Progress, TransportError>;

    /// Simulation time now.
    fn now(&self) -> SimTime;

    /// The run has come to its end. The error says that the simulator is out of reach at this moment, so that nobody
    /// can know what it did last.
    fn ended(&mut self) -> Result<(), TransportError> {
        Ok(())
    }

    /// Ends the connection, and everything that the transport started.
    fn close(&mut self);

    /// Calls this from now on when the start of the system takes long, with what it waits for. Transports that wait for
    /// their simulator alone never call it.
    fn tell_waiting(&mut self, tell: Box<dyn FnMut(&str) + Send>) {
        drop(tell);
    }

    /// What happened to the simulator's process since the last call.
    fn incidents(&mut self) -> Incidents {
        Incidents::default()
    }

    /// How long messages were kept since the last call, wire by wire: from the arrival of a message until it was passed
    /// on, of those that no operation held back. Nothing where the simulator is stepped, since time stands still
    /// meanwhile, and nothing of transports that do not measure it.
    fn added(&mut self) -> Vec<AddedOnWire> {
        Vec::new()
    }
}

/// What happened to a simulator's process apart from its run. It concerns one session only, and is not part of results.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Incidents {
    /// Its process was killed (`SIGKILL`) by a user, or by the system when memory ran out. Then the run says nothing
    /// about the test.
    pub killed: bool,
    /// Other incidents, in words for the user.
    pub notes: Vec<String>,
}

/// What a simulator can do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Capabilities {
    /// The relay steps it: equal tests give equal results.
    pub lock_stepped: bool,
    /// It can be reset to time zero without a restart.
    pub resets: bool,
}

/// What went wrong between runner and simulator, in words for the user.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
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
    /// An operation wants something done to a node that the simulator does not offer.
    #[error(
        "the simulator does not offer to {fault} node `{node}`, as operation `{operation}` needs; {}",
        offered(offers)
    )]
    NotOffered {
        /// The operation.
        operation: String,
        /// What it does to the node, in the word of the language.
        fault: &'static str,
        /// The node in the space.
        node: String,
        /// What the simulator offers.
        offers: Offers,
    },
    /// A message is not of the type that the space declares for its topic.
    #[error("a message on `{path}` is not of its declared type: {reason}")]
    WrongType {
        /// The topic.
        path: String,
        /// The difference.
        reason: String,
    },
    /// The simulator's program cannot be started.
    #[error("cannot start the simulator `{command}` in {}: {reason}", folder.display())]
    NotStarted {
        /// The program with its arguments.
        command: String,
        /// The folder it was to run in.
        folder: PathBuf,
        /// The reason.
        reason: String,
    },
    /// The simulator's program ended, or closed its output, in the middle of a run.
    #[error("the simulator `{command}` {how} while {awaited} was awaited{}", quoted(last_lines))]
    Disconnected {
        /// The program with its arguments.
        command: String,
        /// How it ended, as a phrase.
        how: String,
        /// What it was expected to send next, as a phrase.
        awaited: String,
        /// The last lines of its standard error.
        last_lines: String,
    },
    /// A program that the plan launches did not start, or did not stay.
    #[cfg(feature = "process")]
    #[error(transparent)]
    Launch(#[from] LaunchError),
    /// The connection to the simulator was lost, although nothing says that the simulator has ended.
    #[error("the connection to {to} was lost: {how}")]
    ConnectionLost {
        /// What was connected.
        to: String,
        /// How it was lost, as a phrase.
        how: String,
    },
    /// The clock of the simulator went back.
    #[error("the clock of the simulator went back, from {from} to {to}")]
    ClockBack {
        /// The latest time before.
        from: SimTime,
        /// The time after it.
        to: SimTime,
    },
    /// The clock of the simulator leapt ahead.
    #[error("the clock of the simulator leapt ahead, from {from} to {to}, while it usually goes on by {usual}")]
    ClockLeap {
        /// The time before.
        from: SimTime,
        /// The time after it.
        to: SimTime,
        /// Its usual tick.
        usual: SimTime,
    },
    /// The clock of the simulator stands still, or the simulator says nothing.
    #[error("{awaited} was awaited for {limit} s of wall time")]
    Silent {
        /// What was awaited, as a phrase.
        awaited: String,
        /// For how long, in seconds of wall time.
        limit: f64,
    },
    /// Messages would not pass through the relay, or would not arrive, in words with the remedy.
    #[error("{0}")]
    Wiring(String),
    /// The simulator's program sent something that is not part of the protocol.
    #[error("line {line} since the simulator's reset {problem}; {remedy}")]
    Protocol {
        /// The line of its standard output, counted from 1: the answer to the last reset.
        line: u64,
        /// The problem, as a phrase.
        problem: String,
        /// The remedy, as an instruction.
        remedy: String,
    },
}

/// Whose fault it is that a run broke off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fault {
    /// The system's: a program of it ended or said that it failed.
    Crash,
    /// The system's: it says nothing any more.
    Timeout {
        /// For how long, in seconds of wall time.
        limit: f64,
    },
    /// The environment's: a program was not started, or not ready in time.
    LaunchFailed,
    /// The environment's: the connection to the simulator was lost.
    Disconnect,
    /// The environment's: the simulator's clock went back, or leapt ahead.
    WrongClock,
}

impl TransportError {
    /// Whose fault it is.
    pub fn fault(&self) -> Fault {
        match self {
            #[cfg(feature = "process")]
            TransportError::Launch(LaunchError::Failed { .. }) => Fault::LaunchFailed,
            #[cfg(feature = "process")]
            TransportError::Launch(LaunchError::Ended { .. }) => Fault::Crash,
            TransportError::ConnectionLost { .. } => Fault::Disconnect,
            TransportError::ClockBack { .. } | TransportError::ClockLeap { .. } => Fault::WrongClock,
            TransportError::Silent { limit, .. } => Fault::Timeout { limit: *limit },
            // A simulator that cannot be started is the space's mistake; running the test again does not help.
            TransportError::Simulator(_)
            | TransportError::UnknownTopic { .. }
            | TransportError::NotOffered { .. }
            | TransportError::WrongType { .. }
            | TransportError::NotStarted { .. }
            | TransportError::Disconnected { .. }
            | TransportError::Wiring(_)
            | TransportError::Protocol { .. } => Fault::Crash,
        }
    }
}

fn quoted(last_lines: &str) -> String {
    if last_lines.is_empty() { String::new() } else { format!("; the last lines of its standard error:\n{last_lines}") }
}

/// What a simulator offers for its nodes, and how it would offer more.
fn offered(offers: &Offers) -> String {
    let node = |(node, faults): (&String, &BTreeSet<NodeFault>)| {
        let faults: Vec<&str> = faults.iter().map(|fault| fault.word()).collect();
        format!("`{node}` ({})", faults.join(", "))
    };
    let nodes: Vec<String> = offers.iter().map(node).collect();
    let known =
        if nodes.is_empty() { "it offers nothing".to_owned() } else { format!("it offers {}", nodes.join(", ")) };
    format!("{known}: name the node and what can be done to it in `nodes` of `ready`, or in Rust with `Bus::offer`")
}

fn hint(near: Option<&str>, known: &[String]) -> String {
    match near {
        Some(near) => format!("; did you mean `{near}`?"),
        None => format!("; it has {}", known.join(", ")),
    }
}

/// That the simulator lacks a topic of the space, with the most similar one of those it has.
#[cfg(feature = "in-process")]
fn unknown_topic<'a>(path: &str, known: impl Iterator<Item = &'a String> + Clone) -> TransportError {
    let near = known
        .clone()
        .map(|known| (strsim::normalized_levenshtein(path, known), known))
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .filter(|(similarity, _)| *similarity > 0.7)
        .map(|(_, known)| known.clone());
    TransportError::UnknownTopic { path: path.to_owned(), near, known: known.cloned().collect() }
}

/// Creates the transport to the simulator; generated code names the one that its space declares.
#[derive(Clone)]
pub struct Connect {
    make: fn(&CampaignPlan, &Path) -> Box<dyn Transport>,
    /// The folder that a simulator that is a program runs in.
    folder: PathBuf,
}

impl Connect {
    /// What makes transports of one kind. `folder` is the one that programs run in.
    pub fn new(make: fn(&CampaignPlan, &Path) -> Box<dyn Transport>, folder: PathBuf) -> Self {
        Connect { make, folder }
    }

    /// The same for programs that run in another folder.
    #[must_use]
    pub fn in_folder(self, folder: PathBuf) -> Self {
        Connect { folder, ..self }
    }

    /// A transport as the plan describes it.
    pub fn transport(&self, plan: &CampaignPlan) -> Box<dyn Transport> {
        (self.make)(plan, &self.folder)
    }
}

impl std::fmt::Debug for Connect {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Connect")
    }
}
