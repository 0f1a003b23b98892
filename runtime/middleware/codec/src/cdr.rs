//! CDR, the wire format of ROS 2: XCDR version 1, in both byte orders.
//!
//! A sample begins with an encapsulation header of four bytes, which says how it is encoded; alignment counts from
//! behind it. A `wstring` is the number of its code units and a `uint32` for each: CDR leaves that open, and the
//! implementations of ROS 2 do it so, without a zero at the end.

use std::borrow::Cow;

use sesame_plan::Primitive;

use crate::dialect::{ByteOrder, Dialect, Hidden};
use crate::error::CodecError;

/// Reads and writes samples of one interface, which is found by its whole name.
pub type Codec = crate::codec::Codec<Cdr>;

/// CDR as ROS 2 uses it.
#[derive(Debug)]
pub enum Cdr {}

/// The bits of the header's last byte that hold how many bytes follow the last field (DDS-XTypes 1.3, 7.6.3.1.2).
const PADDING_COUNT: u8 = 3;

impl Dialect for Cdr {
    const HEADER: usize = 4;
    const ALIGNED: bool = true;
    const BIG_ENDIAN: bool = true;
    const TERMINATED: bool = true;
    const WIDE: bool = true;
    const PADDING: usize = 7;
    // `rclpy` serialises into room for elements that are aligned, and hands out all of it, even if there are none.
    const OVERESTIMATED: usize = 4;

    fn byte_order(sample: &[u8]) -> Result<ByteOrder, CodecError> {
        match sample {
            [0, 0, _, _, ..] => Ok(ByteOrder::Big),
            [0, 1, _, _, ..] => Ok(ByteOrder::Little),
            [first, second, _, _, ..] => Err(CodecError::Encoding(*first, *second)),
            _ => Err(CodecError::Short { path: String::new(), length: 0, needed: Self::HEADER - sample.len() }),
        }
    }

    fn write_header(bytes: &mut Vec<u8>, came: Option<&[u8]>) {
        match came {
            // Some writers say in the last byte how many bytes follow the last field. Now none do; a reader would cut
            // the message instead.
            Some([first, second, third, last, ..]) => bytes.extend([*first, *second, *third, last & !PADDING_COUNT]),
            _ => bytes.extend([0, 1, 0, 0]),
        }
    }

    fn type_name(interface: &str) -> Cow<'_, str> {
        interface.into()
    }

    fn has_field(_: &str) -> bool {
        true
    }

    fn hidden(_: &str, _: &[&str]) -> Option<Hidden> {
        None
    }

    fn seconds(type_name: &str) -> Option<Primitive> {
        let is_time = matches!(type_name, "builtin_interfaces/msg/Time" | "builtin_interfaces/msg/Duration");
        is_time.then_some(Primitive::Int32)
    }
}

#[cfg(test)]
mod tests;
