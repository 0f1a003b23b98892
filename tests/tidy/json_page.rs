//! The page on what is printed as JSON lists every field, as the types in the source declare it.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::{env, fs};

use sesame_tests::workspace;
use syn::{Attribute, Fields, GenericArgument, Item, ItemEnum, ItemStruct, PathArguments, Type, UseTree};

const PAGE: &str = "docs/json.md";

/// Where the tables of the page begin.
const MARK: &str = "<!-- From here on a test writes this page; CONTRIBUTING.md says how. -->\n";

/// What is printed: the heading, how the values come, and the type with its file.
const PRINTED: [(&str, &str, &str, &str); 20] = [
    (
        "`run`, `resume`, `known`, `repeat`, `shrink`, `report`",
        "One object.",
        "Concluded",
        "runtime/src/cli/execution.rs",
    ),
    ("`null`, `mitm`, `known --lab`, `prepare`", "One object.", "Concluded", "runtime/src/cli/preparation.rs"),
    ("`causes`", "One object.", "CausesSummary", "runtime/results/report/src/facts/causes.rs"),
    ("`list`", "One object.", "TestList", "runtime/results/report/src/facts/show.rs"),
    ("`show`", "One object.", "TestReport", "runtime/results/report/src/facts/show.rs"),
    ("`show --at`", "One object.", "MomentReport", "runtime/results/report/src/facts/certificate/moment.rs"),
    (
        "`confirm`",
        "A list with an object for each test that was run again.",
        "ConfirmedTest",
        "runtime/results/analysis/src/confirmed.rs",
    ),
    ("`replay`", "One object.", "Replay", "runtime/results/report/src/facts/replay.rs"),
    ("`replay-recording`", "One object.", "RecordingReplay", "runtime/results/report/src/facts/recording.rs"),
    ("`monitors`", "One object.", "MonitorsCompared", "runtime/results/report/src/facts/monitors.rs"),
    ("`twin`", "One object.", "Twin", "runtime/results/report/src/facts/twin.rs"),
    ("`export`", "One object.", "Exported", "runtime/results/report/src/export.rs"),
    ("`export --causes`", "A list with an object for each test.", "Exported", "runtime/results/report/src/export.rs"),
    ("`digest`", "One object.", "Digest", "runtime/src/cli/view.rs"),
    (
        "`sesamec check`, `fmt`, `generate`, `run`",
        "One object per line and diagnostic.",
        "Line",
        "sesame-dsl/src/diagnostic/render/json.rs",
    ),
    ("`sesamec explain NAME FILE`", "One object.", "Explained", "sesamec/src/uses.rs"),
    ("`sesamec explain FILE`", "A list with an object for each declaration.", "Declared", "sesamec/src/uses.rs"),
    ("`sesamec scan`", "One object.", "Facts", "runtime/middleware/scan/src/facts.rs"),
    ("`sesamec agents`", "One object.", "QueueContents", "runtime/src/cli/agent.rs"),
    (
        "`sesamec agents forecast`",
        "A list with an object for each number of agents.",
        "ForecastRow",
        "runtime/src/cli/forecast.rs",
    ),
];

/// Crates whose types may be printed, by the folder of their sources.
const CRATES: [(&str, &str); 11] = [
    ("sesame_runtime", "runtime/src"),
    ("sesame_record", "runtime/results/record/src"),
    ("sesame_present", "runtime/results/present/src"),
    ("sesame_analysis", "runtime/results/analysis/src"),
    ("sesame_report", "runtime/results/report/src"),
    ("sesame_search", "runtime/search/src"),
    ("sesame_base", "runtime/model/base/src"),
    ("sesame_plan", "runtime/model/plan/src"),
    ("sesame_scan", "runtime/middleware/scan/src"),
    ("sesame_dsl", "sesame-dsl/src"),
    ("sesamec", "sesamec/src"),
];

/// A type that can be printed.
#[derive(Clone)]
enum Printed {
    Struct(ItemStruct),
    Enum(ItemEnum),
}

/// All types that serialise, by name; and the imports of each file.
struct Source {
    types: BTreeMap<String, Vec<(PathBuf, Printed)>>,
    imports: BTreeMap<PathBuf, BTreeMap<String, String>>,
}

