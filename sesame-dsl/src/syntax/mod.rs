//! From text to [`ast`]: parsing with recovery.

mod activation;
pub(crate) mod ast;
mod explain;
mod exploration;
mod formula;
mod limits;
mod parse;
mod token;
mod words;

pub(crate) use parse::parse;
