//! Messages as ROS 1 serialises them: little-endian, without alignment, each behind the other.
//!
//! What is not read is skipped, and what is not changed is copied byte for byte. Layouts may be those of ROS 1 or those
//! of ROS 2: a `std_msgs/Header` without the field `seq`, which ROS 2 does not have, gets it on the wire, and a message
//! that in ROS 2 has the one field `structure_needs_at_least_one_member` is empty.
//!
//! | on the wire | in the language |
//! |---|---|
//! | `bool` | `bool` |
//! | `int8` … `uint64`, `byte`, `char` | `int`; a `uint64` of 2^63 or more cannot be read |
//! | `float32`, `float64` | `real` |
//! | `string` | `text`; invalid UTF-8 is shown with replacement characters |
//! | arrays | `list` |
//! | a nested message of exactly `x`, `y`, `z`, all `float32` or all `float64` | `point` |
//! | `time` or `duration`: a nested `builtin_interfaces/msg/Time` or `Duration` | `real` in seconds |
//! | any other message | a message |

mod error;
mod layout;
mod read;
mod write;

#[cfg(test)]
mod tests;

use std::sync::Arc;

use sesame_plan::Interface;
use sesame_relay::value::Value;
use sesame_relay::wire::Wanted;

pub(crate) use self::error::LARGEST;
pub use self::error::{CodecError, LayoutError};
use self::layout::{Layout, Selection};
use self::read::Input;

/// Reads and writes the messages of one interface.
#[derive(Debug)]
pub struct Codec {
    layout: Layout,
    selection: Selection,
}

impl Codec {
    /// A codec for the interface of this name, with or without `/msg/` in it, which reads what is wanted. Each
    /// interface comes after those that it contains.
    pub fn new(interfaces: &[Interface], name: &str, wanted: &Wanted) -> Result<Self, LayoutError> {
        let layout = Layout::new(interfaces, name)?;
        let selection = layout.select(wanted);
        Ok(Codec { layout, selection })
    }

    /// Reads a message, without the length before it: a record with the fields that are wanted, which remembers the
    /// bytes.
    ///
    /// The whole message is checked: one that is too short or too long is an error, wherever that is.
    pub fn read(&self, message: Arc<[u8]>) -> Result<Value, CodecError> {
        read::read(&self.layout, &self.selection, message)
    }

    /// Writes a message, without the length before it. One that was read and not changed is the bytes from which it was
    /// read; of a changed one, everything that was not changed or not read is copied from there. Of one that was not
    /// read, fields that it lacks are zero or empty.
    ///
    /// Whole numbers beyond the range of their field become its nearest number, reals are rounded to the nearest one
    /// that their field holds, and a list ends where its type does.
    pub fn write(&self, message: &Value) -> Result<Arc<[u8]>, CodecError> {
        write::write(&self.layout, &self.selection, message)
    }

    /// Where a layout that others have differs from this one, in a phrase. The number in headers makes no difference.
    pub(crate) fn difference(&self, interfaces: &[Interface], name: &str) -> Option<String> {
        match Layout::new(interfaces, name) {
            Ok(other) => self.layout.difference(&other),
            Err(error) => Some(error.to_string()),
        }
    }

    /// Whether these bytes are a message of this layout.
    pub fn check(&self, message: &[u8]) -> Result<(), CodecError> {
        let mut input = Input::new(message);
        input.skip_shape(&self.layout, self.layout.message())?;
        input.end()
    }
}
