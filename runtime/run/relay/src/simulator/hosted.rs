//! A simulator in Rust under somebody else's protocol: steps are taken, messages go in and out, and topics can be cut.
//!
//! A protocol in which the relay cannot answer in the middle of a step has no other way: what is published on a topic
//! that is cut reaches its subscribers when it is delivered, which is between steps.

use std::collections::{BTreeMap, VecDeque};

use sesame_base::time::SimTime;

use crate::simulator::{Bus, Offered, Port, Progress, Setup, Simulator, SimulatorError, Wires};
use crate::value::Value;

/// What one step may publish; a simulator that publishes more has lost its way.
const STEP_LIMIT: usize = 100_000;

/// A message that a hosted simulator has published.
#[derive(Debug, Clone, PartialEq)]
pub struct Message {
    /// The name of its topic.
    pub topic: String,
    /// Its payload.
    pub value: Value,
}

/// A simulator in the middle of a run.
#[derive(Debug)]
pub struct Hosted<S> {
    simulator: S,
    topics: Topics,
    now: SimTime,
    step: SimTime,
}

#[derive(Debug, Default)]
struct Topics {
    ports: BTreeMap<String, usize>,
    opened: Vec<Topic>,
    published: Vec<Message>,
    /// Whether something was not kept, since too much was published at once.
    flooded: bool,
    /// What is offered; nobody under another protocol gives orders.
    nodes: Offered,
}

#[derive(Debug)]
struct Topic {
    path: String,
    /// What has arrived; `None` without a subscription.
    inbox: Option<VecDeque<Value>>,
    cut: bool,
    /// What was published last.
    latest: Option<Value>,
}

impl<S: Simulator> Hosted<S> {
    /// Starts a simulator. Nothing is cut yet, so what is published meanwhile arrives.
    pub fn start(
        setup: &Setup,
        start: impl FnOnce(&Setup, &mut Bus<'_>) -> Result<S, SimulatorError>,
    ) -> Result<Self, SimulatorError> {
        let mut topics = Topics::default();
        let simulator = start(setup, &mut Bus { now: SimTime::ZERO, wires: &mut topics })?;
        Ok(Hosted { simulator, topics, now: SimTime::ZERO, step: setup.step })
    }

    /// Simulation time now.
    pub fn now(&self) -> SimTime {
        self.now
    }

    /// Advances the world by one step.
    pub fn step(&mut self) -> Result<Progress, SimulatorError> {
        self.now = self.now + self.step;
        let progress = self.simulator.step(&mut Bus { now: self.now, wires: &mut self.topics })?;
        if self.topics.flooded {
            return Err(SimulatorError(format!("it published more than {STEP_LIMIT} messages in one step")));
        }
        Ok(progress)
    }

    /// The topics that the simulator has opened, in the order of their names.
    pub fn topics(&self) -> impl Iterator<Item = &str> {
        self.topics.ports.keys().map(String::as_str)
    }

    /// Whether the simulator has opened this topic.
    pub fn has(&self, topic: &str) -> bool {
        self.topics.ports.contains_key(topic)
    }

    /// What was published last on a topic.
    pub fn latest(&self, topic: &str) -> Option<&Value> {
        self.topics.find(topic)?.latest.as_ref()
    }

    /// From now on, what is published on a topic does not arrive, until something is [delivered](Self::deliver); or it
    /// arrives again. False if there is no such topic.
    pub fn cut(&mut self, topic: &str, cut: bool) -> bool {
        let Some(&port) = self.topics.ports.get(topic) else { return false };
        self.topics.opened[port].cut = cut;
        true
    }

    /// Passes a message to the subscribers of a topic. False if there is no such topic.
    pub fn deliver(&mut self, topic: &str, value: Value) -> bool {
        let Some(&port) = self.topics.ports.get(topic) else { return false };
        if let Some(inbox) = &mut self.topics.opened[port].inbox
            && inbox.len() < STEP_LIMIT
        {
            inbox.push_back(value);
        }
        true
    }

    /// What was published since the last call, in order.
    pub fn take(&mut self) -> Vec<Message> {
        std::mem::take(&mut self.topics.published)
    }
}

impl Topics {
    fn find(&self, path: &str) -> Option<&Topic> {
        self.ports.get(path).map(|&port| &self.opened[port])
    }
}

impl Wires for Topics {
    fn open(&mut self, path: &str) -> Port {
        if let Some(&port) = self.ports.get(path) {
            return Port(port);
        }
        self.ports.insert(path.to_owned(), self.opened.len());
        self.opened.push(Topic { path: path.to_owned(), inbox: None, cut: false, latest: None });
        Port(self.opened.len() - 1)
    }

