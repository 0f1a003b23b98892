//! The texts of this project that people read and edit: stubs, READMEs, new projects and the report's shell.
//!
//! Templates hold loops and plain conditions, nothing else: names, types and sentences are computed by whoever fills
//! them in.

pub mod project;
pub mod report;
pub mod runner;
