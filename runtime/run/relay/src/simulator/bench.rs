//! A test bench for simulators: runs one without a relay and keeps its published messages.

use std::collections::{BTreeMap, VecDeque};

use sesame_base::time::SimTime;

use crate::simulator::{Bus, NodeOrder, Offered, OrderToNode, Port, Progress, Setup, Simulator, SimulatorError, Wires};
use crate::value::Value;

/// A message on the bench.
#[derive(Debug, Clone, PartialEq)]
pub struct Published {
    /// When it was published.
    pub time: SimTime,
    /// Its value.
    pub value: Value,
}

/// A simulator on the bench.
pub struct Bench<S> {
    simulator: S,
    wires: Loopback,
    now: SimTime,
    step: SimTime,
}

/// Changes a message on its way, given its time, topic and value; `None` drops it.
pub type Tamper = Box<dyn FnMut(SimTime, &str, Value) -> Option<Value>>;

#[derive(Default)]
struct Loopback {
    ports: BTreeMap<String, usize>,
    names: Vec<String>,
    inboxes: Vec<Option<VecDeque<Value>>>,
    published: Vec<Vec<Published>>,
    tamper: Option<Tamper>,
    nodes: Offered,
}

impl<S: Simulator> Bench<S> {
    /// Starts a simulator.
    pub fn start(setup: &Setup) -> Result<Self, SimulatorError> {
        Self::start_tampered(setup, None)
    }

    /// Starts a simulator whose messages pass through `tamper`.
    pub fn start_tampered(setup: &Setup, tamper: Option<Tamper>) -> Result<Self, SimulatorError> {
        let mut wires = Loopback { tamper, ..Loopback::default() };
        let simulator = S::start(setup, &mut Bus { now: SimTime::ZERO, wires: &mut wires })?;
        Ok(Bench { simulator, wires, now: SimTime::ZERO, step: setup.step })
    }

    /// Advances to at least this time, or to the end of the scenario.
    pub fn run_until(&mut self, end: SimTime) -> Result<Progress, SimulatorError> {
        while self.now < end {
            self.now = self.now + self.step;
            if self.simulator.step(&mut Bus { now: self.now, wires: &mut self.wires })? == Progress::Ended {
                return Ok(Progress::Ended);
            }
        }
        Ok(Progress::Running)
    }

    /// Gives an order for a node that the simulator offers; it has it in its next step.
    pub fn order(&mut self, node: &str, order: NodeOrder) {
        self.wires.nodes.give(OrderToNode { node: node.to_owned(), order });
    }

    /// The simulator itself.
    pub fn simulator(&self) -> &S {
        &self.simulator
    }

    /// Everything published so far on a topic.
    pub fn published(&self, path: &str) -> &[Published] {
        self.wires.ports.get(path).map_or(&[], |&port| &self.wires.published[port])
    }

    /// All topics opened so far, sorted.
    pub fn topics(&self) -> impl Iterator<Item = &str> {
        self.wires.ports.keys().map(String::as_str)
    }
}

impl Wires for Loopback {
    fn open(&mut self, path: &str) -> Port {
        if let Some(&port) = self.ports.get(path) {
            return Port(port);
        }
        let port = self.names.len();
        self.ports.insert(path.to_owned(), port);
        self.names.push(path.to_owned());
        self.inboxes.push(None);
        self.published.push(Vec::new());
        Port(port)
    }

    fn subscribe(&mut self, port: Port) {
        self.inboxes[port.0].get_or_insert_default();
    }

    fn publish(&mut self, now: SimTime, port: Port, value: Value) {
        self.published[port.0].push(Published { time: now, value: value.clone() });
        let Some(inbox) = &mut self.inboxes[port.0] else { return };
        let arrived = match &mut self.tamper {
            Some(tamper) => tamper(now, &self.names[port.0], value),
            None => Some(value),
        };
        inbox.extend(arrived);
    }

    fn receive(&mut self, port: Port) -> Option<Value> {
        self.inboxes[port.0].as_mut()?.pop_front()
    }

    fn nodes(&mut self) -> &mut Offered {
        &mut self.nodes
    }
}
