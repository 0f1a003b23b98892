//! Files in memory → disk. The only module of this crate that writes.
//!
//! Nothing is written before everything has been looked at: if one machine file was edited by hand, nothing changes.
//! Files that would come out the same are not touched, others are written beside their place and renamed into it, and
//! a tree's manifest comes last. A user's file is never written twice and never deleted.
//!
//! Nothing outside the output folder is read, written or removed: no link in it is followed.

mod fresh_folder;
mod manifest;
mod place;

use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf};

use similar::TextDiff;

pub use self::fresh_folder::FreshFolder;
use self::manifest::{Entry, Manifest};
use self::place::{Found, OutputPath};
use crate::files::{MANIFEST, Owner, Tree};
use crate::input::Unreadable;

/// What to do about the difference between generated files and those on disk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// Only say what would be done by [`Mode::Write`].
    Check,
    /// Only say what would be done by [`Mode::Force`].
    CheckForce,
    /// Write, but refuse to overwrite what was edited by hand.
    Write,
    /// Write, and overwrite machine files that were edited by hand.
    Force,
}

impl Mode {
    fn forces(self) -> bool {
        matches!(self, Mode::Force | Mode::CheckForce)
    }
}

/// What became, or would become, of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Change {
    /// It was not there.
    Created,
    /// It was different.
    Updated,
    /// It is as it should be and was not touched.
    Unchanged,
    /// It is the user's (or cargo's) and there already.
    Kept,
    /// It is generated no longer, and was as generated.
    Removed,
}

/// A file and what became of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileReport {
    /// Its path relative to the output folder.
    pub path: String,
    /// Whose it is.
    pub owner: Owner,
    /// What became of it.
    pub change: Change,
    /// From what is there to what is generated, as a unified diff; only for text that is or would be updated.
    pub diff: Option<String>,
}

/// Something that is left in the output folder although the space has no use for it any more.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub enum Orphan {
    /// The hook of a metric or operation that is gone: its file, and what it was of.
    Hook {
        /// Path relative to the output folder.
        path: String,
        /// What it was of, for example ``metric `speed` ``.
        of: String,
    },
    /// A machine file that was edited by hand.
    Edited {
        /// Path relative to the output folder.
        path: String,
    },
    /// The runner of a campaign that is gone, with its results.
    Runner {
        /// Its folder inside the output folder.
        folder: String,
    },
}

/// A user's hook whose metric or operation is given something else than when the hook was last generated for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChangedHook {
    /// The hook's file, relative to the output folder.
    pub path: String,
    /// What it is of, for example ``metric `speed` ``.
    pub of: String,
    /// What it was given and is not any more.
    pub gone: Vec<String>,
    /// What it is given now and was not.
    pub new: Vec<String>,
}

/// What was done, or would be done.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Report {
    /// Every file, in the order of the trees and by path.
    pub files: Vec<FileReport>,
    /// What is left over.
    pub orphans: Vec<Orphan>,
    /// Hooks that may need a change.
    pub changed_hooks: Vec<ChangedHook>,
}

impl Report {
    /// How many files met this fate.
    pub fn count(&self, change: Change) -> usize {
        self.files.iter().filter(|file| file.change == change).count()
    }

    /// Whether the disk differs from what is generated.
    pub fn out_of_date(&self) -> bool {
        self.files.iter().any(|file| {
            file.owner != Owner::Seed && matches!(file.change, Change::Created | Change::Updated | Change::Removed)
        })
    }
}

/// A machine file that was edited by hand, or a foreign file in its place.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EditedFile {
    /// Its path relative to the output folder.
    pub path: String,
    /// From what is generated to what is there, as a unified diff.
    pub diff: String,
}

