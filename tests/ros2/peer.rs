//! A program of `peers/` that takes part in a test.
//!
//! Peers say what has happened in lines of JSON, and tests wait for what was said: never for time alone.

use std::ffi::OsStr;
use std::io::{BufRead as _, BufReader, Write as _};
use std::os::unix::process::ExitStatusExt as _;
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::Value;
// How long a peer may take to say anything.
pub(crate) use sesame_patience::LIMIT;
use sesame_tests::workspace;

use crate::environment::Domain;

/// How long a peer that has said its result may take to leave.
const TO_LEAVE: Duration = Duration::from_secs(20);

/// Cyclone on this machine only: on the loopback interface, where it finds others without multicast.
const CYCLONE: &str = "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name=\"lo\"/></Interfaces></General>\
                       <Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>30\
                       </MaxAutoParticipantIndex><Peers><Peer address=\"localhost\"/></Peers></Discovery></Domain>\
                       </CycloneDDS>";

/// A running peer; it is ended when it is dropped.
pub(crate) struct Peer {
    name: String,
    child: Mutex<Child>,
    said: Arc<Said>,
    listening: Option<JoinHandle<()>>,
    /// How many probes it was told to send.
    probes: AtomicU64,
}

/// What a peer has said until now.
#[derive(Default)]
struct Said {
    lines: Mutex<Lines>,
    more: Condvar,
}

#[derive(Default)]
struct Lines {
    all: Vec<String>,
    /// Whether it says no more.
    ended: bool,
}

impl Lines {
    /// The latest value that was said under a name.
    fn latest(&self, key: &str) -> Option<Value> {
        self.all.iter().rev().find_map(|line| {
            let mut said: Value = serde_json::from_str(line).ok()?;
            said.get_mut(key).map(Value::take)
        })
    }
}

impl Peer {
    /// Starts a program of `peers/`.
    pub(crate) fn start(python: &Path, domain: &Domain, program: &str, arguments: &[&str]) -> Self {
        Peer::start_in(&workspace().join("tests/ros2/peers"), python, domain, program, arguments)
    }

    /// Starts a program of another folder, in it.
    pub(crate) fn start_in(
        folder: &Path,
        python: &Path,
        domain: &Domain,
        program: &str,
        arguments: &[impl AsRef<OsStr>],
    ) -> Self {
        let mut child = Command::new(python)
            .arg(folder.join(program))
            .args(arguments)
            .current_dir(folder)
            .env("ROS_DOMAIN_ID", domain.number.to_string())
            .env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
            .env("ROS_LOG_DIR", std::env::temp_dir().join("sesame_tests_ros2"))
            .env("CYCLONEDDS_URI", CYCLONE)
            // When a peer is killed, Fast DDS leaves half a megabyte of shared memory and the locks of its ports
            // behind. A runner speaks UDP anyway.
            .env("FASTDDS_BUILTIN_TRANSPORTS", "UDPv4")
            .env("PYTHONFAULTHANDLER", "1")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap_or_else(|error| panic!("{} does not start: {error}", python.display()));
        let output = child.stdout.take().expect("its output is a pipe");
        let said = Arc::<Said>::default();
        let hears = Arc::clone(&said);
        let listening = std::thread::spawn(move || listen(output, &hears));
        Peer {
            name: program.to_owned(),
            child: Mutex::new(child),
            said,
            listening: Some(listening),
            probes: AtomicU64::new(0),
        }
    }

    /// Tells one that waits for it to begin, or to go on.
    pub(crate) fn go(&self) {
        self.tell("go");
    }

    /// Tells a publisher to send a probe: its number.
    pub(crate) fn probe(&self) -> u64 {
        self.tell("probe");
        self.probes.fetch_add(1, Ordering::Relaxed) + 1
    }

    /// Waits until nobody subscribes to what it publishes.
    pub(crate) fn await_alone(&self) {
        self.tell("alone");
        self.await_said("alone");
    }

    fn tell(&self, line: &str) {
        let mut child = lock(&self.child);
        let input = child.stdin.as_mut().expect("its input is a pipe");
        // One that has given up is noticed by what it says.
        let _ = writeln!(input, "{line}").and_then(|()| input.flush());
    }

