//! The rosbridge protocol, version 2, without its sockets: what peers say to each other, and how it is written.
//!
//! A peer sends [`Operation`]s, each in a frame of its own: as a text in JSON, or, for messages of topics on request, as
//! bytes in CBOR ([`cbor`]). What is too long for a frame is sent in pieces ([`fragment`]), and what is to be small as a
//! picture ([`png`]). [`Reader`] makes operations of frames, whatever way they come.
//!
//! Pure: the caller has the sockets and the clock. No input makes it panic or keep more than [`Limits`] says.

pub mod cbor;
pub mod fragment;
mod operation;
pub mod png;
mod reader;

pub use operation::{Compression, Level, Operation};
pub use reader::{FrameError, Limits, Reader};
