//! SimlogAPI with peers that others wrote: grpcio, with what its tools make of the same files.
//!
//! `examples/set_up.py` makes the environment of the peers, and `SESAME_SIMLOG` names its Python. A test without it
//! says that it is skipped, and fails with `CI=true`.

#![cfg(all(feature = "client", feature = "server"))]
#![expect(clippy::disallowed_methods, clippy::disallowed_types, reason = "they start other programs and wait for them")]

mod peer;
mod recorder;

mod client;
mod monitors;
mod scanning;
mod served;
#[cfg(feature = "tls")]
mod tls;
mod version2;
mod version3;
