//! Files of the space that an operation changes for one run, and how they are restored in every case.
//!
//! Before a file is changed, its contents are copied into a folder `.sesame-originals` beside the `.sesame` file, and
//! the copy is on disk before the change is made. So a file is restored after a run that ends, fails or panics; after
//! the death of the worker, by the worker that replaces it or by the supervisor at its end; and after the death of all,
//! by the next runner of the space, before it does anything else.
//!
//! The folder of originals may have come with the space from somebody else. So nothing in it can lead out of the
//! space's folder: no link in it or on the path of a file that is restored is followed, nothing that was there before
//! is written to, and a path that leads elsewhere is an error, before anything is restored.
//!
//! Two locks keep runners apart. A supervisor whose campaign may change files holds the first from its start to its
//! end; every other runner of the space refuses to run tests in that time, since its simulator would see changed files.
//! A worker holds the second for its life: a runner that starts after a supervisor died waits for that supervisor's
//! last worker. While files may change, tests run one at a time, since every simulator of the space would see the
//! changes.

use std::fs::{self, File, TryLockError};
use std::io::{self, Read as _, Write as _};
use std::path::{Component, Path, PathBuf};

use serde::{Deserialize, Serialize};

use sesame_relay::files::{SpaceFileError, SpaceFiles};

/// The folder of originals, beside the `.sesame` file.
const FOLDER: &str = ".sesame-originals";

/// A file that could not be changed or restored.
#[derive(Debug, thiserror::Error)]
pub(crate) enum FileError {
    /// The path is outside the space.
    #[error(
        "`{}` is not a file below the space's folder {}: name it by its path from there, without `..`",
        path.display(), folder.display()
    )]
    Outside {
        /// The path, as it was given.
        path: PathBuf,
        /// The space's folder.
        folder: PathBuf,
    },
    /// The folder of originals names a file outside the space.
    #[error(
        "{} says that `{}` was changed, which is not a file below {} or is reached by a link, so nothing was restored: if \
         one of your runners wrote this entry, restore the file from the copy beside it; then delete {}",
        entry.display(), path.display(), folder.display(), entry.display()
    )]
    EntryOutside {
        /// The entry in the folder of originals.
        entry: PathBuf,
        /// What it names.
        path: PathBuf,
        /// The space's folder.
        folder: PathBuf,
    },
    /// The copy of a changed file is missing.
    #[error(
        "{} is missing; according to {} it is the original of `{}`: restore that file by hand, then delete {}",
        copy.display(), entry.display(), path.display(), entry.display()
    )]
    NoOriginal {
        /// The copy.
        copy: PathBuf,
        /// The entry in the folder of originals.
        entry: PathBuf,
        /// The file that was changed.
        path: PathBuf,
    },
    /// In the place of the folder of originals, or of a file in it, is something else.
    #[error("{} is a link, or something else that was not made by a runner: check what it is, and remove it", path.display())]
    NotOurs {
        /// What.
        path: PathBuf,
    },
    /// It is not text.
    #[error("{} is not UTF-8 text, so it cannot be edited as text: use `replace_file`", path.display())]
    NoText {
        /// The file.
        path: PathBuf,
    },
    /// Another runner may change files of the space.
    #[error(
        "another runner of this space may change files in {} at the moment: wait for its end, or stop it",
        folder.display()
    )]
    Busy {
        /// The space's folder.
        folder: PathBuf,
    },
    /// The system refused.
    #[error("cannot {doing} {}: {source}", path.display())]
    Io {
        /// What failed, as a verb.
        doing: &'static str,
        /// The file.
        path: PathBuf,
        /// Why not.
        source: io::Error,
    },
}

impl FileError {
    fn io(doing: &'static str, path: &Path) -> impl FnOnce(io::Error) -> FileError {
        move |source| FileError::Io { doing, path: path.to_owned(), source }
    }
}

/// A change that is to be undone: one file in the folder of originals.
#[derive(Debug, Serialize, Deserialize)]
struct Entry {
    /// The file, relative to the space's folder.
    path: PathBuf,
    /// Whether it existed; its contents are then beside the entry.
    existed: bool,
}

