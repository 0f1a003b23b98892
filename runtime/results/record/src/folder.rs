//! Where a run's results go, and who may write there.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read as _, Seek as _, Write as _};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use crate::files::{BEGUN, DATABASE, LOCK};
use crate::{RecordError, Repository};

/// A fresh folder for a run.
#[derive(Debug)]
pub struct Claim {
    /// The folder; it exists, holds no results, and no other process uses it as long as the claim exists.
    pub folder: PathBuf,
    /// The latest run of the same name that was begun, is not finished, and that no process is writing: what `resume`
    /// could continue.
    pub unfinished: Option<PathBuf>,
    pub(crate) lock: Lock,
}

/// Makes a fresh folder for a run: `<results>/<name>`, and where that is taken `<name>-2`, `<name>-3`, … A run of the
/// campaign is named by its seed, so that [`latest_folder`] finds it.
///
/// A folder in which a run was killed before it had results is as good as a fresh one.
pub fn claim_folder(results: &Path, name: &str) -> Result<Claim, RecordError> {
    std::fs::create_dir_all(results).map_err(|e| RecordError::io("make the folder for results", results, e))?;
    let mut unfinished = None;
    let mut n = 1u32;
    loop {
        let folder = results.join(if n == 1 { name.to_owned() } else { format!("{name}-{n}") });
        match std::fs::create_dir(&folder) {
            Err(error) if error.kind() != std::io::ErrorKind::AlreadyExists => {
                return Err(RecordError::io("make the folder for results", &folder, error));
            }
            _ => {}
        }
        if let Some(lock) = locked_for_a_beginning(&folder)? {
            return Ok(Claim { folder, unfinished, lock });
        }
        if can_be_resumed(&folder) {
            unfinished = Some(folder);
        }
        n += 1;
    }
}

/// The lock of a folder without results, unless another process has it. If two try at once, one gets it.
fn locked_for_a_beginning(folder: &Path) -> Result<Option<Lock>, RecordError> {
    if !holds_nothing(folder)? {
        return Ok(None);
    }
    match Lock::acquire(folder) {
        // The process that held the lock until now may have begun a run.
        Ok(lock) => Ok(holds_nothing(folder)?.then_some(lock)),
        Err(RecordError::Locked { .. }) => Ok(None),
        Err(error) => Err(error),
    }
}

/// Whether there is nothing in a folder but what a run leaves that was killed as it began.
fn holds_nothing(folder: &Path) -> Result<bool, RecordError> {
    let failed = |error| RecordError::io("look into the folder", folder, error);
    let entries = match std::fs::read_dir(folder) {
        Err(error) if error.kind() == std::io::ErrorKind::NotADirectory => return Ok(false),
        entries => entries.map_err(failed)?,
    };
    for entry in entries {
        let name = entry.map_err(failed)?.file_name();
        if name != LOCK && name != BEGUN && name.to_str() != Some(&format!("{BEGUN}-journal")) {
            return Ok(false);
        }
    }
    Ok(true)
}

/// The folder of the campaign's run whose results were written last, if there is any.
///
/// Its name is its seed, perhaps with a number after it, such as `42-2`. What else was run on the side (regression
/// tests, repetitions, runs in a lab such as `42-hall`) is looked at when it is asked for, or when there is nothing
/// else. The same holds for runs that ended before any test did, perhaps because the simulator was missing: they do not
/// hide those that found something.
pub fn latest_folder(results: &Path) -> Result<Option<PathBuf>, RecordError> {
    let folders = latest_first(results)?;
    let searches: Vec<&PathBuf> = folders.iter().filter(|folder| is_search(folder)).collect();
    let tested = searches.iter().find(|folder| has_tests(folder));
    Ok(tested.or(searches.first()).copied().or(folders.first()).cloned())
}

fn is_search(folder: &Path) -> bool {
    folder.file_name().is_some_and(|name| name.to_string_lossy().chars().all(|c| c.is_ascii_digit() || c == '-'))
}

/// Whether a run has tests besides reference runs. Results that cannot be read may have some, and opening
/// them says what is wrong.
fn has_tests(folder: &Path) -> bool {
    Repository::open(folder).and_then(|repository| repository.evaluated()).map_or(true, |tests| tests > 0)
}

