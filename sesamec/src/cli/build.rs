//! Building a runner by cargo.

use std::io::{BufRead as _, BufReader, Read as _};
use std::path::{Path, PathBuf};
use std::process::{ChildStdout, Command, Stdio};
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::time::{Duration, Instant};

use anyhow::{Context as _, bail};
use sesame_codegen::plan::RunnerPlan;
use sesame_runtime::cli::RUNNER;

use super::progress::{CargoMessage, Crates, Metadata};
use super::shell::Shell;

/// How often the line of a terminal is written again.
const TICK: Duration = Duration::from_millis(250);

/// How often progress is shown where each time takes a line of its own.
const LINE_EVERY: Duration = Duration::from_secs(5);

/// A build that takes longer is worth counting its crates.
const SHORT: Duration = Duration::from_secs(1);

/// What the first build of a runner takes; later ones compile only the runner's own crate.
const COST: &str = "about five minutes of processor, and 1 GB on the disk";

/// What becomes known while cargo builds.
enum Event {
    /// Cargo says something.
    Said(CargoMessage),
    /// Which crates there are.
    Crates(Metadata),
    /// What cargo says can no longer be read: it has ended, or for this reason.
    End(std::io::Result<()>),
}

/// Builds the runner in a folder and returns its program. Shows progress; what rustc has to say of the user's hooks is
/// passed on.
pub(super) fn build(shell: Shell, folder: &Path, campaign: &str) -> anyhow::Result<PathBuf> {
    let start = Instant::now();
    let mut cargo = cargo(folder)
        .env(RUNNER, folder.canonicalize().unwrap_or_else(|_| folder.to_owned()))
        .args(["build", "--quiet", "--message-format=json-render-diagnostics"])
        .args(["--color", if shell.colour() { "always" } else { "never" }])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .context("cannot start `cargo` to build the runner")?;
    let mut errors = cargo.stderr.take().expect("it is piped");
    let errors = std::thread::spawn(move || {
        let mut text = Vec::new();
        errors.read_to_end(&mut text).map(|_| text)
    });
    let (sender, events) = mpsc::channel();
    let output = cargo.stdout.take().expect("it is piped");
    std::thread::spawn({
        let sender = sender.clone();
        move || pass_on(output, &sender)
    });

    let every = if shell.rewrites() { TICK } else { LINE_EVERY };
    let mut next = every;
    let mut counted = false;
    let mut crates = Crates::default();
    let mut program = None;
    loop {
        match events.recv_timeout(TICK) {
            Ok(Event::Said(message)) => {
                crates.hear(&message);
                program = message.executable.or(program);
            }
            Ok(Event::Crates(metadata)) => crates.expect(metadata),
            Ok(Event::End(read)) => break read.context("cannot read what cargo says")?,
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => unreachable!("this function holds a sender"),
        }
        let elapsed = start.elapsed();
        if elapsed >= SHORT && !counted {
            counted = true;
            count(folder, sender.clone());
        }
        if elapsed >= next {
            shell.doing("Building", crates.line(campaign, elapsed));
            next = elapsed + every;
        }
    }
    let status = cargo.wait().context("cannot wait for cargo")?;
    let said = errors.join().expect("reading does not panic").context("cannot read the output of cargo")?;
    let said = String::from_utf8_lossy(&said);
    if !said.trim().is_empty() {
        shell.text(&said);
    }
    match program {
        Some(program) if status.success() => {
            shell.did("Built", format!("{campaign} in {:.1} s", start.elapsed().as_secs_f64()));
            Ok(program)
        }
        _ => bail!("cannot build the runner in {}; see the errors above", folder.display()),
    }
}

/// Insists that there is a cargo to build the runner of a campaign, before anything is generated or filled in for it.
pub(super) fn check_cargo(runner: &RunnerPlan) -> anyhow::Result<()> {
    let name = Path::new("cargo").with_extension(std::env::consts::EXE_EXTENSION);
    let path = std::env::var_os("PATH").unwrap_or_default();
    if std::env::split_paths(&path).any(|folder| folder.join(&name).is_file()) {
        return Ok(());
    }
    let parts = runner.parts_in_rust();
    let (why, instead) = match &parts[..] {
        [] => (String::new(), ""),
        [one] => (format!(": {one} is in Rust"), "\n  or write it in Python, for which nothing is compiled"),
        [others @ .., last] => {
            let why = format!(": {} and {last} are in Rust", others.join(", "));
            (why, "\n  or write them in Python, for which nothing is compiled")
        }
    };
    bail!(
        "the runner of campaign `{}` has to be compiled{why}, and there is no `cargo` on PATH\n  install Rust from \
         https://rustup.rs, and a C compiler: about 1 GB; the first build then takes {COST}{instead}",
        runner.plan.campaign.name,
    )
}

/// Cargo, in the folder of a runner: it reads the settings of the folder it runs in, and there the runners' common
/// target folder is named.
fn cargo(folder: &Path) -> Command {
    let mut cargo = Command::new("cargo");
    cargo.current_dir(folder).stdin(Stdio::null());
    cargo
}

/// Passes on what cargo says, to its end.
fn pass_on(output: ChildStdout, events: &Sender<Event>) {
    let mut end = Ok(());
    for line in BufReader::new(output).lines() {
        match line {
            // Other lines are what build scripts print.
            Ok(line) => {
                if let Ok(message) = serde_json::from_str(&line)
                    && events.send(Event::Said(message)).is_err()
                {
                    break;
                }
            }
            Err(error) => {
                end = Err(error);
                break;
            }
        }
    }
    // The other side may have ended already.
    let _ = events.send(Event::End(end));
}

/// Finds out which crates a build takes, beside the build. Without an answer progress is shown without a total: what is
/// wrong with the manifest the build itself reports.
fn count(folder: &Path, events: Sender<Event>) {
    let mut version = cargo(folder);
    version.args(["--version", "--verbose"]);
    let mut metadata = cargo(folder);
    metadata.args(["metadata", "--format-version", "1", "--quiet"]);
    std::thread::spawn(move || {
        let output = |command: &mut Command| {
            let output = command.stderr(Stdio::null()).output().ok().filter(|output| output.status.success())?;
            String::from_utf8(output.stdout).ok()
        };
        let version = output(&mut version)?;
        // Without the platform there would be crates of other systems.
        let host = version.lines().find_map(|line| line.strip_prefix("host: "))?;
        let metadata = output(metadata.args(["--filter-platform", host]))?;
        events.send(Event::Crates(serde_json::from_str(&metadata).ok()?)).ok()
    });
}
