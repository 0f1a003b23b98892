//! Folders with the definitions of messages, services and actions of ROS.

use std::collections::BTreeSet;
use std::path::PathBuf;

use anyhow::bail;
use sesame_dsl::interfaces::{self, Folders, Interfaces as _};
use sesame_plan::{Dialect, action};
use sesame_scan::Facts;

use crate::interfaces::Files;
use crate::scan::FILE;

/// Definitions in folders.
pub(super) struct Definitions {
    /// The folders, as they are written in a space.
    pub(super) written: Vec<String>,
    pub(super) files: Files,
}

impl Definitions {
    /// In the folders that are named, or else in these.
    pub(super) fn new(named: &[PathBuf], others: impl Iterator<Item = PathBuf>) -> anyhow::Result<Self> {
        let folders: Vec<PathBuf> =
            if named.is_empty() { others.filter(|folder| folder.is_dir()).collect() } else { named.to_vec() };
        let mut written = Vec::new();
        for folder in folders {
            if !folder.is_dir() {
                bail!("{} is not a folder; `--types` names one with packages such as `std_msgs`", folder.display());
            }
            match folder.to_str() {
                Some(text) if !text.trim().is_empty() && !text.chars().any(char::is_control) => {
                    written.push(text.to_owned());
                }
                _ => bail!("{} has a name that cannot be written in a space", folder.display()),
            }
        }
        Ok(Definitions { written, files: Files::default() })
    }

    /// The folders, with files of this ROS.
    pub(super) fn folders(&self, dialect: Dialect) -> Folders<'_> {
        Folders { written: &self.written, file: FILE, dialect }
    }

    /// The types of services and actions that have layouts of all that they consist of.
    pub(super) fn services(&self, facts: &Facts) -> BTreeSet<String> {
        let folders = self.folders(facts.system.dialect());
        let has_layout =
            |part: &str| interfaces::known(part).is_some() || matches!(self.files.find(folders, part), Ok(Some(_)));
        let is_named = |ty: &str, kind| interfaces::full_name(ty, kind, folders.dialect).as_deref() == Some(ty);
        let services = facts.services.iter().filter_map(|service| service.ty.as_ref()).filter(|ty| {
            is_named(ty, "srv") && ["Request", "Response"].iter().all(|part| has_layout(&format!("{ty}_{part}")))
        });
        let actions =
            facts.actions.iter().map(|action| &action.ty).filter(|ty| {
                is_named(ty, "action") && action::PARTS.iter().all(|part| has_layout(&part.interface_of(ty)))
            });
        services.chain(actions).cloned().collect()
    }
}

/// The absolute paths in a variable of the environment.
pub(super) fn paths(variable: &str) -> impl Iterator<Item = PathBuf> {
    let paths = std::env::var_os(variable).unwrap_or_default();
    let paths: Vec<PathBuf> = std::env::split_paths(&paths).filter(|path| path.is_absolute()).collect();
    paths.into_iter()
}
