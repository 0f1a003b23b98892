//! Files of the space that an operation changes for one run, put back whatever happens.
//!
//! Before a file is changed, what it held is copied into a folder `.sesame-originals` beside the `.sesame` file, and the
//! copy is on disk before the change is. So a file is put back after a run that ends, fails or panics; after the death of
//! the worker, by the worker that takes its place or by the supervisor when it ends; and after the death of all, by the
//! next runner of the space, which does that before anything else.
//!
//! Two locks keep runners apart. A supervisor whose campaign may change files holds the first from its start to its end;
//! every other runner of the space refuses to run tests meanwhile, since its simulator would see changed files. A worker
//! holds the second for its life: a runner that starts after a supervisor died waits for that supervisor's last worker.
//! While files may change, tests run one at a time, as every simulator of the space would see them.

use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Component, Path, PathBuf};

use serde::{Deserialize, Serialize};

/// The folder of originals, beside the `.sesame` file.
pub const FOLDER: &str = ".sesame-originals";

/// A file that could not be changed or put back.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FileError {
    /// The path leads elsewhere.
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
    /// It holds no text.
    #[error("{} does not hold UTF-8 text, so it cannot be edited as text: replace it whole", path.display())]
    NoText {
        /// The file.
        path: PathBuf,
    },
    /// Another runner may change files of the space.
    #[error(
        "another runner of this space may change files in {} right now: wait for its end, or stop it",
        folder.display()
    )]
    Busy {
        /// The space's folder.
        folder: PathBuf,
    },
    /// The system refused.
    #[error("cannot {doing} {}: {source}", path.display())]
    Io {
        /// What was to be done.
        doing: &'static str,
        /// With which file.
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

/// A change that is to be undone, as its file in the folder of originals has it.
#[derive(Debug, Serialize, Deserialize)]
struct Entry {
    /// The file, relative to the space's folder.
    path: PathBuf,
    /// Whether it was there; what it held then lies beside the entry.
    existed: bool,
}

/// The files of a space that may be changed, and the originals of those that are.
#[derive(Debug)]
pub struct ChangedFiles {
    /// The folder of the `.sesame` file, without symbolic links where it could be resolved.
    folder: PathBuf,
    /// Held as long as this lives.
    _lock: Option<File>,
}

impl ChangedFiles {
    /// The files below a folder, without any lock: for tests whose operations change none.
    pub fn unlocked(folder: &Path) -> Self {
        let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
        ChangedFiles { folder, _lock: None }
    }

    /// The files below a folder, for the worker of a campaign that may change them; waits for the worker before it.
    /// What that one left changed is put back.
    pub fn for_worker(folder: &Path) -> Result<Self, FileError> {
        let mut files = ChangedFiles::unlocked(folder);
        let lock = files.wait_for_worker()?;
        files.put_back()?;
        Ok(ChangedFiles { _lock: Some(lock), ..files })
    }

    /// The files below a folder, for a runner that is about to run tests, and what an earlier one had left changed, which
    /// is put back. If the campaign `may_change` files, other runners of the space are kept out as long as this lives.
    pub fn for_supervisor(folder: &Path, may_change: bool) -> Result<(Self, Vec<PathBuf>), FileError> {
        let mut files = ChangedFiles::unlocked(folder);
        if !may_change && !files.originals().exists() {
            return Ok((files, Vec::new()));
        }
        let lock = files.lock_file("supervisor.lock")?;
        match lock.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(FileError::Busy { folder: files.folder }),
            Err(TryLockError::Error(error)) => return Err(FileError::io("lock", &files.originals())(error)),
        }
        let worker = files.wait_for_worker()?;
        let put_back = files.put_back()?;
        drop(worker);
        let lock = may_change.then_some(lock);
        Ok((ChangedFiles { _lock: lock, ..files }, put_back))
    }

    /// The folder of the `.sesame` file.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    fn originals(&self) -> PathBuf {
        self.folder.join(FOLDER)
    }

    /// Opens a lock file; the folder it lies in tells version control to look away.
    fn lock_file(&self, name: &str) -> Result<File, FileError> {
        let folder = self.originals();
        fs::create_dir_all(&folder).map_err(FileError::io("make", &folder))?;
        let ignore = folder.join(".gitignore");
        fs::write(&ignore, "*\n").map_err(FileError::io("write", &ignore))?;
        let path = folder.join(name);
        File::options()
            .create(true)
            .write(true)
            .truncate(false)
            .open(&path)
            .map_err(FileError::io("open the lock file", &path))
    }

    fn wait_for_worker(&self) -> Result<File, FileError> {
        let file = self.lock_file("worker.lock")?;
        file.lock().map_err(FileError::io("lock", &self.originals().join("worker.lock")))?;
        Ok(file)
    }

    /// A path of the space as a path of the system. The file need not be there, its folder must.
    ///
    /// Refused is what is not below the space's folder, also by way of a symbolic link, and the originals themselves.
    pub fn resolve(&self, path: &Path) -> Result<PathBuf, FileError> {
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
        if !real.starts_with(&self.folder) || real.starts_with(self.originals()) || real.is_dir() {
            return Err(outside());
        }
        Ok(real)
    }

    /// The text of a file.
    pub fn read_text(&self, path: &Path) -> Result<String, FileError> {
        let path = self.resolve(path)?;
        let bytes = fs::read(&path).map_err(FileError::io("read", &path))?;
        String::from_utf8(bytes).map_err(|_| FileError::NoText { path })
    }

    /// Replaces what a file holds, its original kept; false if it held just that.
    pub fn replace(&mut self, path: &Path, contents: &[u8]) -> Result<bool, FileError> {
        let real = self.resolve(path)?;
        if fs::read(&real).is_ok_and(|now| now == contents) {
            return Ok(false);
        }
        self.keep_original(&real)?;
        fs::write(&real, contents).map_err(FileError::io("write", &real))?;
        Ok(true)
    }

    /// Copies a file's original onto the disk, unless that was done since files were last put back.
    fn keep_original(&self, real: &Path) -> Result<(), FileError> {
        let path = real.strip_prefix(&self.folder).unwrap_or(real).to_owned();
        let entries = self.entries()?;
        if entries.iter().any(|(_, entry)| entry.path == path) {
            return Ok(());
        }
        let folder = self.originals();
        fs::create_dir_all(&folder).map_err(FileError::io("make", &folder))?;
        let number = entries.last().map_or(1, |(number, _)| number + 1);
        let existed = real.exists();
        if existed {
            let copy = folder.join(format!("{number}.original"));
            fs::copy(real, &copy).map_err(FileError::io("keep the original of", real))?;
            sync(&copy)?;
        }
        // The entry appears whole, after what it speaks of.
        let fresh = folder.join(format!("{number}.fresh"));
        let text = serde_json::to_vec(&Entry { path, existed }).map_err(io::Error::from);
        text.and_then(|text| fs::write(&fresh, text)).map_err(FileError::io("write", &fresh))?;
        sync(&fresh)?;
        let entry = folder.join(format!("{number}.json"));
        fs::rename(&fresh, &entry).map_err(FileError::io("write", &entry))?;
        sync_folder(&folder)
    }

    /// The changes to be undone, by number, rising.
    fn entries(&self) -> Result<Vec<(u64, Entry)>, FileError> {
        let folder = self.originals();
        let listed = match fs::read_dir(&folder) {
            Ok(listed) => listed,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
            Err(error) => return Err(FileError::io("list", &folder)(error)),
        };
        let mut entries = Vec::new();
        for file in listed {
            let name = file.map_err(FileError::io("list", &folder))?.file_name();
            let number = name.to_str().and_then(|name| name.strip_suffix(".json")).and_then(|n| n.parse().ok());
            let Some(number) = number else { continue };
            let path = folder.join(&name);
            let text = fs::read(&path).map_err(FileError::io("read", &path))?;
            let entry =
                serde_json::from_slice(&text).map_err(|error| FileError::io("understand", &path)(error.into()))?;
            entries.push((number, entry));
        }
        entries.sort_by_key(|(number, _): &(u64, Entry)| *number);
        Ok(entries)
    }

    /// Puts everything back that was changed, and says what, relative to the folder. Stopped at any point, it can be
    /// done again.
    pub fn put_back(&mut self) -> Result<Vec<PathBuf>, FileError> {
        let folder = self.originals();
        let mut done = Vec::new();
        for (number, Entry { path, existed }) in self.entries()? {
            let real = self.folder.join(&path);
            let copy = folder.join(format!("{number}.original"));
            if existed {
                fs::copy(&copy, &real).map_err(FileError::io("put back", &real))?;
                sync(&real)?;
            } else if let Err(error) = fs::remove_file(&real)
                && error.kind() != io::ErrorKind::NotFound
            {
                return Err(FileError::io("remove", &real)(error));
            }
            // Without its entry nobody asks for the copy.
            let entry = folder.join(format!("{number}.json"));
            fs::remove_file(&entry).map_err(FileError::io("remove", &entry))?;
            sync_folder(&folder)?;
            if existed {
                fs::remove_file(&copy).map_err(FileError::io("remove", &copy))?;
            }
            done.push(path);
        }
        Ok(done)
    }
}

