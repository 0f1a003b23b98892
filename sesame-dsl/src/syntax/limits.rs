//! What a file may cost: checked before the parser sees it, so that no text can exhaust its stack or its time.

use std::num::NonZeroUsize;

use super::token::text_end;

/// Largest file, in bytes.
pub(super) const MAX_BYTES: usize = 1 << 20;
/// Deepest nesting of braces.
pub(super) const MAX_DEPTH: usize = 64;
/// Most calls of grammar rules for one file: some hundred per byte of the largest.
pub(super) const MAX_CALLS: NonZeroUsize = NonZeroUsize::new(200_000_000).expect("not zero");

/// Where braces nest deeper than allowed, if they do.
pub(super) fn too_deep(text: &str) -> Option<usize> {
    let bytes = text.as_bytes();
    let mut depth = 0usize;
    let mut at = 0;
    while at < bytes.len() {
        match bytes[at] {
            // A quote that does not end on its line is a sign like any other, as in the grammar.
            b'"' => at = text_end(text, at).unwrap_or(at + 1),
            b'/' if bytes.get(at + 1) == Some(&b'/') => {
                at = text[at..].find('\n').map_or(bytes.len(), |length| at + length);
            }
            b'{' => {
                depth += 1;
                if depth > MAX_DEPTH {
                    return Some(at);
                }
                at += 1;
            }
            b'}' => {
                depth = depth.saturating_sub(1);
                at += 1;
            }
            _ => at += 1,
        }
    }
    None
}