    /// The latest number that it has said under a name, and zero before.
    pub(crate) fn told(&self, key: &str) -> u64 {
        lock(&self.said.lines).latest(key).and_then(|value| value.as_u64()).unwrap_or_default()
    }

    /// Waits until it has said something under this name.
    #[track_caller]
    pub(crate) fn await_said(&self, key: &str) -> Value {
        let lines = lock(&self.said.lines);
        let missing = |lines: &mut Lines| lines.latest(key).is_none() && !lines.ended;
        let waited = self.said.more.wait_timeout_while(lines, LIMIT, missing);
        let (lines, _) = waited.unwrap_or_else(PoisonError::into_inner);
        let found = lines.latest(key);
        found.unwrap_or_else(|| panic!("{} was awaited to say `{key}`, and said {:?}", self.name, lines.all))
    }

    /// Waits until it is matched with somebody.
    pub(crate) fn await_match(&self) {
        self.await_said("matched");
    }

    /// Waits until its publishers and subscribers are there.
    pub(crate) fn await_up(&self) {
        self.await_said("up");
    }

    /// Whether it has done its part: it has said its result, or has ended by itself.
    pub(crate) fn is_done(&self) -> bool {
        self.code().is_some() || self.has_ended()
    }

    /// The exit code that it said together with its result.
    fn code(&self) -> Option<i32> {
        let said = lock(&self.said.lines).latest("code")?;
        said.as_i64().and_then(|code| i32::try_from(code).ok())
    }

    fn has_ended(&self) -> bool {
        lock(&self.child).try_wait().expect("a child can be asked").is_some()
    }

    /// Closes its input, which those that stay wait for, and waits for its end: its exit code, and what it said. One
    /// that has said its result and then hangs is ended: Fast DDS may block while it takes a node down.
    #[track_caller]
    fn wait(&mut self) -> (Option<i32>, Vec<String>) {
        drop(lock(&self.child).stdin.take());
        let mut done = None;
        let ended = sesame_patience::comes(|| {
            let since = self.code().map(|_| *done.get_or_insert_with(Instant::now));
            self.has_ended() || since.is_some_and(|since| since.elapsed() > TO_LEAVE)
        });
        assert!(ended, "{} does not end, and said {:?}", self.name, lock(&self.said.lines).all);
        if !self.has_ended() {
            eprintln!("{} has said its result, and does not leave", self.name);
            let _ = lock(&self.child).kill();
        }
        if let Some(listening) = self.listening.take() {
            let _ = listening.join();
        }
        let said = self.code();
        let status = lock(&self.child).wait().expect("a child can be awaited");
        let code = if status.signal() == Some(Signal::SIGKILL as i32) { said } else { status.code() };
        (code, std::mem::take(&mut lock(&self.said.lines).all))
    }

    /// Waits for its end: all that it said.
    pub(crate) fn text(mut self) -> String {
        let (code, said) = self.wait();
        assert_eq!(code, Some(0), "{}", self.name);
        said.join("\n")
    }

    /// Waits for its end: its exit code, and the JSON that it said last.
    pub(crate) fn end(mut self) -> (Option<i32>, Value) {
        let (code, said) = self.wait();
        let last = said.last().map_or("", String::as_str);
        let last = serde_json::from_str(last).unwrap_or_else(|_| panic!("{}: {code:?}: {said:?}", self.name));
        (code, last)
    }

    /// Waits for its end, which is a good one.
    #[track_caller]
    pub(crate) fn expect(self) -> Value {
        let name = self.name.clone();
        let (code, said) = self.end();
        assert_eq!(code, Some(0), "{name}: {said}");
        said
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        if !self.has_ended() {
            let mut child = lock(&self.child);
            // In a test that fails its Python writes to the standard error where each of its threads is.
            let signal = if std::thread::panicking() { Signal::SIGABRT } else { Signal::SIGKILL };
            let _ = kill(Pid::from_raw(child.id().cast_signed()), signal);
            let _ = child.wait();
        }
    }
}

fn lock<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Keeps each line. What came until a reader or writer failed is enough.
fn listen(output: ChildStdout, said: &Said) {
    for line in BufReader::new(output).lines().map_while(Result::ok) {
        lock(&said.lines).all.push(line);
        said.more.notify_all();
    }
    lock(&said.lines).ended = true;
    said.more.notify_all();
}
