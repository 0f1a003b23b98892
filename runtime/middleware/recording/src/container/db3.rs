//! Recordings of rosbag2 in SQLite.

use std::collections::BTreeMap;
use std::path::Path;

use rusqlite::types::ValueRef;
use rusqlite::{Connection, OpenFlags, Row, ffi};

use sesame_base::visible::visible;

use super::compressed::{self, ZSTD};
use super::entry::{Channel, Each, Entry, LARGEST, Message, Schema};
use crate::error::RecordingError;

/// The most topics of a file.
const MOST_TOPICS: usize = 1 << 16;

/// The most bytes of all definitions and names of a file together.
const MOST_DECLARED: usize = 1 << 26;

/// Reads a file, in the order of its messages' times. The path is that which the user knows.
pub(super) fn read(file: &Path, path: &Path, each: Each<'_>) -> Result<(), RecordingError> {
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let failed = |error: rusqlite::Error| sorted(&error, path);
    let database = Connection::open_with_flags(file, flags).map_err(failed)?;
    // Nothing that the file itself declares is carried out: no functions in views, no triggers.
    database.execute_batch("PRAGMA trusted_schema = OFF; PRAGMA cell_size_check = ON;").map_err(failed)?;
    let tables = tables(&database).map_err(failed)?;
    let has = |name: &str| tables.iter().any(|table| table == name);
    if !has("topics") || !has("messages") {
        return Err(RecordingError::Foreign { path: path.to_owned() });
    }
    let schemas = if has("message_definitions") { definitions(&database, path)? } else { BTreeMap::new() };
    for channel in topics(&database, &schemas, path)? {
        each(Entry::Channel(channel))?;
    }
    messages(&database, path, each)
}

fn tables(database: &Connection) -> rusqlite::Result<Vec<String>> {
    let mut asked = database.prepare("SELECT name FROM sqlite_master WHERE type = 'table' LIMIT 100")?;
    asked.query_map((), |row| text(row, 0))?.collect()
}

/// Text, whatever is there.
fn text(row: &Row<'_>, at: usize) -> rusqlite::Result<String> {
    Ok(match row.get_ref(at)? {
        ValueRef::Text(text) | ValueRef::Blob(text) => String::from_utf8_lossy(text).into_owned(),
        ValueRef::Integer(number) => number.to_string(),
        ValueRef::Null | ValueRef::Real(_) => String::new(),
    })
}

fn too_much(path: &Path) -> RecordingError {
    RecordingError::Damaged { problem: "it has too many topics or definitions".to_owned(), path: path.to_owned() }
}

/// The definitions by the types that they are of.
fn definitions(database: &Connection, path: &Path) -> Result<BTreeMap<String, Schema>, RecordingError> {
    let failed = |error: rusqlite::Error| sorted(&error, path);
    let mut asked = database
        .prepare(&format!(
            "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions \
             WHERE length(encoded_message_definition) <= {MOST_DECLARED}"
        ))
        .map_err(failed)?;
    let mut rows = asked.query(()).map_err(failed)?;
    let (mut found, mut size) = (BTreeMap::new(), 0);
    while let Some(row) = rows.next().map_err(failed)? {
        let column = |at| text(row, at).map_err(failed);
        let schema = Schema { name: column(0)?, encoding: column(1)?, text: column(2)? };
        size += schema.name.len() + schema.text.len();
        if size > MOST_DECLARED {
            return Err(too_much(path));
        }
        if schema.encoding != "unknown" {
            found.insert(schema.name.clone(), schema);
        }
    }
    Ok(found)
}

fn topics(
    database: &Connection,
    schemas: &BTreeMap<String, Schema>,
    path: &Path,
) -> Result<Vec<Channel>, RecordingError> {
    let failed = |error: rusqlite::Error| sorted(&error, path);
    let mut asked =
        database.prepare("SELECT id, name, type, serialization_format FROM topics ORDER BY id").map_err(failed)?;
    let mut rows = asked.query(()).map_err(failed)?;
    let (mut found, mut size) = (Vec::new(), 0);
    while let Some(row) = rows.next().map_err(failed)? {
        let column = |at| text(row, at).map_err(failed);
        let id: i64 = row.get(0).map_err(failed)?;
        let Ok(id) = u32::try_from(id) else { continue };
        let ty = column(2)?;
        // An event of a service is defined by its service.
        let schema = schemas.get(&ty).or_else(|| schemas.get(ty.strip_suffix("_Event")?));
        let of_type = |text: String, encoding: String| Schema { name: ty.clone(), encoding, text };
        let schema = schema.map_or_else(
            || of_type(String::new(), String::new()),
            |schema| of_type(schema.text.clone(), schema.encoding.clone()),
        );
        let channel =
            Channel { id, topic: column(1)?, encoding: column(3)?, schema: Some(schema), metadata: BTreeMap::new() };
        size += channel.topic.len() + channel.schema.as_ref().map_or(0, |schema| schema.text.len());
        if found.len() >= MOST_TOPICS || size > MOST_DECLARED {
            return Err(too_much(path));
        }
        found.push(channel);
    }
    Ok(found)
}

fn messages(database: &Connection, path: &Path, each: Each<'_>) -> Result<(), RecordingError> {
    let failed = |error: rusqlite::Error| sorted(&error, path);
    // Messages that are too large are not loaded, but known.
    let mut asked = database
        .prepare(&format!(
            "SELECT topic_id, timestamp, CASE WHEN length(data) <= {LARGEST} THEN data END FROM messages \
             ORDER BY timestamp, id"
        ))
        .map_err(failed)?;
    let mut rows = asked.query(()).map_err(failed)?;
    while let Some(row) = rows.next().map_err(failed)? {
        let damaged = |problem: &str| RecordingError::Damaged { problem: problem.to_owned(), path: path.to_owned() };
        let (ValueRef::Integer(topic), ValueRef::Integer(time)) =
            (row.get_ref(0).map_err(failed)?, row.get_ref(1).map_err(failed)?)
        else {
            return Err(damaged("a message has no topic or no time"));
        };
        let (ValueRef::Blob(data) | ValueRef::Text(data)) = row.get_ref(2).map_err(failed)? else {
            return Err(damaged("a message is too large or has no content"));
        };
        let channel = u32::try_from(topic).map_err(|_| damaged("a message has no topic"))?;
        let time = u64::try_from(time).map_err(|_| damaged("a message is from before 1970"))?;
        // Compressed message by message; no message in CDR begins so.
        let unpacked;
        let data = if data.starts_with(&ZSTD) {
            let wrong = |error| damaged(&format!("a message cannot be decompressed: {error}"));
            unpacked = compressed::message(data, LARGEST).map_err(wrong)?;
            &unpacked
        } else {
            data
        };
        each(Entry::Message(Message { channel, sequence: 0, time, data }))?;
    }
    Ok(())
}

/// Converts a problem with a file into an error with a remedy.
fn sorted(error: &rusqlite::Error, path: &Path) -> RecordingError {
    match error.sqlite_error().map(|error| error.extended_code & 0xff) {
        Some(ffi::SQLITE_NOTADB) => RecordingError::Foreign { path: path.to_owned() },
        Some(ffi::SQLITE_CANTOPEN | ffi::SQLITE_IOERR | ffi::SQLITE_BUSY | ffi::SQLITE_PERM | ffi::SQLITE_READONLY) => {
            RecordingError::Unreadable { reason: visible(&error.to_string()), path: path.to_owned() }
        }
        _ => RecordingError::Damaged { problem: visible(&error.to_string()), path: path.to_owned() },
    }
}
