//! `sesamec import`: a testing space of the original platform becomes a space and results.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context as _, anyhow, bail};

use super::shell::{self, Shell};
use super::{Format, Language, commands};
use crate::import::{Imported, Kind};
use crate::output;

/// Notes of one kind that are shown at most; files repeat themselves.
const MOST_NOTES: usize = 40;

/// `sesamec import`
pub(super) fn import(shell: Shell, language: &Language, file: &Path, out: &Path) -> anyhow::Result<ExitCode> {
    let mut imported = Imported::read(file)?;
    // A stem as it is would be a path that anybody may have written.
    let stem: String = file
        .file_stem()
        .unwrap_or_default()
        .to_string_lossy()
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' })
        .collect();
    let name = format!("{}.sesame", if stem.is_empty() { "space" } else { &stem });
    output::create(out, &BTreeMap::from([(name.clone(), imported.text().to_owned())]))?;
    let space = out.join(&name);
    shell.did("Imported", format!("{}: into {}", file.display(), space.display()));
    let checked = commands::check(shell, language, &space, Format::Human).with_context(|| {
        format!("{} was written, but is not right yet; its results were not imported", space.display())
    })?;
    let performed: Vec<(usize, String)> = imported.performed().map(|(at, name)| (at, name.to_owned())).collect();
    for (at, campaign) in performed {
        let plan = checked.plans.iter().find(|runner| runner.plan.campaign.name == campaign);
        let Some(plan) = plan else { bail!("the space that was written has no campaign `{campaign}`") };
        let folder = out.join("results").join(crate::names::campaign_folder(&campaign));
        let recorded = imported
            .record(at, &plan.plan, &folder)
            .map_err(|error| anyhow!(error))
            .with_context(|| format!("cannot import the results of `{campaign}`"))?;
        shell.did(
            "Recorded",
            format!(
                "{}: {}, {}",
                folder.display(),
                counted(recorded.tests, "test"),
                counted(recorded.sets, "result set")
            ),
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
    let (sesamec, results) = (shell::command(), out.join("results"));
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

fn counted(n: usize, what: &str) -> String {
    if n == 1 { format!("1 {what}") } else { format!("{n} {what}s") }
}
