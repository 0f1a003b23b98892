//! All messages of a recording.

use std::collections::BTreeMap;
use std::path::Path;

use sesame_base::visible::visible;
use sesame_plan::Interface;
use sesame_relay::value::Value;
use sesame_relay::wire::Wanted;

use crate::container::{Channel, Entry, Message, read};
use crate::error::RecordingError;
use crate::layout::{Bytes, Unreadable};

/// A message of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedMessage<'a> {
    /// Its topic.
    pub topic: &'a str,
    /// When it was recorded, in nanoseconds.
    pub time: u64,
    /// Its value, with all fields; or why it cannot be read, in words for the user. Messages in JSON have no layout
    /// without a space, so they cannot be read.
    pub value: Result<Value, String>,
}

/// Reads all messages of a recording in the order of its files, by the layouts that they say, else by these. If it is
/// cut off or damaged, what comes before is told first.
pub fn messages(
    path: &Path,
    known: &[Interface],
    each: &mut dyn FnMut(RecordedMessage<'_>),
) -> Result<(), RecordingError> {
    let mut channels: BTreeMap<u32, (Channel, Result<Bytes, String>)> = BTreeMap::new();
    read(path, &mut |entry| {
        match entry {
            Entry::File => channels.clear(),
            Entry::Channel(channel) => {
                let bytes = Bytes::new(&channel, known, None, &Wanted::All).map_err(|unreadable| match unreadable {
                    Unreadable::Encoding => format!("it is recorded as `{}`", visible(&channel.encoding)),
                    Unreadable::Layout(reason) => visible(&reason),
                });
                channels.insert(channel.id, (channel, bytes));
            }
            Entry::Message(Message { channel, time, data, .. }) => {
                if let Some((channel, bytes)) = channels.get(&channel) {
                    let value = bytes.as_ref().map_err(String::clone).and_then(|bytes| bytes.read(data));
                    each(RecordedMessage { topic: &channel.topic, time, value });
                }
            }
            Entry::Metadata(..) => {}
        }
        Ok(())
    })
}
