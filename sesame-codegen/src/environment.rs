//! What emitted crates need of the world: the runtime, the simulator's crate, and what `sesame.toml` lists. Reads
//! files, writes none.
//!
//! Paths are written as seen from a runner's folder, relative wherever there is a relative way, so that a checkout or
//! a project can be moved as a whole.

mod vendor;

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf};

use serde::Deserialize;
use toml::{Table, Value};

use crate::emit::{Environment, HooksFolder, Problem, Templates, simulator_path};
use crate::input::{self, Unreadable};
use crate::plan::RunnerPlan;

/// The name of the file beside a `.sesame` file that says what its runners need.
pub(crate) const SETTINGS: &str = "sesame.toml";

/// The folder beside a `.sesame` file that its runners are in, if nothing else is said.
pub const RUNNERS: &str = "runners";

const RUNTIME: &str = "sesame-runtime";

/// Why the surroundings of a runner cannot be worked out.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file cannot be read.
    #[error("cannot read {}: {cause}", path.display())]
    Read {
        /// Which.
        path: PathBuf,
        /// Why.
        cause: Unreadable,
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
    #[error("{source_file} places the simulator's crate in `{folder}`, but {} does not exist", manifest.display())]
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
        "the location of the crate `{name}` of the simulator `{path}` is unknown: \
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
    #[error("no {RUNTIME} in {}: give the folder of its Cargo.toml", folder.display())]
    NoRuntime {
        /// Where.
        folder: PathBuf,
    },
    /// The program that the `.sesame` file gives by its path is not there.
    #[error("{source_file} gives the simulator's program as `{program}`, but {} does not exist", file.display())]
    NoProgram {
        /// File name of the `.sesame` file.
        source_file: String,
        /// The program as it stands there.
        program: String,
        /// The file that is missing.
        file: PathBuf,
    },
    /// Templates of the user's cannot be used.
    #[error("{}: {problem}", folder.display())]
    Templates {
        /// Their folder.
        folder: PathBuf,
        /// What is wrong.
        problem: Problem,
    },
    /// A runtime that is in no folder cannot be copied.
    #[error(
        "`--vendor` copies the runtime, so it needs the source in a folder: give it with `--runtime path:FOLDER`, or as \
         `path` in [runtime] of {SETTINGS}"
    )]
    RuntimeHasNoFolder,
    /// A crate that cannot be copied into a runner.
    #[error("{} cannot be copied into a runner: {problem}", path.display())]
    Vendor {
        /// The folder of the crate, or a file in it.
        path: PathBuf,
        /// Why.
        problem: String,
    },
    /// A path that TOML cannot hold.
    #[error("the path {} is not UTF-8 and cannot be written into a Cargo.toml", path.display())]
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
    /// A repository.
    Git {
        /// Its address.
        url: String,
        /// What to take of it: `tag`, `branch` or `rev`, and which. Its main branch if not said.
        reference: Option<(&'static str, String)>,
    },
}

/// What a command line says of the surroundings.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct EnvironmentOptions {
    /// Where runners take the runtime from; if not said: `[runtime]` in `sesame.toml`, else the checkout that sesamec
    /// was built from, else the released version.
    pub runtime: Option<RuntimeChoice>,
    /// A folder, relative to the working directory, with templates in place of this project's; if not said: `templates`
    /// in `sesame.toml`, which is relative to that.
    pub templates: Option<PathBuf>,
    /// Each runner has the hooks in its own folder.
    pub self_contained: bool,
    /// Each runner has the hooks, the runtime, the simulator, and every other crate that is in a folder in its own
    /// folder.
    pub vendor: bool,
}

