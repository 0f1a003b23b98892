//! Payloads of all topics: what those of each have in common, bounded together.

use std::collections::BTreeMap;

use serde_json::Value as Json;

use crate::samples::Samples;

/// The most topics whose payloads are looked at.
const MOST_TOPICS: usize = 10_000;

/// The most places that are kept of all payloads together.
const MOST_PARTS: usize = 200_000;

/// What the payloads of each topic have in common.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Payloads {
    by_topic: BTreeMap<String, Samples>,
    parts: usize,
    cut: bool,
}

impl Payloads {
    /// One more payload of a topic.
    pub fn add(&mut self, topic: &str, payload: &Json) {
        if !self.by_topic.contains_key(topic) {
            if self.by_topic.len() >= MOST_TOPICS {
                self.cut = true;
                return;
            }
            self.by_topic.insert(topic.to_owned(), Samples::default());
        }
        let Some(samples) = self.by_topic.get_mut(topic) else { return };
        if self.parts >= MOST_PARTS {
            self.cut = true;
            return;
        }
        let before = samples.parts();
        samples.add(payload);
        self.parts += samples.parts() - before;
    }

    /// The payloads of a topic.
    pub fn get(&self, topic: &str) -> Option<&Samples> {
        self.by_topic.get(topic)
    }

    /// Whether there was more than is kept.
    pub fn is_cut(&self) -> bool {
        self.cut
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn all_topics_together_are_bounded() {
        let mut payloads = Payloads::default();
        for topic in 0..200 {
            let fields = (0..1500).map(|field| (format!("f{field}"), json!(1)));
            payloads.add(&format!("topic{topic}"), &Json::Object(fields.collect()));
        }
        assert!(payloads.is_cut());
        assert!(payloads.parts <= MOST_PARTS + 1500);
        assert_eq!(payloads.get("topic0").map(Samples::count), Some(1));
        assert_eq!(payloads.get("topic199").map(Samples::count), Some(0));
    }
}
