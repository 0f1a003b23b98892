//! What runs in a domain: nodes, topics, services, and the layouts of their messages.
//!
//! [`Facts`](sesame_scan::Facts) are gathered by listening ([`Scanner`]), which publishes nothing but what discovery
//! needs. Only a node that is asked for the layout of a type receives a request.

mod ask;
mod assemble;
mod described;
mod listen;

pub use listen::{ScanError, Scanner};

/// How many publishers and subscribers are kept at most.
pub const MOST_ENDPOINTS: usize = 10_000;
