//! The command `sesamec`: what a command line asks for, from the check of a space to the study of a lab.
//!
//! The language checks ([`frontend`]), the generator writes runners, and the runtime runs, records and reports; what is
//! here calls them and says what came of it ([`cli`]).

// These macros panic where nothing can be written: on a full disk, or after the reader has gone.
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod certificate;
pub mod cli;
pub mod explain;
pub mod frontend;
mod interfaces;
// Public, because it depends on the features which parts of it the command itself uses.
pub mod scan;
mod uses;
