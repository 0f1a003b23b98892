//! Imports: which files a space consists of, and their declarations as one.
//!
//! An imported file's declarations are as if they stood in the importing one, its `space` excepted: so a file can be a
//! space of its own and be imported by another. However often and from wherever a file is imported, it is there once.

use std::collections::BTreeMap;
use std::path::Path;

use crate::diagnostic::{Code, Diagnostic};
use crate::source::{SourceMap, normal_path};
use crate::span::FileId;
use crate::syntax::{self, ast};

/// The longest chain of imports.
const MAX_DEPTH: usize = 64;

/// Adds to `sources` what the file `root` imports, and what that imports in turn: each file once, by what `read` says
/// to its name. A name is relative to the importing file's folder, with `.` and `..` worked out; an absolute one stays.
/// Why a file cannot be read is kept, and said by [`crate::analyse`] at the import. A name that does not end in
/// `.sesame` is never asked for: what is read is quoted in diagnostics, so nothing but spaces is.
pub fn load_imports(sources: &mut SourceMap, root: FileId, mut read: impl FnMut(&str) -> Result<String, String>) {
    let mut waiting = vec![root];
    while let Some(id) = waiting.pop() {
        let file = sources.file(id);
        // Most files import nothing, and are then parsed once only.
        if !file.text().contains("import") {
            continue;
        }
        let imports = syntax::parse(id, file.text(), &mut Vec::new()).imports;
        let names: Vec<String> = imports.iter().map(|import| imported_name(file.name(), &import.text)).collect();
        for name in names {
            // Its text would be shown where it has mistakes, and it may be anything.
            if !is_space(&name) {
                continue;
            }
            if sources.find(&name).is_some() || sources.unreadable(&name).is_some() {
                continue;
            }
            match read(&name) {
                Ok(text) => waiting.push(sources.add(name, text)),
                Err(why) => sources.add_unreadable(name, why),
            }
        }
    }
}

/// Whether a name is that of a `.sesame` file.
fn is_space(name: &str) -> bool {
    Path::new(name).extension().is_some_and(|extension| extension == "sesame")
}

/// The name of what a file imports: relative to what the importing file's name is relative to.
fn imported_name(importing: &str, written: &str) -> String {
    let folder = Path::new(importing).parent().unwrap_or(Path::new(""));
    normal_path(&folder.join(written))
}

/// The files of a space as one.
pub(crate) struct Merged {
    /// Their declarations: those of imported files stand before those of the files that import them.
    pub(crate) file: ast::File,
    /// Their names as seen from the folder of the first.
    pub(crate) names: BTreeMap<FileId, String>,
    /// Their places in the order of declarations.
    pub(crate) ranks: BTreeMap<FileId, usize>,
}

/// Parses a file and all it imports.
pub(crate) fn merge(sources: &SourceMap, root: FileId, diagnostics: &mut Vec<Diagnostic>) -> Merged {
    let merged = Merged { file: ast::File::default(), names: BTreeMap::new(), ranks: BTreeMap::new() };
    let mut merger = Merger { sources, diagnostics, open: Vec::new(), merged };
    let name = Path::new(sources.file(root).name()).file_name().map(|name| name.to_string_lossy().into_owned());
    merger.visit(root, name.unwrap_or_default());
    merger.merged
}

struct Merger<'a> {
    sources: &'a SourceMap,
    diagnostics: &'a mut Vec<Diagnostic>,
    /// The files that are being read, each imported by the one before it.
    open: Vec<FileId>,
    merged: Merged,
}

