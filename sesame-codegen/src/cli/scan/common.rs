//! What all scans do: they find folders of types, name secrets without reading them, and print a space that passes its
//! check.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context as _, anyhow, bail};
use sesame_dsl::interfaces::{self, Folders, Interfaces as _};
use sesame_notation::quoted;
use sesame_plan::{Dialect, Secret};
use sesame_scan::{Facts, System};

use crate::cli::arguments::ExplainFormat;
use crate::cli::shell::{self, Shell};
use crate::frontend::Language;
use crate::interfaces::Files;
use crate::scan::{FILE, Origin, Types, check_settings, checked_space};

/// Folders with definitions of types.
pub(super) struct Definitions {
    written: Vec<String>,
    pub(super) files: Files,
}

impl Definitions {
    /// In the folders that are named, or else in these.
    #[cfg(any(feature = "ros1", feature = "ros2", feature = "rosbridge"))]
    pub(super) fn new(named: &[PathBuf], others: impl Iterator<Item = PathBuf>) -> anyhow::Result<Self> {
        let folders: Vec<PathBuf> =
            if named.is_empty() { others.filter(|folder| folder.is_dir()).collect() } else { named.to_vec() };
        let mut written = Vec::new();
        for folder in folders {
            if !folder.is_dir() {
                bail!("{} is no folder; `--types` names one with packages such as `std_msgs`", folder.display());
            }
            match folder.to_str() {
                Some(text) if !text.trim().is_empty() && !text.chars().any(char::is_control) => {
                    written.push(text.to_owned());
                }
                _ => bail!("{} has a name that cannot be written in a space", folder.display()),
            }
        }
        Ok(Definitions { written, files: Files::default() })
    }

    /// None: the middleware has no types.
    #[cfg(any(feature = "mqtt", feature = "simlog"))]
    pub(super) fn none() -> Self {
        Definitions { written: Vec::new(), files: Files::default() }
    }

    /// As those of files of this ROS.
    pub(super) fn folders(&self, dialect: Dialect) -> Folders<'_> {
        Folders { written: &self.written, file: FILE, dialect }
    }

    /// The types of services that have layouts of requests and replies.
    fn services(&self, facts: &Facts) -> BTreeSet<String> {
        let dialect = facts.system.dialect();
        let types: BTreeSet<&String> = facts.services.iter().filter_map(|service| service.ty.as_ref()).collect();
        let has_layout = |part: &str| {
            interfaces::known(part).is_some() || matches!(self.files.find(self.folders(dialect), part), Ok(Some(_)))
        };
        let has_layouts = |ty: &str| {
            interfaces::full_name(ty, "srv").as_deref() == Some(ty)
                && ["Request", "Response"].into_iter().all(|part| has_layout(&format!("{ty}_{part}")))
        };
        types.into_iter().filter(|ty| has_layouts(ty)).cloned().collect()
    }
}

/// The folders `share` of what is installed for ROS 2.
#[cfg(any(feature = "ros2", feature = "rosbridge"))]
pub(super) fn shares() -> impl Iterator<Item = PathBuf> {
    paths("AMENT_PREFIX_PATH").into_iter().map(|prefix| prefix.join("share"))
}

/// The absolute paths in a variable of the environment.
#[cfg(any(feature = "ros1", feature = "ros2", feature = "rosbridge"))]
pub(super) fn paths(variable: &str) -> Vec<PathBuf> {
    let paths = std::env::var_os(variable).unwrap_or_default();
    std::env::split_paths(&paths).filter(|path| path.is_absolute()).collect()
}

/// Where a secret is, if it is anywhere.
#[cfg(any(feature = "mqtt", feature = "rosbridge"))]
pub(super) fn secret(variable: Option<&String>, file: Option<&String>) -> Option<Secret> {
    match (variable, file) {
        (Some(name), _) => Some(Secret::Environment { name: name.clone() }),
        (None, Some(path)) => Some(Secret::File { path: path.clone() }),
        (None, None) => None,
    }
}

/// The line of a simulator that says where a secret is.
#[cfg(any(feature = "mqtt", feature = "rosbridge"))]
pub(super) fn secret_line(word: &str, secret: &Secret) -> String {
    match secret {
        Secret::Environment { name } => format!("{word} from env {}", quoted(name)),
        Secret::File { path } => format!("{word} from file {}", quoted(path)),
    }
}

/// Refuses an address that no space could have, before anything is connected there.
#[cfg(any(feature = "mqtt", feature = "ros1", feature = "rosbridge", feature = "simlog"))]
pub(super) fn refuse_wrong_address(language: &Language, system: System, settings: &[String]) -> anyhow::Result<()> {
    check_settings(language, system, settings).map_err(|problem| anyhow!(problem))
}

/// Prints the space, or what was found.
pub(super) fn print(
    language: &Language,
    mut facts: Facts,
    mut types: Types,
    definitions: &Definitions,
    settings: &[String],
    format: ExplainFormat,
) -> anyhow::Result<ExitCode> {
    let services = definitions.services(&facts);
    let origin = Origin { folders: &definitions.written, services: &services, settings };
    let text = checked_space(language, &facts, &mut types, origin).map_err(|why| anyhow!(why))?;
    match format {
        ExplainFormat::Human => shell::asked_for(&text)?,
        ExplainFormat::Json => {
            facts.types = types.facts();
            let json = serde_json::to_string(&facts).context("cannot write what was found as JSON")?;
            shell::asked_for(&format!("{json}\n"))?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// What was found, in a line; `nothing` says what may be wrong if that is nothing at all.
pub(super) fn tell(shell: Shell, facts: &Facts, nothing: &str) {
    if facts.cut {
        shell.warning("there is more than a scan keeps; the rest is left out".to_owned());
    }
    if facts.nodes.is_empty() && facts.topics.is_empty() {
        shell.warning(nothing.to_owned());
    }
    let (nodes, topics, services) = (facts.nodes.len(), facts.topics.len(), facts.services.len());
    shell.did(
        "Found",
        if facts.system.is_ros() {
            format!("{nodes} nodes, {topics} topics, {services} services")
        } else {
            format!("{topics} topics")
        },
    );
}
