//! The simulator's process: started without a shell in a group of its own, and ended with all it started.
//!
//! However it comes to its end, its input is closed first, and it has [`END_LIMIT`] to end by itself. What it leaves behind
//! when it ends is ended at once: so nobody is left who holds its output open, and the end of the output tells the end of
//! the process. On Linux its [keeper](super::keeper) sees to all that, also when the worker is gone.

use std::fmt::Write as _;
use std::io::{self, Write};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, ChildStdout, Command, ExitStatus, Stdio};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, Weak};
use std::thread;
use std::time::Duration;

use crate::process_group;
use crate::transport::TransportError;
#[cfg(target_os = "linux")]
use crate::transport::process::keeper::Report;
use crate::transport::process::words::LastWords;

/// How long a simulator whose input is closed may take to end by itself.
pub(super) const END_LIMIT: Duration = Duration::from_secs(1);

/// How long a keeper may take beyond that to end what the simulator started, and then itself.
#[cfg(target_os = "linux")]
const KEEPER_LIMIT: Duration = Duration::from_secs(7);

/// The simulators of this process that may be alive.
static RUNNING: Mutex<Vec<Weak<Held>>> = Mutex::new(Vec::new());

/// A program that is a simulator.
#[derive(Debug, Clone)]
pub(super) struct Program {
    /// A name on `PATH`, or a path relative to the folder.
    pub(super) name: String,
    /// Its arguments.
    pub(super) arguments: Vec<String>,
    /// The folder it runs in.
    pub(super) folder: PathBuf,
    /// Whether the program of this process is a runner, which can keep watch over the simulator.
    #[cfg_attr(not(target_os = "linux"), expect(dead_code, reason = "only Linux ends a process with another"))]
    pub(super) in_runner: bool,
}

impl Program {
    /// The program with its arguments, for messages.
    pub(super) fn shown(&self) -> String {
        self.arguments.iter().fold(self.name.clone(), |mut shown, argument| {
            let plain = !argument.is_empty() && !argument.contains(|c: char| c.is_whitespace() || c.is_control());
            let written =
                if plain { write!(shown, " {argument}") } else { write!(shown, " \"{}\"", argument.escape_debug()) };
            written.expect("text grows as needed");
            shown
        })
    }

    /// Starts it.
    pub(super) fn start(&self) -> Result<(Running, Input, ChildStdout), TransportError> {
        let failed = |error: &io::Error| TransportError::NotStarted {
            command: self.shown(),
            folder: self.folder.clone(),
            reason: reason(error),
        };
        if !self.folder.is_dir() {
            return Err(TransportError::NotStarted {
                command: self.shown(),
                folder: self.folder.clone(),
                reason: "there is no such folder; if the space has moved, run `sesamec generate` again".to_owned(),
            });
        }
        // The folder that a worker has for itself is where it runs; the simulator runs beside its space.
        let own_folder = std::env::current_dir().map_err(|error| failed(&error))?;
        let (mut command, keeper) = self.command().map_err(|error| failed(&error))?;
        process_group::own(&mut command);
        let mut child = command
            .current_dir(&self.folder)
            .env_remove("SESAME_WORKER_TOKEN")
            .env("SESAME_WORKER_FOLDER", own_folder)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(|error| failed(&error))?;
        let input = child.stdin.take().expect("it is piped");
        let output = child.stdout.take().expect("it is piped");
        let words = LastWords::listen(child.stderr.take().expect("it is piped"));
        let held = Held::new(child, input, keeper.is_some());
        Ok((Running { held: Arc::clone(&held), words, keeper }, Input(held), output))
    }

    /// The program's path: what has a folder in it is relative to ours, everything else is looked up.
    fn path(&self) -> PathBuf {
        if self.name.contains(std::path::is_separator) {
            self.folder.join(&self.name)
        } else {
            PathBuf::from(&self.name)
        }
    }

    /// The command that starts it, and where its keeper will report if it has one.
    #[cfg(target_os = "linux")]
    fn command(&self) -> io::Result<(Command, Option<Report>)> {
        if !self.in_runner {
            return Ok((plain(self), None));
        }
        // If the keeper is killed, what it kept becomes ours.
        crate::descendants::adopt_orphans();
        let report = Report::new()?;
        let mut command = super::keeper::command(&report);
        command.arg(self.path()).args(&self.arguments);
        Ok((command, Some(report)))
    }

