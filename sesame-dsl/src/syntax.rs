//! From text to [`ast`]: parsing with recovery.
//!
//! [`ast`] is the data, `parse` makes it from the grammar's pairs, and `syntax_error` says what is wrong where the
//! grammar gave up. Both know from `blocks` what stands in which block.

pub(crate) mod ast;
mod blocks;
mod bounds;
mod foreign;
mod limits;
mod parse;
mod phrases;
mod syntax_error;
mod text;
mod token;
mod values;

pub use limits::MAX_BYTES;
pub(crate) use limits::parse_bounded;
pub(crate) use parse::parse;
pub(crate) use token::{is_keyword, token_at};
