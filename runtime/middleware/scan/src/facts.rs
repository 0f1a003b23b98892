//! What was found, as data.

use serde::Serialize;
use sesame_plan::{Dialect, SimulatorKind};

/// What was found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Facts {
    /// The system that was scanned.
    pub system: System,
    /// How long it was listened to, in seconds of wall time.
    pub seconds: f64,
    /// Whether there was more than a scan keeps.
    pub cut: bool,
    /// The nodes, by name, without those of tools; none if the middleware does not reveal nodes.
    pub nodes: Vec<FoundNode>,
    /// The topics, by path, without those that every node has.
    pub topics: Vec<FoundTopic>,
    /// The services, by path, without those that every node has.
    pub services: Vec<FoundService>,
    /// The actions of ROS 2, by path. Their topics and services are not listed elsewhere.
    pub actions: Vec<FoundAction>,
    /// The types of the topics, and those that they contain, by name.
    pub types: Vec<FoundType>,
}

impl Facts {
    /// Nothing yet of a system.
    pub fn of(system: System) -> Self {
        Facts {
            system,
            seconds: 0.0,
            cut: false,
            nodes: Vec::new(),
            topics: Vec::new(),
            services: Vec::new(),
            actions: Vec::new(),
            types: Vec::new(),
        }
    }
}

/// A system that runs.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum System {
    /// Nodes of ROS 2.
    Ros2 {
        /// Their domain.
        domain: u16,
    },
    /// Nodes of ROS 1.
    Ros1 {
        /// The address of their master.
        master: String,
    },
    /// ROS nodes behind a rosbridge server.
    Rosbridge {
        /// The address of the server.
        url: String,
        /// Which ROS is behind it.
        dialect: Dialect,
        /// Whether it has the services of rosapi, which list the system.
        rosapi: bool,
    },
    /// Clients of an MQTT broker.
    Mqtt {
        /// The address of the broker.
        url: String,
    },
    /// A simulator that speaks SimlogAPI.
    Simlog {
        /// Its address.
        url: String,
        /// The version of the protocol.
        protocol: u8,
        /// The length of a step in milliseconds.
        step_ms: u64,
        /// How many steps it took for the scan.
        steps: u64,
    },
    /// Vehicles that speak `MAVLink`.
    Mavlink {
        /// The address to which they send.
        url: String,
        /// The files that define their messages.
        definitions: Vec<String>,
    },
}

impl System {
    /// The kind of simulator that it is in a space.
    pub const fn kind(&self) -> SimulatorKind {
        match self {
            System::Ros2 { .. } => SimulatorKind::Ros2,
            System::Ros1 { .. } => SimulatorKind::Ros1,
            System::Rosbridge { .. } => SimulatorKind::Rosbridge,
            System::Mqtt { .. } => SimulatorKind::Mqtt,
            System::Simlog { .. } => SimulatorKind::Simlog,
            System::Mavlink { .. } => SimulatorKind::Mavlink,
        }
    }

    /// The ROS that it speaks; ROS 2 if it speaks none.
    pub fn dialect(&self) -> Dialect {
        match self {
            System::Rosbridge { dialect, .. } => *dialect,
            _ => self.kind().properties().ros.unwrap_or_default(),
        }
    }

    /// Whether its messages have types of ROS.
    pub fn is_ros(&self) -> bool {
        self.kind().properties().ros.is_some()
    }
}

/// A node.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct FoundNode {
    /// Its name with its namespace, for example `/cell/arm`.
    pub name: String,
    /// How many nodes have this name: more than 1 is a mistake of the system.
    pub count: usize,
    /// Whether it answers, in ROS 1: the master also lists nodes that ended without unregistering.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub answers: Option<bool>,
    /// The topics that it publishes.
    pub publishes: Vec<String>,
    /// The topics to which it subscribes.
    pub subscribes: Vec<String>,
    /// The services that it serves.
    pub serves: Vec<String>,
    /// The services of which it is a client, as far as the middleware reveals them.
    pub calls: Vec<String>,
}

