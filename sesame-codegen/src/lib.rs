//! To be written.

pub mod lower;
pub mod plan;
