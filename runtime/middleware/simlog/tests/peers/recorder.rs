//! A relay that writes down what passes, and changes it.

use std::collections::BTreeMap;
use std::path::Path;

use sesame_base::time::SimTime;
use sesame_plan::testing::{self, minimal, node, simlog_mut, topic};
use sesame_plan::{CampaignPlan, NodeId, SimlogVersion, TopicId, TopicMembers, Type, WireNames};
use sesame_relay::fuzz::Order;
use sesame_relay::relay::{Delivery, Exchange};
use sesame_relay::simulator::Progress;
use sesame_relay::transport::{Transport, TransportError};
use sesame_relay::value::Value;
use sesame_relay::wire::{Wire, WireTable};

pub(crate) const STEP: SimTime = SimTime::from_nanos(20_000_000);

/// What becomes of a message on a wire; `None` drops it.
pub(crate) type Change = fn(&str, Value) -> Option<Value>;

pub(crate) struct Recorder {
    wires: WireTable,
    change: Change,
    counts: BTreeMap<Wire, u64>,
    pub(crate) published: BTreeMap<String, Vec<(SimTime, Value)>>,
    pub(crate) subscribed: Vec<String>,
}

impl Recorder {
    pub(crate) fn new(plan: &CampaignPlan, change: Change) -> Self {
        let (counts, published) = (BTreeMap::new(), BTreeMap::new());
        Recorder { wires: WireTable::new(plan), change, counts, published, subscribed: Vec::new() }
    }

    /// All that was published on a topic.
    pub(crate) fn of(&self, path: &str) -> &[(SimTime, Value)] {
        self.published.get(path).map_or(&[], Vec::as_slice)
    }

    /// As numbers.
    pub(crate) fn numbers(&self, path: &str, field: &[&str]) -> Vec<f64> {
        self.of(path).iter().map(|(_, value)| value.number_at(field).expect("it is a number")).collect()
    }
}

impl Exchange for Recorder {
    fn wires(&self) -> &WireTable {
        &self.wires
    }

    fn intercepts(&self, _: Wire) -> bool {
        true
    }

    fn subscribed(&mut self, wire: Wire) {
        self.subscribed.push(self.wires.path(wire).to_owned());
    }

    fn clock_at_zero(&mut self, _: f64) {}
    fn advance(&mut self, _: SimTime, _: &mut Vec<Delivery>) {}

    fn message_from(
        &mut self,
        now: SimTime,
        wire: Wire,
        _: Option<NodeId>,
        value: Value,
        deliveries: &mut Vec<Delivery>,
    ) {
        let path = self.wires.path(wire).to_owned();
        let count = self.counts.entry(wire).or_default();
        if let Some(value) = (self.change)(&path, value.clone()) {
            deliveries.push(Delivery { wire, index: *count, at: now, by_monitor: false, value });
        }
        *count += 1;
        self.published.entry(path).or_default().push((now, value));
    }

    fn next_index(&self, wire: Wire) -> u64 {
        self.counts.get(&wire).copied().unwrap_or_default()
    }

    fn parameters(&self) -> &[(String, f64)] {
        &[]
    }

    fn arguments(&self) -> &[(String, String)] {
        &[]
    }

    fn take_orders(&mut self) -> Vec<Order> {
        Vec::new()
    }

    fn carried_out(&mut self, _: SimTime, _: usize) {}

    fn next_due(&self) -> Option<SimTime> {
        None
    }
}

/// A plan of topics, of which `joint` is cut and all are published every step.
pub(crate) fn plan(url: &str, protocol: SimlogVersion, topics: &[(&str, Type)]) -> CampaignPlan {
    let mut plan = minimal();
    plan.topics = topics.iter().map(|(path, ty)| topic(path, &[path], ty.clone())).collect();
    let mut all = node("simulator");
    all.every_step = (0..).take(topics.len()).map(TopicId).collect();
    all.publishes = all.every_step.iter().copied().map(TopicMembers::All).collect();
    plan.nodes = vec![all];
    let cut = (0..).map(TopicId).zip(topics).filter(|(_, (path, _))| *path == "joint").map(|(id, _)| id).collect();
    plan.simulator = testing::simlog(url);
    let simlog = simlog_mut(&mut plan.simulator);
    (simlog.protocol, simlog.cut, simlog.settle_ns) = (protocol, cut, 20_000_000);
    if protocol == SimlogVersion::V3 {
        (simlog.names, simlog.marker) = (WireNames::of_version_3(), Some("SIMLOG://step".to_owned()));
    }
    plan
}

/// Ends a step when nothing has come for so many milliseconds, where nobody says how much comes: longer than a message
/// is ever late on a machine that is busy.
pub(crate) fn settles(plan: &mut CampaignPlan, milliseconds: u64) {
    simlog_mut(&mut plan.simulator).settle_ns = milliseconds * 1_000_000;
}

/// The transport of a plan.
pub(crate) fn transport(plan: &CampaignPlan) -> Box<dyn Transport> {
    transport_in(plan, Path::new(env!("CARGO_MANIFEST_DIR")))
}

/// The transport of a plan whose files are seen from this folder.
pub(crate) fn transport_in(plan: &CampaignPlan, folder: &Path) -> Box<dyn Transport> {
    plan.validate().expect("the plan is sound");
    sesame_simlog::simlog(folder.to_owned()).transport(plan)
}

/// Runs until the end, or until this many steps were taken. How many were.
pub(crate) fn run(transport: &mut dyn Transport, steps: u32, relay: &mut Recorder) -> Result<u32, TransportError> {
    transport.reset(1, relay)?;
    let until = SimTime::from_nanos(STEP.nanos() * i64::from(steps));
    let mut taken = 0;
    while transport.now() < until {
        let progress = transport.advance(until, relay)?;
        taken += 1;
        if progress == Progress::Ended {
            return Ok(taken);
        }
    }
    assert_eq!(transport.advance(until, relay)?, Progress::Ended, "the run is over");
    Ok(taken)
}
