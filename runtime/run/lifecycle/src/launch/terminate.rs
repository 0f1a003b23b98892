//! The command that ends a system, run once at its end.
//!
//! A worker may be told to end while its transport waits for the system, so what is to be run is known to the whole
//! process: whoever ends the system first runs it, and the other one waits.

use std::io::Write as _;
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::time::Duration;

use crate::output::Watch;
use crate::program::{Alarm, Program};

/// How long the command may take; then it is ended, and so is what it should have ended.
pub(super) const LIMIT: Duration = Duration::from_secs(10);

/// The commands of systems that are running.
static PENDING: Mutex<Vec<Weak<Terminate>>> = Mutex::new(Vec::new());

/// A command that is to be run at the end of what was launched.
pub(super) struct Terminate {
    program: Program,
    /// The command as it is written in the space.
    shown: String,
    done: Mutex<bool>,
}

impl Terminate {
    /// Registers it: from now on it is run when this process is told to end.
    pub(super) fn pending(program: Program, shown: String) -> Arc<Terminate> {
        let terminate = Arc::new(Terminate { program, shown, done: Mutex::new(false) });
        let mut pending = PENDING.lock().unwrap_or_else(PoisonError::into_inner);
        pending.retain(|other| other.strong_count() > 0);
        pending.push(Arc::downgrade(&terminate));
        terminate
    }

    /// Runs it, unless it was run; what went wrong, in words for the user.
    pub(super) fn run(&self) -> Option<String> {
        let mut done = self.done.lock().unwrap_or_else(PoisonError::into_inner);
        if *done {
            return None;
        }
        *done = true;
        let shown = &self.shown;
        let running = match self.program.start_in_background(&Watch::default(), &Alarm::default()) {
            Ok(running) => running,
            Err(error) => return Some(format!("`terminate` `{shown}` cannot be started: {}", error.reason)),
        };
        if !running.wait_for_end(LIMIT) {
            return Some(format!("`terminate` `{shown}` did not end within {} s, and was ended", LIMIT.as_secs()));
        }
        let end = running.post_mortem();
        let lines = if end.last_lines.is_empty() { String::new() } else { format!(":\n{}", end.last_lines) };
        (!end.success).then(|| format!("`terminate` `{shown}` {}{lines}", end.how))
    }
}

/// Runs those of all systems of this process, because it ends.
pub fn terminate_all() {
    let pending: Vec<Arc<Terminate>> =
        PENDING.lock().unwrap_or_else(PoisonError::into_inner).iter().filter_map(Weak::upgrade).collect();
    for note in pending.iter().filter_map(|terminate| terminate.run()) {
        // The worker's log; nobody else listens any more.
        writeln!(std::io::stderr(), "{note}").ok();
    }
}
