//! What makes a physical test safe, as geometry and arithmetic: no files, no plan, no results; callers bring those.
//!
//! A test that ends in a collision in simulation must not do so in the lab. [SESAME 2023, Section 4.3] lists ways to
//! run it nevertheless; each has a module here:
//!
//! - [`expansion`]: safety zones are widened, so that there is time to respond; [`speed`] finds how fast a robot was.
//! - [`interlock`]: an interlock ends the test, and stands for the violation that it prevents.
//! - [`briefing`]: people intervene, and must know what to expect.
//! - [`contact`]: virtual objects and multi-robot position integration. What may collide is not there, and the contact
//!   is found in the recorded poses: [`trace`], [`alignment`], [`body`], [`distance`].
//! - [`coupling`]: whether the recorded motion depends on what was not there, in which case that method does not hold.
//!
//! Lengths are metres, times seconds, angles radians, speeds metres per second. Everything is a function of its
//! arguments, with the same bits on every machine.

pub mod alignment;
pub mod body;
pub mod briefing;
pub mod contact;
pub mod coupling;
pub mod distance;
pub mod expansion;
pub mod interlock;
pub mod speed;
pub mod trace;

pub use parry3d_f64::math::{Pose, Rotation, Vector};
