//! Groups of processes: a process that was started with its own can be ended together with those that stayed in it.

pub use self::system::has_ended;
#[cfg(target_os = "linux")]
pub use self::system::is_ours;
pub use self::system::{kill, own, was_killed};

#[cfg(unix)]
mod system {
    use std::os::unix::process::{CommandExt as _, ExitStatusExt as _};
    use std::process::{Child, Command, ExitStatus};

    use rustix::process::{Pid, Signal, kill_process_group};

    /// Lets the process begin a group of its own.
    pub fn own(command: &mut Command) {
        command.process_group(0);
    }

    /// Whether the process has ended. It is not reaped, so that its id is given to no other.
    pub fn has_ended(child: &mut Child) -> bool {
        use rustix::process::{WaitId, WaitIdOptions, waitid};

        let options = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
        matches!(waitid(WaitId::Pid(Pid::from_child(child)), options), Ok(Some(_)))
    }

    /// Ends the process and its group. It must not have been reaped.
    pub fn kill(child: &mut Child) {
        // A group that has ended already is what was asked for.
        kill_process_group(Pid::from_child(child), Signal::KILL).ok();
    }

    /// Whether a process is in the group of this one.
    #[cfg(target_os = "linux")]
    pub fn is_ours(id: u32) -> bool {
        use rustix::process::{getpgid, getpgrp};

        getpgid(Pid::from_raw(id.cast_signed())).is_ok_and(|group| group == getpgrp())
    }

    /// Whether a process was killed. Only another process, or the system, can have done that.
    pub fn was_killed(status: ExitStatus) -> bool {
        status.signal() == Some(Signal::KILL.as_raw())
    }
}

/// Processes alone: the standard library knows no more.
#[cfg(not(unix))]
mod system {
    use std::process::{Child, Command, ExitStatus};

    pub fn own(_: &mut Command) {}

    pub fn has_ended(child: &mut Child) -> bool {
        matches!(child.try_wait(), Ok(Some(_)))
    }

    pub fn kill(child: &mut Child) {
        child.kill().ok();
    }

    /// The status does not tell here.
    pub fn was_killed(_: ExitStatus) -> bool {
        false
    }
}
