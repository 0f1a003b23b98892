//! What a file says, before names mean anything: the grammar's constructs with their spans and doc comments.
//!
//! A construct with a syntax error is not here; but the name it was about to declare is kept in [`File::undeclared`],
//! and the block around it is marked as one with errors, so that one mistake does not look like several.

mod campaign;
pub(crate) mod eddi;
mod exploration;
mod formula;
pub(crate) mod lifecycle;
mod metric;
mod operation;
pub(crate) mod physical;
mod system;
mod test;
mod words;

pub(crate) use campaign::*;
pub(crate) use exploration::*;
pub(crate) use formula::*;
pub(crate) use metric::*;
pub(crate) use operation::*;
pub(crate) use system::*;
pub(crate) use test::*;
pub(crate) use words::*;

use eddi::Eddi;
use physical::Physical;

/// A whole file. Order between kinds never matters; within a kind it is the order of the file.
#[derive(Debug, Default)]
pub(crate) struct File {
    pub(crate) spaces: Vec<Head>,
    pub(crate) imports: Vec<Text>,
    pub(crate) systems: Vec<System>,
    pub(crate) metrics: Vec<Metric>,
    pub(crate) requirements: Vec<Requirement>,
    pub(crate) operations: Vec<Operation>,
    pub(crate) tests: Vec<Test>,
    pub(crate) campaigns: Vec<Campaign>,
    pub(crate) eddis: Vec<Eddi>,
    pub(crate) physicals: Vec<Physical>,
    /// Names that a broken or unsupported construct was about to declare.
    pub(crate) undeclared: Vec<Name>,
    /// Whether anything at the top level could not be read.
    pub(crate) has_errors: bool,
    /// Whether an imported file is missing, and with it names that others use.
    pub(crate) incomplete: bool,
}
