//! The advisories that the project keeps for audits without a network: facts only, in RustSec's format.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use semver::VersionReq;

use crate::advisory::{self, Advisory, Database};
use crate::error::AuditError;
use crate::locked::Package;

/// Replaces the snapshot in `folder` by the facts that `database` has on `packages` at `date`, and says how many
/// advisories those are.
///
/// Titles are the project's own. One that the old snapshot has stays; a new advisory gets its kind for a title, to be
/// written anew by hand. No prose of the database is taken.
///
/// # Errors
///
/// When the database or the old snapshot cannot be read, or the new one not be written.
pub fn make(database: &Path, packages: &[Package], date: &str, folder: &Path) -> Result<usize, AuditError> {
    let Database { advisories, covers } = advisory::read(database, packages)?;
    if covers.is_some() {
        let why = "is a snapshot itself, which knows nothing new";
        return Err(AuditError::malformed(database.display().to_string(), why));
    }
    let crates = folder.join("crates");
    let titles: BTreeMap<String, String> = if crates.is_dir() {
        let old = advisory::read(folder, packages)?.advisories;
        fs::remove_dir_all(&crates).map_err(AuditError::io(&crates))?;
        old.into_iter().map(|advisory| (advisory.id, advisory.title)).collect()
    } else {
        BTreeMap::new()
    };
    fs::create_dir_all(&crates).map_err(AuditError::io(&crates))?;
    for advisory in &advisories {
        let title = match titles.get(&advisory.id) {
            Some(title) => title.clone(),
            None => format!("{}: {}", advisory.package, advisory.kind()),
        };
        let of_package = crates.join(&advisory.package);
        fs::create_dir_all(&of_package).map_err(AuditError::io(&of_package))?;
        write(&of_package.join(format!("{}.md", advisory.id)), &facts(advisory, &title))?;
    }
    let foreign = packages.iter().filter(|package| package.source.is_some());
    let covers: BTreeSet<String> = foreign.map(|package| format!("{}\n", package.name)).collect();
    write(&folder.join(advisory::COVERS), &covers.into_iter().collect::<String>())?;
    write(&folder.join("README.md"), &readme(date, advisories.len()))?;
    Ok(advisories.len())
}

fn write(path: &Path, text: &str) -> Result<(), AuditError> {
    fs::write(path, text).map_err(AuditError::io(path))
}

fn facts(advisory: &Advisory, title: &str) -> String {
    let quoted = |text: &str| toml::Value::from(text).to_string();
    let list = |versions: &[VersionReq]| {
        let versions: Vec<String> = versions.iter().map(|version| quoted(&version.to_string())).collect();
        versions.join(", ")
    };
    let mut text = String::from("```toml\n[advisory]\n");
    let given = [
        ("id", Some(&advisory.id)),
        ("package", Some(&advisory.package)),
        ("date", Some(&advisory.date)),
        ("informational", advisory.informational.as_ref()),
        ("url", advisory.url.as_ref()),
        ("withdrawn", advisory.withdrawn.as_ref()),
    ];
    for (name, value) in given {
        if let Some(value) = value {
            let _ = writeln!(text, "{name} = {}", quoted(value));
        }
    }
    let _ = writeln!(text, "\n[versions]\npatched = [{}]", list(&advisory.patched));
    if !advisory.unaffected.is_empty() {
        let _ = writeln!(text, "unaffected = [{}]", list(&advisory.unaffected));
    }
    let _ = writeln!(text, "```\n\n# {title}");
    text
}

fn readme(date: &str, count: usize) -> String {
    format!(
        "# Advisories\n\n\
         {count} advisories name packages of `Cargo.lock`; as of {date}.\n\n\
         This is only the fallback: `.ci/run` audits against the current RustSec advisory database where it can fetch \
         it, and `SESAME_ADVISORY_DB=FOLDER` names a checkout for any test run. These files repeat facts of that \
         database (which versions, since when, where to read more); their titles are our own. `packages.txt` names \
         the packages that were looked up: a dependency that is missing there fails the audit.\n\n\
         To make them anew:\n\n\
         ```\n\
         git clone --depth 1 https://github.com/rustsec/advisory-db target/advisory-db\n\
         cargo run -p sesame-audit -- target/advisory-db\n\
         ```\n\n\
         Then write a title for each new advisory.\n"
    )
}
