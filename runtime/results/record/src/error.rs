//! Errors of results on disk, each with the path and a remedy.

use std::path::{Path, PathBuf};

use sesame_base::test_number::TestNumber;
use sesame_base::visible::visible;

/// Why results could not be written or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordError {
    /// The folder already holds results.
    #[error("there are results already; choose another folder, or `resume` them if they are unfinished: {}", path.display())]
    Exists {
        /// The database.
        path: PathBuf,
    },
    /// There is no database at this place.
    #[error("no results here; name the folder of a run, for example `results/42`: {}", path.display())]
    Missing {
        /// The database looked for.
        path: PathBuf,
    },
    /// Another process is writing these results.
    #[error("{} is writing these results; wait for it or stop it: {}", holder(*pid), path.display())]
    Locked {
        /// The holder, where the lock file tells it.
        pid: Option<u32>,
        /// The lock file.
        path: PathBuf,
    },
    /// The lock was removed during a run, so another run may write these results too.
    #[error(
        "the lock of these results was removed while they were written, so another run may be writing them; this run ends, and \
         `resume` continues it: {}", path.display()
    )]
    LockLost {
        /// The lock file.
        path: PathBuf,
    },
    /// The run has ended, so there is nothing to resume.
    #[error("this run is finished; start a new one with `run`: {}", path.display())]
    Finished {
        /// The database.
        path: PathBuf,
    },
    /// The run has not ended: additions could change what it still records.
    #[error("this run is unfinished; `resume` continues it: {}", path.display())]
    Unfinished {
        /// The database.
        path: PathBuf,
    },
    /// The file is not a results repository.
    #[error("not the results of a campaign ({found}); nothing was changed: {}", path.display())]
    Foreign {
        /// What the file is instead.
        found: String,
        /// The file.
        path: PathBuf,
    },
    /// A later release wrote the file.
    #[error(
        "these results have schema {found}, this release reads {known}; read them with the release that wrote \
         them, or a later one: {}", path.display()
    )]
    Newer {
        /// Schema of the file.
        found: i64,
        /// Schema of this release.
        known: i64,
        /// The file.
        path: PathBuf,
    },
    /// An earlier release wrote the file, in a schema that is not read any more.
    #[error(
        "these results have schema {found}, this release reads {known}; read them with the release that wrote them, or \
         run the campaign again: {}", path.display()
    )]
    Older {
        /// Schema of the file.
        found: i64,
        /// Schema of this release.
        known: i64,
        /// The file.
        path: PathBuf,
    },
    /// An earlier release wrote the file: it can be read, but not written.
    #[error(
        "these results have schema {found}, this release writes {known}: they can be read, but nothing can be added; \
         continue with the release that wrote them, or run the campaign again: {}", path.display()
    )]
    ReadOnly {
        /// Schema of the file.
        found: i64,
        /// Schema of this release.
        known: i64,
        /// The file.
        path: PathBuf,
    },
    /// The file is cut off or its content contradicts itself.
    #[error("these results are damaged ({problem}); restore the file from a copy, or run the campaign again: {}", path.display())]
    Damaged {
        /// What was found.
        problem: String,
        /// The file.
        path: PathBuf,
    },
    /// The file must be recovered before it is read, since a run broke off, but it may not be written.
    #[error(
        "a run that broke off left these results in need of recovery, but they cannot be written ({source}); make their \
         folder writable, or copy all of it to a writable place: {}", path.display()
    )]
    Unsettled {
        /// The error of the database.
        source: rusqlite::Error,
        /// The database.
        path: PathBuf,
    },
    /// A test of this number is there already.
    #[error("test {number} is recorded already; a number is used once: {}", path.display())]
    TestExists {
        /// The number.
        number: TestNumber,
        /// The database.
        path: PathBuf,
    },
    /// There is no such test.
    #[error("no test `{name}` in these results; `list` shows all tests: {}", path.display())]
    NoSuchTest {
        /// What was asked for.
        name: String,
        /// The database.
        path: PathBuf,
    },
    /// There is no such set of results.
    #[error("no set of results `{name}`; {}: {}", known_sets(known), path.display())]
    NoSuchSet {
        /// What was asked for.
        name: String,
        /// The sets there are.
        known: Vec<String>,
        /// The database.
        path: PathBuf,
    },
    /// A test that could not be read back: a number that is not finite, a large count, or what does not fit the plan.
    #[error("test {test} cannot be recorded ({what}): {}", path.display())]
    Unrecordable {
        /// The test.
        test: TestNumber,
        /// What does not fit.
        what: String,
        /// The database.
        path: PathBuf,
    },
    /// The file system refused.
    #[error("cannot {doing}: {source}: {}", path.display())]
    Io {
        /// What was being done.
        doing: &'static str,
        /// Why it failed.
        source: std::io::Error,
        /// Where.
        path: PathBuf,
    },
    /// The database refused.
    #[error("cannot {doing}: {}: {}", refusal(source), path.display())]
    Database {
        /// What was being done.
        doing: &'static str,
        /// Why it failed.
        source: rusqlite::Error,
        /// The database.
        path: PathBuf,
    },
}

impl RecordError {
    /// A file or folder that could not be read or written, while this was being done.
    pub fn io(doing: &'static str, path: &Path, source: std::io::Error) -> Self {
        RecordError::Io { doing, source, path: path.to_owned() }
    }

    /// Sorts a failure of the database into what a user can do about it.
    pub(crate) fn database(doing: &'static str, path: &Path, source: rusqlite::Error) -> Self {
        use rusqlite::ErrorCode::{DatabaseCorrupt, NotADatabase};
        let path = path.to_owned();
        match source.sqlite_error_code() {
            Some(NotADatabase) => RecordError::Foreign { found: "not an SQLite file".to_owned(), path },
            Some(DatabaseCorrupt) => RecordError::Damaged { problem: visible(&source.to_string()), path },
            _ => RecordError::Database { doing, source, path },
        }
    }

    /// What is wrong with a file may quote it, so it is made fit to be shown.
    pub fn damaged(path: &Path, problem: impl AsRef<str>) -> Self {
        RecordError::Damaged { problem: visible(problem.as_ref()), path: path.to_owned() }
    }
}

/// The sets there are, in words; of many the first and the last.
fn known_sets(known: &[String]) -> String {
    let quoted: Vec<String> = known.iter().map(|name| format!("`{}`", visible(name))).collect();
    match quoted.as_slice() {
        [] => "there are none".to_owned(),
        [only] => format!("there is {only}"),
        [first, second, .., last] if quoted.len() > 6 => format!("there are {first}, {second}, … and {last}"),
        [most @ .., last] => format!("there are {} and {last}", most.join(", ")),
    }
}

/// What the database says; for a failed write also the most common reason, which it does not know.
fn refusal(source: &rusqlite::Error) -> String {
    use rusqlite::ffi;
    const WRITING: [std::ffi::c_int; 6] = [
        ffi::SQLITE_IOERR_WRITE,
        ffi::SQLITE_IOERR_TRUNCATE,
        ffi::SQLITE_IOERR_FSYNC,
        ffi::SQLITE_IOERR_SHMOPEN,
        ffi::SQLITE_IOERR_SHMSIZE,
        ffi::SQLITE_IOERR_SHMMAP,
    ];
    let said = visible(&source.to_string());
    match source.sqlite_error() {
        Some(error) if WRITING.contains(&error.extended_code) => {
            format!("{said} while writing; perhaps the disk is full")
        }
        _ => said,
    }
}

fn holder(pid: Option<u32>) -> String {
    pid.map_or_else(|| "another process".to_owned(), |pid| format!("process {pid}"))
}