/// Why nothing, or not everything, was written.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Machine files were edited.
    #[error("{}", edited_files(files))]
    Edited {
        /// Which, and how.
        files: Vec<EditedFile>,
    },
    /// The output folder holds the runners of another `.sesame` file.
    #[error(
        "{} contains the runners of `{other}`, not of `{source_file}`: choose another folder with `-o`, or replace \
         them with `--force`",
        folder.display()
    )]
    OtherSpace {
        /// The output folder.
        folder: PathBuf,
        /// File name of the `.sesame` file whose runners are there.
        other: String,
        /// File name of the `.sesame` file that was to be generated.
        source_file: String,
    },
    /// The runner there carries more with it than this one would.
    #[error(
        "the runner in {} was generated with `--{option}`: pass `--{option}` again, choose another folder with `-o`, or \
         replace it with `--force`",
        folder.display()
    )]
    OtherOption {
        /// The runner's folder.
        folder: PathBuf,
        /// The option.
        option: &'static str,
    },
    /// A new project would be mixed with something else.
    #[error("{} already exists and is not empty: choose another name", folder.display())]
    NotEmpty {
        /// The folder.
        folder: PathBuf,
    },
    /// A manifest that cannot be read.
    #[error(
        "cannot use the manifest {} ({problem}): restore it, or delete it and generate with `--force`",
        path.display()
    )]
    Manifest {
        /// Where.
        path: PathBuf,
        /// What is wrong with it.
        problem: String,
    },
    /// A link where generated files have a folder, or where their manifest is.
    #[error(
        "{} is a link, and generated files are never written through links: remove the link, or pass the folder that \
         it leads to with `-o`",
        path.display()
    )]
    Link {
        /// The link.
        path: PathBuf,
    },
    /// Something else where a generated file or folder belongs.
    #[error("{} is in the way of {what} that is generated there: move it elsewhere", path.display())]
    InTheWay {
        /// What is there.
        path: PathBuf,
        /// What belongs there, with its article.
        what: &'static str,
    },
    /// A file there that cannot be read.
    #[error("cannot read {}: {cause}", path.display())]
    Unreadable {
        /// Which.
        path: PathBuf,
        /// Why.
        cause: Unreadable,
    },
    /// The file system refused.
    #[error("cannot {action} {}: {cause}", path.display())]
    Io {
        /// What was tried.
        action: &'static str,
        /// On what.
        path: PathBuf,
        /// What the system says.
        cause: io::Error,
    },
}

fn edited_files(files: &[EditedFile]) -> String {
    let mut text = "generated files were edited by hand, so nothing was written:\n".to_owned();
    for EditedFile { path, diff } in files {
        text = format!("{text}\n{path}\n{diff}");
    }
    text.push_str("\nmove your changes into the .sesame file, a hook or sesame.toml; `--force` overwrites these files");
    text
}

/// Brings an output folder up to date with its trees, or says what that would do.
pub fn apply(out: &Path, trees: &[Tree], mode: Mode) -> Result<Report, Error> {
    let mut report = Report::default();
    let mut edited = Vec::new();
    let mut steps = Vec::new();
    for tree in trees {
        survey(out, tree, mode, &mut report, &mut edited, &mut steps)?;
    }
    if !edited.is_empty() {
        return Err(Error::Edited { files: edited });
    }
    report.orphans.sort();
    if matches!(mode, Mode::Write | Mode::Force) {
        steps.iter().try_for_each(|step| step.take(out))?;
    }
    Ok(report)
}

/// Writes a new project into a folder that must be empty or not there yet.
pub fn create(folder: &Path, files: &std::collections::BTreeMap<String, String>) -> Result<(), Error> {
    is_empty_but_for(folder, "")?;
    files.iter().try_for_each(|(path, contents)| OutputPath { root: folder, below: path }.write(contents.as_bytes()))
}

/// Whether a folder is there, which then must hold nothing but, perhaps, something of this name.
fn is_empty_but_for(folder: &Path, name: &str) -> Result<bool, Error> {
    let failed = |cause| Error::Io { action: "look into", path: folder.to_owned(), cause };
    let entries = match fs::read_dir(folder) {
        Err(cause) if cause.kind() == io::ErrorKind::NotFound => return Ok(false),
        entries => entries.map_err(failed)?,
    };
    for entry in entries {
        if entry.map_err(failed)?.file_name() != name {
            return Err(Error::NotEmpty { folder: folder.to_owned() });
        }
    }
    Ok(true)
}

/// The folder for results in a project.
pub const RESULTS: &str = "results";

