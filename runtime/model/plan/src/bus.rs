//! A system whose messages go over a bus: a server of rosbridge, a broker of MQTT, a ROS 1 master.

use serde::{Deserialize, Serialize};

use crate::NodeId;

/// Where a bus is, and what a runner shows to be let in.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Remote {
    /// Its address, for example `ws://127.0.0.1:9090`. It may contain `{port}`, `{worker}` and `{domain}`, for which
    /// each worker has its own; without them the bus can serve one worker only.
    pub url: String,
    /// What it wants to be shown; `None` for one that lets everybody in.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub token: Option<Secret>,
    /// A file with the certificates of authorities that are trusted instead of those that the system trusts, relative
    /// to the folder of the `.sesame` file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trust: Option<String>,
}

/// Where a secret is kept. The secret itself is in no plan, no results and no log.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Secret {
    /// In a variable of the environment.
    Environment {
        /// Its name.
        name: String,
    },
    /// In a file, relative to the folder of the `.sesame` file. Space at its end is not part of the secret.
    File {
        /// The file.
        path: String,
    },
}

/// A server that speaks the rosbridge protocol.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Rosbridge {
    /// Where it is.
    pub remote: Remote,
    /// The domain (`ROS_DOMAIN_ID`) of what the first worker launches; each further one has the next.
    #[serde(default)]
    pub domain: u16,
    /// Which ROS is behind it.
    #[serde(default, skip_serializing_if = "Dialect::is_default")]
    pub dialect: Dialect,
    /// How it is asked to send messages.
    #[serde(default, skip_serializing_if = "Compression::is_default")]
    pub compression: Compression,
}

/// An address at which the runner stands for a server of rosbridge: whoever connects there is one node, and finds the
/// topics that are cut under their own names.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Proxy {
    /// The node that its clients are.
    pub node: NodeId,
    /// Its address, for example `ws://127.0.0.1:9190`. It may contain placeholders as that of a [`Remote`].
    pub url: String,
    /// What clients have to show; `None` if everybody is let in.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub token: Option<Secret>,
    /// What it shows to clients, for `wss://`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub identity: Option<Identity>,
    /// Whether it may be reached from other machines.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub public: bool,
}

/// What a server of TLS shows to its clients: files in PEM, relative to the folder of the `.sesame` file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity {
    /// Its certificate, and those of the authorities between it and one that clients trust.
    pub certificate: String,
    /// Its private key.
    pub key: String,
}

/// Which ROS is behind a bridge: they differ in the names of types and of the parts of a time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Dialect {
    /// ROS 1: `std_msgs/Header`, `secs` and `nsecs`.
    Ros1,
    /// ROS 2: `std_msgs/msg/Header`, `sec` and `nanosec`.
    #[default]
    Ros2,
}

impl Dialect {
    #[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it with a reference")]
    fn is_default(&self) -> bool {
        *self == Dialect::default()
    }
}

/// How a bridge is asked to send messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Compression {
    /// As texts in JSON.
    #[default]
    None,
    /// As bytes in CBOR.
    Cbor,
    /// As pictures that hold texts in JSON.
    Png,
}

impl Compression {
    #[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it with a reference")]
    fn is_default(&self) -> bool {
        *self == Compression::default()
    }
}

/// A system whose messages go over brokers of MQTT.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Mqtt {
    /// The broker of all nodes that have none of their own.
    pub broker: Broker,
    /// Brokers of nodes. A message goes from the broker of its publisher to those of its subscribers, under the same
    /// name where these differ; where they do not, publishers of topics that are cut publish on `TOPIC/undisturbed`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub brokers: Vec<(NodeId, Broker)>,
    /// How surely messages arrive.
    pub quality: Quality,
}

/// A broker of MQTT.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Broker {
    /// Where it is; its token is the password.
    pub remote: Remote,
    /// The name with which the password goes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub user: Option<String>,
}

/// How surely a message of MQTT arrives: its quality of service.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quality {
    /// Quality 0: if nothing goes wrong.
    AtMostOnce,
    /// Quality 1: perhaps several times.
    #[default]
    AtLeastOnce,
    /// Quality 2.
    ExactlyOnce,
}

/// Nodes of ROS 1.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ros1 {
    /// The address of the master, for example `http://127.0.0.1:11311`. It may contain placeholders as that of a
    /// [`Remote`].
    pub master: String,
}
