//! The programs that a plan launches beside a simulator that is a program.

use crate::lifecycle::launch::Launched;
use crate::transport::{Incidents, TransportError};

/// Starts what the plan launches, before the simulator is started, and waits until it is ready.
pub(super) fn launch(launched: &mut Launched, seed: u64) -> Result<(), TransportError> {
    launched.start(seed)?;
    let mut asked = false;
    launched.await_ready(&mut |_| {
        asked = true;
        true
    })?;
    if asked {
        launched.end();
        return Err(TransportError::LaunchFailed {
            what: "a program".to_owned(),
            problem: "is awaited by a topic or the clock, which a simulator of this kind has only after its reset; \
                      await a port or a line instead"
                .to_owned(),
            last_lines: String::new(),
        });
    }
    Ok(())
}

/// The fault that a launched program has ended, if one has.
pub(super) fn health(launched: &mut Launched, incidents: &mut Incidents) -> Result<(), TransportError> {
    let checked = launched.check();
    if checked.is_err() {
        incidents.killed |= launched.was_killed();
        incidents.notes.append(&mut launched.take_notes());
    }
    checked
}
