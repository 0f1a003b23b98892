//! The texts of this project that people read and edit: stubs, READMEs and new projects.
//!
//! Templates are in the language of tera and hold loops and plain conditions, nothing else: names, types and sentences
//! are computed by whoever fills them in.

pub mod project;
pub mod runner;
