//! `sesamec import`: a testing space of the original platform becomes a space and results.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context as _, anyhow, bail};
use sesame_codegen::output::FreshFolder;
use sesame_codegen::{input, output};
use sesame_legacy::{Imported, Kind, Recorded};

use super::commands;
use super::shell::{self, Format, Shell};
use crate::frontend::{Checked, Language};

/// Notes of one kind that are shown at most; files repeat themselves.
const MOST_NOTES: usize = 40;

/// `sesamec import`
pub(super) fn import(shell: Shell, language: &Language, file: &Path, out: &Path) -> anyhow::Result<ExitCode> {
    let opened = input::open(file).map_err(|error| anyhow!("{}: cannot be read: {error}", file.display()))?;
    let mut imported = Imported::read(file, opened)?;
    // The stem comes from outside, so it is not used as a path unchanged.
    let stem: String = file
        .file_stem()
        .unwrap_or_default()
        .to_string_lossy()
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' })
        .collect();
    let name = format!("{}.sesame", if stem.is_empty() { "space" } else { &stem });
    let space = out.join(&name);
    // Whatever is wrong is found before anything is written.
    let nothing = || format!("{} cannot be expressed in the language as it is, so nothing was written", file.display());
    let shown_as = space.display().to_string();
    let text = (language.format)(&shown_as, imported.text(), shell.look(Format::Human)).map_err(|found| {
        let written = shell.diagnostics(&found.diagnostics, Format::Human).err();
        written.unwrap_or_else(|| commands::has_errors(&space, found.errors).context(nothing()))
    })?;
    let checked = commands::check_text(shell, language, &space, &text, Format::Human).with_context(nothing)?;
    let folder = FreshFolder::begin(out)?;
    output::create(folder.path(), &BTreeMap::from([(name, text)]))?;
    let recorded = record(&mut imported, &checked, folder.path())?;
    folder.settle()?;
    shell.did("Imported", format!("{}: into {}", file.display(), space.display()));
    shell.did("Checked", format!("{}: {}", space.display(), checked.summary));
    for (campaign, Recorded { tests, sets }) in recorded {
        let folder = out.join(output::RESULTS).join(campaign);
        shell.did(
            "Recorded",
            format!("{}: {}, {}", folder.display(), counted(tests, "test"), counted(sets, "result set")),
        );
    }
    let mut shown: BTreeMap<Kind, usize> = BTreeMap::new();
    for (kind, text) in imported.notes.iter() {
        let count = shown.entry(kind).or_default();
        *count += 1;
        if *count <= MOST_NOTES {
            shell.did(kind.word(), text);
        }
    }
    for (kind, count) in shown {
        if count > MOST_NOTES {
            shell.did(kind.word(), format!("{} more", count - MOST_NOTES));
        }
    }
    let (sesamec, results) = (shell::command(), out.join(output::RESULTS));
    let look = if results.exists() {
        format!("\n  look at the results    {sesamec} results campaigns {}", results.display())
    } else {
        String::new()
    };
    shell.text(&format!(
        "\nNext:\n{look}\n  name your simulator    in {space}\n  generate the runners   {sesamec} generate {space}\n",
        space = space.display()
    ));
    Ok(ExitCode::SUCCESS)
}

/// Records the tests of every campaign that performed some: the name of the folder of each, and what is in it.
fn record(imported: &mut Imported, checked: &Checked, out: &Path) -> anyhow::Result<Vec<(String, Recorded)>> {
    let performed: Vec<(usize, String)> = imported.performed().map(|(at, name)| (at, name.to_owned())).collect();
    let mut all = Vec::new();
    for (at, campaign) in performed {
        let plan = checked.plans.iter().find(|runner| runner.plan.campaign.name == campaign);
        let Some(plan) = plan else { bail!("the space has no campaign `{campaign}`") };
        let name = sesame_codegen::names::campaign_folder(&campaign);
        let folder = out.join(output::RESULTS).join(&name);
        let recorded = imported
            .record(at, &plan.plan, &folder)
            .map_err(|error| anyhow!(error))
            .with_context(|| format!("cannot import the results of `{campaign}`, so nothing was written"))?;
        all.push((name, recorded));
    }
    Ok(all)
}

fn counted(n: usize, what: &str) -> String {
    if n == 1 { format!("1 {what}") } else { format!("{n} {what}s") }
}