/// The table of a type that is still to be written, and those that are.
struct Page<'a> {
    source: &'a Source,
    text: String,
    waiting: Vec<(String, PathBuf)>,
    seen: BTreeSet<(String, PathBuf)>,
}

fn rust_files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder of sources") {
        let path = entry.expect("it can be read").path();
        if path.is_dir() {
            rust_files(&path, found);
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            found.push(path);
        }
    }
}

impl Source {
    fn read() -> Self {
        let mut files = Vec::new();
        for (_, folder) in CRATES {
            rust_files(&workspace().join(folder), &mut files);
        }
        files.sort();
        let mut source = Source { types: BTreeMap::new(), imports: BTreeMap::new() };
        for path in files {
            let text = fs::read_to_string(&path).expect("a source is text");
            let parsed = syn::parse_file(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
            let path = path.strip_prefix(workspace()).expect("it is in the workspace").to_owned();
            let imports = source.imports.entry(path.clone()).or_default();
            for item in parsed.items {
                let (name, printed) = match item {
                    Item::Use(used) => {
                        note_imports(&used.tree, "", imports);
                        continue;
                    }
                    Item::Struct(of) => (of.ident.to_string(), Printed::Struct(of)),
                    Item::Enum(of) => (of.ident.to_string(), Printed::Enum(of)),
                    _ => continue,
                };
                let attributes = match &printed {
                    Printed::Struct(of) => &of.attrs,
                    Printed::Enum(of) => &of.attrs,
                };
                if name == "TestNumber" || derives_serialize(attributes) {
                    source.types.entry(name).or_default().push((path.clone(), printed));
                }
            }
        }
        source
    }

    /// The type that a file means by a name.
    fn find(&self, name: &str, file: &Path) -> (&PathBuf, &Printed) {
        let all = self.types.get(name).unwrap_or_else(|| panic!("{}: {name} does not serialise", file.display()));
        let own = |path: &Path| CRATES.iter().find(|(_, folder)| path.starts_with(folder));
        let imported = self.imports[file].get(name).map(|from| from.split("::").next().unwrap_or_default());
        let from = match imported {
            Some("crate" | "super" | "self") => own(file),
            Some(of) => CRATES.iter().find(|(name, _)| *name == of),
            None => None,
        };
        let here = all.iter().find(|(path, _)| path == file);
        let within = |folder: &str| {
            let mut found = all.iter().filter(|(path, _)| path.starts_with(folder));
            found.next().filter(|_| found.next().is_none())
        };
        let only = (all.len() == 1).then(|| &all[0]);
        let found = here.or_else(|| from.and_then(|(_, folder)| within(folder))).or(only);
        let (path, printed) = found.unwrap_or_else(|| panic!("{}: which {name}?", file.display()));
        (path, printed)
    }
}

fn note_imports(tree: &UseTree, before: &str, imports: &mut BTreeMap<String, String>) {
    match tree {
        UseTree::Path(path) => note_imports(&path.tree, &format!("{before}{}::", path.ident), imports),
        UseTree::Name(name) => drop(imports.insert(name.ident.to_string(), before.to_owned())),
        UseTree::Group(group) => group.items.iter().for_each(|tree| note_imports(tree, before, imports)),
        UseTree::Rename(_) | UseTree::Glob(_) => {}
    }
}

fn derives_serialize(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| attribute.path().is_ident("derive") && words_of(attribute).contains("Serialize"))
}

fn words_of(attribute: &Attribute) -> String {
    attribute.meta.require_list().map_or_else(|_| String::new(), |list| list.tokens.to_string())
}

/// What `serde` is told of a field or type.
fn serde(attributes: &[Attribute]) -> String {
    let of_serde = attributes.iter().filter(|attribute| attribute.path().is_ident("serde"));
    of_serde.map(words_of).collect::<Vec<_>>().join(", ")
}

/// The text behind `key =` in what `serde` is told.
fn told(serde: &str, key: &str) -> Option<String> {
    let (_, rest) = serde.split_once(&format!("{key} = \""))?;
    Some(rest.split('"').next().unwrap_or_default().to_owned())
}

