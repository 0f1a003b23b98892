//! What runs somewhere as the text of a space, whatever middleware it talks over. Pure: who listens, and who reads
//! folders, is elsewhere.
//!
//! Names, types and payloads come from a network, where anybody may have written them: what the language cannot say
//! becomes a comment, and no text of it anything else.

mod blocks;
mod checked;
mod comments;
mod expressible;
mod grouped_nodes;
mod groups;
mod named;
mod nodes;
mod origin;
mod payloads;
mod simulator;
#[cfg(test)]
mod tests;
mod text;
mod topics;
mod types;

pub use checked::{FILE, check_settings, checked_space};
pub use origin::Origin;
pub use payloads::{by_payloads, types_by_payloads};
pub use types::Types;
