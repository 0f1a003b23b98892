//! What a run says, compared with a judge who knows everything.
//!
//! Random spaces, tests and simulators, the simulators of which crash, hang, publish what is not a number, and do not
//! subscribe to some of their topics. The **judge** sees the same run of the same simulator without its faults, and
//! every delivery; it computes each metric from the complete lists of messages by the words of the documentation, in
//! two passes and without any of the runtime's code. What the runtime says of a requirement never contradicts it.
//!
//! A case is a function of its number: a failure prints the number and the whole case, and `JUDGE_CASE=NUMBER` runs it
//! alone. `JUDGE_CASES=COUNT` shortens the long tests.
#![cfg(test)]
#![expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "times are a few seconds, and draws are made from numbers in 0..1"
)]

mod activations;
mod adapter;
mod broken_off;
mod case;
mod computations;
mod formulas;
mod hooks;
mod ledger;
mod metamorphic;
mod monitors;
#[expect(clippy::disallowed_methods, reason = "cases run side by side, as many as a variable says")]
mod properties;
mod robot;
mod temporal;
mod words;