/// A doc comment as a sentence for a table: links to the source become what they are called.
fn doc(attributes: &[Attribute]) -> String {
    let mut text = Vec::new();
    for attribute in attributes.iter().filter(|attribute| attribute.path().is_ident("doc")) {
        if let syn::Meta::NameValue(value) = &attribute.meta
            && let syn::Expr::Lit(literal) = &value.value
            && let syn::Lit::Str(line) = &literal.lit
        {
            text.push(line.value().trim().to_owned());
        }
    }
    let text = text.join(" ").replace("`None`", "`null`").replace('|', "\\|");
    let mut plain = String::new();
    let mut rest = text.as_str();
    while let Some((before, linked)) = rest.split_once('[') {
        let Some((name, after)) = linked.split_once(']') else { break };
        plain.push_str(before);
        let of_source = name.starts_with('`') || after.starts_with('(');
        let [open, close] = if of_source { ["", ""] } else { ["[", "]"] };
        plain.extend([open, name, close]);
        rest = after;
        if after.starts_with('(') {
            rest = after.split_once(')').map_or("", |(_, rest)| rest);
        }
    }
    plain.push_str(rest);
    // Where a type of the source is in parentheses, that is for readers of the source.
    while let Some((before, rest)) = plain.split_once(" (`")
        && let Some((within, after)) = rest.split_once(')')
        && within.contains("::")
    {
        plain = format!("{before}{after}");
    }
    plain
}

fn snake_case(name: &str) -> String {
    let mut out = String::new();
    for (at, c) in name.char_indices() {
        if c.is_uppercase() && at > 0 {
            out.push('_');
        }
        out.extend(c.to_lowercase());
    }
    out
}

impl Page<'_> {
    /// What a value of a type is, in words.
    fn value(&mut self, ty: &Type, file: &Path) -> String {
        let segment = match ty {
            Type::Reference(of) => return self.value(&of.elem, file),
            Type::Slice(of) => return format!("list of {}", self.value(&of.elem, file)),
            Type::Array(of) => return format!("list of {}", self.value(&of.elem, file)),
            Type::Tuple(of) => {
                let values: Vec<String> = of.elems.iter().map(|ty| self.value(ty, file)).collect();
                return format!("list of {}", values.join(" and "));
            }
            Type::Path(path) => path.path.segments.last().expect("a path has segments"),
            _ => panic!("{}: a type that this page does not know", file.display()),
        };
        let inner = |nth: usize| match &segment.arguments {
            PathArguments::AngleBracketed(given) => {
                let mut types = given.args.iter().filter_map(|given| match given {
                    GenericArgument::Type(ty) => Some(ty.clone()),
                    _ => None,
                });
                types.nth(nth).expect("it has so many")
            }
            _ => panic!("{}: a type without arguments", file.display()),
        };
        match segment.ident.to_string().as_str() {
            "f64" => "number".to_owned(),
            "u8" | "u16" | "u32" | "u64" | "i32" | "i64" | "usize" => "whole number".to_owned(),
            "bool" => "truth value".to_owned(),
            "str" | "String" | "Path" | "PathBuf" => "text".to_owned(),
            "TestNumber" => "text such as `T5`".to_owned(),
            "Option" => format!("{} or `null`", self.value(&inner(0), file)),
            "Vec" => format!("list of {}", self.value(&inner(0), file)),
            "Box" | "Arc" => self.value(&inner(0), file),
            "BTreeMap" => format!("object with {} by name", self.value(&inner(1), file)),
            name => self.named(name, file),
        }
    }

    fn named(&mut self, name: &str, file: &Path) -> String {
        let (path, printed) = self.source.find(name, file);
        match printed {
            Printed::Struct(ItemStruct { fields: Fields::Unnamed(one), .. }) if one.unnamed.len() == 1 => {
                self.value(&one.unnamed[0].ty, path)
            }
            Printed::Enum(of) if of.variants.iter().all(|variant| variant.fields.is_empty()) => {
                let snake = told(&serde(&of.attrs), "rename_all").is_some();
                let word = |name: String| format!("`{}`", if snake { snake_case(&name) } else { name });
                let words = of.variants.iter().map(|variant| word(variant.ident.to_string()));
                format!("one of {}", words.collect::<Vec<_>>().join(", "))
            }
            _ => {
                let key = (name.to_owned(), path.clone());
                if self.seen.insert(key.clone()) {
                    self.waiting.push(key);
                }
                format!("[{name}](#{})", name.to_lowercase())
            }
        }
    }

    fn table(&mut self, name: &str, file: &Path) {
        let (path, printed) = self.source.find(name, file);
        let (path, printed) = (path.clone(), printed.clone());
        match printed {
            Printed::Struct(of) => {
                self.text.push_str("| field | value | meaning |\n|---|---|---|\n");
                self.rows(&of.fields, &path);
            }
            Printed::Enum(of) => {
                let tag = told(&serde(&of.attrs), "tag");
                let tag = tag.unwrap_or_else(|| panic!("{}: {name} has no tag", path.display()));
                let kinds = of.variants.iter().map(|variant| format!("`{}`", snake_case(&variant.ident.to_string())));
                let kinds = kinds.collect::<Vec<_>>().join(", ");
                let _ = writeln!(
                    self.text,
                    "| field | value | meaning |\n|---|---|---|\n| `{tag}` | one of {kinds} | Which kind it is. |"
                );
                for variant in &of.variants {
                    let kind = snake_case(&variant.ident.to_string());
                    let _ = writeln!(self.text, "| | | **`{kind}`**: {} |", doc(&variant.attrs));
                    self.rows(&variant.fields, &path);
                }
            }
        }
    }

    fn rows(&mut self, fields: &Fields, file: &Path) {
        for field in fields {
            let serde = serde(&field.attrs);
            if serde.split(", ").any(|word| word == "skip") {
                continue;
            }
            if serde.contains("flatten") {
                let Type::Path(path) = (match &field.ty {
                    Type::Reference(of) => &*of.elem,
                    other => other,
                }) else {
                    panic!("{}: what is flattened is a struct", file.display())
                };
                let name = path.path.segments.last().expect("a path has segments").ident.to_string();
                let (path, printed) = self.source.find(&name, file);
                let Printed::Struct(of) = printed.clone() else { panic!("{name} is not a struct") };
                self.rows(&of.fields, &path.clone());
                continue;
            }
            let rust = field.ident.as_ref().expect("fields have names").to_string();
            let name = told(&serde, "rename").unwrap_or_else(|| rust.trim_start_matches("r#").to_owned());
            let value = self.value(&field.ty, file);
            let mut meaning = doc(&field.attrs);
            assert!(!meaning.is_empty(), "{}: `{name}` has no doc comment", file.display());
            let left_out = match told(&serde, "skip_serializing_if").as_deref() {
                None => "",
                Some("Option::is_none") => " Left out if there is none.",
                Some("Vec::is_empty") => " Left out if it is empty.",
                Some(_) => " Left out if it is the default.",
            };
            meaning.push_str(left_out);
            let value = if left_out.contains("none") { value.replace(" or `null`", "") } else { value };
            let _ = writeln!(self.text, "| `{name}` | {value} | {meaning} |");
        }
    }
}

