//! Payloads of version 2: messages of ROS with their own fields, or text.
//!
//! A text is what it says where the space declares `text`, a number or a truth value; where it declares a message, a
//! list or a point, it is JSON. A time stamp beside a text is the text's; without a text it is the payload itself. All
//! other contents are messages whose fields have the names of the protocol, or a point where the space declares one.

use std::borrow::Cow;

use sesame_relay::message::Mismatch;
use sesame_relay::value::Value;

use crate::expected_type::ExpectedType;
use crate::json;
use crate::proto::v2::ros_message::Content;
use crate::proto::v2::{
    Duration, Header, JointTrajectory, JointTrajectoryPoint, Point, PointStamped, Quaternion, RosMessage, SafetyZone,
    SafetyZoneCmd, Time,
};
use crate::tree::Tree;

const SECOND: u64 = 1_000_000_000;

/// The value of a message.
pub(crate) fn read(expected: &ExpectedType, message: &RosMessage) -> Result<Value, Mismatch> {
    match content(message) {
        Some(content) => {
            let tree = tree(content);
            match (expected, tree.field("point")) {
                (ExpectedType::Point, Some(point)) => point.read(expected),
                _ => tree.read(expected),
            }
        }
        None => text(expected, &message.value),
    }
}

/// What a message says, as JSON. A text in quotes is a text like any other, with its quotes.
pub(crate) fn payload(message: &RosMessage) -> serde_json::Value {
    if let Some(content) = content(message) {
        return json::json(&tree(content));
    }
    match json::read(message.value.trim()) {
        Some(tree @ (Tree::Bool(_) | Tree::Int(_) | Tree::Real(_) | Tree::List(_) | Tree::Fields(_))) => {
            json::json(&tree)
        }
        Some(Tree::Nothing | Tree::Text(_)) | None => message.value.clone().into(),
    }
}

/// The same message with another value. Single numbers are rounded once, to the nearest.
pub(crate) fn write(value: &Value, like: &RosMessage) -> Result<RosMessage, Mismatch> {
    let mut message = like.clone();
    let Some(content) = content(like) else {
        message.value = written(value, &like.value);
        return Ok(message);
    };
    let mut all = tree(content);
    match (value, &mut all) {
        (Value::Point(_), Tree::Fields(fields)) => match fields.iter_mut().find(|(name, _)| name == "point") {
            Some((_, point)) => point.write(value),
            None => all.write(value),
        },
        (Value::Record(_), Tree::Fields(_)) => all.write(value),
        _ => return Err(Mismatch::new("message", value)),
    }
    message.content = Some(rebuilt(content, &all)?);
    Ok(message)
}

/// When a message was published, by its own stamp, in nanoseconds.
///
/// The original platform took the nanoseconds for the whole time. This does the same if the seconds are zero.
pub(crate) fn stamp(message: &RosMessage) -> Option<u64> {
    let header = match message.content.as_ref()? {
        Content::TimeStamp(header) => Some(header),
        Content::JointTrajectory(it) => it.header.as_ref(),
        Content::PointStamped(it) => it.header.as_ref(),
        Content::SafetyZone(it) => it.header.as_ref(),
        Content::Point(_) | Content::Quaternion(_) | Content::JointTrajectoryPoint(_) | Content::SafetyZoneCmd(_) => {
            None
        }
    };
    let Time { sec, nsec } = header?.stamp.as_ref()?;
    Some(sec.saturating_mul(SECOND).saturating_add(*nsec))
}

/// A header of this time, in nanoseconds.
fn header(now: u64) -> Header {
    Header { seq: 0, stamp: Some(Time { sec: now / SECOND, nsec: now % SECOND }), frame_id: String::new() }
}

