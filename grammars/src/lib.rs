//! The grammar of the Sesame language as a pest parser, and nothing else.
//!
//! `sesame.pest` is the one normative grammar. Its entry rule `file` accepts every text: what no rule understands comes
//! out as `error_…` pairs, which the front end explains.

/// The text of the grammar, for tests that compare keyword lists with it.
pub const GRAMMAR: &str = include_str!("../sesame.pest");

mod parser {
    #![expect(missing_docs, reason = "the derive generates one undocumented variant per rule of the grammar")]

    /// The parser that pest derives from `sesame.pest`.
    #[derive(pest_derive::Parser)]
    #[grammar = "sesame.pest"]
    pub struct SesameParser;
}

pub use parser::{Rule, SesameParser};