/// The tables of the page.
fn tables() -> String {
    let source = Source::read();
    let mut page = Page { source: &source, text: String::new(), waiting: Vec::new(), seen: BTreeSet::new() };
    for (heading, how, name, file) in PRINTED {
        let _ = writeln!(page.text, "\n## {heading}\n\n{how}\n");
        page.table(name, Path::new(file));
    }
    page.text.push_str("\n## Parts\n");
    let mut parts = BTreeMap::new();
    while let Some((name, file)) = page.waiting.pop() {
        let before = std::mem::take(&mut page.text);
        page.table(&name, &file);
        let table = std::mem::replace(&mut page.text, before);
        let two = parts.insert(name.clone(), table);
        assert!(two.is_none(), "two parts of what is printed are called {name}: rename one");
    }
    for (name, table) in parts {
        let _ = write!(page.text, "\n### {name}\n\n{table}");
    }
    page.text
}

#[test]
fn the_page_on_json_has_every_field_that_is_printed_and_no_other() {
    let path = workspace().join(PAGE);
    let page = fs::read_to_string(&path).unwrap();
    let (head, written) = page.split_once(MARK).expect("the page has a mark before its tables");
    let tables = tables();
    if env::var("INSTA_UPDATE").is_ok_and(|update| update == "always") {
        fs::write(&path, format!("{head}{MARK}{tables}")).unwrap();
        return;
    }
    let difference = written.lines().zip(tables.lines()).find(|(written, wanted)| written != wanted);
    assert!(
        written == tables,
        "{PAGE} is not what the types in the source say; write it anew with `INSTA_UPDATE=always cargo test -p sesame-tests \
         --test tidy`. The first difference: {difference:#?}"
    );
}
