//! A connection to a running system: the node between its nodes.

use std::collections::BTreeSet;
use std::collections::btree_map::{BTreeMap, Entry};
use std::time::Instant;

use rustdds::QosPolicies;
use rustdds::policy::{Durability, History, Reliability};
use rustdds::rpc::SampleIdentity;
use sesame_codec::cdr::Codec;
use sesame_plan::{CampaignPlan, Clock, Fitted, NodeId, Operation, OperationKind, Ros, StepBy, TopicId};
use sesame_relay::transport::relay_latency::Added;
use sesame_relay::wire::{Line, Wire, WireTable, wanted};

use crate::dds::{DdsError, Endpoint, Participant, ReaderId, Received, Sample, WriterId, mirrored};
use crate::graph::{DISCOVERY_TOPIC, DISCOVERY_TYPE, Gid, NodeInfo, Nodes};
use crate::lifecycle::Lifecycle;
use crate::names;
use crate::parameters::Parameters;
use crate::transport::served::{Direction, Served, services};
use crate::transport::service::{self, Client};
use crate::transport::watch::Watch;
use crate::transport::wires::{absolute, lines_in_ros};

/// The name of the runner's node.
const NODE: &str = "/sesame_relay";

/// The name of a guest's node, before that of its monitor.
const GUEST: &str = "/sesame_monitor_";

/// A node of our own in the domain, with what it reads and writes.
pub(super) struct Session {
    /// The name of the node.
    pub(super) name: String,
    pub(super) dds: Participant,
    pub(super) nodes: Nodes,
    pub(super) info: NodeInfo,
    pub(super) info_reader: ReaderId,
    pub(super) info_writer: WriterId,
    pub(super) lines: Vec<Connected>,
    pub(super) services: Vec<Served>,
    /// The parameters of nodes on whose parameters operations act.
    pub(super) parameters: BTreeMap<NodeId, Parameters>,
    /// The lifecycles of nodes on which operations act by transitions.
    pub(super) lifecycles: BTreeMap<NodeId, Lifecycle>,
    /// Participants whose processes were killed.
    dead: Vec<[u8; PREFIX]>,
    /// What came in while something else was awaited.
    pub(super) backlog: Vec<Incoming>,
    pub(super) clock: ClockReader,
    pub(super) step: Stepper,
    pub(super) reset: Option<Caller>,
    /// The topics of which a message has come, and the first and latest time of the clock.
    pub(super) heard: BTreeSet<TopicId>,
    pub(super) ticks: Option<(i64, i64)>,
    pub(super) received: Vec<Received>,
    pub(super) unreadable: Vec<(ReaderId, String)>,
    /// Warnings of the session, each once.
    pub(super) notes: Vec<String>,
    /// What was noted, also if it was handed on since.
    said: BTreeSet<String>,
    /// The wires on which a message could not be decoded.
    pub(super) undecodable: BTreeSet<Wire>,
    /// What the relay adds to the way of messages; `None` in lock-step, where time stands still meanwhile.
    pub(super) added: Option<Added>,
    /// Who comes and goes while a run goes on.
    pub(super) watch: Watch,
}

/// A line with what stands for it in DDS.
pub(super) struct Connected {
    pub(super) line: Line,
    /// The interface of its messages.
    pub(super) interface: String,
    /// The name of its type in DDS.
    pub(super) type_name: String,
    pub(super) codec: Codec,
    /// One per source; `None` until somebody publishes there.
    pub(super) readers: Vec<Option<ReaderId>>,
    /// One per sink; `None` until somebody publishes on a source.
    pub(super) writers: Vec<Option<WriterId>>,
    /// What the publishers offer, and thus what the relay offers.
    pub(super) qos: QosPolicies,
}

pub(super) enum ClockReader {
    Wall,
    Topic { path: String, reader: Option<ReaderId> },
}

/// What takes steps.
pub(super) enum Stepper {
    None,
    Service(Caller),
    Topic { path: String, writer: Option<WriterId> },
}

/// A service that is called, connected as soon as there is a server.
pub(super) struct Caller {
    pub(super) path: String,
    pub(super) client: Option<Client>,
}

