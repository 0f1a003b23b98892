//! What runs in a domain: nodes, topics, services, and the layouts of their messages.
//!
//! [`Facts`] are data that anybody can read; they are gathered by listening ([`Scanner`], with feature `node`), which
//! publishes nothing but what discovery needs. Only a node that is asked for the layout of a type receives a request.

#[cfg(feature = "node")]
mod ask;
#[cfg(feature = "node")]
mod assemble;
#[cfg(feature = "node")]
mod described;
mod facts;
#[cfg(feature = "node")]
mod listen;

pub use facts::{Facts, FoundAction, FoundField, FoundNode, FoundService, FoundTopic, FoundType, TypeSource};
#[cfg(feature = "node")]
pub use listen::{ScanError, Scanner};

/// How many publishers and subscribers are kept at most.
pub const MOST_ENDPOINTS: usize = 10_000;

/// The type of clocks.
pub const CLOCK: &str = "rosgraph_msgs/msg/Clock";

/// The node of publishers and subscribers whose participant names no node.
pub const NOBODY: &str = "?";
