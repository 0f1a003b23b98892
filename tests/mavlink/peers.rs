//! A vehicle and a ground station in Python.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::mpsc::Receiver;

use serde_json::Value;
use sesame_patience::LIMIT;
use sesame_peers::{Ended, lines};
use sesame_tests::workspace;

/// The Python with pymavlink. Without one the test is to be skipped.
pub(crate) fn python() -> Option<PathBuf> {
    sesame_peers::named("SESAME_MAVLINK")
}

/// The definitions that pymavlink brings.
pub(crate) fn common(python: &Path) -> PathBuf {
    let code = "import pymavlink, pathlib; print(pathlib.Path(pymavlink.__file__).parent)";
    let said = Command::new(python).args(["-c", code]).output().expect("Python starts");
    PathBuf::from(String::from_utf8_lossy(&said.stdout).trim()).join("dialects/v20/common.xml")
}

/// A peer, which is ended when it is dropped.
pub(crate) struct Peer {
    child: Ended,
    said: Receiver<String>,
    lines: Vec<Value>,
}

impl Peer {
    /// Starts `peer.py`, and waits until it is ready.
    pub(crate) fn start(python: &Path, arguments: &[&str]) -> Peer {
        let child = Command::new(python)
            .arg(workspace().join("tests/mavlink/peer.py"))
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn();
        let mut child = Ended(child.expect("Python starts"));
        let said = lines(child.0.stdout.take().expect("its output is a pipe"));
        let mut peer = Peer { child, said, lines: Vec::new() };
        let ready = peer.said.recv_timeout(LIMIT).unwrap_or_else(|_| panic!("{arguments:?} did not get ready"));
        assert!(ready.contains("ready"), "{ready}");
        peer.lines.clear();
        peer
    }

    /// Tells a vehicle to begin.
    pub(crate) fn go(&mut self) {
        let input = self.child.0.stdin.as_mut().expect("its input is a pipe");
        input.write_all(b"\n").and_then(|()| input.flush()).expect("it listens");
    }

    /// All that it has said until now.
    pub(crate) fn lines(&mut self) -> &[Value] {
        while let Ok(line) = self.said.try_recv() {
            self.lines.push(serde_json::from_str(&line).unwrap_or_else(|_| panic!("{line}")));
        }
        &self.lines
    }

    /// The datagrams that it sent (`sent`) or heard (`came`), with when.
    pub(crate) fn datagrams(&mut self, which: &str) -> Vec<(String, f64)> {
        let of = |line: &Value| Some((line[which].as_str()?.to_owned(), line["at"].as_f64()?));
        self.lines().iter().filter_map(of).collect()
    }

    /// A field of the messages that it heard: those of this type, with the numbers of their frames.
    pub(crate) fn values(&mut self, ty: &str, field: &str) -> Vec<(f64, u64)> {
        let lines = self.lines().iter();
        let messages = lines.flat_map(|line| {
            let all = |key: &str| line[key].as_array().cloned().unwrap_or_default();
            all("types").into_iter().zip(all("values")).zip(all("sequence")).collect::<Vec<_>>()
        });
        let of_type = messages.filter(|((of, _), _)| of == ty);
        of_type.filter_map(|((_, values), number)| Some((values[field].as_f64()?, number.as_u64()?))).collect()
    }

    /// When a drone sent each of its positions, in seconds.
    pub(crate) fn numbers(&mut self) -> Vec<f64> {
        let numbered = self.lines().iter().filter(|line| line["number"].is_u64());
        numbered.map(|line| line["at"].as_f64().expect("it says when")).collect()
    }

    /// How many messages of a type it heard.
    pub(crate) fn count(&mut self, ty: &str) -> usize {
        let types = self.lines().iter().flat_map(|line| line["types"].as_array().cloned().unwrap_or_default());
        types.filter(|of| of == ty).count()
    }
}
