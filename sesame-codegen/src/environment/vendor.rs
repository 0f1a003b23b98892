//! Crates that are copied into a runner, so that it builds where there is neither a checkout nor a project.
//!
//! Copied are the runtime, the simulator's crate, and every crate they or the hooks reach by a path. Manifests are
//! written anew: what they inherit from a workspace stands in them, paths lead to the copies beside them, and what only
//! serves tests is left out. A dependency on the runtime, wherever it came from, is on the copy. Dependencies on
//! registries stay what they are.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use toml::{Table, Value};

use super::{Error, RUNTIME, files_below, package_name, settled};
use crate::input;

/// Where copies are, inside a runner.
const FOLDER: &str = "vendor";

/// Tables of dependencies that building a crate needs.
const DEPENDENCIES: [&str; 2] = ["dependencies", "build-dependencies"];

/// What a manifest says of workspaces, tests and builds of its own; in a copy it has no meaning or is in the way.
const LEFT_OUT: [&str; 9] =
    ["workspace", "profile", "patch", "replace", "dev-dependencies", "test", "bench", "example", "badges"];

/// Folders of a crate that only serve its development.
const LEFT_OUT_FOLDERS: [&str; 4] = ["target", "tests", "benches", "examples"];

/// The files of the copies, by path inside a runner; and lets `dependencies`, whose paths are as seen from `runner`,
/// lead to them.
pub(super) fn vendor(
    runner: &Path,
    dependencies: &mut BTreeMap<String, Value>,
) -> Result<BTreeMap<String, Vec<u8>>, Vec<Error>> {
    let mut crates = Crates::default();
    let mut errors = Vec::new();
    for (name, value) in dependencies {
        let path = value.get("path").and_then(Value::as_str);
        match path.map(|path| crates.copy(&runner.join(path))) {
            None if name == RUNTIME => errors.push(Error::RuntimeHasNoFolder),
            None => {}
            Some(Ok(package)) => lead_to(value, &format!("{FOLDER}/{package}")),
            Some(Err(error)) => errors.push(error),
        }
    }
    let mut files = BTreeMap::new();
    while let Some(package) = crates.waiting.pop() {
        match crates.files(&package) {
            Ok(own) => files.extend(own),
            Err(error) => errors.push(error),
        }
    }
    if errors.is_empty() { Ok(files) } else { Err(errors) }
}

/// Crates to be copied.
#[derive(Default)]
struct Crates {
    /// The folder of each, by the name of its package.
    folders: BTreeMap<String, PathBuf>,
    /// Those whose files have not been looked at.
    waiting: Vec<String>,
}

impl Crates {
    /// Copies the crate in a folder too, and gives the name of its package.
    fn copy(&mut self, folder: &Path) -> Result<String, Error> {
        let folder = settled(folder)?;
        let package = package_name(&folder.join("Cargo.toml"))?;
        let failed = |problem| Error::Vendor { path: folder.clone(), problem };
        if !crate::emit::is_package_name(&package) {
            return Err(failed(format!("`{}` is not the name of a package", package.escape_debug())));
        }
        match self.folders.get(&package) {
            Some(known) if *known == folder => {}
            Some(other) => {
                return Err(failed(format!("its package `{package}` is called like the one in {}", other.display())));
            }
            None => {
                self.folders.insert(package.clone(), folder);
                self.waiting.push(package.clone());
            }
        }
        Ok(package)
    }

    /// The files of a crate, by path inside a runner.
    fn files(&mut self, package: &str) -> Result<BTreeMap<String, Vec<u8>>, Error> {
        let folder = self.folders[package].clone();
        let mut files = BTreeMap::new();
        let all = files_below(&folder)?;
        let nested: BTreeSet<&str> = all.iter().filter_map(|path| path.strip_suffix("/Cargo.toml")).collect();
        for path in &all {
            let left_out = path.split_once('/').is_some_and(|(first, _)| LEFT_OUT_FOLDERS.contains(&first));
            let of_another =
                nested.iter().any(|nested| path.strip_prefix(nested).is_some_and(|rest| rest.starts_with('/')));
            if left_out || of_another || ["Cargo.toml", "Cargo.lock"].contains(&path.as_str()) {
                continue;
            }
            let source = folder.join(path);
            if path.contains(['\\', ':', '\0']) {
                let problem = "its name has a sign in it that not every system allows".to_owned();
                return Err(Error::Vendor { path: source, problem });
            }
            let contents =
                input::bytes(&source, input::MOST_OF_A_COPY).map_err(|cause| Error::Read { path: source, cause })?;
            files.insert(format!("{FOLDER}/{package}/{path}"), contents);
        }
        let manifest = self.manifest(&folder)?;
        let text =
            toml::to_string(&manifest).map_err(|error| Error::Vendor { path: folder, problem: error.to_string() })?;
        let note = "# A copy that `sesamec generate --vendor` made. Do not edit: it is written anew.\n\n";
        files.insert(format!("{FOLDER}/{package}/Cargo.toml"), format!("{note}{text}").into_bytes());
        Ok(files)
    }

