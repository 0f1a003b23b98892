//! The simulator's process: started without a shell in a group of its own, and ended with all it started.

use std::collections::VecDeque;
use std::fmt::Write as _;
use std::io::{self, Read, Write};
use std::path::PathBuf;
use std::process::{Child, ChildStderr, ChildStdin, ChildStdout, Command, ExitStatus, Stdio};
use std::sync::mpsc;
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use crate::transport::TransportError;

/// How long a simulator whose input is closed may take to end by itself.
const END_LIMIT: Duration = Duration::from_secs(1);

/// How much of standard error is kept for error messages, in bytes and in lines.
const KEPT_BYTES: usize = 4096;
const KEPT_LINES: usize = 3;

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
    pub(super) fn start(&self) -> Result<(Running, ChildStdin, ChildStdout), TransportError> {
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
        let mut command = self.command();
        group::own(&mut command);
        let mut child = command
            .current_dir(&self.folder)
            .env_remove("SESAME_WORKER_TOKEN")
            .env("SESAME_WORKER_FOLDER", own_folder)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(|error| failed(&error))?;
        let stdin = child.stdin.take().expect("it is piped");
        let stdout = child.stdout.take().expect("it is piped");
        let words = LastWords::listen(child.stderr.take().expect("it is piped"));
        Ok((Running { child, words, ended: None }, stdin, stdout))
    }

    /// The program's path: what has a folder in it is relative to ours, everything else is looked up.
    fn path(&self) -> PathBuf {
        if self.name.contains(std::path::is_separator) {
            self.folder.join(&self.name)
        } else {
            PathBuf::from(&self.name)
        }
    }

    #[cfg(target_os = "linux")]
    fn command(&self) -> Command {
        if !self.in_runner {
            return plain(self);
        }
        // The runner becomes the simulator, after it has asked the system to end it with its worker. This is the
        // runner's own file even if another was put into its place meanwhile.
        let mut command = Command::new("/proc/self/exe");
        command.arg("simulator").arg(std::process::id().to_string()).arg("--").arg(self.path()).args(&self.arguments);
        command
    }

    #[cfg(not(target_os = "linux"))]
    fn command(&self) -> Command {
        plain(self)
    }
}

fn plain(program: &Program) -> Command {
    let mut command = Command::new(program.path());
    command.args(&program.arguments);
    command
}

fn reason(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "there is no such program; install it, or give its path".to_owned(),
        io::ErrorKind::PermissionDenied => format!("{error}; is it marked as executable?"),
        _ => error.to_string(),
    }
}

/// Becomes a simulator that ends when its worker does, even if the worker is killed while the simulator hangs. Only
/// returns if that fails; it is then said in the words of the protocol.
#[cfg(all(feature = "campaign", target_os = "linux"))]
pub(crate) fn become_simulator(
    worker: u32,
    program: &std::ffi::OsStr,
    arguments: &[std::ffi::OsString],
) -> std::process::ExitCode {
    use std::os::unix::process::CommandExt as _;

    use rustix::process::{Signal, getppid, set_parent_process_death_signal};

    let failed = |what: String| {
        let mut line = b"{\"failed\":".to_vec();
        crate::json::quoted(&what, &mut line);
        line.extend_from_slice(b"}\n");
        // Nobody is left to be told if this fails.
        io::stdout().write_all(&line).and_then(|()| io::stdout().flush()).ok();
        std::process::ExitCode::FAILURE
    };
    if let Err(error) = set_parent_process_death_signal(Some(Signal::KILL)) {
        return failed(format!("it cannot be made to end with its worker: {error}"));
    }
    // The worker may have gone before the system was asked.
    if getppid().is_none_or(|parent| parent.as_raw_pid().cast_unsigned() != worker) {
        return std::process::ExitCode::FAILURE;
    }
    let error = Command::new(program).args(arguments).exec();
    failed(format!("cannot start `{}`: {}", program.display(), reason(&error)))
}

/// A simulator's process. Dropping it ends the process and all that it started.
pub(super) struct Running {
    child: Child,
    words: LastWords,
    ended: Option<ExitStatus>,
}

impl Running {
    /// Waits a while for the process to end by itself, since its input is closed; then ends it.
    pub(super) fn close(mut self) {
        self.wait();
        self.end();
    }

