//! From text to [`ast`]: parsing with recovery.

pub(crate) mod ast;
mod condition;
mod explain;
mod formula;
mod limits;
mod parse;
mod token;
mod words;

pub(crate) use parse::parse;