/// Something that came in.
#[derive(Debug)]
pub(super) enum Incoming {
    /// A message for the relay.
    Message(Message),
    /// The clock shows so many nanoseconds.
    Clock(i64),
    /// The step was taken, or not.
    Stepped(service::Answer),
    /// The reset was done, or not.
    Reset(service::Answer),
}

/// A message for the relay.
#[derive(Debug)]
pub(super) struct Message {
    pub(super) wire: Wire,
    pub(super) origin: Origin,
    pub(super) sample: Sample,
    /// When it came, if that is measured.
    pub(super) arrived: Option<Instant>,
}

/// Where a message comes from.
#[derive(Debug, Clone, Copy)]
pub(super) enum Origin {
    /// The line at a position, and its publisher if it is told apart.
    Line(usize, Option<NodeId>),
    /// The service at a position, and the client of the call.
    Service(usize, Direction, SampleIdentity),
}

impl Session {
    /// Joins the domain.
    pub(super) fn join(plan: &CampaignPlan, ros: &Ros, wires: &WireTable, domain: u16) -> Result<Self, DdsError> {
        let mut dds = Participant::join(domain, false)?;
        let latched = |depth| {
            rustdds::QosPolicyBuilder::new()
                .reliability(Reliability::Reliable { max_blocking_time: rustdds::Duration::ZERO })
                .durability(Durability::TransientLocal)
                .history(History::KeepLast { depth })
                .build()
        };
        let info_reader = dds.read(DISCOVERY_TOPIC, DISCOVERY_TYPE, &latched(1000))?;
        let info_writer = dds.publish(DISCOVERY_TOPIC, DISCOVERY_TYPE, &latched(1))?;
        let mut connected = Vec::new();
        for (line, interface) in lines_in_ros(plan, wires) {
            let wanted = wanted(plan, line.topic);
            let codec =
                Codec::new(&ros.interfaces, &interface, &wanted).map_err(|error| DdsError(error.to_string()))?;
            connected.push(Connected {
                codec,
                readers: vec![None; line.sources.len()],
                writers: vec![None; line.sinks.len()],
                // A node that comes later than a guest is to hear its state.
                qos: if line.cut || line.sinks.is_empty() { mirrored([]) } else { latched(1) },
                type_name: names::type_name(&interface),
                interface,
                line,
            });
        }
        let caller = |path: &String| Caller { path: absolute(path), client: None };
        Ok(Session {
            name: node_name(plan),
            nodes: Nodes::default(),
            info: NodeInfo::new(),
            info_reader,
            info_writer,
            services: services(plan, &ros.interfaces, wires, &mut dds)?,
            parameters: parameters(plan, &mut dds)?,
            lifecycles: lifecycles(plan, &mut dds)?,
            backlog: Vec::new(),
            dead: Vec::new(),
            dds,
            lines: connected,
            clock: match &ros.clock {
                Clock::Wall => ClockReader::Wall,
                Clock::Topic { path } => ClockReader::Topic { path: absolute(path), reader: None },
            },
            step: match ros.step.as_ref().map(|step| &step.by) {
                None => Stepper::None,
                Some(StepBy::Service { path }) => Stepper::Service(caller(path)),
                Some(StepBy::Topic { path }) => Stepper::Topic { path: absolute(path), writer: None },
            },
            reset: ros.reset.as_ref().map(caller),
            heard: BTreeSet::new(),
            ticks: None,
            received: Vec::new(),
            unreadable: Vec::new(),
            notes: Vec::new(),
            said: BTreeSet::new(),
            undecodable: BTreeSet::new(),
            added: ros.step.is_none().then(Added::default),
            watch: Watch::default(),
        })
    }

    /// All publishers that others announce and that live.
    pub(super) fn publishers(&self) -> Vec<Endpoint> {
        self.living(self.dds.publishers())
    }

    /// All subscribers that others announce and that live.
    pub(super) fn subscribers(&self) -> Vec<Endpoint> {
        self.living(self.dds.subscribers())
    }

