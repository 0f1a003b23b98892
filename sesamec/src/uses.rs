//! A thing of a space with its definition and all places that mention it: as text, and as JSON.

use std::fmt::Write as _;

use serde::Serialize;
use sesame_dsl::diagnostic::shortened;
use sesame_dsl::index::{Definition, DefinitionId, Index};
use sesame_dsl::location::Location;
use sesame_dsl::source::SourceMap;
use sesame_dsl::span::Span;

use crate::certificate::{self, CertificatePart};

/// Finds what a name of the file `file` stands for. What is wrong with the name comes back as a sentence or several.
pub(crate) fn find(sources: &SourceMap, index: &Index, file: &str, name: &str) -> Result<DefinitionId, String> {
    let found = index.find(name);
    match found[..] {
        [id] => Ok(id),
        [] => Err(unknown(sources, index, file, name)),
        [first, ..] => Err(ambiguous(sources, index, file, &found, first)),
    }
}

fn unknown(sources: &SourceMap, index: &Index, file: &str, name: &str) -> String {
    let mut message = format!("{file} declares nothing named `{name}`");
    if let Some((_, span)) = index.unread.iter().find(|(unread, _)| unread == name) {
        write!(message, " that could be read; see the error at {}", place(sources, *span)).expect(STRING);
        return message;
    }
    let unresolved = index.references.iter().filter(|reference| reference.target.is_none());
    let mentions: Vec<String> = unresolved
        .filter(|reference| sources.snippet(reference.span) == name)
        .map(|reference| place(sources, reference.span))
        .collect();
    if !mentions.is_empty() {
        write!(message, ", which is mentioned at {}", mentions.join(", ")).expect(STRING);
    }
    if let Some(similar) = index.most_similar(name) {
        write!(message, "; did you mean `{similar}`?").expect(STRING);
    }
    message
}

fn ambiguous(sources: &SourceMap, index: &Index, file: &str, found: &[DefinitionId], first: DefinitionId) -> String {
    let name = index.full_name(first);
    let places = |id: &DefinitionId| place(sources, index.definition(*id).span);
    if found.iter().all(|&id| index.full_name(id) == name) {
        let places: Vec<String> = found.iter().map(places).collect();
        return format!("{file} declares `{name}` more than once: at {}", places.join(", "));
    }
    let mut message = format!(
        "{} things in {file} have the name `{}`; name one with what it belongs to:",
        found.len(),
        index.definition(first).name
    );
    for id in found {
        let Definition { kind, .. } = index.definition(*id);
        write!(message, "\n  `{}`, a {} at {}", index.full_name(*id), kind.word(), places(id)).expect(STRING);
    }
    message
}

const STRING: &str = "a string takes all text";

/// Where something stands, as editors and compilers write it.
fn place(sources: &SourceMap, span: Span) -> String {
    let at = sources.position(span);
    format!("{}:{}:{}", sources.file(span.file).name(), at.line, at.column)
}

/// A definition with its doc comment, and each use with its line.
pub(crate) fn text(
    sources: &SourceMap,
    index: &Index,
    id: DefinitionId,
    certificate: Option<&CertificatePart>,
) -> String {
    let definition = index.definition(id);
    let mut out = String::new();
    let kind = definition.kind.word();
    writeln!(out, "{kind} `{}`, {}\n", index.full_name(id), place(sources, definition.span)).expect(STRING);
    for line in definition.doc.lines() {
        writeln!(out, "{}", format!("  /// {line}").trim_end()).expect(STRING);
    }
    for line in declaration(sources, definition) {
        writeln!(out, "{}", format!("  {line}").trim_end()).expect(STRING);
    }
    out.push('\n');
    if let Some(certificate) = certificate {
        writeln!(out, "{}", certificate::text(certificate)).expect(STRING);
    }
    let uses = uses(sources, index, id);
    out.push_str(if uses.is_empty() { "no uses\n" } else { &uses });
    out
}

/// The places that mention a definition, each with its line; empty where none does.
pub(crate) fn uses(sources: &SourceMap, index: &Index, id: DefinitionId) -> String {
    let uses: Vec<_> = index.uses(id).collect();
    let mut out = match uses.len() {
        0 => String::new(),
        1 => "1 use\n".to_owned(),
        n => format!("{n} uses\n"),
    };
    for used in uses {
        let within = index.definition(used.within);
        let place = place(sources, used.span);
        writeln!(out, "  {place}: in {} `{}`", within.kind.word(), index.full_name(used.within)).expect(STRING);
        writeln!(out, "      {}", line(sources, used.span)).expect(STRING);
    }
    out
}

