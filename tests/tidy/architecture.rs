//! The crates depend on each other as ARCHITECTURE.md says, and the files of a crate on each other in one direction.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use syn::visit::{self, Visit};

use sesame_tests::workspace;

/// A manifest, by the folder in which it lies.
fn manifest(folder: &str) -> toml::Table {
    toml::from_str(&fs::read_to_string(workspace().join(folder).join("Cargo.toml")).unwrap()).unwrap()
}

/// The folder of each crate of the workspace.
fn members() -> Vec<String> {
    let root = manifest("");
    let members = root["workspace"]["members"].as_array().unwrap();
    members.iter().map(|member| member.as_str().unwrap().to_owned()).collect()
}

/// What each crate links of the others, as its manifest says: dependencies of tests are left out.
fn manifests() -> BTreeMap<String, BTreeSet<String>> {
    let mut crates = BTreeMap::new();
    for member in members() {
        let manifest = manifest(&member);
        let name = manifest["package"]["name"].as_str().unwrap().to_owned();
        let ours = |table: &toml::Table| -> BTreeSet<String> {
            table.keys().filter(|name| name.starts_with("sesame-") || *name == "sesamec").cloned().collect()
        };
        crates.insert(name, manifest.get("dependencies").and_then(toml::Value::as_table).map(ours).unwrap_or_default());
    }
    crates
}

/// The graph as ARCHITECTURE.md prints it: a crate and what it links on each line, the lowest first.
fn graph(text: &str) -> Vec<(String, BTreeSet<String>)> {
    let block = text.split("```crates\n").nth(1).and_then(|rest| rest.split("```").next());
    let lines = block.expect("ARCHITECTURE.md has a block of crates").lines();
    lines
        .map(|line| {
            let (name, links) = line.split_once('→').unwrap_or((line, ""));
            let links = links.split(',').map(str::trim).filter(|link| !link.is_empty()).map(str::to_owned);
            (name.trim().to_owned(), links.collect())
        })
        .collect()
}

/// What a graph says against these manifests, or against itself, in sentences.
fn objections(graph: &[(String, BTreeSet<String>)], crates: &BTreeMap<String, BTreeSet<String>>) -> Vec<String> {
    let mut objections = Vec::new();
    let mut below = BTreeSet::new();
    for (name, links) in graph {
        for up in links.iter().filter(|link| !below.contains(*link)) {
            objections.push(format!("{name} links {up}, which is not above it in the list: an arrow that runs up"));
        }
        below.insert(name.clone());
        match crates.get(name) {
            None => objections.push(format!("{name} is in ARCHITECTURE.md and not in the workspace")),
            Some(linked) if linked != links => objections.push(format!(
                "{name} links {linked:?}, and ARCHITECTURE.md says {links:?}: change the list only if the idea of the crate changed"
            )),
            Some(_) => {}
        }
    }
    let missing = crates.keys().filter(|name| !below.contains(*name));
    objections.extend(missing.map(|name| format!("{name} is missing in ARCHITECTURE.md")));
    objections
}

#[test]
fn crates_link_each_other_as_the_architecture_says() {
    let text = fs::read_to_string(workspace().join("ARCHITECTURE.md")).unwrap();
    let objections = objections(&graph(&text), &manifests());
    assert!(objections.is_empty(), "{objections:#?}");
}

/// The crates of the runtime in the order of the map in ARCHITECTURE.md, each with its folder.
fn map(text: &str) -> Vec<(String, String)> {
    let rows = text.lines().filter_map(|line| line.strip_prefix("| `runtime/"));
    rows.map(|row| {
        let (folder, rest) = row.split_once("` | `").expect("a row of the map names a folder and a crate");
        let (name, _) = rest.split_once('`').expect("names of crates are code");
        (name.to_owned(), format!("runtime/{folder}").trim_end_matches('/').to_owned())
    })
    .collect()
}

