//! Messages in CDR, the wire format of ROS 2: XCDR version 1, in both byte orders.
//!
//! A sample begins with four bytes that say how it is encoded; alignment counts from behind them. What is not read is
//! skipped, and what is not changed is copied byte for byte.
//!
//! | on the wire | in the language |
//! |---|---|
//! | `bool` | `bool` |
//! | `int8` … `uint64`, `byte`, `char` | `int`; a `uint64` of 2^63 or more cannot be read |
//! | `float32`, `float64` | `real` |
//! | `string`, `wstring` | `text`; invalid UTF-8 and UTF-16 is shown with replacement characters |
//! | arrays and sequences | `list` |
//! | a nested message of exactly `x`, `y`, `z`, all `float32` or all `float64` | `point` |
//! | a nested `builtin_interfaces/msg/Time` or `Duration` | `real` in seconds |
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
pub use sesame_relay::wire::Wanted;

pub use self::error::{CodecError, LayoutError};
use self::layout::{Layout, Selection};

/// The bytes that say how a sample is encoded.
const HEADER: usize = 4;

/// How many bytes a code unit of a `wstring` has. CDR leaves that open; the implementations of ROS 2 write each unit of
/// UTF-16 as a `uint32`, behind their number and without a zero at the end.
const WIDE: usize = 4;

/// Reads and writes the messages of one interface.
#[derive(Debug)]
pub struct Codec {
    layout: Layout,
    selection: Selection,
}

impl Codec {
    /// A codec for the interface of this name, which reads what is wanted. Each interface comes after those that it
    /// contains.
    pub fn new(interfaces: &[Interface], name: &str, wanted: &Wanted) -> Result<Self, LayoutError> {
        let layout = Layout::new(interfaces, name)?;
        let selection = layout.select(wanted);
        Ok(Codec { layout, selection })
    }

    /// Reads a sample: a record with the fields that are wanted, which remembers the sample.
    ///
    /// The whole sample is checked: one that is too short or too long is an error, wherever that is.
    pub fn read(&self, sample: Arc<[u8]>) -> Result<Value, CodecError> {
        read::read(&self.layout, &self.selection, sample)
    }

    /// Writes a message. One that was read and not changed is the sample from which it was read; of a changed one,
    /// everything that was not changed or not read is copied from there. One that was not read is written in the byte
    /// order of most machines, and fields that it lacks are zero or empty.
    ///
    /// Whole numbers beyond the range of their field become its nearest number, reals are rounded to the nearest one
    /// that their field holds, and a list ends where its type does.
    pub fn write(&self, message: &Value) -> Result<Arc<[u8]>, CodecError> {
        write::write(&self.layout, &self.selection, message)
    }
}
