//! A program: started without a shell in a process group of its own, and ended with everything it started.
//!
//! In every case its input is closed first, and it has [`END_LIMIT`] to exit by itself; a program without an input is
//! asked with `SIGTERM` instead. Everything that it leaves behind when it exits is ended at once, so no process holds
//! its output open, and the end of the output means the end of the program. On Linux its [keeper](super::keeper) does
//! this, even after the worker has ended.

use std::fmt::Write as _;
use std::io::{self, Write};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, ChildStdout, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, Weak};
use std::thread;
use std::time::Duration;

#[cfg(target_os = "linux")]
use crate::keeper::Report;
use crate::limits::{END_LIMIT, NOT_FOUND, reason};
use crate::output::{OutputTail, Watch};
use crate::process_group;

/// How much longer a keeper may take to end everything that the program started, and then itself.
#[cfg(target_os = "linux")]
const KEEPER_LIMIT: Duration = Duration::from_secs(7);

/// The programs started by this process that may be alive.
static RUNNING: Mutex<Vec<Weak<Handle>>> = Mutex::new(Vec::new());

/// Set when a program in the background ends that was not asked to.
pub type Alarm = Arc<AtomicBool>;

/// A program that can be started.
#[derive(Debug, Clone)]
pub struct Program {
    /// A name on `PATH`, or a path relative to the folder.
    pub name: String,
    /// Its arguments.
    pub arguments: Vec<String>,
    /// The folder it runs in.
    pub folder: PathBuf,
    /// What is in its environment in addition to what it inherits.
    pub environment: Vec<(String, String)>,
    /// Whether this process is a runner, whose executable can be the keeper.
    #[cfg_attr(not(target_os = "linux"), expect(dead_code, reason = "only Linux has keepers"))]
    pub in_runner: bool,
}

impl Program {
    /// The program with its arguments, for messages.
    pub fn shown(&self) -> String {
        self.arguments.iter().fold(self.name.clone(), |mut shown, argument| {
            let plain = !argument.is_empty() && !argument.contains(|c: char| c.is_whitespace() || c.is_control());
            let written =
                if plain { write!(shown, " {argument}") } else { write!(shown, " \"{}\"", argument.escape_debug()) };
            written.expect("text grows as needed");
            shown
        })
    }

    /// Starts it, to be spoken to on its standard input and heard on its standard output.
    pub fn start(&self) -> Result<(Running, Input, ChildStdout), StartError> {
        let (mut child, keeper) = self.spawn(false)?;
        let input = child.stdin.take().expect("it is piped");
        let output = child.stdout.take().expect("it is piped");
        let stderr = OutputTail::capture(child.stderr.take().expect("it is piped"), "the simulator");
        let handle = Handle::new(child, Some(input), keeper.is_some(), None);
        Ok((Running { handle: Arc::clone(&handle), output: stderr, keeper }, Input(handle), output))
    }

    /// Starts it in the background: its standard input is empty, and all that it writes is logged. `watch` sees that
    /// too, and `alarm` is set if it ends unasked.
    pub(crate) fn start_in_background(&self, watch: &Watch, alarm: &Alarm) -> Result<Running, StartError> {
        let (mut child, keeper) = self.spawn(true)?;
        let output = OutputTail::capture_both(
            child.stdout.take().expect("it is piped"),
            child.stderr.take().expect("it is piped"),
            &format!("`{}`", self.shown()),
            watch,
        );
        // The keeper's input, whose end tells it to end the program.
        let input = child.stdin.take();
        let handle = Handle::new(child, input, keeper.is_some(), Some(Arc::clone(alarm)));
        Ok(Running { handle, output, keeper })
    }

