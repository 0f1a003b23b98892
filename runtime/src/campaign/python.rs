//! Hooks in Python: which Python imports them, and what they are, before anything runs.
//!
//! Workers with such hooks are processes of Python, `python3 -m sesamec worker …`, or forks of a session of Python.
//! Each is first asked once, by `examine`: it reads the runner as JSON on its standard input, imports the
//! hooks, and answers in JSON. So what is wrong with them is known before a test runs, and is said once.

use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use serde::Deserialize;

#[cfg(target_os = "linux")]
use crate::campaign::fork_server::ForkServer;
use crate::interpreted::Interpreted;

/// The environment variable that names the Python of workers.
const PYTHON: &str = "SESAMEC_PYTHON";

/// How long hooks may take to be imported.
const IMPORT_LIMIT: Duration = Duration::from_secs(60);

/// Hooks in Python that were imported once.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Examined {
    /// The Python that imported them; empty if workers are forked.
    pub(crate) python: PathBuf,
    /// The file that registers them, in the folder of the space.
    pub(crate) file: Option<String>,
    /// The metrics and operations of the campaign that have their hooks in Python.
    pub(crate) registered: Vec<String>,
    /// Metrics of the campaign whose hooks are not filled in yet.
    pub(crate) unfilled_metrics: Vec<String>,
    /// Operations of the campaign whose hooks are not filled in yet.
    pub(crate) unfilled_operations: Vec<String>,
}

/// What Python answers.
#[derive(Debug, Deserialize)]
struct Answer {
    version: String,
    /// What is wrong with the hooks, for people.
    #[serde(default)]
    problem: Option<String>,
    #[serde(default)]
    registered: Vec<String>,
    /// Those that have no hook in Python, each with what it is of.
    #[serde(default)]
    missing: Vec<(String, String)>,
    #[serde(default)]
    unfilled_metrics: Vec<String>,
    #[serde(default)]
    unfilled_operations: Vec<String>,
}

/// Imports the hooks of a runner: all that its campaign calls have to be there. The error says what is wrong.
pub(crate) fn examine(runner: &Interpreted) -> io::Result<Examined> {
    let hooks = runner.hooks.clone().unwrap_or_default();
    let (examined, missing) = imported(runner)?;
    let in_rust = |name: &str| hooks.in_rust.iter().find(|(hook, _)| hook == name).map(|(_, file)| file);
    let here = hooks.file.as_deref().unwrap_or("this process");
    let quoted = |names: &[&str]| names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    if let Some((name, file)) = examined.registered.iter().find_map(|name| Some((name, in_rust(name)?))) {
        return Err(io::Error::other(format!(
            "`{name}` has a hook in Python, in {here}, and another in Rust, in {file}: remove one of them"
        )));
    }
    let Some((first, what)) = missing.first() else { return Ok(examined) };
    let elsewhere: Vec<String> =
        missing.iter().filter_map(|(name, _)| Some(format!("`{name}` in {}", in_rust(name)?))).collect();
    if elsewhere.is_empty() {
        let names: Vec<&str> = missing.iter().map(|(name, _)| name.as_str()).collect();
        let which = if names.len() == 1 { format!("{what} `{first}` has") } else { format!("{} have", quoted(&names)) };
        let there = match &hooks.file {
            Some(file) => format!("register it in {file}; `sesamec generate --python` shows a stub of it"),
            None => "register it before the campaign runs".to_owned(),
        };
        return Err(io::Error::other(format!("{which} no hook in Python: {there}")));
    }
    let in_python: Vec<&str> = examined.registered.iter().map(String::as_str).collect();
    let in_python = if in_python.is_empty() { "no others".to_owned() } else { quoted(&in_python) };
    Err(io::Error::other(format!(
        "the hooks of one campaign are either all in Rust or all in Python: Rust has {}, and {here} has {in_python}; write \
         those of Rust in Python, or the others in Rust",
        elsewhere.join(", ")
    )))
}

/// The metrics and operations of a campaign that have hooks in Python, whatever is missing.
pub(crate) fn registered(runner: &Interpreted) -> io::Result<Vec<String>> {
    imported(runner).map(|(examined, _)| examined.registered)
}

fn imported(runner: &Interpreted) -> io::Result<(Examined, Vec<(String, String)>)> {
    let text = serde_json::to_vec(runner)?;
    #[cfg(target_os = "linux")]
    if let Some(server) = ForkServer::of_this_process() {
        let answer = asked_of_fork(&server, &text)?;
        return concluded(runner, PathBuf::new(), answer);
    }
    let mut refusals = Vec::new();
    for python in candidates() {
        match asked(&python, &text)? {
            Ok(answer) if answer.version == env!("CARGO_PKG_VERSION") => return concluded(runner, python, answer),
            Ok(answer) => refusals.push(format!("{} has version {}", python.display(), answer.version)),
            Err(reason) => refusals.push(format!("{}: {reason}", python.display())),
        }
    }
    Err(io::Error::other(format!(
        "hooks in Python need the Python package `sesamec` in version {0}: `pip install sesamec=={0}` installs it, and \
         {PYTHON} names a Python that has it; asked: {1}",
        env!("CARGO_PKG_VERSION"),
        refusals.join("; ")
    )))
}

