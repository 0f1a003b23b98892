//! Strategies that learn nothing from results: tests are drawn, one after the other.

pub(crate) mod decode;

pub(crate) mod grid;
pub(crate) mod latin_hypercube;
pub(crate) mod random;
pub(crate) mod sampled_search;
pub(crate) mod sobol;