    /// What became of a process that closed its output: a phrase, and the last lines of its standard error.
    pub(super) fn post_mortem(mut self) -> (String, String) {
        let ended = self.wait();
        self.end();
        let how = match self.ended.filter(|_| ended) {
            Some(status) => format!("ended ({status})"),
            None => "closed its standard output, but did not end,".to_owned(),
        };
        (how, self.words.take())
    }

    /// Forgets what was said on standard error so far.
    pub(super) fn forget_words(&mut self) {
        self.words.forget();
    }

    /// Whether it ended by itself, within a limit. It is not reaped: its id stays its own.
    fn wait(&mut self) -> bool {
        let started = Instant::now();
        let mut pause = Duration::from_micros(200);
        while started.elapsed() < END_LIMIT {
            if group::has_ended(&mut self.child) {
                return true;
            }
            thread::sleep(pause);
            pause = (pause * 2).min(Duration::from_millis(20));
        }
        false
    }

    fn end(&mut self) {
        if self.ended.is_none() {
            group::kill(&mut self.child);
            self.ended = self.child.wait().ok();
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.end();
    }
}

/// What a simulator says on standard error goes where the worker's goes; its last words are kept.
struct LastWords {
    kept: Arc<Mutex<VecDeque<u8>>>,
    end: mpsc::Receiver<()>,
}

impl LastWords {
    fn listen(mut from: ChildStderr) -> Self {
        let kept = Arc::new(Mutex::new(VecDeque::new()));
        let (sender, end) = mpsc::channel();
        let keep = Arc::clone(&kept);
        thread::spawn(move || {
            // Dropped at the end of the stream, which is what the receiver waits for.
            let _sender: mpsc::Sender<()> = sender;
            let mut buffer = [0; 4096];
            loop {
                match from.read(&mut buffer) {
                    Ok(0) => return,
                    Ok(count) => {
                        let said = &buffer[..count];
                        // A log that cannot be written is no reason to stop listening.
                        io::stderr().write_all(said).ok();
                        let Ok(mut kept) = keep.lock() else { return };
                        kept.extend(said);
                        let over = kept.len().saturating_sub(KEPT_BYTES);
                        kept.drain(..over);
                    }
                    Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                    Err(_) => return,
                }
            }
        });
        LastWords { kept, end }
    }

    fn forget(&self) {
        if let Ok(mut kept) = self.kept.lock() {
            kept.clear();
        }
    }

    /// The last lines, once the stream has ended; its process has.
    fn take(&self) -> String {
        self.end.recv_timeout(END_LIMIT).ok();
        let Ok(kept) = self.kept.lock() else { return String::new() };
        let bytes: Vec<u8> = kept.iter().copied().collect();
        let text = String::from_utf8_lossy(&bytes);
        let lines: Vec<&str> = text.lines().filter(|line| !line.trim().is_empty()).collect();
        lines[lines.len().saturating_sub(KEPT_LINES)..].join("\n")
    }
}

/// Processes with all that they started.
#[cfg(unix)]
mod group {
    use std::os::unix::process::CommandExt as _;
    use std::process::{Child, Command};

    use rustix::process::{Pid, Signal, WaitId, WaitIdOptions, kill_process_group, waitid};

    /// Lets the process begin a group of its own.
    pub(super) fn own(command: &mut Command) {
        command.process_group(0);
    }

    /// Whether the process has ended. It is not reaped, so that its id is given to no other.
    pub(super) fn has_ended(child: &mut Child) -> bool {
        let options = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
        matches!(waitid(WaitId::Pid(Pid::from_child(child)), options), Ok(Some(_)))
    }

    /// Ends the process and its group. It must not have been reaped.
    pub(super) fn kill(child: &mut Child) {
        // A group that has ended already is what was asked for.
        kill_process_group(Pid::from_child(child), Signal::KILL).ok();
    }
}

/// Processes alone: the standard library knows no more.
#[cfg(not(unix))]
mod group {
    use std::process::{Child, Command};

    pub(super) fn own(_: &mut Command) {}

    pub(super) fn has_ended(child: &mut Child) -> bool {
        matches!(child.try_wait(), Ok(Some(_)))
    }

    pub(super) fn kill(child: &mut Child) {
        child.kill().ok();
    }
}
