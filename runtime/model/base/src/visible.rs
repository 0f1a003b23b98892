//! Text from files, simulators and peers, made safe to show.
//!
//! A terminal obeys control characters, and characters that set the direction of text make it read as something that it
//! is not. Whatever is shown goes through this module: in a terminal and on a page such characters become `�`, in JSON
//! they are escaped.

use std::borrow::Cow;
use std::fmt::Write as _;

/// Whether a character must not be shown as it is: a terminal obeys it, it changes the direction of the text around it,
/// it ends a line for some readers only, or no XML document may hold it. So are line ends and tabs.
pub fn is_hidden(c: char) -> bool {
    c.is_control()
        || matches!(c, '\u{061C}' | '\u{200E}' | '\u{200F}' | '\u{202A}'..='\u{202E}' | '\u{2066}'..='\u{2069}')
        || matches!(c, '\u{2028}' | '\u{2029}' | '\u{FFFE}' | '\u{FFFF}')
}

/// Text on one line: line ends and tabs become spaces.
pub fn visible(text: &str) -> String {
    text.chars().map(|c| if matches!(c, '\n' | '\t') { ' ' } else { shown(c) }).collect()
}

/// As [`visible`], but keeps line ends and tabs.
pub fn visible_lines(text: &str) -> Cow<'_, str> {
    let hidden = |c: char| is_hidden(c) && !matches!(c, '\n' | '\t');
    if !text.contains(hidden) {
        return Cow::Borrowed(text);
    }
    Cow::Owned(text.chars().map(|c| if hidden(c) { '\u{FFFD}' } else { c }).collect())
}

/// JSON whose texts have such characters as escapes. It means the same, and keeps the line ends between its parts.
pub fn visible_json(json: &str) -> Cow<'_, str> {
    let hidden = |c: char| is_hidden(c) && c != '\n';
    if !json.contains(hidden) {
        return Cow::Borrowed(json);
    }
    let mut escaped = String::with_capacity(json.len() + 16);
    for c in json.chars() {
        // JSON leaves some of them unescaped. They are only in texts, and all lie in Unicode's basic plane.
        if hidden(c) {
            let _ = write!(escaped, "\\u{:04x}", u32::from(c));
        } else {
            escaped.push(c);
        }
    }
    Cow::Owned(escaped)
}

fn shown(c: char) -> char {
    if is_hidden(c) { '\u{FFFD}' } else { c }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn what_a_terminal_obeys_is_replaced_and_all_else_stays() {
        assert_eq!(visible("a\x1b[31mb\r\u{9b}\u{7f}\0\u{202e}c\n\td µ🤖"), "a�[31mb�����c  d µ🤖");
        assert_eq!(visible_lines("a\x1bb\n\tc"), "a�b\n\tc");
        assert!(matches!(visible_lines("space a\n"), Cow::Borrowed(_)));
    }

    proptest! {
        #[test]
        fn nothing_hidden_is_left_and_json_means_the_same(text in any::<String>(), at in 0_usize..40, hidden in 0_u32..=0xFFFF) {
            let mut text = text;
            if let Some(c) = char::from_u32(hidden).filter(|&c| is_hidden(c)) {
                let at = text.char_indices().map(|(at, _)| at).nth(at).unwrap_or(0);
                text.insert(at, c);
            }
            prop_assert!(!visible(&text).contains(is_hidden));
            prop_assert_eq!(visible(&text).chars().count(), text.chars().count());
            prop_assert!(!visible_lines(&text).contains(|c| is_hidden(c) && !matches!(c, '\n' | '\t')));
            let json = serde_json::to_string_pretty(&[&text]).unwrap();
            let shown = visible_json(&json);
            prop_assert!(!shown.contains(|c| is_hidden(c) && c != '\n'));
            prop_assert_eq!(serde_json::from_str::<[String; 1]>(&shown).unwrap(), [text]);
        }
    }
}
