//! For people: with the lines of the source.

use annotate_snippets::{AnnotationKind, Group, Level, Patch, Renderer, Snippet};

use super::for_terminals;
use crate::diagnostic::{Diagnostic, Severity, hidden, visible};
use crate::source::SourceMap;
use crate::span::Span;

/// Diagnostics with the source lines they speak of, an empty line between two; ends with a newline if there is any.
pub fn human(diagnostics: &[Diagnostic], sources: &SourceMap, colour: bool) -> String {
    let renderer = if colour { Renderer::styled() } else { Renderer::plain() };
    let rendered: Vec<String> =
        diagnostics.iter().map(|diagnostic| one(&for_terminals(diagnostic), sources, &renderer)).collect();
    // The renderer replaces most of what a terminal obeys in source lines, but not all. Colours are its own.
    rendered.join("\n").chars().map(|c| if hidden(c) && !(colour && c == '\x1b') { '\u{fffd}' } else { c }).collect()
}

fn one(diagnostic: &Diagnostic, sources: &SourceMap, renderer: &Renderer) -> String {
    let level = match diagnostic.severity() {
        Severity::Error => Level::ERROR,
        Severity::Warning => Level::WARNING,
    };
    let file = sources.file(diagnostic.span.file);
    let within = |span: Span| span.file == diagnostic.span.file;
    let mut snippet = Snippet::source(file.text()).path(visible(file.name())).line_start(1);
    let primary = AnnotationKind::Primary.span(diagnostic.span.range());
    snippet = snippet.annotation(primary.label(diagnostic.label.as_str()));
    for (span, label) in diagnostic.secondary.iter().filter(|(span, _)| within(*span)) {
        snippet = snippet.annotation(AnnotationKind::Context.span(span.range()).label(label.as_str()));
    }
    let mut main = Group::with_title(level.primary_title(diagnostic.title.as_str()).id(diagnostic.code.text()));
    main = main.element(snippet);
    for (span, label) in diagnostic.secondary.iter().filter(|(span, _)| !within(*span)) {
        let other = sources.file(span.file);
        let annotation = AnnotationKind::Context.span(span.range()).label(label.as_str());
        main = main
            .element(Snippet::source(other.text()).path(visible(other.name())).line_start(1).annotation(annotation));
    }
    for note in &diagnostic.notes {
        main = main.element(Level::NOTE.message(note.as_str()));
    }
    let mut report = vec![main];
    for suggestion in &diagnostic.suggestions {
        let Some((first, _)) = suggestion.edits.first() else { continue };
        let target = sources.file(first.file);
        let mut patches = Snippet::source(target.text()).path(visible(target.name())).line_start(1);
        for (span, replacement) in &suggestion.edits {
            patches = patches.patch(Patch::new(span.range(), replacement.as_str()));
        }
        report.push(Level::HELP.secondary_title(suggestion.message.as_str()).element(patches));
    }
    format!("{}\n", renderer.render(&report))
}
