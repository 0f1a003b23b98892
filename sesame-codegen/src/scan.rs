//! What runs in a domain of ROS 2 as the text of a space. Pure: who listens, and who reads folders, is elsewhere.
//!
//! Names and types come from a network, where anybody may have written them: what the language cannot say becomes a
//! comment, and no text of it anything else.

mod blocks;
mod checked;
mod groups;
#[cfg(test)]
mod tests;
mod text;
mod types;

pub(crate) use checked::{FILE, checked_space};
pub(crate) use text::Origin;
pub(crate) use types::Types;

/// Whether this can be the name of a topic, a service or a node, with its `/` at the beginning.
fn is_ros_name(path: &str) -> bool {
    const LONGEST: usize = 247;
    let Some(relative) = path.strip_prefix('/') else { return false };
    let fits = |part: &str| {
        !part.is_empty()
            && !part.starts_with(|first: char| first.is_ascii_digit())
            && part.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_')
    };
    relative.len() <= LONGEST && relative.split('/').all(fits)
}
