//! Who is there: the nodes of a domain with their publishers and subscribers.
//!
//! Publishers and subscribers are announced by DDS; the node that each of them belongs to is announced by the
//! middlewares of ROS on a topic of their own, `ros_discovery_info`.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use rustdds::GUID;
use sesame_codec::cdr::Codec;
use sesame_relay::value::{Fields, Record, Text, Value};
use sesame_relay::wire::Wanted;

use crate::layouts::{Layout, interfaces};

/// The topic on which participants say what nodes they have.
pub(crate) const DISCOVERY_TOPIC: &str = "ros_discovery_info";
/// Its type in DDS.
pub(crate) const DISCOVERY_TYPE: &str = "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_";

/// How long the name of a node is awaited that its participant is yet to say: it comes later than the node's publishers
/// and subscribers. Fast DDS says only after three seconds what got lost, so a name may need two of its periods.
pub(crate) const NAMES: Duration = Duration::from_secs(10);

/// The bytes that identify something in a domain.
pub(crate) type Gid = [u8; 16];

/// Says and reads what nodes a participant has.
pub(crate) struct NodeInfo {
    codec: Codec,
}

/// A node with its publishers and subscribers.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct NodeEntities {
    /// With its namespace, for example `/cell/arm`.
    pub(crate) name: String,
    pub(crate) readers: Vec<Gid>,
    pub(crate) writers: Vec<Gid>,
}

const INFO: &str = "rmw_dds_common/msg/ParticipantEntitiesInfo";
const GID: &str = "rmw_dds_common/msg/Gid";

const LAYOUTS: &[Layout] = &[
    (GID, &[("data", "uint8[16]")]),
    (
        "rmw_dds_common/msg/NodeEntitiesInfo",
        &[
            ("node_namespace", "string"),
            ("node_name", "string"),
            ("reader_gid_seq", "rmw_dds_common/msg/Gid[]"),
            ("writer_gid_seq", "rmw_dds_common/msg/Gid[]"),
        ],
    ),
    (INFO, &[("gid", GID), ("node_entities_info_seq", "rmw_dds_common/msg/NodeEntitiesInfo[]")]),
];

impl NodeInfo {
    pub(crate) fn new() -> Self {
        NodeInfo { codec: Codec::new(&interfaces(LAYOUTS), INFO, &Wanted::All).expect("the layout is known") }
    }

    /// The nodes of a participant, as it says; `None` if it cannot be read.
    pub(crate) fn read(&self, sample: Arc<[u8]>) -> Option<(Gid, Vec<NodeEntities>)> {
        let value = self.codec.read(sample).ok()?;
        let participant = gid(value.at(&["gid"])?)?;
        let Value::List(nodes) = value.at(&["node_entities_info_seq"])? else { return None };
        let nodes = nodes.iter().map(|node| {
            let (space, name) = (text(node.at(&["node_namespace"])?)?, text(node.at(&["node_name"])?)?);
            let gids = |field: &str| match node.at(&[field])? {
                Value::List(gids) => gids.iter().map(gid).collect::<Option<Vec<Gid>>>(),
                _ => None,
            };
            let name = format!("{}/{name}", space.trim_end_matches('/'));
            Some(NodeEntities { name, readers: gids("reader_gid_seq")?, writers: gids("writer_gid_seq")? })
        });
        Some((participant, nodes.collect::<Option<_>>()?))
    }

    /// What a participant with one node says.
    pub(crate) fn write(&self, participant: Gid, node: &NodeEntities) -> Option<Arc<[u8]>> {
        let gid_value = |gid: &Gid| {
            let data = gid.iter().map(|&byte| Value::Int(i64::from(byte))).collect();
            Value::Record(Record::new(&Fields::new(["data"]), vec![Value::List(data)]))
        };
        let gids = |gids: &[Gid]| Value::List(gids.iter().map(gid_value).collect());
        let (space, name) = node.name.rsplit_once('/').unwrap_or(("", &node.name));
        let entities = Record::new(
            &Fields::new(["node_namespace", "node_name", "reader_gid_seq", "writer_gid_seq"]),
            vec![
                Value::Text(Text::from(if space.is_empty() { "/" } else { space })),
                Value::Text(Text::from(name)),
                gids(&node.readers),
                gids(&node.writers),
            ],
        );
        let info = Record::new(
            &Fields::new(["gid", "node_entities_info_seq"]),
            vec![gid_value(&participant), Value::List(vec![entities.into()])],
        );
        self.codec.write(&info.into()).ok()
    }
}

fn text(value: &Value) -> Option<&str> {
    match value {
        Value::Text(text) => Some(text),
        _ => None,
    }
}

fn gid(value: &Value) -> Option<Gid> {
    let Value::List(bytes) = value.at(&["data"])? else { return None };
    let bytes: Option<Vec<u8>> = bytes
        .iter()
        .map(|byte| match byte {
            Value::Int(byte) => u8::try_from(*byte).ok(),
            _ => None,
        })
        .collect();
    bytes?.try_into().ok()
}

/// Which node each publisher and subscriber belongs to.
#[derive(Debug, Default)]
pub(crate) struct Nodes {
    of_participant: BTreeMap<Gid, Vec<NodeEntities>>,
}

impl Nodes {
    /// A participant says what nodes it has; that replaces what it said before.
    pub(crate) fn learn(&mut self, participant: Gid, nodes: Vec<NodeEntities>) {
        self.of_participant.insert(participant, nodes);
    }

    /// Forgets the participants that have a node of this name, and tells which they were.
    pub(crate) fn forget(&mut self, name: &str) -> Vec<Gid> {
        let has = |nodes: &Vec<NodeEntities>| nodes.iter().any(|node| node.name == name);
        let gone: Vec<Gid> = self.of_participant.iter().filter(|(_, nodes)| has(nodes)).map(|(gid, _)| *gid).collect();
        self.of_participant.retain(|gid, _| !gone.contains(gid));
        gone
    }

    /// The node of a publisher or subscriber, as far as its participant has said.
    pub(crate) fn name(&self, guid: GUID) -> Option<&str> {
        let gid = guid.to_bytes();
        let nodes = self.of_participant.values().flatten();
        let mut of = nodes.filter(|node| node.readers.contains(&gid) || node.writers.contains(&gid));
        of.next().map(|node| node.name.as_str())
    }

    /// All nodes.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &NodeEntities> {
        self.of_participant.values().flatten()
    }
}