    fn spawn(&self, background: bool) -> Result<(Child, Option<Report>), StartError> {
        let refused = |reason| StartError { command: self.shown(), folder: self.folder.clone(), reason };
        let failed = |error: &io::Error| refused(reason(error));
        if !self.folder.is_dir() {
            let reason = "there is no such folder; if the space has moved, run `sesamec generate` again";
            return Err(refused(reason.to_owned()));
        }
        // A worker runs in its own folder; the program runs in the folder of the space.
        let own_folder = std::env::current_dir().map_err(|error| failed(&error))?;
        let (mut command, keeper) = self.command(background).map_err(|error| failed(&error))?;
        process_group::own(&mut command);
        let input = if background && keeper.is_none() { Stdio::null() } else { Stdio::piped() };
        let child = command
            .current_dir(&self.folder)
            .env_remove("SESAME_WORKER_TOKEN")
            .env("SESAME_WORKER_FOLDER", own_folder)
            .envs(self.environment.iter().map(|(name, value)| (name, value)))
            .stdin(input)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(|error| failed(&error))?;
        Ok((child, keeper))
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
    fn command(&self, background: bool) -> io::Result<(Command, Option<Report>)> {
        if !self.in_runner {
            return Ok((plain(self), None));
        }
        // If the keeper is killed, this process becomes the parent of its children.
        crate::descendants::adopt_orphans();
        let report = Report::new()?;
        let mut command = super::keeper::command(&report, background);
        command.arg(self.path()).args(&self.arguments);
        Ok((command, Some(report)))
    }

    #[cfg(not(target_os = "linux"))]
    fn command(&self, _background: bool) -> io::Result<(Command, Option<Report>)> {
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
pub struct StartError {
    /// The program with its arguments.
    pub command: String,
    /// The folder it was to run in.
    pub folder: PathBuf,
    /// The reason, in words for the user.
    pub reason: String,
}

/// Ends all programs that this process started, with everything they started. It does the same as closing each of them,
/// but may be called from any thread, even while another one communicates with them.
pub fn end_programs() {
    let running: Vec<Arc<Handle>> = lock(&RUNNING).iter().filter_map(Weak::upgrade).collect();
    // All are asked first, so that the programs exit at the same time.
    let closed: Vec<bool> = running.iter().map(|handle| handle.ask_to_end()).collect();
    for (handle, closed) in running.iter().zip(closed) {
        if closed {
            handle.wait();
        }
        handle.end();
    }
}

/// A program's standard input. Dropping it closes the input.
pub struct Input(Arc<Handle>);

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
pub struct PostMortem {
    /// The way it ended, as a phrase.
    pub how: String,
    /// The last lines of its standard error; for a program in the background, of all that it wrote.
    pub last_lines: String,
    /// Whether it cannot have been started: the exit status says so by the convention of shells.
    pub not_found: bool,
    /// Whether it exited with status 0.
    pub success: bool,
    /// Whether it was killed by another process or the system.
    pub killed: bool,
}

/// A program that was started. Dropping it ends the program and everything it started. Close its input first; otherwise
/// the program has no time to exit by itself.
pub struct Running {
    handle: Arc<Handle>,
    output: OutputTail,
    #[cfg_attr(not(target_os = "linux"), expect(dead_code, reason = "only Linux has keepers"))]
    keeper: Option<Report>,
}

impl Running {
    /// How a program ended that has closed its output. Its input must be closed.
    pub fn post_mortem(mut self) -> PostMortem {
        let in_time = self.handle.wait();
        let status = self.handle.end();
        let status = self.ended_by_itself(status.filter(|_| in_time));
        let how = match status {
            Some(status) => format!("ended ({status})"),
            None => "closed its standard output, but did not exit,".to_owned(),
        };
        PostMortem {
            how,
            last_lines: self.output.last_lines(),
            not_found: status.and_then(|status| status.code()) == Some(NOT_FOUND),
            success: status.is_some_and(|status| status.success()),
            killed: status.is_some_and(process_group::was_killed),
        }
    }

    /// A new test begins: forgets everything written so far.
    pub fn clear_output(&mut self) {
        self.output.clear();
    }

    /// The last lines of a program that is running.
    pub fn last_lines_so_far(&self) -> String {
        self.output.last_lines_so_far()
    }

    /// Whether it has ended, with everything that it left behind.
    pub fn has_ended(&self) -> bool {
        lock(&self.handle.process).ended
    }

    /// Waits at most this long until it has ended; whether it has.
    pub fn wait_for_end(&self, limit: Duration) -> bool {
        self.handle.wait_for(limit)
    }

    /// Its end is expected from now on: it sets no alarm.
    pub fn expect_end(&self) {
        self.handle.asked.store(true, Ordering::Relaxed);
    }

    /// Asks it to end: closes its input, or sends `SIGTERM` to a program in the background. Dropping it then waits.
    pub fn ask_to_end(&self) {
        self.handle.ask_to_end();
    }

    /// The process of the program, or of its keeper, and whether it is the keeper's.
    #[cfg(target_os = "linux")]
    pub fn process(&self) -> (u32, bool) {
        (self.handle.id, self.handle.kept)
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
        if self.handle.is_asked() {
            self.handle.wait();
        }
        self.handle.end();
    }
}

/// A process, or its keeper, shared between threads.
struct Handle {
    id: u32,
    kept: bool,
    /// Set if a program in the background, which has no input of its own, ends unasked.
    alarm: Option<Alarm>,
    /// A program in the background was asked to end.
    asked: AtomicBool,
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
    fn new(child: Child, input: Option<ChildStdin>, kept: bool, alarm: Option<Alarm>) -> Arc<Handle> {
        let handle = Arc::new(Handle {
            id: child.id(),
            kept,
            alarm,
            asked: AtomicBool::new(false),
            input: Mutex::new(input),
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
        if let Some(alarm) = self.alarm.as_ref().filter(|_| !self.asked.load(Ordering::Relaxed)) {
            alarm.store(true, Ordering::Relaxed);
        }
        self.ended.notify_all();
    }

    /// Waits for the process, whose input is closed, to exit by itself; returns whether it did so in time.
    fn wait(&self) -> bool {
        self.wait_for(self.limit())
    }

    fn wait_for(&self, limit: Duration) -> bool {
        let process = lock(&self.process);
        let running = |process: &mut Process| !process.ended && process.status.is_none();
        let waited = self.ended.wait_timeout_while(process, limit, running);
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
            crate::descendants::end_adopted(|id| own.contains(&id) || process_group::is_ours(id), Duration::ZERO);
        }
    }

    /// Closes the input, unless a line is being written at the moment; whether it did. A program in the background that
    /// has no keeper gets a signal in its place.
    fn ask_to_end(&self) -> bool {
        match self.input.try_lock() {
            Ok(mut input) => *input = None,
            Err(_) => return false,
        }
        if self.alarm.is_some() && !self.asked.swap(true, Ordering::Relaxed) && !self.kept {
            let mut process = lock(&self.process);
            if !process.ended && process.status.is_none() {
                process_group::ask_to_end(&mut process.child);
            }
        }
        true
    }

    fn is_asked(&self) -> bool {
        if self.alarm.is_some() { self.asked.load(Ordering::Relaxed) } else { lock(&self.input).is_none() }
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
