//! Why a monitor cannot go on.

use crate::transport::TransportError;

/// Why a monitor cannot go on between a runner and a simulator, in words for the user.
#[derive(Debug, thiserror::Error)]
pub enum BesideError {
    /// The simulator has ended, or its output is closed, while the runner waits for it.
    #[error("the program behind `--` ended while {awaited} was awaited")]
    Ended {
        /// What it was expected to send next, as a phrase.
        awaited: &'static str,
    },
    /// The simulator sent something that is not part of the protocol.
    #[error("the program behind `--`: {0}")]
    Simulator(TransportError),
    /// The runner sent something that is not part of the protocol.
    #[error("the runner sent what this monitor does not understand ({problem}); both must be of one release")]
    Runner {
        /// The problem.
        problem: String,
    },
    /// A message is not what the monitor expects.
    #[error("a message on `{path}` is not of the type that the space of the monitor declares: {reason}")]
    WrongType {
        /// The topic.
        path: String,
        /// The difference.
        reason: String,
    },
}
