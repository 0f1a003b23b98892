//! Definitions of messages: the text of `.msg`, `.srv` and `.idl` files of ROS as layouts, and that of the files of
//! [`mavlink`].
//!
//! Pure: it reads no files. A caller gives the text of each file to [`msg`], [`srv`], [`action()`] or [`idl`], collects
//! what comes out in a [`Catalogue`], and asks it for the layout of an interface with everything that it contains.
//! Files of ROS 1 are read by [`ros1`].

pub mod action;
pub mod bundle;
mod catalogue;
mod idl;
pub mod mavlink;
mod msg;
pub mod ros1;

pub use catalogue::{Catalogue, ResolveError};
pub use idl::idl;
pub use msg::{action, msg, srv};

use sesame_plan::WireType;

/// An interface as a file declares it.
#[derive(Debug, Clone, PartialEq)]
pub struct Definition {
    /// Its name with package and kind, for example `sensor_msgs/msg/JointState` or `std_srvs/srv/SetBool_Request`.
    pub name: String,
    /// Its fields, in order. In ROS 2, an interface without fields has the one that is on the wire in their place:
    /// `structure_needs_at_least_one_member`.
    pub fields: Vec<Field>,
    /// Its constants, in order; they are not on the wire.
    pub constants: Vec<Constant>,
}

/// A field of an interface.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// Its name.
    pub name: String,
    /// Its type. Interfaces in it have full names.
    pub ty: WireType,
}

/// A constant of an interface.
#[derive(Debug, Clone, PartialEq)]
pub struct Constant {
    /// Its name.
    pub name: String,
    /// Its value, as written.
    pub value: String,
}

/// What is wrong with a file.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {problem}")]
pub struct DefinitionError {
    /// The line, from 1.
    pub line: usize,
    /// The problem, in words for the user.
    pub problem: String,
}

/// The most values that a fixed array may hold: a layout is not a place for images.
const LONGEST_ARRAY: u32 = 1 << 24;

/// An interface of these fields.
fn definition(name: String, mut fields: Vec<Field>, constants: Vec<Constant>) -> Definition {
    if fields.is_empty() {
        let ty = WireType::Primitive { primitive: sesame_plan::Primitive::Uint8 };
        fields.push(Field { name: "structure_needs_at_least_one_member".to_owned(), ty });
    }
    Definition { name, fields, constants }
}

/// Whether this can be the name of a package, an interface or a field.
fn is_name(name: &str) -> bool {
    name.starts_with(|first: char| first.is_ascii_alphabetic())
        && name.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_')
}