    #[cfg(not(target_os = "linux"))]
    fn command(&self) -> io::Result<(Command, Option<Report>)> {
        Ok((plain(self), None))
    }
}

/// Nobody keeps a simulator here, so nobody reports.
#[cfg(not(target_os = "linux"))]
enum Report {}

fn plain(program: &Program) -> Command {
    let mut command = Command::new(program.path());
    command.args(&program.arguments);
    command
}

/// Why a program does not start, in words.
pub(super) fn reason(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "there is no such program; install it, or give its path".to_owned(),
        io::ErrorKind::PermissionDenied => format!("{error}; is it marked as executable?"),
        _ => error.to_string(),
    }
}

/// Ends all simulators of this process with all that they started, whatever they do: as when each is closed, but from
/// any thread, and also while another talks to them.
pub fn end_simulators() {
    let running: Vec<Arc<Held>> = lock(&RUNNING).iter().filter_map(Weak::upgrade).collect();
    // First of all, so that they end side by side.
    let closed: Vec<bool> = running.iter().map(|held| held.try_close_input()).collect();
    for (held, closed) in running.iter().zip(closed) {
        if closed {
            held.wait();
        }
        held.end();
    }
}

/// The way to a simulator's standard input. Dropping it closes the input.
pub(super) struct Input(Arc<Held>);

impl Write for Input {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut *lock(&self.0.input) {
            Some(input) => input.write(bytes),
            None => Err(io::ErrorKind::BrokenPipe.into()),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Drop for Input {
    fn drop(&mut self) {
        *lock(&self.0.input) = None;
    }
}

/// What became of a simulator.
pub(super) struct PostMortem {
    /// How it ended, as a phrase.
    pub(super) how: String,
    /// The last lines of its standard error.
    pub(super) last_words: String,
    /// Whether it was killed, and not by us.
    pub(super) killed: bool,
}

/// A simulator's process. Dropping it ends the process and all that it started; its input must be closed by then, or it
/// is not given the time to end by itself.
pub(super) struct Running {
    held: Arc<Held>,
    words: LastWords,
    #[cfg_attr(not(target_os = "linux"), expect(dead_code, reason = "only Linux has keepers"))]
    keeper: Option<Report>,
}

impl Running {
    /// What became of a process that closed its output. Its input must be closed.
    pub(super) fn post_mortem(mut self) -> PostMortem {
        let in_time = self.held.wait();
        let status = self.held.end();
        let (how, killed) = match self.ended_by_itself(status.filter(|_| in_time)) {
            Some(status) => (format!("ended ({status})"), process_group::was_killed(status)),
            None => ("closed its standard output, but did not end,".to_owned(), false),
        };
        PostMortem { how, last_words: self.words.take(), killed }
    }

    /// A new test begins: forgets what was said on standard error so far.
    pub(super) fn forget_words(&mut self) {
        self.words.forget();
    }

    /// The status of a simulator that ended by itself. The keeper knows more than its own status says.
    fn ended_by_itself(&mut self, status: Option<ExitStatus>) -> Option<ExitStatus> {
        #[cfg(target_os = "linux")]
        if let Some(report) = self.keeper.take() {
            return report.read(status);
        }
        status
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        if lock(&self.held.input).is_none() {
            self.held.wait();
        }
        self.held.end();
    }
}

/// A process, or its keeper, that several threads hold.
struct Held {
    id: u32,
    #[cfg_attr(not(target_os = "linux"), expect(dead_code, reason = "only Linux has keepers"))]
    kept: bool,
    /// Locked while a line is written, which may take as long as nobody reads it.
    input: Mutex<Option<ChildStdin>>,
    process: Mutex<Process>,
    ended: Condvar,
}

struct Process {
    child: Child,
    /// It has ended, and nothing of it is left.
    ended: bool,
    /// It is reaped: from then on its id may be another's.
    status: Option<ExitStatus>,
}

impl Held {
    fn new(child: Child, input: ChildStdin, kept: bool) -> Arc<Held> {
        let held = Arc::new(Held {
            id: child.id(),
            kept,
            input: Mutex::new(Some(input)),
            process: Mutex::new(Process { child, ended: false, status: None }),
            ended: Condvar::new(),
        });
        let mut running = lock(&RUNNING);
        running.retain(|held| held.strong_count() > 0);
        running.push(Arc::downgrade(&held));
        drop(running);
        let watched = Arc::clone(&held);
        thread::spawn(move || watched.watch());
        held
    }