/// A message for a value of which no other message says how it is written: the content of the protocol whose name the
/// type has, a stamped point, a safety zone, or text with a time stamp.
pub(crate) fn message(value: &Value, kind: &str, now: u64) -> Result<RosMessage, Mismatch> {
    const ZONE: [&str; 4] = ["zone", "level", "object1", "object2"];
    let named = matches!(value, Value::Record(_)).then(|| empty(kind)).flatten();
    let content = named.unwrap_or_else(|| match value {
        Value::Point(_) => Content::PointStamped(PointStamped { header: Some(header(now)), point: None }),
        Value::Record(record) if record.fields().names().iter().map(|name| &**name).eq(ZONE) => {
            Content::SafetyZone(SafetyZone { header: Some(header(now)), ..SafetyZone::default() })
        }
        _ => Content::TimeStamp(header(now)),
    });
    let text = matches!(content, Content::TimeStamp(_)).then(|| written(value, "")).unwrap_or_default();
    let like = RosMessage { r#type: kind.to_owned(), value: text, content: Some(content) };
    if like.value.is_empty() && !matches!(value, Value::Text(_)) { write(value, &like) } else { Ok(like) }
}

/// Content of the protocol, by the name of its type.
fn empty(kind: &str) -> Option<Content> {
    Some(match kind {
        "JointTrajectory" => Content::JointTrajectory(JointTrajectory::default()),
        "JointTrajectoryPoint" => Content::JointTrajectoryPoint(JointTrajectoryPoint::default()),
        "Quaternion" => Content::Quaternion(Quaternion::default()),
        "SafetyZoneCmd" => Content::SafetyZoneCmd(SafetyZoneCmd::default()),
        _ => return None,
    })
}

/// The content that is the payload.
fn content(message: &RosMessage) -> Option<&Content> {
    message.content.as_ref().filter(|content| !matches!(content, Content::TimeStamp(_)) || message.value.is_empty())
}

/// What a text says.
pub(crate) fn text(expected: &ExpectedType, text: &str) -> Result<Value, Mismatch> {
    let wrong = |expected| Mismatch { path: Vec::new(), expected, found: "text" };
    let word = text.trim();
    match expected {
        ExpectedType::Text => Ok(Value::Text(text.into())),
        ExpectedType::Bool => word.parse().map(Value::Bool).map_err(|_| wrong("bool")),
        ExpectedType::Real => word.parse().map(Value::Real).map_err(|_| wrong("real")),
        ExpectedType::Int => match word.parse::<i64>() {
            Ok(whole) => Ok(Value::Int(whole)),
            Err(_) => Tree::Real(word.parse().map_err(|_| wrong("int"))?).read(expected),
        },
        ExpectedType::Point | ExpectedType::List(_) | ExpectedType::Record(_) => {
            json::read(text).ok_or_else(|| wrong("JSON"))?.read(expected)
        }
    }
}

/// A value as text, in the manner of another one.
pub(crate) fn written(value: &Value, like: &str) -> String {
    match value {
        Value::Text(text) | Value::Undeclared(text) => text.to_string(),
        Value::Opaque(bytes) => String::from_utf8_lossy(bytes).into_owned(),
        Value::Bool(truth) => truth.to_string(),
        Value::Int(whole) => whole.to_string(),
        Value::Real(x) if x.is_finite() => format!("{x:?}"),
        Value::Real(x) if x.is_nan() => "NaN".to_owned(),
        Value::Real(x) => if *x > 0.0 { "Infinity" } else { "-Infinity" }.to_owned(),
        Value::Point(_) | Value::List(_) | Value::Record(_) => {
            let mut tree = json::read(like).unwrap_or(Tree::Nothing);
            tree.write(value);
            json::written(&tree)
        }
    }
}

fn tree(content: &Content) -> Tree {
    match content {
        Content::JointTrajectory(it) => it.tree(),
        Content::Point(it) => it.tree(),
        Content::PointStamped(it) => it.tree(),
        Content::Quaternion(it) => it.tree(),
        Content::JointTrajectoryPoint(it) => it.tree(),
        Content::TimeStamp(it) => it.tree(),
        Content::SafetyZone(it) => it.tree(),
        Content::SafetyZoneCmd(it) => it.tree(),
    }
}

/// Content of the same kind from a tree.
fn rebuilt(content: &Content, tree: &Tree) -> Result<Content, Mismatch> {
    Ok(match content {
        Content::JointTrajectory(_) => Content::JointTrajectory(Part::of(tree)?),
        Content::Point(_) => Content::Point(Part::of(tree)?),
        Content::PointStamped(_) => Content::PointStamped(Part::of(tree)?),
        Content::Quaternion(_) => Content::Quaternion(Part::of(tree)?),
        Content::JointTrajectoryPoint(_) => Content::JointTrajectoryPoint(Part::of(tree)?),
        Content::TimeStamp(_) => Content::TimeStamp(Part::of(tree)?),
        Content::SafetyZone(_) => Content::SafetyZone(Part::of(tree)?),
        Content::SafetyZoneCmd(_) => Content::SafetyZoneCmd(Part::of(tree)?),
    })
}

/// A part of a message of the protocol.
trait Part: Sized {
    fn tree(&self) -> Tree;
    fn of(tree: &Tree) -> Result<Self, Mismatch>;
}

impl Part for f32 {
    fn tree(&self) -> Tree {
        Tree::Real(f64::from(*self))
    }

    fn of(tree: &Tree) -> Result<Self, Mismatch> {
        let real = tree.real()?;
        #[expect(clippy::cast_possible_truncation, reason = "it is rounded here, and nowhere else")]
        let single = real as f32;
        if real.is_finite() && single.is_infinite() {
            let found = "a number that is too large";
            return Err(Mismatch { path: Vec::new(), expected: "a real of 32 bits", found });
        }
        Ok(single)
    }
}

impl Part for u32 {
    fn tree(&self) -> Tree {
        Tree::Int(i128::from(*self))
    }

    fn of(tree: &Tree) -> Result<Self, Mismatch> {
        unsigned(tree, "an int of 32 bits, not negative")
    }
}

impl Part for u64 {
    fn tree(&self) -> Tree {
        Tree::Int(i128::from(*self))
    }

    fn of(tree: &Tree) -> Result<Self, Mismatch> {
        unsigned(tree, "an int that is not negative")
    }
}

fn unsigned<T: TryFrom<i128>>(tree: &Tree, expected: &'static str) -> Result<T, Mismatch> {
    T::try_from(tree.whole()?).map_err(|_| Mismatch { path: Vec::new(), expected, found: "another int" })
}

impl Part for String {
    fn tree(&self) -> Tree {
        Tree::Text(self.clone())
    }

    fn of(tree: &Tree) -> Result<Self, Mismatch> {
        match tree {
            Tree::Text(text) => Ok(text.clone()),
            _ => Err(tree.mismatch("text")),
        }
    }
}

impl<T: Part> Part for Vec<T> {
    fn tree(&self) -> Tree {
        Tree::List(self.iter().map(Part::tree).collect())
    }

    fn of(tree: &Tree) -> Result<Self, Mismatch> {
        let Tree::List(items) = tree else { return Err(tree.mismatch("list")) };
        let items = items.iter().enumerate();
        items.map(|(at, item)| T::of(item).map_err(|error| error.inside(&format!("[{at}]")))).collect()
    }
}

impl<T: Part> Part for Option<T> {
    fn tree(&self) -> Tree {
        self.as_ref().map_or(Tree::Nothing, Part::tree)
    }

    fn of(tree: &Tree) -> Result<Self, Mismatch> {
        if *tree == Tree::Nothing { Ok(None) } else { T::of(tree).map(Some) }
    }
}

/// Parts that are messages, by the names of their fields.
macro_rules! messages {
    ($($message:ident { $($field:ident),* })*) => {$(
        impl Part for $message {
            fn tree(&self) -> Tree {
                Tree::Fields(vec![$((Cow::Borrowed(stringify!($field)), self.$field.tree())),*])
            }

            fn of(tree: &Tree) -> Result<Self, Mismatch> {
                let mut message = $message::default();
                each(tree, &[$(stringify!($field)),*], &mut |name, tree| {
                    match name {
                        $(stringify!($field) => message.$field = Part::of(tree)?,)*
                        _ => return Err(tree.mismatch("nothing: the protocol has no such field")),
                    }
                    Ok(())
                })?;
                Ok(message)
            }
        }
    )*};
}

messages! {
    Time { sec, nsec }
    Duration { msec }
    Header { seq, stamp, frame_id }
    JointTrajectoryPoint { positions, velocities, accelerations, effort, time_from_start }
    JointTrajectory { header, joint_names, points }
    PointStamped { header, point }
    Point { x, y, z }
    Quaternion { x, y, z, w }
    SafetyZone { header, zone, level, object1, object2 }
    SafetyZoneCmd { zone, cmd }
}

/// Calls for each field of a tree; a point may be a list of its coordinates.
fn each(
    tree: &Tree,
    names: &[&'static str],
    take: &mut dyn FnMut(&str, &Tree) -> Result<(), Mismatch>,
) -> Result<(), Mismatch> {
    match tree {
        Tree::Fields(fields) => {
            fields.iter().try_for_each(|(name, tree)| take(name, tree).map_err(|error| error.inside(name)))
        }
        Tree::List(items) if names == ["x", "y", "z"] && items.len() == 3 => {
            names.iter().zip(items).try_for_each(|(name, item)| take(name, item).map_err(|error| error.inside(name)))
        }
        _ => Err(tree.mismatch("message")),
    }
}

#[cfg(test)]
mod tests;
