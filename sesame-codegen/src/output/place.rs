//! Places below a folder, looked at and written to without following any link.
//!
//! The folder itself is as the user named it, and may be a link. Below it every part of a path is looked at before it
//! is used, so that links in a folder cannot lead a generation elsewhere. A program that could exchange a folder for a
//! link between the look and the write could also change the code that is built and run next, so nothing more is done
//! about it.

use std::fs::{self, File, Permissions};
use std::io::{self, Write as _};
use std::path::{Component, Path, PathBuf};

use super::{Error, is_inside};
use crate::input::{self, MOST_OF_A_COPY, Unreadable};

/// What is at a place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Found {
    /// Nothing.
    Nothing,
    /// A regular file.
    File,
    /// A link, wherever it leads.
    Link,
    /// A folder, a pipe or a device.
    Other,
}

/// A path below a folder.
#[derive(Debug, Clone, Copy)]
pub(super) struct OutputPath<'a> {
    /// The folder.
    pub(super) root: &'a Path,
    /// The way from there, with `/` between its parts and without `..`.
    pub(super) below: &'a str,
}

impl OutputPath<'_> {
    /// As a path of the system.
    pub(super) fn path(self) -> PathBuf {
        self.root.join(self.below)
    }

    /// What is there. A link in the place of a folder on the way is refused.
    pub(super) fn look(self) -> Result<Found, Error> {
        assert!(is_inside(self.below), "a place is below its folder: {}", self.below);
        let mut here = self.root.to_owned();
        let mut parts = Path::new(self.below).components().peekable();
        while let Some(part) = parts.next() {
            here.push(part);
            let found = match fs::symlink_metadata(&here) {
                Ok(metadata) if metadata.is_symlink() => Found::Link,
                Ok(metadata) if metadata.is_file() => Found::File,
                Ok(metadata) if metadata.is_dir() && parts.peek().is_some() => continue,
                Ok(_) => Found::Other,
                Err(cause) if cause.kind() == io::ErrorKind::NotFound => return Ok(Found::Nothing),
                Err(cause) => return Err(Error::Io { action: "look at", path: here, cause }),
            };
            return match (parts.peek(), found) {
                (None, found) => Ok(found),
                (Some(_), Found::Link) => Err(Error::Link { path: here }),
                (Some(_), _) => Err(Error::InTheWay { path: here, what: "a folder" }),
            };
        }
        unreachable!("a path has a last part")
    }

    /// What the file there holds; `None` if nothing is there. Anything but a file is refused.
    pub(super) fn read(self) -> Result<Option<Vec<u8>>, Error> {
        match self.look()? {
            Found::Nothing => Ok(None),
            Found::File => match input::bytes(&self.path(), MOST_OF_A_COPY) {
                Ok(bytes) => Ok(Some(bytes)),
                Err(Unreadable::Missing) => Ok(None),
                Err(cause) => Err(Error::Unreadable { path: self.path(), cause }),
            },
            Found::Link => Err(Error::Link { path: self.path() }),
            Found::Other => Err(Error::InTheWay { path: self.path(), what: "a file" }),
        }
    }

    /// Writes the file, and makes the folders on the way: beside its place and then renamed into it, so that a reader
    /// sees the old file or the new one, never half of it. A link in its place is replaced, never followed.
    pub(super) fn write(self, contents: &[u8]) -> Result<(), Error> {
        if self.look()? == Found::Other {
            return Err(Error::InTheWay { path: self.path(), what: "a file" });
        }
        make_folder(self.root)?;
        let mut here = self.root.to_owned();
        let mut parts: Vec<Component<'_>> = Path::new(self.below).components().collect();
        parts.pop();
        for part in parts {
            here.push(part);
            match fs::create_dir(&here) {
                Err(cause) if cause.kind() == io::ErrorKind::AlreadyExists => {}
                made => made.map_err(|cause| Error::Io { action: "create the folder", path: here.clone(), cause })?,
            }
        }
        put(&self.path(), contents, None)
    }

    /// Removes the file there; a link is left alone.
    pub(super) fn remove(self) -> Result<(), Error> {
        if self.look()? != Found::File {
            return Ok(());
        }
        match fs::remove_file(self.path()) {
            Err(cause) if cause.kind() != io::ErrorKind::NotFound => {
                Err(Error::Io { action: "remove", path: self.path(), cause })
            }
            _ => Ok(()),
        }
    }
}

/// Makes a folder and those around it, as the user named it.
fn make_folder(folder: &Path) -> Result<(), Error> {
    fs::create_dir_all(folder).map_err(|cause| Error::Io {
        action: "create the folder",
        path: folder.to_owned(),
        cause,
    })
}

/// Writes a file beside a path, and renames it into the place.
pub(super) fn put(path: &Path, contents: &[u8], permissions: Option<Permissions>) -> Result<(), Error> {
    let (temporary, mut file) = beside(path)?;
    let written = file
        .write_all(contents)
        .and_then(|()| permissions.map_or(Ok(()), |permissions| file.set_permissions(permissions)))
        .and_then(|()| fs::rename(&temporary, path));
    written.map_err(|cause| {
        // The rest of it is useless; the first error is reported.
        drop(fs::remove_file(&temporary));
        Error::Io { action: "write", path: path.to_owned(), cause }
    })
}

/// A new file beside a path. Whatever is there already is left as it is: something that lay in wait, what a generation
/// that was killed left behind, or what another one is writing.
fn beside(path: &Path) -> Result<(PathBuf, File), Error> {
    let mut name = path.file_name().expect("a file that is written has a name").to_owned();
    name.push(format!(".sesame-new-{}", std::process::id()));
    for number in 0..1000 {
        let mut name = name.clone();
        if number > 0 {
            name.push(format!("-{number}"));
        }
        let temporary = path.with_file_name(name);
        match File::create_new(&temporary) {
            Ok(file) => return Ok((temporary, file)),
            Err(cause) if cause.kind() == io::ErrorKind::AlreadyExists => {}
            Err(cause) => return Err(Error::Io { action: "write", path: temporary, cause }),
        }
    }
    let cause = io::ErrorKind::AlreadyExists.into();
    Err(Error::Io { action: "write beside", path: path.to_owned(), cause })
}