    fn subscribe(&mut self, port: Port) {
        self.opened[port.0].inbox.get_or_insert_default();
    }

    fn publish(&mut self, _: SimTime, port: Port, value: Value) {
        if self.published.len() >= STEP_LIMIT {
            self.flooded = true;
            return;
        }
        let topic = &mut self.opened[port.0];
        if let (Some(inbox), false) = (&mut topic.inbox, topic.cut) {
            inbox.push_back(value.clone());
        }
        topic.latest = Some(value.clone());
        self.published.push(Message { topic: topic.path.clone(), value });
    }

    fn receive(&mut self, port: Port) -> Option<Value> {
        self.opened[port.0].inbox.as_mut()?.pop_front()
    }

    fn nodes(&mut self) -> &mut Offered {
        &mut self.nodes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A controller that counts, and a drive that says what it has heard.
    struct Cart {
        target: Port,
        state: Port,
        count: i64,
    }

    impl Simulator for Cart {
        fn start(_: &Setup, bus: &mut Bus<'_>) -> Result<Self, SimulatorError> {
            let (target, state) = (bus.open("target"), bus.open("state"));
            bus.subscribe(target);
            Ok(Cart { target, state, count: 0 })
        }

        fn step(&mut self, bus: &mut Bus<'_>) -> Result<Progress, SimulatorError> {
            self.count += 1;
            bus.publish(self.target, self.count);
            while let Some(heard) = bus.receive(self.target) {
                bus.publish(self.state, heard);
            }
            Ok(if self.count < 4 { Progress::Running } else { Progress::Ended })
        }
    }

    fn states(cart: &mut Hosted<Cart>) -> Vec<Value> {
        cart.step().unwrap();
        cart.take().into_iter().filter(|message| message.topic == "state").map(|message| message.value).collect()
    }

    #[test]
    fn what_is_cut_arrives_when_it_is_delivered() {
        let setup = Setup::new(1, SimTime::from_nanos(10));
        let mut cart = Hosted::start(&setup, Cart::start).unwrap();
        assert_eq!(states(&mut cart), [Value::Int(1)]);
        assert!(cart.cut("target", true));
        assert_eq!(states(&mut cart), []);
        assert_eq!(cart.latest("target"), Some(&Value::Int(2)));
        assert!(cart.deliver("target", Value::Int(20)));
        assert_eq!(states(&mut cart), [Value::Int(20)]);
        assert!(cart.cut("target", false));
        assert_eq!(cart.step(), Ok(Progress::Ended));
        assert_eq!(cart.take().last().map(|message| &message.value), Some(&Value::Int(4)));
        assert_eq!(cart.now(), SimTime::from_nanos(40));
    }

    #[test]
    fn what_is_not_there_is_said() {
        let mut cart = Hosted::start(&Setup::new(1, SimTime::from_nanos(10)), Cart::start).unwrap();
        assert_eq!(cart.topics().collect::<Vec<_>>(), ["state", "target"]);
        assert!(!cart.cut("targets", true) && !cart.deliver("targets", Value::Int(1)) && !cart.has("targets"));
    }
}