/// What the map says against the crates that there are, and which wings link one that stands below them.
fn objections_to_wings(map: &[(String, String)], crates: &BTreeMap<String, BTreeSet<String>>) -> Vec<String> {
    let wing = |folder: &str| folder.split('/').nth(1).unwrap_or("").to_owned();
    let mut wings = Vec::new();
    for (_, folder) in map {
        if wings.last() != Some(&wing(folder)) {
            wings.push(wing(folder));
        }
    }
    let mut objections: Vec<String> = (1..wings.len())
        .filter(|&at| wings[..at].contains(&wings[at]))
        .map(|at| format!("the crates of {} are not together in the map", wings[at]))
        .collect();
    let at = |name: &str| {
        let (_, folder) = map.iter().find(|row| row.0 == name)?;
        wings.iter().position(|other| *other == wing(folder))
    };
    for (name, folder) in map {
        for link in &crates[name] {
            if at(link).is_some_and(|link| Some(link) > at(name)) {
                objections.push(format!("{name} in {folder} links {link}, which is in a later wing"));
            }
        }
    }
    objections
}

#[test]
fn no_wing_links_a_later_one() {
    let map = map(&fs::read_to_string(workspace().join("ARCHITECTURE.md")).unwrap());
    let runtime: BTreeSet<String> = members().into_iter().filter(|folder| folder.starts_with("runtime")).collect();
    assert_eq!(map.iter().map(|row| row.1.clone()).collect::<BTreeSet<_>>(), runtime, "the map, and the manifest");
    let objections = objections_to_wings(&map, &manifests());
    assert!(objections.is_empty(), "{objections:#?}");
}

#[test]
fn a_wing_that_links_a_later_one_is_objected_to() {
    let row = |name: &str, folder: &str| (name.to_owned(), folder.to_owned());
    let map = [row("plan", "runtime/model/plan"), row("base", "runtime/model/base"), row("relay", "runtime/run/relay")];
    let links = |of: &[(&str, &str)]| -> BTreeMap<String, BTreeSet<String>> {
        let of_one = |name: &str| of.iter().filter(|link| link.0 == name).map(|link| link.1.to_owned()).collect();
        map.iter().map(|row| (row.0.clone(), of_one(&row.0))).collect()
    };
    assert_eq!(objections_to_wings(&map, &links(&[("relay", "plan"), ("plan", "base")])), Vec::<String>::new());
    let up = objections_to_wings(&map, &links(&[("plan", "relay")]));
    assert_eq!(up, ["plan in runtime/model/plan links relay, which is in a later wing"]);
    let apart = [map[0].clone(), map[2].clone(), map[1].clone()];
    assert_eq!(objections_to_wings(&apart, &links(&[])), ["the crates of model are not together in the map"]);
}

/// Features named `testing` are for the tests of other crates: in `[dependencies]` they would be part of runners.
#[test]
fn no_crate_links_what_is_for_tests() {
    let for_tests = |dependency: &toml::Value| {
        let features = dependency.get("features").and_then(toml::Value::as_array);
        features.is_some_and(|features| features.iter().any(|feature| feature.as_str() == Some("testing")))
    };
    let mut linked = Vec::new();
    for folder in members() {
        let manifest = manifest(&folder);
        let dependencies = manifest.get("dependencies").and_then(toml::Value::as_table).into_iter().flatten();
        linked.extend(
            dependencies.filter(|(_, dependency)| for_tests(dependency)).map(|(name, _)| format!("{folder}: {name}")),
        );
    }
    assert!(linked.is_empty(), "{linked:?}");
}

#[test]
fn an_arrow_that_runs_up_a_missing_crate_and_another_link_are_objected_to() {
    let links = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect::<BTreeSet<_>>();
    let crates = BTreeMap::from([
        ("low".to_owned(), links(&[])),
        ("high".to_owned(), links(&["low"])),
        ("new".to_owned(), links(&[])),
    ]);
    let listed = |low: &[&str], high: &[&str]| {
        vec![("low".to_owned(), links(low)), ("high".to_owned(), links(high)), ("new".to_owned(), links(&[]))]
    };
    assert!(objections(&listed(&[], &["low"]), &crates).is_empty());
    assert!(objections(&listed(&["high"], &["low"]), &crates)[0].contains("runs up"));
    assert!(objections(&listed(&[], &[]), &crates)[0].contains("high links {\"low\"}"));
    assert_eq!(objections(&listed(&[], &["low"])[..2], &crates), ["new is missing in ARCHITECTURE.md"]);
}

