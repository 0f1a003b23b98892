//! What a run is told in, and what all crates above it share.
//!
//! Simulation time; whether a condition over metrics holds, and whether it ever can; when an operation is active; what
//! one run showed ([`observation`]), and what that says about a requirement ([`verdict`]). Everything here is a
//! function of its arguments: no files, no clocks, no processes.

pub mod activation;
pub mod condition;
pub mod decimal;
pub mod observation;
pub mod test_number;
pub mod time;
pub mod verdict;
pub mod visible;
