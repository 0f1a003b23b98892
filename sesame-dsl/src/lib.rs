//! The front end of the Sesame language: text in, resolved model and diagnostics out.
//!
//! Pure: no file system, no environment, no clock. [`analyse`] never stops at the first mistake, never panics on any
//! text, and reports one mistake once.

pub mod diagnostic;
pub mod model;
mod similar;
pub mod source;
pub mod span;
mod syntax;
pub mod units;

use diagnostic::{Diagnostic, Severity};
use model::Space;

/// What an analysis found.
#[derive(Debug, Clone, PartialEq)]
pub struct Analysis {
    /// The model; `Some` exactly when no diagnostic is an error.
    pub model: Option<Space>,
    /// Errors and warnings, sorted by position.
    pub diagnostics: Vec<Diagnostic>,
}

impl Analysis {
    /// Whether anything is an error.
    pub fn has_errors(&self) -> bool {
        self.diagnostics.iter().any(|diagnostic| diagnostic.severity() == Severity::Error)
    }
}
