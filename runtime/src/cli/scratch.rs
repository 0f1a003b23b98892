//! Folders for workers whose tests are not recorded.

use std::fs::DirBuilder;
#[cfg(unix)]
use std::os::unix::fs::DirBuilderExt as _;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use crate::cli::failure::Failure;

/// A folder that goes when it is no longer needed.
pub(super) struct Scratch(PathBuf);

impl Scratch {
    /// A new one, among the system's temporary files.
    pub(super) fn new(what: &str) -> Result<Self, Failure> {
        let moment = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default().as_nanos();
        let folder = std::env::temp_dir().join(format!("sesame-{what}-{}-{moment:x}", std::process::id()));
        let mut builder = DirBuilder::new();
        // Others must not write in it: it names the program that the worker starts.
        #[cfg(unix)]
        builder.mode(0o700);
        builder
            .create(&folder)
            .map_err(|error| Failure(format!("cannot make a folder for the worker: {error}: {}", folder.display())))?;
        Ok(Scratch(folder))
    }

    pub(super) fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        // What cannot be removed is left to the system, which clears its temporary files.
        std::fs::remove_dir_all(&self.0).ok();
    }
}
