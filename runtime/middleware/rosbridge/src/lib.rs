//! Systems of ROS behind a bridge that speaks the rosbridge protocol, version 2.
//!
//! The protocol itself has no sockets: a peer sends [`Operation`]s, each in a frame of its own: as a text in JSON, or,
//! for messages of topics on request, as bytes in CBOR ([`cbor`]). What is too long for a frame is sent in pieces
//! ([`fragment`]), and what is to be small as a picture ([`png`]). [`Reader`] makes operations of frames, whatever way
//! they come. No input makes it panic or keep more than [`Limits`] says.
//!
//! With the feature `client`, `client` is a connection to a bridge, `payload` turns messages into values, `rosbridge`
//! is the transport to the nodes behind it, and `proxy` is where other clients connect that are to be disturbed.

mod bare;
pub mod cbor;
#[cfg(feature = "client")]
pub mod client;
#[cfg(feature = "client")]
mod echo;
pub mod fragment;
mod operation;
#[cfg(feature = "client")]
pub mod payload;
pub mod png;
#[cfg(feature = "client")]
mod proxy;
mod reader;
#[cfg(feature = "client")]
pub mod scan;
#[cfg(feature = "client")]
mod transport;

pub use operation::{Compression, Level, Operation};
pub use reader::{FrameError, Limits, Reader};
#[cfg(feature = "client")]
pub use transport::rosbridge;
