//! Bags of ROS 1, version 2.0, read from start to end without their index: so a bag whose recorder was killed is read
//! as well. Whether it is all there follows from the place of the index, which is written last.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, Read};
use std::path::Path;

use sesame_base::visible::visible;

use super::compressed::{self, Wrong};
use super::entry::{BLOCK, Channel, Each, Entry, LARGEST, Message, Schema};
use crate::error::RecordingError;

/// What stands before the first record.
const MAGIC: &[u8] = b"#ROSBAG V2.0\n";

/// The kinds of records that are read, by their number.
const MESSAGE: u8 = 0x02;
const HEAD: u8 = 0x03;
const CHUNK: u8 = 0x05;
const CONNECTION: u8 = 0x07;

/// The most bytes of what all connections of a file say together.
const MOST_DECLARED: usize = 1 << 26;

/// Reads a file.
pub(super) fn read(mut file: impl Read, path: &Path, each: Each<'_>) -> Result<(), RecordingError> {
    let mut magic = [0; MAGIC.len()];
    file.read_exact(&mut magic).map_err(|error| cut(path, &error))?;
    let mut reader = Reader { path, each, index: 0, told: BTreeSet::new(), size: 0 };
    let mut at = MAGIC.len() as u64;
    while let Some(header) = block(&mut file, path, true)? {
        let Some(data) = block(&mut file, path, false)? else { return Err(cut_off(path)) };
        reader.record(&header, &data, true)?;
        at += (header.len() + data.len() + 2 * size_of::<u32>()) as u64;
    }
    if reader.index == 0 || at < reader.index { Err(cut_off(path)) } else { Ok(()) }
}

fn cut_off(path: &Path) -> RecordingError {
    RecordingError::CutOff { path: path.to_owned() }
}

fn cut(path: &Path, error: &io::Error) -> RecordingError {
    if error.kind() == io::ErrorKind::UnexpectedEof { cut_off(path) } else { RecordingError::unreadable(path, error) }
}

/// Bytes behind their length; `None` at the end of the file, where it may end.
fn block(file: &mut impl Read, path: &Path, may_end: bool) -> Result<Option<Vec<u8>>, RecordingError> {
    let mut length = Vec::with_capacity(size_of::<u32>());
    file.by_ref().take(4).read_to_end(&mut length).map_err(|error| cut(path, &error))?;
    if length.is_empty() && may_end {
        return Ok(None);
    }
    let length: [u8; 4] = length.try_into().map_err(|_| cut_off(path))?;
    let length = u32::from_le_bytes(length) as usize;
    if length > LARGEST {
        let problem = format!("a record has {length} bytes");
        return Err(RecordingError::Damaged { problem, path: path.to_owned() });
    }
    // Memory for a length that may be damaged is not allocated in advance.
    let mut bytes = Vec::with_capacity(length.min(BLOCK));
    file.by_ref().take(length as u64).read_to_end(&mut bytes).map_err(|error| cut(path, &error))?;
    if bytes.len() == length { Ok(Some(bytes)) } else { Err(cut_off(path)) }
}

struct Reader<'a, 'e> {
    path: &'a Path,
    each: Each<'e>,
    /// Where the file has its index; zero before it has one.
    index: u64,
    /// The connections that were told.
    told: BTreeSet<u32>,
    /// How much they say.
    size: usize,
}

impl Reader<'_, '_> {
    fn damaged(&self, problem: impl Into<String>) -> RecordingError {
        RecordingError::Damaged { problem: problem.into(), path: self.path.to_owned() }
    }