/// Gives a file that is there another text. Who may read and write it stays as it is, and a link stays a link.
pub fn replace(path: &Path, contents: &str) -> Result<(), Error> {
    let failed = |cause| Error::Io { action: "write", path: path.to_owned(), cause };
    let file = path.canonicalize().map_err(failed)?;
    let permissions = fs::metadata(&file).map_err(failed)?.permissions();
    place::put(&file, contents.as_bytes(), Some(permissions))
}

/// Something to be done in the output folder.
enum Step {
    Write { path: String, contents: Vec<u8> },
    Remove { path: String },
}

impl Step {
    fn take(&self, out: &Path) -> Result<(), Error> {
        match self {
            Step::Write { path, contents } => OutputPath { root: out, below: path }.write(contents),
            Step::Remove { path } => OutputPath { root: out, below: path }.remove(),
        }
    }
}

/// Compares a tree with the disk.
fn survey(
    out: &Path,
    tree: &Tree,
    mode: Mode,
    report: &mut Report,
    edited: &mut Vec<EditedFile>,
    steps: &mut Vec<Step>,
) -> Result<(), Error> {
    let root = if tree.folder.is_empty() { out.to_owned() } else { out.join(&tree.folder) };
    let shown = |path: &str| if tree.folder.is_empty() { path.to_owned() } else { format!("{}/{path}", tree.folder) };
    let manifest_path = root.join(&tree.manifest);
    let manifest_shown = shown(&tree.manifest);
    // What is not UTF-8 was not generated, and is not JSON either.
    let at_manifest = OutputPath { root: out, below: &manifest_shown };
    let old_text = at_manifest.read()?.map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
    let old = old_text
        .as_deref()
        .map(Manifest::parse)
        .transpose()
        .map_err(|problem| Error::Manifest { path: manifest_path.clone(), problem })?;
    if let Some(old) = &old
        && old.source != tree.source
        && !mode.forces()
    {
        return Err(Error::OtherSpace { folder: root, other: old.source.clone(), source_file: tree.source.clone() });
    }
    if let Some(old) = &old
        && let Some(option) = ["vendor", "self-contained"].into_iter().find(|&option| old.options.contains_key(option))
        && !["vendor", option].iter().any(|&option| tree.options.contains_key(option))
        && !mode.forces()
    {
        return Err(Error::OtherOption { folder: root, option });
    }
    let mut new = Manifest::of(tree);

    for (path, file) in &tree.files {
        let shown = shown(path);
        let at = OutputPath { root: out, below: &shown };
        let found = at.look()?;
        let mut changed = None;
        let change = match (file.owner, found) {
            (_, Found::Nothing) => Change::Created,
            // What a user put there is the user's, a link too.
            (Owner::User | Owner::Seed, Found::File | Found::Link) => Change::Kept,
            (_, Found::Other) => return Err(Error::InTheWay { path: at.path(), what: "a file" }),
            (Owner::Machine, Found::Link) => {
                if !mode.forces() {
                    let diff = "it is now a link, but generated files are not links\n".to_owned();
                    edited.push(EditedFile { path: shown.clone(), diff });
                }
                Change::Updated
            }
            (Owner::Machine, Found::File) => match at.read()? {
                None => Change::Created,
                Some(found) if found == file.contents => Change::Unchanged,
                Some(found) => {
                    let generated = old.as_ref().and_then(|old| old.files.get(path));
                    let generated = generated.and_then(|entry| entry.hash.as_ref());
                    if !mode.forces() && generated != Some(&crate::emit::hash(&found)) {
                        let diff = diff(("generated", &file.contents), ("found", &found)).unwrap_or_default();
                        edited.push(EditedFile { path: shown.clone(), diff });
                    }
                    changed = diff(("there", &found), ("generated", &file.contents));
                    Change::Updated
                }
            },
        };
        if matches!(change, Change::Created | Change::Updated) {
            steps.push(Step::Write { path: shown.clone(), contents: file.contents.clone() });
        }
        report.files.push(FileReport { path: shown, owner: file.owner, change, diff: changed });
    }

    if let Some(old) = &old {
        compare_hooks(old, &new, &shown, out, report)?;
        leftovers(old, &mut new, &shown, out, report, steps)?;
    }
    let text = new.text();
    let change = match &old_text {
        None => Change::Created,
        Some(old) if *old == text => Change::Unchanged,
        Some(_) => Change::Updated,
    };
    if change != Change::Unchanged {
        steps.push(Step::Write { path: manifest_shown.clone(), contents: text.into_bytes() });
    }
    report.files.push(FileReport { path: manifest_shown, owner: Owner::Machine, change, diff: None });
    Ok(())
}

