//! MCAP files, read from start to end.
//!
//! Chunks are split here, since the library's reader trusts the lengths inside of a chunk: a damaged one would make it
//! lose its position, or panic.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;

use mcap::records::{Metadata, Record, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{McapError, McapResult, parse_record};

use sesame_base::visible::visible;

use super::compressed::{self, Wrong};
use super::entry::{BLOCK, Channel, Each, Entry, LARGEST, Message, Schema};
use crate::error::RecordingError;

/// The most bytes of all schemas and channels of a file together.
const MOST_DECLARED: usize = 1 << 26;

/// Reads a file.
pub(super) fn read(mut file: impl Read, path: &Path, each: Each<'_>) -> Result<(), RecordingError> {
    let reading = LinearReaderOptions::default()
        .with_emit_chunks(true)
        .with_validate_data_section_crc(true)
        .with_validate_summary_section_crc(true)
        .with_record_length_limit(LARGEST);
    let mut reader = LinearReader::new_with_options(reading);
    let mut declared = Declared::default();
    while let Some(event) = reader.next_event() {
        match event.map_err(|error| sorted(error, path))? {
            LinearReadEvent::ReadRequest(wanted) => {
                // Memory for a length that may be damaged is not allocated in advance.
                let block = reader.insert(wanted.min(BLOCK));
                let read = file.read(block).map_err(|error| RecordingError::unreadable(path, &error))?;
                reader.notify_read(read);
            }
            LinearReadEvent::Record { opcode, data } => {
                let mut failed = None;
                let walked = records(opcode, data, &mut |record| {
                    failed = declared.tell(record, path, each).err();
                    failed.is_none()
                });
                walked.map_err(|error| sorted(error, path))?;
                failed.map_or(Ok(()), Err)?;
            }
        }
    }
    Ok(())
}

/// What a file has declared until now. Files may say it again in each chunk.
#[derive(Default)]
struct Declared {
    schemas: BTreeMap<u16, Schema>,
    channels: BTreeMap<u16, Channel>,
    size: usize,
}

impl Declared {
    fn tell(&mut self, record: Record<'_>, path: &Path, each: Each<'_>) -> Result<(), RecordingError> {
        match record {
            Record::Metadata(Metadata { name, metadata }) => each(Entry::Metadata(name, metadata)),
            Record::Schema { header, data } => {
                let text = String::from_utf8_lossy(&data).into_owned();
                let schema = Schema { name: header.name, encoding: header.encoding, text };
                if self.schemas.get(&header.id) != Some(&schema) {
                    self.grow(schema.name.len() + schema.text.len(), path)?;
                    self.schemas.insert(header.id, schema);
                }
                Ok(())
            }
            Record::Channel(channel) => {
                let told = Channel {
                    id: channel.id.into(),
                    topic: channel.topic,
                    encoding: channel.message_encoding,
                    schema: self.schemas.get(&channel.schema_id).cloned(),
                    metadata: channel.metadata,
                };
                if self.channels.get(&channel.id) == Some(&told) {
                    return Ok(());
                }
                let schema = told.schema.as_ref().map_or(0, |schema| schema.name.len() + schema.text.len());
                let said: usize = told.metadata.iter().map(|(key, value)| key.len() + value.len()).sum();
                self.grow(told.topic.len() + schema + said, path)?;
                self.channels.insert(channel.id, told.clone());
                each(Entry::Channel(told))
            }
            Record::Message { header, data } => each(Entry::Message(Message {
                channel: header.channel_id.into(),
                sequence: header.sequence,
                time: header.log_time,
                data: &data,
            })),
            _ => Ok(()),
        }
    }

    fn grow(&mut self, by: usize, path: &Path) -> Result<(), RecordingError> {
        self.size = self.size.saturating_add(by);
        if self.size > MOST_DECLARED {
            let problem = "it has too many schemas".to_owned();
            return Err(RecordingError::Damaged { problem, path: path.to_owned() });
        }
        Ok(())
    }
}

/// Converts a problem with a file into an error with a remedy.
fn sorted(error: McapError, path: &Path) -> RecordingError {
    match error {
        McapError::BadMagic => RecordingError::Foreign { path: path.to_owned() },
        McapError::UnexpectedEof => RecordingError::CutOff { path: path.to_owned() },
        McapError::UnsupportedCompression(method) => {
            RecordingError::Compressed { method: visible(&method), path: path.to_owned() }
        }
        McapError::Io(error) => RecordingError::unreadable(path, &error),
        McapError::DecompressionError(problem) => RecordingError::Damaged { problem, path: path.to_owned() },
        other => RecordingError::Damaged { problem: visible(&other.to_string()), path: path.to_owned() },
    }
}

/// The contents of a record, one after another until one is refused: all records of a chunk in order, or the record
/// itself. Kinds that nobody here reads are left out.
///
/// A chunk that is not complete in length, or has a wrong checksum, is an error.
pub(crate) fn records(opcode: u8, data: &[u8], each: &mut dyn FnMut(Record<'_>) -> bool) -> McapResult<()> {
    if opcode != op::CHUNK {
        if let Some(record) = known(opcode, data)? {
            each(record);
        }
        return Ok(());
    }
    let Record::Chunk { header, .. } = parse_record(opcode, data)? else { return Ok(()) };
    // The records are the last part of a chunk.
    let length = usize::try_from(header.compressed_size).map_err(|_| McapError::UnexpectedEoc)?;
    let start = data.len().checked_sub(length).ok_or(McapError::UnexpectedEoc)?;
    let stored = &data[start..];
    let unpacked;
    let mut rest = if header.compression.is_empty() {
        stored
    } else {
        let size = usize::try_from(header.uncompressed_size).ok().filter(|size| *size <= LARGEST);
        let size = size.ok_or(McapError::ChunkTooLarge(header.uncompressed_size))?;
        unpacked = compressed::chunk(&header.compression, stored, size).map_err(|wrong| match wrong {
            Wrong::Method => McapError::UnsupportedCompression(header.compression),
            Wrong::Content(problem) => McapError::DecompressionError(problem),
        })?;
        &unpacked
    };
    if header.uncompressed_crc != 0 {
        let calculated = crc32fast::hash(rest);
        if calculated != header.uncompressed_crc {
            return Err(McapError::BadChunkCrc { saved: header.uncompressed_crc, calculated });
        }
    }
    while !rest.is_empty() {
        let (head, body) = rest.split_at_checked(1 + size_of::<u64>()).ok_or(McapError::UnexpectedEoc)?;
        let length = head[1..].iter().rev().fold(0u64, |length, &byte| length << 8 | u64::from(byte));
        let length = usize::try_from(length).map_err(|_| McapError::UnexpectedEoc)?;
        let (body, after) = body.split_at_checked(length).ok_or(McapError::UnexpectedEoc)?;
        if !known(head[0], body)?.is_none_or(&mut *each) {
            break;
        }
        rest = after;
    }
    Ok(())
}

fn known(opcode: u8, data: &[u8]) -> McapResult<Option<Record<'_>>> {
    match opcode {
        op::SCHEMA | op::CHANNEL | op::MESSAGE | op::METADATA => parse_record(opcode, data).map(Some),
        _ => Ok(None),
    }
}