    fn record(&mut self, header: &[u8], data: &[u8], may_be_chunk: bool) -> Result<(), RecordingError> {
        let header = fields(header).ok_or_else(|| self.damaged("the header of a record cannot be read"))?;
        let number = |name: &str| Some(u32::from_le_bytes(header.get(name.as_bytes())?.get(..4)?.try_into().ok()?));
        let text = |name: &[u8]| String::from_utf8_lossy(header.get(name).copied().unwrap_or_default()).into_owned();
        let lacks = |what: &str| self.damaged(format!("a record does not say its `{what}`"));
        match header.get(b"op".as_slice()) {
            Some([MESSAGE]) => {
                let channel = number("conn").ok_or_else(|| lacks("conn"))?;
                let nanos = || Some(u32::from_le_bytes(header.get(b"time".as_slice())?.get(4..8)?.try_into().ok()?));
                let (seconds, nanos) = number("time").zip(nanos()).ok_or_else(|| lacks("time"))?;
                let time = u64::from(seconds) * 1_000_000_000 + u64::from(nanos);
                (self.each)(Entry::Message(Message { channel, sequence: 0, time, data }))
            }
            Some([CONNECTION]) => {
                let id = number("conn").ok_or_else(|| lacks("conn"))?;
                let topic = text(b"topic");
                self.connection(id, topic, data)
            }
            Some([CHUNK]) if may_be_chunk => {
                let size = number("size").ok_or_else(|| lacks("size"))? as usize;
                let method = text(b"compression");
                self.chunk(&method, size, data)
            }
            Some([HEAD]) => {
                let index =
                    || Some(u64::from_le_bytes(header.get(b"index_pos".as_slice())?.get(..8)?.try_into().ok()?));
                self.index = index().ok_or_else(|| lacks("index_pos"))?;
                Ok(())
            }
            Some([_]) => Ok(()),
            _ => Err(lacks("op")),
        }
    }

    fn chunk(&mut self, method: &str, size: usize, data: &[u8]) -> Result<(), RecordingError> {
        if size > LARGEST {
            return Err(self.damaged(format!("a chunk has {size} bytes")));
        }
        let content = compressed::chunk(method, data, size).map_err(|wrong| match wrong {
            Wrong::Method => RecordingError::Compressed { method: visible(method), path: self.path.to_owned() },
            Wrong::Content(problem) => self.damaged(problem),
        })?;
        let mut rest = content.as_slice();
        while !rest.is_empty() {
            let header = counted(&mut rest);
            let (header, data) =
                header.zip(counted(&mut rest)).ok_or_else(|| self.damaged("a chunk ends within a record"))?;
            self.record(header, data, false)?;
        }
        Ok(())
    }

    fn connection(&mut self, id: u32, topic: String, data: &[u8]) -> Result<(), RecordingError> {
        // They are there once more at the end.
        if self.told.contains(&id) {
            return Ok(());
        }
        let said = fields(data).ok_or_else(|| self.damaged("the header of a connection cannot be read"))?;
        let text = |name: &[u8]| String::from_utf8_lossy(said.get(name).copied().unwrap_or_default()).into_owned();
        let schema = Schema { name: text(b"type"), encoding: "ros1msg".to_owned(), text: text(b"message_definition") };
        self.size = self.size.saturating_add(topic.len() + data.len());
        if self.size > MOST_DECLARED {
            return Err(self.damaged("it has too many connections"));
        }
        self.told.insert(id);
        let encoding = "ros1".to_owned();
        (self.each)(Entry::Channel(Channel { id, topic, encoding, schema: Some(schema), metadata: BTreeMap::new() }))
    }
}

/// Bytes behind their length, taken from the front.
fn counted<'a>(rest: &mut &'a [u8]) -> Option<&'a [u8]> {
    let (length, body) = rest.split_first_chunk()?;
    let (bytes, after) = body.split_at_checked(u32::from_le_bytes(*length) as usize)?;
    *rest = after;
    Some(bytes)
}

/// The fields of a header: each a length, a name, `=` and a value.
fn fields(mut header: &[u8]) -> Option<BTreeMap<&[u8], &[u8]>> {
    let mut found = BTreeMap::new();
    while !header.is_empty() {
        let field = counted(&mut header)?;
        let equals = field.iter().position(|byte| *byte == b'=')?;
        found.insert(&field[..equals], &field[equals + 1..]);
    }
    Some(found)
}
