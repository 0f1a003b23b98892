//! The formatter on every file there is, and on the same files with their blanks, line ends and comments shuffled.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use pest::Parser as _;
use proptest::prelude::*;
use sesame_dsl::analyse;
use sesame_dsl::diagnostic::{Diagnostic, Severity};
use sesame_dsl::format::format;
use sesame_dsl::source::SourceMap;
use sesame_grammar::{GRAMMAR, Rule, SesameParser};

#[expect(clippy::disallowed_methods, reason = "the crate is pure; its tests read their corpus")]
fn files() -> Vec<(PathBuf, String)> {
    let crate_folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folders = [
        "tests/good",
        "tests/bad",
        "tests/format",
        "../examples/a50_cell",
        "../examples/kuka_cell",
        "../examples/transport",
        "../examples/two_drones",
        "../examples/two_robots",
        "../examples/warehouse",
    ];
    let mut files = Vec::new();
    for folder in folders {
        for entry in std::fs::read_dir(crate_folder.join(folder)).expect("the corpus can be listed") {
            let path = entry.expect("the corpus can be listed").path();
            if path.extension().is_some_and(|extension| extension == "sesame") {
                let text = std::fs::read_to_string(&path).expect("the corpus is text");
                files.push((path, text));
            }
        }
    }
    files.sort();
    files
}

fn formatted(text: &str) -> Result<String, Vec<Diagnostic>> {
    let mut sources = SourceMap::new();
    let root = sources.add("a.sesame", text);
    format(&sources, root)
}

/// Everything that is neither blank nor line end.
fn ink(text: &str) -> String {
    text.chars().filter(|c| !c.is_whitespace() && *c != '\u{FEFF}').collect()
}

/// What a text means: its model without places, or else its diagnostics without theirs. Both may quote the text.
fn meaning(text: &str) -> Vec<String> {
    let mut sources = SourceMap::new();
    let root = sources.add("a.sesame", text);
    let analysis = analyse(&sources, root);
    if let Some(model) = analysis.model {
        let model = format!("{model:#?}");
        let places = |line: &&str| !["lo: ", "hi: ", "line: "].iter().any(|place| line.trim_start().starts_with(place));
        return model.lines().filter(places).map(ink).collect();
    }
    let said = analysis.diagnostics.iter().map(|found| format!("{} {} {}", found.code, found.title, found.label));
    said.map(|said| ink(&said)).collect()
}

fn comments(text: &str) -> Vec<&str> {
    outside_of_texts(text).into_iter().filter(|piece| piece.starts_with("//")).map(str::trim_end).collect()
}

/// A text in pieces: comments, quoted texts, blanks, and what is between.
fn outside_of_texts(text: &str) -> Vec<&str> {
    let mut pieces = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let blank = |c: char| c.is_ascii_whitespace() || c == '\u{FEFF}';
        let end = if rest.starts_with("//") {
            rest.find('\n')
        } else if first == '"' {
            let mut escaped = false;
            let closing = rest[1..].find(|c| {
                let closes = c == '"' && !escaped;
                escaped = c == '\\' && !escaped;
                closes
            });
            closing.map(|at| at + 2)
        } else if blank(first) {
            rest.find(|c| !blank(c))
        } else {
            rest.char_indices()
                .map(|(at, _)| at)
                .skip(1)
                .find(|&at| rest[at..].starts_with("//") || rest[at..].starts_with(|c| blank(c) || c == '"'))
        };
        let (piece, next) = rest.split_at(end.unwrap_or(rest.len()));
        pieces.push(piece);
        rest = next;
    }
    pieces
}

fn is_formatted_well(text: &str) {
    let Ok(once) = formatted(text) else { return };
    assert_eq!(ink(&once), ink(text), "nothing but blanks and line ends is changed:\n{once}");
    assert_eq!(comments(&once), comments(text), "every comment survives:\n{once}");
    let (before, after) = (meaning(text), meaning(&once));
    let different = before.iter().zip(&after).find(|(before, after)| before != after);
    assert_eq!((different, before.len()), (None, after.len()), "it means the same:\n{once}");
    assert_eq!(formatted(&once).as_ref(), Ok(&once), "formatting again changes nothing");
    assert!(!once.contains('\r') && !once.contains("\n\n\n") && !once.starts_with('\n'), "{once}");
    assert!(once.is_empty() || once.ends_with('\n') && !once.ends_with("\n\n"), "{once}");
    assert!(once.lines().all(|line| !line.ends_with(' ')), "{once}");
}

#[test]
fn every_file_keeps_its_meaning_and_comments_and_is_formatted_once_for_all() {
    let files = files();
    let readable = files.iter().filter(|(_, text)| formatted(text).is_ok()).count();
    assert!(readable > 40, "{readable} files have no syntax errors");
    for (_, text) in &files {
        is_formatted_well(text);
    }
}

