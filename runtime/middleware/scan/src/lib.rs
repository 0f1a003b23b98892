//! What a scan finds in a system that runs.
//!
//! [`Facts`] are data that anybody can read, the same over every middleware; adapters gather them, and the generator
//! writes a space of them. Where nobody describes the messages of a topic, [`Samples`] has what its JSON payloads have
//! in common, and guesses the type of which all of them are. Pure: whoever listens is elsewhere.

mod arrivals;
mod facts;
mod guess;
mod payloads;
mod samples;

pub use arrivals::Arrivals;
pub use facts::{
    Facts, FoundAction, FoundField, FoundNode, FoundService, FoundTopic, FoundType, LeftOut, System, TypeSource,
};
pub use guess::{Conventions, Guess, GuessedField};
pub use payloads::Payloads;
pub use samples::Samples;

/// The type of clocks in ROS.
pub const CLOCK: &str = "rosgraph_msgs/msg/Clock";

/// The services that every node of ROS 2 has for its parameters and types, by the last part of their names.
pub const OF_EVERY_NODE: [&str; 7] = [
    "describe_parameters",
    "get_parameter_types",
    "get_parameters",
    "list_parameters",
    "set_parameters",
    "set_parameters_atomically",
    "get_type_description",
];

/// The node of publishers and subscribers of which nobody says to which node they belong.
pub const NOBODY: &str = "?";
