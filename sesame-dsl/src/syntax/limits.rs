//! What a file may cost: checked before the parser sees it, so that no text can exhaust its stack or its time.

use std::num::NonZeroUsize;
use std::sync::{Mutex, PoisonError};

use pest::Parser as _;
use pest::error::Error;
use pest::iterators::Pairs;
use sesame_grammar::{Rule, SesameParser};

use super::text::text_end;

/// Largest file, in bytes: more than a hundred thousand lines.
pub const MAX_BYTES: usize = 8 << 20;
/// Deepest nesting of braces.
const MAX_BRACES: usize = 64;
/// Deepest nesting of parentheses.
const MAX_PARENTHESES: usize = 24;
/// Most calls of grammar rules for each byte of a text. Files as people write them take a tenth of that.
const MAX_CALLS_PER_BYTE: usize = 300;
/// Most calls of grammar rules for a text of no length.
const MAX_CALLS_FOR_NOTHING: usize = 10_000_000;

/// Parses a text by a rule, in time that grows with its length and not faster: an error of the limit on calls says
/// otherwise.
pub(crate) fn parse_bounded(rule: Rule, text: &str) -> Result<Pairs<'_, Rule>, Box<Error<Rule>>> {
    // The limit is the whole process's in pest, so one text is parsed at a time.
    static PARSING: Mutex<()> = Mutex::new(());
    let _turn = PARSING.lock().unwrap_or_else(PoisonError::into_inner);
    pest::set_call_limit(NonZeroUsize::new(MAX_CALLS_FOR_NOTHING + MAX_CALLS_PER_BYTE * text.len()));
    SesameParser::parse(rule, text).map_err(Box::new)
}

/// Where braces or parentheses nest deeper than allowed, if they do, and what is wrong there.
pub(super) fn too_deep(text: &str) -> Option<(usize, String)> {
    let bytes = text.as_bytes();
    let mut depth = 0usize;
    let mut parentheses = 0usize;
    let mut at = 0;
    while at < bytes.len() {
        match bytes[at] {
            // A quote that does not end on its line is a sign like any other, as in the grammar.
            b'"' => at = text_end(text, at).unwrap_or(at + 1),
            b'/' if bytes.get(at + 1) == Some(&b'/') => {
                at = text[at..].find('\n').map_or(bytes.len(), |length| at + length);
            }
            b'(' => {
                parentheses += 1;
                if parentheses > MAX_PARENTHESES {
                    return Some((at, format!("parentheses are nested more than {MAX_PARENTHESES} levels deep")));
                }
                at += 1;
            }
            b')' => {
                parentheses = parentheses.saturating_sub(1);
                at += 1;
            }
            b'{' => {
                depth += 1;
                parentheses = 0;
                if depth > MAX_BRACES {
                    return Some((at, format!("blocks are nested more than {MAX_BRACES} levels deep")));
                }
                at += 1;
            }
            b'}' => {
                depth = depth.saturating_sub(1);
                parentheses = 0;
                at += 1;
            }
            _ => at += 1,
        }
    }
    None
}
