//! Systems of MQTT as a user meets them: brokers of mosquitto, vehicles that speak VDA 5050, and clients in JavaScript,
//! with the runner between them.
//!
//! `SESAME_MQTT` names a folder with the peers of `package.json`, `SESAME_PAHO` a Python with paho-mqtt; `./test` makes
//! both. Without them, or without mosquitto, a test says that it is skipped, and fails with `CI=true`.
#![cfg(all(test, unix))]

mod fleet;
mod peers;
mod refusals;
mod relaying;
mod scanning;
mod warehouse;
