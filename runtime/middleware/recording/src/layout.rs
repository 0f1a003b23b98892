//! The layouts of messages in recordings: what the file says of a channel, else what the space knows.

use std::sync::Arc;

use sesame_codec::{cdr, ros1};
use sesame_interfaces::bundle::{self, Notation};
use sesame_plan::Interface;
use sesame_relay::value::Value;
use sesame_relay::wire::Wanted;

use crate::container::{Channel, Schema};

/// Reads the messages of a channel from bytes.
pub(crate) enum Bytes {
    Cdr(Box<cdr::Codec>),
    Ros1(Box<ros1::Codec>),
}

/// Why the messages of a channel cannot be read.
pub(crate) enum Unreadable {
    /// Nobody knows the encoding.
    Encoding,
    /// The layout is not known, in words for the user.
    Layout(String),
}

/// Makes the codec of a layout.
type Make = fn(&[Interface], &str, &Wanted) -> Result<Bytes, String>;

/// The encodings of messages.
const ENCODINGS: [(&str, Make); 2] = [
    ("cdr", |interfaces, name, wanted| match cdr::Codec::new(interfaces, name, wanted) {
        Ok(codec) => Ok(Bytes::Cdr(Box::new(codec))),
        Err(error) => Err(error.to_string()),
    }),
    ("ros1", |interfaces, name, wanted| match ros1::Codec::new(interfaces, name, wanted) {
        Ok(codec) => Ok(Bytes::Ros1(Box::new(codec))),
        Err(error) => Err(error.to_string()),
    }),
];

impl Bytes {
    /// For the messages of a channel. Where the file does not say their layout, it is that of one of these interfaces,
    /// of the type that the file names, or else of this one.
    pub(crate) fn new(
        channel: &Channel,
        known: &[Interface],
        or: Option<&str>,
        wanted: &Wanted,
    ) -> Result<Self, Unreadable> {
        let encoding = ENCODINGS.iter().find(|(name, _)| *name == channel.encoding);
        let (_, make) = encoding.ok_or(Unreadable::Encoding)?;
        let (interfaces, name) = layout(channel.schema.as_ref(), known, or).map_err(Unreadable::Layout)?;
        make(&interfaces, &name, wanted).map_err(Unreadable::Layout)
    }

    /// Reads a message.
    pub(crate) fn read(&self, data: &[u8]) -> Result<Value, String> {
        match self {
            Bytes::Cdr(codec) => codec.read(Arc::from(data)),
            Bytes::Ros1(codec) => codec.read(Arc::from(data)),
        }
        .map_err(|error| error.to_string())
    }
}

fn layout(schema: Option<&Schema>, known: &[Interface], or: Option<&str>) -> Result<(Vec<Interface>, String), String> {
    if let Some(schema) = schema.filter(|schema| !schema.encoding.is_empty()) {
        let notations: Vec<&str> = Notation::ALL.iter().map(|(_, name)| *name).collect();
        let notation = Notation::named(&schema.encoding).ok_or_else(|| {
            let encoding = schema.encoding.escape_debug();
            format!("its schema is written as `{encoding}`; only {} can be read", notations.join(", "))
        })?;
        let wrong =
            |problem: String| format!("the definition of `{}` in the file: {problem}", schema.name.escape_debug());
        let (catalogue, name) =
            bundle::read(notation, &schema.name, &schema.text).map_err(|error| wrong(error.to_string()))?;
        let interfaces = catalogue.layout(&name).map_err(|error| wrong(error.to_string()))?;
        return Ok((interfaces, name));
    }
    let named = schema.map(|schema| schema.name.as_str());
    let mut found = named.into_iter().chain(or).filter_map(bundle::full).filter_map(|name| {
        let at = known.iter().position(|interface| interface.name == name)?;
        Some((known[..=at].to_vec(), name))
    });
    found.next().ok_or_else(|| {
        let ty = named.map_or_else(|| "its type".to_owned(), |name| format!("`{}`", name.escape_debug()));
        format!(
            "neither the file nor the space defines {ty}: declare the topic with that type in a system of `ros2` or \
             `ros1`, whose `types` name the folders with its definitions"
        )
    })
}
