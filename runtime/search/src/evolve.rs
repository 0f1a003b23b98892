//! Evolution of tests: how children are made, and what steers them towards cells that have few tests.

pub(crate) mod boost;
pub(crate) mod cells;
pub(crate) mod construct;
pub(crate) mod map_elites;
pub(crate) mod novelty;
pub(crate) mod predict;
pub(crate) mod variation;
