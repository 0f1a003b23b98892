//! Advisories in the format of the RustSec database: a file `crates/PACKAGE/RUSTSEC-YYYY-NNNN.md` each, which begins
//! with facts in TOML.
//!
//! RustSec's own library reads the same files, but needs 36 more packages than this; what the audit compares are two
//! lists of versions.

mod problems;

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use semver::{Version, VersionReq};
use serde::Deserialize;

use crate::error::AuditError;
use crate::locked::Package;

pub use problems::problems;

/// What is known of some versions of a package.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Advisory {
    /// Its name, such as `RUSTSEC-2024-0436`.
    pub id: String,
    /// The package that it is about.
    pub package: String,
    /// The day on which it was disclosed.
    pub date: String,
    /// `unmaintained`, `unsound` or `notice`; none for a vulnerability.
    pub informational: Option<String>,
    /// Where one can read more.
    pub url: Option<String>,
    /// The day on which it was taken back.
    pub withdrawn: Option<String>,
    /// Versions in which the matter is mended.
    pub patched: Vec<VersionReq>,
    /// Versions that never had it.
    pub unaffected: Vec<VersionReq>,
    /// In a few words.
    pub title: String,
}

impl Advisory {
    /// What it is: `vulnerability`, or the informational kind.
    pub fn kind(&self) -> &str {
        self.informational.as_deref().unwrap_or("vulnerability")
    }

    /// Whether a version has what the advisory is about: one that is neither patched nor unaffected.
    ///
    /// As in Cargo, a requirement holds for a pre-release only if it names one of the same version. So a pre-release is
    /// rather affected than not.
    pub fn affects(&self, version: &Version) -> bool {
        self.withdrawn.is_none() && !self.patched.iter().chain(&self.unaffected).any(|safe| safe.matches(version))
    }
}

/// Reads the text of an advisory; `file` is for messages.
///
/// # Errors
///
/// When the facts are missing or not as RustSec writes them.
pub fn parse(file: &str, text: &str) -> Result<Advisory, AuditError> {
    #[derive(Deserialize)]
    struct Facts {
        advisory: Head,
        versions: Versions,
    }
    #[derive(Deserialize)]
    struct Head {
        id: String,
        package: String,
        date: String,
        informational: Option<String>,
        url: Option<String>,
        withdrawn: Option<String>,
    }
    #[derive(Deserialize)]
    struct Versions {
        patched: Vec<VersionReq>,
        #[serde(default)]
        unaffected: Vec<VersionReq>,
    }
    let text = text.replace("\r\n", "\n");
    let (facts, prose) = text
        .strip_prefix("```toml\n")
        .and_then(|rest| rest.split_once("\n```"))
        .ok_or_else(|| AuditError::malformed(file, "does not begin with facts between ```toml and ```"))?;
    let Facts { advisory, versions } = toml::from_str(facts).map_err(|error| AuditError::malformed(file, error))?;
    let title = prose.lines().find_map(|line| line.strip_prefix("# ")).unwrap_or_default();
    Ok(Advisory {
        id: advisory.id,
        package: advisory.package,
        date: advisory.date,
        informational: advisory.informational,
        url: advisory.url,
        withdrawn: advisory.withdrawn,
        patched: versions.patched,
        unaffected: versions.unaffected,
        title: title.trim().to_owned(),
    })
}

/// What a database says.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Database {
    /// Its advisories on the packages it was read for, by package and name.
    pub advisories: Vec<Advisory>,
    /// The packages that it was made for, where it is a snapshot; RustSec's own is for all.
    pub covers: Option<BTreeSet<String>>,
}

/// The file of a snapshot that names the packages which it was made for, one a line.
pub const COVERS: &str = "packages.txt";

/// Reads what a database has on these packages. It opens no file on another package.
///
/// # Errors
///
/// If the folder is not a database, or an advisory in it cannot be read: an unreadable advisory is never skipped.
pub fn read(folder: &Path, packages: &[Package]) -> Result<Database, AuditError> {
    let crates = folder.join("crates");
    if !crates.is_dir() {
        return Err(AuditError::NoDatabase { path: folder.to_owned() });
    }
    let covers = folder.join(COVERS);
    let covers = if covers.exists() {
        let names = fs::read_to_string(&covers).map_err(AuditError::io(&covers))?;
        Some(names.lines().map(str::to_owned).collect())
    } else {
        None
    };
    let names: BTreeSet<&str> = packages.iter().map(|package| package.name.as_str()).collect();
    let mut advisories = Vec::new();
    for name in names {
        let of_package = crates.join(name);
        if !of_package.is_dir() {
            continue;
        }
        let mut files = fs::read_dir(&of_package)
            .and_then(|entries| entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>, _>>())
            .map_err(AuditError::io(&of_package))?;
        files.retain(|path| path.extension().is_some_and(|extension| extension == "md"));
        files.sort();
        for path in files {
            let text = fs::read_to_string(&path).map_err(AuditError::io(&path))?;
            let advisory = parse(&path.display().to_string(), &text)?;
            if advisory.package != name {
                let why = format!("is about {}, but lies in the folder of {name}", advisory.package);
                return Err(AuditError::malformed(path.display().to_string(), why));
            }
            advisories.push(advisory);
        }
    }
    Ok(Database { advisories, covers })
}