/// The rooms that docs/rooms.md lists: by crate, the modules in the table.
fn listed_rooms(text: &str) -> BTreeMap<String, BTreeSet<String>> {
    let mut rooms: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for row in text.lines().filter(|line| line.starts_with("| ")) {
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        let modules = cells[2].split(',').map(|name| name.trim().trim_matches('`').to_owned());
        rooms.entry(cells[1].to_owned()).or_default().extend(modules);
    }
    rooms.remove("crate");
    rooms
}

/// The modules of a crate that are not for tests.
fn modules(crate_folder: &Path) -> BTreeSet<String> {
    let file = syn::parse_file(&fs::read_to_string(crate_folder.join("src/lib.rs")).unwrap()).unwrap();
    let modules = file.items.into_iter().filter_map(|item| match item {
        syn::Item::Mod(module) if !module.attrs.iter().any(is_for_tests) => Some(module.ident.to_string()),
        _ => None,
    });
    modules.filter(|name| name != "testing").collect()
}

#[test]
fn the_table_lists_each_room_of_the_runtime_and_no_other() {
    let listed = listed_rooms(&fs::read_to_string(workspace().join("docs/rooms.md")).unwrap());
    let members = members();
    for (name, rooms) in &listed {
        let folder =
            members.iter().find(|folder| folder.starts_with("runtime") && folder.rsplit('/').next() == Some(name));
        let folder =
            folder.unwrap_or_else(|| panic!("docs/rooms.md lists {name}, which is not a crate of the runtime"));
        assert_eq!(*rooms, modules(&workspace().join(folder)), "rooms of {name}: docs/rooms.md, and the crate");
    }
    assert_eq!(listed.len(), 27, "{listed:?}");
}

/// A file of a crate as the path of its module.
type Module = Vec<String>;

/// Which module names which, in the code that is not for tests.
#[derive(Default)]
struct Files {
    sources: BTreeMap<Module, syn::File>,
    /// What a module re-exports: a name, and where it comes from.
    reexports: BTreeMap<Module, BTreeMap<String, Module>>,
}

