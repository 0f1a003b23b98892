//! The rules of a tidy tree, each a function from files to complaints. A complaint names the file, what is wrong, and
//! what to do.

/// The columns that a line of comment may fill, as rustfmt has it for code.
const COLUMNS: usize = 120;

/// What test runners, merges and patches leave behind.
const LEFT_BEHIND: [&str; 4] = [".pending-snap", ".snap.new", ".orig", ".rej"];

/// A file of the tree.
#[derive(Debug, Clone)]
pub(crate) struct File {
    /// Its path from the root, with `/` between its parts.
    pub(crate) path: String,
    /// What it holds; empty where that is not text.
    pub(crate) text: String,
}

impl File {
    fn name(&self) -> &str {
        self.path.rsplit('/').next().unwrap_or(&self.path)
    }

    /// What follows the last dot of its name.
    fn ending(&self) -> Option<&str> {
        self.name().rsplit_once('.').map(|(_, ending)| ending)
    }
}

/// A crate of the workspace.
#[derive(Debug, Clone)]
pub(crate) struct Crate {
    /// Its name.
    pub(crate) name: String,
    /// Its manifest's path from the root.
    pub(crate) manifest: String,
    /// Whether the manifest says what it is for.
    pub(crate) described: bool,
    /// Whether the examples in the documentation of its code are tested; `None` without a library.
    pub(crate) tests_examples: Option<bool>,
}

/// Files that some program left behind.
pub(crate) fn left_behind(files: &[File]) -> Vec<String> {
    let found = files.iter().filter(|file| LEFT_BEHIND.iter().any(|ending| file.path.ends_with(ending)));
    found.map(|file| format!("{0}: a program left it behind; remove it with `git rm {0}`", file.path)).collect()
}

/// Kinds of such files that git does not ignore.
pub(crate) fn not_ignored(gitignore: &str) -> Vec<String> {
    let ignored = |ending: &str| gitignore.lines().any(|line| line.trim() == format!("*{ending}"));
    let missing = LEFT_BEHIND.iter().filter(|ending| !ignored(ending));
    missing.map(|ending| format!(".gitignore: add the line `*{ending}`")).collect()
}

/// Lines of comment that are too wide.
pub(crate) fn wide_comments(files: &[File]) -> Vec<String> {
    let mut complaints = Vec::new();
    for file in files {
        let Some(mark) = comment_mark(file) else { continue };
        for (number, line) in (1..).zip(file.text.lines()) {
            let columns = line.chars().count();
            if line.trim_start().starts_with(mark) && columns > COLUMNS {
                complaints
                    .push(format!("{}:{number}: the comment fills {columns} columns; wrap it at {COLUMNS}", file.path));
            }
        }
    }
    complaints
}

/// What begins a line of comment in a file of this kind; `None` for kinds that have none, or have other widths.
fn comment_mark(file: &File) -> Option<&'static str> {
    match file.ending() {
        Some("rs" | "pest") => Some("//"),
        Some("toml" | "sh" | "py") => Some("#"),
        _ if file.text.starts_with("#!") => Some("#"),
        _ => None,
    }
}

/// Crates without a description, or without a row in the map of ARCHITECTURE.md.
pub(crate) fn not_on_the_map(crates: &[Crate], architecture: &str) -> Vec<String> {
    let map = architecture.split("\n## ").find(|section| section.starts_with("The map\n")).unwrap_or_default();
    let rows: Vec<&str> = map.lines().filter(|line| line.starts_with('|')).collect();
    let mut complaints = Vec::new();
    for Crate { name, manifest, described, .. } in crates {
        if !described {
            complaints.push(format!("{manifest}: add a `description`: what {name} is, in one sentence"));
        }
        if !rows.iter().any(|row| row.contains(&format!("`{name}`"))) {
            complaints
                .push(format!("ARCHITECTURE.md: add a row for `{name}` ({manifest}) to the table under `The map`"));
        }
    }
    complaints
}

/// Crates whose examples in documentation are not tested, and crates in which rustdoc looks for examples in vain, which
/// takes about a second each.
pub(crate) fn untested_examples(crates: &[Crate], files: &[File]) -> Vec<String> {
    let begins_example = |line: &str| {
        let line = line.trim_start();
        line.starts_with("/// ```") || line.starts_with("//! ```") || line.starts_with("#![doc = include_str!")
    };
    let complaint = |of: &Crate| {
        let sources = format!("{}src/", of.manifest.strip_suffix("Cargo.toml")?);
        let mut sources = files.iter().filter(|file| file.path.starts_with(&sources) && file.ending() == Some("rs"));
        let example = sources.find(|file| file.text.lines().any(begins_example));
        match (example, of.tests_examples?) {
            (Some(file), false) => {
                Some(format!("{}: remove `doctest = false`: {} has an example", of.manifest, file.path))
            }
            (None, true) => {
                Some(format!("{}: add `doctest = false` below `[lib]`: there are no examples", of.manifest))
            }
            _ => None,
        }
    };
    crates.iter().filter_map(complaint).collect()
}

