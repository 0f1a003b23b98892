//! The terms of a run that all crates above this one share.
//!
//! Simulation time; whether a condition over metrics holds, and whether it ever can, by bounds on [`differences`];
//! when an operation is active; the result of one run ([`observation`]), which of its wires fell silent ([`silence`]),
//! its verdicts on requirements ([`verdict`]), and when a bound on a robustness was lost ([`robustness`]). Everything
//! here is a function of its arguments, without files, clocks or processes.

pub mod activation;
pub mod condition;
pub mod differences;
pub mod gathered;
pub mod hazard;
pub mod latency;
pub mod observation;
pub mod robustness;
pub mod shell;
pub mod silence;
pub mod test_number;
pub mod time;
pub mod verdict;
pub mod visible;
