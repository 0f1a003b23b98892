//! What users read of a simulator that cannot be started, or has a fault.

use crate::transport::process::session::Fault;
use crate::transport::{Incidents, TransportError};
use sesame_lifecycle::{PostMortem, Program, Running, StartError};

impl From<StartError> for TransportError {
    fn from(StartError { command, folder, reason }: StartError) -> Self {
        TransportError::NotStarted { command, folder, reason }
    }
}

/// The error for a fault of a simulator whose process was `running` and is never used again.
pub(super) fn explain(
    program: &Program,
    running: Option<Running>,
    fault: Fault,
    incidents: &mut Incidents,
) -> TransportError {
    match fault {
        Fault::Disconnected(awaited) => {
            let Some(running) = running else { unreachable!("only a connected simulator can disconnect") };
            let PostMortem { how, last_lines, killed, .. } = running.post_mortem();
            incidents.killed |= killed;
            TransportError::Disconnected { command: program.shown(), how, awaited, last_lines }
        }
        Fault::Wrong(error) => error,
    }
}

/// Notes that a simulator is restarted because of a fault that may belong to the previous test. That its old process
/// was killed does not concern this test.
pub(super) fn note_restart(program: &Program, running: Option<Running>, fault: Fault, incidents: &mut Incidents) {
    let reason = explain(program, running, fault, &mut Incidents::default());
    incidents.notes.push(format!(
        "the simulator was restarted before this test, because of a fault after the previous one: {reason}"
    ));
}
