//! What files say, and how much of it is read.

use std::collections::BTreeMap;

use crate::error::RecordingError;

/// The largest record, chunk and message that is read, in bytes.
pub(super) const LARGEST: usize = 1 << 27;

/// How much is read at once, in bytes.
pub(super) const BLOCK: usize = 1 << 16;

/// What a file says, in its order.
pub(crate) enum Entry<'a> {
    /// A file of the recording begins: its channels are its own.
    File,
    /// A named set of texts.
    Metadata(String, BTreeMap<String, String>),
    /// A channel, before its first message.
    Channel(Channel),
    /// A message.
    Message(Message<'a>),
}

/// A line of messages of one type.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Channel {
    /// Its number in the file.
    pub(crate) id: u32,
    pub(crate) topic: String,
    /// How messages are encoded: `json`, `cdr`, `ros1`, or something else.
    pub(crate) encoding: String,
    /// What the messages are, if the file says it.
    pub(crate) schema: Option<Schema>,
    /// What its writer said of it.
    pub(crate) metadata: BTreeMap<String, String>,
}

/// The type of the messages on a channel.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Schema {
    /// Its name.
    pub(crate) name: String,
    /// How the text is written: `ros2msg`, `ros2idl`, `ros1msg`, `jsonschema`, or something else; empty without a text.
    pub(crate) encoding: String,
    /// Its definition with everything that it contains.
    pub(crate) text: String,
}

/// A message as bytes.
pub(crate) struct Message<'a> {
    /// The number of its channel.
    pub(crate) channel: u32,
    /// Its number on its channel, if the file has one.
    pub(crate) sequence: u32,
    /// When it was recorded, in nanoseconds.
    pub(crate) time: u64,
    pub(crate) data: &'a [u8],
}

/// Who is told the entries of a file.
pub(crate) type Each<'e> = &'e mut dyn FnMut(Entry<'_>) -> Result<(), RecordingError>;
