//! A program: started without a shell in a process group of its own, and ended with everything it started.
//!
//! In every case its input is closed first, and it has [`END_LIMIT`] to exit by itself. Everything that it leaves
//! behind when it exits is ended at once, so no process holds its output open, and the end of the output means the end
//! of the program. On Linux its [keeper](super::keeper) does this, even after the worker has ended.

use std::fmt::Write as _;
use std::io::{self, Write};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, ChildStdout, Command, ExitStatus, Stdio};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, Weak};
use std::thread;
use std::time::Duration;

#[cfg(target_os = "linux")]
use crate::lifecycle::keeper::Report;
use crate::lifecycle::limits::{END_LIMIT, reason};
use crate::lifecycle::process_group;
use crate::lifecycle::stderr::StderrTail;

/// How much longer a keeper may take to end everything that the program started, and then itself.
#[cfg(target_os = "linux")]
const KEEPER_LIMIT: Duration = Duration::from_secs(7);

/// The programs started by this process that may be alive.
static RUNNING: Mutex<Vec<Weak<Handle>>> = Mutex::new(Vec::new());

/// A program that can be started.
#[derive(Debug, Clone)]
pub(crate) struct Program {
    /// A name on `PATH`, or a path relative to the folder.
    pub(crate) name: String,
    /// Its arguments.
    pub(crate) arguments: Vec<String>,
    /// The folder it runs in.
    pub(crate) folder: PathBuf,
    /// Whether this process is a runner, whose executable can be the keeper.
    #[cfg_attr(not(target_os = "linux"), expect(dead_code, reason = "only Linux has keepers"))]
    pub(crate) in_runner: bool,
}

impl Program {
    /// The program with its arguments, for messages.
    pub(crate) fn shown(&self) -> String {
        self.arguments.iter().fold(self.name.clone(), |mut shown, argument| {
            let plain = !argument.is_empty() && !argument.contains(|c: char| c.is_whitespace() || c.is_control());
            let written =
                if plain { write!(shown, " {argument}") } else { write!(shown, " \"{}\"", argument.escape_debug()) };
            written.expect("text grows as needed");
            shown
        })
    }

    /// Starts it.
    pub(crate) fn start(&self) -> Result<(Running, Input, ChildStdout), StartError> {
        let refused = |reason| StartError { command: self.shown(), folder: self.folder.clone(), reason };
        let failed = |error: &io::Error| refused(reason(error));
        if !self.folder.is_dir() {
            let reason = "there is no such folder; if the space has moved, run `sesamec generate` again";
            return Err(refused(reason.to_owned()));
        }
        // A worker runs in its own folder; the program runs beside the space.
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
        let stderr = StderrTail::capture(child.stderr.take().expect("it is piped"));
        let handle = Handle::new(child, input, keeper.is_some());
        Ok((Running { handle: Arc::clone(&handle), stderr, keeper }, Input(handle), output))
    }

    /// The program's path: a path with a folder is relative to the program's folder, a name is looked up on `PATH`.
    fn path(&self) -> PathBuf {
        if self.name.contains(std::path::is_separator) {
            self.folder.join(&self.name)
        } else {
            PathBuf::from(&self.name)
        }
    }

    /// The command that starts it, and where its keeper reports, if it has one.
    #[cfg(target_os = "linux")]
    fn command(&self) -> io::Result<(Command, Option<Report>)> {
        if !self.in_runner {
            return Ok((plain(self), None));
        }
        // If the keeper is killed, this process becomes the parent of its children.
        crate::lifecycle::descendants::adopt_orphans();
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

/// There are no keepers here.
#[cfg(not(target_os = "linux"))]
enum Report {}

fn plain(program: &Program) -> Command {
    let mut command = Command::new(program.path());
    command.args(&program.arguments);
    command
}

/// Why a program cannot be started.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct StartError {
    /// The program with its arguments.
    pub(crate) command: String,
    /// The folder it was to run in.
    pub(crate) folder: PathBuf,
    /// The reason, in words for the user.
    pub(crate) reason: String,
}

/// Ends all programs that this process started, with everything they started. It does the same as closing each of them,
/// but may be called from any thread, even while another one communicates with them.
pub(crate) fn end_programs() {
    let running: Vec<Arc<Handle>> = lock(&RUNNING).iter().filter_map(Weak::upgrade).collect();
    // All inputs are closed first, so that the programs exit at the same time.
    let closed: Vec<bool> = running.iter().map(|handle| handle.try_close_input()).collect();
    for (handle, closed) in running.iter().zip(closed) {
        if closed {
            handle.wait();
        }
        handle.end();
    }
}

/// A program's standard input. Dropping it closes the input.
pub(crate) struct Input(Arc<Handle>);

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

/// How a program ended.
pub(crate) struct PostMortem {
    /// The way it ended, as a phrase.
    pub(crate) how: String,
    /// The last lines of its standard error.
    pub(crate) last_lines: String,
    /// Whether it was killed by another process or the system.
    pub(crate) killed: bool,
}

/// A program that was started. Dropping it ends the program and everything it started. Close its input first; otherwise
/// the program has no time to exit by itself.
pub(crate) struct Running {
    handle: Arc<Handle>,
    stderr: StderrTail,
    #[cfg_attr(not(target_os = "linux"), expect(dead_code, reason = "only Linux has keepers"))]
    keeper: Option<Report>,
}

impl Running {
    /// How a program ended that has closed its output. Its input must be closed.
    pub(crate) fn post_mortem(mut self) -> PostMortem {
        let in_time = self.handle.wait();
        let status = self.handle.end();
        let (how, killed) = match self.ended_by_itself(status.filter(|_| in_time)) {
            Some(status) => (format!("ended ({status})"), process_group::was_killed(status)),
            None => ("closed its standard output, but did not exit,".to_owned(), false),
        };
        PostMortem { how, last_lines: self.stderr.last_lines(), killed }
    }