/// Modules in files called `mod.rs`. What tests of a crate share is one by need: `tests/shared.rs` would be a test.
pub(crate) fn mod_files(files: &[File]) -> Vec<String> {
    let of_tests = |file: &File| file.path.rsplit('/').nth(2) == Some("tests");
    let found = files.iter().filter(|file| file.name() == "mod.rs" && !of_tests(file));
    let beside = |file: &File| file.path.trim_end_matches("/mod.rs").to_owned() + ".rs";
    found.map(|file| format!("{}: move it to {}", file.path, beside(file))).collect()
}

/// Modules that do not begin with what they are for. The tests of a module, in `tests.rs`, need not.
pub(crate) fn without_purpose(files: &[File]) -> Vec<String> {
    let modules = files.iter().filter(|file| file.ending() == Some("rs") && file.name() != "tests.rs");
    let silent = modules.filter(|file| !file.text.starts_with("//!"));
    silent.map(|file| format!("{}: begin it with `//!` and a sentence on what it is for", file.path)).collect()
}

/// Pages of documentation that no index lists, and entries of the index without a page. The README.md of a folder that
/// the index lists is the index of that folder.
pub(crate) fn not_in_the_index(files: &[File]) -> Vec<String> {
    const INDEX: &str = "docs/README.md";
    let pages = files.iter().filter(|file| file.ending() == Some("md") && file.path != INDEX);
    let pages: Vec<&str> = pages.filter_map(|file| file.path.strip_prefix("docs/")).collect();
    let index = linked(files, INDEX);
    let mut complaints = Vec::new();
    for &page in pages.iter().filter(|page| !index.contains(page)) {
        let Some((folder, name)) = page.rsplit_once('/').filter(|&(_, name)| name != "README.md") else {
            complaints.push(format!("{INDEX}: add a row for docs/{page}"));
            continue;
        };
        let readme = format!("{folder}/README.md");
        let listed = index.iter().any(|link| *link == readme);
        if !listed || !linked(files, &format!("docs/{readme}")).contains(&name) {
            complaints.push(format!("{INDEX}: add a row for docs/{page}, or link it in docs/{readme}"));
        }
    }
    let missing = index.iter().filter(|link| !link.starts_with("..") && !pages.contains(link));
    complaints.extend(missing.map(|link| format!("{INDEX}: there is no page docs/{link}; remove its row")));
    complaints
}

/// The files that a page links, as seen from its folder.
fn linked<'f>(files: &'f [File], page: &str) -> Vec<&'f str> {
    let text = files.iter().find(|file| file.path == page).map_or("", |file| file.text.as_str());
    let links = text.split("](").skip(1).filter_map(|rest| rest.split([')', '#']).next());
    links.filter(|link| !link.is_empty()).collect()
}

/// Pictures of the documentation that no page shows.
pub(crate) fn pictures_not_shown(files: &[File]) -> Vec<String> {
    let pages: Vec<&File> = files.iter().filter(|file| file.ending() == Some("md")).collect();
    let shown = |picture: &File| pages.iter().any(|page| page.text.contains(&format!("{})", picture.name())));
    let pictures = files.iter().filter(|file| matches!(file.ending(), Some("png" | "svg")));
    let hidden = pictures.filter(|picture| !shown(picture));
    hidden.map(|file| format!("{0}: no page shows it; remove it with `git rm {0}`", file.path)).collect()
}

/// Digests of results in documentation: nobody notices when they are out of date.
pub(crate) fn digests(files: &[File]) -> Vec<String> {
    let mut complaints = Vec::new();
    for file in files.iter().filter(|file| file.ending() == Some("md")) {
        let mut words = file.text.split(|c: char| !c.is_ascii_hexdigit());
        if let Some(digest) = words.find(|word| word.len() == 64) {
            complaints.push(format!("{}: write `(64 hexadecimal digits)` for the digest {digest}", file.path));
        }
    }
    complaints
}

/// The page with the table of exit codes.
const PAGE: &str = "docs/guide/running.md";

/// Tables of exit codes in addition to the one of the guide.
pub(crate) fn exit_codes(files: &[File]) -> Vec<String> {
    let mut complaints = Vec::new();
    for file in files.iter().filter(|file| file.ending() == Some("md")) {
        let tables = file.text.lines().filter(|line| line.starts_with("| exit code |")).count();
        if tables != usize::from(file.path == PAGE) {
            complaints
                .push(format!("{}: {tables} tables of exit codes; there is one, in {PAGE}: link to it", file.path));
        }
    }
    complaints
}

