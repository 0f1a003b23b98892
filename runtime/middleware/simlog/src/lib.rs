//! SimlogAPI over gRPC: the protocol of the simulator that the original platform used, in both its versions.
//!
//! A payload of the wire is a [`Message`]; the declared types of a plan say as what it is read ([`Shape`]). The
//! runner's side is a `client::Client` that blocks, with `simlog` around it, the transport. The simulator's side
//! serves any [`Simulator`](sesame_relay::simulator::Simulator) of ours (`server`).

// These macros panic where nothing can be written: on a full disk, or after the reader has gone.
#![warn(clippy::print_stdout, clippy::print_stderr)]

#[cfg(feature = "client")]
pub mod client;
mod dynamic;
mod json;
mod message;
pub mod proto;
mod ros;
#[cfg(feature = "client")]
pub mod scan;
#[cfg(feature = "server")]
pub mod server;
mod shape;
#[cfg(feature = "client")]
mod transport;
mod tree;

pub use message::Message;
pub use shape::{Named, Shape};
#[cfg(feature = "client")]
pub use transport::simlog;
