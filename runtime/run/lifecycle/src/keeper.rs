//! A program's keeper: a process between worker and program which ensures that no process of the program remains,
//! whichever of them ends first. Linux only.
//!
//! It becomes the parent of every process below the program whose own parent ends, in any session. It waits until
//! the program has exited, or until the program's input is closed: by the worker, or because the worker has ended. In
//! that case the program has its time to exit by itself; one in the background, which has no input of its own, is asked
//! with `SIGTERM`. Then the keeper ends all remaining processes, reports how the
//! program ended, and exits. If the keeper is killed, the system ends the program, and the program's children become
//! the worker's.

use std::ffi::{OsStr, OsString};
use std::fs::File;
use std::io::{self, PipeReader, PipeWriter, Read as _, Write as _};
use std::os::fd::AsRawFd as _;
use std::os::unix::process::{CommandExt as _, ExitStatusExt as _};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, ExitStatus, Stdio};
use std::sync::{Arc, Condvar, Mutex, OnceLock, PoisonError};
use std::thread;
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use rustix::process::{
    Pid, Signal, WaitId, WaitIdOptions, WaitOptions, getppid, kill_process_group, set_parent_process_death_signal,
    wait, waitid,
};

use crate::descendants;
use crate::limits::{END_LIMIT, NOT_FOUND, reason};

/// How often a keeper checks that its worker is alive: the program itself may hold its input open.
const CHECK: Timespec = Timespec { tv_sec: 0, tv_nsec: 250_000_000 };

/// What the keeper reports instead of a status if it ended the program itself.
const STOPPED: &str = "stopped";

/// The pipe on which a keeper reports to its worker how the program ended.
pub(crate) struct Report {
    reader: PipeReader,
    /// The keeper opens it by its name.
    writer: PipeWriter,
}

impl Report {
    pub(crate) fn new() -> io::Result<Self> {
        let (reader, writer) = io::pipe()?;
        Ok(Report { reader, writer })
    }

    fn name(&self) -> String {
        format!("/proc/{}/fd/{}", std::process::id(), self.writer.as_raw_fd())
    }

    /// The status of a program that exited by itself, as its keeper reported it; the keeper has ended. Without a
    /// report, because the keeper was killed or could not open the pipe, the keeper's own status is used.
    pub(crate) fn read(mut self, of_keeper: Option<ExitStatus>) -> Option<ExitStatus> {
        drop(self.writer);
        // Another process may have opened the pipe and hold it open.
        if rustix::io::ioctl_fionread(&self.reader).is_ok_and(|waiting| waiting == 0) {
            return of_keeper;
        }
        let mut text = [0; 32];
        let length = self.reader.read(&mut text).unwrap_or(0);
        let text = std::str::from_utf8(&text[..length]).unwrap_or_default();
        if text == STOPPED { None } else { text.parse().map_or(of_keeper, |status| Some(ExitStatus::from_raw(status))) }
    }
}

/// What keepers are, if not the program of this process.
static PROGRAM: OnceLock<PathBuf> = OnceLock::new();

/// From now on, keepers are this program: for a process whose own is another, such as Python. The first call decides.
pub fn use_keeper(program: PathBuf) {
    PROGRAM.get_or_init(|| program);
}

/// The command of a keeper, without the program and its arguments.
pub(crate) fn command(report: &Report, background: bool) -> Command {
    let mut command = match PROGRAM.get() {
        Some(program) => Command::new(program),
        // This is the running executable even if its file was replaced.
        None => Command::new("/proc/self/exe"),
    };
    if let Some(name) = std::env::args_os().next().filter(|_| PROGRAM.get().is_none()) {
        command.arg0(name);
    }
    command.arg("simulator").arg(std::process::id().to_string()).arg(report.name());
    if background {
        command.arg("--background");
    }
    command.arg("--");
    command
}

/// What a keeper starts.
#[derive(Debug, Clone, Copy)]
pub struct Kept<'a> {
    /// The program.
    pub program: &'a OsStr,
    /// Its arguments.
    pub arguments: &'a [OsString],
    /// Whether it has no input of its own.
    pub background: bool,
}

/// The state of a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    Running,
    Stopped,
    Ended,
}

