//! The formatter: one layout for all files.
//!
//! It works on words and signs and on where items and members of blocks begin, not on the kinds of constructs: a
//! construct that is new to the grammar is laid out by the same few rules. These are:
//!
//! - An item begins a line. So does a member of a block, if anything in the block is on a line of its own; else the
//!   block stays on its line, with two blanks between its members.
//! - Inside a member lines end where they did, and what goes on is indented by two.
//! - At most one empty line stays between items or members.
//! - Words and signs have one blank between them or none, but for columns: where lines of one kind follow each other,
//!   and one of them has further blanks before a word that all have, that word is aligned in all of them.
//!
//! The formatted text has the same words, signs and comments in the same order, and formatting it again changes
//! nothing.

mod columns;
mod lines;
mod tokens;

use sesame_grammar::Rule;

use self::tokens::Token;
use crate::diagnostic::{Code, Diagnostic, Severity};
use crate::source::SourceMap;
use crate::span::{FileId, Span};
use crate::syntax::parse_bounded;

/// The file `root` of `sources` in the one layout, with `\n` at the ends of lines.
///
/// Only the syntax must be right: names may be unknown and units may not fit. A file with syntax errors is not
/// formatted; they come back instead, sorted by position.
pub fn format(sources: &SourceMap, root: FileId) -> Result<String, Vec<Diagnostic>> {
    let text = sources.file(root).text();
    let mut diagnostics = Vec::new();
    crate::syntax::parse(root, text, &mut diagnostics);
    diagnostics.retain(|diagnostic| diagnostic.severity() == Severity::Error);
    if !diagnostics.is_empty() {
        diagnostics.sort_by_key(|diagnostic| (diagnostic.span, diagnostic.code));
        return Err(diagnostics);
    }
    let too_large = || {
        let span = Span { file: root, lo: 0, hi: 0 };
        vec![Diagnostic::new(Code::TOO_LARGE, span, "the file is too large to be formatted")]
    };
    let before = read(text).ok_or_else(too_large)?;
    let mut lines = lines::lines(&before);
    columns::align(&mut lines);
    let formatted = lines::text(&lines);
    let after = read(&formatted).ok_or_else(too_large)?;
    let same = before.len() == after.len() && before.iter().zip(&after).all(|(before, after)| before.says_what(after));
    assert!(same, "formatting changes nothing but blanks and line ends");
    Ok(formatted)
}

/// The words of a text without syntax errors. The entry rule accepts every text, so `None` means that it took too long.
fn read(text: &str) -> Option<Vec<Token<'_>>> {
    let mut pairs = parse_bounded(Rule::file, text).ok()?;
    Some(tokens::tokens(text, &pairs.next()?))
}
