//! ROS 1: its messages ([`codec`]), the definitions of its types ([`definition`]), and the runner as a node between real
//! nodes.

pub mod codec;
pub mod definition;
