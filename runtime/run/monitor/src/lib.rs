//! Runtime monitors as conditional safety certificates, ConSerts ([SESAME 2023, §3.3.4, §4.5, §6.1.7]): which guarantee
//! holds, given the evidence.
//!
//! A monitor ([`sesame_plan::Monitor`]) has evidence, which is true, false or unknown; demands, which are guarantees of
//! other monitors; and guarantees, each with a gate over evidence and demands. Its *state* is the strongest guarantee
//! that holds, or the safe state if none does. A *decision* is a change of its state.
//!
//! - [`network`]: monitors compiled together, and a run of them: observations in, decisions out.
//! - [`why`]: the evidence that decided.
//! - [`check`]: guarantees that never or always hold, evidence that decides nothing, orders that contradict.
//! - [`score`]: hazards foreseen and missed, lead times, false alarms.
//! - [`compare`]: decisions on two recordings; [`difference`]: why they differ.
//! - [`tolerance`]: by how much messages may be late before decisions change.
//! - [`truth`], [`gate`], [`evidence`]: what these are made of.
//!
//! Nothing here knows messages or topics: whoever uses it evaluates the conditions of evidence and says what they came
//! to. Everything is a function of its arguments; no result depends on the machine or on wall time.

pub mod check;
mod circuit;
pub mod compare;
pub mod difference;
pub mod evidence;
pub mod gate;
pub mod network;
pub mod score;
pub mod tolerance;
pub mod truth;
pub mod why;

pub use network::{Changes, Decision, EvidenceChange, EvidenceId, Invalid, Network, Reading, Run, State};
pub use truth::Truth;
