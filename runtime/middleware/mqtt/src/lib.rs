//! Systems whose messages go over brokers of MQTT, as fleets of mobile robots do. The runner is a client of each
//! broker.
//!
//! A message goes from the broker of its publisher to those of its subscribers. Where these are different ones, all
//! names stay as they are; where they are one, publishers of topics that are cut publish on `TOPIC/undisturbed`,
//! and the relay on `TOPIC`. Payloads are JSON. What nobody changed goes on byte for byte, with its retain flag and
//! properties.

mod address;
#[expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "an adapter: it waits for a broker on a thread"
)]
mod connection;
mod quick_ack;
mod routes;
#[expect(clippy::disallowed_methods, reason = "an adapter: it listens for a while")]
pub mod scan;
#[expect(clippy::disallowed_methods, reason = "an adapter: it waits for a broker")]
mod session;
#[expect(clippy::disallowed_methods, reason = "an adapter: it waits for brokers")]
mod transport;

pub use transport::mqtt;
