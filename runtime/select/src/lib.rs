//! Which tests a physical laboratory performs: good ones that differ from each other, within a budget, chosen exactly.
//!
//! - [`Problem`]: tests with their points, qualities and costs, a budget, and the weight of diversity λ.
//! - [`choose`]: the choice with the greatest value, and whether that is proved.
//!
//! Everything is a function of its arguments; no result depends on the machine or on wall time.

mod choose;
mod diagonal;
mod incumbent;
mod instance;
mod node;
mod problem;
mod size;
mod start;
mod ties;
mod tree;

pub use choose::{Selection, State, choose};
pub use problem::{Invalid, Pairs, Problem, Test};
