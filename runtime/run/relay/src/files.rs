//! The files of a space, as operations before the start and after the end of a run see them.
//!
//! This crate reaches no file itself: the caller passes an implementation, which decides where files are and how they
//! are restored.

use std::fmt::Debug;
use std::path::Path;

/// The files of a space, some of which operations may change for one run.
///
/// Paths are relative to the folder of the `.sesame` file.
pub trait SpaceFiles: Debug {
    /// The folder of the `.sesame` file.
    fn folder(&self) -> &Path;

    /// The text of a file. It is an error if the file is not UTF-8, or not below the folder.
    fn read_text(&self, path: &Path) -> Result<String, SpaceFileError>;

    /// Replaces the contents of a file until [`restore`](SpaceFiles::restore) is called; a file that does not exist is
    /// created. Returns false if the file already had these contents.
    fn replace(&mut self, path: &Path, contents: &[u8]) -> Result<bool, SpaceFileError>;

    /// Restores all files that were replaced, and removes those that were created. If it is interrupted at any point,
    /// it can be called again.
    fn restore(&mut self) -> Result<(), SpaceFileError>;
}

/// Why a file cannot be read, changed or restored, in words for the user.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct SpaceFileError(pub String);

/// No files: for tests without operations that change files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoFiles;

impl NoFiles {
    fn refuse<T>(path: &Path) -> Result<T, SpaceFileError> {
        Err(SpaceFileError(format!("`{}` cannot be reached: this run has no files", path.display())))
    }
}

impl SpaceFiles for NoFiles {
    fn folder(&self) -> &Path {
        Path::new("")
    }

    fn read_text(&self, path: &Path) -> Result<String, SpaceFileError> {
        Self::refuse(path)
    }

    fn replace(&mut self, path: &Path, _: &[u8]) -> Result<bool, SpaceFileError> {
        Self::refuse(path)
    }

    fn restore(&mut self) -> Result<(), SpaceFileError> {
        Ok(())
    }
}
