//! The life of a system around its simulator: what starts it, when it is ready, what ends it.

use serde::{Deserialize, Serialize};

use crate::TopicId;

/// What a system says in addition to its simulator.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Lifecycle {
    /// What starts it as a whole; nodes may have launches of their own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub launch: Option<Launch>,
    /// What ends it, before what is left of it is ended by signals.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub terminate: Option<Command>,
    /// What the relay may add to a message's way.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub relay_budget: Option<RelayBudget>,
}

impl Lifecycle {
    /// Whether it says nothing.
    pub fn is_default(&self) -> bool {
        *self == Lifecycle::default()
    }
}

/// A program that the runner starts and ends.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Launch {
    /// The program.
    pub command: Command,
    /// When it counts as ready; `None` is at once.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ready: Option<Ready>,
}

/// A program to run, without a shell.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Command {
    /// A name to be found on `PATH`, or a path with `/` in it, relative to the folder of the `.sesame` file, in which
    /// the program runs.
    pub program: String,
    /// Its arguments, one by one. `{worker}`, `{domain}`, `{port}`, `{folder}` and `{seed}` in them are replaced by
    /// what the worker has of its own; an argument `{ros-args}` by the remappings that cut the topics of the node.
    pub arguments: Vec<String>,
}

/// When a launched program is ready.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ready {
    /// What shows it.
    pub when: ReadyWhen,
    /// Wall time after which it has failed to start, in seconds; positive.
    pub within: f64,
}

/// What shows that a launched program is ready.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum ReadyWhen {
    /// The first message on a topic.
    Topic {
        /// Which.
        topic: TopicId,
    },
    /// A connection to a TCP port of this machine succeeds. The text may contain `{port}` and `{worker}`.
    Port {
        /// The number, after replacements.
        port: String,
    },
    /// The clock of the simulator advances.
    Clock,
    /// A line of standard output or standard error contains this text.
    Line {
        /// The text.
        text: String,
    },
}

/// What the relay may add to a message's way, in seconds of wall time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RelayBudget {
    /// Delay at most; positive.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub latency: Option<f64>,
    /// Difference of two delays at most; positive.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub jitter: Option<f64>,
}
