//! Synthetic robots: campaigns whose results are computed, for tests.

#[cfg(test)]
mod exploration;
#[cfg(test)]
mod permitted_tests;
pub mod synthetic_robots;
