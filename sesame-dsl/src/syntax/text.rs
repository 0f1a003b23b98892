//! Where a quoted text ends.

/// One past the closing quote of the text that begins at an offset; `None` when it does not end on its line.
pub(super) fn text_end(text: &str, open: usize) -> Option<usize> {
    let mut escaped = false;
    for (offset, c) in text[open + 1..].char_indices() {
        match c {
            '\n' | '\r' => return None,
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            '"' => return Some(open + 1 + offset + 1),
            _ => {}
        }
    }
    None
}
