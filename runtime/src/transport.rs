//! How a runner reaches its simulator.

/// Makes a connection to the simulator; generated code names the one its space declares.
#[derive(Debug, Clone, Copy)]
pub struct Connect {}

/// A simulator that is a Rust type inside the runner.
pub const fn in_process<S: crate::simulator::Simulator + 'static>() -> Connect {
    Connect {}
}
