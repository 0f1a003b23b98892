//! A program of `peers/` that takes part in a test.

use std::ffi::OsStr;
use std::io::{Read, Write};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::thread::JoinHandle;

use serde_json::Value;
use sesame_tests::workspace;

use crate::environment::Domain;

/// Cyclone on this machine only: on the loopback interface, where it finds others without multicast.
const CYCLONE: &str = "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name=\"lo\"/></Interfaces></General>\
                       <Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>30\
                       </MaxAutoParticipantIndex><Peers><Peer address=\"localhost\"/></Peers></Discovery></Domain>\
                       </CycloneDDS>";

/// A running peer; it is ended when it is dropped.
pub(crate) struct Peer {
    name: String,
    child: Child,
    output: Option<JoinHandle<String>>,
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
            .env("PYTHONDONTWRITEBYTECODE", "1")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap_or_else(|error| panic!("{} does not start: {error}", python.display()));
        let output = child.stdout.take().expect("its output is a pipe");
        let output = std::thread::spawn(move || whole(output));
        Peer { name: program.to_owned(), child, output: Some(output) }
    }

    /// Tells one that waits for it to begin.
    pub(crate) fn go(&mut self) {
        let input = self.child.stdin.as_mut().expect("its input is a pipe");
        // One that has given up is noticed by what it says.
        let _ = input.write_all(b"\n").and_then(|()| input.flush());
    }

    /// Whether it has ended by itself.
    pub(crate) fn has_ended(&mut self) -> bool {
        self.child.try_wait().expect("a child can be asked").is_some()
    }

    /// Waits for its end: all that it said.
    pub(crate) fn text(mut self) -> String {
        let status = self.child.wait().expect("a child can be awaited");
        assert!(status.success(), "{}: {status}", self.name);
        self.output.take().and_then(|output| output.join().ok()).unwrap_or_default()
    }

    /// Waits for its end: its exit code, and the JSON that it said last.
    pub(crate) fn end(mut self) -> (Option<i32>, Value) {
        let status = self.child.wait().expect("a child can be awaited");
        let said = self.output.take().and_then(|output| output.join().ok()).unwrap_or_default();
        let last = said.lines().last().unwrap_or_default();
        let said = serde_json::from_str(last).unwrap_or_else(|_| panic!("{}: {status}: {said}", self.name));
        (status.code(), said)
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
            let _ = self.child.kill();
            let _ = self.child.wait();
        }
    }
}

fn whole(mut output: ChildStdout) -> String {
    let mut text = String::new();
    // What came until a reader or writer failed is enough.
    let _ = output.read_to_string(&mut text);
    text
}
