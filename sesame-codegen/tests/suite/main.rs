//! What the generator writes, and how it treats what is there already.
#![cfg(test)]

mod command;
mod consert_originals;
mod emission;
mod hostile_checkout;
mod meaning;
mod mutated_imports;
mod notation;
mod odd_originals;
mod options;
mod originals;
mod placed;
mod plans;
mod random_originals;
mod regeneration;
mod said_of_originals;
mod scan;
mod surroundings;
