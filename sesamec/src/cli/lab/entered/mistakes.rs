//! What is wrong with a file, and where.

use std::collections::BTreeMap;
use std::path::Path;

/// How many mistakes of a file are listed; a file may have one in each of a million cells.
const MOST: usize = 100;

/// How many mistakes are listed that are the same.
const ALIKE: usize = 3;

/// The mistakes of one file. Places are offsets in bytes.
pub(super) struct Mistakes<'f> {
    file: &'f Path,
    text: &'f str,
    /// Where each line begins.
    lines: Vec<usize>,
    found: Vec<(usize, String)>,
    more: usize,
}

impl<'f> Mistakes<'f> {
    pub(super) fn new(file: &'f Path, text: &'f str) -> Self {
        let lines = std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect();
        Mistakes { file, text, lines, found: Vec::new(), more: 0 }
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

    /// The number of the line that holds an offset, from 1.
    fn number(&self, at: usize) -> usize {
        self.lines.partition_point(|&begin| begin <= at)
    }

    /// The line that holds an offset, as terminals and editors name it.
    pub(super) fn line(&self, at: usize) -> String {
        format!("{}:{}", self.file.display(), self.number(at))
    }

    /// The offset of a line and a column in bytes, both from 1.
    pub(super) fn offset(&self, line: usize, column: usize) -> usize {
        let begin = self.lines.get(line.saturating_sub(1)).copied().unwrap_or(self.text.len());
        (begin + column.saturating_sub(1)).min(self.text.len())
    }

    /// All mistakes in the order of the file, each with its line and its column in characters. Where many places
    /// have the same one, the first ones are listed and the others counted.
    pub(super) fn listed(mut self) -> Vec<String> {
        self.found.sort_by_key(|&(at, _)| at);
        let mut seen: BTreeMap<String, usize> = BTreeMap::new();
        self.found.retain(|(_, what)| {
            let times = seen.entry(what.clone()).or_default();
            *times += 1;
            *times <= ALIKE
        });
        let mut last: BTreeMap<&str, usize> = BTreeMap::new();
        for (at, (_, what)) in self.found.iter().enumerate() {
            last.insert(what, at);
        }
        let more = |at: usize, what: &str| match seen[what].checked_sub(ALIKE) {
            Some(more) if more > 0 && last[what] == at => format!(" (and in {more} more places)"),
            _ => String::new(),
        };
        let said = |(place, (at, what)): (usize, &(usize, String))| {
            let begin = self.lines[self.number(*at) - 1];
            let column = self.text[begin..].char_indices().take_while(|(before, _)| begin + before < *at).count() + 1;
            format!("{}:{column}: {what}{}", self.line(*at), more(place, what))
        };
        let mut listed: Vec<String> = self.found.iter().enumerate().map(said).collect();
        if self.more > 0 {
            listed.push(format!("{}: {} more mistakes; correct these first", self.file.display(), self.more));
        }
        listed
    }
}
