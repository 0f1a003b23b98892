//! Process groups: a process that was started in a group of its own can be ended together with all processes in it.

pub use self::system::has_ended;
#[cfg(target_os = "linux")]
pub use self::system::is_ours;
pub use self::system::{ask_to_end, kill, own, was_killed};

#[cfg(unix)]
mod system {
    use std::os::unix::process::{CommandExt as _, ExitStatusExt as _};
    use std::process::{Child, Command, ExitStatus};

    use rustix::process::{Pid, Signal, kill_process_group};

    /// Makes the command start its process in a group of its own.
    pub fn own(command: &mut Command) {
        command.process_group(0);
    }

    /// Whether the process has ended. It is not reaped, so its id is not reused.
    pub fn has_ended(child: &mut Child) -> bool {
        use rustix::process::{WaitId, WaitIdOptions, waitid};

        let options = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
        matches!(waitid(WaitId::Pid(Pid::from_child(child)), options), Ok(Some(_)))
    }

    /// Ends the process and its group. It must not have been reaped.
    pub fn kill(child: &mut Child) {
        // An error means that the group has already ended.
        kill_process_group(Pid::from_child(child), Signal::KILL).ok();
    }

    /// Asks the process and its group to end. It must not have been reaped.
    pub fn ask_to_end(child: &mut Child) {
        kill_process_group(Pid::from_child(child), Signal::TERM).ok();
        // One that was paused must go on to hear it.
        kill_process_group(Pid::from_child(child), Signal::CONT).ok();
    }

    /// Whether a process is in the group of this process.
    #[cfg(target_os = "linux")]
    pub fn is_ours(id: u32) -> bool {
        use rustix::process::{getpgid, getpgrp};

        getpgid(Pid::from_raw(id.cast_signed())).is_ok_and(|group| group == getpgrp())
    }

    /// Whether a process was killed with `SIGKILL`, by another process or by the system.
    pub fn was_killed(status: ExitStatus) -> bool {
        status.signal() == Some(Signal::KILL.as_raw())
    }
}

/// Single processes: the standard library has no groups.
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

    /// There is no way to ask.
    pub fn ask_to_end(child: &mut Child) {
        kill(child);
    }

    /// The status does not show it here.
    pub fn was_killed(_: ExitStatus) -> bool {
        false
    }
}
