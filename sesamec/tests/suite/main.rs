//! What the command does and says, and what it makes of files of the original platform.
#![cfg(test)]

mod command;
mod consert_originals;
mod hostile_checkout;
mod meaning;
mod mutated_imports;
mod notation;
mod odd_originals;
mod originals;
#[expect(dead_code, reason = "the tests of the generator need more of them")]
#[path = "../../../sesame-codegen/tests/suite/plans.rs"]
mod plans;
mod random_originals;
mod recordings;
mod said_of_originals;
mod scan;