impl Merger<'_> {
    fn visit(&mut self, id: FileId, name: String) {
        let mut file = syntax::parse(id, self.sources.file(id).text(), self.diagnostics);
        self.open.push(id);
        for import in std::mem::take(&mut file.imports) {
            // An empty text was reported where it was read.
            if import.text.trim().is_empty() || !self.import(id, &name, &import) {
                file.incomplete = true;
            }
        }
        self.open.pop();
        if !self.open.is_empty() {
            file.spaces.clear();
        }
        self.merged.names.insert(id, name);
        self.merged.ranks.insert(id, self.merged.ranks.len());
        append(&mut self.merged.file, file);
    }

    /// Reads an imported file unless it has been; false if that cannot be.
    fn import(&mut self, importing: FileId, importing_name: &str, import: &ast::Text) -> bool {
        let name = imported_name(self.sources.file(importing).name(), &import.text);
        if !is_space(&name) {
            let title = format!("cannot import \"{}\"", import.text);
            let diagnostic = Diagnostic::new(Code::NOT_IMPORTED, import.span, title)
                .label("the name of an imported file must end in `.sesame`")
                .note("files with other names are never read, so that no message can show their content");
            self.diagnostics.push(diagnostic);
            return false;
        }
        let Some(id) = self.sources.find(&name) else {
            let title = format!("cannot import \"{}\"", import.text);
            let why = self.sources.unreadable(&name).unwrap_or("this file was not provided");
            let diagnostic = Diagnostic::new(Code::NOT_IMPORTED, import.span, title).label(why);
            self.diagnostics.push(
                diagnostic
                    .note(format!("looked for {name}"))
                    .note("a path is relative to the folder of the file that imports it"),
            );
            return false;
        };
        if let Some(at) = self.open.iter().position(|&open| open == id) {
            self.circle(import, at);
            return false;
        }
        if self.merged.ranks.contains_key(&id) {
            return true;
        }
        if self.open.len() >= MAX_DEPTH {
            let title = format!("imports are nested more than {MAX_DEPTH} levels deep");
            self.diagnostics.push(Diagnostic::new(Code::TOO_LARGE, import.span, title).label("nested too deeply"));
            return false;
        }
        self.visit(id, imported_name(importing_name, &import.text));
        true
    }

    fn circle(&mut self, import: &ast::Text, at: usize) {
        let name = |id: FileId| self.sources.file(id).name();
        let first = name(self.open[at]);
        let title = if at + 1 == self.open.len() {
            format!("{first} imports itself")
        } else {
            let by: Vec<&str> = self.open[at + 1..].iter().map(|&id| name(id)).collect();
            format!("{first} imports itself through {}", by.join(", "))
        };
        let diagnostic = Diagnostic::new(Code::CIRCLE, import.span, title).label("this import closes the cycle");
        self.diagnostics.push(diagnostic);
    }
}

fn append(all: &mut ast::File, mut file: ast::File) {
    all.spaces.append(&mut file.spaces);
    all.systems.append(&mut file.systems);
    all.metrics.append(&mut file.metrics);
    all.requirements.append(&mut file.requirements);
    all.operations.append(&mut file.operations);
    all.tests.append(&mut file.tests);
    all.campaigns.append(&mut file.campaigns);
    all.eddis.append(&mut file.eddis);
    all.physicals.append(&mut file.physicals);
    all.undeclared.append(&mut file.undeclared);
    all.has_errors |= file.has_errors;
    all.incomplete |= file.incomplete;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_import_is_relative_to_the_file_that_imports() {
        assert_eq!(imported_name("demo.sesame", "cell.sesame"), "cell.sesame");
        assert_eq!(imported_name("a/b/demo.sesame", "./cell.sesame"), "a/b/cell.sesame");
        assert_eq!(imported_name("a/b/demo.sesame", "../../cell.sesame"), "cell.sesame");
        assert_eq!(imported_name("a/demo.sesame", "../../cell.sesame"), "../cell.sesame");
        assert_eq!(imported_name("../demo.sesame", "../cell.sesame"), "../../cell.sesame");
        assert_eq!(imported_name("a/demo.sesame", "/lib/../cell.sesame"), "/cell.sesame");
    }

    #[test]
    fn what_is_not_called_a_space_is_not_read() {
        let mut sources = SourceMap::new();
        let root = sources.add("demo.sesame", "import \"/etc/passwd\" import \"a.sesame/..\" import \".sesame\"");
        load_imports(&mut sources, root, |name| panic!("{name} was asked for"));
        let mut diagnostics = Vec::new();
        merge(&sources, root, &mut diagnostics);
        assert_eq!(diagnostics.len(), 3, "{diagnostics:?}");
        assert!(diagnostics.iter().all(|found| found.label.contains("must end in `.sesame`")), "{diagnostics:?}");
    }

    #[test]
    fn each_file_is_read_once_however_it_is_written() {
        let mut sources = SourceMap::new();
        let root = sources.add("x/../demo.sesame", "import \"a.sesame\" import \"./b/../a.sesame\"");
        let mut read = Vec::new();
        load_imports(&mut sources, root, |name| {
            read.push(name.to_owned());
            Ok("import \"demo.sesame\"".to_owned())
        });
        assert_eq!(read, ["a.sesame"], "and the first file is there already");
    }
}
