//! Synthetic robots: campaigns whose results are computed, for tests.

#[cfg(test)]
mod drawn;
#[cfg(test)]
mod explored;
pub mod landscape;
