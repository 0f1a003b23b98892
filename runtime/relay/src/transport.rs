//! How a runner reaches its simulator.
//!
//! A transport is a thin adapter: it moves the simulation on, hands every message and every moment of time to the
//! relay, and carries out the relay's deliveries. It decides nothing.

#[cfg(feature = "in-process")]
mod in_process;
#[cfg(feature = "process")]
mod process;

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use sesame_base::time::SimTime;
use sesame_plan::CampaignPlan;

use crate::relay::Exchange;
use crate::simulator::Progress;

#[cfg(feature = "in-process")]
pub use in_process::in_process;
#[cfg(feature = "process")]
pub use process::end_simulators;
#[cfg(feature = "process")]
pub use process::process;
#[cfg(all(feature = "process", target_os = "linux"))]
pub use process::{become_simulator, keep_simulator};

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

    /// What befell the simulator since this was last asked.
    fn aside(&mut self) -> Aside {
        Aside::default()
    }
}

/// What befell a simulator beside what its run showed. It is of one session alone, and no part of results.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Aside {
    /// Its process was killed (`SIGKILL`), and not by us: by hand, or by a system that had no memory left. The run says
    /// nothing about the test then.
    pub killed: bool,
    /// What else there is to say, in words for the user.
    pub notes: Vec<String>,
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
    /// The simulator's program cannot be started.
    #[error("cannot start the simulator `{command}` in {}: {reason}", folder.display())]
    NotStarted {
        /// The program with its arguments.
        command: String,
        /// The folder it was to run in.
        folder: PathBuf,
        /// Why not.
        reason: String,
    },
    /// The simulator's program went away in the middle of a run.
    #[error("the simulator `{command}` {how} while {awaited} was awaited{}", quoted(last_words))]
    Gone {
        /// The program with its arguments.
        command: String,
        /// How it ended, as a phrase.
        how: String,
        /// What it was to say next, as a phrase.
        awaited: String,
        /// The last lines of its standard error.
        last_words: String,
    },
    /// The simulator's program said something that cannot be understood.
    #[error("line {line} since the simulator's reset {problem}; {remedy}")]
    Protocol {
        /// Which line of its standard output, from 1: the answer to the last reset.
        line: u64,
        /// What is wrong with it, as a phrase.
        problem: String,
        /// What to do about it.
        remedy: String,
    },
}

fn quoted(last_words: &str) -> String {
    if last_words.is_empty() { String::new() } else { format!("; its last words:\n{last_words}") }
}

fn hint(near: Option<&str>, known: &[String]) -> String {
    match near {
        Some(near) => format!("; did you mean `{near}`?"),
        None => format!("; it has {}", known.join(", ")),
    }
}

/// That the simulator lacks a topic of the space, with the most similar one of those it has.
#[cfg(any(feature = "in-process", feature = "process"))]
fn unknown_topic<'a>(path: &str, known: impl Iterator<Item = &'a String> + Clone) -> TransportError {
    let near = known
        .clone()
        .map(|known| (strsim::normalized_levenshtein(path, known), known))
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .filter(|(similarity, _)| *similarity > 0.7)
        .map(|(_, known)| known.clone());
    TransportError::UnknownTopic { path: path.to_owned(), near, known: known.cloned().collect() }
}

/// Makes a connection to the simulator; generated code names the one its space declares.
#[derive(Clone, Copy)]
pub struct Connect {
    make: fn(&CampaignPlan, Place) -> Box<dyn Transport>,
    place: Place,
}

/// Where a simulator lies, for transports that start one.
#[derive(Clone, Copy)]
#[cfg_attr(not(feature = "process"), expect(dead_code, reason = "only a simulator that is a program lies somewhere"))]
struct Place {
    /// Folder of the runner's crate.
    runner: &'static str,
    /// Folder of the `.sesame` file, as seen from there.
    space: &'static str,
}

impl Connect {
    /// A transport as the plan describes it.
    pub fn transport(self, plan: &CampaignPlan) -> Box<dyn Transport> {
        (self.make)(plan, self.place)
    }
}

impl std::fmt::Debug for Connect {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Connect")
    }
}
