//! Which tests a physical laboratory performs: good ones that differ from each other, within a budget, chosen exactly.
//!
//! - [`Problem`]: tests with their points, qualities and costs, a budget, and the weight of diversity λ.
//! - [`choose`]: the choice with the greatest value, and whether that is proved.
//! - [`sweep`]: all λ at which the choice changes.
//! - [`marginal()`]: what more budget would buy.
//! - [`ranking`]: qualities of tests from their metrics.
//!
//! Tests that were performed already are forced, with what is left of the budget and cost 0.
//!
//! Everything is a function of its arguments; no result depends on the machine or on wall time.

mod choose;
mod diagonal;
mod incumbent;
mod instance;
mod marginal;
mod problem;
pub mod ranking;
mod size;
mod start;
mod subproblem;
pub mod sweep;
mod ties;
mod tree;

pub use choose::{Selection, State, choose};
pub use marginal::{Marginal, marginal};
pub use problem::{Invalid, Pairs, Problem, Test};
