//! Text from files and simulators, made safe to show: a terminal would interpret control characters.

/// Text on one line without control characters.
pub fn visible(text: &str) -> String {
    text.chars()
        .map(|c| if c == '\n' || c == '\t' { ' ' } else { c })
        .map(|c| if c.is_control() { '\u{FFFD}' } else { c })
        .collect()
}

/// As [`visible`], but keeps line breaks.
pub fn visible_lines(text: &str) -> String {
    text.chars().map(|c| if c.is_control() && c != '\n' { '\u{FFFD}' } else { c }).collect()
}