/// The lines of a declaration, as far to the left as they go together.
fn declaration<'s>(sources: &'s SourceMap, definition: &Definition) -> Vec<&'s str> {
    let text = sources.file(definition.full_span.file).text();
    let lo = definition.full_span.range().start;
    let indent = lo - text[..lo].rfind('\n').map_or(0, |end| end + 1);
    let mut lines = sources.snippet(definition.full_span).lines();
    let first = lines.next().unwrap_or_default();
    let rest = lines.map(|line| {
        let blanks = line.len() - line.trim_start_matches(' ').len();
        &line[blanks.min(indent)..]
    });
    std::iter::once(first).chain(rest).collect()
}

/// The line that a span begins in, without the blanks around it.
fn line(sources: &SourceMap, span: Span) -> String {
    let text = sources.file(span.file).text();
    let lo = span.range().start;
    let start = text[..lo].rfind('\n').map_or(0, |end| end + 1);
    let end = text[lo..].find('\n').map_or(text.len(), |length| lo + length);
    shortened(text[start..end].trim().to_owned())
}

/// A definition and its uses.
/// A definition with its uses.
#[derive(Serialize)]
struct Explained<'a> {
    /// What is declared, for example `topic`.
    kind: &'static str,
    /// Its name.
    name: String,
    /// Where it is declared.
    at: Location<'a>,
    /// Its doc comment.
    doc: &'a str,
    /// The declaration as written.
    text: &'a str,
    /// For a monitor of a space without errors: its certificate as a tree.
    #[serde(skip_serializing_if = "Option::is_none")]
    certificate: Option<&'a CertificatePart>,
    /// Every place that mentions it.
    uses: Vec<Use<'a>>,
}

/// Something that a space declares.
#[derive(Serialize)]
struct Declared<'a> {
    /// What is declared, for example `topic`.
    kind: &'static str,
    /// Its name; that of a field or a parameter with what it belongs to.
    name: String,
    /// Where it is declared.
    at: Location<'a>,
    /// Its doc comment.
    doc: &'a str,
    /// The declaration as written.
    text: &'a str,
}

/// Everything that a space declares, in the order of declarations: as lines of text.
pub(crate) fn list(sources: &SourceMap, index: &Index) -> String {
    let mut out = String::new();
    for (id, definition) in ids(index) {
        let (kind, name, at) = (definition.kind.word(), index.full_name(id), place(sources, definition.span));
        let doc = definition.doc.lines().next().map_or_else(String::new, |line| format!("  {line}"));
        writeln!(out, "{kind} `{name}`, {at}{doc}").expect(STRING);
    }
    out
}

/// The same as a list in JSON, in ASCII and on one line.
pub(crate) fn list_json(sources: &SourceMap, index: &Index) -> String {
    let declared = ids(index).map(|(id, definition)| Declared {
        kind: definition.kind.word(),
        name: index.full_name(id),
        at: Location::with_utf16(sources, definition.span),
        doc: &definition.doc,
        text: sources.snippet(definition.full_span),
    });
    ascii(&declared.collect::<Vec<_>>())
}

fn ids(index: &Index) -> impl Iterator<Item = (DefinitionId, &Definition)> {
    index.definitions.iter().enumerate().map(|(id, definition)| (DefinitionId(id), definition))
}

/// A place that mentions a definition.
#[derive(Serialize)]
struct Use<'a> {
    /// The place.
    at: Location<'a>,
    /// The declaration that contains it.
    within: Within,
}

/// What mentions it.
#[derive(Serialize)]
struct Within {
    /// What is declared, for example `operation`.
    kind: &'static str,
    /// Its name.
    name: String,
}

/// A definition and its uses as one JSON object, in ASCII and on one line.
pub(crate) fn json(
    sources: &SourceMap,
    index: &Index,
    id: DefinitionId,
    certificate: Option<&CertificatePart>,
) -> String {
    let at = |span| Location::with_utf16(sources, span);
    let definition = index.definition(id);
    let explained = Explained {
        kind: definition.kind.word(),
        name: index.full_name(id),
        at: at(definition.span),
        doc: &definition.doc,
        text: sources.snippet(definition.full_span),
        certificate,
        uses: index
            .uses(id)
            .map(|used| {
                let within = index.definition(used.within);
                Use {
                    at: at(used.span),
                    within: Within { kind: within.kind.word(), name: index.full_name(used.within) },
                }
            })
            .collect(),
    };
    ascii(&explained)
}

/// A line of JSON.
fn ascii(shown: &impl Serialize) -> String {
    let mut out = String::new();
    // What is not ASCII may be obeyed by a terminal.
    for c in serde_json::to_string(shown).expect("strings and numbers serialise").chars() {
        if c.is_ascii() && !c.is_control() {
            out.push(c);
        } else {
            for unit in c.encode_utf16(&mut [0; 2]) {
                write!(out, "\\u{unit:04x}").expect(STRING);
            }
        }
    }
    out.push('\n');
    out
}

#[cfg(test)]
mod tests {
    use sesame_dsl::analyse;

