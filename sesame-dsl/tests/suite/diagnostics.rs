//! Diagnostics and their renderers, over all files of the corpus: what they may say, and that every code occurs.

use std::collections::BTreeSet;

use sesame_dsl::analyse;
use sesame_dsl::diagnostic::{CODES, page, render};
use sesame_dsl::source::SourceMap;

use crate::files::{analyse_text, corpus};
use crate::fixes::diagnostics_after;

#[test]
fn nothing_in_a_file_becomes_a_command_of_github() {
    let mut sources = SourceMap::new();
    let file = sources.add("a,line=1::b%.sesame", "space a\n::error::x\nspace \"%0A::warning::x\"");
    let analysis = analyse(&sources, file);
    let said = render::github(&analysis.diagnostics, &sources);
    assert_eq!(said.lines().count(), analysis.diagnostics.len());
    assert!(said.lines().all(|line| line.starts_with("::error file=a%2Cline=1%3A%3Ab%25.sesame,line=")), "{said}");
}

#[test]
fn nothing_in_a_file_becomes_a_command_of_a_terminal() {
    let obeyed = |c: char| {
        (c.is_control() && c != '\n')
            || matches!(c, '\u{61c}' | '\u{200e}'..='\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
    };
    let hostile = "\x1b]0;owned\x07\u{9b}31m\x08\u{7f}\u{202e}\u{2066}\r\u{200f}";
    // In texts, and in the place of words.
    for sign in ["\"", " "] {
        for (name, text) in corpus("bad") {
            let text = text.replace(sign, &format!("{sign}{hostile}"));
            let (sources, analysis) = analyse_text(&format!("{name}\x1b[31m\u{202e}"), &text);
            assert!(analysis.has_errors() || !analysis.diagnostics.is_empty(), "{name}");
            for said in [
                render::human(&analysis.diagnostics, &sources, false),
                render::short(&analysis.diagnostics, &sources),
                render::github(&analysis.diagnostics, &sources),
                render::json(&analysis.diagnostics, &sources),
            ] {
                assert_eq!(said.chars().find(|&c| obeyed(c)), None, "{name}: {said:?}");
            }
            let json = render::json(&analysis.diagnostics, &sources);
            for (line, found) in json.lines().zip(&analysis.diagnostics) {
                let value: serde_json::Value = serde_json::from_str(line).unwrap();
                assert_eq!(value["title"], found.title.as_str(), "JSON loses nothing");
            }
        }
    }
}

#[test]
fn what_quotes_a_token_of_megabytes_is_short() {
    let long = "a".repeat(2 << 20);
    for text in [
        format!("space {long}\x01"),
        format!("space s {long}"),
        format!("space s metric {long} = {long}x"),
        format!("space s metric {long} = 5 5"),
    ] {
        let (sources, analysis) = analyse_text("long", &text);
        assert!(analysis.has_errors());
        let shown = render::human(&analysis.diagnostics, &sources, false);
        assert!(shown.len() < 10_000 * analysis.diagnostics.len(), "{} bytes", shown.len());
        for found in &analysis.diagnostics {
            let quoted = [&found.title, &found.label].into_iter().chain(&found.notes);
            assert!(quoted.map(String::len).sum::<usize>() < 10_000, "{}", found.code);
        }
    }
}

#[test]
fn every_code_occurs_in_the_corpus_file_named_after_it() {
    let files = corpus("bad");
    for (code, page) in CODES {
        let prefix = format!("{}_", code.text().to_lowercase());
        let own: Vec<_> = files.iter().filter(|(name, _)| name.starts_with(&prefix)).collect();
        assert!(!own.is_empty(), "no file tests/bad/{prefix}….sesame");
        for (name, text) in own {
            let found: BTreeSet<_> = diagnostics_after(text).iter().map(|diagnostic| diagnostic.code).collect();
            assert!(found.contains(code), "{name} gives {found:?}");
        }
        assert!(page.starts_with(&format!("# {code}: ")), "the page of {code} begins with its heading");
    }
}

#[test]
fn codes_are_unique_and_sorted_and_found_in_any_case() {
    assert!(CODES.windows(2).all(|pair| pair[0].0 < pair[1].0));
    assert_eq!(page("e0203"), page("E0203"));
    assert!(page("E0203").is_some());
    assert_eq!(page("E9999"), None);
}

#[test]
fn ten_mistakes_give_ten_diagnostics_at_once() {
    let text = include_str!("../bad/ten_mistakes.sesame");
    let (sources, analysis) = analyse_text("ten_mistakes", text);
    let lines: Vec<u32> =
        analysis.diagnostics.iter().map(|diagnostic| sources.position(diagnostic.span).line).collect();
    // Each mistake is marked in the file by a comment on its line.
    let marked: Vec<u32> =
        (1..).zip(text.lines()).filter(|(_, line)| line.contains("// mistake")).map(|(n, _)| n).collect();
    assert_eq!(marked.len(), 10);
    assert_eq!(lines, marked);
}

#[test]
fn one_line_and_json_say_the_same_as_the_long_form() {
    let (sources, analysis) = analyse_text("ten_mistakes", include_str!("../bad/ten_mistakes.sesame"));
    insta::assert_snapshot!("ten_mistakes_short", render::short(&analysis.diagnostics, &sources));
    insta::assert_snapshot!("ten_mistakes_json", render::json(&analysis.diagnostics, &sources));
    insta::assert_snapshot!("ten_mistakes_github", render::github(&analysis.diagnostics, &sources));
    let json = render::json(&analysis.diagnostics, &sources);
    for (line, diagnostic) in json.lines().zip(&analysis.diagnostics) {
        let value: serde_json::Value = serde_json::from_str(line).unwrap();
        assert_eq!(value["code"], diagnostic.code.text());
        assert_eq!(value["primary"]["at"]["start"]["byte"], diagnostic.span.lo);
    }
}