impl Files {
    fn read(crate_folder: &Path) -> Files {
        let mut files = Files::default();
        let mut waiting = vec![crate_folder.join("src")];
        while let Some(folder) = waiting.pop() {
            for entry in fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    waiting.push(path);
                } else if path.extension().is_some_and(|extension| extension == "rs") {
                    files.add(&path, &crate_folder.join("src"));
                }
            }
        }
        let modules: Vec<Module> = files.sources.keys().cloned().collect();
        for module in modules {
            let mut found = BTreeMap::new();
            for item in &files.sources[&module].items {
                let syn::Item::Use(used) = item else { continue };
                if matches!(used.vis, syn::Visibility::Inherited) {
                    continue;
                }
                for path in paths(&used.tree) {
                    let Some(target) = files.absolute(&module, &path) else { continue };
                    if let Some(name) = path.last() {
                        found.insert(name.clone(), target);
                    }
                }
            }
            files.reexports.insert(module, found);
        }
        files
    }

    fn add(&mut self, path: &Path, src: &Path) {
        let relative: PathBuf = path.strip_prefix(src).unwrap().with_extension("");
        let mut module: Module = relative.iter().map(|part| part.to_str().unwrap().to_owned()).collect();
        if module == ["lib"] || module == ["main"] {
            module.clear();
        }
        let for_tests = |part: &String| part == "tests" || part == "testing";
        if module.iter().any(for_tests) || module.first().is_some_and(|part| part == "bin") {
            return;
        }
        let file = syn::parse_file(&fs::read_to_string(path).unwrap()).unwrap_or_else(|e| panic!("{path:?}: {e}"));
        self.sources.insert(module, file);
    }

    /// A path as seen from a module, from the crate's root; `None` if it leads out of the crate.
    fn absolute(&self, module: &Module, path: &[String]) -> Option<Module> {
        let (first, rest) = path.split_first()?;
        let base = match first.as_str() {
            "crate" => Module::new(),
            "self" if rest.first().is_some_and(|part| part == "super") => return self.absolute(module, rest),
            "self" => module.clone(),
            "super" => module[..module.len().checked_sub(1)?].to_vec(),
            child => {
                let mut child_module = module.clone();
                child_module.push(child.to_owned());
                return self.sources.contains_key(&child_module).then(|| [child_module, rest.to_vec()].concat());
            }
        };
        Some([base, rest.to_vec()].concat())
    }

    /// The file in which what this path names is defined.
    fn file_of(&self, path: &[String], depth: usize) -> Module {
        let at = (0..=path.len()).rev().find(|&at| self.sources.contains_key(&path[..at])).unwrap_or(0);
        let (module, rest) = path.split_at(at);
        let reexported = rest.first().and_then(|name| self.reexports.get(module)?.get(name));
        match reexported {
            Some(target) if depth < 8 => self.file_of(target, depth + 1),
            _ => module.to_vec(),
        }
    }

    /// The files that a file names.
    fn named_by(&self, module: &Module) -> BTreeSet<Module> {
        let mut named = Named::default();
        named.visit_file(&self.sources[module]);
        let Named { mut paths, reexported, plain, .. } = named;
        paths.extend(reexported.into_iter().filter(|path| path.last().is_some_and(|name| plain.contains(name))));
        let absolute = paths.iter().filter_map(|path| self.absolute(module, path));
        absolute.map(|path| self.file_of(&path, 0)).filter(|file| file != module).collect()
    }

    /// Sets of more than two files each of which leads to each other one.
    fn circles(&self) -> Vec<Vec<String>> {
        let named: BTreeMap<&Module, BTreeSet<Module>> =
            self.sources.keys().map(|module| (module, self.named_by(module))).collect();
        let reached = |from: &Module| {
            let mut reached = BTreeSet::new();
            let mut waiting = vec![from.clone()];
            while let Some(module) = waiting.pop() {
                for next in &named[&module] {
                    if reached.insert(next.clone()) {
                        waiting.push(next.clone());
                    }
                }
            }
            reached
        };
        let reach: BTreeMap<&Module, BTreeSet<Module>> =
            self.sources.keys().map(|module| (module, reached(module))).collect();
        let mut circles = BTreeSet::new();
        for (module, far) in &reach {
            let circle: BTreeSet<&Module> = far.iter().filter(|other| reach[other].contains(*module)).collect();
            if circle.len() > 2 {
                circles.insert(circle.into_iter().map(|module| module.join("::")).collect::<Vec<_>>());
            }
        }
        circles.into_iter().collect()
    }
}

/// The paths of a `use`.
fn paths(tree: &syn::UseTree) -> Vec<Vec<String>> {
    let under = |name: &syn::Ident, rest: Vec<Vec<String>>| {
        rest.into_iter().map(|path| [vec![name.to_string()], path].concat()).collect()
    };
    match tree {
        syn::UseTree::Path(path) => under(&path.ident, paths(&path.tree)),
        syn::UseTree::Name(name) if name.ident == "self" => vec![Vec::new()],
        syn::UseTree::Name(name) => vec![vec![name.ident.to_string()]],
        syn::UseTree::Rename(renamed) if renamed.ident == "self" => vec![Vec::new()],
        syn::UseTree::Rename(renamed) => vec![vec![renamed.ident.to_string()]],
        syn::UseTree::Glob(_) => vec![Vec::new()],
        syn::UseTree::Group(group) => group.items.iter().flat_map(paths).collect(),
    }
}

/// `#[cfg(test)]`, alone or with other conditions.
fn is_for_tests(attribute: &syn::Attribute) -> bool {
    matches!(&attribute.meta, syn::Meta::List(list)
        if list.path.is_ident("cfg") && list.tokens.to_string().split_whitespace().any(|word| word == "test"))
}

