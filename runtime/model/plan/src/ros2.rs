//! Systems of ROS: what they have in common, and how their messages are laid out on the wire; and nodes of ROS 2.

use serde::{Deserialize, Serialize};

use crate::NodeId;

/// What systems of ROS have in common, whichever way the runner reaches their nodes.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Ros {
    /// What simulation time is.
    pub clock: Clock,
    /// How the simulator is stepped; `None` for one that runs freely. Only a runner that
    /// [reaches nodes](crate::SimulatorProperties::reaches_nodes) steps one.
    pub step: Option<Stepping>,
    /// The service that sets the simulator to time zero, of type `std_srvs/srv/Empty` or `std_srvs/srv/Trigger`; `None`
    /// for one that is launched again for each test.
    pub reset: Option<String>,
    /// The layouts of all messages, each after those that it contains.
    pub interfaces: Vec<Interface>,
}

/// The nodes of a ROS 2 system, between which the runner stands as a node of its own.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ros2 {
    /// The domain (`ROS_DOMAIN_ID`) of the first worker; each further one has the next. The last one is at most 232.
    pub domain: u16,
}

/// What simulation time is.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Clock {
    /// The latest `rosgraph_msgs/msg/Clock` of this topic.
    Topic {
        /// The topic's name.
        path: String,
    },
    /// Wall time.
    #[default]
    Wall,
}

/// How a simulator is stepped.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Stepping {
    /// Simulation time of one step, in nanoseconds; positive.
    pub step_ns: u64,
    /// What takes a step.
    pub by: StepBy,
}

/// What makes a simulator take one step.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum StepBy {
    /// A call of a service of type `std_srvs/srv/Trigger` or `std_srvs/srv/Empty`, which answers after the step.
    Service {
        /// The service's name.
        path: String,
    },
    /// A `std_msgs/msg/Empty` on a topic; the step has been taken when the clock shows its end.
    Topic {
        /// The topic's name.
        path: String,
    },
}

/// How a topic is cut, so that its messages pass through the relay. It follows from all operations of the space, so
/// that its campaigns need the same remappings.
///
/// A topic that is not cut is only listened to. If it is cut, publishers are remapped to `TOPIC/undisturbed`, or to
/// `TOPIC/from/NODE`; the relay publishes on `TOPIC`, and on `TOPIC/to/NODE` for each subscriber of its own.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Wiring {
    /// Whether an operation may act on its messages.
    pub cut: bool,
    /// The publishers that operations distinguish (`from`).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub publishers: Vec<NodeId>,
    /// The subscribers that operations distinguish (`to`).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub subscribers: Vec<NodeId>,
    /// Whether the runner publishes there in addition to the nodes, which keep their names: it is a guest in their
    /// system. Such a topic is not cut.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub joined: bool,
}

/// The layout of a message: an interface of ROS.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Interface {
    /// Its name with package and kind, for example `sensor_msgs/msg/JointState`.
    pub name: String,
    /// Its fields, in the order of the wire.
    pub fields: Vec<InterfaceField>,
}

/// A field of an interface.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct InterfaceField {
    /// Its name.
    pub name: String,
    /// Its type.
    #[serde(rename = "type")]
    pub ty: WireType,
}

impl WireType {
    /// UTF-8 text of any length.
    pub const STRING: WireType = WireType::String { bound: None };

    /// UTF-16 text of any length.
    pub const WSTRING: WireType = WireType::WString { bound: None };

    /// The name of the interface that its values are, or that the elements of its lists and arrays are.
    pub fn interface(&self) -> Option<&str> {
        match self {
            WireType::Interface { name } => Some(name),
            WireType::Array { of, .. } | WireType::Sequence { of, .. } => of.interface(),
            WireType::Primitive { .. } | WireType::String { .. } | WireType::WString { .. } => None,
        }
    }

    /// The length of a text that is too long for this type, and the greatest length that is not: in bytes of UTF-8, or
    /// in units of UTF-16. `None` for a text that fits, and for a type other than text.
    pub fn exceeded_by(&self, text: &str) -> Option<(usize, u32)> {
        let (bound, length) = match self {
            WireType::String { bound } => ((*bound)?, text.len()),
            WireType::WString { bound } => ((*bound)?, text.encode_utf16().count()),
            _ => return None,
        };
        (length > bound as usize).then_some((length, bound))
    }
}

/// A type as it is on the wire.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum WireType {
    /// A number or a truth value.
    Primitive {
        /// Which.
        primitive: Primitive,
    },
    /// UTF-8 text.
    String {
        /// At most how many bytes; `None` for any number.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        bound: Option<u32>,
    },
    /// UTF-16 text.
    WString {
        /// At most how many units of two bytes; `None` for any number.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        bound: Option<u32>,
    },
    /// Another message.
    Interface {
        /// Its name.
        name: String,
    },
    /// A fixed number of values, at least one.
    Array {
        /// The type of the values.
        of: Box<WireType>,
        /// How many.
        length: u32,
    },
    /// Any number of values.
    Sequence {
        /// The type of the values.
        of: Box<WireType>,
        /// At most how many; `None` for any number.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        bound: Option<u32>,
    },
}

/// A number or a truth value on the wire, named as in `.msg` files. `byte` and `char` are `uint8` there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Primitive {
    /// One byte: 0 or 1.
    Bool,
    /// 8 bits, signed.
    Int8,
    /// 8 bits, unsigned.
    Uint8,
    /// 16 bits, signed.
    Int16,
    /// 16 bits, unsigned.
    Uint16,
    /// 32 bits, signed.
    Int32,
    /// 32 bits, unsigned.
    Uint32,
    /// 64 bits, signed.
    Int64,
    /// 64 bits, unsigned.
    Uint64,
    /// IEEE 754 single precision.
    Float32,
    /// IEEE 754 double precision.
    Float64,
}

impl Primitive {
    /// The one of this name in `.msg` files.
    pub fn named(name: &str) -> Option<Self> {
        Some(match name {
            "bool" => Primitive::Bool,
            "int8" => Primitive::Int8,
            "uint8" | "byte" | "char" => Primitive::Uint8,
            "int16" => Primitive::Int16,
            "uint16" => Primitive::Uint16,
            "int32" => Primitive::Int32,
            "uint32" => Primitive::Uint32,
            "int64" => Primitive::Int64,
            "uint64" => Primitive::Uint64,
            "float32" => Primitive::Float32,
            "float64" => Primitive::Float64,
            _ => return None,
        })
    }

    /// Its name in `.msg` files.
    pub const fn name(self) -> &'static str {
        match self {
            Primitive::Bool => "bool",
            Primitive::Int8 => "int8",
            Primitive::Uint8 => "uint8",
            Primitive::Int16 => "int16",
            Primitive::Uint16 => "uint16",
            Primitive::Int32 => "int32",
            Primitive::Uint32 => "uint32",
            Primitive::Int64 => "int64",
            Primitive::Uint64 => "uint64",
            Primitive::Float32 => "float32",
            Primitive::Float64 => "float64",
        }
    }

    /// How many bytes a value has. It is also its alignment in CDR, version 1.
    pub const fn size(self) -> usize {
        match self {
            Primitive::Bool | Primitive::Int8 | Primitive::Uint8 => 1,
            Primitive::Int16 | Primitive::Uint16 => 2,
            Primitive::Int32 | Primitive::Uint32 | Primitive::Float32 => 4,
            Primitive::Int64 | Primitive::Uint64 | Primitive::Float64 => 8,
        }
    }
}
