//! Signals to a launched program and to everything that it started.

use crate::program::Running;

#[cfg(target_os = "linux")]
pub(super) use self::linux::{kill, pause, resume};
#[cfg(not(target_os = "linux"))]
pub(super) use self::other::{kill, pause, resume};

#[cfg(target_os = "linux")]
mod linux {
    use std::collections::BTreeSet;

    use rustix::process::{Pid, Signal, kill_process};

    use super::Running;
    use crate::descendants;

    /// How often it is looked for processes that were started meanwhile.
    const ROUNDS: usize = 16;

    /// Stops all its processes; whether there were any.
    pub(in super::super) fn pause(running: &Running) -> bool {
        send(running, Signal::STOP)
    }

    /// Lets all its processes go on.
    pub(in super::super) fn resume(running: &Running) -> bool {
        send(running, Signal::CONT)
    }

    /// Ends all its processes at once.
    pub(in super::super) fn kill(running: &Running) -> bool {
        send(running, Signal::KILL)
    }

    /// Sends it until no process is left that has not got it: one may start others before it is reached.
    fn send(running: &Running, signal: Signal) -> bool {
        let (id, is_keeper) = running.process();
        let mut reached = BTreeSet::new();
        for _ in 0..ROUNDS {
            let mut processes: BTreeSet<u32> = descendants::below(id).iter().map(|process| process.id()).collect();
            // The keeper must go on: it watches over the others.
            if !is_keeper && !running.has_ended() {
                processes.insert(id);
            }
            let fresh: Vec<u32> = processes.difference(&reached).copied().collect();
            if fresh.is_empty() {
                break;
            }
            for process in fresh {
                if let Some(process) = Pid::from_raw(process.cast_signed()) {
                    // An error means that it has just ended.
                    kill_process(process, signal).ok();
                }
                reached.insert(process);
            }
        }
        !reached.is_empty()
    }
}

#[cfg(not(target_os = "linux"))]
mod other {
    use super::Running;

    /// Nothing here finds the processes of a program.
    pub(in super::super) fn pause(_: &Running) -> bool {
        false
    }

    pub(in super::super) fn resume(_: &Running) -> bool {
        false
    }

    /// The caller ends the program.
    pub(in super::super) fn kill(_: &Running) -> bool {
        true
    }
}
