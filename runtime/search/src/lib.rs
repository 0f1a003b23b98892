//! How a campaign's tests are found: strategies that are asked for tests and told what came out.
//!
//! A [`Strategy`] has no clock, no files and no processes. What it asks depends on the plan, the seed and what it was
//! told, so a campaign is resumed by telling a new strategy the stored results again. Randomness comes from a stream per
//! child, derived from the seed, so nothing depends on the order in which the tests of a generation are run.
//!
//! The contract is in [`strategy`]; which strategy a plan names, in [`catalogue`]. All draw from one [`space`] of tests.
//! [`sspr`] reduces a test to a point, [`coverage`] counts in which cells of a grid points lie. Objectives are oriented
//! once, in [`objective`]: from there on smaller is better, in fronts and hypervolumes too.

pub mod catalogue;
pub mod confirming;
pub mod coverage;
pub mod evolve;
pub mod falsification;
pub mod indicators;
pub mod known;
pub mod margin;
pub mod neighbours;
pub mod objective;
pub mod repeat;
pub mod sample;
pub mod shrink;
pub mod space;
pub mod sspr;
pub mod stop;
pub mod strategy;
#[cfg(any(test, feature = "testing"))]
pub mod testing;

pub use catalogue::{needs_courses, needs_margins, strategy};
pub use confirming::{Confirming, Judged};
pub use evolve::map_elites::MapElites;
pub use evolve::predict::Course;
pub use evolve::variation::TestVariation;
pub use falsification::Falsification;
pub use known::Known;
pub use margin::margins;
pub use neighbours::Neighbours;
pub use objective::{fitness, fitness_of, in_unit};
pub use repeat::Repeat;
pub use sample::in_turn::{InTurn, Sampling};
pub use sample::latin_hypercube::LatinHypercube;
pub use sample::random::Random;
pub use sample::sobol::Sobol;
pub use sesame_optimise::dominance::{Fitness, Unfit};
pub use sesame_optimise::falsify::Margin;
pub use sesame_optimise::front::Front;
pub use sesame_optimise::nsga2::Nsga2;
pub use shrink::Shrink;
pub use space::permitted::{Permitted, SearchError};
pub use stop::StopRules;
pub use strategy::{Candidate, Evaluated, Strategy};