/// A topic. A path that is used with several types is listed with each.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct FoundTopic {
    /// Its path.
    pub path: String,
    /// Its type, if it is known: in ROS a name such as `sensor_msgs/msg/JointState`, or the DDS name of a type from
    /// elsewhere; otherwise the name of a message in `types`, or `float64`, `int64`, `bool`, `string` or a list of
    /// these, such as `float64[]`.
    #[serde(rename = "type", skip_serializing_if = "Option::is_none")]
    pub ty: Option<String>,
    /// The hash of the type, as a publisher or subscriber announces it; in ROS 1 the MD5 of its definition.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hash: Option<String>,
    /// The node of each publisher; `?` for an unknown node.
    pub publishers: Vec<String>,
    /// The node of each subscriber, in the same way.
    pub subscribers: Vec<String>,
    /// Whether all publishers offer to be reliable, in ROS 2.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reliable: Option<bool>,
    /// Whether all publishers keep messages for late subscribers (transient local), in ROS 2.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub transient_local: Option<bool>,
    /// Whether a publisher keeps its last message for late subscribers, in ROS 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub latching: Option<bool>,
    /// Whether messages were published to be retained by the broker, in MQTT.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub retained: Option<bool>,
    /// The highest quality of service of its messages, in MQTT: 0, 1 or 2.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub quality: Option<u8>,
    /// Whether the simulator has the name under which the topic is cut, in version 3 of SimlogAPI.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub can_be_cut: Option<bool>,
    /// The messages that arrived.
    pub messages: u64,
    /// The messages per second of wall time between the first and the last, if there were two.
    pub rate: Option<f64>,
    /// Why nothing is known about its messages, if there is a particular reason.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub problem: Option<String>,
}

/// A service.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct FoundService {
    /// Its path.
    pub path: String,
    /// Its type, for example `std_srvs/srv/Trigger`, if it is known.
    #[serde(rename = "type", skip_serializing_if = "Option::is_none")]
    pub ty: Option<String>,
    /// The node of each server; `?` for an unknown node.
    pub servers: Vec<String>,
    /// The node of each client, in the same way, as far as the middleware reveals it.
    pub clients: Vec<String>,
}

/// An action.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct FoundAction {
    /// Its path.
    pub path: String,
    /// Its type, for example `nav2_msgs/action/NavigateToPose`; empty if it is unknown.
    #[serde(rename = "type")]
    pub ty: String,
    /// The node of each server; `?` for an unknown node.
    pub servers: Vec<String>,
    /// The node of each client, in the same way.
    pub clients: Vec<String>,
}

/// A type of messages.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct FoundType {
    /// Its name, for example `sensor_msgs/msg/JointState`.
    pub name: String,
    /// Where its layout comes from.
    pub source: TypeSource,
    /// Its fields, in ROS in the order of the wire; none if its layout is unknown.
    pub fields: Vec<FoundField>,
    /// Fields of payloads in JSON that a space cannot declare.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub left_out: Vec<LeftOut>,
    /// Why its layout is unknown or cannot be used.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub problem: Option<String>,
}

/// Where the layout of a type comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum TypeSource {
    /// It needs no folder: `sesamec` knows it.
    Known,
    /// A folder has its definition.
    Folder,
    /// A node, a publisher or a bridge described it.
    Node,
    /// It is what the payloads that came have in common.
    Payloads,
    /// A file of a dialect of `MAVLink` defines it.
    Dialect,
    /// Nowhere.
    Unknown,
}

/// A field of a type.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct FoundField {
    /// Its name.
    pub name: String,
    /// Its type, as in a `.msg` file.
    #[serde(rename = "type")]
    pub ty: String,
    /// Its unit, as its definition has it, in `MAVLink`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// A value that came, in words, in `MAVLink`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sample: Option<String>,
    /// Whether some messages in JSON lacked it.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub optional: bool,
}

/// A field that a space cannot declare.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct LeftOut {
    /// Its name.
    pub name: String,
    /// The reason, in a clause.
    pub why: String,
}
