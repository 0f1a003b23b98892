//! Systems that speak `MAVLink` over UDP, as PX4 and `ArduPilot` do. The runner sits between vehicles and their ground
//! station.
//!
//! Vehicles send to the address of a proxy. Each vehicle gets a link with its own socket to the ground station, so both
//! sides see as many peers as without the runner. A topic names a message, and may name the system and the component
//! that send it: `HEARTBEAT`, `1/HEARTBEAT`, `1/154/HEARTBEAT`. The runner forwards everything that no operation acts
//! on byte for byte, even if it is not `MAVLink`.

#[expect(clippy::disallowed_methods, clippy::disallowed_types, reason = "an adapter: it reads files")]
mod definitions;
mod frame;
#[expect(clippy::disallowed_methods, clippy::disallowed_types, reason = "an adapter: it has sockets, and waits")]
mod network;
#[expect(clippy::disallowed_methods, clippy::disallowed_types, reason = "an adapter: it listens at a socket")]
pub mod scan;

pub use network::mavlink;
