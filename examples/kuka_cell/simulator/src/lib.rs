//! The KUKA gearbox cell of the SESAME examples, as a simulator to fuzz.
//!
//! Three six-axis arms and two sliding conveyors carry gearboxes through a cell with people in it. A PLC sends joint
//! targets every step; the arms follow them as their drives can; zones tell how near the grippers come. See `README.md`
//! for the topics, the layout and what disturbances do.
//!
//! What is modelled: kinematics, drives with their limits and lags, the PLC's sequence with its interlocks, distances.
//! What is not: contact (an arm driven into a conveyor or a neighbour passes through it, and the distance tells), the
//! dynamics that couple joints, and payload.

pub mod arm;
mod cell;
pub mod conveyor;
pub mod geometry;
pub mod kinematics;
pub mod noise;
pub mod plc;
pub mod program;
pub mod sequence;
pub mod servo;
pub mod zones;

pub use cell::{Cell, GRIPPER_SPEED_TOPIC, NoisyCell};
pub use plc::CYCLE_TIME_TOPIC;
pub use program::TAKT_SECONDS;
pub use sequence::{IN_POSITION_MONITORING, IN_POSITION_TOLERANCE};
