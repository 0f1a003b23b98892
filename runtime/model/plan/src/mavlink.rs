//! What names of topics and declared fields stand for in `MAVLink`, for all who compare them with definitions.

use crate::{Primitive, WireType};

/// The name of a topic: `MESSAGE`, `SYSTEM/MESSAGE` or `SYSTEM/COMPONENT/MESSAGE`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TopicName<'a> {
    /// The system that sends its messages, if the name says so.
    pub system: Option<u8>,
    /// Its component, in the same way.
    pub component: Option<u8>,
    /// The name of its messages in the definitions.
    pub message: &'a str,
}

impl<'a> TopicName<'a> {
    /// Takes a name apart, or says what is wrong with it.
    pub fn read(name: &'a str) -> Result<TopicName<'a>, String> {
        let number = |text: &str| {
            let number = text.parse::<u8>().ok().filter(|number| number.to_string() == text);
            number.ok_or_else(|| format!("`{text}` is not the number of a system or component, from 0 to 255"))
        };
        let parts: Vec<&str> = name.split('/').collect();
        match parts[..] {
            [message] => Ok(TopicName { system: None, component: None, message }),
            [system, message] => Ok(TopicName { system: Some(number(system)?), component: None, message }),
            [system, component, message] => {
                Ok(TopicName { system: Some(number(system)?), component: Some(number(component)?), message })
            }
            _ => Err("expected `MESSAGE`, `SYSTEM/MESSAGE` or `SYSTEM/COMPONENT/MESSAGE`".to_owned()),
        }
    }
}

/// The words of the language for the values of a field, the best one first.
fn words(field: &WireType) -> &'static [&'static str] {
    match field {
        WireType::Primitive { primitive: Primitive::Float32 | Primitive::Float64 } => &["real"],
        WireType::Primitive { .. } => &["int", "real", "bool"],
        WireType::String { .. } => &["text"],
        _ => &[],
    }
}

/// Whether an array, and what a field or each of its elements is.
fn parts(field: &WireType) -> (Option<u32>, &WireType) {
    if let WireType::Array { of, length } = field { (Some(*length), of) } else { (None, field) }
}

/// Whether a field can be declared with the type of this word, such as `real`, or as a list of that.
pub fn can_be_declared(field: &WireType, list: bool, word: &str) -> bool {
    let (length, of) = parts(field);
    length.is_some() == list && words(of).contains(&word)
}

/// The type that a field can be declared with, with this word if that is one of them; `None` if there is no such type.
pub fn nearest_type(field: &WireType, word: &str) -> Option<String> {
    let (length, of) = parts(field);
    let word = words(of).iter().find(|known| **known == word).or(words(of).first())?;
    Some(if length.is_some() { format!("list of {word}") } else { (*word).to_owned() })
}

/// The types that a field can be declared with, for a sentence.
pub fn types_in_words(field: &WireType) -> String {
    let (length, of) = parts(field);
    let quoted: Vec<String> = words(of).iter().map(|word| format!("`{word}`")).collect();
    let one = match &quoted[..] {
        [others @ .., last] if !others.is_empty() => format!("{} or {last}", others.join(", ")),
        quoted => quoted.concat(),
    };
    match length {
        Some(length) => format!("a `list of` {one}, of {length} elements"),
        None => one,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_says_who_sends_what() {
        let read = |name| TopicName::read(name).map(|topic| (topic.system, topic.component, topic.message));
        assert_eq!(read("HEARTBEAT"), Ok((None, None, "HEARTBEAT")));
        assert_eq!(read("7/HEARTBEAT"), Ok((Some(7), None, "HEARTBEAT")));
        assert_eq!(read("255/154/HEARTBEAT"), Ok((Some(255), Some(154), "HEARTBEAT")));
        for wrong in ["256/A", "-1/A", "+1/A", "01/A", "/A", "1//A", "1/2/3/A", "a/b/c/d/e"] {
            assert!(read(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn fields_can_be_declared_as_what_they_hold() {
        let of = |primitive| WireType::Primitive { primitive };
        let array = WireType::Array { of: Box::new(of(Primitive::Float32)), length: 4 };
        assert!(can_be_declared(&of(Primitive::Uint8), false, "bool"));
        assert!(!can_be_declared(&of(Primitive::Float64), false, "int"));
        assert!(can_be_declared(&array, true, "real") && !can_be_declared(&array, false, "real"));
        assert_eq!(nearest_type(&array, "int").as_deref(), Some("list of real"));
        assert_eq!(nearest_type(&of(Primitive::Int64), "real").as_deref(), Some("real"));
        assert_eq!(types_in_words(&array), "a `list of` `real`, of 4 elements");
        assert_eq!(types_in_words(&of(Primitive::Int8)), "`int`, `real` or `bool`");
        assert_eq!(types_in_words(&WireType::STRING), "`text`");
    }
}
