//! `sesame-audit FOLDER` makes the project's snapshot of advisories anew from a checkout of the RustSec database.

use std::path::Path;
use std::process::Command;

use anyhow::{Context as _, bail};
use sesame_audit::{locked, snapshot};

fn main() -> anyhow::Result<()> {
    let [_, database] = &std::env::args().collect::<Vec<_>>()[..] else {
        bail!("usage: sesame-audit FOLDER, a checkout of the RustSec advisory database");
    };
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let lock = here.join("../../Cargo.lock");
    let lock = std::fs::read_to_string(&lock).with_context(|| lock.display().to_string())?;
    let folder = here.join("advisories");
    let count = snapshot::make(Path::new(database), &locked::packages(&lock)?, &date(database)?, &folder)?;
    println!("{count} advisories in {}", folder.display());
    Ok(())
}

/// The day of the last commit of a checkout.
fn date(checkout: &str) -> anyhow::Result<String> {
    // Else git would tell of a repository around it.
    if !Path::new(checkout).join(".git").exists() {
        bail!("{checkout} is not a checkout: it has no `.git`");
    }
    let git = Command::new("git")
        .args(["-C", checkout, "log", "-1", "--format=%cs"])
        .output()
        .context("git tells of what day the database is, and could not be run")?;
    if !git.status.success() {
        bail!("git does not tell of what day {checkout} is: {}", String::from_utf8_lossy(&git.stderr).trim());
    }
    Ok(String::from_utf8(git.stdout)?.trim().to_owned())
}
