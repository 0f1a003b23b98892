//! Evolution of tests: how children are made, and what steers them towards cells that have few tests.

pub mod boost;
pub mod cells;
pub mod construct;
pub mod constructing;
pub mod map_elites;
pub mod novelty;
pub mod predict;
pub mod variation;
