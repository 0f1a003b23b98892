//! Systems of ROS 1 as a user meets them: Debian's master and nodes, with the runner between them.
//!
//! The peers are the programs in `tests/ros1/peers`; `SESAME_ROS1` names a Python that has rospy. Without it a test
//! says that it is skipped, and fails with `CI=true`.
#![cfg(all(test, unix))]
#![expect(clippy::unwrap_used, reason = "a test ends where something is missing")]
#![expect(clippy::disallowed_methods, clippy::disallowed_types, reason = "they start other programs and wait for them")]

mod core;
mod system;

mod faults;
mod relaying;
mod scanning;
mod services;
