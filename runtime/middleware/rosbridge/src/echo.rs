//! What messages of the runner are known by when they come back from the bridge.

use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash as _, Hasher as _};

use serde_json::Value;

/// A hash of what a message says, without the last digits of its numbers: some bridges do not keep those.
pub(crate) fn content(message: &Value) -> u64 {
    let mut hasher = DefaultHasher::new();
    add(message, &mut hasher);
    hasher.finish()
}

fn add(value: &Value, hasher: &mut DefaultHasher) {
    match value {
        Value::Null => 0u8.hash(hasher),
        Value::Bool(truth) => truth.hash(hasher),
        Value::Number(number) => {
            // Negative zero and zero are equal.
            format!("{:.6e}", number.as_f64().unwrap_or(f64::NAN) + 0.0).hash(hasher);
        }
        Value::String(text) => text.hash(hasher),
        Value::Array(elements) => {
            elements.len().hash(hasher);
            for element in elements {
                add(element, hasher);
            }
        }
        // `serde_json` keeps fields as they came or by name; the order says nothing.
        Value::Object(fields) => {
            let mut fields: Vec<_> = fields.iter().collect();
            fields.sort_by_key(|(name, _)| *name);
            for (name, value) in fields {
                name.hash(hasher);
                add(value, hasher);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_message_is_known_although_digits_are_lost_and_fields_come_in_another_order() {
        let said = content(&json!({ "data": 0.123_456_789_012_345_67, "name": "a", "zero": -0.0 }));
        assert_eq!(said, content(&json!({ "name": "a", "zero": 0, "data": 0.123_456_789 })));
        assert_ne!(said, content(&json!({ "name": "a", "zero": 0, "data": 0.123_5 })));
        assert_ne!(said, content(&json!({ "name": "b", "zero": 0, "data": 0.123_456_789 })));
    }
}