/// The folder of the campaign's run whose results were written last, of those that are not finished and that no process
/// is writing, if there is any. Where all that are not finished are being written, the error names the process of the
/// latest.
///
/// A run that was written later than it and cannot be read is an error: it may be the one that is meant.
pub fn latest_unfinished(results: &Path) -> Result<Option<PathBuf>, RecordError> {
    let mut at_work = None;
    for folder in latest_first(results)? {
        if Repository::open(&folder)?.campaign().stop.is_some() {
            continue;
        }
        // The lock is released at once: a query must not prevent others from writing.
        match Lock::acquire(&folder) {
            Ok(_) => return Ok(Some(folder)),
            Err(error @ RecordError::Locked { .. }) => at_work = at_work.or(Some(error)),
            Err(error) => return Err(error),
        }
    }
    at_work.map_or(Ok(None), Err)
}

/// The folders of the campaign's runs, those first whose results were written last.
fn latest_first(results: &Path) -> Result<Vec<PathBuf>, RecordError> {
    let failed = |error| RecordError::io("look for results", results, error);
    let entries = match std::fs::read_dir(results) {
        Ok(entries) => entries,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(error) => return Err(failed(error)),
    };
    let mut runs = Vec::new();
    for entry in entries {
        let folder = entry.map_err(failed)?.path();
        let name = folder.file_name().unwrap_or_default().to_string_lossy();
        if name.starts_with(|first: char| first.is_ascii_digit()) {
            runs.extend(written_at(&folder).map(|written| (written, folder)));
        }
    }
    // Equal times are told apart by name, so that the answer does not depend on the order of the listing.
    runs.sort();
    Ok(runs.into_iter().rev().map(|(_, folder)| folder).collect())
}

/// When something was last written into the database of a folder, if there is one.
///
/// While a run goes on, and after it was killed, what is new is in the log beside the database. An empty log says
/// nothing: reading makes one.
fn written_at(folder: &Path) -> Option<SystemTime> {
    let written = |name: String| {
        let file = std::fs::metadata(folder.join(name)).ok()?;
        Some((file.modified().ok()?, file.len()))
    };
    let (database, _) = written(DATABASE.to_owned())?;
    let log = written(format!("{DATABASE}-wal")).filter(|&(_, length)| length > 0);
    Some(log.map_or(database, |(log, _)| log.max(database)))
}

fn can_be_resumed(folder: &Path) -> bool {
    let open = Repository::open(folder).is_ok_and(|repository| repository.campaign().stop.is_none());
    // The lock is released at once: a query must not prevent others from writing.
    open && Lock::acquire(folder).is_ok()
}

/// The right to write into a folder; let go when dropped, and by the system when the process dies.
#[derive(Debug)]
pub(crate) struct Lock {
    file: File,
    path: PathBuf,
}

impl Lock {
    /// Takes the lock, or names its holder.
    pub(crate) fn acquire(folder: &Path) -> Result<Lock, RecordError> {
        let path = folder.join(LOCK);
        let doing = "lock the results";
        // Never truncated on opening: until the lock is ours the content is its holder's.
        let mut file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(&path)
            .map_err(|e| RecordError::io(doing, &path, e))?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                let mut holder = String::new();
                file.read_to_string(&mut holder).map_err(|e| RecordError::io("read the lock", &path, e))?;
                return Err(RecordError::Locked { pid: holder.trim().parse().ok(), path });
            }
            Err(TryLockError::Error(error)) => return Err(RecordError::io(doing, &path, error)),
        }
        let written = file
            .set_len(0)
            .and_then(|()| file.rewind())
            .and_then(|()| file.write_all(format!("{}\n", std::process::id()).as_bytes()));
        written.map_err(|e| RecordError::io(doing, &path, e))?;
        Ok(Lock { file, path })
    }

    /// Makes sure that the lock is still where others look for it. Somebody who removes the file lets another process
    /// in.
    pub(crate) fn check(&self) -> Result<(), RecordError> {
        let held = self.is_in_place().map_err(|e| RecordError::io("look at the lock", &self.path, e))?;
        if held { Ok(()) } else { Err(RecordError::LockLost { path: self.path.clone() }) }
    }

    #[cfg(unix)]
    fn is_in_place(&self) -> std::io::Result<bool> {
        use std::os::unix::fs::MetadataExt as _;
        Ok(self.file.metadata()?.nlink() > 0)
    }

    /// Elsewhere the name of an open file stays taken.
    #[cfg(not(unix))]
    fn is_in_place(&self) -> std::io::Result<bool> {
        self.file.metadata().map(|_| true)
    }
}