/// Tests that a page names in a command, and that their crate does not have.
pub(crate) fn unknown_tests(files: &[File], crates: &[Crate]) -> Vec<String> {
    let mut complaints = Vec::new();
    for page in files.iter().filter(|file| file.ending() == Some("md")) {
        for command in page.text.lines().filter_map(test_command) {
            let words = || command.split_whitespace();
            let Some(package) = words().skip_while(|&word| word != "-p").nth(1) else { continue };
            let Some(named) = crates.iter().find(|of| of.name == package) else {
                complaints.push(format!("{}: `{command}`: there is no crate `{package}`", page.path));
                continue;
            };
            let folder = named.manifest.trim_end_matches("Cargo.toml");
            let of_it = || files.iter().filter(|file| file.path.starts_with(folder) && file.ending() != Some("md"));
            for test in words().filter(|&word| word.contains('_') && !word.contains('=')) {
                let last = test.rsplit("::").next().unwrap_or(test);
                if !of_it().any(|file| file.path.contains(last) || file.text.contains(last)) {
                    complaints.push(format!("{}: `{command}`: {package} has no test `{test}`", page.path));
                }
            }
        }
    }
    complaints
}

/// The command in a line that runs tests, up to a backtick.
fn test_command(line: &str) -> Option<&str> {
    let begin = ["cargo test ", "cargo nextest run "].iter().find_map(|command| line.find(command))?;
    line[begin..].split('`').next()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn crate_named(name: &str) -> Crate {
        let manifest = format!("{name}/Cargo.toml");
        Crate { name: name.to_owned(), manifest, described: true, tests_examples: None }
    }

    fn file(path: &str, text: &str) -> File {
        File { path: path.to_owned(), text: text.to_owned() }
    }

    #[test]
    fn what_programs_leave_behind_is_found() {
        let files = [".a.rs.pending-snap", "b.snap.new", "c.rs.orig", "d.rej", "e.snap", "orig.rs"];
        let found = left_behind(&files.map(|path| file(path, "")));
        assert_eq!(found.len(), 4, "{found:?}");
        assert_eq!(found[1], "b.snap.new: a program left it behind; remove it with `git rm b.snap.new`");
    }

    #[test]
    fn git_is_to_ignore_each_kind() {
        assert_eq!(
            not_ignored("target/\n*.snap.new\n*.orig\n"),
            [".gitignore: add the line `*.pending-snap`", ".gitignore: add the line `*.rej`"]
        );
        assert_eq!(not_ignored("*.pending-snap\n*.snap.new\n*.orig\n*.rej\n"), [""; 0]);
    }

    #[test]
    fn comments_are_measured_in_characters() {
        let fits = format!("    // {}", "ü".repeat(COLUMNS - 7));
        let wide = format!("{fits}x");
        let code = format!("let text = \"{}\";", "x".repeat(COLUMNS));
        let rust = file("a.rs", &format!("{code}\n{fits}\n{wide}\n"));
        assert_eq!(wide_comments(&[rust]), ["a.rs:3: the comment fills 121 columns; wrap it at 120"]);
        let long = "x".repeat(COLUMNS);
        let hash = format!("# {long}\n");
        assert_eq!(wide_comments(&[file("a.toml", &hash), file("run", &format!("#!/bin/sh\n{hash}"))]).len(), 2);
        assert_eq!(wide_comments(&[file("a.md", &hash), file("LICENCE", &hash)]), [""; 0], "headings are not comments");
        assert_eq!(wide_comments(&[file("a.pest", &format!("// {long}"))]).len(), 1);
    }

    #[test]
    fn a_crate_needs_a_description_and_a_row() {
        let of = |name: &str, described| Crate { described, ..crate_named(name) };
        let page =
            "# Architecture\n\n## The map\n\n| `a/` | `a` | one |\n\nAlso `b`.\n\n## Other\n\n| `c/` | `c` | |\n";
        assert_eq!(not_on_the_map(&[of("a", true)], page), [""; 0]);
        let complaints = not_on_the_map(&[of("a", false), of("b", true), of("c", true)], page);
        assert_eq!(
            complaints,
            [
                "a/Cargo.toml: add a `description`: what a is, in one sentence",
                "ARCHITECTURE.md: add a row for `b` (b/Cargo.toml) to the table under `The map`",
                "ARCHITECTURE.md: add a row for `c` (c/Cargo.toml) to the table under `The map`",
            ]
        );
    }

    #[test]
    fn examples_are_tested_and_looked_for_where_there_are_some() {
        let crates = [Some(true), Some(false), None].map(|tests_examples| Crate { tests_examples, ..crate_named("a") });
        let with = [file("a/src/b.rs", "/// Sums.\n///\n/// ```\n/// assert_eq!(1 + 1, 2);\n/// ```\n")];
        let without =
            [file("a/src/b.rs", "/// Sums.\n"), file("b/src/lib.rs", "//! ```\n"), file("a/README.md", "```")];
        assert_eq!(
            untested_examples(&crates, &with),
            ["a/Cargo.toml: remove `doctest = false`: a/src/b.rs has an example"]
        );
        assert_eq!(
            untested_examples(&crates, &without),
            ["a/Cargo.toml: add `doctest = false` below `[lib]`: there are no examples"]
        );
    }

    #[test]
    fn a_module_lies_beside_its_folder() {
        let files = [
            file("src/a/mod.rs", ""),
            file("src/a.rs", ""),
            file("src/mod_of_a.rs", ""),
            file("a/tests/shared/mod.rs", ""),
        ];
        assert_eq!(mod_files(&files), ["src/a/mod.rs: move it to src/a.rs"]);
    }

    #[test]
    fn a_module_begins_with_its_purpose() {
        let files = [
            file("a.rs", "//! Something.\n"),
            file("b.rs", "use a;\n"),
            file("a/tests.rs", "use super::*;\n"),
            file("b.toml", ""),
            file("c.rs", ""),
        ];
        assert_eq!(
            without_purpose(&files),
            [
                "b.rs: begin it with `//!` and a sentence on what it is for",
                "c.rs: begin it with `//!` and a sentence on what it is for",
            ]
        );
    }

    #[test]
    fn the_index_lists_each_page_and_no_other() {
        let index = "[a](a.md) [gone](gone.md) [up](../README.md)";
        let files = [file("docs/README.md", index), file("docs/a.md", ""), file("docs/b.md", ""), file("c.md", "")];
        assert_eq!(
            not_in_the_index(&files),
            [
                "docs/README.md: add a row for docs/b.md",
                "docs/README.md: there is no page docs/gone.md; remove its row"
            ]
        );
    }

    #[test]
    fn a_page_in_a_folder_is_listed_by_the_index_or_by_its_folder() {
        let files = |index: &str, folder: &str| {
            [file("docs/README.md", index), file("docs/x/README.md", folder), file("docs/x/y.md", "")]
        };
        let folder = "[x](x/README.md)";
        assert_eq!(not_in_the_index(&files(folder, "[y](y.md#why)")), [""; 0]);
        assert_eq!(not_in_the_index(&files("[x](x/README.md) [y](x/y.md)", "")), [""; 0]);
        assert_eq!(
            not_in_the_index(&files(folder, "[up](../README.md)")),
            ["docs/README.md: add a row for docs/x/y.md, or link it in docs/x/README.md"]
        );
        assert_eq!(not_in_the_index(&files("", "[y](y.md)")).len(), 2, "nobody finds the folder");
    }

    #[test]
    fn each_picture_is_shown_by_a_page() {
        let page = file("docs/a.md", "![A front](front.png)");
        let files = [page, file("docs/front.png", ""), file("docs/old.png", "")];
        assert_eq!(
            pictures_not_shown(&files),
            ["docs/old.png: no page shows it; remove it with `git rm docs/old.png`"]
        );
    }

    #[test]
    fn documentation_has_no_digest_and_one_table_of_exit_codes() {
        let digest = "84067dcc".repeat(8);
        let page = |path: &str, text: &str| file(path, text);
        assert_eq!(digests(&[page("a.md", &format!("Digest {digest}\n"))]).len(), 1);
        assert_eq!(digests(&[page("a.md", &format!("{digest}0")), page("a.rs", &digest)]), [""; 0]);
        let table = "| exit code | means |\n";
        let [guide, twice] = [table.to_owned(), table.repeat(2)];
        assert_eq!(exit_codes(&[page(PAGE, &guide), page("docs/b.md", "")]), [""; 0]);
        assert_eq!(exit_codes(&[page(PAGE, &twice), page("docs/b.md", table)]).len(), 2);
        assert_eq!(exit_codes(&[page(PAGE, "")]).len(), 1);
    }

    #[test]
    fn a_command_of_a_page_names_tests_that_exist() {
        let page = |command: &str| file("docs/a.md", &format!("Run `A=b_c {command}`.\n"));
        let test = file("a/tests/suite.rs", "fn it_works() {}\n");
        let complaints = |command: &str| unknown_tests(&[page(command), test.clone()], &[crate_named("a")]);
        assert_eq!(complaints("cargo test -p a --test suite -- --ignored some::it_works"), [""; 0]);
        assert_eq!(complaints("cargo test --workspace"), [""; 0]);
        assert_eq!(
            complaints("cargo nextest run -p a it_worked"),
            ["docs/a.md: `cargo nextest run -p a it_worked`: a has no test `it_worked`"]
        );
        assert_eq!(complaints("cargo test -p b"), ["docs/a.md: `cargo test -p b`: there is no crate `b`"]);
    }
}