/// Collects the paths that code names. A re-export is a use only if the file itself names what it re-exports.
#[derive(Default)]
struct Named {
    paths: Vec<Vec<String>>,
    reexported: Vec<Vec<String>>,
    /// Names without a path, among them those that a `use` has brought into the file.
    plain: BTreeSet<String>,
    /// How many modules inside the file are open: so many times `super` stays in the file.
    depth: usize,
}

impl Named {
    fn add(&mut self, path: &[String]) {
        let ups = path.iter().take_while(|part| *part == "super").count().min(self.depth);
        let inside = if ups > 0 { vec!["self".to_owned()] } else { Vec::new() };
        // `self::super` is the file's own parent again.
        self.paths.push([inside, path[ups..].to_vec()].concat());
    }
}

impl<'ast> Visit<'ast> for Named {
    fn visit_item(&mut self, item: &'ast syn::Item) {
        let attributes = match item {
            syn::Item::Mod(module) => &module.attrs[..],
            syn::Item::Fn(function) => &function.attrs[..],
            syn::Item::Impl(implementation) => &implementation.attrs[..],
            syn::Item::Use(used) => &used.attrs[..],
            _ => &[],
        };
        if !attributes.iter().any(is_for_tests) {
            visit::visit_item(self, item);
        }
    }

    fn visit_item_mod(&mut self, module: &'ast syn::ItemMod) {
        self.depth += 1;
        visit::visit_item_mod(self, module);
        self.depth -= 1;
    }

    fn visit_item_use(&mut self, used: &'ast syn::ItemUse) {
        for path in paths(&used.tree) {
            if matches!(used.vis, syn::Visibility::Inherited) {
                self.add(&path);
            } else {
                self.reexported.push(path);
            }
        }
    }

    /// `pub(in super)` says who may use a thing, and uses nothing.
    fn visit_visibility(&mut self, _: &'ast syn::Visibility) {}

    fn visit_path(&mut self, path: &'ast syn::Path) {
        if path.segments.len() > 1 {
            let path: Vec<String> = path.segments.iter().map(|segment| segment.ident.to_string()).collect();
            self.add(&path);
        }
        self.plain.extend(path.segments.first().map(|segment| segment.ident.to_string()));
        visit::visit_path(self, path);
    }
}

#[test]
fn no_circle_of_files_is_larger_than_two() {
    let mut found = Vec::new();
    for folder in members().into_iter().filter(|folder| workspace().join(folder).join("src").is_dir()) {
        let circles = Files::read(&workspace().join(&folder)).circles();
        found.extend(circles.into_iter().map(|circle| (folder.clone(), circle)));
    }
    assert!(found.is_empty(), "files that depend on each other in a circle, move what ties them: {found:#?}");
}

#[test]
fn a_circle_is_found_through_re_exports_and_not_through_tests() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = folder.path().join("src").join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    };
    write("lib.rs", "mod a; mod b; mod c;");
    write("a.rs", "mod inner; pub use inner::Thing; pub fn of(_: crate::b::B) {}");
    write("a/inner.rs", "pub struct Thing; mod inside { use super::Thing; }");
    write("b.rs", "use crate::c::C; pub struct B(C);");
    write("c.rs", "pub struct C; #[cfg(test)] mod tests { use crate::a::of; }");
    let circles = || Files::read(folder.path()).circles();
    assert!(circles().is_empty());
    write("a.rs", "mod inner; pub use crate::b::B; pub fn of(_: B) {}");
    write("c.rs", "use crate::a::of; pub struct C;");
    assert_eq!(circles(), [["a", "b", "c"]], "a file that names what it re-exports uses it");
    write("a.rs", "mod inner; pub use inner::Thing; pub fn of(_: crate::b::B) {}");
    write("c.rs", "use crate::a::Thing; pub struct C(Thing);");
    assert!(circles().is_empty(), "{:?}: a re-export leads to where the thing is", circles());
    write("a/inner.rs", "pub struct Thing(crate::b::B);");
    assert_eq!(circles(), [["a::inner", "b", "c"]]);
}
