//! Generated files in memory, before anything is written.

use std::borrow::Cow;
use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Who may change a file once it exists.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Owner {
    /// The generator: rewritten whenever it would come out different; an edit by hand is refused.
    Machine,
    /// The user: created if absent and never touched again.
    User,
    /// Another program (cargo): created if absent so that it starts from the right place, then that program's. It may
    /// be absent without anything being out of date.
    Seed,
}

/// A file to be.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct File {
    /// Who may change it once it exists.
    pub owner: Owner,
    /// All of it.
    pub contents: Vec<u8>,
}

impl File {
    /// Its contents as text. What is not text, such as a vendored mesh, is shown as far as possible.
    pub fn text(&self) -> Cow<'_, str> {
        String::from_utf8_lossy(&self.contents)
    }
}

/// Where the manifest of a folder is that holds nothing but what is generated, and hooks.
pub(crate) const MANIFEST: &str = ".sesame/manifest.json";

/// A folder with one manifest: the output folder itself (what all runners share), or one runner's crate.
#[derive(Debug, Clone, PartialEq)]
pub struct Tree {
    /// Its name inside the output folder; empty for the output folder itself.
    pub folder: String,
    /// Where its manifest is, relative to the folder.
    pub manifest: String,
    /// Its files by path relative to the folder, `/` between the parts, no part `.` or `..`.
    pub files: BTreeMap<String, File>,
    /// The generator, for example `sesamec 0.1.0`.
    pub generator: String,
    /// File name of the `.sesame` file it comes from.
    pub source: String,
    /// Options that had a say in the contents, by name.
    pub options: BTreeMap<String, String>,
    /// SHA-256 of the plans it comes from, in hexadecimal.
    pub model: String,
    /// The user's hooks in it, by path.
    pub hooks: BTreeMap<String, Hook>,
    /// Names of the folders of all runners of the space, in order; empty for a runner.
    pub runners: Vec<String>,
}

/// What is remembered of a user's hook, to be able to say later what changed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Hook {
    /// What it is of, for example ``metric `speed` ``.
    pub of: String,
    /// What the hook is given: one line for each handler, and one for each field of the messages they take.
    pub inputs: Vec<String>,
}

impl Tree {
    /// Adds a file.
    pub(crate) fn add(&mut self, path: &str, owner: Owner, contents: impl Into<Vec<u8>>) {
        let before = self.files.insert(path.to_owned(), File { owner, contents: contents.into() });
        assert!(before.is_none(), "two generated files are called {path}");
    }
}