impl RuntimeChoice {
    /// From the command line: `path:FOLDER`, `git:URL`, `git:URL?tag=TAG` (or `branch=`, `rev=`) or a version.
    pub fn parse(text: &str) -> Result<Self, String> {
        if let Some(git) = text.strip_prefix("git:").filter(|git| !git.is_empty()) {
            return Self::parse_git(git);
        }
        match text.strip_prefix("path:") {
            Some(folder) if !folder.is_empty() => Ok(RuntimeChoice::Folder(folder.into())),
            None if text.starts_with(|first: char| first.is_ascii_digit() || "=^~<>".contains(first)) => {
                Ok(RuntimeChoice::Version(text.to_owned()))
            }
            _ => Err(format!(
                "expected `path:FOLDER`, `git:URL`, `git:URL?tag=TAG` or a version such as `{}`",
                env!("CARGO_PKG_VERSION")
            )),
        }
    }

    fn parse_git(git: &str) -> Result<Self, String> {
        let Some((url, reference)) = git.rsplit_once('?') else {
            return Ok(RuntimeChoice::Git { url: git.to_owned(), reference: None });
        };
        let known = ["tag", "branch", "rev"].into_iter().find_map(|kind| {
            let name = reference.strip_prefix(kind)?.strip_prefix('=').filter(|name| !name.is_empty())?;
            Some((kind, name.to_owned()))
        });
        let expected = || format!("expected `tag=…`, `branch=…` or `rev=…` after `?`, not `{reference}`");
        Ok(RuntimeChoice::Git { url: url.to_owned(), reference: Some(known.ok_or_else(expected)?) })
    }
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Settings {
    runtime: Option<Table>,
    templates: Option<PathBuf>,
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
    options: &EnvironmentOptions,
) -> Result<Environment, Vec<Error>> {
    let runtime = options.runtime.as_ref();
    let home = home(source);
    let out_folder = settled(out).map_err(|error| vec![error])?;
    let runner_folder = out_folder.join("runner");
    let mut errors = Vec::new();
    let settings = settings(&home.join(SETTINGS)).unwrap_or_else(|error| {
        errors.push(error);
        Settings::default()
    });
    let mut dependencies = BTreeMap::new();
    let mut lock = None;
    let mut target = None;
    match runtime_dependency(&runner_folder, home, runtime, settings.runtime.as_ref()) {
        Ok((value, folder)) => {
            dependencies.insert(RUNTIME.to_owned(), value);
            target = folder.as_deref().and_then(|folder| checkout_target(&out_folder, folder));
            lock = first_lock(out).or_else(|| folder.and_then(|folder| workspace_lock(&folder)));
        }
        Err(error) => errors.push(error),
    }
    for (name, value) in &settings.dependencies {
        if name.replace('_', "-") == RUNTIME {
            let problem = format!("`{name}` does not belong in [dependencies]: choose it in [runtime]");
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
    let templates_folder = options.templates.clone().or_else(|| settings.templates.map(|folder| home.join(folder)));
    let templates =
        templates_folder.as_deref().map_or_else(|| Ok(Templates::default()), templates).unwrap_or_else(|found| {
            errors.extend(found);
            Templates::default()
        });
    let mut vendored = BTreeMap::new();
    if options.vendor && errors.is_empty() {
        match vendor::vendor(&runner_folder, &mut dependencies) {
            Ok(files) => vendored = files,
            Err(found) => errors.extend(found),
        }
    }
    let mut hooks = HooksFolder::Shared;
    if options.self_contained || options.vendor {
        // A runner that is generated elsewhere takes along what is filled in beside the space.
        let beside = [out.to_owned(), home.join(RUNNERS)].map(|runners| runners.join("hooks"));
        match shared_hooks(beside.iter().find(|folder| folder.is_dir())) {
            Ok(shared) => hooks = HooksFolder::Own { shared },
            Err(error) => errors.push(error),
        }
    }
    if !errors.is_empty() {
        return Err(errors);
    }
    let mut said = BTreeMap::new();
    if let Some(choice) = runtime {
        let text = match choice {
            RuntimeChoice::Folder(folder) => {
                format!("path:{}", relative(&runner_folder, folder).map_err(|error| vec![error])?)
            }
            RuntimeChoice::Version(version) => version.clone(),
            RuntimeChoice::Git { url, reference: None } => format!("git:{url}"),
            RuntimeChoice::Git { url, reference: Some((kind, name)) } => format!("git:{url}?{kind}={name}"),
        };
        said.insert("runtime".to_owned(), text);
    }
    if let Some(folder) = &options.templates {
        said.insert("templates".to_owned(), relative(&runner_folder, folder).map_err(|error| vec![error])?);
    }
    let system = plans.first().map_or_else(|| home.to_owned(), |first| home.join(first.system_folder()));
    let space_folder = relative(&runner_folder, home).map_err(|error| vec![error])?;
    let simulator_folder = relative(&runner_folder, &system).map_err(|error| vec![error])?;
    Ok(Environment {
        dependencies,
        lock,
        target,
        options: said,
        space_folder,
        simulator_folder,
        hooks,
        vendored,
        templates,
    })
}

/// Whether the user chose the runtime of a space's runners, on the command line or in `sesame.toml`.
pub fn runtime_is_chosen(source: &Path, options: &EnvironmentOptions) -> Result<bool, Error> {
    Ok(options.runtime.is_some() || settings(&home(source).join(SETTINGS))?.runtime.is_some())
}

/// Whether a simulator that is a program is where a runner without a crate would look for it.
pub fn check_program(source: &Path, plan: &RunnerPlan) -> Result<(), Error> {
    let space = settled(home(source))?;
    simulator_dependency(&space, &space, plan, &BTreeMap::new()).map(drop)
}

/// The folders of the space and of its simulator.
pub fn folders(source: &Path, plan: &RunnerPlan) -> Result<(PathBuf, PathBuf), Error> {
    let space = settled(home(source))?;
    let simulator = space.join(plan.system_folder());
    Ok((space, simulator))
}

/// The folder of a `.sesame` file.
fn home(source: &Path) -> &Path {
    let parent = source.parent().unwrap_or(Path::new("."));
    if parent == Path::new("") { Path::new(".") } else { parent }
}

/// The runtime as a dependency of a crate in `folder`, which need not exist yet.
pub(crate) fn runtime_for(folder: &Path, runtime: Option<&RuntimeChoice>) -> Result<Value, Error> {
    runtime_dependency(&settled(folder)?, Path::new("."), runtime, None).map(|(value, _)| value)
}

/// The templates for what is generated of a space: as the command line or `sesame.toml` says, else those of this
/// project.
pub fn chosen_templates(source: &Path, options: &EnvironmentOptions) -> Result<Templates, Vec<Error>> {
    let home = home(source);
    let settings = settings(&home.join(SETTINGS)).map_err(|error| vec![error])?;
    let folder = options.templates.clone().or_else(|| settings.templates.map(|folder| home.join(folder)));
    folder.as_deref().map_or_else(|| Ok(Templates::default()), templates)
}

/// The user's templates in a folder: every file in it and below takes the place of the template of its path.
pub fn templates(folder: &Path) -> Result<Templates, Vec<Error>> {
    let read = |path: &String| {
        let path = folder.join(path);
        input::text(&path).map_err(|cause| Error::Read { path, cause })
    };
    let mut errors = Vec::new();
    let mut replaced = BTreeMap::new();
    for path in files_below(folder).map_err(|error| vec![error])? {
        match read(&path) {
            Ok(text) => drop(replaced.insert(path, text)),
            Err(error) => errors.push(error),
        }
    }
    let wrong = |problem| Error::Templates { folder: folder.to_owned(), problem };
    let templates = Templates::replacing(replaced).unwrap_or_else(|problems| {
        errors.extend(problems.into_iter().map(wrong));
        Templates::default()
    });
    if errors.is_empty() { Ok(templates) } else { Err(errors) }
}

/// The Rust files in the folder of hooks that runners share, by path.
fn shared_hooks(folder: Option<&PathBuf>) -> Result<BTreeMap<String, String>, Error> {
    let Some(folder) = folder else { return Ok(BTreeMap::new()) };
    let files = files_below(folder)?
        .into_iter()
        .filter(|path| Path::new(path).extension().is_some_and(|extension| extension == "rs"));
    files
        .map(|path| match input::text(&folder.join(&path)) {
            Ok(text) => Ok((path, text)),
            Err(cause) => Err(Error::Read { path: folder.join(path), cause }),
        })
        .collect()
}

/// The files in a folder and below, sorted, as paths inside it with `/` between their parts. Leaves out what is hidden,
/// and folders that are links.
fn files_below(folder: &Path) -> Result<Vec<String>, Error> {
    let mut files = Vec::new();
    let mut folders = vec![String::new()];
    while let Some(inside) = folders.pop() {
        let here = folder.join(&inside);
        let failed = |cause: io::Error| Error::Read { path: here.clone(), cause: cause.into() };
        for entry in fs::read_dir(&here).map_err(failed)? {
            let entry = entry.map_err(failed)?;
            let name = entry.file_name();
            let Some(name) = name.to_str() else { return Err(Error::NotText { path: entry.path() }) };
            if name.starts_with('.') {
                continue;
            }
            let path = if inside.is_empty() { name.to_owned() } else { format!("{inside}/{name}") };
            let kind = entry.file_type().map_err(failed)?;
            if kind.is_dir() {
                folders.push(path);
            } else if kind.is_file() || entry.path().is_file() {
                files.push(path);
            }
        }
    }
    files.sort();
    Ok(files)
}

fn settings(path: &Path) -> Result<Settings, Error> {
    match input::text(path) {
        Ok(text) => toml::from_str(&text).map_err(|error| Error::Settings {
            path: path.to_owned(),
            problem: error.to_string().trim_end().to_owned(),
        }),
        Err(Unreadable::Missing) => Ok(Settings::default()),
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
        (Some(RuntimeChoice::Git { url, reference }), _) => {
            let mut table = Table::from_iter([("git".to_owned(), Value::from(url.as_str()))]);
            table.extend(reference.iter().map(|(kind, name)| ((*kind).to_owned(), Value::from(name.as_str()))));
            return Ok((Value::Table(table), None));
        }
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
    if let Some((program, _)) = plan.plan.simulator.program() {
        let file = system.join(program);
        if program.contains('/') && !file.is_file() {
            let (source_file, program) = (plan.plan.source.clone(), program.to_owned());
            return Err(Error::NoProgram { source_file, program, file });
        }
    }
    let Some(path) = simulator_path(&plan.plan.simulator) else { return Ok(None) };
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
    let text = input::text(manifest).map_err(|cause| Error::Read { path: manifest.to_owned(), cause })?;
    let table: Table = toml::from_str(&text).map_err(|error| failed(error.to_string()))?;
    let name = table.get("package").and_then(|package| package.get("name")).and_then(Value::as_str);
    name.map(str::to_owned).ok_or_else(|| failed("it has no package name".to_owned()))
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
    locks.iter().find_map(|lock| input::text(lock).ok())
}

/// The lock file of the workspace that the runtime is of: its versions are those that were tested together, and cargo
/// leaves out what a runner does not use.
fn workspace_lock(runtime: &Path) -> Option<String> {
    runtime.ancestors().take(3).find_map(|folder| input::text(&folder.join("Cargo.lock")).ok())
}

/// The target folder of the checkout that the runtime is of, as seen from a runners' folder in this checkout: SQLite,
/// and more of what `sesamec` was made of, need not be compiled again. Runners elsewhere have one of their own.
fn checkout_target(out: &Path, runtime: &Path) -> Option<String> {
    let root =
        settled(runtime).ok()?.ancestors().take(3).find(|folder| folder.join("Cargo.lock").is_file())?.to_owned();
    if !out.starts_with(&root) {
        return None;
    }
    relative(out, &root.join("target")).ok()
}

/// An absolute path without links and `..`; its last parts need not exist.
fn settled(path: &Path) -> Result<PathBuf, Error> {
    let absolute =
        std::path::absolute(path).map_err(|cause| Error::Read { path: path.to_owned(), cause: cause.into() })?;
    let existing = absolute.ancestors().find(|ancestor| ancestor.exists()).unwrap_or(Path::new("/"));
    let mut settled =
        existing.canonicalize().map_err(|cause| Error::Read { path: existing.to_owned(), cause: cause.into() })?;
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
