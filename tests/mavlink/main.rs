//! Systems of `MAVLink` as a user meets them: a vehicle and a ground station with pymavlink, and the runner between
//! them.
//!
//! `SESAME_MAVLINK` names the Python of the example; `./test` makes it. Without it a test says that it is skipped, and
//! fails with `CI=true`.
#![cfg(all(test, unix))]

mod example;
mod peers;
mod relaying;
mod scanning;
