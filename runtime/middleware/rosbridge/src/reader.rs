//! Frames of a peer as operations, in whatever way they come.

use serde_json::Value;

use crate::bare;
use crate::cbor::{self, CborError};
use crate::fragment::{PieceError, Pieces};
use crate::operation::Operation;
use crate::png::{self, PictureError};

/// How much a peer may send.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// The most bytes of one operation, whole and decoded.
    pub operation: usize,
    /// The most bytes of pieces that wait for others.
    pub pieces: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Limits { operation: 16 << 20, pieces: 32 << 20 }
    }
}

/// Why a frame is not an operation. The peer may go on with the next one.
#[derive(Debug, thiserror::Error)]
pub enum FrameError {
    /// It is too long.
    #[error("it has {length} bytes, more than {most}")]
    Long {
        /// Its length.
        length: usize,
        /// The most.
        most: usize,
    },
    /// It is not JSON.
    #[error("it is not JSON: {0}")]
    Syntax(serde_json::Error),
    /// It says nothing that the protocol has.
    #[error("`op` is {}", match op { Some(op) => format!("`{}`, which is not an operation", op.escape_debug()), None => "missing".to_owned() })]
    Unknown {
        /// What it says.
        op: Option<String>,
    },
    /// It lacks something, or something in it is of the wrong kind.
    #[error("`{op}`: {problem}")]
    Fields {
        /// The operation.
        op: String,
        /// What is wrong.
        problem: String,
    },
    /// It is not CBOR.
    #[error(transparent)]
    Cbor(#[from] CborError),
    /// It is a useless piece.
    #[error(transparent)]
    Piece(#[from] PieceError),
    /// It is not a picture of a text.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// Pieces of pieces, or pictures of pictures.
    #[error("`{0}` inside of another one")]
    Nested(&'static str),
}

/// The operations that the protocol has.
const KNOWN: [&str; 13] = [
    "advertise",
    "unadvertise",
    "publish",
    "subscribe",
    "unsubscribe",
    "advertise_service",
    "unadvertise_service",
    "call_service",
    "service_response",
    "set_level",
    "status",
    "fragment",
    "png",
];

/// What reads the frames of one peer.
#[derive(Debug, Default)]
pub struct Reader {
    limits: Limits,
    pieces: Pieces,
}

impl Reader {
    /// One with these limits.
    pub fn new(limits: Limits) -> Reader {
        Reader { limits, pieces: Pieces::default() }
    }

    /// The operation in a frame of text; `None` if it is a piece of one that is not complete. Never a `fragment` or a
    /// `png`.
    pub fn text(&mut self, frame: &str) -> Result<Option<Operation>, FrameError> {
        self.within(frame.len())?;
        let operation = parsed(frame)?;
        self.whole(operation, 0)
    }

    /// The operation in a frame of bytes.
    pub fn bytes(&mut self, frame: &[u8]) -> Result<Option<Operation>, FrameError> {
        self.within(frame.len())?;
        let operation = typed(cbor::read(frame)?)?;
        self.whole(operation, 0)
    }

    fn within(&self, length: usize) -> Result<(), FrameError> {
        let most = self.limits.operation;
        if length > most { Err(FrameError::Long { length, most }) } else { Ok(()) }
    }

    /// Pieces put together, and pictures read. A picture may be in pieces, and pieces may be of a picture: two layers.
    fn whole(&mut self, operation: Operation, layer: usize) -> Result<Option<Operation>, FrameError> {
        if layer > 2 {
            return Err(FrameError::Nested(operation.name()));
        }
        let inner = match operation {
            Operation::Fragment { id, data, num, total } => {
                match self.pieces.take(&id, &data, (num, total), self.limits.pieces)? {
                    Some(whole) => whole,
                    None => return Ok(None),
                }
            }
            Operation::Png { data, num: None, total: None, .. } => png::text(&data, self.limits.operation)?,
            Operation::Png { id, data, num, total } => {
                let id = id.unwrap_or_default();
                let number = (num.unwrap_or(0), total.unwrap_or(1));
                match self.pieces.take(&format!("png {id}"), &data, number, self.limits.pieces)? {
                    Some(whole) => png::text(&whole, self.limits.operation)?,
                    None => return Ok(None),
                }
            }
            operation => return Ok(Some(operation)),
        };
        self.within(inner.len())?;
        let inner = parsed(&inner)?;
        self.whole(inner, layer + 1)
    }
}

fn parsed(text: &str) -> Result<Operation, FrameError> {
    let read = serde_json::from_str(text).or_else(|error| {
        let marked = bare::marked(text).and_then(|text| serde_json::from_str(&text).ok());
        marked.ok_or(error)
    });
    typed(read.map_err(FrameError::Syntax)?)
}

/// A value as an operation, or what is wrong with it.
fn typed(value: Value) -> Result<Operation, FrameError> {
    let op = value.get("op").and_then(Value::as_str).map(str::to_owned);
    let Some(op) = op.filter(|op| KNOWN.contains(&op.as_str())) else {
        let op = value.get("op").and_then(Value::as_str).map(|op| op.chars().take(40).collect());
        return Err(FrameError::Unknown { op });
    };
    serde_json::from_value(value).map_err(|error| FrameError::Fields { op, problem: error.to_string() })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use serde_json::json;

    use super::*;
    use crate::fragment::cut;
    use crate::operation::{Compression, Level};

    fn read(text: &str) -> Result<Option<Operation>, FrameError> {
        Reader::default().text(text)
    }

    fn publish(msg: Value) -> Operation {
        Operation::Publish { id: None, topic: "/cmd".to_owned(), msg, latch: None }
    }

    #[test]
    fn what_clients_send_is_understood() {
        let subscribe = r#"{"op":"subscribe","id":"subscribe:/cmd:1","topic":"/cmd","type":"geometry_msgs/TwistStamped",
            "compression":"png","throttle_rate":100,"queue_length":1,"reconnect_on_close":true}"#;
        let Operation::Subscribe { topic, throttle_rate, compression, .. } = read(subscribe).unwrap().unwrap() else {
            panic!()
        };
        assert_eq!((topic.as_str(), throttle_rate, compression), ("/cmd", Some(100), Some(Compression::Png)));
        let call = read(r#"{"op":"call_service","service":"/rosapi/topics","args":[]}"#).unwrap().unwrap();
        let Operation::CallService { id: None, service, args: Some(args), .. } = call else { panic!("{call:?}") };
        assert_eq!((service.as_str(), args), ("/rosapi/topics", json!([])));
        let level = read(r#"{"op":"set_level","level":"warning","id":"x"}"#).unwrap().unwrap();
        assert_eq!(level, Operation::SetLevel { id: Some("x".to_owned()), level: Level::Warning });
    }

    #[test]
    fn what_is_said_is_written_without_what_is_not() {
        assert_eq!(publish(json!({"x": 1.0})).text(), r#"{"op":"publish","topic":"/cmd","msg":{"x":1.0}}"#);
    }

    #[test]
    fn what_is_wrong_with_a_frame_is_said() {
        let said = |text: &str| read(text).unwrap_err().to_string();
        assert_eq!(said(r#"{"op":"publish","topic":"/a"}"#), "`publish`: missing field `msg`");
        assert_eq!(said(r#"{"op":"explode"}"#), "`op` is `explode`, which is not an operation");
        assert_eq!(said(r#"{"topic":"/a"}"#), "`op` is missing");
        assert_eq!(said("[1]"), "`op` is missing");
        assert!(said("{").starts_with("it is not JSON: "));
        assert!(said(r#"{"op":"advertise","topic":3,"type":"a/b"}"#).starts_with("`advertise`: invalid type"));
        let mut small = Reader::new(Limits { operation: 10, pieces: 100 });
        assert_eq!(small.text(r#"{"op":"unsubscribe"}"#).unwrap_err().to_string(), "it has 20 bytes, more than 10");
        assert_eq!(KNOWN.len(), 13);
    }

    #[test]
    fn pictures_pieces_and_pieces_of_pictures_are_what_they_hold() {
        let operation = publish(json!({"data": "ä".repeat(500)}));
        let picture = Operation::Png { id: None, data: png::picture(&operation.text()), num: None, total: None };
        assert_eq!(read(&picture.text()).unwrap(), Some(operation.clone()));
        let mut reader = Reader::default();
        let pieces = cut("7", &picture.text(), 50);
        assert!(pieces.len() > 2);
        for (at, piece) in pieces.iter().enumerate() {
            let found = reader.text(&piece.text()).unwrap();
            assert_eq!(found, (at + 1 == pieces.len()).then(|| operation.clone()));
        }
        let bytes = cbor::write(&serde_json::to_value(&operation).unwrap());
        assert_eq!(reader.bytes(&bytes).unwrap(), Some(operation));
    }

    #[test]
    fn pictures_in_pictures_without_end_are_refused() {
        let mut operation = publish(json!({}));
        for _ in 0..4 {
            operation = Operation::Png { id: None, data: png::picture(&operation.text()), num: None, total: None };
        }
        assert_eq!(read(&operation.text()).unwrap_err().to_string(), "`png` inside of another one");
    }

    proptest! {
        #[test]
        fn any_text_is_an_operation_or_an_error(text in any::<String>(), bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            let mut reader = Reader::default();
            let _ = reader.text(&text);
            let _ = reader.bytes(&bytes);
        }

        #[test]
        fn mutilated_frames_never_reach_what_was_not_said(
            at in any::<prop::sample::Index>(), put in any::<char>(), cut_off in any::<prop::sample::Index>(),
        ) {
            let text = publish(json!({"position": [0.5, 1.5], "name": ["a"]})).text();
            let mut signs: Vec<char> = text.chars().collect();
            let place = at.index(signs.len());
            signs[place] = put;
            signs.truncate(cut_off.index(signs.len()) + 1);
            let mutilated: String = signs.into_iter().collect();
            if let Ok(Some(operation)) = read(&mutilated) {
                prop_assert_eq!(operation.name(), "publish");
            }
        }
    }
}
