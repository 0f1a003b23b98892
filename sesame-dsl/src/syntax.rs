//! From text to [`ast`]: parsing with recovery.

mod activation;
pub(crate) mod ast;
pub(crate) mod eddi;
mod exploration;
mod formula;
pub(crate) mod lifecycle;
mod limits;
mod operation;
mod parse;
pub(crate) mod physical;
mod syntax_error;
mod token;
mod words;

pub use limits::MAX_BYTES;
pub(crate) use limits::parse_bounded;
pub(crate) use parse::parse;
pub(crate) use token::{is_keyword, token_at};
