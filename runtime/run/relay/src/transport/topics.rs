//! The topics of a simulator that does not share the relay's values: what it publishes is read by the types that the
//! space declares, and what reaches its subscribers is written for it, in order over all topics.

use std::collections::BTreeMap;

use sesame_base::time::SimTime;
use sesame_plan::{CampaignPlan, Type};

use crate::message::Mismatch;
use crate::relay::{Delivery, Exchange};
use crate::simulator::Offers;
use crate::transport::node_orders::NodeOrders;
use crate::transport::{TransportError, unknown_topic};
use crate::value::Value;
use crate::wire::Wire;

/// The most messages a simulator may publish in one step; with more of them, the test is a crash.
pub const STEP_LIMIT: u64 = 100_000;

/// How payloads look on the simulator's side, and where deliveries to it are collected.
pub trait Format {
    /// A payload as the simulator publishes it.
    type Payload<'a>;

    /// Reads a payload of a declared type.
    fn read(&mut self, plan: &CampaignPlan, ty: &Type, payload: &Self::Payload<'_>) -> Result<Value, Mismatch>;

    /// Collects a message for the simulator as it was published. `at` is when it was delivered, if the simulator wants
    /// to know.
    fn pass_on(&mut self, path: &str, at: Option<SimTime>, payload: &Self::Payload<'_>);

    /// Collects a message for the simulator that may have been changed on its way.
    fn deliver(&mut self, path: &str, at: Option<SimTime>, value: &Value);

    /// Forgets what was collected. What helps to read the next run may stay.
    fn clear(&mut self);
}

/// What a simulator says of itself at time zero.
#[derive(Debug, Clone, Copy)]
pub struct Opened<'a> {
    /// Topics it publishes.
    pub publishes: &'a [String],
    /// Topics to which it subscribes.
    pub subscribes: &'a [String],
    /// Nodes that are parts of it, and what it can do to each of them.
    pub nodes: &'a Offers,
    /// Whether it wants to know when each message was delivered.
    pub times: bool,
}

/// A message of the simulator.
#[derive(Debug)]
pub struct Published<'a, P> {
    /// The topic's name on the wire.
    pub path: &'a str,
    /// What it carries.
    pub payload: P,
    /// Whether the simulator has given it to its own subscribers, since nothing can change it.
    pub delivered: bool,
}

/// Why messages are not passed on.
#[derive(Debug)]
pub enum Refused {
    /// There are more than [`STEP_LIMIT`] in one step.
    TooMany,
    /// The simulator did not say that it publishes on this topic.
    NotPublished(String),
    /// The simulator has delivered a message itself that an operation may change.
    Intercepted(String),
    /// A payload is not of its declared type.
    WrongType(TransportError),
}

/// The topics of one run, and the messages that wait for delivery.
#[derive(Debug, Default)]
pub struct Topics<F> {
    by_path: BTreeMap<String, Topic>,
    /// Per wire of the relay: whether the simulator subscribes to it.
    subscribed: Vec<bool>,
    /// Whether the simulator is told when each message was delivered.
    timed: bool,
    /// Whether the simulator may deliver messages itself that no operation intercepts.
    pub delivers: bool,
    /// Where deliveries are collected.
    pub format: F,
    /// What the relay has delivered and [`deliver`](Topics::deliver) has not collected yet.
    pub deliveries: Vec<Delivery>,
    /// Messages since the last step began.
    pub published: u64,
    /// The wires of messages that were collected as soon as they came, each as often; `None` where that is not
    /// measured.
    pub passed: Option<Vec<Wire>>,
}

/// One topic of the simulator.
#[derive(Debug)]
struct Topic {
    wire: Option<Wire>,
    publishes: bool,
    subscribes: bool,
}

impl<F: Format> Topics<F> {
    /// Forgets the topics of the last run.
    pub fn clear(&mut self) {
        self.by_path.clear();
        self.subscribed.clear();
        self.timed = false;
        self.delivers = false;
        self.format.clear();
        self.deliveries.clear();
        self.published = 0;
        self.passed.iter_mut().for_each(Vec::clear);
    }

