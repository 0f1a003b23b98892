//! What is said of a simulator that cannot be started, or closes its output.

use crate::lifecycle::{PostMortem, Program, Running, StartError};
use crate::transport::{Incidents, TransportError};

impl From<StartError> for TransportError {
    fn from(StartError { command, folder, reason }: StartError) -> Self {
        TransportError::NotStarted { command, folder, reason }
    }
}

/// The error about a simulator that closed its output although something was awaited.
pub(super) fn disconnected(
    program: &Program,
    running: Option<Running>,
    awaited: String,
    incidents: &mut Incidents,
) -> TransportError {
    let Some(running) = running else { unreachable!("only a connected simulator can disconnect") };
    let PostMortem { how, last_lines, killed } = running.post_mortem();
    incidents.killed |= killed;
    TransportError::Disconnected { command: program.shown(), how, awaited, last_lines }
}

/// The note about a simulator that was restarted, because of a fault that may belong to the previous test.
pub(super) fn restarted(reason: &TransportError) -> String {
    format!("the simulator was restarted before this test, because of a fault after the previous one: {reason}")
}
