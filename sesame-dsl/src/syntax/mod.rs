//! From text to [`ast`]: parsing with recovery.

mod activation;
pub(crate) mod ast;
pub(crate) mod eddi;
mod explain;
mod exploration;
mod formula;
mod limits;
mod operation;
mod parse;
pub(crate) mod physical;
pub(crate) mod surroundings;
mod token;
mod words;

pub use limits::MAX_BYTES;
pub(crate) use limits::parse_bounded;
pub(crate) use parse::parse;
pub(crate) use token::{is_keyword, token_at};
