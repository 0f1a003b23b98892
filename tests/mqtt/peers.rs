//! Brokers and clients.

use std::fs;
use std::io::Write as _;
use std::net::{Ipv4Addr, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

use serde_json::Value;
// How long a client may take to say anything.
pub(crate) use sesame_patience::LIMIT;
use sesame_peers::{Ended, lines, named};
use sesame_tests::{Port, workspace};

/// The folder of the peers' packages. Without one it prints that the test is skipped; with `CI=true` that is an error.
pub(crate) fn packages() -> Option<PathBuf> {
    beside_mosquitto("SESAME_MQTT")
}

/// A Python with a client of MQTT, as [`packages`].
pub(crate) fn python() -> Option<PathBuf> {
    beside_mosquitto("SESAME_PAHO")
}

/// What a variable names, if there is a broker, too.
fn beside_mosquitto(variable: &str) -> Option<PathBuf> {
    let found = named(variable)?;
    let has_broker = Command::new("mosquitto").arg("-h").stdout(Stdio::null()).status().is_ok();
    let insists = std::env::var("CI").is_ok_and(|ci| ci == "true");
    assert!(has_broker || !insists, "mosquitto is not installed");
    if !has_broker {
        eprintln!("skipped: mosquitto is not installed");
        return None;
    }
    Some(found)
}

/// A broker, which is ended when it is dropped.
pub(crate) struct Broker {
    pub(crate) port: u16,
    held: Port,
    // Ended before somebody else may have its port.
    child: Option<Ended>,
    settings: PathBuf,
}

impl Broker {
    /// One for everybody on this machine.
    pub(crate) fn start(folder: &Path) -> Broker {
        Broker::with(folder, "allow_anonymous true\n")
    }

    /// One with these settings.
    pub(crate) fn with(folder: &Path, settings: &str) -> Broker {
        let held = Port::free();
        let port = held.number();
        let file = folder.join(format!("mosquitto-{port}.conf"));
        // Without a limit on what waits, so that nothing is dropped for a slow client.
        let settings = format!("listener {port} 127.0.0.1\nmax_queued_messages 0\nuser root\n{settings}");
        fs::write(&file, settings).expect("settings can be written");
        let mut broker = Broker { port, held, child: None, settings: file };
        broker.begin();
        broker
    }

    /// Ends it and starts it again.
    pub(crate) fn restart(&mut self) {
        self.child = None;
        self.begin();
    }

    fn begin(&mut self) {
        let child = Command::new("mosquitto").arg("-c").arg(&self.settings).stderr(Stdio::null()).spawn();
        self.child = Some(Ended(child.expect("mosquitto starts")));
        let limit = Instant::now() + LIMIT;
        while TcpStream::connect((Ipv4Addr::LOCALHOST, self.held.number())).is_err() {
            assert!(Instant::now() < limit, "mosquitto does not listen");
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

/// A client in JavaScript, which is ended when it is dropped.
pub(crate) struct Client {
    child: Ended,
    said: Receiver<String>,
    /// How many messages it said that it has heard.
    count: u64,
    last: String,
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
        let said = lines(child.0.stdout.take().expect("its output is a pipe"));
        let ready = said.recv_timeout(LIMIT);
        assert_eq!(ready.as_deref(), Ok("ready"), "{arguments:?}");
        Client { child, said, count: 0, last: String::new() }
    }

    fn hear(&mut self, line: String) {
        let said: Option<Value> = serde_json::from_str(&line).ok();
        if let Some(count) = said.and_then(|said| said["count"].as_u64()) {
            self.count = count;
        }
        self.last = line;
    }

    /// How many messages it has said until now that it has heard.
    pub(crate) fn count(&mut self) -> u64 {
        while let Ok(line) = self.said.try_recv() {
            self.hear(line);
        }
        self.count
    }

    /// Tells a publisher to send the next ones.
    pub(crate) fn go(&mut self) {
        let input = self.child.0.stdin.as_mut().expect("its input is a pipe");
        // One that has sent all does not listen any more.
        let _ = input.write_all(b"\n").and_then(|()| input.flush());
    }

    /// Whether it has ended by itself.
    pub(crate) fn has_ended(&mut self) -> bool {
        self.child.0.try_wait().expect("a child can be asked").is_some()
    }

    /// What it said at its end.
    pub(crate) fn end(mut self) -> Value {
        while let Ok(line) = self.said.recv_timeout(LIMIT) {
            self.hear(line);
        }
        serde_json::from_str(&self.last).unwrap_or_else(|_| panic!("it ended without a word: {}", self.last))
    }
}
