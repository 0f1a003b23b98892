//! ROS 1: the definitions of its types ([`definition`]), and the runner as a node between real nodes.
//!
//! The definitions are pure, and so is the codec of messages, [`sesame_codec::ros1`]. The node is an adapter around
//! them, in Rust alone: nothing of ROS is needed to build or run it. It speaks XML-RPC and TCPROS itself, because it
//! needs what no crate has: connection headers of others, under which it publishes and serves; services whose types are
//! known only when it runs; bounds for everything that others send; and no interface but the loopback one.

#[expect(clippy::disallowed_methods, clippy::disallowed_types, reason = "an adapter: it has connections")]
mod connection;
#[expect(clippy::disallowed_methods, reason = "an adapter: it waits for others")]
mod contact;
pub mod definition;
#[expect(clippy::disallowed_methods, reason = "an adapter: it waits for others")]
mod master;
#[expect(clippy::disallowed_methods, clippy::disallowed_types, reason = "an adapter: it waits for others on threads")]
mod node;
mod protocol;
#[expect(clippy::disallowed_methods, reason = "an adapter: it asks others")]
pub mod scan;
#[expect(clippy::disallowed_methods, reason = "an adapter: it waits for other processes")]
mod transport;

pub use master::AskError;
pub use transport::ros1;
