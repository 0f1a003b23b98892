//! What is shown to people, independent of what it is about: numbers as people read them, tables, markup, axes and
//! charts.
//!
//! It guarantees: texts from files and simulators cannot become markup, and in HTML and in tables for a terminal their
//! characters that must not be shown are replaced; HTML is well-formed as XML too; a table says the same as text, HTML,
//! CSV and JSON, and in the latter two with all digits of its numbers. Everything is a function of its arguments.
//!
//! - [`number`]: as many digits as tell numbers apart, with units.
//! - [`table`]: typed cells, rendered as text, HTML, CSV and JSON.
//! - [`markup`]: a writer of HTML and SVG.
//! - [`axis`], [`chart`], [`names`]: what charts have in common.

// These macros panic where nothing can be written: on a full disk, or after the reader has gone.
#![warn(clippy::print_stdout, clippy::print_stderr)]

pub mod axis;
pub mod chart;
pub mod markup;
pub mod names;
pub mod number;
pub mod table;
