//! What is wrong with a file, and where.

use std::path::Path;

/// How many mistakes of a file are listed; a file may have one in each of a million cells.
const MOST: usize = 100;

/// The mistakes of one file. Places are offsets in bytes.
pub(super) struct Mistakes<'f> {
    file: &'f Path,
    text: &'f str,
    found: Vec<(usize, String)>,
    more: usize,
}

impl<'f> Mistakes<'f> {
    pub(super) fn new(file: &'f Path, text: &'f str) -> Self {
        Mistakes { file, text, found: Vec::new(), more: 0 }
    }

    /// Adds a mistake. What is said of it is only made up if it is listed.
    pub(super) fn say(&mut self, at: usize, what: impl FnOnce() -> String) {
        if self.found.len() < MOST {
            self.found.push((at, what()));
        } else {
            self.more += 1;
        }
    }

    pub(super) fn are_none(&self) -> bool {
        self.found.is_empty()
    }

    /// A line of the file, as terminals and editors name it.
    pub(super) fn line(&self, at: usize) -> String {
        format!("{}:{}", self.file.display(), position(self.text, at).0)
    }

    /// All mistakes in the order of the file, each with its place.
    pub(super) fn listed(mut self) -> Vec<String> {
        self.found.sort_by_key(|&(at, _)| at);
        let file = self.file.display();
        let said = |(at, what): &(usize, String)| {
            let (line, column) = position(self.text, *at);
            format!("{file}:{line}:{column}: {what}")
        };
        let mut listed: Vec<String> = self.found.iter().map(said).collect();
        if self.more > 0 {
            listed.push(format!("{file}: {} more mistakes", self.more));
        }
        listed
    }
}

/// The line and the column, in characters, of an offset; both from 1.
pub(super) fn position(text: &str, at: usize) -> (usize, usize) {
    let before = &text.as_bytes()[..at.min(text.len())];
    let line = before.iter().filter(|&&byte| byte == b'\n').count() + 1;
    let start = before.iter().rposition(|&byte| byte == b'\n').map_or(0, |at| at + 1);
    // Each character has one byte that does not continue another.
    let column = before[start..].iter().filter(|&&byte| byte & 0xC0 != 0x80).count() + 1;
    (line, column)
}

/// The offset of a line and a column in bytes, both from 1.
pub(super) fn offset(text: &str, line: usize, column: usize) -> usize {
    let lines: usize = text.split_inclusive('\n').take(line.saturating_sub(1)).map(str::len).sum();
    (lines + column.saturating_sub(1)).min(text.len())
}
