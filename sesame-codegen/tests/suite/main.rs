//! What the generator writes, and how it treats what is there already.
#![cfg(test)]

mod command;
mod compiled;
mod emission;
mod plans;
mod regeneration;
mod surroundings;
