//! The space of tests that a campaign permits: which operations, when, how strong.
//!
//! It is defined in one place, [`permitted`], from which all strategies draw and to which crossover and mutation return.

pub mod apart;
pub mod choice;
pub mod condition;
pub mod initial;
pub mod permitted;
pub mod range;