/// No test formats a construct that is missing in the corpus: if you add one to the grammar, add it to the corpus,
/// too.
#[test]
fn every_construct_of_the_grammar_is_in_a_file_that_is_formatted() {
    let mut seen = BTreeSet::new();
    for (_, text) in files().iter().filter(|(_, text)| formatted(text).is_ok()) {
        let pairs = SesameParser::parse(Rule::file, text).expect("the entry rule accepts every text");
        seen.extend(pairs.flatten().map(|pair| pair.as_rule()));
    }
    // Silent rules and what atomic ones are made of give no pairs; the others are of mistakes and of later versions.
    let silent = |name: &str| {
        let mut definitions = GRAMMAR.lines().filter_map(|line| line.split_once('='));
        definitions.any(|(of, body)| of.trim() == name && body.trim_start().starts_with('_'))
    };
    let inner = ["EOI", "fields_not_closed", "id_char", "identifier", "keyword", "per_symbol", "unit_symbol"];
    let of_mistakes = ["error_", "one_", "unsupported_"];
    let words_of_later = ["kind_name", "not_closed", "strategy_name", "transport_name"];
    let unseen: Vec<String> = Rule::all_rules()
        .iter()
        .filter(|rule| !seen.contains(rule))
        .map(|rule| format!("{rule:?}"))
        .filter(|name| !silent(name) && !of_mistakes.iter().any(|prefix| name.starts_with(prefix)))
        .filter(|name| !inner.contains(&name.as_str()) && !words_of_later.contains(&name.as_str()))
        .collect();
    assert_eq!(unseen, Vec::<String>::new(), "add these to a file of `tests/good`");
}

#[test]
fn the_layout_of_an_untidy_file() {
    insta::assert_snapshot!(formatted(include_str!("../format/untidy.sesame")).unwrap());
}

#[test]
fn a_file_with_syntax_errors_gives_its_errors_and_nothing_else() {
    let errors = formatted("space a\nmetric = 1\noperation\n").unwrap_err();
    assert_eq!(errors.len(), 2);
    assert!(errors.iter().all(|error| error.severity() == Severity::Error));
}

#[test]
fn names_and_units_need_not_be_right() {
    assert_eq!(formatted("metric m  =  last( nowhere )*3parsec").unwrap(), "metric m = last(nowhere) * 3parsec\n");
}

#[test]
fn a_byte_order_mark_is_a_blank_between_words_and_stays_in_texts_and_comments() {
    let joined = "\u{FEFF}space a \u{FEFF} // b\u{FEFF}c\n\u{FEFF}import \"d\u{FEFF}.sesame\"\n";
    assert_eq!(
        formatted(joined).unwrap(),
        "space a  // b\u{FEFF}c\nimport \"d\u{FEFF}.sesame\"\n",
        "a byte order mark is a blank between words, and a sign in texts and comments"
    );
}

#[test]
fn an_empty_file_stays_empty() {
    assert_eq!(formatted("").unwrap(), "");
    assert_eq!(formatted("\u{FEFF} \r\n\n").unwrap(), "");
    assert_eq!(formatted(" // alone").unwrap(), "// alone\n");
}

#[test]
fn windows_line_ends_become_plain_ones() {
    assert_eq!(
        formatted("space a\r\n\r\n\r\n/// b \r\nspace b // c\r\n").unwrap(),
        "space a\n\n/// b\nspace b  // c\n"
    );
}

#[test]
fn a_column_stays_aligned_when_a_name_grows() {
    let text = "topic a   = \"x\" : int\ntopic abcdef = \"x\" : int\n\ntopic b = \"x\" : int\n";
    let text = format!("system {{\n{text}}}\n");
    assert_eq!(
        formatted(&text).unwrap(),
        "system {\n  topic a      = \"x\" : int\n  topic abcdef = \"x\" : int\n\n  topic b = \"x\" : int\n}\n"
    );
}

/// What may stand where there were blanks.
const BLANKS: &[&str] =
    &[" ", " ", "   ", "\t", "\n", "\n\n\n", "\r\n", " // c\n", "\n    // d é \"\n\n", "\n//// {\n"];

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, ..ProptestConfig::default() })]

    #[test]
    fn any_layout_of_a_file_keeps_its_meaning_and_comments_and_is_formatted_once_for_all(
        file: prop::sample::Index,
        blanks in prop::collection::vec(prop::sample::select(BLANKS), 40..200),
        kept in 0..4_usize,
    ) {
        let files = files();
        let (_, text) = file.get(&files);
        let mut blanks = blanks.iter().cycle();
        let mut shuffled = String::new();
        let mut after_comment = false;
        for (at, piece) in outside_of_texts(text).into_iter().enumerate() {
            let blank = piece.trim_matches(|c: char| c.is_ascii_whitespace() || c == '\u{FEFF}').is_empty();
            // Some stay as they are, so that columns and blocks on one line occur too.
            if blank && at % (kept + 1) == 0 {
                shuffled.push_str(if after_comment { "\n" } else { "" });
                shuffled.push_str(blanks.next().expect("it never ends"));
            } else {
                shuffled.push_str(piece);
            }
            after_comment = piece.starts_with("//");
        }
        is_formatted_well(&shuffled);
    }
}

#[test]
fn examples_and_new_projects_are_in_the_layout() {
    let template = include_str!("../../../templates/project/space.sesame.tera").replace("{{ name }}", "demo");
    let examples = files().into_iter().filter(|(path, _)| path.to_string_lossy().contains("examples"));
    for (path, text) in examples.chain([("the space of a new project".into(), template)]) {
        assert_eq!(formatted(&text).unwrap(), text, "{}: `sesamec fmt` brings it into the layout", path.display());
    }
}
