//! The KUKA gearbox cell of the SESAME examples, as a simulator to fuzz.
//!
//! Three six-axis arms and two sliding conveyors carry gearboxes through a cell with people in it. A PLC sends joint
//! targets every step; the arms follow them within the limits of their drives; zones measure how near the grippers
//! come. `README.md` describes the topics, the layout and the effects of disturbances.
//!
//! The model includes kinematics, drives with their limits and lags, the PLC's sequence with its interlocks, distances.
//! It does not include contact (an arm that is driven into a conveyor or a neighbour passes through it, which the
//! distance shows), the dynamics that couple joints, and payload.

pub mod arm;
mod cell;
pub mod conveyor;
pub mod geometry;
pub mod kinematics;
pub mod lab;
pub mod noise;
pub mod plc;
pub mod program;
pub mod safety;
pub mod sequence;
pub mod servo;
pub mod zones;

pub use cell::{Cell, GRIPPER_SPEED_TOPIC, NoisyCell, RealCell, TransportCell};
pub use plc::CYCLE_TIME_TOPIC;
pub use program::TAKT_SECONDS;
pub use sequence::{IN_POSITION_MONITORING, IN_POSITION_TOLERANCE};
