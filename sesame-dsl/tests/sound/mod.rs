//! What every text is owed: an answer, in every rendering, that points into the file.

use sesame_dsl::diagnostic::{Diagnostic, render};
use sesame_dsl::source::SourceMap;
use sesame_dsl::span::{FileId, Span};
use sesame_dsl::{Analysis, analyse};

pub(crate) fn analyse_text(text: &str) -> (SourceMap, FileId, Analysis) {
    let mut sources = SourceMap::new();
    let file = sources.add("a.sesame", text);
    let analysis = analyse(&sources, file);
    (sources, file, analysis)
}

fn spans(diagnostic: &Diagnostic) -> impl Iterator<Item = Span> + '_ {
    let edits = diagnostic.suggestions.iter().flat_map(|suggestion| &suggestion.edits).map(|(span, _)| *span);
    std::iter::once(diagnostic.span).chain(diagnostic.secondary.iter().map(|(span, _)| *span)).chain(edits)
}

/// Insists on a sound answer, and gives it.
pub(crate) fn has_a_sound_answer(text: &str) -> Analysis {
    let (sources, file, analysis) = analyse_text(text);
    assert_eq!(analysis.model.is_some(), !analysis.has_errors());
    for span in analysis.diagnostics.iter().flat_map(spans) {
        assert_eq!(span.file, file);
        assert!(text.get(span.range()).is_some(), "{span:?} is not in the file");
    }
    render::human(&analysis.diagnostics, &sources, true);
    assert_eq!(render::short(&analysis.diagnostics, &sources).lines().count(), analysis.diagnostics.len());
    assert_eq!(render::json(&analysis.diagnostics, &sources).lines().count(), analysis.diagnostics.len());
    analysis
}
