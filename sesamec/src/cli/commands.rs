//! What each subcommand does.

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context as _, anyhow, bail};
use sesame_codegen::emit::Templates;
use sesame_codegen::environment::{self, EnvironmentOptions, RuntimeChoice, environment};
use sesame_codegen::files::{Owner, Tree};
use sesame_codegen::input;
use sesame_codegen::output::{self, Change, Mode, Orphan, Report};
use sesame_codegen::plan::{OperationPlan, RunnerPlan};
use sesame_codegen::{emit, names, project, stubs};
use sesame_dsl::diagnostic::visible_lines;

use super::arguments::{Deny, ExplainFormat, Generation, Purpose};
use super::owner;
use super::shell::{self, Format, Shell};
use crate::frontend::{Checked, Language};

/// `sesamec new`
pub(super) fn new(
    shell: Shell,
    folder: &Path,
    simulator: project::Simulator,
    runtime: Option<&RuntimeChoice>,
    templates: Option<&Path>,
) -> anyhow::Result<ExitCode> {
    let templates = templates.map_or_else(|| Ok(Templates::default()), environment::templates);
    let templates = templates.map_err(|errors| all(&errors))?;
    output::create(folder, &project::files(folder, simulator, runtime, &templates)?)?;
    let name = folder.file_name().unwrap_or_default().display();
    let space = folder.join(format!("{name}.sesame"));
    let hook = folder.join(project::HOOK_FILE);
    let (hook, line) = (hook.display(), project::HOOK_LINE);
    let [generate, run] = ["generate", "run"].map(|command| shell::command_for(command, &space));
    match simulator {
        project::Simulator::Rust => {
            shell.did("Created", format!("{}: a space, a simulator of its own, and a README", folder.display()));
            shell.text(&format!(
                "\nNext steps to a first front:\n\
                 \n  1. generate the runner and a stub for its metric\n\
                 \n         {generate}\n\
                 \n  2. fill in the stub: in {hook}, replace the body of `on_clearance` with\n\
                 \n         {line}\n\
                 \n  3. run the campaign\n\
                 \n         {run}\n"
            ));
        }
        project::Simulator::Python => {
            shell.did("Created", format!("{}: a space, a simulator in Python, and a README", folder.display()));
            shell.text(&format!("\nTo a first front:\n\n    {run}\n"));
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// `sesamec check`
pub(super) fn check_only(
    shell: Shell,
    language: &Language,
    file: &Path,
    deny: Option<Deny>,
    format: Format,
) -> anyhow::Result<ExitCode> {
    let checked = check(shell, language, file, format)?;
    match (deny, checked.warnings) {
        (None, _) | (Some(Deny::Warnings), 0) => Ok(ExitCode::SUCCESS),
        (Some(Deny::Warnings), 1) => bail!("{} has a warning, and `--deny warnings` is set", file.display()),
        (Some(Deny::Warnings), n) => bail!("{} has {n} warnings, and `--deny warnings` is set", file.display()),
    }
}

/// Reads and checks a space, and says what is wrong with it.
pub(super) fn check(shell: Shell, language: &Language, file: &Path, format: Format) -> anyhow::Result<Checked> {
    let text = input::text(file).with_context(|| format!("cannot read {}", file.display()))?;
    let checked = check_text(shell, language, file, &text, format)?;
    for undecided in &checked.undecided {
        shell.note(undecided);
    }
    shell.did("Checked", format!("{}: {}", file.display(), checked.summary));
    Ok(checked)
}

/// Checks the text of a space that is, or will be, in a file, and says what is wrong with it.
pub(super) fn check_text(
    shell: Shell,
    language: &Language,
    file: &Path,
    text: &str,
    format: Format,
) -> anyhow::Result<Checked> {
    let checked = (language.check)(&file.display().to_string(), text, shell.look(format));
    shell.diagnostics(&checked.diagnostics, format)?;
    if checked.errors > 0 {
        return Err(has_errors(file, checked.errors));
    }
    Ok(checked)
}

/// That a file has errors, which were shown.
pub(super) fn has_errors(file: &Path, errors: usize) -> anyhow::Error {
    let (file, sesamec) = (file.display(), shell::command());
    match errors {
        1 => anyhow!("{file} has an error; `{sesamec} explain CODE` explains its code"),
        n => anyhow!("{file} has {n} errors; `{sesamec} explain CODE` explains a code"),
    }
}

/// `sesamec generate`
pub(super) fn generate(
    shell: Shell,
    language: &Language,
    generation: &Generation,
    options: &EnvironmentOptions,
    purpose: Purpose,
) -> anyhow::Result<ExitCode> {
    let checked = check(shell, language, &generation.file, generation.diagnostics.format)?;
    let chosen = match &generation.campaign {
        Some(name) => vec![choose(&checked, &generation.file, Some(name))?],
        None if checked.plans.is_empty() => bail!("{} has no campaign to generate for", generation.file.display()),
        None => (0..checked.plans.len()).collect(),
    };
    let mode = mode(purpose, generation);
    let (out, report) = write(shell, generation, options, &checked, &chosen, mode)?;
    conclude(shell, &out, &report, purpose, &shell::command_for("generate", &generation.file))
}

/// How trees are applied.
pub(super) fn mode(purpose: Purpose, generation: &Generation) -> Mode {
    match (purpose, generation.force) {
        (Purpose::Check, _) | (Purpose::DryRun, false) => Mode::Check,
        (Purpose::DryRun, true) => Mode::CheckForce,
        (Purpose::Write, true) => Mode::Force,
        (Purpose::Write, false) => Mode::Write,
    }
}

/// Shows what was asked for of a generation, and fails if files were to be up to date and are not.
pub(super) fn conclude(
    shell: Shell,
    out: &Path,
    report: &Report,
    purpose: Purpose,
    remedy: &str,
) -> anyhow::Result<ExitCode> {
    if purpose == Purpose::DryRun {
        shell::asked_for(&visible_lines(&preview(out, report)))?;
    }
    if purpose == Purpose::Check && report.out_of_date() {
        let files = report.files.iter().filter(|file| file.owner != Owner::Seed);
        for file in files.filter(|file| !matches!(file.change, Change::Unchanged | Change::Kept)) {
            let what = match file.change {
                Change::Created => "is missing",
                Change::Removed => "is no longer generated",
                _ => "is out of date",
            };
            shell.text(&visible_lines(&format!("{} {what}", out.join(&file.path).display())));
        }
        bail!("out of date: run `{remedy}`");
    }
    Ok(ExitCode::SUCCESS)
}

/// What a generation would do: a line for each file that it would touch, and how it would change.
fn preview(out: &Path, report: &Report) -> String {
    let mut text = String::new();
    for file in &report.files {
        let what = match file.change {
            Change::Created => "would create",
            Change::Updated => "would update",
            Change::Removed => "would remove",
            Change::Unchanged | Change::Kept => continue,
        };
        text = format!("{text}{what} {}\n", out.join(&file.path).display());
        if let Some(diff) = &file.diff {
            text.push_str(diff);
        }
    }
    text
}

/// `sesamec explain CODE`
pub(super) fn explain_code(language: &Language, code: &str) -> anyhow::Result<ExitCode> {
    if let Some(page) = (language.explain)(code) {
        shell::asked_for(&format!("{}\n", page.trim_end()))?;
        return Ok(ExitCode::SUCCESS);
    }
    let shown = code.escape_debug();
    let digits = code.strip_prefix(['E', 'e', 'W', 'w']).unwrap_or_default();
    if !digits.is_empty() && digits.chars().all(|c| c.is_ascii_digit()) {
        bail!("there is no diagnostic `{shown}`; codes look like E0203");
    }
    bail!(
        "`{shown}` is not a code like E0203; to explain a name of a space, add its file: `{} explain {shown} FILE`",
        shell::command()
    )
}

/// `sesamec explain`
pub(super) fn explainable(language: &Language) -> anyhow::Result<ExitCode> {
    let sesamec = shell::command();
    let codes: Vec<String> =
        (language.codes)().iter().map(|(code, meaning)| format!("  {code}  {meaning}\n")).collect();
    shell::asked_for(&format!(
        "`{sesamec} explain FILE` lists what a space declares\n\
         `{sesamec} explain NAME FILE` explains what a space declares: a topic, metric, operation, campaign, …\n\
         `{sesamec} explain wiring FILE` shows how the nodes of a ROS 2 system are remapped\n\
         `{sesamec} explain CODE` explains a diagnostic:\n{}",
        codes.concat()
    ))?;
    Ok(ExitCode::SUCCESS)
}

/// `sesamec explain NAME FILE`
pub(super) fn explain_name(
    shell: Shell,
    language: &Language,
    name: &str,
    file: &Path,
    format: ExplainFormat,
) -> anyhow::Result<ExitCode> {
    let text = input::text(file).with_context(|| format!("cannot read {}", file.display()))?;
    let found = match (language.find)(&file.display().to_string(), &text, name) {
        Ok(found) => found,
        // A name of the space comes first.
        Err(_) if name == "wiring" => return explain_wiring(shell, language, file, &text),
        Err(why) => bail!(why),
    };
    if format == ExplainFormat::Human && found.campaign {
        let checked = check_text(shell, language, file, &text, Format::Human)?;
        let plan = &checked.plans[choose(&checked, file, Some(name))?].plan;
        let mut text = format!("{}\n{}", crate::explain::campaign(plan), super::search_space::described(plan));
        if !found.uses.is_empty() {
            // All else is text of the language as well.
            text.push('\n');
            text.extend(found.uses.lines().map(|line| format!("// {line}\n")));
        }
        shell::asked_for(&visible_lines(&text))?;
        return Ok(ExitCode::SUCCESS);
    }
    unread(shell, file, found.errors, "uses");
    match format {
        ExplainFormat::Human => shell::asked_for(&visible_lines(&found.text))?,
        ExplainFormat::Json => shell::asked_for(&found.json)?,
    }
    Ok(ExitCode::SUCCESS)
}

/// `sesamec explain FILE`
pub(super) fn explain_file(
    shell: Shell,
    language: &Language,
    file: &Path,
    format: ExplainFormat,
) -> anyhow::Result<ExitCode> {
    let text = input::text(file).with_context(|| format!("cannot read {}", file.display()))?;
    let found = (language.declarations)(&file.display().to_string(), &text);
    unread(shell, file, found.errors, "declarations");
    match format {
        ExplainFormat::Human => shell::asked_for(&visible_lines(&found.text))?,
        ExplainFormat::Json => shell::asked_for(&found.json)?,
    }
    Ok(ExitCode::SUCCESS)
}

/// Says that a space has errors, so that something is missing.
fn unread(shell: Shell, file: &Path, errors: usize, what: &str) {
    if errors > 0 {
        let has = if errors == 1 { "an error".to_owned() } else { format!("{errors} errors") };
        shell.warning(format!(
            "{} has {has}: {what} that could not be read are missing; see `{}`",
            file.display(),
            shell::command_for("check", file)
        ));
    }
}

/// `sesamec explain wiring FILE`
fn explain_wiring(shell: Shell, language: &Language, file: &Path, text: &str) -> anyhow::Result<ExitCode> {
    let checked = check_text(shell, language, file, text, Format::Human)?;
    // All campaigns of a space need the same remappings.
    let Some(runner) = checked.plans.first() else { bail!("{} has no campaign", file.display()) };
    shell::asked_for(&visible_lines(&sesame_codegen::wiring::text(&runner.plan)))?;
    Ok(ExitCode::SUCCESS)
}

/// The campaign of a name, or the only one.
pub(super) fn choose(checked: &Checked, file: &Path, name: Option<&str>) -> anyhow::Result<usize> {
    let campaigns: Vec<&str> = checked.plans.iter().map(|runner| runner.plan.campaign.name.as_str()).collect();
    let file = file.display();
    let Some(name) = name else {
        return match campaigns[..] {
            [_] => Ok(0),
            [] => bail!("{file} has no campaign to run"),
            _ => bail!("{file} has several campaigns: choose one with `--campaign`: {}", campaigns.join(", ")),
        };
    };
    if let Some(at) = campaigns.iter().position(|&campaign| campaign == name) {
        return Ok(at);
    }
    let near = campaigns.iter().map(|&campaign| (strsim::damerau_levenshtein(campaign, name), campaign)).min();
    match near {
        Some((distance, campaign)) if distance <= name.len().max(3) / 3 => {
            bail!("{file} has no campaign `{name}`; did you mean `{campaign}`?")
        }
        _ => bail!("{file} has no campaign `{name}`; its campaigns are {}", campaigns.join(", ")),
    }
}

/// Generates some of a space's campaigns, and says so.
pub(super) fn write(
    shell: Shell,
    generation: &Generation,
    options: &EnvironmentOptions,
    checked: &Checked,
    chosen: &[usize],
    mode: Mode,
) -> anyhow::Result<(PathBuf, Report)> {
    let campaigns: Vec<&str> = chosen.iter().map(|&at| checked.plans[at].plan.campaign.name.as_str()).collect();
    let out = generation.own_runners(&campaigns)?;
    for campaign in &campaigns {
        owner::check(&generation.file, &out.join(names::campaign_folder(campaign)))?;
    }
    let environment = environment(&generation.file, &out, &checked.plans, options).map_err(|errors| all(&errors))?;
    let trees = emit::emit(&checked.plans, &environment).map_err(|problems| all(&problems))?;
    let (shared, runners) = trees.split_first().expect("there is a tree for what runners share");
    let alone = options.self_contained || options.vendor;
    // A runner that can be moved elsewhere shares nothing.
    let shared = (!alone).then_some(shared);
    let trees: Vec<Tree> = shared.into_iter().chain(chosen.iter().map(|&at| &runners[at])).cloned().collect();
    let report = output::apply(&out, &trees, mode)?;
    let space = &checked.plans[chosen[0]];
    tell(shell, &out, &trees, &report, mode, space);
    if let Some((program, _)) = space.plan.simulator.program()
        && alone
    {
        let folder = &environment.simulator_folder;
        shell.warning(format!(
            "the simulator `{program}` is a program, which is not copied: a runner that is moved still starts it in \
             `{folder}`, relative to its own folder"
        ));
    }
    if alone && space.operations.iter().any(OperationPlan::is_offline) {
        let folder = &environment.space_folder;
        shell.warning(format!(
            "custom operations before the start and after the end work on files, which are not copied: a runner that \
             is moved still looks for them in `{folder}`, relative to its own folder"
        ));
    }
    for note in &checked.notes {
        shell.note(note);
    }
    Ok((out, report))
}

/// Several errors as one; the shell shows each on its own.
pub(super) fn all(errors: &[impl std::fmt::Display]) -> anyhow::Error {
    anyhow!(errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("\u{1e}"))
}

/// What is said of a new hook: a stub is to be filled in, a copy of one that is filled in is not.
fn created_hook(path: &Path, contents: &str) -> (&'static str, String) {
    if stubs::is_stub(contents) {
        ("Stub", format!("{}: fill this in", path.display()))
    } else {
        ("Copied", path.display().to_string())
    }
}

/// What these trees hold in a file of the output folder.
fn contents<'a>(trees: &'a [Tree], path: &str) -> Cow<'a, str> {
    let in_tree = |tree: &'a Tree| {
        let below = if tree.folder.is_empty() { Some(path) } else { path.strip_prefix(&format!("{}/", tree.folder)) };
        tree.files.get(below?)
    };
    trees.iter().find_map(in_tree).map_or_else(Cow::default, |file| file.text())
}

