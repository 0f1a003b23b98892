//! ROS 2: the runner as a node between real nodes.
//!
//! The codec of messages is pure: [`sesame_codec::cdr`]. The node is an adapter around it, over DDS in Rust alone:
//! nothing of ROS is needed to build or run it.

mod dds;
mod graph;
mod layouts;
mod lifecycle;
mod names;
mod node_service;
mod parameters;
pub mod scan;
mod transport;

pub use transport::ros2;
