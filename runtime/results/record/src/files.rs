//! The names of files in a run's folder.

#![expect(clippy::disallowed_methods, reason = "an adapter: it looks for files")]

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

/// What may stand behind the name of a test whose recording is in the folder of traces: that of its trace, and those of
/// recordings that people put there. The one without an ending is a folder.
const RECORDINGS: [&str; 6] = [".mcap", "", ".db3", ".bag", ".mcap.zstd", ".db3.zstd"];

/// Where a runner writes the trace of a test, in the results in this folder.
pub fn trace_file(folder: &Path, test: u32) -> PathBuf {
    folder.join(TRACES).join(format!("{}.mcap", TestNumber(test)))
}

/// The recording of a test, in the results in this folder: its trace, or what people put in its place, such as `T3.bag`
/// or a folder of rosbag2 with the name `T3`.
pub fn recording(folder: &Path, test: u32) -> Option<PathBuf> {
    let traces = folder.join(TRACES);
    let named = RECORDINGS.iter().map(|ending| traces.join(format!("{}{ending}", TestNumber(test))));
    named.into_iter().find(|path| path.exists())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_recording_of_a_test_may_be_of_any_kind_and_its_trace_comes_first() {
        let folder = tempfile::tempdir().unwrap();
        let traces = folder.path().join(TRACES);
        std::fs::create_dir(&traces).unwrap();
        assert_eq!(recording(folder.path(), 3), None);
        std::fs::write(traces.join("T3.bag"), "").unwrap();
        std::fs::write(traces.join("T31.mcap"), "").unwrap();
        assert_eq!(recording(folder.path(), 3), Some(traces.join("T3.bag")));
        std::fs::create_dir(traces.join("T3")).unwrap();
        assert_eq!(recording(folder.path(), 3), Some(traces.join("T3")));
        std::fs::write(traces.join("T3.mcap"), "").unwrap();
        assert_eq!(recording(folder.path(), 3), Some(trace_file(folder.path(), 3)));
    }
}
