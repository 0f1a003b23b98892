//! Holds what the workspace depends on against security advisories, licences and sources.
//!
//! [`locked`] reads `Cargo.lock`, [`licence`] what `cargo metadata` says of licences, [`advisory`] a folder in the
//! format of the RustSec advisory database, and [`agreed`] what this project accepts. [`audit`] compares them and
//! returns every [`Problem`]; none means that all packages may stay.

pub mod advisory;
pub mod agreed;
pub mod licence;
pub mod locked;
pub mod snapshot;

use std::fmt;
use std::path::PathBuf;

use advisory::{Advisory, Database};
use agreed::Agreed;
use licence::Licences;
use locked::Package;

/// Why the audit itself could not be done. It never passes because something to compare with is missing.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum AuditError {
    /// A file or folder could not be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// A text is not what it should be.
    #[error("{what}: {why}")]
    Malformed {
        /// The file, or the command that printed the text.
        what: String,
        /// What is wrong with it.
        why: String,
    },
    /// The folder is not a checkout of an advisory database.
    #[error("{} is not an advisory database: it has no folder `crates`", path.display())]
    NoDatabase {
        /// The folder.
        path: PathBuf,
    },
}

impl AuditError {
    pub(crate) fn io(path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> AuditError {
        let path = path.into();
        move |source| AuditError::Io { path, source }
    }

    pub(crate) fn malformed(what: impl Into<String>, why: impl fmt::Display) -> AuditError {
        AuditError::Malformed { what: what.into(), why: why.to_string() }
    }
}

/// Something about a dependency that this project has not agreed to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Problem {
    /// An advisory names a locked version, and no exception names the advisory.
    Affected {
        /// The package and its version.
        package: Package,
        /// What is known of it.
        advisory: Advisory,
    },
    /// An exception names an advisory that affects no locked version (any more).
    NeedlessException {
        /// The advisory.
        id: String,
        /// The package that the exception is for.
        package: String,
    },
    /// The snapshot of advisories was made before there was this dependency, so it cannot say anything about it.
    NotCovered {
        /// The package.
        package: Package,
    },
    /// A package comes from elsewhere than the agreed registries.
    Source {
        /// The package; its source is set.
        package: Package,
    },
    /// No licence that a package offers has been agreed to.
    Licence {
        /// The package.
        package: Package,
        /// What it offers, if it says so in its manifest.
        offered: Option<String>,
    },
    /// Without this agreed licence, all packages would pass too.
    NeedlessLicence {
        /// The licence.
        licence: String,
    },
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Problem::Affected { package: Package { name, version, .. }, advisory } => {
                write!(f, "{name} {version}: {} ({}), {}", advisory.id, advisory.kind(), advisory.title)?;
                if advisory.patched.is_empty() {
                    write!(f, "; no version is patched")?;
                } else {
                    let patched: Vec<String> = advisory.patched.iter().map(ToString::to_string).collect();
                    write!(f, "; patched: {}", patched.join(" or "))?;
                }
                write!(f, "; https://rustsec.org/advisories/{}.html", advisory.id)
            }
            Problem::NeedlessException { id, package } => {
                write!(f, "{id} does not affect the locked {package}: remove its exception from agreed.toml")
            }
            Problem::NotCovered { package: Package { name, version, .. } } => {
                write!(
                    f,
                    "{name} {version}: the snapshot of advisories is older than this dependency: make it anew as its \
                     README.md says, or look whether https://rustsec.org/packages/{name}.html exists, add what it \
                     lists, and add the name to {}",
                    advisory::COVERS
                )
            }
            Problem::Source { package: Package { name, version, source } } => {
                let source = source.as_deref().unwrap_or("no source");
                write!(f, "{name} {version}: comes from {source}, which agreed.toml does not name")
            }
            Problem::Licence { package: Package { name, version, .. }, offered: Some(offered) } => {
                write!(f, "{name} {version}: agreed.toml allows none of its licences, {offered}")
            }
            Problem::Licence { package: Package { name, version, .. }, offered: None } => {
                write!(f, "{name} {version}: its manifest names no licence")
            }
            Problem::NeedlessLicence { licence } => {
                write!(f, "{licence} is needed by no package: remove it from agreed.toml")
            }
        }
    }
}

/// Every problem with these packages: advisories, then sources, then licences.
///
/// # Errors
///
/// When a licence cannot be understood: an unknown one is not taken for a harmless one.
pub fn audit(
    packages: &[Package],
    database: &Database,
    licences: &Licences,
    agreed: &Agreed,
) -> Result<Vec<Problem>, AuditError> {
    let mut problems = advisory::problems(packages, database, &agreed.exceptions);
    problems.extend(locked::problems(packages, &agreed.sources));
    problems.extend(licence::problems(packages, licences, &agreed.licences)?);
    Ok(problems)
}
