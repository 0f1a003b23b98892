//! The names of files in a run's folder.

use std::path::{Path, PathBuf};

use sesame_base::test_number::TestNumber;

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
    folder.join(TRACES).join(format!("{}.mcap", TestNumber(test)))
}
