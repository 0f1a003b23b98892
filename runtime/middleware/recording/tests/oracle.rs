//! Recordings that others wrote, beside another reader of them.
//!
//! `SESAME_ROS2_CYCLONE` names a Python with rosbags, `SESAME_BAGS` a folder with recordings.

#![expect(clippy::unwrap_used, reason = "a test ends where something is missing")]
#![expect(clippy::disallowed_methods, reason = "it looks for recordings")]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde_json::Value as Json;
use sesame_peers::named;
use sesame_peers::oracle::{each_line, is};
use sesame_recording::messages;
use sesame_relay::value::Value;

const ORACLE: &str = "ros2/recordings_oracle.py";

/// A line of it.
#[derive(Deserialize)]
struct Line {
    recording: PathBuf,
    topic: String,
    time: u64,
    fields: Option<Json>,
}

/// The messages of each topic, in order of time.
type Topics<T> = BTreeMap<String, Vec<(u64, T)>>;

fn in_order<T>(mut topics: Topics<T>) -> Topics<T> {
    topics.values_mut().for_each(|messages| messages.sort_by_key(|(time, _)| *time));
    topics
}

fn ours(path: &Path) -> Topics<Result<Value, String>> {
    let mut topics: Topics<_> = BTreeMap::new();
    messages(path, &[], &mut |message| {
        topics.entry(message.topic.to_owned()).or_default().push((message.time, message.value));
    })
    .unwrap_or_else(|error| panic!("{error}"));
    in_order(topics)
}

/// Reads what the oracle reads, and returns how many messages were compared.
fn compare(python: &Path, arguments: &[&str]) -> usize {
    let mut recordings: BTreeMap<PathBuf, Topics<Json>> = BTreeMap::new();
    each_line(python, ORACLE, arguments, |line: &Line| {
        let topics = recordings.entry(line.recording.clone()).or_default();
        let fields = line.fields.clone().unwrap_or_default();
        topics.entry(line.topic.clone()).or_default().push((line.time, fields));
    });
    let mut compared = 0;
    for (path, theirs) in recordings {
        let (theirs, ours) = (in_order(theirs), ours(&path));
        assert!(theirs.keys().eq(ours.keys()), "{}: {:?} and {:?}", path.display(), theirs.keys(), ours.keys());
        for ((topic, theirs), ours) in theirs.iter().zip(ours.values()) {
            let place = format!("{} {topic}", path.display());
            assert_eq!(theirs.len(), ours.len(), "{place}");
            for ((their_time, fields), (our_time, value)) in theirs.iter().zip(ours) {
                assert_eq!(their_time, our_time, "{place}");
                if fields.is_null() {
                    continue;
                }
                let value = match value {
                    Ok(value) => value,
                    // Numbers that Sesame does not have.
                    Err(error) if error.ends_with("too large for a whole number of 64 bits with a sign") => continue,
                    Err(error) => panic!("{place}: {error}"),
                };
                assert!(is(value, fields), "{place}: {value:?}, not {fields}");
                compared += 1;
            }
        }
    }
    compared
}

#[test]
fn recordings_of_all_kinds_are_read_as_rosbags_reads_them() {
    let Some(python) = named("SESAME_ROS2_CYCLONE") else { return };
    let folder = tempfile::tempdir().unwrap();
    let compared = compare(&python, &["write", folder.path().to_str().unwrap(), "30", "7"]);
    assert_eq!(compared, 6 * (30 + 10) + 3 * 10);
}

/// All recordings below a folder: files, and folders with `metadata.yaml`.
fn below(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
        if path.is_dir() {
            if path.join("metadata.yaml").is_file() {
                found.push(path.clone());
            }
            below(&path, found);
        } else if ["mcap", "db3", "bag", "zstd"].contains(&ending) {
            found.push(path);
        }
    }
}

#[test]
fn recordings_of_other_projects_are_read_completely() {
    let Some(folder) = std::env::var_os("SESAME_BAGS") else {
        eprintln!("skipped: SESAME_BAGS names no folder with recordings");
        return;
    };
    let mut found = Vec::new();
    below(Path::new(&folder), &mut found);
    found.sort();
    assert!(!found.is_empty(), "there are no recordings below {}", Path::new(&folder).display());
    let (mut read, mut unknown) = (0, BTreeMap::new());
    for path in &found {
        let mut told = 0;
        let whole = messages(path, &[], &mut |message| {
            told += 1;
            if let Err(reason) = message.value {
                *unknown.entry(format!("{} {}: {reason}", path.display(), message.topic)).or_insert(0) += 1;
            }
        });
        whole.unwrap_or_else(|error| panic!("{error}"));
        read += told;
    }
    println!("{read} messages of {} recordings; not decoded: {unknown:#?}", found.len());
    let Some(python) = named("SESAME_ROS2_CYCLONE") else { return };
    let folders: Vec<&str> = found.iter().filter(|path| path.is_dir()).map(|path| path.to_str().unwrap()).collect();
    let arguments: Vec<&str> = std::iter::once("read").chain(folders).collect();
    let compared = compare(&python, &arguments);
    println!("{compared} of them compared with rosbags");
}
