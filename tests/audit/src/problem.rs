//! What an audit finds, and how it says so.

use std::fmt;

use crate::advisory::{Advisory, COVERS};
use crate::locked::Package;

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
                     lists, and add the name to {COVERS}"
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
