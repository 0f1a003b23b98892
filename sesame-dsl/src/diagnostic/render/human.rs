//! For people: with the lines of the source.

use std::ops::Range;

use annotate_snippets::{AnnotationKind, Group, Level, Patch, Renderer, Snippet};

use super::terminal::for_terminals;
use crate::diagnostic::{Diagnostic, Severity, visible_lines};
use crate::source::{SourceFile, SourceMap};
use crate::span::Span;

/// The most bytes of source lines that a suggestion shows; a longer one is shown as its message only.
const LONGEST_PATCH: usize = 4096;

/// Diagnostics with the source lines they refer to, separated by empty lines; ends with a newline if there is any.
pub fn human(diagnostics: &[Diagnostic], sources: &SourceMap, colour: bool) -> String {
    let renderer = if colour { Renderer::styled() } else { Renderer::plain() };
    let rendered: Vec<String> =
        diagnostics.iter().map(|diagnostic| one(&for_terminals(diagnostic), sources, &renderer)).collect();
    // The renderer replaces most control characters in source lines, but not all. Colours are its own.
    let text = rendered.join("\n");
    if !colour {
        return visible_lines(&text).into_owned();
    }
    text.split('\x1b').map(visible_lines).collect::<Vec<_>>().join("\x1b")
}

/// The lines of a file that contain some spans. The renderer reads everything that it is given, and a large file may
/// have many diagnostics.
struct Excerpt<'a> {
    file: &'a SourceFile,
    lines: Range<usize>,
    first: u32,
}

impl<'a> Excerpt<'a> {
    fn of(file: &'a SourceFile, spans: impl Iterator<Item = Span> + Clone) -> Self {
        let lo = spans.clone().map(|span| span.lo).min().unwrap_or(0);
        let hi = spans.map(|span| span.hi).max().unwrap_or(lo);
        let (lines, first) = file.lines_of(lo, hi);
        Excerpt { file, lines, first }
    }

    fn text(&self) -> &'a str {
        &self.file.text()[self.lines.clone()]
    }

    /// Where in these lines a span is.
    fn range(&self, span: Span) -> Range<usize> {
        let range = span.range();
        range.start - self.lines.start..range.end - self.lines.start
    }

    fn snippet<T: Clone>(&self) -> Snippet<'a, T> {
        Snippet::source(self.text()).path(visible_lines(self.file.name())).line_start(self.first as usize)
    }
}

fn one(diagnostic: &Diagnostic, sources: &SourceMap, renderer: &Renderer) -> String {
    let level = match diagnostic.severity() {
        Severity::Error => Level::ERROR,
        Severity::Warning => Level::WARNING,
    };
    let within = |span: Span| span.file == diagnostic.span.file;
    let secondary = diagnostic.secondary.iter().filter(|(span, _)| within(*span));
    let spans = std::iter::once(diagnostic.span).chain(secondary.clone().map(|(span, _)| *span));
    let excerpt = Excerpt::of(sources.file(diagnostic.span.file), spans);
    let primary = AnnotationKind::Primary.span(excerpt.range(diagnostic.span));
    let mut snippet = excerpt.snippet().annotation(primary.label(diagnostic.label.as_str()));
    for (span, label) in secondary {
        snippet = snippet.annotation(AnnotationKind::Context.span(excerpt.range(*span)).label(label.as_str()));
    }
    let mut main = Group::with_title(level.primary_title(diagnostic.title.as_str()).id(diagnostic.code.text()));
    main = main.element(snippet);
    for (span, label) in diagnostic.secondary.iter().filter(|(span, _)| !within(*span)) {
        let other = Excerpt::of(sources.file(span.file), std::iter::once(*span));
        let annotation = AnnotationKind::Context.span(other.range(*span)).label(label.as_str());
        main = main.element(other.snippet().annotation(annotation));
    }
    for note in &diagnostic.notes {
        main = main.element(Level::NOTE.message(note.as_str()));
    }
    let mut patched = Vec::new();
    for suggestion in &diagnostic.suggestions {
        let Some((first, _)) = suggestion.edits.first() else { continue };
        let excerpt = Excerpt::of(sources.file(first.file), suggestion.edits.iter().map(|(span, _)| *span));
        let written: usize = suggestion.edits.iter().map(|(_, replacement)| replacement.len()).sum();
        if excerpt.text().len() + written > LONGEST_PATCH {
            main = main.element(Level::HELP.message(suggestion.message.as_str()));
            continue;
        }
        let mut patches = excerpt.snippet();
        for (span, replacement) in &suggestion.edits {
            patches = patches.patch(Patch::new(excerpt.range(*span), replacement.as_str()));
        }
        patched.push(Level::HELP.secondary_title(suggestion.message.as_str()).element(patches));
    }
    let report: Vec<Group<'_>> = std::iter::once(main).chain(patched).collect();
    format!("{}\n", renderer.render(&report))
}
