//! The programs that a plan launches in addition to a simulator that is a program.

use crate::transport::{Incidents, TransportError};
use sesame_lifecycle::launch::Launched;

/// The fault that a launched program has ended, if one has.
pub(super) fn health(launched: &mut Launched, incidents: &mut Incidents) -> Result<(), TransportError> {
    let checked = launched.check();
    if checked.is_err() {
        incidents.killed |= launched.was_killed();
        incidents.notes.append(&mut launched.take_notes());
    }
    Ok(checked?)
}
