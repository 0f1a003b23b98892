//! Groups of processes: a process that was started with its own can be ended together with those that stayed in it.

pub(crate) use self::system::{has_ended, kill, own};

#[cfg(unix)]
mod system {
    use std::os::unix::process::CommandExt as _;
    use std::process::{Child, Command};

    use rustix::process::{Pid, Signal, WaitId, WaitIdOptions, kill_process_group, waitid};

    /// Lets the process begin a group of its own.
    pub(crate) fn own(command: &mut Command) {
        command.process_group(0);
    }

    /// Whether the process has ended. It is not reaped, so that its id is given to no other.
    pub(crate) fn has_ended(child: &mut Child) -> bool {
        let options = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
        matches!(waitid(WaitId::Pid(Pid::from_child(child)), options), Ok(Some(_)))
    }

    /// Ends the process and its group. It must not have been reaped.
    pub(crate) fn kill(child: &mut Child) {
        // A group that has ended already is what was asked for.
        kill_process_group(Pid::from_child(child), Signal::KILL).ok();
    }
}

/// Processes alone: the standard library knows no more.
#[cfg(not(unix))]
mod system {
    use std::process::{Child, Command};

    pub(crate) fn own(_: &mut Command) {}

    pub(crate) fn has_ended(child: &mut Child) -> bool {
        matches!(child.try_wait(), Ok(Some(_)))
    }

    pub(crate) fn kill(child: &mut Child) {
        child.kill().ok();
    }
}
