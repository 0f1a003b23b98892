//! Why an audit could not be done.

use std::fmt;
use std::path::PathBuf;

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
