//! Systems of ROS 2 as a user meets them: real peers of three middlewares, with the runner between them.
//!
//! The peers are the programs in `peers/`; `examples/set_up.py` makes the environments in which they run, and the
//! variables `SESAME_ROS2_…` name their Pythons. A test without its peers says that it is skipped, and fails with
//! `CI=true`.
#![cfg(all(test, unix))]

mod environment;
mod peer;
mod relaying;

mod actions;
mod budget;
mod codec;
mod examples;
mod faults;
mod fleet;
mod latched;
mod late_server;
mod links;
mod lock_step;
mod managed;
mod monitor;
mod prepared;
mod proxies;
mod rosbridge;
mod scans;
mod simlog;
mod soak;
mod vendors;
mod watch;
