//! Behaviour across crates, as a user meets it.
#![cfg(test)]

mod declarative;
mod faults;
mod first_front;
mod interruption;
mod kuka_cell;
mod regeneration;
mod search;
mod stl;
mod tampering;
