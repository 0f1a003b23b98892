//! Building a runner by cargo.

use std::io::{BufRead as _, BufReader, Read as _};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

use anyhow::{Context as _, bail};
use serde::Deserialize;

use super::shell::Shell;

/// What cargo says of each crate it has built.
#[derive(Deserialize)]
struct Message {
    reason: String,
    target: Option<Target>,
    executable: Option<PathBuf>,
}

#[derive(Deserialize)]
struct Target {
    name: String,
}

/// Builds the runner in a folder and gives its program. What rustc has to say of the user's hooks is passed on.
pub(super) fn build(shell: Shell, folder: &Path, campaign: &str) -> anyhow::Result<PathBuf> {
    let start = Instant::now();
    shell.doing("Building", campaign);
    let mut cargo = Command::new("cargo")
        .args(["build", "--quiet", "--message-format=json-render-diagnostics"])
        .args(["--color", if shell.colour() { "always" } else { "never" }])
        // Cargo reads the settings of the folder it runs in: there the runners' common target folder is named.
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .context("cannot start `cargo` to build the runner; install Rust from https://rustup.rs")?;
    let mut errors = cargo.stderr.take().expect("it is piped");
    let errors = std::thread::spawn(move || {
        let mut text = Vec::new();
        errors.read_to_end(&mut text).map(|_| text)
    });
    let mut program = None;
    for line in BufReader::new(cargo.stdout.take().expect("it is piped")).lines() {
        // Other lines are what build scripts print.
        let Ok(message) = serde_json::from_str::<Message>(&line.context("cannot read the output of cargo")?) else {
            continue;
        };
        if message.reason == "compiler-artifact" {
            if let Some(target) = message.target {
                shell.doing("Building", format!("{campaign}: {}", target.name));
            }
            program = message.executable.or(program);
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
