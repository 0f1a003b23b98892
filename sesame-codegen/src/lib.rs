//! From a checked space to the runner crates of its campaigns.
//!
//! Model → plan ([`lower`], [`plan`]) → files in memory ([`emit`]) → disk ([`output`], the only module that writes).
//! Each arrow but the last is a pure function: the same model and version give the same bytes.

// These macros panic where nothing can be written: on a full disk, or after the reader has gone.
#![warn(clippy::print_stdout, clippy::print_stderr)]

pub mod emit;
pub mod environment;
pub mod files;
pub mod input;
pub mod lower;
pub mod names;
pub mod output;
pub mod plan;
pub mod project;
pub mod stubs;
pub mod wiring;