/// What was generated of a tree in a folder of its own; `more` goes behind it.
pub(super) fn tell_tree(shell: Shell, out: &Path, tree: &Tree, report: &Report, mode: Mode, more: &str) {
    let verb = if matches!(mode, Mode::Write | Mode::Force) { "Generated" } else { "Compared" };
    let prefix = format!("{}/", tree.folder);
    let files: Vec<_> = report.files.iter().filter(|file| file.path.starts_with(&prefix)).collect();
    let written = files.iter().filter(|file| matches!(file.change, Change::Created | Change::Updated)).count();
    let changed = match written {
        0 => ", unchanged".to_owned(),
        n if n == files.len() => String::new(),
        n => format!(", {n} written"),
    };
    shell.did(verb, format!("{}: {} files{changed}{more}", out.join(&tree.folder).display(), files.len()));
}

/// Hooks of the user's that may need a change.
pub(super) fn tell_changed_hooks(shell: Shell, out: &Path, report: &Report) {
    for hook in &report.changed_hooks {
        let mut lines = format!("the inputs of {} have changed; adapt {}:", hook.of, out.join(&hook.path).display());
        let changes = hook.gone.iter().map(|line| ('-', line)).chain(hook.new.iter().map(|line| ('+', line)));
        for (sign, line) in changes {
            lines = format!("{lines}\n           {sign} {line}");
        }
        shell.warning(lines);
    }
}

