//! Diagnostics as text: for people, for line-based tools, for programs, for GitHub.

mod github;
mod human;
mod json;
mod short;
mod terminal;

pub use github::github;
pub use human::human;
pub use json::json;
pub use short::short;
