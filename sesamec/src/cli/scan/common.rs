//! What all scans end with: a line on what was found, and a space that passes its check.

use std::process::ExitCode;

use anyhow::{Context as _, anyhow};
use sesame_scan::Facts;

use crate::cli::arguments::ExplainFormat;
use crate::cli::shell::{self, Shell};
use crate::frontend::Language;
use crate::scan::{Origin, Types, checked_space};

/// Prints the space, or what was found.
pub(super) fn print(
    language: &Language,
    mut facts: Facts,
    mut types: Types,
    origin: Origin<'_>,
    format: ExplainFormat,
) -> anyhow::Result<ExitCode> {
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
        } else if nodes > 0 {
            format!("{nodes} nodes, {topics} topics")
        } else {
            format!("{topics} topics")
        },
    );
}
