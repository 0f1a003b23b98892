//! Files with recordings: whatever their format, a sequence of entries.

mod bag;
mod compressed;
#[cfg(feature = "db3")]
mod db3;
mod entry;
mod folder;
pub(crate) mod mcap;

use std::fs::File;
use std::io::{self, BufReader, Chain, Cursor, Read, Seek as _, SeekFrom};
use std::path::Path;

use crate::error::RecordingError;

use entry::BLOCK;
#[cfg(feature = "db3")]
use entry::LARGEST;
pub(crate) use entry::{Channel, Each, Entry, Message, Schema};

/// How many times larger than the file what is compressed in it may be.
#[cfg(feature = "db3")]
const MOST_GROWTH: u64 = 1000;

/// What stands at the beginning of a file that tells its format.
const HEAD: usize = 16;

/// Reads a recording from start to end: a file of any format, or a folder of rosbag2.
///
/// If a file is cut off or damaged, everything before is told, and then it is an error.
pub(crate) fn read(path: &Path, each: Each<'_>) -> Result<(), RecordingError> {
    if let Some(folder) = folder::of(path) {
        return folder::files(folder)?.iter().try_for_each(|file| one(file, each));
    }
    one(path, each)
}

/// The formats of files, by how they begin.
#[derive(Clone, Copy)]
enum Format {
    Mcap,
    Sqlite,
    Bag,
    OldBag,
    Zstd,
}

const FORMATS: [(&[u8], Format); 5] = [
    (b"\x89MCAP", Format::Mcap),
    (b"SQLite format 3\0", Format::Sqlite),
    (b"#ROSBAG V2.0\n", Format::Bag),
    (b"#ROSBAG", Format::OldBag),
    (&compressed::ZSTD, Format::Zstd),
];

fn one(path: &Path, each: Each<'_>) -> Result<(), RecordingError> {
    let unreadable = |error: io::Error| RecordingError::unreadable(path, &error);
    let mut file = File::open(path).map_err(unreadable)?;
    let head = head(&mut file).map_err(unreadable)?;
    each(Entry::File)?;
    match format(&head, path)? {
        Format::Zstd => {
            file.seek(SeekFrom::Start(0)).map_err(unreadable)?;
            let mut content = compressed::file(BufReader::with_capacity(BLOCK, file));
            let head = self::head(&mut content).map_err(unreadable)?;
            let format = format(&head, path)?;
            content_of(format, &head, content, path, each)
        }
        Format::Sqlite => sqlite(path, path, each),
        other => content_of(other, &head, file, path, each),
    }
}

/// Reads what begins with these bytes and goes on with those.
fn content_of(format: Format, head: &[u8], rest: impl Read, path: &Path, each: Each<'_>) -> Result<(), RecordingError> {
    let mut whole: Chain<Cursor<&[u8]>, _> = Cursor::new(head).chain(rest);
    match format {
        Format::Mcap => mcap::read(BufReader::with_capacity(BLOCK, whole), path, each),
        Format::Bag => bag::read(BufReader::with_capacity(BLOCK, whole), path, each),
        Format::Sqlite => unpacked(&mut whole, path, each),
        Format::OldBag => {
            let problem = "a bag of ROS 1 before version 2.0; `rosbag fix` converts it".to_owned();
            Err(RecordingError::Unsupported { problem, path: path.to_owned() })
        }
        Format::Zstd => Err(RecordingError::Foreign { path: path.to_owned() }),
    }
}

#[cfg(feature = "db3")]
fn sqlite(file: &Path, path: &Path, each: Each<'_>) -> Result<(), RecordingError> {
    db3::read(file, path, each)
}

/// SQLite needs a file.
#[cfg(feature = "db3")]
fn unpacked(content: &mut dyn Read, path: &Path, each: Each<'_>) -> Result<(), RecordingError> {
    let unreadable = |error: io::Error| RecordingError::unreadable(path, &error);
    let packed = std::fs::metadata(path).map_err(unreadable)?.len();
    // A few bytes cannot fill the disk.
    let most = packed.saturating_mul(MOST_GROWTH).saturating_add(LARGEST as u64);
    let mut file = tempfile::NamedTempFile::new().map_err(unreadable)?;
    if io::copy(&mut content.take(most), &mut file).map_err(unreadable)? == most {
        let problem = format!("it grows to more than {MOST_GROWTH} times its size");
        return Err(RecordingError::Damaged { problem, path: path.to_owned() });
    }
    sqlite(file.path(), path, each)
}

#[cfg(not(feature = "db3"))]
fn sqlite(_: &Path, path: &Path, _: Each<'_>) -> Result<(), RecordingError> {
    let problem = "a recording in SQLite, which this program does not read; `sesamec replay-recording` does, and \
                   `ros2 bag convert` makes it MCAP"
        .to_owned();
    Err(RecordingError::Unsupported { problem, path: path.to_owned() })
}

#[cfg(not(feature = "db3"))]
fn unpacked(_: &mut dyn Read, path: &Path, each: Each<'_>) -> Result<(), RecordingError> {
    sqlite(path, path, each)
}

/// The first bytes of a file.
fn head(file: &mut impl Read) -> io::Result<Vec<u8>> {
    let mut head = Vec::with_capacity(HEAD);
    file.take(HEAD as u64).read_to_end(&mut head)?;
    Ok(head)
}

fn format(head: &[u8], path: &Path) -> Result<Format, RecordingError> {
    if head.is_empty() {
        return Err(RecordingError::CutOff { path: path.to_owned() });
    }
    let found = FORMATS.iter().find(|(start, _)| head.starts_with(start)).map(|(_, format)| *format);
    found.ok_or_else(|| RecordingError::Foreign { path: path.to_owned() })
}

#[cfg(test)]
mod tests;
