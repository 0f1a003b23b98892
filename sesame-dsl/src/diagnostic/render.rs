//! Text from diagnostics: for people, for one-line tools, for programs.

mod human;
mod json;
mod short;

pub use human::human;
pub use json::json;
pub use short::short;