    /// The manifest of a copy.
    fn manifest(&mut self, folder: &Path) -> Result<Table, Error> {
        let path = folder.join("Cargo.toml");
        let mut manifest = table(&path)?;
        let workspace = Workspace::of(folder, &manifest)?;
        if let Some(package) = manifest.get_mut("package").and_then(Value::as_table_mut) {
            let inherited: Vec<String> =
                package.iter().filter(|(_, value)| inherits(value)).map(|(key, _)| key.clone()).collect();
            for key in inherited {
                // These are files of the workspace, for people.
                if ["readme", "license-file"].contains(&key.as_str()) {
                    package.remove(&key);
                    continue;
                }
                let value = workspace.get(&path, &["package", &key])?;
                package.insert(key, value);
            }
            package.remove("workspace");
        }
        if manifest.get("lints").is_some_and(inherits) {
            manifest.insert("lints".to_owned(), workspace.get(&path, &["lints"])?);
        }
        for key in LEFT_OUT {
            manifest.remove(key);
        }
        self.dependencies(&mut manifest, &path, &workspace)?;
        if let Some(targets) = manifest.get_mut("target").and_then(Value::as_table_mut) {
            for (_, target) in targets.iter_mut() {
                if let Some(target) = target.as_table_mut() {
                    target.remove("dev-dependencies");
                    self.dependencies(target, &path, &workspace)?;
                }
            }
        }
        Ok(manifest)
    }

    fn dependencies(&mut self, table: &mut Table, manifest: &Path, workspace: &Workspace) -> Result<(), Error> {
        let home = manifest.parent().unwrap_or(Path::new("."));
        for kind in DEPENDENCIES {
            let Some(dependencies) = table.get_mut(kind).and_then(Value::as_table_mut) else { continue };
            for (name, value) in dependencies.iter_mut() {
                let mut base = home;
                if inherits(value) {
                    *value = inherited(value, workspace.get(manifest, &["dependencies", name])?);
                    base = &workspace.folder;
                }
                let package = value.get("package").and_then(Value::as_str).unwrap_or(name).to_owned();
                if package == RUNTIME {
                    lead_to(value, &format!("../{RUNTIME}"));
                } else if let Some(path) = value.get("path").and_then(Value::as_str) {
                    let package = self.copy(&base.join(path))?;
                    lead_to(value, &format!("../{package}"));
                }
            }
        }
        Ok(())
    }
}

/// The workspace that a crate inherits from.
struct Workspace {
    folder: PathBuf,
    /// Its `[workspace]`; empty if there is none.
    table: Table,
}

impl Workspace {
    /// The workspace of a crate: named by its manifest, or the nearest around it, as cargo looks for it.
    fn of(folder: &Path, manifest: &Table) -> Result<Self, Error> {
        let named = manifest.get("package").and_then(|package| package.get("workspace")).and_then(Value::as_str);
        let candidates: Vec<PathBuf> = match named {
            Some(named) => vec![settled(&folder.join(named))?],
            None => folder.ancestors().map(Path::to_owned).collect(),
        };
        for folder in candidates {
            let path = folder.join("Cargo.toml");
            if path.is_file()
                && let Some(table) = table(&path)?.get("workspace").and_then(Value::as_table)
            {
                return Ok(Workspace { folder, table: table.clone() });
            }
        }
        Ok(Workspace { folder: folder.to_owned(), table: Table::new() })
    }

    fn get(&self, manifest: &Path, keys: &[&str]) -> Result<Value, Error> {
        let found = keys.iter().try_fold(None::<&Value>, |at, key| match at {
            None => self.table.get(*key).map(Some),
            Some(at) => at.get(*key).map(Some),
        });
        found.flatten().cloned().ok_or_else(|| Error::Vendor {
            path: manifest.to_owned(),
            problem: format!("it inherits `{}`, which no workspace around it has", keys.join(".")),
        })
    }
}

/// Whether a value of a manifest is to be taken from the workspace.
fn inherits(value: &Value) -> bool {
    value.get("workspace").and_then(Value::as_bool) == Some(true)
}

/// A dependency of a workspace with what a member adds to it.
fn inherited(own: &Value, workspace: Value) -> Value {
    let mut merged = match workspace {
        Value::Table(table) => table,
        version => Table::from_iter([("version".to_owned(), version)]),
    };
    for (key, value) in own.as_table().into_iter().flatten().filter(|(key, _)| *key != "workspace") {
        match (merged.get_mut(key).and_then(Value::as_array_mut), value.as_array()) {
            (Some(features), Some(more)) => features.extend(more.iter().cloned()),
            _ => drop(merged.insert(key.clone(), value.clone())),
        }
    }
    Value::Table(merged)
}

/// Replaces the source of a dependency by a folder.
fn lead_to(value: &mut Value, path: &str) {
    let mut table = match std::mem::replace(value, Value::from("")) {
        Value::Table(table) => table,
        _ => Table::new(),
    };
    for key in ["version", "git", "branch", "tag", "rev", "registry"] {
        table.remove(key);
    }
    table.insert("path".to_owned(), path.into());
    *value = Value::Table(table);
}

fn table(path: &Path) -> Result<Table, Error> {
    let text = input::text(path).map_err(|cause| Error::Read { path: path.to_owned(), cause })?;
    toml::from_str(&text)
        .map_err(|error| Error::Settings { path: path.to_owned(), problem: error.to_string().trim_end().to_owned() })
}
