//! Where a run's results go, and who may write there.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read as _, Seek as _, Write as _};
use std::path::{Path, PathBuf};

use crate::record::{RecordError, Repository};

/// Name of the database in a run's folder.
pub const DATABASE: &str = "results.sqlite";

/// Name of the database until it has all of its tables.
pub(crate) const BEGUN: &str = "results.sqlite.begun";

/// Name of the lock file in a run's folder.
pub const LOCK: &str = "results.lock";

/// Name of the folder of traces in a run's folder.
pub const TRACES: &str = "traces";

/// Where the trace of a test is, if it has one, in the results in this folder.
pub fn trace_file(folder: &Path, test: u32) -> PathBuf {
    folder.join(TRACES).join(format!("T{test}.mcap"))
}

/// A fresh folder for a run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Claim {
    /// The folder; it exists now, is empty, and is nobody else's.
    pub folder: PathBuf,
    /// The latest run of the same name that was begun, is not finished, and that no process is writing: what `resume`
    /// could go on with.
    pub unfinished: Option<PathBuf>,
}

/// Makes a fresh folder for a run: `<results>/<name>`, and where that is taken `<name>-2`, `<name>-3`, … A run of the
/// campaign is named by its seed, so that [`latest_folder`] finds it.
pub fn claim_folder(results: &Path, name: &str) -> Result<Claim, RecordError> {
    std::fs::create_dir_all(results).map_err(|e| RecordError::io("make the folder for results", results, e))?;
    let mut unfinished = None;
    let mut n = 1u32;
    loop {
        let folder = results.join(if n == 1 { name.to_owned() } else { format!("{name}-{n}") });
        // Making the folder is the claim: of two processes that try at once, one gets the next number.
        match std::fs::create_dir(&folder) {
            Ok(()) => return Ok(Claim { folder, unfinished }),
            Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {
                if can_be_resumed(&folder) {
                    unfinished = Some(folder);
                }
                n += 1;
            }
            Err(error) => return Err(RecordError::io("make the folder for results", &folder, error)),
        }
    }
}

/// The folder of the campaign's run whose results were written last, if there is any. Its name begins with its seed:
/// what else was run on the side (known tests, repetitions) is looked at when it is asked for.
pub fn latest_folder(results: &Path) -> Result<Option<PathBuf>, RecordError> {
    let failed = |error| RecordError::io("look for results", results, error);
    let entries = match std::fs::read_dir(results) {
        Ok(entries) => entries,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(failed(error)),
    };
    let mut latest = None;
    for entry in entries {
        let folder = entry.map_err(failed)?.path();
        let name = folder.file_name().unwrap_or_default().to_string_lossy();
        if !name.starts_with(|first: char| first.is_ascii_digit()) {
            continue;
        }
        let Ok(written) = std::fs::metadata(folder.join(DATABASE)).and_then(|file| file.modified()) else { continue };
        // Equal times are told apart by name, so that the answer does not depend on the order of the listing.
        latest = latest.max(Some((written, folder)));
    }
    Ok(latest.map(|(_, folder)| folder))
}

fn can_be_resumed(folder: &Path) -> bool {
    let open = Repository::open(folder).is_ok_and(|repository| repository.campaign().stop.is_none());
    // The lock is let go at once: asking must not keep anybody from writing.
    open && Lock::acquire(folder).is_ok()
}

/// The right to write into a folder; let go when dropped, and by the system when the process dies.
#[derive(Debug)]
pub(crate) struct Lock {
    _file: File,
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
        Ok(Lock { _file: file })
    }
}