    /// Takes the simulator's topics; all topics of the space must be among them, but for states of monitors, and what
    /// operations do to nodes among what it offers. Tells the relay which topics have subscribers.
    pub fn open(
        &mut self,
        plan: &CampaignPlan,
        opened: Opened<'_>,
        relay: &mut dyn Exchange,
    ) -> Result<(), TransportError> {
        self.timed = opened.times;
        let wires = relay.wires();
        for path in opened.publishes.iter().chain(opened.subscribes) {
            let topic = Topic { wire: wires.find(path), publishes: false, subscribes: false };
            self.by_path.entry(path.clone()).or_insert(topic);
        }
        self.subscribed = vec![false; wires.len()];
        for path in opened.publishes {
            self.by_path.entry(path.clone()).and_modify(|topic| topic.publishes = true);
        }
        for path in opened.subscribes {
            self.by_path.entry(path.clone()).and_modify(|topic| topic.subscribes = true);
            if let Some(wire) = wires.find(path) {
                self.subscribed[wire.index()] = true;
            }
        }
        let is_needed = |&wire: &Wire| !plan.is_state_of_monitor(wires.topic(wire));
        let mut needed = wires.iter().filter(is_needed);
        if let Some(missing) = needed.find(|&wire| !self.by_path.contains_key(wires.path(wire))) {
            return Err(unknown_topic(wires.path(missing), self.by_path.keys()));
        }
        NodeOrders::are_offered(plan, opened.nodes)?;
        for wire in wires.iter().filter(|wire| self.subscribed[wire.index()]) {
            relay.subscribed(wire);
        }
        Ok(())
    }

    /// Passes messages through the relay; deliveries to subscribers are collected.
    pub fn publish<'a>(
        &mut self,
        plan: &CampaignPlan,
        now: SimTime,
        messages: impl ExactSizeIterator<Item = Published<'a, F::Payload<'a>>>,
        relay: &mut dyn Exchange,
    ) -> Result<(), Refused> {
        self.published += messages.len() as u64;
        if self.published > STEP_LIMIT {
            return Err(Refused::TooMany);
        }
        for Published { path, payload, delivered } in messages {
            let Some(topic) = self.by_path.get(path).filter(|topic| topic.publishes) else {
                return Err(Refused::NotPublished(path.to_owned()));
            };
            let Some(wire) = topic.wire else {
                if topic.subscribes && !delivered {
                    self.format.pass_on(path, self.timed.then_some(now), &payload);
                }
                continue;
            };
            if delivered && (!self.delivers || relay.intercepts(wire)) {
                return Err(Refused::Intercepted(path.to_owned()));
            }
            let declared = &plan.topic(relay.wires().topic(wire)).ty;
            let value = self.format.read(plan, declared, &payload).map_err(|mismatch| {
                Refused::WrongType(TransportError::WrongType { path: path.to_owned(), reason: mismatch.to_string() })
            })?;
            relay.message(now, wire, value, &mut self.deliveries);
            if delivered {
                self.deliveries.retain(|delivery| delivery.wire != wire);
            }
            self.deliver(relay, Some((wire, &payload)));
        }
        Ok(())
    }

    /// Collects the relay's deliveries to subscribers. A message that no operation intercepts is passed on as it was
    /// published.
    pub fn deliver(&mut self, relay: &dyn Exchange, published: Option<(Wire, &F::Payload<'_>)>) {
        for Delivery { wire, at, by_monitor, value, .. } in self.deliveries.drain(..) {
            if !self.subscribed.get(wire.index()).copied().unwrap_or(false) {
                continue;
            }
            if let (Some(passed), Some((from, _))) = (&mut self.passed, published)
                && from == wire
                && !by_monitor
            {
                passed.push(wire);
            }
            let untouched = published.filter(|&(from, _)| from == wire && !by_monitor && !relay.intercepts(wire));
            let (path, at) = (relay.wires().path(wire), self.timed.then_some(at));
            match untouched {
                Some((_, payload)) => self.format.pass_on(path, at, payload),
                None => self.format.deliver(path, at, &value),
            }
        }
    }
}
