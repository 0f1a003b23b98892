//! What every text is owed: an answer, in every rendering, that points into the file; and to be formatted once for all,
//! or to be refused with what is wrong.

use sesame_dsl::diagnostic::{Diagnostic, render};
use sesame_dsl::format::format;
use sesame_dsl::index::Index;
use sesame_dsl::source::SourceMap;
use sesame_dsl::span::{FileId, Span};
use sesame_dsl::{Analysis, analyse, load_imports};

const IMPORTED: &str = include_str!("../good/kuka_cell.sesame");

/// A text as a file, with what it imports: itself by its own name, a space that is in order by names that speak of a
/// cell; no other file can be read.
fn sources_of(text: &str) -> (SourceMap, FileId) {
    let mut sources = SourceMap::new();
    let file = sources.add("a.sesame", text);
    load_imports(&mut sources, file, |name| match name {
        "a.sesame" => Ok(text.to_owned()),
        _ if name.contains("cell") => Ok(IMPORTED.to_owned()),
        _ => Err("there is no such file".to_owned()),
    });
    (sources, file)
}

pub(crate) fn analyse_text(text: &str) -> (SourceMap, FileId, Analysis) {
    let (sources, file) = sources_of(text);
    let analysis = analyse(&sources, file);
    (sources, file, analysis)
}

fn spans(diagnostic: &Diagnostic) -> impl Iterator<Item = Span> + '_ {
    let edits = diagnostic.suggestions.iter().flat_map(|suggestion| &suggestion.edits).map(|(span, _)| *span);
    std::iter::once(diagnostic.span).chain(diagnostic.secondary.iter().map(|(span, _)| *span)).chain(edits)
}

/// Insists on a sound answer, and gives it.
pub(crate) fn has_a_sound_answer(text: &str) -> (FileId, Analysis) {
    let (sources, root, analysis) = analyse_text(text);
    assert_eq!(analysis.model.is_some(), !analysis.has_errors());
    for span in analysis.diagnostics.iter().flat_map(spans) {
        let text = sources.file(span.file).text();
        assert!(text.get(span.range()).is_some(), "{span:?} is not in the file");
    }
    let Index { definitions, references, unread } = &analysis.index;
    for definition in definitions {
        // The topics of a service or an action stand where its name does.
        let written = sources.snippet(definition.span);
        let of_actions = sesame_plan::action::PARTS.map(|part| part.name);
        let ends = ["request", "reply"].into_iter().chain(of_actions);
        let is_part = || ends.into_iter().any(|end| definition.name == format!("{written}_{end}"));
        assert!(definition.name == written || is_part(), "{definition:?}");
        let within = definition.full_span.range();
        assert!(sources.file(definition.span.file).text().get(within).is_some(), "{definition:?}");
    }
    for reference in references {
        assert!(reference.within.0 < definitions.len(), "{reference:?}");
        match reference.target {
            Some(target) => assert_eq!(sources.snippet(reference.span), analysis.index.definition(target).name),
            None => assert!(analysis.has_errors(), "`{}` does not resolve", sources.snippet(reference.span)),
        }
    }
    assert!(unread.is_empty() || analysis.has_errors());
    render::human(&analysis.diagnostics, &sources, true);
    assert_eq!(render::short(&analysis.diagnostics, &sources).lines().count(), analysis.diagnostics.len());
    assert_eq!(render::json(&analysis.diagnostics, &sources).lines().count(), analysis.diagnostics.len());
    assert_eq!(render::github(&analysis.diagnostics, &sources).lines().count(), analysis.diagnostics.len());
    // What formatting must keep besides, `format` makes sure of by itself.
    if let Ok(formatted) = format(&sources, root) {
        let (sources, file) = sources_of(&formatted);
        assert_eq!(format(&sources, file).as_ref(), Ok(&formatted));
    }
    (root, analysis)
}
