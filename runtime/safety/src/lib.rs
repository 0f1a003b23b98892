//! What makes a physical test safe, as geometry and arithmetic: no files, no plan, no results; callers bring those.
//!
//! A test that ends in a collision in simulation must not do so in the lab. [SESAME 2023, Section 4.3] lists ways to run
//! it nevertheless. For virtual objects and multi-robot position integration, what may collide is not there, and the
//! contact is found in the recorded poses: [`contact`], with [`trace`], [`alignment`], [`body`] and [`distance`].
//!
//! Lengths are metres, times seconds, angles radians, speeds metres per second. Everything is a function of its
//! arguments, with the same bits on every machine.

pub mod alignment;
pub mod body;
pub mod contact;
pub mod distance;
pub mod trace;

pub use parry3d_f64::math::{Pose, Rotation, Vector};
