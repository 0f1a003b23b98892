//! A simulator's keeper: a process between worker and simulator that sees to it that nothing of the simulator is left,
//! whoever ends first, and however. Linux only.
//!
//! It becomes the parent of all that is below the simulator once its own parents end, sessions or not. It waits until the
//! simulator has ended, or until the simulator's input is closed, be it that the worker closed it or that the worker is
//! gone; then the simulator has its time to end by itself. What is left after that is ended, the keeper reports how the
//! simulator ended, and ends too. If the keeper is killed, the simulator is, and what it started becomes the worker's.

use std::ffi::{OsStr, OsString};
use std::fs::File;
use std::io::{self, PipeReader, PipeWriter, Read as _, Write as _};
use std::os::fd::AsRawFd as _;
use std::os::unix::process::{CommandExt as _, ExitStatusExt as _};
use std::path::Path;
use std::process::{Command, ExitCode, ExitStatus};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use rustix::process::{
    Pid, Signal, WaitId, WaitIdOptions, WaitOptions, getppid, kill_process_group, set_parent_process_death_signal,
    wait, waitid,
};

use crate::descendants;
use crate::transport::process::child::{END_LIMIT, reason};

/// How often a keeper looks whether its worker is there: who holds the simulator's input open may be the simulator itself.
const LOOK: Timespec = Timespec { tv_sec: 0, tv_nsec: 250_000_000 };

/// What the keeper says instead of a status when it ended the simulator itself.
const STOPPED: &str = "stopped";

/// The way on which a keeper tells its worker how the simulator ended.
pub(super) struct Report {
    reader: PipeReader,
    /// Lent to the keeper, which opens it by its name.
    writer: PipeWriter,
}

impl Report {
    pub(super) fn new() -> io::Result<Self> {
        let (reader, writer) = io::pipe()?;
        Ok(Report { reader, writer })
    }

    fn name(&self) -> String {
        format!("/proc/{}/fd/{}", std::process::id(), self.writer.as_raw_fd())
    }

    /// The status of a simulator that ended by itself, as its keeper reported it, which has ended. Without a report, since
    /// the keeper was killed or had no way to report, its own status has to do.
    pub(super) fn read(mut self, of_keeper: Option<ExitStatus>) -> Option<ExitStatus> {
        drop(self.writer);
        // Somebody else may have opened the way, and hold it.
        if rustix::io::ioctl_fionread(&self.reader).is_ok_and(|waiting| waiting == 0) {
            return of_keeper;
        }
        let mut text = [0; 32];
        let length = self.reader.read(&mut text).unwrap_or(0);
        let text = std::str::from_utf8(&text[..length]).unwrap_or_default();
        if text == STOPPED { None } else { text.parse().map_or(of_keeper, |status| Some(ExitStatus::from_raw(status))) }
    }
}

/// The command of a keeper, short of the simulator's program and its arguments.
pub(super) fn command(report: &Report) -> Command {
    // This is the runner's own file even if another was put into its place meanwhile.
    let mut command = Command::new("/proc/self/exe");
    if let Some(name) = std::env::args_os().next() {
        command.arg0(name);
    }
    command.arg("simulator").arg(std::process::id().to_string()).arg(report.name()).arg("--");
    command
}

/// How far a simulator is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    Runs,
    Stopped,
    Ended,
}

/// Starts a simulator, keeps it until it has ended, and ends what it leaves behind.
pub fn keep_simulator(worker: u32, report: &Path, program: &OsStr, arguments: &[OsString]) -> ExitCode {
    descendants::adopt_orphans();
    // Without it the keeper's own status has to do.
    let report = File::options().write(true).open(report).ok();
    let mut command = Command::new("/proc/self/exe");
    if let Some(name) = std::env::args_os().next() {
        command.arg0(name);
    }
    command.arg("simulated").arg(std::process::id().to_string()).arg("--").arg(program).args(arguments);
    let simulator = match command.process_group(0).spawn() {
        Ok(child) => Pid::from_child(&child),
        Err(error) => return failed(&format!("cannot start its keeper: {error}")),
    };
    // The worker is to see when the simulator closes them. This end of the input can be written by nobody.
    rustix::stdio::dup2_stdout(io::stdin()).ok();
    rustix::stdio::dup2_stderr(io::stdin()).ok();

    let shared = Arc::new((Mutex::new(Stage::Runs), Condvar::new()));
    let watched = Arc::clone(&shared);
    thread::spawn(move || end_after_input(worker, simulator, &watched));
    let Some(status) = reap_until_ended(simulator, &shared) else { return ExitCode::FAILURE };
    let (status, stopped) = status;
    descendants::end_adopted(|_| false, Duration::ZERO);
    if let Some(mut report) = report {
        let text = if stopped { STOPPED.to_owned() } else { status.into_raw().to_string() };
        report.write_all(text.as_bytes()).ok();
    }
    // As shells have it.
    let code = status.code().or_else(|| Some(128 + status.signal()?)).and_then(|code| u8::try_from(code).ok());
    code.map_or(ExitCode::FAILURE, ExitCode::from)
}

