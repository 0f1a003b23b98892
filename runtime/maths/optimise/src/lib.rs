//! Search on vectors, and what measures it: no plan, no robots, usable as it is.
//!
#![doc = include_str!("../README.md")]
//!
//! # Modules
//!
//! - [`nsga2`], with its parts: [`dominance`], [`sorting`], [`crowding`], [`selection`].
//! - [`nsga3`]: survival by reference points, for three and more objectives.
//! - [`front`]: the non-dominated solutions of all that were evaluated.
//! - [`hypervolume`] and [`igd`]: how good a front is.
//! - [`sobol`]: low-discrepancy points.
//! - [`falsify`]: looking for a violation where evaluations are expensive, by a Gaussian process.
//! - [`problems`]: functions with known answers, for tests and benchmarks.

pub mod crowding;
pub mod dominance;
pub mod falsify;
pub mod front;
pub mod hypervolume;
pub mod igd;
pub mod nsga2;
pub mod nsga3;
pub mod problems;
pub mod selection;
pub mod sobol;
pub mod sorting;
