//! The documentation against the compiler: every example in it is checked, and what it lists is complete.
//!
//! Examples are fenced blocks whose first word is `sesame`. A plain one is a whole file, as is every one that names its
//! `space`. The standard space (`sesame,standard`, once, in the language reference) is one too; as `cell.sesame` it can
//! be imported, and it completes the others:
//!
//! | info string       | how the block is read                                                     |
//! |-------------------|---------------------------------------------------------------------------|
//! | `sesame,fragment` | after the standard space                                                  |
//! | `sesame,system`   | inside the `system { … }` of the standard space, at its beginning         |
//! | `sesame,E0402`    | after the standard space, and gives exactly this diagnostic               |
//!
//! A block of any language with `from=PATH` stands in that file of the project word for word, indentation aside, where
//! templates are taken to be of a project `demo`. `text,keywords` lists reserved words.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use sesame_dsl::diagnostic::{CODES, Severity, render};
use sesame_dsl::source::SourceMap;
use sesame_dsl::{analyse, load_imports, units};

/// The page that has the standard space.
const STANDARD: &str = "docs/language/README.md";

const GRAMMAR: &str = include_str!("../../../grammars/sesame.pest");

fn project() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the crate lies in the project").to_owned()
}

#[expect(clippy::disallowed_methods, reason = "the crate is pure; this test reads the project's documentation")]
fn read(path: &str) -> String {
    let file = project().join(path);
    std::fs::read_to_string(&file).unwrap_or_else(|error| panic!("{}: {error}", file.display()))
}

#[expect(clippy::disallowed_methods, reason = "the crate is pure; this test reads the project's documentation")]
fn pages() -> Vec<(String, String)> {
    let mut paths: Vec<String> = Vec::new();
    let mut folders = vec!["docs".to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(project().join(&folder)).expect("the project has documentation") {
            let entry = entry.expect("the folder can be listed");
            let path = format!("{folder}/{}", entry.file_name().to_str().expect("names are plain"));
            if entry.path().is_dir() {
                folders.push(path);
            } else if entry.path().extension() == Some("md".as_ref()) {
                paths.push(path);
            }
        }
    }
    assert!(paths.len() >= 2, "guide and reference are there");
    let examples = ["a50_cell", "kuka_cell", "transport", "two_drones", "two_robots", "warehouse"];
    paths.extend(examples.map(|example| format!("examples/{example}/README.md")));
    paths.push("README.md".to_owned());
    paths.sort();
    paths.into_iter().map(|path| (path.clone(), read(&path))).collect()
}

/// A fenced block.
struct Block {
    /// Page and line, for messages.
    place: String,
    /// What stands behind the opening fence.
    info: String,
    text: String,
}

fn blocks(page: &str, text: &str) -> Vec<Block> {
    let mut found: Vec<Block> = Vec::new();
    let mut open: Option<String> = None;
    for (number, line) in (1..).zip(text.lines()) {
        let bare = line.trim_start();
        match &open {
            None if bare.starts_with("```") => {
                let fence: String = bare.chars().take_while(|&c| c == '`').collect();
                let info = bare[fence.len()..].trim().to_owned();
                found.push(Block { place: format!("{page}:{number}"), info, text: String::new() });
                open = Some(fence);
            }
            Some(fence) if bare == fence => open = None,
            Some(_) => {
                let block = found.last_mut().expect("an open block was pushed");
                block.text.push_str(line);
                block.text.push('\n');
            }
            None => {}
        }
    }
    assert!(open.is_none(), "{page} ends inside a fenced block");
    found
}

fn all_blocks() -> Vec<Block> {
    pages().iter().flat_map(|(page, text)| blocks(page, text)).collect()
}

/// The codes that a file gives, each with whether it is an error, and all of it in words.
fn check(text: &str) -> (Vec<(String, bool)>, String) {
    let mut sources = SourceMap::new();
    let file = sources.add("example.sesame", text);
    load_imports(&mut sources, file, |name| {
        let known = (name == "cell.sesame").then(|| standard(&blocks(STANDARD, &read(STANDARD))));
        known.ok_or_else(|| "examples import `cell.sesame` only".to_owned())
    });
    let analysis = analyse(&sources, file);
    let codes = analysis.diagnostics.iter();
    let codes =
        codes.map(|diagnostic| (diagnostic.code.text().to_owned(), diagnostic.severity() == Severity::Error)).collect();
    (codes, render::human(&analysis.diagnostics, &sources, false))
}

fn standard(blocks: &[Block]) -> String {
    let found: Vec<&Block> = blocks.iter().filter(|block| block.info == "sesame,standard").collect();
    let [standard] = found[..] else { panic!("there is one standard space, not {}", found.len()) };
    standard.text.clone()
}

#[test]
fn every_example_says_what_it_claims_to_say() {
    let blocks = all_blocks();
    let standard = standard(&blocks);
    let mut checked = 0;
    for block in blocks.iter().filter(|block| block.info.starts_with("sesame") && !block.info.contains(" from=")) {
        let whole = block.text.lines().any(|line| line.starts_with("space "));
        let after = if whole { block.text.clone() } else { format!("{standard}\n{}", block.text) };
        let place = &block.place;
        match block.info.as_str() {
            "sesame" | "sesame,standard" => {
                let (codes, said) = check(&block.text);
                assert!(codes.is_empty(), "{place}\n{said}");
            }
            "sesame,fragment" => {
                let (codes, said) = check(&after);
                // A fragment may leave operations and metrics to its reader, but nothing else.
                assert!(codes.iter().all(|(code, _)| ["W0002", "W0011"].contains(&code.as_str())), "{place}\n{said}");
            }
            "sesame,system" => {
                let inside = standard.replacen("system {\n", &format!("system {{\n{}", block.text), 1);
                assert_ne!(inside, standard, "the standard space has a system");
                let (codes, said) = check(&inside);
                assert!(codes.is_empty(), "{place}\n{said}");
            }
            info => {
                let code = info.strip_prefix("sesame,").unwrap_or_default();
                let (codes, said) = check(&after);
                let found: Vec<&str> = codes.iter().map(|(code, _)| code.as_str()).collect();
                assert_eq!(found, [code], "{place}\n{said}");
            }
        }
        checked += 1;
    }
    assert!(checked >= 12, "the reference has examples, not {checked}");
}