/// The files of a space that may be changed, and the originals of changed ones.
#[derive(Debug)]
pub(crate) struct ChangedFiles {
    /// The folder of the `.sesame` file, without symbolic links if it could be resolved.
    folder: PathBuf,
    /// Held as long as this lives.
    _lock: Option<File>,
}

impl ChangedFiles {
    /// The files below a folder, without any lock: for tests whose operations change none.
    pub(crate) fn unlocked(folder: &Path) -> Self {
        let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
        ChangedFiles { folder, _lock: None }
    }

    /// The files below a folder, for the worker of a campaign that may change them; waits for the previous worker and
    /// restores what it left changed.
    pub(crate) fn for_worker(folder: &Path) -> Result<Self, FileError> {
        let mut files = ChangedFiles::unlocked(folder);
        let lock = files.wait_for_worker()?;
        files.restore_all()?;
        Ok(ChangedFiles { _lock: Some(lock), ..files })
    }

    /// The files below a folder, for a runner that is about to run tests, and the files that an earlier one had left
    /// changed, which are restored. If the campaign `may_change` files, other runners of the space are locked out as
    /// long as this lives.
    pub(crate) fn for_supervisor(folder: &Path, may_change: bool) -> Result<(Self, Vec<PathBuf>), FileError> {
        let mut files = ChangedFiles::unlocked(folder);
        if !may_change && !files.has_originals()? {
            return Ok((files, Vec::new()));
        }
        let lock = files.lock_file("supervisor.lock")?;
        match lock.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(FileError::Busy { folder: files.folder }),
            Err(TryLockError::Error(error)) => return Err(FileError::io("lock", &files.originals())(error)),
        }
        let worker = files.wait_for_worker()?;
        let restored = files.restore_all()?;
        drop(worker);
        let lock = may_change.then_some(lock);
        Ok((ChangedFiles { _lock: lock, ..files }, restored))
    }

    fn originals(&self) -> PathBuf {
        self.folder.join(FOLDER)
    }

    /// Whether there is a folder of originals; anything else in its place is an error.
    fn has_originals(&self) -> Result<bool, FileError> {
        let path = self.originals();
        match fs::symlink_metadata(&path) {
            Ok(metadata) if metadata.is_dir() => Ok(true),
            Ok(_) => Err(FileError::NotOurs { path }),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
            Err(error) => Err(FileError::io("inspect", &path)(error)),
        }
    }

    /// The folder of originals, created if it does not exist.
    fn made_originals(&self) -> Result<PathBuf, FileError> {
        let folder = self.originals();
        if !self.has_originals()? {
            fs::create_dir_all(&folder).map_err(FileError::io("create", &folder))?;
        }
        Ok(folder)
    }

    /// Opens a lock file, in a folder that version control ignores.
    fn lock_file(&self, name: &str) -> Result<File, FileError> {
        let folder = self.made_originals()?;
        let ignore = folder.join(".gitignore");
        match File::create_new(&ignore) {
            Ok(mut file) => file.write_all(b"*\n").map_err(FileError::io("write", &ignore))?,
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            Err(error) => return Err(FileError::io("write", &ignore)(error)),
        }
        let path = folder.join(name);
        let failed = || FileError::io("open the lock file", &path);
        if own_file(&path)? {
            return File::options().write(true).open(&path).map_err(failed());
        }
        match File::create_new(&path) {
            // Another runner has just created it.
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists && own_file(&path)? => {
                File::options().write(true).open(&path).map_err(failed())
            }
            made => made.map_err(failed()),
        }
    }

    fn wait_for_worker(&self) -> Result<File, FileError> {
        let file = self.lock_file("worker.lock")?;
        file.lock().map_err(FileError::io("lock", &self.originals().join("worker.lock")))?;
        Ok(file)
    }

    /// A path of the space as a path of the system. The file need not exist, its folder must.
    ///
    /// It is an error if the path leads out of the space's folder, also by a symbolic link, or to the originals.
    pub(crate) fn resolve(&self, path: &Path) -> Result<PathBuf, FileError> {
        let outside = || FileError::Outside { path: path.to_owned(), folder: self.folder.clone() };
        let plain = path.components().all(|part| matches!(part, Component::Normal(_)));
        let (Some(name), true) = (path.file_name(), plain) else { return Err(outside()) };
        let whole = self.folder.join(path);
        let real = if fs::symlink_metadata(&whole).is_ok() {
            whole.canonicalize().map_err(FileError::io("find", &whole))?
        } else {
            let parent = whole.parent().unwrap_or(&self.folder);
            parent.canonicalize().map_err(FileError::io("find", parent))?.join(name)
        };
        let file = real.is_file() || !real.exists();
        if !real.starts_with(&self.folder) || real.starts_with(self.originals()) || !file {
            return Err(outside());
        }
        Ok(real)
    }

    /// The text of a file.
    fn text(&self, path: &Path) -> Result<String, FileError> {
        let path = self.resolve(path)?;
        let bytes = fs::read(&path).map_err(FileError::io("read", &path))?;
        String::from_utf8(bytes).map_err(|_| FileError::NoText { path })
    }

    /// Replaces the contents of a file and keeps its original; false if it already had these contents.
    fn replace_contents(&mut self, path: &Path, contents: &[u8]) -> Result<bool, FileError> {
        let real = self.resolve(path)?;
        if fs::read(&real).is_ok_and(|now| now == contents) {
            return Ok(false);
        }
        self.keep_original(&real)?;
        fs::write(&real, contents).map_err(FileError::io("write", &real))?;
        Ok(true)
    }

    /// Copies a file's original to the disk, unless that was done since files were last restored.
    fn keep_original(&self, real: &Path) -> Result<(), FileError> {
        let path = real.strip_prefix(&self.folder).unwrap_or(real).to_owned();
        let entries = self.entries()?;
        if entries.iter().any(|(_, entry)| entry.path == path) {
            return Ok(());
        }
        let folder = self.made_originals()?;
        let number = entries.last().map_or(1, |(number, _)| number + 1);
        let existed = real.exists();
        if existed {
            let copy = folder.join(format!("{number}.original"));
            discard(&copy)?;
            fs::copy(real, &copy).map_err(FileError::io("keep the original of", real))?;
            sync(&copy)?;
        }
        // The entry appears complete, and after its copy.
        let fresh = folder.join(format!("{number}.fresh"));
        discard(&fresh)?;
        let text = serde_json::to_vec(&Entry { path, existed }).map_err(io::Error::from);
        text.and_then(|text| File::create_new(&fresh)?.write_all(&text)).map_err(FileError::io("write", &fresh))?;
        sync(&fresh)?;
        let entry = folder.join(format!("{number}.json"));
        fs::rename(&fresh, &entry).map_err(FileError::io("write", &entry))?;
        sync_folder(&folder)
    }

    /// The changes to be undone, by increasing number.
    fn entries(&self) -> Result<Vec<(u64, Entry)>, FileError> {
        let folder = self.originals();
        if !self.has_originals()? {
            return Ok(Vec::new());
        }
        let listed = fs::read_dir(&folder).map_err(FileError::io("list", &folder))?;
        let mut entries = Vec::new();
        for file in listed {
            let name = file.map_err(FileError::io("list", &folder))?.file_name();
            let number = name.to_str().and_then(|name| name.strip_suffix(".json")).and_then(|n| n.parse().ok());
            let Some(number) = number else { continue };
            let path = folder.join(&name);
            own_file(&path)?;
            let mut text = Vec::new();
            File::open(&path)
                .and_then(|file| file.take(LONGEST_ENTRY).read_to_end(&mut text))
                .map_err(FileError::io("read", &path))?;
            let entry = serde_json::from_slice(&text).map_err(|error| FileError::io("parse", &path)(error.into()))?;
            entries.push((number, entry));
        }
        entries.sort_by_key(|(number, _): &(u64, Entry)| *number);
        Ok(entries)
    }

    /// A file that may be restored, as a path of the system: it is below the space's folder or does not exist, and no
    /// link is on its path. `None` for anything else.
    fn own_place(&self, path: &Path) -> Option<PathBuf> {
        if path.starts_with(FOLDER) || path.as_os_str().is_empty() {
            return None;
        }
        let mut here = self.folder.clone();
        let mut parts = path.components().peekable();
        while let Some(part) = parts.next() {
            let Component::Normal(name) = part else { return None };
            here.push(name);
            match fs::symlink_metadata(&here) {
                Ok(metadata) if parts.peek().is_some() && metadata.is_dir() => {}
                Ok(metadata) if parts.peek().is_none() && metadata.is_file() => {}
                Err(error) if error.kind() == io::ErrorKind::NotFound => {}
                _ => return None,
            }
        }
        Some(here)
    }

    /// Restores everything that was changed, and returns the paths relative to the folder. If it is interrupted at any
    /// point, it can be called again.
    ///
    /// All entries are checked before the first file is restored, so an entry that leads elsewhere stops all.
    pub(crate) fn restore_all(&mut self) -> Result<Vec<PathBuf>, FileError> {
        let folder = self.originals();
        let mut changes = Vec::new();
        for (number, Entry { path, existed }) in self.entries()? {
            let entry = folder.join(format!("{number}.json"));
            let copy = folder.join(format!("{number}.original"));
            let Some(real) = self.own_place(&path) else {
                return Err(FileError::EntryOutside { entry, path, folder: self.folder.clone() });
            };
            if existed && !own_file(&copy)? {
                return Err(FileError::NoOriginal { copy, entry, path });
            }
            changes.push((path, real, entry, existed.then_some(copy)));
        }
        let mut done = Vec::new();
        for (path, real, entry, copy) in changes {
            if let Some(copy) = &copy {
                fs::copy(copy, &real).map_err(FileError::io("restore", &real))?;
                sync(&real)?;
            } else if let Err(error) = fs::remove_file(&real)
                && error.kind() != io::ErrorKind::NotFound
            {
                return Err(FileError::io("remove", &real)(error));
            }
            // Without its entry the copy is not needed.
            fs::remove_file(&entry).map_err(FileError::io("remove", &entry))?;
            sync_folder(&folder)?;
            if let Some(copy) = &copy {
                fs::remove_file(copy).map_err(FileError::io("remove", copy))?;
            }
            done.push(path);
        }
        Ok(done)
    }
}

