//! ROS 2: its messages in CDR ([`cdr`]), and the runner as a node between real nodes.
//!
//! The codec is pure. The node is an adapter around it, over DDS in Rust alone: nothing of ROS is needed to build or
//! run it.

pub mod cdr;
#[cfg(feature = "node")]
mod dds;
#[cfg(feature = "node")]
mod graph;
#[cfg(feature = "node")]
mod names;
#[cfg(feature = "node")]
mod parameters;
#[cfg(feature = "node")]
pub mod scan;
#[cfg(feature = "node")]
mod transport;

#[cfg(feature = "node")]
pub use transport::ros2;