fn concluded(runner: &Interpreted, python: PathBuf, answer: Answer) -> io::Result<(Examined, Vec<(String, String)>)> {
    let Answer { problem, registered, missing, unfilled_metrics, unfilled_operations, version: _ } = answer;
    if let Some(problem) = problem {
        return Err(io::Error::other(problem));
    }
    let file = runner.hooks.as_ref().and_then(|hooks| hooks.file.clone());
    Ok((Examined { python, file, registered, unfilled_metrics, unfilled_operations }, missing))
}

/// The Pythons that may have the package: the one that the user names, else that of simulators, else the one beside
/// this program, which `pip` installs there.
fn candidates() -> Vec<PathBuf> {
    if let Some(named) = std::env::var_os(PYTHON).filter(|named| !named.is_empty()) {
        return vec![settled(PathBuf::from(named))];
    }
    let name = if cfg!(windows) { "python.exe" } else { "python3" };
    let on_path = std::env::var_os("PATH").and_then(|path| {
        let folders = std::env::split_paths(&path).map(|folder| folder.join(name));
        folders.into_iter().find(|file| file.is_file()).map(settled)
    });
    let beside = std::env::current_exe().ok().map(|program| program.with_file_name(name));
    let mut found: Vec<PathBuf> = on_path.into_iter().chain(beside.filter(|file| file.is_file())).collect();
    found.dedup();
    if found.is_empty() { vec![PathBuf::from(name)] } else { found }
}

/// A program that is given by its path, as seen from any folder.
fn settled(program: PathBuf) -> PathBuf {
    let is_path = program.components().count() > 1;
    std::path::absolute(&program).ok().filter(|_| is_path).unwrap_or(program)
}

/// What Python does as `python3 -m sesamec`, but that it imports nothing from the folder that it is started in.
const MODULE: &str = "import sys; sys.path = [folder for folder in sys.path if folder]; \
                      from sesamec.__main__ import main; sys.exit(main(sys.argv[1:]))";

/// A Python that runs the package.
pub(crate) fn command(python: &Path) -> Command {
    let mut command = Command::new(python);
    command.args(["-c", MODULE]);
    command
}

/// Asks a Python; the inner error says why it cannot answer.
fn asked(python: &Path, text: &[u8]) -> io::Result<Result<Answer, String>> {
    let mut command = command(python);
    command.arg("examine").stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = match command.spawn() {
        Ok(child) => child,
        Err(error) => return Ok(Err(error.to_string())),
    };
    let (mut input, mut output) = (child.stdin.take().expect("it is piped"), child.stdout.take().expect("it is piped"));
    let mut errors = child.stderr.take().expect("it is piped");
    let (answer, said, hangs) = thread::scope(|scope| {
        // One that cannot import the package ends without reading.
        scope.spawn(move || input.write_all(text).ok());
        let said = scope.spawn(move || read(&mut errors));
        let answer = scope.spawn(move || read(&mut output));
        let begun = Instant::now();
        while !answer.is_finished() && begun.elapsed() < IMPORT_LIMIT {
            thread::sleep(Duration::from_millis(2));
        }
        let hangs = !answer.is_finished();
        if hangs {
            child.kill().ok();
        }
        (answer.join().unwrap_or_default(), said.join().unwrap_or_default(), hangs)
    });
    child.wait()?;
    if let Ok(answer) = serde_json::from_slice(&answer) {
        // What the hooks print while they are imported.
        io::stderr().write_all(&said).ok();
        return Ok(Ok(answer));
    }
    let said = String::from_utf8_lossy(&said);
    let last = said.lines().rev().find(|line| !line.trim().is_empty());
    if hangs {
        return Err(late());
    }
    Ok(Err(last.unwrap_or("it ended without an answer").to_owned()))
}

fn late() -> io::Error {
    io::Error::other(format!("the hooks were not imported within {} s", IMPORT_LIMIT.as_secs()))
}

fn read(from: &mut impl Read) -> Vec<u8> {
    let mut text = Vec::new();
    // An answer that cannot be read to its end is not understood either.
    from.read_to_end(&mut text).ok();
    text
}

/// Asks a process that forks, by a fork of it.
#[cfg(target_os = "linux")]
fn asked_of_fork(server: &std::sync::Arc<ForkServer>, text: &[u8]) -> io::Result<Answer> {
    use std::net::Shutdown;
    use std::os::unix::net::UnixStream;

    let (mut ours, theirs) = UnixStream::pair()?;
    let mut command = Command::new("sesamec");
    command.arg("examine");
    let output = std::fs::File::options().write(true).open("/dev/null")?;
    let forked = server.fork(&command, Path::new("."), 0, &theirs.into(), &output)?;
    ours.set_read_timeout(Some(IMPORT_LIMIT))?;
    let mut answer = Vec::new();
    let heard =
        ours.write_all(text).and_then(|()| ours.shutdown(Shutdown::Write)).and_then(|()| ours.read_to_end(&mut answer));
    forked.end();
    match heard {
        Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => {
            return Err(late());
        }
        heard => _ = heard?,
    }
    serde_json::from_slice(&answer)
        .map_err(|_| io::Error::other("the process with the hooks ended while it was asked for them"))
}
