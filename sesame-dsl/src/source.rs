//! Source files in memory, and where their lines begin.

use std::collections::{BTreeMap, HashMap};
use std::ops::Range;
use std::path::{Component, Path, PathBuf};

use crate::span::{FileId, Span};

/// The files of one analysis. Nothing here touches a disk: the caller reads files and adds their text.
#[derive(Debug, Clone, Default)]
pub struct SourceMap {
    files: Vec<SourceFile>,
    /// The first file of each name, `.` and `..` in it worked out.
    by_name: HashMap<String, FileId>,
    /// Why files that are imported could not be read, by name.
    unreadable: BTreeMap<String, String>,
}

/// One file: its name as shown to people, its text, and where its lines begin.
#[derive(Debug, Clone)]
pub struct SourceFile {
    name: String,
    text: String,
    /// Byte offset of each line's first character; the first is 0, and they increase.
    line_starts: Vec<u32>,
}

/// A position: line and column count from 1, columns in characters unless stated otherwise.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct LineColumn {
    /// The line, from 1.
    pub line: u32,
    /// The column in the line, from 1.
    pub column: u32,
}

impl SourceMap {
    /// No files.
    pub fn new() -> Self {
        SourceMap::default()
    }

    /// Adds a file under the name that diagnostics show.
    pub fn add(&mut self, name: impl Into<String>, text: impl Into<String>) -> FileId {
        let id = FileId(u32::try_from(self.files.len()).expect("fewer than 2^32 files"));
        let name = name.into();
        self.by_name.entry(normal_path(Path::new(&name))).or_insert(id);
        self.files.push(SourceFile::new(name, text.into()));
        id
    }

    /// Says that a file cannot be read, and why, for example `there is no such file`.
    pub fn add_unreadable(&mut self, name: impl Into<String>, why: impl Into<String>) {
        self.unreadable.insert(name.into(), why.into());
    }

    /// The same files, one of them with another text.
    pub(crate) fn with_text(&self, id: FileId, text: &str) -> SourceMap {
        let mut changed = self.clone();
        let file = &mut changed.files[id.0 as usize];
        *file = SourceFile::new(std::mem::take(&mut file.name), text.to_owned());
        changed
    }

    /// How many bytes all files have together.
    pub(crate) fn bytes(&self) -> usize {
        self.files.iter().map(|file| file.text.len()).sum()
    }

    /// Why the file of a name cannot be read, if that is known.
    pub fn unreadable(&self, name: &str) -> Option<&str> {
        self.unreadable.get(name).map(String::as_str)
    }

    /// The file of a name, `.` and `..` in it worked out.
    pub fn find(&self, name: &str) -> Option<FileId> {
        self.by_name.get(&normal_path(Path::new(name))).copied()
    }

    /// The file of an id of this map.
    pub fn file(&self, id: FileId) -> &SourceFile {
        &self.files[id.0 as usize]
    }

    /// The text a span covers.
    pub fn snippet(&self, span: Span) -> &str {
        &self.file(span.file).text[span.range()]
    }

    /// Line and column of a span's first character.
    pub fn position(&self, span: Span) -> LineColumn {
        self.file(span.file).position(span.lo)
    }
}

impl SourceFile {
    fn new(name: String, text: String) -> Self {
        let mut line_starts = vec![0];
        line_starts.extend(text.bytes().enumerate().filter(|&(_, byte)| byte == b'\n').map(|(offset, _)| {
            // Text beyond 4 GiB is refused by the parser before any offset in it is used.
            u32::try_from(offset + 1).unwrap_or(u32::MAX)
        }));
        SourceFile { name, text, line_starts }
    }

    /// The name that diagnostics show.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The whole text.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The whole lines that hold some bytes, without the last line's end, and the number of the first, from 1.
    pub(crate) fn lines_of(&self, lo: u32, hi: u32) -> (Range<usize>, u32) {
        let first = self.line_starts.partition_point(|&start| start <= lo);
        let after = self.line_starts.partition_point(|&start| start <= hi);
        let start = self.line_starts[first - 1] as usize;
        let end = self.line_starts.get(after).map_or(self.text.len(), |&next| next as usize - 1);
        (start..end, u32::try_from(first).unwrap_or(u32::MAX))
    }

    /// Line and column of a byte offset, which is at most the text's length.
    pub fn position(&self, offset: u32) -> LineColumn {
        self.position_by(offset, |before| before.chars().count())
    }

    /// The same with the column in units of UTF-16, as editors count.
    pub fn position_utf16(&self, offset: u32) -> LineColumn {
        self.position_by(offset, |before| before.encode_utf16().count())
    }

    fn position_by(&self, offset: u32, width: fn(&str) -> usize) -> LineColumn {
        let line = self.line_starts.partition_point(|&start| start <= offset);
        let start = self.line_starts[line - 1] as usize;
        let column = width(&self.text[start..offset as usize]) + 1;
        let count = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        LineColumn { line: count(line), column: count(column) }
    }
}

/// A path without `.`, and without `..` but at its beginning.
pub(crate) fn normal_path(path: &Path) -> String {
    let mut parts: Vec<Component<'_>> = Vec::new();
    for part in path.components() {
        match (part, parts.last()) {
            (Component::ParentDir, Some(Component::Normal(_))) => {
                parts.pop();
            }
            // Nothing is above the root.
            (Component::CurDir, _) | (Component::ParentDir, Some(Component::RootDir)) => {}
            _ => parts.push(part),
        }
    }
    parts.into_iter().collect::<PathBuf>().to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn editors_count_in_units_of_utf16() {
        let mut sources = SourceMap::new();
        let file = sources.add("a.sesame", "a\nµ🤖x");
        let at =
            |offset| (sources.file(file).position(offset).column, sources.file(file).position_utf16(offset).column);
        assert_eq!(at(2), (1, 1));
        assert_eq!(at(4), (2, 2));
        assert_eq!(at(8), (3, 4), "a robot is one character and two units");
        assert_eq!(sources.file(file).position_utf16(9).line, 2);
    }

    #[test]
    fn lines_and_columns_count_from_one_and_in_characters() {
        let mut sources = SourceMap::new();
        let file = sources.add("a.sesame", "ab\nµx\n\n");
        let at = |offset| {
            let LineColumn { line, column } = sources.file(file).position(offset);
            (line, column)
        };
        assert_eq!(at(0), (1, 1));
        assert_eq!(at(2), (1, 3));
        assert_eq!(at(3), (2, 1));
        assert_eq!(at(5), (2, 2));
        assert_eq!(at(7), (3, 1));
        assert_eq!(at(8), (4, 1));
        let lines = |lo, hi| {
            let (range, first) = sources.file(file).lines_of(lo, hi);
            (&sources.file(file).text()[range], first)
        };
        assert_eq!(lines(0, 1), ("ab", 1));
        assert_eq!(lines(1, 2), ("ab", 1), "its line end is the line's");
        assert_eq!(lines(1, 5), ("ab\nµx", 1));
        assert_eq!(lines(7, 7), ("", 3));
        assert_eq!(lines(8, 8), ("", 4));
    }
}
