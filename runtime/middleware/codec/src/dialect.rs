//! What differs between the wire formats of ROS.

use std::borrow::Cow;
use std::fmt::Debug;

use sesame_plan::Primitive;

use crate::error::CodecError;

/// The order in which the bytes of a number come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ByteOrder {
    /// The least significant one first.
    Little,
    /// The most significant one first.
    Big,
}

/// A wire format. Everything that it does not say is the same in all of them: numbers, arrays and messages have no
/// frame, and the length of a text or of a sequence is a `uint32` before it.
pub trait Dialect: Debug {
    /// How many bytes before the first field say how the message is encoded. Alignment counts from behind them.
    const HEADER: usize;
    /// Whether numbers and lengths begin at multiples of their size.
    const ALIGNED: bool;
    /// Whether a message may be big-endian; else all are little-endian.
    const BIG_ENDIAN: bool;
    /// Whether a zero follows the bytes of a `string`, and counts as one of them.
    const TERMINATED: bool;
    /// Whether there is `wstring`, whose code units have four bytes each.
    const WIDE: bool;
    /// How many bytes may follow the last field.
    const PADDING: usize;
    /// How many more bytes may follow it for each length that is zero.
    const OVERESTIMATED: usize;

    /// The order of bytes in a message, as its header says.
    fn byte_order(message: &[u8]) -> Result<ByteOrder, CodecError>;

    /// Writes the header of a message: of a changed one, from the message that came, or else of one that is written
    /// anew and is little-endian.
    fn write_header(bytes: &mut Vec<u8>, came: Option<&[u8]>);

    /// The name by which an interface is found.
    fn type_name(interface: &str) -> Cow<'_, str>;

    /// Whether a field of a layout is on the wire.
    fn has_field(name: &str) -> bool;

    /// The number before the fields of a type that a layout with only these fields does not have.
    fn hidden(type_name: &str, fields: &[&str]) -> Option<Hidden>;

    /// The type of the seconds, if a type of the fields `sec` and `nanosec` is a time or a duration.
    fn seconds(type_name: &str) -> Option<Primitive>;

    /// How many bytes are skipped from a place, counted from behind the header, to the next multiple of an alignment,
    /// which is a power of two.
    fn padding(at: usize, align: usize) -> usize {
        if Self::ALIGNED { at.wrapping_neg() & (align - 1) } else { 0 }
    }
}

/// A number that is on the wire and in no layout.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Hidden {
    /// Its name where layouts have it.
    pub name: &'static str,
    /// Its type.
    pub primitive: Primitive,
}