/// Waits until a file is on disk.
fn sync(path: &Path) -> Result<(), FileError> {
    File::open(path).and_then(|file| file.sync_all()).map_err(FileError::io("write", path))
}

/// Waits until the names in a folder are on disk, where the system can be asked for that.
fn sync_folder(path: &Path) -> Result<(), FileError> {
    if cfg!(unix) { sync(path) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn space() -> (tempfile::TempDir, ChangedFiles) {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("config")).unwrap();
        fs::write(folder.path().join("config/a.yaml"), "gain: 1\n").unwrap();
        let files = ChangedFiles::unlocked(folder.path());
        (folder, files)
    }

    #[test]
    fn files_changed_twice_and_files_made_are_as_they_were() {
        let (folder, mut files) = space();
        let (old, new) = (Path::new("config/a.yaml"), Path::new("config/b.yaml"));
        assert!(files.replace(old, b"gain: 2\n").unwrap());
        assert!(files.replace(old, b"gain: 3\n").unwrap());
        assert!(!files.replace(old, b"gain: 3\n").unwrap(), "that is what it holds");
        assert!(files.replace(new, b"\xff\n").unwrap());
        assert!(matches!(files.read_text(new), Err(FileError::NoText { .. })));
        assert_eq!(files.put_back().unwrap(), [old, new]);
        assert_eq!(fs::read_to_string(folder.path().join(old)).unwrap(), "gain: 1\n");
        assert!(!folder.path().join(new).exists());
        assert!(files.put_back().unwrap().is_empty());
    }

    #[test]
    fn whoever_comes_later_puts_back_what_was_left() {
        let (folder, mut files) = space();
        files.replace(Path::new("config/a.yaml"), b"gain: 2\n").unwrap();
        drop(files);
        let (_later, put_back) = ChangedFiles::for_supervisor(folder.path(), false).unwrap();
        assert_eq!(put_back, [Path::new("config/a.yaml")]);
        assert_eq!(fs::read_to_string(folder.path().join("config/a.yaml")).unwrap(), "gain: 1\n");
    }

    #[test]
    fn one_runner_at_a_time_may_change_files_and_no_other_runs_meanwhile() {
        let (folder, _) = space();
        let (first, _) = ChangedFiles::for_supervisor(folder.path(), true).unwrap();
        for may_change in [true, false] {
            let refused = ChangedFiles::for_supervisor(folder.path(), may_change).unwrap_err();
            assert!(refused.to_string().starts_with("another runner of this space"), "{refused}");
        }
        drop(first);
        ChangedFiles::for_supervisor(folder.path(), true).unwrap();
    }

    #[test]
    fn nothing_outside_the_folder_is_touched() {
        let (folder, mut files) = space();
        let elsewhere = tempfile::tempdir().unwrap();
        let secret = elsewhere.path().join("secret");
        fs::write(&secret, "mine").unwrap();
        let mut paths = vec!["../x", "/etc/passwd", "config/../../x", "", "config", ".sesame-originals/1.json"];
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(&secret, folder.path().join("link")).unwrap();
            std::os::unix::fs::symlink(elsewhere.path(), folder.path().join("folder")).unwrap();
            paths.extend(["link", "folder/secret", "folder/new"]);
        }
        fs::create_dir_all(folder.path().join(FOLDER)).unwrap();
        for path in paths {
            let refused = files.replace(Path::new(path), b"yours").unwrap_err();
            assert!(matches!(refused, FileError::Outside { .. }), "{path}: {refused}");
        }
        assert_eq!(fs::read_to_string(&secret).unwrap(), "mine");
    }
}
