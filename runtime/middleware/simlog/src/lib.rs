//! SimlogAPI over gRPC: the protocol of the simulator that the original platform used, in both its versions.
//!
//! A payload of the wire is a [`Message`]; the declared types of a plan say as what it is read ([`ExpectedType`]). The
//! runner's side is a `client::Client` that blocks, with `simlog` around it, the transport. The simulator's side
//! serves any [`Simulator`](sesame_relay::simulator::Simulator) of ours (`server`).

// These macros panic where nothing can be written: on a full disk, or after the reader has gone.
#![warn(clippy::print_stdout, clippy::print_stderr)]

#[cfg(feature = "client")]
#[expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "an adapter: it waits for a simulator on a thread"
)]
pub mod client;
mod dynamic;
mod expected_type;
mod json;
mod message;
pub mod proto;
mod ros;
#[cfg(feature = "client")]
#[expect(clippy::disallowed_methods, reason = "an adapter: it listens for a while")]
pub mod scan;
#[cfg(feature = "server")]
#[expect(clippy::disallowed_types, reason = "an adapter: it serves on a thread")]
pub mod server;
#[cfg(feature = "client")]
#[expect(clippy::disallowed_methods, reason = "an adapter: it waits for a simulator")]
mod transport;
mod tree;

pub use expected_type::{ExpectedType, Named};
pub use message::Message;
#[cfg(feature = "client")]
pub use transport::simlog;
