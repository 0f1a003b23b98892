//! What a campaign leaves behind, and what is made of it.
//!
//! [`record`] is the results repository: one SQLite file per run. [`analysis`] reads any results as tables. [`report`]
//! makes texts, the page and files for build servers.

// These macros panic where nothing can be written: on a full disk, or after the reader has gone.
#![warn(clippy::print_stdout, clippy::print_stderr)]

pub mod analysis;
mod present;
pub mod record;
pub mod report;
