//! What happened in a run without operations, by which searches place windows of operations.

use serde::{Deserialize, Serialize};

use sesame_plan::Span;

/// A wire with at most so many messages has rare ones: each of them is an event by itself.
pub const RARE: usize = 12;

/// When messages came in a run without operations, and when something happened in them.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Course {
    /// Per wire that spoke, in order of declaration.
    pub heard: Vec<Heard>,
    /// Per wire and field in which something happened, in order of declaration.
    pub signals: Vec<Signal>,
    /// Per wire and field that took few values, in order of declaration: which one it had when.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub states: Vec<States>,
}

/// When messages were published on a wire.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Heard {
    /// The position of the wire among the paths of topics in the order of the plan.
    pub wire: u32,
    /// From the first to the last message of each stretch, in seconds, in order and disjoint; start and end are equal
    /// for a single message. A wire with many messages has stretches of several, as long as they came regularly.
    pub stretches: Vec<Span>,
}

/// What happened in a field of the messages of a wire.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Signal {
    /// The position of the wire.
    pub wire: u32,
    /// The field from the message inwards, as in `pose.x`; empty for a message that is a single value, and for
    /// events about when messages come.
    pub field: String,
    /// What happened, in order of time, at least one. Of a great many an even selection.
    pub events: Vec<SignalEvent>,
}

/// Which value a field had when, for fields that took at least two values, but few.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct States {
    /// The position of the wire.
    pub wire: u32,
    /// The field from the message inwards; empty for a message that is a single value.
    pub field: String,
    /// The values in order of time, each until the next one; neighbours differ.
    pub entered: Vec<Entered>,
}

/// A value that a field took.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Entered {
    /// When a message had it first, in seconds of simulation time.
    pub at: f64,
    /// The value as the language writes it: a number, `true`, `false`, or a text without its quotes.
    pub value: String,
}

impl Signal {
    /// Whether its events are about when messages come, not about a field of them.
    pub fn is_of_messages(&self) -> bool {
        self.events.first().is_some_and(|event| event.what.is_of_messages())
    }
}

/// Something that happened in a field, or to the messages of a wire.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SignalEvent {
    /// When, in seconds of simulation time.
    pub at: f64,
    /// What.
    pub what: Happening,
}

/// What can happen in a signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Happening {
    /// A message came, on a wire with few of them.
    Message,
    /// Messages begin to come, after a long silence.
    Begins,
    /// The last message came before a long silence.
    Ends,
    /// A value of few changes to another one.
    Changes,
    /// A number changes by a large part of its range from one message to the next.
    Jumps,
    /// A number that has rested begins to move.
    SetsOut,
    /// A number comes to rest.
    Rests,
    /// A number changes its sign.
    ChangesSign,
    /// A number turns from rising to falling, or the other way.
    Turns,
}

impl Happening {
    /// All of them.
    pub const ALL: [Happening; 9] = [
        Happening::Message,
        Happening::Begins,
        Happening::Ends,
        Happening::Changes,
        Happening::Jumps,
        Happening::SetsOut,
        Happening::Rests,
        Happening::ChangesSign,
        Happening::Turns,
    ];

    /// Whether it is about when messages come, whatever they contain.
    pub fn is_of_messages(self) -> bool {
        matches!(self, Happening::Message | Happening::Begins | Happening::Ends)
    }

    /// Its word in tables and the database.
    pub fn word(self) -> &'static str {
        match self {
            Happening::Message => "message",
            Happening::Begins => "begins",
            Happening::Ends => "ends",
            Happening::Changes => "changes",
            Happening::Jumps => "jumps",
            Happening::SetsOut => "sets_out",
            Happening::Rests => "rests",
            Happening::ChangesSign => "changes_sign",
            Happening::Turns => "turns",
        }
    }

    /// What has this word.
    pub fn from_word(word: &str) -> Option<Happening> {
        Happening::ALL.into_iter().find(|what| what.word() == word)
    }
}
