//! Why recordings cannot be read, in words with a remedy.

use std::io;
use std::path::{Path, PathBuf};

use sesame_base::time::SimTime;

/// Why a recording cannot be fed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// The file cannot be read.
    #[error("cannot read the recording: {reason}: {}", path.display())]
    Unreadable {
        /// The reason.
        reason: String,
        /// The file.
        path: PathBuf,
    },
    /// It is no recording.
    #[error(
        "this is no recording that can be read: MCAP, `.db3` or a folder of rosbag2, or a `.bag` of ROS 1: {}",
        path.display()
    )]
    Foreign {
        /// The file.
        path: PathBuf,
    },
    /// It is a recording, but of a kind that cannot be read here.
    #[error("this is {problem}: {}", path.display())]
    Unsupported {
        /// What it is, with the remedy.
        problem: String,
        /// The file.
        path: PathBuf,
    },
    /// It is truncated.
    #[error(
        "this recording is cut off; `mcap recover`, `ros2 bag reindex` and `rosbag reindex` save what is in it: {}",
        path.display()
    )]
    CutOff {
        /// The file.
        path: PathBuf,
    },
    /// Its content contradicts itself, or violates the format.
    #[error("this recording is damaged ({problem}); restore the file from a copy, or record it again: {}", path.display())]
    Damaged {
        /// The problem.
        problem: String,
        /// The file.
        path: PathBuf,
    },
    /// There is more in it than memory is there for.
    #[error("this recording is too long: {problem}; cut it into parts: {}", path.display())]
    TooLong {
        /// What there is too much of.
        problem: String,
        /// The file.
        path: PathBuf,
    },
    /// Its chunks are compressed by a method that is not known.
    #[error(
        "this recording is compressed by `{method}`, which is none of `zstd`, `lz4` and `bz2`: write it with one of \
         them, or without, such as by `mcap compress --compression zstd IN.mcap -o OUT.mcap`: {}", path.display()
    )]
    Compressed {
        /// The method.
        method: String,
        /// The file.
        path: PathBuf,
    },
    /// A topic of the space is recorded in an encoding that is not known.
    #[error(
        "topic `{topic}` is recorded as `{encoding}`; only `cdr`, `ros1` and `json` can be read: {}", path.display()
    )]
    Encoding {
        /// The topic.
        topic: String,
        /// Its encoding.
        encoding: String,
        /// The file.
        path: PathBuf,
    },
    /// The layout of a topic's messages is not known.
    #[error("the messages on `{topic}` cannot be read: {reason}: {}", path.display())]
    Layout {
        /// The topic.
        topic: String,
        /// The reason, with the remedy.
        reason: String,
        /// The file.
        path: PathBuf,
    },
    /// None of its topics is one of the space.
    #[error("none of the space's topics is in this recording; it has {}: {}", listed(found), path.display())]
    NoTopics {
        /// Topics it has.
        found: Vec<String>,
        /// The file.
        path: PathBuf,
    },
    /// A message is not of the type that the space declares.
    #[error("a message on `{topic}` at {time} is not of its declared type: {reason}: {}", path.display())]
    WrongType {
        /// The topic.
        topic: String,
        /// The time.
        time: SimTime,
        /// The mismatch.
        reason: String,
        /// The file.
        path: PathBuf,
    },
    /// Messages are not in order of time.
    #[error(
        "a message on `{topic}` is much earlier than one before it in the file: put them in order, such as with \
         `mcap sort`: {}", path.display()
    )]
    OutOfOrder {
        /// The topic.
        topic: String,
        /// The file.
        path: PathBuf,
    },
}

impl RecordingError {
    /// A file that cannot be read, or cannot be decompressed.
    pub(crate) fn unreadable(path: &Path, error: &io::Error) -> Self {
        let path = path.to_owned();
        match error.kind() {
            io::ErrorKind::InvalidData => RecordingError::Damaged { problem: error.to_string(), path },
            io::ErrorKind::UnexpectedEof => RecordingError::CutOff { path },
            _ => RecordingError::Unreadable { reason: error.to_string(), path },
        }
    }

    /// Whether what came before the place of the error can be used all the same; in words.
    pub(crate) fn damage(&self) -> Option<String> {
        match self {
            RecordingError::CutOff { .. } => Some("the recording is cut off".to_owned()),
            RecordingError::Damaged { problem, .. } => Some(format!("the recording is damaged ({problem})")),
            _ => None,
        }
    }
}

/// At most a few names, so that a file cannot fill a terminal.
fn listed(found: &[String]) -> String {
    const SHOWN: usize = 8;
    let mut names: Vec<String> = found.iter().take(SHOWN).map(|name| format!("`{}`", name.escape_debug())).collect();
    if found.len() > SHOWN {
        names.push(format!("{} more", found.len() - SHOWN));
    }
    if names.is_empty() { "none at all".to_owned() } else { names.join(", ") }
}
