//! A message of either version.

use prost::Message as _;
use sesame_plan::SimlogVersion;
use sesame_relay::message::Mismatch;
use sesame_relay::value::Value;

use crate::expected_type::ExpectedType;
use crate::proto::v2::RosMessage;
use crate::proto::v3::SimlogMessage;
use crate::{dynamic, ros};

/// A message as it is on the wire.
#[derive(Debug, Clone, PartialEq)]
pub enum Message {
    /// A message of version 2.
    V2(Box<RosMessage>),
    /// A message of version 3.
    V3(Box<SimlogMessage>),
}

impl Message {
    /// Its value, read as this. The mismatch says which field is of another type.
    pub fn read(&self, expected: &ExpectedType) -> Result<Value, Mismatch> {
        match self {
            Message::V2(message) => ros::read(expected, message),
            Message::V3(message) => dynamic::read(expected, message),
        }
    }

    /// What it says, as JSON: of version 2 its content, or what its text is if that is JSON.
    pub fn payload(&self) -> serde_json::Value {
        match self {
            Message::V2(message) => ros::payload(message),
            Message::V3(message) => dynamic::payload(message),
        }
    }

    /// The same message with another value; what the value does not have stays, such as a time stamp. The mismatch says
    /// which field the wire cannot hold. Reals that have 32 bits on the wire are rounded to the nearest.
    pub fn with(&self, value: &Value) -> Result<Message, Mismatch> {
        match self {
            Message::V2(message) => ros::write(value, message).map(|written| Message::V2(Box::new(written))),
            Message::V3(message) => dynamic::write(value, message).map(|written| Message::V3(Box::new(written))),
        }
    }

    /// A message for a value of which no other message says how it is written, published at this time of the simulator
    /// in nanoseconds. The type is what the space calls it; in version 2 it may name a content of the protocol.
    pub fn of(version: SimlogVersion, value: &Value, ty: &str, now: u64) -> Result<Message, Mismatch> {
        Ok(match version {
            SimlogVersion::V2 => Message::V2(Box::new(ros::message(value, ty, now)?)),
            SimlogVersion::V3 => Message::V3(Box::new(dynamic::message(value, now)?)),
        })
    }

    /// When it was published, by its own stamp, in nanoseconds; `None` if it has none.
    pub fn stamp(&self) -> Option<u64> {
        match self {
            Message::V2(message) => ros::stamp(message),
            Message::V3(message) => dynamic::stamp(message),
        }
    }

    /// How many bytes it has on the wire.
    pub fn size(&self) -> usize {
        match self {
            Message::V2(message) => message.encoded_len(),
            Message::V3(message) => message.encoded_len(),
        }
    }
}
