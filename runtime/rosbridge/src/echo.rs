//! Messages of the runner that come back from the bridge: by them the way through it is measured.
//!
//! A message that the runner relays takes the way through the bridge once more than it would without the relay: so what
//! the relay adds to it is the time from its arrival at the runner until the runner, as a subscriber, has it back.

use std::collections::VecDeque;
use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash as _, Hasher as _};
use std::time::{Duration, Instant};

use serde_json::Value;

/// How many messages may be on their way; the oldest are forgotten.
const ON_THEIR_WAY: usize = 1000;

/// Messages that were published and are awaited.
#[derive(Debug, Default)]
pub(crate) struct Echoes {
    awaited: VecDeque<Published>,
}

#[derive(Debug)]
struct Published {
    line: usize,
    sink: usize,
    content: u64,
    /// When it had come to the runner; `None` if an operation delayed or made it.
    arrived: Option<Instant>,
}

impl Echoes {
    /// A message was published on a sink of a line.
    pub(crate) fn published(&mut self, line: usize, sink: usize, message: &Value) {
        if self.awaited.len() == ON_THEIR_WAY {
            self.awaited.pop_front();
        }
        self.awaited.push_back(Published { line, sink, content: content(message), arrived: None });
    }

    /// What was published last on this sink had come to the runner at this moment.
    pub(crate) fn came(&mut self, line: usize, sink: usize, arrived: Instant) {
        if let Some(last) = self.awaited.iter_mut().rev().find(|it| (it.line, it.sink) == (line, sink)) {
            last.arrived = Some(arrived);
        }
    }

    /// A message was heard on a sink: how long ago it had come to the runner, if it is one of the runner's that no
    /// operation delayed. Those published on this sink before it were lost, since a bridge keeps their order.
    pub(crate) fn heard(&mut self, line: usize, sink: usize, message: &Value, at: Instant) -> Option<Duration> {
        let content = content(message);
        let of_sink = |it: &Published| (it.line, it.sink) == (line, sink);
        let found = self.awaited.iter().position(|it| of_sink(it) && it.content == content)?;
        let arrived = self.awaited[found].arrived;
        let mut position = 0;
        self.awaited.retain(|it| {
            position += 1;
            !of_sink(it) || position > found + 1
        });
        arrived.map(|arrived| at.saturating_duration_since(arrived))
    }

    /// Forgets all, as after a lost connection.
    pub(crate) fn clear(&mut self) {
        self.awaited.clear();
    }
}

/// What a message says, without the last digits of its numbers: some bridges do not keep those.
fn content(message: &Value) -> u64 {
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

    const MILLISECOND: Duration = Duration::from_millis(1);

    #[expect(clippy::disallowed_methods, reason = "a moment to count from")]
    fn begin() -> Instant {
        Instant::now()
    }

    #[test]
    fn what_comes_back_is_known_by_its_content_although_digits_are_lost() {
        let mut echoes = Echoes::default();
        let begin = begin();
        echoes.published(0, 0, &json!({ "data": 0.123_456_789_012_345_67, "name": "a" }));
        echoes.came(0, 0, begin);
        assert_eq!(echoes.heard(0, 0, &json!({ "data": 0.5, "name": "a" }), begin), None, "it is of somebody else");
        assert_eq!(echoes.heard(0, 1, &json!({ "name": "a", "data": 0.123_456_789 }), begin), None);
        let again = json!({ "name": "a", "data": 0.123_456_789 });
        assert_eq!(echoes.heard(0, 0, &again, begin + 3 * MILLISECOND), Some(3 * MILLISECOND));
        assert_eq!(echoes.heard(0, 0, &again, begin + 4 * MILLISECOND), None, "it came back once");
    }

    #[test]
    fn lost_messages_do_not_make_later_ones_late_and_delayed_ones_are_not_measured() {
        let mut echoes = Echoes::default();
        let begin = begin();
        for number in 0..3 {
            echoes.published(0, 0, &json!({ "data": number }));
            echoes.came(0, 0, begin + number * 10 * MILLISECOND);
        }
        // The first two are lost.
        let back = echoes.heard(0, 0, &json!({ "data": 2 }), begin + 21 * MILLISECOND);
        assert_eq!(back, Some(MILLISECOND));
        assert_eq!(echoes.heard(0, 0, &json!({ "data": 0 }), begin + 30 * MILLISECOND), None);
        echoes.published(0, 0, &json!({ "data": 3 }));
        assert_eq!(echoes.heard(0, 0, &json!({ "data": 3 }), begin + 40 * MILLISECOND), None);
    }

    #[test]
    fn what_never_comes_back_takes_no_more_memory() {
        let mut echoes = Echoes::default();
        for number in 0..5000 {
            echoes.published(0, 0, &json!({ "data": number }));
        }
        assert_eq!(echoes.awaited.len(), ON_THEIR_WAY);
    }
}
