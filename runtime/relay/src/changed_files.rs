//! Files of the space that an operation changes for one run, put back whatever happens.
//!
//! Before a file is changed, what it held is copied into a folder `.sesame-originals` beside the `.sesame` file, and the
//! copy is on disk before the change is. So a file is put back after a run that ends, fails or panics; after the death of
//! the worker, by the worker that takes its place or by the supervisor when it ends; and after the death of all, by the
//! next runner of the space, which does that before anything else.
//!
//! The folder of originals may have come with the space from somebody else. So nothing in it is believed that leads out
//! of the space's folder: no link in it or on the way to a file that is put back is followed, nothing that lay there
//! before is written to, and a path that leads elsewhere is an error, before anything is put back.
//!
//! Two locks keep runners apart. A supervisor whose campaign may change files holds the first from its start to its end;
//! every other runner of the space refuses to run tests meanwhile, since its simulator would see changed files. A worker
//! holds the second for its life: a runner that starts after a supervisor died waits for that supervisor's last worker.
//! While files may change, tests run one at a time, as every simulator of the space would see them.

use std::fs::{self, File, TryLockError};
use std::io::{self, Read as _, Write as _};
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
    /// The folder of originals names a file to be put back that is elsewhere.
    #[error(
        "{} says that `{}` was changed, which is no file below {} or is reached by a link, so nothing was put back: if a \
         runner of yours wrote that, put the file back from beside it; then delete {}",
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
    /// The copy of what a changed file held is not there.
    #[error(
        "{} is missing, of which {} says that it holds what `{}` was: put that file right by hand, then delete {}",
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
    /// Something else in the place of the folder of originals, or of a file in it.
    #[error("{} is a link or something else that no runner made: look what it is, and remove it", path.display())]
    NotOurs {
        /// What.
        path: PathBuf,
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

    /// Whether there is a folder of originals; what is no folder of its own in that place is refused.
    fn has_originals(&self) -> Result<bool, FileError> {
        let path = self.originals();
        match fs::symlink_metadata(&path) {
            Ok(metadata) if metadata.is_dir() => Ok(true),
            Ok(_) => Err(FileError::NotOurs { path }),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
            Err(error) => Err(FileError::io("look at", &path)(error)),
        }
    }

    /// The folder of originals, made if it is not there.
    fn made_originals(&self) -> Result<PathBuf, FileError> {
        let folder = self.originals();
        if !self.has_originals()? {
            fs::create_dir_all(&folder).map_err(FileError::io("make", &folder))?;
        }
        Ok(folder)
    }

    /// Opens a lock file; the folder it lies in tells version control to look away.
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
            // Another runner made it meanwhile.
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
        let file = real.is_file() || !real.exists();
        if !real.starts_with(&self.folder) || real.starts_with(self.originals()) || !file {
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
        let folder = self.made_originals()?;
        let number = entries.last().map_or(1, |(number, _)| number + 1);
        let existed = real.exists();
        if existed {
            let copy = folder.join(format!("{number}.original"));
            discard(&copy)?;
            fs::copy(real, &copy).map_err(FileError::io("keep the original of", real))?;
            sync(&copy)?;
        }
        // The entry appears whole, after what it speaks of.
        let fresh = folder.join(format!("{number}.fresh"));
        discard(&fresh)?;
        let text = serde_json::to_vec(&Entry { path, existed }).map_err(io::Error::from);
        text.and_then(|text| File::create_new(&fresh)?.write_all(&text)).map_err(FileError::io("write", &fresh))?;
        sync(&fresh)?;
        let entry = folder.join(format!("{number}.json"));
        fs::rename(&fresh, &entry).map_err(FileError::io("write", &entry))?;
        sync_folder(&folder)
    }

    /// The changes to be undone, by number, rising.
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
            let entry =
                serde_json::from_slice(&text).map_err(|error| FileError::io("understand", &path)(error.into()))?;
            entries.push((number, entry));
        }
        entries.sort_by_key(|(number, _): &(u64, Entry)| *number);
        Ok(entries)
    }

    /// A file that may be put back, as a path of the system: it is below the space's folder, or is not there, and no link
    /// is on the way. `None` for all else.
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

    /// Puts everything back that was changed, and says what, relative to the folder. Stopped at any point, it can be
    /// done again.
    ///
    /// All entries are looked at before the first is put back, so that one that leads elsewhere stops all.
    pub fn put_back(&mut self) -> Result<Vec<PathBuf>, FileError> {
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
                fs::copy(copy, &real).map_err(FileError::io("put back", &real))?;
                sync(&real)?;
            } else if let Err(error) = fs::remove_file(&real)
                && error.kind() != io::ErrorKind::NotFound
            {
                return Err(FileError::io("remove", &real)(error));
            }
            // Without its entry nobody asks for the copy.
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

