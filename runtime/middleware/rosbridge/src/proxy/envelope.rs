//! What stands around a message: the fields of an operation by name, with their values as they came.

use std::collections::BTreeMap;

use serde_json::value::RawValue;

use crate::bare;

/// An operation of which only what is asked for is read.
pub(super) struct Envelope<'a> {
    fields: BTreeMap<String, &'a RawValue>,
}

impl<'a> Envelope<'a> {
    /// Reads the envelope of a frame; an error says why it is none.
    pub(super) fn read(frame: &'a str) -> Result<Self, String> {
        let fields = serde_json::from_str(frame).map_err(|error| format!("it is not an operation in JSON: {error}"))?;
        Ok(Envelope { fields })
    }

    /// Reads the envelope of a frame in which there may be numbers that JSON does not have: they are marked in a copy.
    pub(super) fn read_marked(frame: &'a str, copy: &'a mut Option<String>) -> Result<Self, String> {
        Envelope::read(frame).or_else(|problem| {
            *copy = bare::marked(frame);
            copy.as_deref().map_or(Err(problem), Envelope::read)
        })
    }

    /// A field that is a text.
    pub(super) fn text(&self, field: &str) -> Option<String> {
        serde_json::from_str(self.fields.get(field)?.get()).ok()
    }

    /// A field that is a number without sign.
    pub(super) fn number(&self, field: &str) -> Option<u64> {
        serde_json::from_str(self.fields.get(field)?.get()).ok()
    }

    /// The operation with another text in a field and without some fields. Marked numbers are written as they came.
    pub(super) fn with(&self, field: &str, text: &str, without: &[&str]) -> String {
        let text = serde_json::Value::from(text).to_string();
        let mut frame = String::from("{");
        for (name, value) in &self.fields {
            if without.contains(&name.as_str()) {
                continue;
            }
            if frame.len() > 1 {
                frame.push(',');
            }
            frame.push_str(&serde_json::Value::from(name.as_str()).to_string());
            frame.push(':');
            frame.push_str(if name == field { &text } else { value.get() });
        }
        frame.push('}');
        bare::unmarked(frame)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_json_does_not_have_stay_as_they_came() {
        let frame = r#"{"op":"publish","topic":"/a","msg":{"ranges":[1.5,NaN,Infinity]}}"#;
        let mut copy = None;
        let envelope = Envelope::read_marked(frame, &mut copy).unwrap();
        assert_eq!(envelope.with("topic", "/b", &["op"]), r#"{"msg":{"ranges":[1.5,NaN,Infinity]},"topic":"/b"}"#);
        assert!(Envelope::read_marked("{\"op\":NaNs}", &mut None).is_err());
    }

    #[test]
    fn what_is_not_asked_for_stays_as_it_came() {
        let frame =
            r#"{"op":"publish", "topic" : "\u002fa", "msg":{"x": 1.00000000000000000001, "y":[1e400]}, "id":null}"#;
        let envelope = Envelope::read(frame).unwrap();
        assert_eq!(envelope.text("topic").as_deref(), Some("/a"));
        assert_eq!(
            envelope.with("topic", "/a\"b", &["id"]),
            r#"{"msg":{"x": 1.00000000000000000001, "y":[1e400]},"op":"publish","topic":"/a\"b"}"#
        );
        assert_eq!([envelope.text("id"), envelope.text("msg"), envelope.text("none")], [None, None, None]);
        assert_eq!(Envelope::read(r#"{"n":3}"#).unwrap().number("n"), Some(3));
        for wrong in ["", "[]", "3", "{\"a\":}", "{\"op\":NaN}"] {
            assert!(Envelope::read(wrong).is_err(), "{wrong}");
        }
    }
}
