//! How tests reach programs that others wrote: where they are, what they print, and their end.
//!
//! `./test` finds or makes the peers, and names each by an environment variable; CONTRIBUTING.md lists them.

pub mod oracle;

use std::io::{BufRead as _, BufReader, Read};
use std::path::PathBuf;
use std::process::{Child, Command};
use std::sync::mpsc::{Receiver, channel};

/// The program or folder that an environment variable names. Without the variable the test is to be skipped, which is
/// printed here; with `CI=true` that is an error. What is named has to exist.
#[track_caller]
pub fn named(variable: &str) -> Option<PathBuf> {
    let named = std::env::var_os(variable).map(PathBuf::from);
    let Some(path) = named else {
        skip(&format!("{variable} is not set; `./test` finds or makes what it names"));
        return None;
    };
    assert!(path.exists(), "{variable} names {}, which does not exist", path.display());
    Some(path)
}

/// The first of these programs that the system has, which succeeds with these arguments. Without any the test is to be
/// skipped, which is printed here; with `CI=true` that is an error.
#[track_caller]
pub fn installed(programs: &[&'static str], arguments: &[&str]) -> Option<&'static str> {
    let succeeds =
        |program: &str| Command::new(program).args(arguments).output().is_ok_and(|said| said.status.success());
    let found = programs.iter().copied().find(|program| succeeds(program));
    if found.is_none() {
        skip(&format!("{} is not installed, or fails with {arguments:?}", programs.join(" or ")));
    }
    found
}

/// Whether this user may do what a command does, here called `what`; see [`installed`].
#[track_caller]
pub fn permitted(what: &str, command: &mut Command) -> Option<()> {
    let succeeds = command.output().is_ok_and(|said| said.status.success());
    if !succeeds {
        skip(&format!("this user may not make {what}"));
    }
    succeeds.then_some(())
}

/// Whether the system has `python3`; see [`installed`].
#[track_caller]
pub fn has_python3() -> bool {
    installed(&["python3"], &["--version"]).is_some()
}

/// Says why a test is skipped; fails with `CI=true`.
#[track_caller]
fn skip(reason: &str) {
    let insists = std::env::var_os("CI").is_some_and(|ci| ci == "true");
    assert!(!insists, "{reason}");
    eprintln!("skipped: {reason}");
}

/// A program that is ended when this is dropped.
#[derive(Debug)]
pub struct Ended(pub Child);

impl Drop for Ended {
    fn drop(&mut self) {
        // It may have ended by itself.
        self.0.kill().ok();
        self.0.wait().ok();
    }
}

/// The lines that a program writes, read on a thread of their own until the program closes its output or nobody wants
/// them any more.
pub fn lines(output: impl Read + Send + 'static) -> Receiver<String> {
    let (sender, lines) = channel();
    let output = BufReader::new(output);
    std::thread::spawn(move || output.lines().map_while(Result::ok).try_for_each(|line| sender.send(line)));
    lines
}
