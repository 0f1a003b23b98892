//! Synthetic robots: campaigns whose results are computed, for tests.

#[cfg(test)]
mod exploration;
#[cfg(test)]
mod permitted_tests;
pub mod synthetic_robots;

/// A run of which nothing is known but that it completed, for tests of strategies that do not look at runs.
#[cfg(test)]
pub(crate) fn no_run() -> std::sync::Arc<sesame_base::observation::Observation> {
    use sesame_base::observation::{Observation, Outcome};
    std::sync::Arc::new(Observation::without_run(Outcome::Completed))
}
