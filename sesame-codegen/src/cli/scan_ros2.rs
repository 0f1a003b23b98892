//! `sesamec scan ros2`: listens, looks types up, writes a space, and checks what it wrote.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Context as _, anyhow, bail};
use sesame_dsl::interfaces::{self, Folders, Interfaces as _};
use sesame_ros2::scan::{Facts, MOST_ENDPOINTS, Scanner};

use super::arguments::ExplainFormat;
use super::scan::Ros2;
use super::shell::{self, Shell};
use crate::frontend::Language;
use crate::interfaces::Files;
use crate::scan::{FILE, Origin, Types, checked_space};

/// How long nodes have to describe types.
const DESCRIBING: Duration = Duration::from_secs(5);

/// `sesamec scan ros2`
pub(super) fn scan(shell: Shell, language: &Language, arguments: &Ros2) -> anyhow::Result<ExitCode> {
    let written = folders(&arguments.types)?;
    let folders = Folders { written: &written, file: FILE };
    let files = Files::default();
    let (domain, seconds) = (domain(arguments.domain)?, arguments.seconds);
    let mut scanner = Scanner::join(domain, arguments.network)?;
    let reach = if arguments.network { "the network" } else { "this machine" };
    shell.doing("Listening", format!("to domain {domain} on {reach} for {seconds} s"));
    scanner.listen(Duration::from_secs_f64(seconds))?;
    let mut facts = scanner.facts();
    let mut types = Types::of_topics(&facts, &files, folders);
    let missing = types.missing();
    if !missing.is_empty() {
        let asked = if missing.len() == 1 { "a type".to_owned() } else { format!("{} types", missing.len()) };
        shell.doing("Asking", format!("nodes for the layout of {asked} that no folder has"));
        let described = scanner.describe(&facts, &missing, DESCRIBING)?;
        types.add_described(&described, &files, folders);
    }
    drop(scanner);
    tell(shell, &facts, arguments.network);
    let services: BTreeSet<String> = facts.services.iter().map(|service| service.ty.clone()).collect();
    let services = services.into_iter().filter(|ty| has_layouts(ty, &files, folders)).collect();
    let origin = Origin { folders: &written, services: &services };
    let text = checked_space(language, &facts, &mut types, origin).map_err(|why| anyhow!(why))?;
    match arguments.format {
        ExplainFormat::Human => shell::asked_for(&text)?,
        ExplainFormat::Json => {
            facts.types = types.facts();
            let json = serde_json::to_string(&facts).context("cannot write what was found as JSON")?;
            shell::asked_for(&format!("{json}\n"))?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// The domain that is named, or that of the environment.
fn domain(named: Option<u16>) -> anyhow::Result<u16> {
    let of_environment = || match std::env::var("ROS_DOMAIN_ID") {
        Ok(text) if !text.trim().is_empty() => {
            let domain = text.trim().parse().ok().filter(|domain| *domain <= 232);
            domain
                .with_context(|| format!("ROS_DOMAIN_ID is `{}`; expected a number from 0 to 232", text.escape_debug()))
        }
        _ => Ok(0),
    };
    named.map_or_else(of_environment, Ok)
}

/// Whether requests and replies of a type of services have layouts.
fn has_layouts(ty: &str, files: &Files, folders: Folders<'_>) -> bool {
    let is_type = interfaces::full_name(ty, "srv").as_deref() == Some(ty);
    let has_layout = |part: &str| {
        let part = format!("{ty}_{part}");
        interfaces::known(&part).is_some() || matches!(files.find(folders, &part), Ok(Some(_)))
    };
    is_type && ["Request", "Response"].into_iter().all(has_layout)
}

/// The folders with definitions, as they are written.
fn folders(named: &[PathBuf]) -> anyhow::Result<Vec<String>> {
    let folders = if named.is_empty() {
        let prefixes = std::env::var_os("AMENT_PREFIX_PATH").unwrap_or_default();
        let shares = std::env::split_paths(&prefixes).filter(|prefix| prefix.is_absolute());
        shares.map(|prefix| prefix.join("share")).filter(|share| share.is_dir()).collect()
    } else {
        named.to_vec()
    };
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
    Ok(written)
}

/// What was found, in a line.
fn tell(shell: Shell, facts: &Facts, network: bool) {
    if facts.cut {
        shell.warning(format!("there are more than {MOST_ENDPOINTS} publishers and subscribers; the rest is left out"));
    }
    if facts.nodes.is_empty() && facts.topics.is_empty() {
        let network = if network { "" } else { ", and nodes on other machines are heard with `--network` only" };
        shell.warning(format!(
            "nothing runs in domain {}; the domain of a node is its ROS_DOMAIN_ID{network}",
            facts.domain
        ));
    }
    shell.did(
        "Found",
        format!("{} nodes, {} topics, {} services", facts.nodes.len(), facts.topics.len(), facts.services.len()),
    );
}
