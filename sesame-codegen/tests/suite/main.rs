//! What the generator writes, and how it treats what is there already.
#![cfg(test)]

mod emission;
mod hostile_checkout;
mod options;
mod placed;
mod plans;
mod regeneration;
mod surroundings;