    /// Without those of processes that were killed: nobody takes their announcements back before a lease has ended.
    fn living(&self, mut endpoints: Vec<Endpoint>) -> Vec<Endpoint> {
        if !self.dead.is_empty() {
            endpoints.retain(|endpoint| !self.dead.contains(&prefix(endpoint.guid.to_bytes())));
        }
        endpoints
    }

    /// A node was killed: what it announced counts no longer.
    pub(super) fn bury(&mut self, plan: &CampaignPlan, node: NodeId) {
        self.dead.extend(self.nodes.forget(&in_ros(plan, node)).into_iter().map(prefix));
        self.watch.forget(|guid| self.dead.contains(&prefix(guid.to_bytes())));
    }

    pub(super) fn note(&mut self, note: String) {
        if self.said.insert(note.clone()) {
            self.notes.push(note);
        }
    }
}

/// What this process is called as a node.
fn node_name(plan: &CampaignPlan) -> String {
    match plan.monitors.iter().find(|monitor| monitor.publishes.is_some()) {
        Some(monitor) if plan.is_guest() => format!("{GUEST}{}", monitor.name),
        _ => NODE.to_owned(),
    }
}

/// The name of a node in ROS.
pub(super) fn in_ros(plan: &CampaignPlan, node: NodeId) -> String {
    let declared = plan.node(node);
    absolute(declared.named.as_deref().unwrap_or(&declared.name))
}

/// How many bytes of what identifies something are those of its participant.
const PREFIX: usize = 12;

/// The participant of what a gid identifies.
fn prefix(gid: Gid) -> [u8; PREFIX] {
    std::array::from_fn(|at| gid[at])
}

/// The node and its parameter that a name `NODE/PARAMETER` means, with the node as the space calls it.
pub(super) fn parameter_of_node<'n>(plan: &CampaignPlan, name: &'n str) -> Option<(NodeId, &'n str)> {
    (0u32..).map(NodeId).zip(&plan.nodes).find_map(|(id, declared)| {
        // The name of a member of a group may have a `/` too.
        let parameter = name.strip_prefix(declared.name.as_str())?.strip_prefix('/')?;
        Some((id, parameter))
    })
}

/// What sets the parameters of the nodes that operations and scenes act on, or that may be fitted to a lab.
fn parameters(plan: &CampaignPlan, dds: &mut Participant) -> Result<BTreeMap<NodeId, Parameters>, DdsError> {
    let set = plan.operations.iter().filter(|operation| matches!(operation.kind, OperationKind::Set { .. }));
    let operations = set.flat_map(Operation::nodes);
    let scenes = plan.operations.iter().filter_map(|operation| match &operation.kind {
        OperationKind::Scene { parameter, .. } => parameter.as_ref(),
        _ => None,
    });
    let fitted = plan.labs.iter().flat_map(|lab| &lab.fits).map(|fit| &fit.what);
    let adjusted =
        plan.compensation.iter().flat_map(|compensation| &compensation.adjustments).map(|adjustment| &adjustment.what);
    let of_lab = fitted.chain(adjusted).filter_map(|what| match what {
        Fitted::Parameter { name } => Some(name),
        _ => None,
    });
    let named = scenes.chain(of_lab).filter_map(|name| parameter_of_node(plan, name)).map(|(node, _)| node);
    let mut found = BTreeMap::new();
    for node in operations.chain(named) {
        if let Entry::Vacant(place) = found.entry(node) {
            place.insert(Parameters::join(&in_ros(plan, node), dds)?);
        }
    }
    Ok(found)
}

/// What changes the states of the nodes on which operations act by transitions.
fn lifecycles(plan: &CampaignPlan, dds: &mut Participant) -> Result<BTreeMap<NodeId, Lifecycle>, DdsError> {
    let acting = plan.operations.iter().filter(|operation| matches!(operation.kind, OperationKind::Transition { .. }));
    let nodes: BTreeSet<NodeId> = acting.flat_map(Operation::nodes).collect();
    nodes.into_iter().map(|node| Ok((node, Lifecycle::join(&in_ros(plan, node), dds)?))).collect()
}
