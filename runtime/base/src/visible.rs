//! Text from files and simulators, made fit to be shown: on a terminal, control characters would do more than be read.

/// Text on one line without control characters.
pub fn visible(text: &str) -> String {
    text.chars()
        .map(|c| if c == '\n' || c == '\t' { ' ' } else { c })
        .map(|c| if c.is_control() { '\u{FFFD}' } else { c })
        .collect()
}

/// As [`visible`], and with the lines that there are.
pub fn visible_lines(text: &str) -> String {
    text.chars().map(|c| if c.is_control() && c != '\n' { '\u{FFFD}' } else { c }).collect()
}