fn unindented(text: &str) -> String {
    text.lines().map(str::trim).collect::<Vec<_>>().join("\n")
}

#[test]
fn code_in_the_guide_is_that_of_files_that_are_tested() {
    let mut compared = 0;
    for block in all_blocks() {
        let Some((_, path)) = block.info.split_once(" from=") else {
            assert!(!block.info.starts_with("rust"), "{}: Rust comes from a file that is compiled", block.place);
            continue;
        };
        let file = unindented(&read(path)).replace("{{ name }}", "demo");
        assert!(file.contains(&unindented(&block.text)), "{}: not what stands in {path}", block.place);
        compared += 1;
    }
    assert!(compared >= 4, "the guide shows a simulator, its declaration, its test and a hook, not {compared}");
}

#[test]
fn what_hooks_are_said_to_call_exists() {
    let in_rust = read("runtime/run/relay/src/metric.rs") + &read("runtime/run/relay/src/fuzz/custom.rs");
    let in_python = read("python/sesamec/_native.pyi");
    let mut seen = BTreeSet::new();
    for (page, text) in pages() {
        for call in text.split("ctx.").skip(1) {
            let name: String = call.chars().take_while(|&c| c.is_ascii_lowercase() || c == '_').collect();
            let exists = if page == "docs/python.md" {
                in_python.contains(&format!("def {name}(self"))
            } else {
                in_rust.contains(&format!("pub fn {name}("))
            };
            assert!(exists, "{page}: a context has no `{name}`");
            seen.insert(name);
        }
    }
    assert!(seen.len() >= 7, "the guide shows what a context can do, not only {seen:?}");
}

#[test]
fn the_reference_lists_every_code_and_every_unit() {
    let chapters = pages().into_iter().filter(|(page, _)| page.starts_with("docs/language/"));
    let reference: String = chapters.map(|(_, text)| text).collect();
    for (code, _) in CODES {
        assert!(reference.contains(&format!("| {} |", code.text())), "{code} is not in the table");
    }
    for symbol in units::symbols() {
        assert!(reference.contains(&format!("`{symbol}`")), "the unit {symbol} is not in the table");
    }
}

#[test]
fn no_reserved_word_can_be_a_name() {
    let listed = all_blocks().into_iter().filter(|block| block.info == "text,keywords").map(|block| block.text);
    for word in listed.collect::<Vec<_>>().join(" ").split_whitespace() {
        let mut sources = SourceMap::new();
        let text = format!("space s\nmetric {word} = fuzzing_time()\n");
        let root = sources.add("s.sesame", &text);
        let codes: Vec<String> = analyse(&sources, root).diagnostics.iter().map(|one| one.code.to_string()).collect();
        assert!(codes.contains(&"E0102".to_owned()), "{word}: {codes:?}");
    }
}

#[test]
fn the_reference_lists_exactly_the_reserved_words() {
    let words = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
    let listed: BTreeSet<String> = all_blocks()
        .iter()
        .filter(|block| block.info == "text,keywords")
        .flat_map(|block| words(&block.text))
        .collect();
    let rule = GRAMMAR.split("\nkeyword = @{").nth(1).and_then(|rest| rest.split('}').next()).expect("it is a rule");
    let reserved: BTreeSet<String> = rule.split('"').skip(1).step_by(2).map(str::to_owned).collect();
    assert_eq!(listed, reserved);
}

/// The anchor of a heading, as GitHub makes it.
fn anchor(heading: &str) -> String {
    let kept = heading.trim_start_matches('#').trim().to_lowercase();
    kept.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c)).map(|c| if c == ' ' { '-' } else { c }).collect()
}

#[test]
#[expect(clippy::disallowed_methods, reason = "the crate is pure; this test looks at the project's documentation")]
fn every_link_inside_the_project_leads_somewhere() {
    let pages = pages();
    let mut followed = 0;
    for (page, text) in &pages {
        for link in text.split("](").skip(1) {
            let target = link.split(')').next().unwrap_or_default();
            if target.contains("://") {
                continue;
            }
            let (path, fragment) = target.split_once('#').map_or((target, None), |(path, at)| (path, Some(at)));
            let folder = project().join(page).parent().expect("a page lies in a folder").to_owned();
            let file = if path.is_empty() { project().join(page) } else { folder.join(path) };
            assert!(file.exists(), "{page}: nothing is at `{target}`");
            if let Some(fragment) = fragment {
                let text = std::fs::read_to_string(&file).expect("only pages have headings");
                let headings = text.lines().filter(|line| line.starts_with('#'));
                assert!(headings.map(anchor).any(|heading| heading == fragment), "{page}: no heading for `{target}`");
            }
            followed += 1;
        }
    }
    assert!(followed >= 10, "pages are linked with each other, not by {followed} links");
}
