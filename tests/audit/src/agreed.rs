//! What this project accepts of its dependencies: `agreed.toml`.

use serde::Deserialize;

use crate::error::AuditError;

/// What is accepted.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Agreed {
    /// Registries that packages may come from, as the lock file writes them.
    pub sources: Vec<String>,
    /// Licences of which a package has to offer one, by their SPDX names.
    pub licences: Vec<String>,
    /// Advisories that are known and accepted for now.
    #[serde(default)]
    pub exceptions: Vec<Exception>,
}

/// An advisory that is accepted for now.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Exception {
    /// The advisory.
    pub id: String,
    /// The package that it is about.
    pub package: String,
    /// Why it does no harm here.
    pub reason: String,
    /// What has to happen for the exception to go.
    pub until: String,
}

/// Reads `agreed.toml`.
///
/// # Errors
///
/// When a field is missing or unknown, and when an exception gives no reason.
pub fn read(text: &str) -> Result<Agreed, AuditError> {
    let agreed: Agreed = toml::from_str(text).map_err(|error| AuditError::malformed("agreed.toml", error))?;
    for Exception { id, reason, until, .. } in &agreed.exceptions {
        if reason.trim().is_empty() || until.trim().is_empty() {
            return Err(AuditError::malformed("agreed.toml", format!("the exception {id} needs `reason` and `until`")));
        }
    }
    Ok(agreed)
}