impl SpaceFiles for ChangedFiles {
    fn folder(&self) -> &Path {
        &self.folder
    }

    fn read_text(&self, path: &Path) -> Result<String, SpaceFileError> {
        self.text(path).map_err(|error| in_words(&error))
    }

    fn replace(&mut self, path: &Path, contents: &[u8]) -> Result<bool, SpaceFileError> {
        self.replace_contents(path, contents).map_err(|error| in_words(&error))
    }

    fn restore(&mut self) -> Result<(), SpaceFileError> {
        self.restore_all().map(drop).map_err(|error| in_words(&error))
    }
}

fn in_words(error: &FileError) -> SpaceFileError {
    SpaceFileError(error.to_string())
}

/// The most bytes that are read of an entry: a path and a flag.
const LONGEST_ENTRY: u64 = 1 << 16;

/// Whether there is a regular file at a path in the folder of originals; anything but a file is an error.
fn own_file(path: &Path) -> Result<bool, FileError> {
    match fs::symlink_metadata(path) {
        Ok(metadata) if metadata.is_file() => Ok(true),
        Ok(_) => Err(FileError::NotOurs { path: path.to_owned() }),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(FileError::io("inspect", path)(error)),
    }
}

/// Removes a file that a killed runner left in the place of a new one.
fn discard(path: &Path) -> Result<(), FileError> {
    if own_file(path)? { fs::remove_file(path).map_err(FileError::io("remove", path)) } else { Ok(()) }
}

/// Waits until a file is on disk.
fn sync(path: &Path) -> Result<(), FileError> {
    File::open(path).and_then(|file| file.sync_all()).map_err(FileError::io("write", path))
}

/// Waits until the names in a folder are on disk, if the system supports this.
fn sync_folder(path: &Path) -> Result<(), FileError> {
    if cfg!(unix) { sync(path) } else { Ok(()) }
}

#[cfg(test)]
mod tests;
