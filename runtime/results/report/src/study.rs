//! The page of a study: which tests were chosen for a lab, how far simulation and lab are apart, and what a
//! compensation changed.

mod before_after;
mod differences;
pub(super) mod figure;
mod page;
pub(super) mod provenance;
mod signals;
mod space;
#[cfg(test)]
pub(crate) mod tests;

pub use figure::Figure;
pub use page::{Study, Traces};
pub use space::Space;