    /// Waits for the process to end, and ends what it leaves behind.
    fn watch(&self) {
        let killed = end::wait_for_end(self);
        let mut process = lock(&self.process);
        // Whoever reaped it has ended the rest too.
        let reaped = process.status.is_some();
        if !reaped {
            process_group::kill(&mut process.child);
        }
        drop(process);
        if killed && !reaped {
            self.end_orphans();
        }
        lock(&self.process).ended = true;
        self.ended.notify_all();
    }

    /// Waits for the process, whose input is closed, to end by itself; says whether it did within the time it has.
    fn wait(&self) -> bool {
        let process = lock(&self.process);
        let running = |process: &mut Process| !process.ended && process.status.is_none();
        let waited = self.ended.wait_timeout_while(process, self.limit(), running);
        let (process, _) = waited.unwrap_or_else(PoisonError::into_inner);
        process.ended
    }

    fn limit(&self) -> Duration {
        #[cfg(target_os = "linux")]
        if self.kept {
            return END_LIMIT + KEEPER_LIMIT;
        }
        END_LIMIT
    }

    /// Ends the process and all that it started, at once.
    fn end(&self) -> Option<ExitStatus> {
        let mut process = lock(&self.process);
        if process.status.is_none() {
            let alive = !process.ended;
            process_group::kill(&mut process.child);
            process.status = process.child.wait().ok();
            let status = process.status;
            drop(process);
            if alive {
                self.end_orphans();
            }
            return status;
        }
        process.status
    }

    /// What a keeper leaves behind that is killed itself has become ours. Other children of a worker, which hooks start,
    /// are in its own group.
    fn end_orphans(&self) {
        #[cfg(target_os = "linux")]
        if self.kept {
            let own: Vec<u32> = lock(&RUNNING).iter().filter_map(Weak::upgrade).map(|held| held.id).collect();
            crate::descendants::end_adopted(|id| own.contains(&id) || process_group::is_ours(id), Duration::ZERO);
        }
    }

    /// Closes the input unless a line is just being written.
    fn try_close_input(&self) -> bool {
        match self.input.try_lock() {
            Ok(mut input) => {
                *input = None;
                true
            }
            Err(_) => false,
        }
    }
}

/// Nothing that is locked here is left half done by a panic.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// How the end of a process is awaited without reaping it.
#[cfg(unix)]
mod end {
    use rustix::io::Errno;
    use rustix::process::{Pid, WaitId, WaitIdOptions, waitid};

    use super::Held;

    /// Waits until the process has ended, and says whether a signal ended it. It is not reaped, so that its id is given to
    /// no other.
    pub(super) fn wait_for_end(held: &Held) -> bool {
        let Some(id) = Pid::from_raw(held.id.cast_signed()) else { return true };
        loop {
            match waitid(WaitId::Pid(id), WaitIdOptions::EXITED | WaitIdOptions::NOWAIT) {
                Err(Errno::INTR) => {}
                Ok(Some(status)) => return !status.exited(),
                // It is reaped already.
                Ok(None) | Err(_) => return true,
            }
        }
    }
}

/// The same where the standard library offers nothing better than to ask again and again.
#[cfg(not(unix))]
mod end {
    use std::thread;
    use std::time::Duration;

    use super::{Held, lock};

    pub(super) fn wait_for_end(held: &Held) -> bool {
        loop {
            let mut process = lock(&held.process);
            if process.status.is_some() || !matches!(process.child.try_wait(), Ok(None)) {
                return false;
            }
            drop(process);
            thread::sleep(Duration::from_millis(20));
        }
    }
}