/// What was generated.
fn tell(shell: Shell, out: &Path, trees: &[Tree], report: &Report, mode: Mode, space: &RunnerPlan) {
    let created: Vec<_> =
        report.files.iter().filter(|file| file.owner == Owner::User && file.change == Change::Created).collect();
    let kept = report.files.iter().filter(|file| file.owner == Owner::User && file.change == Change::Kept).count();
    let writes = matches!(mode, Mode::Write | Mode::Force);
    for tree in trees.iter().filter(|tree| !tree.folder.is_empty()) {
        let hooks = match kept {
            0 => String::new(),
            1 => ", 1 hook kept".to_owned(),
            n => format!(", {n} hooks kept"),
        };
        tell_tree(shell, out, tree, report, mode, &hooks);
    }
    if writes {
        for hook in created {
            let (verb, what) = created_hook(&out.join(&hook.path), &contents(trees, &hook.path));
            shell.did(verb, what);
        }
    }
    tell_changed_hooks(shell, out, report);
    for orphan in &report.orphans {
        shell.warning(match orphan {
            Orphan::Hook { path, of } if declares(space, of) => {
                format!("{of} now uses a hook in another folder; {} is kept but not compiled", out.join(path).display())
            }
            Orphan::Hook { path, of } if of.is_empty() => {
                format!("{} is no longer part of the runner; it is kept but not compiled", out.join(path).display())
            }
            Orphan::Hook { path, of } => {
                format!("{of} no longer exists; its hook {} is kept but not compiled", out.join(path).display())
            }
            Orphan::Edited { path } => {
                format!("{} is no longer generated; it is kept because it was edited", out.join(path).display())
            }
            Orphan::Runner { folder } => format!(
                "the campaign of {} no longer exists; the folder is kept, with its results",
                out.join(folder).display()
            ),
        });
    }
}

/// Whether a space declares what a hook is of, for example ``metric `speed` ``.
fn declares(space: &RunnerPlan, of: &str) -> bool {
    let metrics = space.hooks.iter().map(|hook| format!("metric `{}`", hook.metric));
    let operations = space.operations.iter().map(|operation| format!("operation `{}`", operation.operation));
    metrics.chain(operations).any(|declared| declared == of)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_copy_of_a_hook_that_is_filled_in_is_not_called_a_stub() {
        let path = Path::new("find/src/hooks/close_calls.rs");
        let stub = "fn on_clearance(ctx: &mut Context) { ctx.unimplemented(); }";
        assert_eq!(created_hook(path, stub), ("Stub", format!("{}: fill this in", path.display())));
        let filled = "fn on_clearance(ctx: &mut Context) { ctx.add(1.0); }";
        assert_eq!(created_hook(path, filled), ("Copied", path.display().to_string()));
    }
}
