//! Simulators in Python.

use std::io::{BufRead as _, BufReader};
use std::path::PathBuf;
use std::process::{Command, Stdio};

use sesame_peers::Ended;

/// The Python of the peers. Without one it prints that the test is skipped; with `CI=true` that is an error.
pub(crate) fn python() -> Option<PathBuf> {
    sesame_peers::named("SESAME_SIMLOG")
}

/// A simulator that listens.
pub(crate) struct Peer {
    _program: Ended,
    pub(crate) port: u16,
}

impl Peer {
    /// Starts one of the simulators; `None` without a Python for it.
    pub(crate) fn start(script: &str, arguments: &[&str]) -> Option<Peer> {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests");
        let mut child = Command::new(python()?)
            .arg(script)
            .args(arguments)
            .current_dir(folder)
            .stdout(Stdio::piped())
            .spawn()
            .expect("a Python that is named starts");
        let mut line = String::new();
        let mut output = BufReader::new(child.stdout.take().expect("it is piped"));
        output.read_line(&mut line).expect("it says its port");
        let port = line.trim().strip_prefix("port ").and_then(|port| port.parse().ok());
        Some(Peer {
            _program: Ended(child),
            port: port.unwrap_or_else(|| panic!("{script} says {line:?} in place of its port")),
        })
    }

    pub(crate) fn url(&self) -> String {
        format!("http://127.0.0.1:{}", self.port)
    }
}
