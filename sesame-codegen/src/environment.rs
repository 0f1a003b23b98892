//! What emitted crates need of the world: the runtime, the simulator's crate, and what `sesame.toml` lists. Reads files,
//! writes none.
//!
//! Paths are written as seen from a runner's folder, relative wherever there is a relative way, so that a checkout or
//! a project can be moved as a whole.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf};

use serde::Deserialize;
use sesame_plan::Transport;
use toml::{Table, Value};

use crate::emit::{Environment, simulator_path};
use crate::plan::RunnerPlan;

/// The name of the file beside a `.sesame` file that says what its runners need.
pub const SETTINGS: &str = "sesame.toml";

const RUNTIME: &str = "sesame-runtime";

/// Why the surroundings of a runner cannot be worked out.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file cannot be read.
    #[error("cannot read {}: {cause}", path.display())]
    Read {
        /// Which.
        path: PathBuf,
        /// What the system says.
        cause: io::Error,
    },
    /// A file is not what it should be.
    #[error("{}: {problem}", path.display())]
    Settings {
        /// Which.
        path: PathBuf,
        /// What is wrong in it, and what to do.
        problem: String,
    },
    /// The folder that the `.sesame` file names holds no crate.
    #[error("{source_file} says the simulator's crate is in `{folder}`, but there is no {}", manifest.display())]
    NoSimulator {
        /// File name of the `.sesame` file.
        source_file: String,
        /// The folder as it stands there.
        folder: String,
        /// The manifest that is missing.
        manifest: PathBuf,
    },
    /// Nothing says where the simulator's crate comes from.
    #[error(
        "nothing says where the crate `{name}` of the simulator `{path}` comes from: \
         add `crate \"its/folder\"` to the simulator in {source_file}, or `{name}` to [dependencies] in {SETTINGS}"
    )]
    UnknownSimulator {
        /// The crate.
        name: String,
        /// The simulator's path.
        path: String,
        /// File name of the `.sesame` file.
        source_file: String,
    },
    /// There is no runtime where one was said to be.
    #[error("there is no {RUNTIME} in {}: give the folder of its Cargo.toml", folder.display())]
    NoRuntime {
        /// Where.
        folder: PathBuf,
    },
    /// The program that the `.sesame` file gives by its path is not there.
    #[error("{source_file} says the simulator's program is `{program}`, but there is no {}", file.display())]
    NoProgram {
        /// File name of the `.sesame` file.
        source_file: String,
        /// The program as it stands there.
        program: String,
        /// The file that is missing.
        file: PathBuf,
    },
    /// A path that TOML cannot hold.
    #[error("the path {} is not UTF-8, and so cannot stand in a Cargo.toml", path.display())]
    NotText {
        /// Which.
        path: PathBuf,
    },
}

/// Where runners take the runtime from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RuntimeChoice {
    /// A folder, relative to the working directory.
    Folder(PathBuf),
    /// A released version.
    Version(String),
}

impl RuntimeChoice {
    /// From the command line: `path:FOLDER` or a version.
    pub fn parse(text: &str) -> Result<Self, String> {
        match text.strip_prefix("path:") {
            Some(folder) if !folder.is_empty() => Ok(RuntimeChoice::Folder(folder.into())),
            None if text.starts_with(|first: char| first.is_ascii_digit() || "=^~<>".contains(first)) => {
                Ok(RuntimeChoice::Version(text.to_owned()))
            }
            _ => Err(format!("expected `path:FOLDER` or a version such as `{}`", env!("CARGO_PKG_VERSION"))),
        }
    }
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Settings {
    runtime: Option<Table>,
    dependencies: Table,
}

/// The checkout that this sesamec was built from: the folder of its runtime, if it is still there. A released build
/// sets `SESAMEC_RELEASE` while compiling and knows of no checkout.
pub fn checkout_runtime() -> Option<PathBuf> {
    if option_env!("SESAMEC_RELEASE").is_some() {
        return None;
    }
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).parent()?.join("runtime");
    is_runtime(&folder).then_some(folder)
}

fn is_runtime(folder: &Path) -> bool {
    package_name(&folder.join("Cargo.toml")).is_ok_and(|name| name == RUNTIME)
}

