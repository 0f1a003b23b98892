//! Functions with known answers, over the unit box: what the strategies are measured on, in tests and benchmarks. No
//! campaign uses them.

mod falsification;
mod multi_objective;
mod real_variation;
mod transmission;

pub use falsification::FalsificationProblem;
pub use multi_objective::{Problem, approximate, approximate_dtlz2, dtlz2};
pub use real_variation::{RealVariation, binary_crossover, polynomial_mutation};
