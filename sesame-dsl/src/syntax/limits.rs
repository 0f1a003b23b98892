//! What a file may cost: checked before the parser sees it, so that no text can exhaust its stack or its time.

use std::num::NonZeroUsize;

use super::token::text_end;

/// Largest file, in bytes.
pub(super) const MAX_BYTES: usize = 1 << 20;
/// Deepest nesting of braces.
const MAX_BRACES: usize = 64;
/// Deepest nesting of parentheses.
const MAX_PARENTHESES: usize = 24;
/// Most calls of grammar rules for one file: some hundred per byte of the largest.
pub(super) const MAX_CALLS: NonZeroUsize = NonZeroUsize::new(200_000_000).expect("not zero");

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
                    return Some((at, format!("parentheses are nested more than {MAX_PARENTHESES} deep")));
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
                    return Some((at, format!("blocks are nested more than {MAX_BRACES} deep")));
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
