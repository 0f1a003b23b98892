//! Strategies that learn nothing from results: tests are drawn, one after the other.

pub mod decoded;
pub mod in_turn;
pub mod latin_hypercube;
pub mod random;
pub mod sobol;
