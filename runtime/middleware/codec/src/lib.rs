//! Messages of ROS as bytes: read where somebody reads them, and written where something changed.
//!
//! A [`Codec`](codec::Codec) is made for one interface and for what of its messages is wanted. What is not wanted is
//! skipped, and what is not changed is copied byte for byte. Layouts, selections, reading and writing are the same for
//! all wire formats; what differs is a [`Dialect`](dialect::Dialect): [`cdr`] of ROS 2, and [`ros1`].
//!
//! | on the wire | in the language |
//! |---|---|
//! | `bool` | `bool` |
//! | `int8` … `uint64`, `byte`, `char` | `int`; a `uint64` of 2^63 or more cannot be read |
//! | `float32`, `float64` | `real` |
//! | `string`, `wstring` | `text`; invalid UTF-8 and UTF-16 is shown with replacement characters |
//! | arrays and sequences | `list` |
//! | a nested message of exactly `x`, `y`, `z`, all `float32` or all `float64` | `point` |
//! | a nested `builtin_interfaces/msg/Time` or `Duration`, `time` and `duration` of ROS 1 | `real` in seconds |
//! | any other message | a message |

pub mod cdr;
pub mod codec;
pub mod dialect;
mod difference;
pub mod error;
mod layout;
mod read;
pub mod ros1;
mod selection;
mod write;

#[cfg(test)]
mod tests;
