//! Packages as `Cargo.lock` names them, and where they come from.

mod problems;

use semver::Version;
use serde::Deserialize;

use crate::error::AuditError;

pub use problems::problems;

/// One locked package.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
pub struct Package {
    /// Its name.
    pub name: String,
    /// Its version.
    pub version: Version,
    /// Where it comes from; a package of the workspace has none.
    pub source: Option<String>,
}

/// All packages of a lock file, in its order.
///
/// # Errors
///
/// If the text is not a lock file.
pub fn packages(lock: &str) -> Result<Vec<Package>, AuditError> {
    #[derive(Deserialize)]
    struct Lock {
        package: Vec<Package>,
    }
    let lock: Lock = toml::from_str(lock).map_err(|error| AuditError::malformed("Cargo.lock", error))?;
    Ok(lock.package)
}