/// The surroundings of the runners of a space.
///
/// `source` is the `.sesame` file, `out` the output folder, which need not exist yet, and `plans` are all of one space.
pub fn environment(
    source: &Path,
    out: &Path,
    plans: &[RunnerPlan],
    runtime: Option<&RuntimeChoice>,
) -> Result<Environment, Vec<Error>> {
    let home = source
        .parent()
        .map_or_else(|| Path::new("."), |parent| if parent == Path::new("") { Path::new(".") } else { parent });
    let runner_folder = settled(out).map_err(|error| vec![error])?.join("runner");
    let mut errors = Vec::new();
    let settings = settings(&home.join(SETTINGS)).unwrap_or_else(|error| {
        errors.push(error);
        Settings::default()
    });
    let mut dependencies = BTreeMap::new();
    let mut lock = None;
    match runtime_dependency(&runner_folder, home, runtime, settings.runtime.as_ref()) {
        Ok((value, folder)) => {
            dependencies.insert(RUNTIME.to_owned(), value);
            lock = first_lock(out).or_else(|| folder.and_then(|folder| workspace_lock(&folder)));
        }
        Err(error) => errors.push(error),
    }
    for (name, value) in &settings.dependencies {
        if name.replace('_', "-") == RUNTIME {
            let problem = format!("`{name}` does not belong into [dependencies]: choose it in [runtime]");
            errors.push(Error::Settings { path: home.join(SETTINGS), problem });
            continue;
        }
        match rebased(value, &runner_folder, home) {
            Ok(value) => {
                dependencies.insert(name.clone(), value);
            }
            Err(error) => errors.push(error),
        }
    }
    if let Some(first) = plans.first() {
        match simulator_dependency(&runner_folder, home, first, &dependencies) {
            Ok(Some((name, value))) => {
                dependencies.insert(name, value);
            }
            Ok(None) => {}
            Err(error) => errors.push(error),
        }
    }
    if !errors.is_empty() {
        return Err(errors);
    }
    let mut options = BTreeMap::new();
    if let Some(choice) = runtime {
        let text = match choice {
            RuntimeChoice::Folder(folder) => {
                format!("path:{}", relative(&runner_folder, folder).map_err(|error| vec![error])?)
            }
            RuntimeChoice::Version(version) => version.clone(),
        };
        options.insert("runtime".to_owned(), text);
    }
    let system = plans.first().map_or_else(|| home.to_owned(), |first| home.join(first.system_folder()));
    let space_folder = relative(&runner_folder, home).map_err(|error| vec![error])?;
    let simulator_folder = relative(&runner_folder, &system).map_err(|error| vec![error])?;
    Ok(Environment { dependencies, lock, options, space_folder, simulator_folder })
}

/// The runtime as a dependency of a crate in `folder`, which need not exist yet.
pub fn runtime_for(folder: &Path, runtime: Option<&RuntimeChoice>) -> Result<Value, Error> {
    runtime_dependency(&settled(folder)?, Path::new("."), runtime, None).map(|(value, _)| value)
}

fn settings(path: &Path) -> Result<Settings, Error> {
    match fs::read_to_string(path) {
        Ok(text) => toml::from_str(&text).map_err(|error| Error::Settings {
            path: path.to_owned(),
            problem: error.to_string().trim_end().to_owned(),
        }),
        Err(cause) if cause.kind() == io::ErrorKind::NotFound => Ok(Settings::default()),
        Err(cause) => Err(Error::Read { path: path.to_owned(), cause }),
    }
}

/// The runtime as a dependency, and its folder if it has one: what the command line says, else `sesame.toml`, else the
/// checkout this sesamec was built from, else the release of the same version.
fn runtime_dependency(
    runner: &Path,
    home: &Path,
    choice: Option<&RuntimeChoice>,
    settings: Option<&Table>,
) -> Result<(Value, Option<PathBuf>), Error> {
    let folder = match (choice, settings) {
        (Some(RuntimeChoice::Version(version)), _) => return Ok((Value::from(version.as_str()), None)),
        (Some(RuntimeChoice::Folder(folder)), _) => folder.clone(),
        (None, Some(table)) => match table.get("path").and_then(Value::as_str) {
            Some(path) => home.join(path),
            None => return Ok((Value::Table(table.clone()), None)),
        },
        (None, None) => match checkout_runtime() {
            Some(folder) => folder,
            None => return Ok((Value::from(concat!("=", env!("CARGO_PKG_VERSION"))), None)),
        },
    };
    if !is_runtime(&folder) {
        return Err(Error::NoRuntime { folder });
    }
    let table = Table::from_iter([("path".to_owned(), Value::from(relative(runner, &folder)?))]);
    Ok((Value::Table(table), Some(folder)))
}

