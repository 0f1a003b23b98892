//! Recovers the part of a trace that was written before its process died.

use std::fs::{self, File};
use std::io::{BufWriter, Read as _};
use std::path::Path;

use mcap::records::{Metadata, Record, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{McapError, McapResult, Writer, parse_record};

use sesame_base::observation::Outcome;

use crate::container::mcap::records;
use crate::trace::writer::{finish, options};
use crate::trace::{RUN, TraceError, how_it_ended, publish};

/// The largest record and chunk that is read; ours are far smaller.
const LIMIT: usize = 1 << 28;

/// Makes a trace of the contents of an unfinished one, up to its last complete chunk, and gives it this name, in a
/// folder that exists. Without an unfinished trace it does nothing. The unfinished trace is removed.
pub fn recover(unfinished: &Path, outcome: &Outcome, file: &Path) -> Result<(), TraceError> {
    if !unfinished.exists() {
        return Ok(());
    }
    let saved = unfinished.with_extension("saved");
    copy(unfinished, outcome, &saved).map_err(|error| TraceError::new(&saved, error))?;
    publish(&saved, file)?;
    fs::remove_file(unfinished).map_err(|error| TraceError::new(unfinished, error.into()))
}

fn copy(unfinished: &Path, outcome: &Outcome, saved: &Path) -> McapResult<()> {
    let mut file = File::open(unfinished)?;
    // It begins with its profile, if it begins at all.
    let mut started: Option<Writer<BufWriter<File>>> = None;
    let start = |profile: &str| -> McapResult<_> { options(profile).create(BufWriter::new(File::create(saved)?)) };
    // Only complete chunks are read.
    let reading =
        LinearReaderOptions::default().with_skip_end_magic(true).with_emit_chunks(true).with_record_length_limit(LIMIT);
    let mut reader = LinearReader::new_with_options(reading);
    while let Some(event) = reader.next_event() {
        match event {
            Ok(LinearReadEvent::ReadRequest(wanted)) => {
                let read = file.read(reader.insert(wanted))?;
                reader.notify_read(read);
            }
            // The first error is where the process died.
            Ok(LinearReadEvent::Record { opcode: op::HEADER, data }) => {
                match (parse_record(op::HEADER, data), &started) {
                    (Ok(Record::Header(header)), None) => started = Some(start(&header.profile)?),
                    _ => break,
                }
            }
            Ok(LinearReadEvent::Record { opcode, data }) => {
                let Some(writer) = &mut started else { break };
                let mut found = Vec::new();
                // A chunk counts as a whole or not at all.
                let whole = records(opcode, data, &mut |record| {
                    found.push(record.into_owned());
                    true
                });
                if whole.is_err() {
                    break;
                }
                found.iter().try_for_each(|record| copy_record(writer, record))?;
            }
            Err(McapError::Io(error)) => return Err(error.into()),
            Err(_) => break,
        }
    }
    let mut writer = match started {
        Some(writer) => writer,
        None => start("")?,
    };
    writer.write_metadata(&Metadata { name: RUN.to_owned(), metadata: how_it_ended(outcome) })?;
    finish(writer)
}

fn copy_record(writer: &mut Writer<BufWriter<File>>, record: &Record<'_>) -> McapResult<()> {
    match record {
        Record::Schema { header, data } => {
            writer.add_schema_with_id(header.id, &header.name, &header.encoding, data).map(drop)
        }
        Record::Channel(channel) => writer
            .add_channel_with_id(
                channel.id,
                channel.schema_id,
                &channel.topic,
                &channel.message_encoding,
                &channel.metadata,
            )
            .map(drop),
        Record::Message { header, data } => writer.write_to_known_channel(header, data),
        Record::Metadata(metadata) => writer.write_metadata(metadata),
        _ => Ok(()),
    }
}
