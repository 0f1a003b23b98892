//! `sesamec generate --python`: types of a space in Python, and stubs of its hooks.

use std::process::ExitCode;

use anyhow::bail;
use sesame_codegen::emit::{self, Python};
use sesame_codegen::environment::{EnvironmentOptions, chosen_templates};
use sesame_codegen::files::Owner;
use sesame_codegen::input;
use sesame_codegen::output::{self, Change, Mode};
use sesame_codegen::stubs::missing_in_python;

use super::arguments::{Generation, Purpose};
use super::commands::{all, check, conclude, mode, tell_changed_hooks};
use super::shell::{self, Shell};
use crate::frontend::Language;

pub(super) fn generate(
    shell: Shell,
    language: &Language,
    generation: &Generation,
    options: &EnvironmentOptions,
    purpose: Purpose,
) -> anyhow::Result<ExitCode> {
    let checked = check(shell, language, &generation.file, generation.diagnostics.format)?;
    let Some(space) = checked.plans.first() else {
        bail!("{} has no campaign to generate for", generation.file.display())
    };
    let templates = chosen_templates(&generation.file, options).map_err(|errors| all(&errors))?;
    let Python { tree, hooks, needed } =
        emit::python(&checked.plans, &generation.file, &templates).map_err(|problems| all(&problems))?;
    let beside = || generation.file.parent().unwrap_or(std::path::Path::new("")).to_owned();
    let out = generation.out.clone().unwrap_or_else(beside);
    let mode = mode(purpose, generation);
    let trees = [tree];
    let report = output::apply(&out, &trees, mode)?;
    let writes = matches!(mode, Mode::Write | Mode::Force);
    for file in report.files.iter().filter(|file| trees[0].files.contains_key(&file.path)) {
        let path = out.join(&file.path);
        match (file.owner, file.change) {
            (Owner::User, Change::Created) if writes => shell.did("Stub", format!("{}: fill this in", path.display())),
            (Owner::User, Change::Created) | (Owner::Seed, _) => {}
            (Owner::User, _) => shell.did("Kept", path.display().to_string()),
            (Owner::Machine, change) => {
                let unchanged = if change == Change::Unchanged { ", unchanged" } else { "" };
                shell.did(if writes { "Generated" } else { "Compared" }, format!("{}{unchanged}", path.display()));
            }
        }
    }
    tell_changed_hooks(shell, &out, &report);
    let file = out.join(&hooks);
    let missing = input::text(&file).map(|module| missing_in_python(&module, &needed)).unwrap_or_default();
    if !missing.is_empty() {
        let names: Vec<String> = missing.iter().map(|name| format!("`{name}`")).collect();
        let stubs = emit::python_stubs(space, &generation.file, &templates, &missing)?;
        let (_, stubs) = stubs.split_once("\n\n\n").unwrap_or(("", &stubs));
        shell.warning(format!("{} has no hook of {}; add:\n\n{stubs}", file.display(), names.join(", ")));
    }
    conclude(shell, &out, &report, purpose, &shell::command_for("generate --python", &generation.file))
}
