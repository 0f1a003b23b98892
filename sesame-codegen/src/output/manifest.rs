//! Manifests: what was generated, so that the next generation can tell its own files from edited ones.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::files::{Hook, Owner, Tree};

/// The version of the manifest's format.
const SCHEMA: u32 = 1;

/// A manifest.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Manifest {
    schema: u32,
    pub(super) generator: String,
    pub(super) source: String,
    pub(super) model: String,
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub(super) options: BTreeMap<String, String>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) runners: Vec<String>,
    pub(super) files: BTreeMap<String, Entry>,
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub(super) hooks: BTreeMap<String, Hook>,
}

/// A file of a manifest.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Entry {
    pub(super) owner: Owner,
    /// SHA-256 as generated; a user's file has none, it changes as the user likes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) hash: Option<String>,
}

impl Manifest {
    /// The manifest of a tree as generated.
    pub(super) fn of(tree: &Tree) -> Self {
        let files = tree.files.iter().filter(|(_, file)| file.owner != Owner::Seed).map(|(path, file)| {
            let hash = (file.owner == Owner::Machine).then(|| crate::emit::hash(&file.contents));
            (path.clone(), Entry { owner: file.owner, hash })
        });
        Manifest {
            schema: SCHEMA,
            generator: tree.generator.clone(),
            source: tree.source.clone(),
            model: tree.model.clone(),
            options: tree.options.clone(),
            runners: tree.runners.clone(),
            files: files.collect(),
            hooks: tree.hooks.clone(),
        }
    }

    /// Reads a manifest; the error says in words what is wrong with it.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        #[derive(Deserialize)]
        struct Version {
            schema: u32,
        }
        let Version { schema } = serde_json::from_str(text).map_err(|error| error.to_string())?;
        if schema != SCHEMA {
            return Err(format!("it has version {schema}, but this sesamec writes version {SCHEMA}"));
        }
        serde_json::from_str(text).map_err(|error| error.to_string())
    }

    /// Its text.
    pub(super) fn text(&self) -> String {
        serde_json::to_string_pretty(self).expect("a manifest is plain data") + "\n"
    }
}
