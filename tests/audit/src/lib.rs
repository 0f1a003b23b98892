//! Holds what the workspace depends on against security advisories, licences and sources.
//!
//! [`locked`] reads `Cargo.lock`, [`licence`] what `cargo metadata` says of licences, [`advisory`] a folder in the
//! format of the RustSec advisory database, and [`agreed`] what this project accepts. [`audit`] compares them and
//! returns every [`Problem`]; none means that all packages may stay.

pub mod advisory;
pub mod agreed;
mod error;
pub mod licence;
pub mod locked;
mod problem;
pub mod snapshot;

use advisory::Database;
use agreed::Agreed;
use licence::Licences;
use locked::Package;

pub use error::AuditError;
pub use problem::Problem;

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