    /// A new test begins: forgets everything written to standard error so far.
    pub(crate) fn clear_stderr(&mut self) {
        self.stderr.clear();
    }

    /// The status of a program that exited by itself, as its keeper reports it, if there is one.
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
        if lock(&self.handle.input).is_none() {
            self.handle.wait();
        }
        self.handle.end();
    }
}

/// A process, or its keeper, shared between threads.
struct Handle {
    id: u32,
    #[cfg_attr(not(target_os = "linux"), expect(dead_code, reason = "only Linux has keepers"))]
    kept: bool,
    /// Locked while a line is written, which blocks until the program reads it.
    input: Mutex<Option<ChildStdin>>,
    process: Mutex<Process>,
    ended: Condvar,
}

struct Process {
    child: Child,
    /// It has ended, and so has everything it left behind.
    ended: bool,
    /// Its status, once it is reaped: from then on its id may be reused.
    status: Option<ExitStatus>,
}

impl Handle {
    fn new(child: Child, input: ChildStdin, kept: bool) -> Arc<Handle> {
        let handle = Arc::new(Handle {
            id: child.id(),
            kept,
            input: Mutex::new(Some(input)),
            process: Mutex::new(Process { child, ended: false, status: None }),
            ended: Condvar::new(),
        });
        let mut running = lock(&RUNNING);
        running.retain(|handle| handle.strong_count() > 0);
        running.push(Arc::downgrade(&handle));
        drop(running);
        let watched = Arc::clone(&handle);
        thread::spawn(move || watched.watch());
        handle
    }

    /// Waits for the process to end, and ends everything it leaves behind.
    fn watch(&self) {
        let killed = self.wait_for_end();
        let mut process = lock(&self.process);
        // The thread that reaped it has ended the rest too.
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

    /// Waits for the process, whose input is closed, to exit by itself; returns whether it did so in time.
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

    /// Ends the process and everything it started, at once.
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

    /// Ends the processes that a killed keeper left behind: this process is now their parent. Other children of a
    /// worker, started by hooks, are in the worker's own group.
    fn end_orphans(&self) {
        #[cfg(target_os = "linux")]
        if self.kept {
            let own: Vec<u32> = lock(&RUNNING).iter().filter_map(Weak::upgrade).map(|handle| handle.id).collect();
            crate::lifecycle::descendants::end_adopted(
                |id| own.contains(&id) || process_group::is_ours(id),
                Duration::ZERO,
            );
        }
    }

    /// Closes the input, unless a line is being written at the moment.
    fn try_close_input(&self) -> bool {
        match self.input.try_lock() {
            Ok(mut input) => {
                *input = None;
                true
            }
            Err(_) => false,
        }
    }

    /// Waits until the process has ended, and returns whether a signal ended it. The process is not reaped, so its id
    /// is not reused.
    #[cfg(unix)]
    fn wait_for_end(&self) -> bool {
        use rustix::io::Errno;
        use rustix::process::{Pid, WaitId, WaitIdOptions, waitid};

        let Some(id) = Pid::from_raw(self.id.cast_signed()) else { return true };
        loop {
            match waitid(WaitId::Pid(id), WaitIdOptions::EXITED | WaitIdOptions::NOWAIT) {
                Err(Errno::INTR) => {}
                Ok(Some(status)) => return !status.exited(),
                // It is reaped already.
                Ok(None) | Err(_) => return true,
            }
        }
    }

    /// The same by polling: the standard library has nothing better.
    #[cfg(not(unix))]
    fn wait_for_end(&self) -> bool {
        loop {
            let mut process = lock(&self.process);
            if process.status.is_some() || !matches!(process.child.try_wait(), Ok(None)) {
                return false;
            }
            drop(process);
            thread::sleep(Duration::from_millis(20));
        }
    }
}

/// A panic leaves no partial change in anything that is locked here.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
