//! Where clients of a bridge connect that are to be disturbed: each address is one node.
//!
//! A client that connects to a proxy gets a connection of its own to the bridge, over which its frames go on. Only the
//! names of topics and services that are cut are others there ([`names`]), so that its messages pass through the
//! runner, which is a client of the bridge as well. Clients need no change but the address.

mod envelope;
mod names;
mod server;
mod standing;
mod tunnel;

pub(crate) use server::{Proxies, Proxy};
