//! What every declaration has.

use crate::span::Span;

/// What every declaration has.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Declaration {
    /// Its name: ASCII letters, digits and `_`; unique in the space.
    pub name: String,
    /// Where the name stands.
    pub span: Span,
    /// Line of the name, from 1.
    pub line: u32,
    /// Its doc comment, lines joined by `\n`, without the slashes and one space after them; empty when there is none.
    pub doc: String,
}
