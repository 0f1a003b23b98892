//! What peers say to each other.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::bare;

/// One thing that a peer says. Fields that a peer may leave out are `Option`s, and are left out when there is nothing
/// to say. What a peer says besides is ignored, as the protocol asks for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "op", rename_all = "snake_case")]
pub enum Operation {
    /// The peer will publish on a topic.
    Advertise {
        /// By which it takes this back, and to which answers refer.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        id: Option<String>,
        /// The topic.
        topic: String,
        /// The type of its messages, `std_msgs/Float64` or `std_msgs/msg/Float64`.
        #[serde(rename = "type")]
        ty: String,
        /// Whether who subscribes later gets the last message.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        latch: Option<bool>,
        /// How many messages may wait.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        queue_size: Option<u64>,
    },
    /// It will not any more.
    Unadvertise {
        /// The id of the `advertise` which is taken back.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        id: Option<String>,
        /// The topic.
        topic: String,
    },
    /// A message on a topic, in either direction.
    Publish {
        /// To which answers refer.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        id: Option<String>,
        /// The topic.
        topic: String,
        /// The message.
        msg: Value,
        /// As in `advertise`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        latch: Option<bool>,
    },
    /// The peer wants the messages of a topic.
    Subscribe {
        /// By which it takes this back.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        id: Option<String>,
        /// The topic.
        topic: String,
        /// The type of its messages, if the peer knows it.
        #[serde(default, rename = "type", skip_serializing_if = "Option::is_none")]
        ty: Option<String>,
        /// The least time between two messages, in milliseconds.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        throttle_rate: Option<u64>,
        /// How many messages may wait for that; 0 for all.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        queue_length: Option<u64>,
        /// The most bytes in a frame; longer ones are sent in fragments.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        fragment_size: Option<u64>,
        /// How messages are written.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        compression: Option<Compression>,
    },
    /// It does not any more.
    Unsubscribe {
        /// The id of the `subscribe` which is taken back; all of the topic if there is none.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        id: Option<String>,
        /// The topic.
        topic: String,
    },
    /// The peer answers calls of a service.
    AdvertiseService {
        /// The service.
        service: String,
        /// Its type.
        #[serde(rename = "type")]
        ty: String,
    },
    /// It does not any more.
    UnadvertiseService {
        /// The service.
        service: String,
    },
    /// Somebody asks a service.
    CallService {
        /// To which the response refers.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        id: Option<String>,
        /// The service.
        service: String,
        /// Its type, if the peer knows it.
        #[serde(default, rename = "type", skip_serializing_if = "Option::is_none")]
        ty: Option<String>,
        /// The request: its fields by name, or in their order.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        args: Option<Value>,
        /// As in `subscribe`, for the response.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        fragment_size: Option<u64>,
        /// As in `subscribe`, for the response.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        compression: Option<Compression>,
    },
    /// What a service says.
    ServiceResponse {
        /// The id of the call.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        id: Option<String>,
        /// The service.
        service: String,
        /// The response, or why there is none.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        values: Option<Value>,
        /// Whether there is one.
        result: bool,
    },
    /// Which reports of its peer a peer wants.
    SetLevel {
        /// To which answers refer.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        id: Option<String>,
        /// The least important ones that it wants.
        level: Level,
    },
    /// A report.
    Status {
        /// The id of what it is about.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        id: Option<String>,
        /// How important it is.
        level: Level,
        /// In words.
        msg: String,
    },
    /// A piece of an operation.
    Fragment {
        /// All pieces of one operation have one.
        id: String,
        /// The piece.
        data: String,
        /// Its number, from 0.
        num: u32,
        /// How many there are.
        total: u32,
    },
    /// An operation as a picture, or a piece of one.
    Png {
        /// As in `fragment`, if it is a piece.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        id: Option<String>,
        /// The picture, in base64.
        data: String,
        /// As in `fragment`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        num: Option<u32>,
        /// As in `fragment`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        total: Option<u32>,
    },
}

/// How important a report is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Level {
    /// For developers.
    Info,
    /// Something may be wrong.
    Warning,
    /// Something was not done.
    Error,
    /// Nothing at all.
    None,
}

/// How messages are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Compression {
    /// As JSON.
    #[serde(rename = "none")]
    None,
    /// As JSON in a picture.
    #[serde(rename = "png")]
    Png,
    /// As CBOR.
    #[serde(rename = "cbor")]
    Cbor,
    /// As CBOR with the bytes that ROS has on its wire.
    #[serde(rename = "cbor-raw")]
    CborRaw,
}

impl Operation {
    /// The operation as a frame of text.
    pub fn text(&self) -> String {
        bare::unmarked(serde_json::to_string(self).expect("an operation is plain data with text keys"))
    }

    /// Its name on the wire.
    pub fn name(&self) -> &'static str {
        match self {
            Operation::Advertise { .. } => "advertise",
            Operation::Unadvertise { .. } => "unadvertise",
            Operation::Publish { .. } => "publish",
            Operation::Subscribe { .. } => "subscribe",
            Operation::Unsubscribe { .. } => "unsubscribe",
            Operation::AdvertiseService { .. } => "advertise_service",
            Operation::UnadvertiseService { .. } => "unadvertise_service",
            Operation::CallService { .. } => "call_service",
            Operation::ServiceResponse { .. } => "service_response",
            Operation::SetLevel { .. } => "set_level",
            Operation::Status { .. } => "status",
            Operation::Fragment { .. } => "fragment",
            Operation::Png { .. } => "png",
        }
    }
}