/// The most that is read of an entry: a path and a word.
const LONGEST_ENTRY: u64 = 1 << 16;

/// Whether a regular file is in a place of the folder of originals; anything but a file there is refused.
fn own_file(path: &Path) -> Result<bool, FileError> {
    match fs::symlink_metadata(path) {
        Ok(metadata) if metadata.is_file() => Ok(true),
        Ok(_) => Err(FileError::NotOurs { path: path.to_owned() }),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(FileError::io("look at", path)(error)),
    }
}

/// Makes room for a file: removes what a runner that was killed left there.
fn discard(path: &Path) -> Result<(), FileError> {
    if own_file(path)? { fs::remove_file(path).map_err(FileError::io("remove", path)) } else { Ok(()) }
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

    /// What a hostile space has in its folder of originals, or beside it.
    #[cfg(unix)]
    #[derive(Debug, Clone)]
    enum Trap {
        /// A link at a place.
        Link { at: &'static str, to: &'static str },
        /// A file at a place.
        File { at: &'static str },
        /// An entry with a path to be put back.
        Entry { number: u8, path: &'static str, existed: bool, original: bool },
    }

    #[cfg(unix)]
    fn trap() -> impl proptest::strategy::Strategy<Value = Trap> {
        const PLACES: &[&str] = &[
            ".sesame-originals",
            ".sesame-originals/.gitignore",
            ".sesame-originals/1.json",
            ".sesame-originals/1.original",
            ".sesame-originals/2.json",
            ".sesame-originals/2.original",
            ".sesame-originals/2.fresh",
            ".sesame-originals/3.fresh",
            ".sesame-originals/3.original",
            ".sesame-originals/supervisor.lock",
            ".sesame-originals/worker.lock",
            "config",
            "config/a.yaml",
            "config/b.yaml",
            "deep/er",
        ];
        const TARGETS: &[&str] = &["outside", "outside/victim", "outside/folder", "outside/new", "space/config", ""];
        const PATHS: &[&str] = &[
            "config/a.yaml",
            "config/new.yaml",
            "config",
            "deep/er/victim",
            "../outside/victim",
            "ABSOLUTE",
            "config/../../outside/victim",
            ".sesame-originals/1.original",
            "",
            "/",
        ];
        use proptest::prelude::*;
        prop_oneof![
            3 => (prop::sample::select(PLACES), prop::sample::select(TARGETS))
                .prop_map(|(at, to)| Trap::Link { at, to }),
            1 => prop::sample::select(PLACES).prop_map(|at| Trap::File { at }),
            4 => (1..3u8, prop::sample::select(PATHS), any::<bool>(), any::<bool>())
                .prop_map(|(number, path, existed, original)| Trap::Entry { number, path, existed, original }),
        ]
    }

    /// Every name below a folder, with what it holds or leads to.
    #[cfg(unix)]
    fn snapshot(folder: &Path) -> std::collections::BTreeMap<PathBuf, Vec<u8>> {
        use std::os::unix::fs::PermissionsExt as _;
        let mut all = std::collections::BTreeMap::new();
        let mut folders = vec![folder.to_owned()];
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(&folder).unwrap() {
                let path = entry.unwrap().path();
                let metadata = fs::symlink_metadata(&path).unwrap();
                let mut what = format!("{:o} ", metadata.permissions().mode()).into_bytes();
                if metadata.is_symlink() {
                    what.extend(fs::read_link(&path).unwrap().as_os_str().as_encoded_bytes());
                } else if metadata.is_file() {
                    what.extend(fs::read(&path).unwrap());
                } else {
                    folders.push(path.clone());
                }
                all.insert(path, what);
            }
        }
        all
    }

    #[cfg(unix)]
    proptest::proptest! {
        #![proptest_config(proptest::prelude::ProptestConfig { cases: 200, failure_persistence: None, ..Default::default() })]

        #[test]
        fn whatever_lies_in_a_space_nothing_outside_is_touched_by_putting_back(
            traps in proptest::collection::vec(trap(), 1..8),
            may_change: bool,
        ) {
            let all = tempfile::tempdir().unwrap();
            let (space, outside) = (all.path().join("space"), all.path().join("outside"));
            for folder in [space.join("config"), space.join(FOLDER), space.join("deep"), outside.join("folder")] {
                fs::create_dir_all(folder).unwrap();
            }
            fs::write(space.join("config/a.yaml"), "gain: 1\n").unwrap();
            fs::write(outside.join("victim"), "mine").unwrap();
            fs::write(outside.join("folder/a.yaml"), "mine").unwrap();
            let absolute = outside.join("victim");
            let absolute = absolute.to_str().unwrap();
            for trap in traps {
                match trap {
                    Trap::Link { at, to } => {
                        let (at, to) = (space.join(at), all.path().join(to));
                        // Only what the trap itself made may be in its way.
                        if fs::symlink_metadata(&at).is_ok_and(|it| it.is_dir()) && at.starts_with(&space) {
                            fs::remove_dir_all(&at).unwrap();
                        }
                        drop(std::os::unix::fs::symlink(to, at));
                    }
                    Trap::File { at } => {
                        if snapshot(&space).contains_key(space.join(at).parent().unwrap()) {
                            drop(File::create_new(space.join(at)));
                        }
                    }
                    Trap::Entry { number, path, existed, original } => {
                        let folder = space.join(FOLDER);
                        if fs::symlink_metadata(&folder).is_ok_and(|it| it.is_dir()) {
                            let entry = Entry { path: path.replace("ABSOLUTE", absolute).into(), existed };
                            let entry = serde_json::to_vec(&entry).unwrap();
                            let made = File::create_new(folder.join(format!("{number}.json")));
                            drop(made.and_then(|mut file| file.write_all(&entry)));
                            if original {
                                let made = File::create_new(folder.join(format!("{number}.original")));
                                drop(made.and_then(|mut file| file.write_all(b"yours")));
                            }
                        }
                    }
                }
            }
            let before = snapshot(&outside);
            let done = ChangedFiles::for_supervisor(&space, may_change);
            let done = done.map(|(files, _)| drop(files));
            let worked = ChangedFiles::for_worker(&space).and_then(|mut files| {
                for path in ["config/a.yaml", "config/new.yaml", "deep/er/victim"] {
                    drop(files.replace(Path::new(path), b"yours"));
                }
                files.put_back()
            });
            proptest::prop_assert_eq!(snapshot(&outside), before, "{:?} {:?}", done, worked);
            for error in done.err().into_iter().chain(worked.err()) {
                proptest::prop_assert!(error.to_string().contains(space.to_str().unwrap()), "{}", error);
            }
        }
    }

    #[test]
    fn an_entry_that_names_what_is_elsewhere_stops_all_and_is_named() {
        let (folder, mut files) = space();
        files.replace(Path::new("config/a.yaml"), b"gain: 2\n").unwrap();
        let entry = folder.path().join(FOLDER).join("2.json");
        for path in ["../x", "/etc/passwd", "config/../../x", "config", "", ".sesame-originals/1.original"] {
            fs::write(&entry, serde_json::to_vec(&Entry { path: path.into(), existed: false }).unwrap()).unwrap();
            let refused = files.put_back().unwrap_err();
            assert!(matches!(refused, FileError::EntryOutside { .. }), "{path}: {refused}");
            assert!(refused.to_string().contains("2.json"), "{refused}");
            assert_eq!(fs::read_to_string(folder.path().join("config/a.yaml")).unwrap(), "gain: 2\n", "nothing is");
        }
        fs::remove_file(&entry).unwrap();
        assert_eq!(files.put_back().unwrap(), [Path::new("config/a.yaml")]);
    }

    #[test]
    fn an_original_that_is_missing_is_named() {
        let (folder, mut files) = space();
        files.replace(Path::new("config/a.yaml"), b"gain: 2\n").unwrap();
        fs::remove_file(folder.path().join(FOLDER).join("1.original")).unwrap();
        let refused = files.put_back().unwrap_err().to_string();
        for part in ["1.original is missing", "1.json", "config/a.yaml"] {
            assert!(refused.contains(part), "{refused}");
        }
    }
}
