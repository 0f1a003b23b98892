//! The tree is tidy: rules that neither rustc, clippy nor rustfmt knows of, held against every file that git tracks.
//!
//! Without a checkout of git, as in an unpacked archive, nothing says which files belong to the tree; the test says so
//! and passes there, but not where `CI=true`.
#![cfg(test)]

mod architecture;
mod json_page;
mod protocol;
mod rules;

use std::fs;
use std::process::Command;

use sesame_tests::workspace;
use toml::Table;

use self::rules::{Crate, File};

/// Every file that git tracks and that is there; `None` without a checkout.
fn tracked() -> Option<Vec<File>> {
    if !workspace().join(".git").exists() {
        assert!(std::env::var_os("CI").is_none_or(|ci| ci != "true"), "a check of all files needs a checkout of git");
        eprintln!("skipped: this is not a checkout of git");
        return None;
    }
    let output = Command::new("git").args(["ls-files", "-z"]).current_dir(workspace()).output().expect("git starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let paths = String::from_utf8(output.stdout).expect("paths of the project are text");
    let present = paths.split_terminator('\0').filter(|path| workspace().join(path).is_file());
    let read = |path: &str| {
        let bytes = fs::read(workspace().join(path)).expect("a tracked file can be read");
        File { path: path.to_owned(), text: String::from_utf8(bytes).unwrap_or_default() }
    };
    Some(present.map(read).collect())
}

fn text(path: &str) -> String {
    fs::read_to_string(workspace().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// The crates that the root's manifest lists.
fn crates() -> Vec<Crate> {
    let parsed = |path: &str| -> Table { text(path).parse().unwrap_or_else(|error| panic!("{path}: {error}")) };
    let root = parsed("Cargo.toml");
    let members = root["workspace"]["members"].as_array().expect("a workspace has members");
    let member = |member: &toml::Value| {
        let manifest = format!("{}/Cargo.toml", member.as_str().expect("a member is a path"));
        let table = parsed(&manifest);
        let package = &table["package"];
        let name = package["name"].as_str().expect("a package has a name").to_owned();
        let described =
            package.get("description").and_then(toml::Value::as_str).is_some_and(|text| !text.trim().is_empty());
        let library = workspace().join(&manifest).with_file_name("src/lib.rs").is_file();
        let doctest = table.get("lib").and_then(|lib| lib.get("doctest")?.as_bool()).unwrap_or(true);
        Crate { name, manifest, described, tests_examples: library.then_some(doctest) }
    };
    members.iter().map(member).collect()
}

#[test]
fn the_tree_is_tidy() {
    let Some(files) = tracked() else { return };
    let crates = crates();
    assert!(files.len() > 100 && crates.len() > 5, "{} files, {} crates", files.len(), crates.len());
    let complaints = [
        rules::left_behind(&files),
        rules::not_ignored(&text(".gitignore")),
        rules::wide_comments(&files),
        rules::not_on_the_map(&crates, &text("ARCHITECTURE.md")),
        rules::untested_examples(&crates, &files),
        rules::mod_files(&files),
        rules::without_purpose(&files),
        rules::not_in_the_index(&files),
        rules::pictures_not_shown(&files),
        rules::digests(&files),
        rules::exit_codes(&files),
        rules::unknown_tests(&files, &crates),
    ]
    .concat();
    assert!(complaints.is_empty(), "{} things are untidy:\n{}\n", complaints.len(), complaints.join("\n"));
}
