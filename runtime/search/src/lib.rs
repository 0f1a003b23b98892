//! How a campaign's tests are found: strategies that are asked for tests and told their results.
//!
//! A [`Strategy`] has no clock, no files and no processes. What it asks for depends on the plan, the seed and what it
//! was told, so a campaign is resumed by telling a new strategy the recorded results. Randomness comes from a stream
//! per child, derived from the seed, so nothing depends on the order in which the tests of a generation are run.
//!
//! [`strategy`] gives the strategy of a campaign, [`strategy_of_task`] that of any task of a runner. All draw from one
//! [`space`] of tests. [`sspr`] reduces a test to a point; [`coverage`] counts in which cells of a grid points lie.
//! Objectives are oriented once, by [`fitness`]: from there on smaller is better, in fronts and hypervolumes too.

mod catalogue;
mod confirmed_front;
pub mod coverage;
mod error;
mod evolve;
mod falsification;
mod fixed_tests;
pub mod indicators;
mod interleaved;
mod margin;
mod neighbours;
mod objective;
mod sample;
pub mod shrink;
pub mod space;
pub mod sspr;
mod stop;
mod strategy;
pub mod test_key;
#[cfg(any(test, feature = "testing"))]
pub mod testing;
pub mod variation;

pub use catalogue::{strategy, strategy_of_task};
pub use confirmed_front::{ConfirmedFront, GenerationTest, aggregate};
pub use error::SearchError;
pub use evolve::variation::{Rates, TestVariation};
pub use margin::{confirmed_margins, margins};
pub use neighbours::Neighbours;
pub use objective::{fitness, fitness_of};
pub use stop::{StopRules, discovery_at_most};
pub use strategy::{Candidate, Evaluated, Strategy};