/// Ends the simulator if it does not end by itself in time after its input was closed.
fn end_after_input(worker: u32, simulator: Pid, shared: &(Mutex<Stage>, Condvar)) {
    wait_for_end_of_input(worker);
    let (stage, changed) = shared;
    let running = stage.lock().unwrap_or_else(PoisonError::into_inner);
    let waited = changed.wait_timeout_while(running, END_LIMIT, |stage| *stage == Stage::Runs);
    let (mut stage, _) = waited.unwrap_or_else(PoisonError::into_inner);
    if *stage == Stage::Runs {
        *stage = Stage::Stopped;
        // It is reaped by who holds this lock only, so the id is its own.
        kill_process_group(simulator, Signal::KILL).ok();
    }
}

/// Waits until nobody can write to standard input any more, or the worker is gone.
fn wait_for_end_of_input(worker: u32) {
    let input = io::stdin();
    let worker_lives = || getppid().is_some_and(|parent| parent.as_raw_pid().cast_unsigned() == worker);
    while worker_lives() {
        let mut input = [PollFd::new(&input, PollFlags::empty())];
        match poll(&mut input, Some(&LOOK)) {
            Ok(0) | Err(Errno::INTR) => {}
            _ => return,
        }
    }
}

/// Reaps whatever ends until the simulator has; gives its status, and whether it was stopped before.
fn reap_until_ended(simulator: Pid, (stage, changed): &(Mutex<Stage>, Condvar)) -> Option<(ExitStatus, bool)> {
    loop {
        match waitid(WaitId::All, WaitIdOptions::EXITED | WaitIdOptions::NOWAIT) {
            Ok(_) => {}
            Err(Errno::INTR) => continue,
            Err(_) => return None,
        }
        let mut stage = stage.lock().unwrap_or_else(PoisonError::into_inner);
        if let Ok(Some((ended, status))) = wait(WaitOptions::NOHANG)
            && ended == simulator
        {
            let stopped = *stage == Stage::Stopped;
            *stage = Stage::Ended;
            changed.notify_all();
            return Some((ExitStatus::from_raw(status.as_raw()), stopped));
        }
    }
}

/// Becomes a simulator that ends when its keeper does, even if the keeper is killed while the simulator hangs. Only
/// returns if that fails; it is then said in the words of the protocol.
pub fn become_simulator(keeper: u32, program: &OsStr, arguments: &[OsString]) -> ExitCode {
    if let Err(error) = set_parent_process_death_signal(Some(Signal::KILL)) {
        return failed(&format!("it cannot be made to end with its keeper: {error}"));
    }
    // The keeper may have gone before the system was asked.
    if getppid().is_none_or(|parent| parent.as_raw_pid().cast_unsigned() != keeper) {
        return ExitCode::FAILURE;
    }
    let error = Command::new(program).args(arguments).exec();
    failed(&format!("cannot start `{}`: {}", program.display(), reason(&error)))
}

/// Says in the words of the protocol that there will be no simulator.
fn failed(what: &str) -> ExitCode {
    let mut line = b"{\"failed\":".to_vec();
    crate::json::quoted(what, &mut line);
    line.extend_from_slice(b"}\n");
    // Nobody is left to be told if this fails.
    io::stdout().write_all(&line).and_then(|()| io::stdout().flush()).ok();
    ExitCode::FAILURE
}
