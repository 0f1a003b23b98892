//! Folders of rosbag2: several files with messages, one after another, and `metadata.yaml`.

use std::fs;
use std::path::{Path, PathBuf};

use crate::error::RecordingError;

/// The file that says which files belong to the recording.
const METADATA: &str = "metadata.yaml";

/// Larger ones are not read.
const LARGEST: u64 = 1 << 24;

/// What ends the names of files with messages.
const ENDINGS: [&str; 4] = [".mcap", ".db3", ".mcap.zstd", ".db3.zstd"];

/// The folder that is meant, if it is one: it may be named by its `metadata.yaml`.
pub(super) fn of(path: &Path) -> Option<&Path> {
    if path.is_dir() {
        return Some(path);
    }
    let folder = path.parent().filter(|_| path.file_name().is_some_and(|name| name == METADATA))?;
    Some(if folder.as_os_str().is_empty() { Path::new(".") } else { folder })
}

/// The files of a folder, in their order in time: those that `metadata.yaml` names. Without it, because the recorder
/// was killed, all that there are.
pub(super) fn files(folder: &Path) -> Result<Vec<PathBuf>, RecordingError> {
    let unreadable = |error| RecordingError::unreadable(folder, &error);
    let metadata = folder.join(METADATA);
    let named = if metadata.is_file() {
        if fs::metadata(&metadata).map_err(unreadable)?.len() > LARGEST {
            let problem = format!("{METADATA} is too large");
            return Err(RecordingError::Damaged { problem, path: folder.to_owned() });
        }
        named(&String::from_utf8_lossy(&fs::read(&metadata).map_err(unreadable)?))
    } else {
        Vec::new()
    };
    // A file that is named as it was before it was compressed, or by a path of the machine where it was recorded.
    let mut files: Vec<PathBuf> = Vec::new();
    for name in named {
        let here = |name: &str| Some(folder.join(name)).filter(|file| file.is_file());
        let last = name.rsplit('/').next().unwrap_or_default();
        let file = here(&name).or_else(|| here(last)).or_else(|| here(&format!("{last}.zstd")));
        let problem = || format!("{METADATA} names `{}`, which is not there", name.escape_debug());
        files.push(file.ok_or_else(|| RecordingError::Damaged { problem: problem(), path: folder.to_owned() })?);
    }
    if files.is_empty() {
        files = all(folder)?;
    }
    if files.is_empty() { Err(RecordingError::Foreign { path: folder.to_owned() }) } else { Ok(files) }
}

/// All files with messages, in the order of the numbers in their names.
fn all(folder: &Path) -> Result<Vec<PathBuf>, RecordingError> {
    let unreadable = |error| RecordingError::unreadable(folder, &error);
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).map_err(unreadable)? {
        let file = entry.map_err(unreadable)?.path();
        let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if ENDINGS.iter().any(|ending| name.ends_with(ending)) {
            found.push((numbered(&name), file));
        }
    }
    found.sort();
    Ok(found.into_iter().map(|(_, file)| file).collect())
}

/// A name by which `bag_10` comes after `bag_9`.
fn numbered(name: &str) -> (String, u64, String) {
    let stem = name.split('.').next().unwrap_or_default();
    let digits = stem.bytes().rev().take_while(u8::is_ascii_digit).count();
    let (before, number) = stem.split_at(stem.len() - digits);
    (before.to_owned(), number.parse().unwrap_or(0), name.to_owned())
}

/// The files that the text names, in `relative_file_paths`: a list, a line for each.
fn named(text: &str) -> Vec<String> {
    let mut lines = text.lines().skip_while(|line| line.trim() != "relative_file_paths:").skip(1);
    let items = lines.by_ref().map_while(|line| line.trim_start().strip_prefix("- "));
    items.map(|item| item.trim().trim_matches(['"', '\'']).to_owned()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_files_of_a_folder_come_in_the_order_of_its_metadata_or_of_their_numbers() {
        let folder = tempfile::tempdir().unwrap();
        let of = |name: &str| folder.path().join(name);
        for name in ["bag_10.mcap", "bag_9.mcap", "bag_2.db3.zstd", "notes.txt"] {
            fs::write(of(name), "").unwrap();
        }
        assert_eq!(files(folder.path()).unwrap(), [of("bag_2.db3.zstd"), of("bag_9.mcap"), of("bag_10.mcap")]);
        let metadata = "rosbag2_bagfile_information:\n  relative_file_paths:\n    - bag_9.mcap\n    - \"/home/x/bag_2.db3\"\n  files:\n    - path: other\n";
        fs::write(of(METADATA), metadata).unwrap();
        assert_eq!(files(folder.path()).unwrap(), [of("bag_9.mcap"), of("bag_2.db3.zstd")]);
        assert_eq!(super::of(&of(METADATA)), Some(folder.path()));
        fs::write(of(METADATA), metadata.replace("bag_9", "bag_8")).unwrap();
        let said = files(folder.path()).unwrap_err().to_string();
        assert!(said.contains("names `bag_8.mcap`, which is not there"), "{said}");
    }

    #[test]
    fn a_folder_without_a_recording_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        assert!(matches!(files(folder.path()), Err(RecordingError::Foreign { .. })));
    }
}