/// Hooks on disk whose metric or operation is now given something else.
fn compare_hooks(
    old: &Manifest,
    new: &Manifest,
    shown: &dyn Fn(&str) -> String,
    out: &Path,
    report: &mut Report,
) -> Result<(), Error> {
    for (path, hook) in &new.hooks {
        let Some(before) = old.hooks.get(path) else { continue };
        let shown = shown(path);
        let at = OutputPath { root: out, below: &shown };
        if before.inputs == hook.inputs || at.look()? == Found::Nothing {
            continue;
        }
        let missing = |from: &[String], of: &[String]| of.iter().filter(|line| !from.contains(line)).cloned().collect();
        report.changed_hooks.push(ChangedHook {
            path: shown,
            of: hook.of.clone(),
            gone: missing(&hook.inputs, &before.inputs),
            new: missing(&before.inputs, &hook.inputs),
        });
    }
    Ok(())
}

/// What an earlier generation left and this one has no use for. What the user may want to keep stays in the manifest,
/// so that it is named each time until it is gone.
fn leftovers(
    old: &Manifest,
    new: &mut Manifest,
    shown: &dyn Fn(&str) -> String,
    out: &Path,
    report: &mut Report,
    steps: &mut Vec<Step>,
) -> Result<(), Error> {
    for (path, entry) in &old.files {
        if new.files.contains_key(path) || !is_inside(path) {
            continue;
        }
        let shown = shown(path);
        let generated = OutputPath { root: out, below: &shown };
        // A manifest may name anything. What is not a file in this folder was not generated, and does not matter here.
        if !matches!(generated.look(), Ok(Found::File)) {
            continue;
        }
        match (entry.owner, &entry.hash) {
            (Owner::Machine, Some(hash))
                if generated.read()?.is_some_and(|found| *hash == crate::emit::hash(&found)) =>
            {
                steps.push(Step::Remove { path: shown.clone() });
                let (owner, change) = (Owner::Machine, Change::Removed);
                report.files.push(FileReport { path: shown, owner, change, diff: None });
                continue;
            }
            (Owner::User, _) => {
                let hook = old.hooks.get(path);
                let of = hook.map(|hook| hook.of.clone()).unwrap_or_default();
                new.hooks.extend(hook.map(|hook| (path.clone(), hook.clone())));
                report.orphans.push(Orphan::Hook { path: shown, of });
            }
            _ => report.orphans.push(Orphan::Edited { path: shown }),
        }
        new.files.insert(path.clone(), Entry { owner: entry.owner, hash: entry.hash.clone() });
    }
    for folder in &old.runners {
        let gone = !new.runners.contains(folder);
        let manifest = format!("{folder}/{MANIFEST}");
        if gone && is_inside(folder) && matches!((OutputPath { root: out, below: &manifest }).look(), Ok(Found::File)) {
            report.orphans.push(Orphan::Runner { folder: folder.clone() });
            new.runners.push(folder.clone());
        }
    }
    Ok(())
}

/// Whether a relative path stays in its folder, on every system.
fn is_inside(path: &str) -> bool {
    !path.is_empty()
        && !path.contains(['\\', ':', '\0'])
        && Path::new(path).components().all(|part| matches!(part, Component::Normal(_)))
}

/// A unified diff; `None` if one of the two is not text.
fn diff((old_name, old): (&str, &[u8]), (new_name, new): (&str, &[u8])) -> Option<String> {
    let (old, new) = (std::str::from_utf8(old).ok()?, std::str::from_utf8(new).ok()?);
    Some(TextDiff::from_lines(old, new).unified_diff().header(old_name, new_name).context_radius(2).to_string())
}

/// How a text would change, as a unified diff.
pub fn text_diff(old: &str, new: &str) -> String {
    diff(("there", old.as_bytes()), ("formatted", new.as_bytes())).expect("both are text")
}
