//! `sesamec generate --eddi`: a monitor as a program of its own.

use std::path::Path;
use std::process::ExitCode;

use anyhow::bail;
use sesame_codegen::environment::{EnvironmentOptions, environment};
use sesame_codegen::plan::MonitorPlan;
use sesame_codegen::{emit, names, output};

use super::arguments::{Generation, Purpose};
use super::commands::{all, check, conclude, mode, tell_tree};
use super::shell::{self, Shell};
use crate::frontend::{Checked, Language};

pub(super) fn generate(
    shell: Shell,
    language: &Language,
    eddi: &str,
    generation: &Generation,
    options: &EnvironmentOptions,
    purpose: Purpose,
) -> anyhow::Result<ExitCode> {
    let checked = check(shell, language, &generation.file, generation.diagnostics.format)?;
    let plan = choose(&checked, &generation.file, eddi)?;
    let folder = names::monitor_folder(eddi);
    let campaigns = checked.plans.iter().map(|runner| &runner.plan.campaign.name);
    if let Some(same) = campaigns.into_iter().find(|campaign| names::campaign_folder(campaign) == folder) {
        bail!("the runner of campaign `{same}` would be in the same folder, `{folder}`: rename one of them");
    }
    let out = generation.own_runners(&[])?;
    // A monitor needs neither the simulator nor hooks.
    let environment = environment(&generation.file, &out, &[], options).map_err(|errors| all(&errors))?;
    let tree = emit::monitor(plan, &environment).map_err(|problems| all(&problems))?;
    let mode = mode(purpose, generation);
    let trees = [tree];
    let report = output::apply(&out, &trees, mode)?;
    tell_tree(shell, &out, &trees[0], &report, mode, "");
    conclude(shell, &out, &report, purpose, &shell::command_for("generate", &generation.file))
}

/// The monitor of a name.
fn choose<'c>(checked: &'c Checked, file: &Path, name: &str) -> anyhow::Result<&'c MonitorPlan> {
    let file = file.display();
    if let Some((_, plan)) = checked.monitors.iter().find(|(of, _)| of == name) {
        return plan.as_ref().map_err(|refused| anyhow::anyhow!("{refused}"));
    }
    let names: Vec<&str> = checked.monitors.iter().map(|(name, _)| name.as_str()).collect();
    let near = names.iter().map(|&other| (strsim::damerau_levenshtein(other, name), other)).min();
    let shown = name.escape_debug();
    match near {
        None => bail!("{file} has no monitor `{shown}`, and no other: `eddi {shown} publishes … {{ … }}` declares one"),
        Some((distance, other)) if distance <= name.len().max(3) / 3 => {
            bail!("{file} has no monitor `{shown}`; did you mean `{other}`?")
        }
        Some(_) => bail!("{file} has no monitor `{shown}`; its monitors are {}", names.join(", ")),
    }
}
