//! What the generator writes, and how it treats what is there already.

mod compiled;
mod emission;
mod plans;
mod regeneration;
mod surroundings;
