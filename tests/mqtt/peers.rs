//! Brokers and clients.

use std::fs;
use std::io::{BufRead as _, BufReader, Write as _};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;
use sesame_tests::workspace;

/// The folder of the peers' packages. Without one the test is to be skipped, which is said here; with `CI=true` that is
/// an error.
pub(crate) fn packages() -> Option<PathBuf> {
    let packages = std::env::var_os("SESAME_MQTT").map(PathBuf::from).filter(|folder| folder.is_dir());
    let has_broker = Command::new("mosquitto").arg("-h").stdout(Stdio::null()).status().is_ok();
    let insists = std::env::var("CI").is_ok_and(|ci| ci == "true");
    assert!(packages.is_some() || !insists, "SESAME_MQTT names no folder: `./test` makes it with npm");
    assert!(has_broker || !insists, "mosquitto is not installed");
    if packages.is_none() || !has_broker {
        eprintln!("skipped: SESAME_MQTT names no folder, which `./test` makes with npm, or there is no mosquitto");
        return None;
    }
    packages
}

/// A port that nobody listens on.
pub(crate) fn free_port() -> u16 {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).expect("there is a free port");
    listener.local_addr().expect("it has an address").port()
}

/// A broker, which is ended when it is dropped.
pub(crate) struct Broker {
    pub(crate) port: u16,
    _child: Ended,
}

/// A program that is ended when it is dropped.
struct Ended(Child);

impl Drop for Ended {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Broker {
    /// One for everybody on this machine.
    pub(crate) fn start(folder: &Path) -> Broker {
        Broker::start_at(folder, free_port(), "allow_anonymous true\n")
    }

    /// One at a port, with these settings.
    pub(crate) fn start_at(folder: &Path, port: u16, settings: &str) -> Broker {
        let file = folder.join(format!("mosquitto-{port}.conf"));
        // Without a limit on what waits, so that nothing is dropped for a slow client.
        let settings = format!("listener {port} 127.0.0.1\nmax_queued_messages 0\nuser root\n{settings}");
        fs::write(&file, settings).expect("settings can be written");
        let child = Command::new("mosquitto").arg("-c").arg(&file).stderr(Stdio::null()).spawn();
        let child = Ended(child.expect("mosquitto starts"));
        let limit = Instant::now() + Duration::from_secs(20);
        while TcpStream::connect((Ipv4Addr::LOCALHOST, port)).is_err() {
            assert!(Instant::now() < limit, "mosquitto does not listen");
            std::thread::sleep(Duration::from_millis(20));
        }
        Broker { port, _child: child }
    }
}

/// A client in JavaScript, which is ended when it is dropped.
pub(crate) struct Client {
    child: Ended,
    said: BufReader<ChildStdout>,
}

impl Client {
    /// Starts `client.js`, and waits until it is ready.
    pub(crate) fn start(packages: &Path, arguments: &[&str]) -> Client {
        let child = Command::new("node")
            .arg(workspace().join("tests/mqtt/client.js"))
            .args(arguments)
            .env("NODE_PATH", packages.join("node_modules"))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn();
        let mut child = Ended(child.expect("node starts"));
        let said = BufReader::new(child.0.stdout.take().expect("its output is a pipe"));
        let mut client = Client { child, said };
        assert_eq!(client.line(), "ready");
        client
    }

    fn line(&mut self) -> String {
        let mut line = String::new();
        self.said.read_line(&mut line).expect("it speaks UTF-8");
        line.trim_end().to_owned()
    }

    /// Tells a publisher to begin.
    pub(crate) fn go(&mut self) {
        let input = self.child.0.stdin.as_mut().expect("its input is a pipe");
        input.write_all(b"\n").and_then(|()| input.flush()).expect("it listens");
    }

    /// Whether it has ended by itself.
    pub(crate) fn has_ended(&mut self) -> bool {
        self.child.0.try_wait().expect("a child can be asked").is_some()
    }

    /// What it said at its end.
    pub(crate) fn end(mut self) -> Value {
        let line = self.line();
        serde_json::from_str(&line).unwrap_or_else(|_| panic!("it ended without a word: {line}"))
    }
}
