//! A place in a file as JSON shows it to other programs.

use serde::Serialize;

use crate::source::{SourceFile, SourceMap};
use crate::span::Span;

/// A place in a file; its end is exclusive.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Location<'a> {
    /// The file's name as shown to people.
    pub file: &'a str,
    /// Where it starts.
    pub start: Position,
    /// Where it ends.
    pub end: Position,
}

/// A position in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Position {
    /// Bytes before it.
    pub byte: u32,
    /// Its line, from 1.
    pub line: u32,
    /// Its column in characters, from 1.
    pub column: u32,
    /// Its column in units of UTF-16, from 1; only for definitions and uses ([`Location::with_utf16`]).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub utf16_column: Option<u32>,
}

impl<'a> Location<'a> {
    /// The place of a span.
    pub fn new(sources: &'a SourceMap, span: Span) -> Self {
        Location::between(sources.file(span.file), span, |_| None)
    }

    /// The place of a span, also with columns as editors count them.
    pub fn with_utf16(sources: &'a SourceMap, span: Span) -> Self {
        let file = sources.file(span.file);
        Location::between(file, span, |byte| Some(file.position_utf16(byte).column))
    }

    fn between(file: &'a SourceFile, span: Span, utf16_column: impl Fn(u32) -> Option<u32>) -> Self {
        let position = |byte| {
            let at = file.position(byte);
            Position { byte, line: at.line, column: at.column, utf16_column: utf16_column(byte) }
        };
        Location { file: file.name(), start: position(span.lo), end: position(span.hi) }
    }
}