/// Starts a program, waits until it has ended, and ends everything it leaves behind. If it cannot be started, `failed`
/// is called with the reason, with the program's standard output and standard error.
pub fn keep(worker: u32, report: &Path, kept: &Kept<'_>, failed: fn(&str)) -> ExitCode {
    let &Kept { program, arguments, background } = kept;
    descendants::adopt_orphans();
    // Without it the keeper's own status is used.
    let report = File::options().write(true).open(report).ok();
    let mut command = Command::new("/proc/self/exe");
    if let Some(name) = std::env::args_os().next() {
        command.arg0(name);
    }
    command.arg("simulated").arg(std::process::id().to_string());
    if background {
        command.arg("--background").stdin(Stdio::null());
    }
    command.arg("--").arg(program).args(arguments);
    let child = match command.process_group(0).spawn() {
        Ok(child) => Pid::from_child(&child),
        Err(error) => {
            failed(&format!("cannot start its keeper: {error}"));
            return ExitCode::FAILURE;
        }
    };
    // The worker must see when the program closes its output, so the keeper must not hold it open. It writes nothing.
    rustix::stdio::dup2_stdout(io::stdin()).ok();
    rustix::stdio::dup2_stderr(io::stdin()).ok();

    let shared = Arc::new((Mutex::new(Stage::Running), Condvar::new()));
    let watched = Arc::clone(&shared);
    thread::spawn(move || end_after_input(worker, child, background, &watched));
    let Some(status) = reap_until_ended(child, &shared) else { return ExitCode::FAILURE };
    let (status, stopped) = status;
    descendants::end_adopted(|_| false, Duration::ZERO);
    if let Some(mut report) = report {
        let text = if stopped { STOPPED.to_owned() } else { status.into_raw().to_string() };
        report.write_all(text.as_bytes()).ok();
    }
    // As in shells.
    let code = status.code().or_else(|| Some(128 + status.signal()?)).and_then(|code| u8::try_from(code).ok());
    code.map_or(ExitCode::FAILURE, ExitCode::from)
}

/// Ends the program if it does not exit by itself in time after its input was closed.
fn end_after_input(worker: u32, child: Pid, background: bool, shared: &(Mutex<Stage>, Condvar)) {
    wait_for_end_of_input(worker);
    let (stage, changed) = shared;
    let running = stage.lock().unwrap_or_else(PoisonError::into_inner);
    if background && *running == Stage::Running {
        // One that was paused must go on to hear it.
        kill_process_group(child, Signal::TERM).ok();
        kill_process_group(child, Signal::CONT).ok();
    }
    let waited = changed.wait_timeout_while(running, END_LIMIT, |stage| *stage == Stage::Running);
    let (mut stage, _) = waited.unwrap_or_else(PoisonError::into_inner);
    if *stage == Stage::Running {
        *stage = Stage::Stopped;
        // It is only reaped while this lock is held, so the id is still its own.
        kill_process_group(child, Signal::KILL).ok();
    }
}

/// Waits until no process can write to standard input any more, or the worker has ended.
fn wait_for_end_of_input(worker: u32) {
    let input = io::stdin();
    let worker_is_alive = || getppid().is_some_and(|parent| parent.as_raw_pid().cast_unsigned() == worker);
    while worker_is_alive() {
        let mut input = [PollFd::new(&input, PollFlags::empty())];
        match poll(&mut input, Some(&CHECK)) {
            Ok(0) | Err(Errno::INTR) => {}
            _ => return,
        }
    }
}

/// Reaps all processes until the program has ended; returns its status, and whether the keeper ended it.
fn reap_until_ended(child: Pid, (stage, changed): &(Mutex<Stage>, Condvar)) -> Option<(ExitStatus, bool)> {
    loop {
        match waitid(WaitId::All, WaitIdOptions::EXITED | WaitIdOptions::NOWAIT) {
            Ok(_) => {}
            Err(Errno::INTR) => continue,
            Err(_) => return None,
        }
        let mut stage = stage.lock().unwrap_or_else(PoisonError::into_inner);
        if let Ok(Some((ended, status))) = wait(WaitOptions::NOHANG)
            && ended == child
        {
            let stopped = *stage == Stage::Stopped;
            *stage = Stage::Ended;
            changed.notify_all();
            return Some((ExitStatus::from_raw(status.as_raw()), stopped));
        }
    }
}

/// Replaces this process by a program that ends when its keeper does, even if the keeper is killed while the program
/// hangs. Only returns if that fails, after it has called `failed` with the reason.
pub fn become_program(keeper: u32, program: &OsStr, arguments: &[OsString], failed: fn(&str)) -> ExitCode {
    if let Err(error) = set_parent_process_death_signal(Some(Signal::KILL)) {
        failed(&format!("it cannot be made to end with its keeper: {error}"));
        return ExitCode::FAILURE;
    }
    // The keeper may have ended before the system was asked.
    if getppid().is_none_or(|parent| parent.as_raw_pid().cast_unsigned() != keeper) {
        return ExitCode::FAILURE;
    }
    let error = Command::new(program).args(arguments).exec();
    failed(&format!("cannot start `{}`: {}", program.display(), reason(&error)));
    u8::try_from(NOT_FOUND).map_or(ExitCode::FAILURE, ExitCode::from)
}
