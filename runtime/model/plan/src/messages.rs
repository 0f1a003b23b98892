//! The messages that an operation of a test alters, where it does not alter all.

use serde::{Deserialize, Serialize};

/// Messages by their numbers on the wires that an operation acts on: at least one, in rising order, each once. So equal
/// lists are written equally.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "Vec<MessageRun>", into = "Vec<MessageRun>")]
pub struct Messages(Vec<MessageRun>);

/// Messages of one wire that follow each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct MessageRun {
    /// The position of the wire among those that the operation acts on, from 0.
    #[serde(default, skip_serializing_if = "is_first")]
    pub wire: u32,
    /// The number of the first among the messages published there, from 0: the key of random draws.
    pub first: u64,
    /// The number of the last.
    pub last: u64,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it with a reference")]
fn is_first(wire: &u32) -> bool {
    *wire == 0
}

impl Messages {
    /// These messages, each by the position of its wire and its number there, in any order; `None` if there is none.
    pub fn of(messages: impl IntoIterator<Item = (u32, u64)>) -> Option<Messages> {
        Messages::of_runs(messages.into_iter().map(|(wire, number)| MessageRun { wire, first: number, last: number }))
    }

    /// The messages of these runs, in any order; `None` if there is none. A run that ends before it begins holds none.
    pub fn of_runs(runs: impl IntoIterator<Item = MessageRun>) -> Option<Messages> {
        let mut runs: Vec<MessageRun> = runs.into_iter().filter(|run| run.first <= run.last).collect();
        runs.sort_unstable();
        let mut merged: Vec<MessageRun> = Vec::new();
        for run in runs {
            match merged.last_mut() {
                Some(before) if before.wire == run.wire && run.first <= before.last.saturating_add(1) => {
                    before.last = before.last.max(run.last);
                }
                _ => merged.push(run),
            }
        }
        (!merged.is_empty()).then_some(Messages(merged))
    }

    /// The runs, in order: none touches another.
    pub fn runs(&self) -> &[MessageRun] {
        &self.0
    }

    /// Whether a message is among them, by the position of its wire and its number there.
    pub fn hold(&self, wire: u64, number: u64) -> bool {
        let at = self.0.partition_point(|run| (u64::from(run.wire), run.last) < (wire, number));
        self.0.get(at).is_some_and(|run| u64::from(run.wire) == wire && run.first <= number)
    }

    /// How many they are.
    pub fn count(&self) -> u64 {
        self.0.iter().fold(0, |count: u64, run| count.saturating_add((run.last - run.first).saturating_add(1)))
    }
}

impl TryFrom<Vec<MessageRun>> for Messages {
    type Error = &'static str;

    fn try_from(runs: Vec<MessageRun>) -> Result<Self, Self::Error> {
        let messages = Messages::of_runs(runs.iter().copied()).filter(|messages| messages.0 == runs);
        messages.ok_or("are not messages in rising order, each once")
    }
}

impl From<Messages> for Vec<MessageRun> {
    fn from(messages: Messages) -> Self {
        messages.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_holds_what_it_was_made_of_and_is_read_as_it_was_written() {
        let all: Vec<(u32, u64)> = (0..2).flat_map(|wire| (0..5).map(move |number| (wire, number))).collect();
        for chosen in 0..1u32 << all.len() {
            let expected: Vec<(u32, u64)> =
                all.iter().enumerate().filter(|(at, _)| chosen >> at & 1 == 1).map(|(_, message)| *message).collect();
            let Some(list) = Messages::of(expected.iter().rev().chain(&expected).copied()) else {
                assert_eq!(chosen, 0);
                continue;
            };
            for (wire, number) in (0..3).flat_map(|wire| (0..6).map(move |number| (wire, number))) {
                assert_eq!(list.hold(u64::from(wire), number), expected.contains(&(wire, number)), "{list:?}");
            }
            assert_eq!(list.count(), expected.len() as u64);
            let written = serde_json::to_string(&list).unwrap();
            assert_eq!(serde_json::from_str::<Messages>(&written).unwrap(), list);
        }
    }

    #[test]
    fn a_list_from_elsewhere_is_in_order_or_refused() {
        let read = |text: &str| serde_json::from_str::<Messages>(text).map_err(|error| error.to_string());
        let ordered = r#"[{"first": 2, "last": 3}, {"first": 5, "last": 5}, {"wire": 1, "first": 0, "last": 0}]"#;
        assert_eq!(read(ordered).map(|messages| messages.count()), Ok(4));
        for wrong in [
            "[]",
            r#"[{"first": 3, "last": 2}]"#,
            r#"[{"first": 2, "last": 3}, {"first": 4, "last": 4}]"#,
            r#"[{"wire": 1, "first": 2, "last": 3}, {"first": 7, "last": 7}]"#,
        ] {
            assert!(read(wrong).unwrap_err().starts_with("are not messages in rising order"), "{wrong}");
        }
        assert_eq!(read(r#"[{"first": 0, "last": 18446744073709551615}]"#).map(|all| all.count()), Ok(u64::MAX));
    }
}