    use super::*;

    const SPACE: &str = "space cell
system {
  message Zone { level: real[mm] }
  message Arm { level: real[mm] }
  /// What the zones report.
  ///
  /// One for each.
  topic zones = \"z/{a,b}\" : Zone
  topic broken
}
metric depth minimise = max(zones.level)
campaign c {
  objectives depth
  operations cut 1 per test // µ
}
operation cut on zones = blackhole
operation cat on zoness = blackhole
";

    fn explained(name: &str, text: &str) -> Result<(String, String), String> {
        let mut sources = SourceMap::new();
        let root = sources.add("a.sesame", text);
        let index = analyse(&sources, root).index;
        let id = find(&sources, &index, "a.sesame", name)?;
        Ok((super::text(&sources, &index, id, None), json(&sources, &index, id, None)))
    }

    #[test]
    fn a_thing_is_shown_with_its_comment_its_declaration_and_its_uses() {
        let (text, json) = explained("zones", SPACE).unwrap();
        insta::assert_snapshot!("uses_of_a_topic", text);
        let json: serde_json::Value = serde_json::from_str(&json).unwrap();
        assert_eq!(json["kind"], "topic");
        assert_eq!(json["text"], "topic zones = \"z/{a,b}\" : Zone");
        let uses = json["uses"].as_array().unwrap();
        let within: Vec<_> = uses.iter().map(|used| used["within"]["name"].as_str().unwrap()).collect();
        assert_eq!(within, ["depth", "cut"]);
        assert_eq!(uses[0]["at"]["start"]["line"], 11);
    }

    #[test]
    fn everything_that_is_declared_is_listed_with_its_place() {
        let mut sources = SourceMap::new();
        let root = sources.add("a.sesame", SPACE);
        let index = analyse(&sources, root).index;
        let text = list(&sources, &index);
        assert!(text.starts_with("space `cell`, a.sesame:1:7\nmessage `Zone`, a.sesame:3:11\n"), "{text}");
        assert!(text.contains("\nfield `Zone.level`, a.sesame:3:18\n"), "{text}");
        assert!(text.contains("\ntopic `zones`, a.sesame:8:9  What the zones report.\n"), "{text}");
        let json: Vec<serde_json::Value> = serde_json::from_str(&list_json(&sources, &index)).unwrap();
        assert_eq!(json.len(), text.lines().count());
        let depth = json.iter().find(|declared| declared["name"] == "depth").unwrap();
        assert_eq!(depth["kind"], "metric");
        assert_eq!(depth["text"], "metric depth minimise = max(zones.level)");
    }

    #[test]
    fn a_declaration_of_several_lines_keeps_its_shape() {
        let text =
            explained("c", &SPACE.replace("\ncampaign c", "\n  campaign c").replace("\n}\nop", "\n  }\nop")).unwrap().0;
        let shape = "  campaign c {\n  objectives depth\n  operations cut 1 per test // µ\n  }\n";
        assert!(text.contains(shape), "{text}");
    }

    #[test]
    fn json_is_ascii_for_any_file() {
        let text = "space s /// \u{202e}🤖\u{1b}[31m\nmetric m minimise { hook on x }";
        let json = explained("m", text).unwrap().1;
        assert!(json.trim_end().chars().all(|c| c.is_ascii() && !c.is_control()), "{json}");
        let json: serde_json::Value = serde_json::from_str(&json).unwrap();
        assert_eq!(json["doc"], "\u{202e}🤖\u{1b}[31m");
    }

    #[test]
    fn what_is_not_one_thing_is_said_with_a_way_out() {
        let wrong = |name: &str| explained(name, SPACE).unwrap_err();
        assert_eq!(
            wrong("level"),
            "2 things in a.sesame have the name `level`; name one with what it belongs to:\n  \
             `Zone.level`, a field at a.sesame:3:18\n  `Arm.level`, a field at a.sesame:4:17"
        );
        assert!(explained("zones.level", SPACE).is_ok());
        let zoness =
            "a.sesame declares nothing named `zoness`, which is mentioned at a.sesame:17:18; did you mean `zones`?";
        assert_eq!(wrong("zoness"), zoness);
        assert_eq!(wrong("Zone.levl"), "a.sesame declares nothing named `Zone.levl`; did you mean `Zone.level`?");
        assert_eq!(wrong("quux"), "a.sesame declares nothing named `quux`");
        assert_eq!(
            wrong("broken"),
            "a.sesame declares nothing named `broken` that could be read; see the error at a.sesame:9:9"
        );
        let twice = format!("{SPACE}operation cut on zones = blackhole");
        let twice = explained("cut", &twice).unwrap_err();
        assert_eq!(twice, "a.sesame declares `cut` more than once: at a.sesame:16:11, a.sesame:18:11");
    }
}
