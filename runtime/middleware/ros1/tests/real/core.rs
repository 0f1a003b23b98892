//! A master of its own for each test, and programs at it.

use std::io::Write;
use std::net::{Ipv4Addr, TcpListener, TcpStream, UdpSocket};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::Value as Json;

/// How long anything may take: longer than it ever takes, on a machine that is busy too.
pub(crate) const LIMIT: Duration = Duration::from_secs(120);

/// The Python that has rospy. Without one it prints that the test is skipped.
pub(crate) fn python() -> Option<PathBuf> {
    sesame_peers::named("SESAME_ROS1")
}

/// A port for a master that no other test on this machine uses meanwhile.
struct Port {
    number: u16,
    /// The datagrams of the same port, which nobody wants: whoever has them has the port.
    _held: UdpSocket,
}

impl Port {
    /// One that nobody listens on. The ports lie below those that the system gives to whoever asks for any, so nobody
    /// takes it before the master does, or while the master is being started again. Each process looks from another one
    /// on: what has just been used may yet have a late visitor.
    fn free() -> Self {
        const FIRST: u16 = 15_000;
        const COUNT: usize = 2_000;
        let free = (0..COUNT).find_map(|at| {
            let number = FIRST + u16::try_from((at + std::process::id() as usize) % COUNT).unwrap();
            let held = UdpSocket::bind((Ipv4Addr::LOCALHOST, number)).ok()?;
            TcpListener::bind((Ipv4Addr::LOCALHOST, number)).is_ok().then_some(Port { number, _held: held })
        });
        free.expect("so many ports are enough for the tests of one machine")
    }
}

/// A master, which ends when it is dropped.
pub(crate) struct Core {
    python: PathBuf,
    port: Port,
    pub(crate) home: tempfile::TempDir,
    roscore: Option<Program>,
}

impl Core {
    /// A new one, if there is ROS 1.
    pub(crate) fn start() -> Option<Self> {
        let python = python()?;
        let home = tempfile::tempdir().unwrap();
        let mut core = Core { python, port: Port::free(), home, roscore: None };
        core.begin();
        Some(core)
    }

    /// Starts it again, on the same port.
    pub(crate) fn begin(&mut self) {
        self.begin_with("roscore", &[]);
    }

    /// Starts it again without what else `roscore` starts, which takes less time than a runner waits for a master.
    pub(crate) fn begin_alone(&mut self) {
        self.begin_with("rosmaster", &["--core"]);
    }

    fn begin_with(&mut self, program: &str, arguments: &[&str]) {
        let port = self.port().to_string();
        self.roscore = Some(self.tool(program, &[arguments, &["-p", &port]].concat()));
        let limit = Instant::now() + LIMIT;
        while TcpStream::connect((Ipv4Addr::LOCALHOST, self.port())).is_err() {
            assert!(Instant::now() < limit, "{program} does not start");
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    pub(crate) fn port(&self) -> u16 {
        self.port.number
    }

    /// Ends it.
    pub(crate) fn end(&mut self) {
        self.roscore = None;
    }

    pub(crate) fn uri(&self) -> String {
        format!("http://127.0.0.1:{}", self.port())
    }

    /// A tool of ROS.
    pub(crate) fn tool(&self, tool: &str, arguments: &[&str]) -> Program {
        self.program(Command::new(tool).args(arguments), tool)
    }

    /// A program of `tests/ros1/peers`.
    pub(crate) fn peer(&self, peer: &str, arguments: &[&str]) -> Program {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../tests/ros1/peers").join(peer);
        self.program(Command::new(&self.python).arg(script).args(arguments), peer)
    }

    /// The same, once it is ready.
    pub(crate) fn ready_peer(&self, peer: &str, arguments: &[&str]) -> Program {
        let mut program = self.peer(peer, arguments);
        assert_eq!(program.said()["ready"], true, "{peer}");
        program
    }

    fn program(&self, command: &mut Command, name: &str) -> Program {
        let own = |name: &str| self.home.path().join(name);
        command
            .current_dir(self.home.path())
            .env("ROS_MASTER_URI", self.uri())
            .env("ROS_IP", "127.0.0.1")
            .env_remove("ROS_HOSTNAME")
            .env("ROS_HOME", own("home"))
            .env("ROS_LOG_DIR", own("log"))
            .env("PYTHONUNBUFFERED", "1");
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let lines = sesame_peers::lines(child.stdout.take().unwrap());
        Program { name: name.to_owned(), child, lines }
    }
}

/// A running program; it is ended when it is dropped.
pub(crate) struct Program {
    name: String,
    child: Child,
    lines: Receiver<String>,
}

impl Program {
    /// Tells one that waits for it to go on.
    pub(crate) fn go(&mut self) {
        self.tell("go");
    }

    fn tell(&mut self, line: &str) {
        let input = self.child.stdin.as_mut().unwrap();
        writeln!(input, "{line}").and_then(|()| input.flush()).unwrap();
    }

    /// The next line.
    pub(crate) fn line(&mut self) -> String {
        self.line_if_any().unwrap_or_else(|| panic!("{} says no more", self.name))
    }

    /// The next line; `None` at its end.
    pub(crate) fn line_if_any(&mut self) -> Option<String> {
        self.lines.recv_timeout(LIMIT).ok()
    }

    /// A line that is there already.
    pub(crate) fn line_already(&mut self) -> Option<String> {
        self.lines.try_recv().ok()
    }

    /// The JSON of a line that is there already.
    pub(crate) fn said_already(&mut self) -> Option<Json> {
        self.line_already().map(|line| serde_json::from_str(&line).unwrap())
    }

    /// The JSON of the next line.
    pub(crate) fn said(&mut self) -> Json {
        let line = self.line();
        serde_json::from_str(&line).unwrap_or_else(|_| panic!("{}: {line}", self.name))
    }

    /// Waits until it has ended by itself.
    pub(crate) fn ended(mut self) {
        let limit = Instant::now() + LIMIT;
        while self.child.try_wait().unwrap().is_none() {
            assert!(Instant::now() < limit, "{} does not end", self.name);
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    /// Tells a publisher to stop.
    pub(crate) fn stop_publishing(&mut self) {
        self.tell("stop");
    }

    /// Tells a subscriber to end when it has heard the message of this number.
    pub(crate) fn end_after(&mut self, number: u64) {
        self.tell(&number.to_string());
    }

    /// Asks it to end, and waits until it has.
    pub(crate) fn end(mut self, signal: Signal) {
        self.stop(signal);
    }

    fn stop(&mut self, signal: Signal) {
        if self.child.try_wait().unwrap().is_some() {
            return;
        }
        let _ = kill(Pid::from_raw(self.child.id().cast_signed()), signal);
        let limit = Instant::now() + LIMIT / 2;
        while self.child.try_wait().unwrap().is_none() {
            if Instant::now() > limit {
                self.child.kill().unwrap();
                self.child.wait().unwrap();
                return;
            }
            std::thread::sleep(Duration::from_millis(10));
        }
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        // Tools of ROS end their own children when they are asked to end.
        self.stop(if self.name.starts_with("ros") { Signal::SIGINT } else { Signal::SIGKILL });
    }
}
