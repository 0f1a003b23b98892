//! Arguments that several commands share.

use std::path::PathBuf;

use anyhow::bail;
use sesame_codegen::environment::{self, EnvironmentOptions, RuntimeChoice};
use sesame_codegen::names;

use super::owner;
use super::shell::Format;

/// Which diagnostics fail the command besides errors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Deny {
    /// Warnings.
    Warnings,
}

/// How diagnostics are shown.
#[derive(Debug, Clone, Copy, clap::Args)]
pub(super) struct Diagnostics {
    /// How errors and warnings of the space are shown: `human` and `short` on standard error, `json` and `github` on
    /// standard output.
    #[arg(long, value_enum, default_value_t = Format::Human)]
    pub(super) format: Format,
}

/// How a definition and its uses are shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
pub(super) enum ExplainFormat {
    /// Text.
    #[default]
    Human,
    /// One JSON object.
    Json,
}

/// What is generated, and where.
#[derive(Debug, clap::Args)]
pub(super) struct Generation {
    /// The `.sesame` file.
    pub(super) file: PathBuf,
    /// The campaign; if omitted, all of them for `generate`, and the only one for `run`.
    #[arg(long, short)]
    pub(super) campaign: Option<String>,
    /// The folder for the runners; if omitted, `runners` beside the file.
    #[arg(long, short = 'o', value_name = "FOLDER")]
    pub(super) out: Option<PathBuf>,
    /// Overwrite generated files that were edited by hand. Hooks are never overwritten.
    #[arg(long)]
    pub(super) force: bool,
    /// Where the runtime comes from: `path:FOLDER`, `git:URL`, `git:URL?tag=TAG` (or `branch=`, `rev=`), or a version.
    /// If omitted: [runtime] in sesame.toml, else the checkout that sesamec was built from, else the released version.
    #[arg(long, value_parser = RuntimeChoice::parse)]
    pub(super) runtime: Option<RuntimeChoice>,
    /// A folder with templates in place of sesamec's own, by their names; if omitted, `templates` in sesame.toml.
    #[arg(long, value_name = "FOLDER")]
    pub(super) templates: Option<PathBuf>,
    #[command(flatten)]
    pub(super) diagnostics: Diagnostics,
}

/// What `generate` does beside writing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Purpose {
    /// Writing.
    Write,
    /// Telling by the exit code whether anything would be written.
    Check,
    /// Showing what would be written.
    DryRun,
}

impl Generation {
    /// The folder of the runners of these campaigns. Two spaces in one folder may have campaigns of one name, as when a
    /// variant imports the other: the first one has `runners`, the other a folder in it that is called like its file.
    pub(super) fn runners(&self, campaigns: &[&str]) -> PathBuf {
        let shared = || self.file.with_file_name(environment::RUNNERS);
        self.out.clone().unwrap_or_else(|| {
            let own = self.file.file_name().map_or_else(shared, |name| shared().join(name));
            let folders = || campaigns.iter().map(|campaign| names::campaign_folder(campaign));
            let has_own = folders().any(|folder| own.join(folder).is_dir());
            let taken = || folders().any(|folder| owner::other_than(&self.file, &shared().join(folder)).is_some());
            if has_own || taken() { own } else { shared() }
        })
    }

    /// The folder of the runners of these campaigns, to be written in: unless the user names it, it must not lead
    /// elsewhere.
    pub(super) fn own_runners(&self, campaigns: &[&str]) -> anyhow::Result<PathBuf> {
        let runners = self.runners(campaigns);
        let default = [self.file.with_file_name(environment::RUNNERS), runners.clone()];
        if let Some(link) = default.iter().find(|path| self.out.is_none() && path.is_symlink()) {
            bail!("{} is a link; choose the folder for the runners with `-o`", link.display());
        }
        Ok(runners)
    }

    /// With the defaults of everything but the campaign and the place of its runner.
    pub(super) fn of(file: PathBuf, campaign: Option<String>, out: Option<PathBuf>) -> Self {
        let diagnostics = Diagnostics { format: Format::Human };
        Generation { file, campaign, out, force: false, runtime: None, templates: None, diagnostics }
    }

    pub(super) fn options(&self) -> EnvironmentOptions {
        EnvironmentOptions {
            runtime: self.runtime.clone(),
            templates: self.templates.clone(),
            ..EnvironmentOptions::default()
        }
    }
}
