//! Messages as ROS 1 serialises them: little-endian, without alignment, each field behind the other.
//!
//! Layouts may be those of ROS 1 or those of ROS 2: a `std_msgs/Header` without the field `seq`, which ROS 2 does not
//! have, gets it on the wire, and a message that in ROS 2 has the one field `structure_needs_at_least_one_member` is
//! empty. The length before a message as a whole is not part of it.

use std::borrow::Cow;

use sesame_interfaces::ros1::NOTHING;
use sesame_plan::Primitive;

use crate::dialect::{ByteOrder, Dialect, Hidden};
use crate::error::CodecError;

/// Reads and writes messages of one interface, which is found with or without `/msg/` in its name.
pub type Codec = crate::codec::Codec<Ros1>;

/// The serialisation of ROS 1.
#[derive(Debug)]
pub enum Ros1 {}

impl Dialect for Ros1 {
    const HEADER: usize = 0;
    const ALIGNED: bool = false;
    const BIG_ENDIAN: bool = false;
    const TERMINATED: bool = false;
    const WIDE: bool = false;
    const PADDING: usize = 0;
    const OVERESTIMATED: usize = 0;

    fn byte_order(_: &[u8]) -> Result<ByteOrder, CodecError> {
        Ok(ByteOrder::Little)
    }

    fn write_header(_: &mut Vec<u8>, _: Option<&[u8]>) {}

    fn type_name(interface: &str) -> Cow<'_, str> {
        sesame_interfaces::ros1::type_name(interface).into()
    }

    fn has_field(name: &str) -> bool {
        name != NOTHING
    }

    fn hidden(type_name: &str, fields: &[&str]) -> Option<Hidden> {
        let lacks_number = type_name == "std_msgs/Header" && !fields.contains(&"seq");
        lacks_number.then_some(Hidden { name: "seq", primitive: Primitive::Uint32 })
    }

    fn seconds(type_name: &str) -> Option<Primitive> {
        match type_name {
            "builtin_interfaces/Time" => Some(Primitive::Uint32),
            "builtin_interfaces/Duration" => Some(Primitive::Int32),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests;