/// The simulator's crate as a dependency; `None` when `sesame.toml` lists it, or when it is a program.
fn simulator_dependency(
    runner: &Path,
    home: &Path,
    plan: &RunnerPlan,
    dependencies: &BTreeMap<String, Value>,
) -> Result<Option<(String, Value)>, Error> {
    let system = home.join(plan.system_folder());
    let path = match &plan.plan.simulator.transport {
        Transport::InProcess { .. } => simulator_path(&plan.plan.simulator.transport).unwrap_or_default(),
        Transport::Process { program, .. } => {
            let file = system.join(program);
            if program.contains('/') && !file.is_file() {
                let (source_file, program) = (plan.plan.source.clone(), program.clone());
                return Err(Error::NoProgram { source_file, program, file });
            }
            return Ok(None);
        }
    };
    let name = path.first().copied().unwrap_or_default().to_owned();
    let listed = dependencies.keys().any(|key| key.replace('-', "_") == name);
    let Some(folder) = &plan.simulator_crate else {
        if listed {
            return Ok(None);
        }
        let source_file = plan.plan.source.clone();
        return Err(Error::UnknownSimulator { name, path: path.join("::"), source_file });
    };
    if listed {
        let source = &plan.plan.source;
        let problem =
            format!("`{name}` is the simulator's crate, which {source} places in `{folder}`: remove one of them");
        return Err(Error::Settings { path: home.join(SETTINGS), problem });
    }
    let crate_folder = system.join(folder);
    let manifest = crate_folder.join("Cargo.toml");
    if !manifest.is_file() {
        let source_file = plan.plan.source.clone();
        return Err(Error::NoSimulator { source_file, folder: folder.clone(), manifest });
    }
    let mut table = Table::new();
    table.insert("path".to_owned(), relative(runner, &crate_folder)?.into());
    let package = package_name(&manifest)?;
    if package != name {
        table.insert("package".to_owned(), package.into());
    }
    Ok(Some((name, Value::Table(table))))
}

fn package_name(manifest: &Path) -> Result<String, Error> {
    let failed = |problem: String| Error::Settings { path: manifest.to_owned(), problem };
    let text = fs::read_to_string(manifest).map_err(|cause| Error::Read { path: manifest.to_owned(), cause })?;
    let table: Table = toml::from_str(&text).map_err(|error| failed(error.to_string()))?;
    let name = table.get("package").and_then(|package| package.get("name")).and_then(Value::as_str);
    name.map(str::to_owned).ok_or_else(|| failed("it names no package".to_owned()))
}

/// A dependency whose path, if it has one, is as seen from a runner and not from `sesame.toml`.
fn rebased(value: &Value, runner: &Path, home: &Path) -> Result<Value, Error> {
    let mut value = value.clone();
    if let Some(path) = value.get("path").and_then(Value::as_str) {
        let path = relative(runner, &home.join(path))?;
        if let Some(table) = value.as_table_mut() {
            table.insert("path".to_owned(), path.into());
        }
    }
    Ok(value)
}

/// The lock file of the first runner in a folder that has one.
fn first_lock(out: &Path) -> Option<String> {
    let mut locks: Vec<PathBuf> =
        fs::read_dir(out).ok()?.filter_map(Result::ok).map(|entry| entry.path().join("Cargo.lock")).collect();
    locks.sort();
    locks.iter().find_map(|lock| fs::read_to_string(lock).ok())
}

/// The lock file of the workspace that the runtime is of: its versions are those that were tested together, and cargo
/// leaves out what a runner does not use.
fn workspace_lock(runtime: &Path) -> Option<String> {
    runtime.ancestors().take(3).find_map(|folder| fs::read_to_string(folder.join("Cargo.lock")).ok())
}

/// An absolute path without links and `..`; its last parts need not exist.
fn settled(path: &Path) -> Result<PathBuf, Error> {
    let absolute = std::path::absolute(path).map_err(|cause| Error::Read { path: path.to_owned(), cause })?;
    let existing = absolute.ancestors().find(|ancestor| ancestor.exists()).unwrap_or(Path::new("/"));
    let mut settled = existing.canonicalize().map_err(|cause| Error::Read { path: existing.to_owned(), cause })?;
    for part in absolute.strip_prefix(existing).unwrap_or(Path::new("")).components() {
        match part {
            Component::ParentDir => {
                settled.pop();
            }
            part => settled.push(part),
        }
    }
    Ok(settled)
}

/// A path as seen from a settled folder, with `/` between its parts; absolute if there is no relative way.
fn relative(from: &Path, to: &Path) -> Result<String, Error> {
    let to = settled(to)?;
    let shared = from.components().zip(to.components()).take_while(|(here, there)| here == there).count();
    if shared == 0 {
        return to.to_str().map(str::to_owned).ok_or(Error::NotText { path: to });
    }
    let up = from.components().skip(shared).map(|_| Ok(".."));
    let down = to.components().skip(shared).map(|part| part.as_os_str().to_str().ok_or(()));
    let parts: Result<Vec<&str>, ()> = up.chain(down).collect();
    let parts = parts.map_err(|()| Error::NotText { path: to.clone() })?;
    Ok(if parts.is_empty() { ".".to_owned() } else { parts.join("/") })
}
