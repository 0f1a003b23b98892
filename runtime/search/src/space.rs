//! The space of tests that a campaign permits: which operations, when, how strong.
//!
//! It is defined in one place, [`TestSpace`]. All strategies draw from it, and crossover and mutation return to it.

pub(crate) mod condition;
pub(crate) mod heard;
pub(crate) mod initial;
pub(crate) mod parameter_space;
pub(crate) mod range;
pub(crate) mod separation;
pub(crate) mod strongest;
pub(crate) mod test_space;

pub use heard::Heard;
pub use initial::fresh_test;
pub use parameter_space::ParameterSpace;
pub use range::Range;
pub use strongest::Strongest;
pub use test_space::{ActivationSpace, OperationSpace, TestSpace};
