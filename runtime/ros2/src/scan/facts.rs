//! What was seen, as data.

use serde::Serialize;

/// What was seen in a domain.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Facts {
    /// The domain.
    pub domain: u16,
    /// How long it was listened to, in seconds of wall time.
    pub seconds: f64,
    /// Whether there were more publishers and subscribers than a scan keeps: 10,000.
    pub cut: bool,
    /// The nodes, by name. Those that begin with `_`, which tools of ROS start, are left out.
    pub nodes: Vec<FoundNode>,
    /// The topics, by path, without `/rosout` and `/parameter_events`, which every node has.
    pub topics: Vec<FoundTopic>,
    /// The services, by path, without those for parameters and type descriptions, which every node has.
    pub services: Vec<FoundService>,
    /// The actions, by path. Their topics and services are not listed elsewhere.
    pub actions: Vec<FoundAction>,
    /// The types of the topics, and those that they contain, by name.
    pub types: Vec<FoundType>,
}

/// A node.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct FoundNode {
    /// Its name with its namespace, for example `/cell/arm`.
    pub name: String,
    /// How many nodes have this name: more than 1 is a mistake of the system.
    pub count: usize,
    /// The topics that it publishes.
    pub publishes: Vec<String>,
    /// The topics to which it subscribes.
    pub subscribes: Vec<String>,
    /// The services that it serves.
    pub serves: Vec<String>,
    /// The services of which it is a client.
    pub calls: Vec<String>,
}

/// A topic. A path that is used with several types is listed with each.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct FoundTopic {
    /// Its path.
    pub path: String,
    /// Its type, for example `sensor_msgs/msg/JointState`; of types that are none of ROS's, the name in DDS.
    #[serde(rename = "type")]
    pub ty: String,
    /// The hash of the type, as a publisher or subscriber announces it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hash: Option<String>,
    /// The node of each publisher; a participant that names no node is `?`.
    pub publishers: Vec<String>,
    /// The node of each subscriber, in the same way.
    pub subscribers: Vec<String>,
    /// Whether all publishers offer to be reliable.
    pub reliable: bool,
    /// Whether all publishers keep messages for late subscribers (transient local).
    pub transient_local: bool,
    /// The messages that arrived.
    pub messages: u64,
    /// The messages per second of wall time between the first and the last, if there were two.
    pub rate: Option<f64>,
}

/// A service.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct FoundService {
    /// Its path.
    pub path: String,
    /// Its type, for example `std_srvs/srv/Trigger`.
    #[serde(rename = "type")]
    pub ty: String,
    /// The node of each server; a participant that names no node is `?`.
    pub servers: Vec<String>,
    /// The node of each client, in the same way.
    pub clients: Vec<String>,
}

/// An action.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct FoundAction {
    /// Its path.
    pub path: String,
    /// Its type, for example `nav2_msgs/action/NavigateToPose`.
    #[serde(rename = "type")]
    pub ty: String,
}

/// A type of messages.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct FoundType {
    /// Its name, for example `sensor_msgs/msg/JointState`.
    pub name: String,
    /// Where its layout comes from.
    pub source: TypeSource,
    /// Its fields in the order of the wire; none if its layout is unknown.
    pub fields: Vec<FoundField>,
    /// Why its layout is unknown or of no use.
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
    /// A node described it.
    Node,
    /// Nowhere.
    Unknown,
}

/// A field of a type.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct FoundField {
    /// Its name.
    pub name: String,
    /// Its type, as in a `.msg` file.
    #[serde(rename = "type")]
    pub ty: String,
}
