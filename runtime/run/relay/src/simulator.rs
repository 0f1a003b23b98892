//! The trait of a simulator in Rust that runs inside the runner (`simulator … = in_process "crate::Type"`).
//!
//! The simulator is a small distributed system in one type: its parts communicate over named topics through a [`Bus`]
//! only. The relay is part of the bus. A message of one part is disturbed if the test says so, and reaches its
//! subscribers in the same step: a relay without operations adds no delay.

mod nodes;

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};

use sesame_base::time::SimTime;

use crate::value::Value;

pub(crate) use nodes::Offered;
pub use nodes::{NodeFault, NodeOrder, Offers, OrderToNode};

/// A simulator that is stepped in lock-step with the relay.
///
/// It must be deterministic: the same seed and the same received messages must give the same published messages. All
/// state must belong to the value, since several may exist at once; each test starts a new one.
pub trait Simulator: Sized {
    /// Creates the world at time zero and opens its topics on the bus. It may publish initial messages.
    fn start(setup: &Setup, bus: &mut Bus<'_>) -> Result<Self, SimulatorError>;

    /// Advances the world by one step of [`Setup::step`], to the time [`Bus::now`].
    fn step(&mut self, bus: &mut Bus<'_>) -> Result<Progress, SimulatorError>;
}

/// The settings with which a simulator is started.
#[derive(Debug, Clone)]
pub struct Setup {
    /// Seed of the simulator's own randomness. It only differs between tests if a campaign asks for it.
    pub seed: u64,
    /// Length of one step.
    pub step: SimTime,
    /// What is not as the simulator has it.
    parameters: Parameters,
}

impl Setup {
    /// Settings with which every parameter is as the simulator has it.
    pub fn new(seed: u64, step: SimTime) -> Self {
        Setup { seed, step, parameters: Parameters::default() }
    }

    /// The same with other values of these parameters.
    #[must_use]
    pub fn with_parameters(self, values: impl IntoIterator<Item = (String, f64)>) -> Self {
        let parameters = Parameters { values: values.into_iter().collect(), asked: RefCell::default() };
        Setup { parameters, ..self }
    }

    /// The value of a parameter in this run: `usual`, unless a compensation of a reality gap sets it. A simulator asks
    /// for each of its parameters when it starts; a compensation that sets another one is an error.
    pub fn parameter(&self, name: &str, usual: f64) -> f64 {
        self.parameters.asked.borrow_mut().insert(name.to_owned());
        self.parameters.values.get(name).copied().unwrap_or(usual)
    }

    /// The parameters that the simulator has asked for.
    #[cfg(any(feature = "in-process", feature = "serve"))]
    pub(crate) fn asked(&self) -> Vec<String> {
        self.parameters.asked.borrow().iter().cloned().collect()
    }

    /// What is wrong if a value was given to a parameter that the simulator has not asked for.
    #[cfg(feature = "in-process")]
    pub(crate) fn unknown_parameter(&self) -> Option<SimulatorError> {
        let asked = self.asked();
        let unknown = self.parameters.values.keys().find(|name| !asked.contains(name))?;
        Some(SimulatorError(no_such_parameter(unknown, &asked)))
    }
}

/// What is wrong with a parameter that a simulator does not have.
#[cfg(feature = "in-process")]
pub fn no_such_parameter(name: &str, known: &[String]) -> String {
    let known: Vec<String> = known.iter().map(|name| format!("`{name}`")).collect();
    let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
    format!("it has no parameter `{name}` that a compensation can set; it has {known}")
}

/// Values of parameters, and which were asked for.
#[derive(Debug, Clone, Default)]
struct Parameters {
    values: BTreeMap<String, f64>,
    asked: RefCell<BTreeSet<String>>,
}

/// Whether there is more to simulate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Progress {
    /// The scenario continues.
    Running,
    /// The scenario has ended; this ends the test.
    Ended,
}

/// What went wrong in a simulator, in words for the user.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct SimulatorError(pub String);

/// A topic opened on a bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Port(pub(crate) usize);

/// The simulator's side of the message bus.
///
/// ```
/// # use sesame_relay::simulator::{Bus, Port};
/// # fn controller(_: f64) -> f64 { 0.0 }
/// struct Joint { command: Port, target: f64 }
///
/// impl Joint {
///     fn open(bus: &mut Bus<'_>) -> Joint {
///         let command = bus.open("arm/joint1/position");
///         bus.subscribe(command);
///         Joint { command, target: 0.0 }
///     }
///     fn step(&mut self, bus: &mut Bus<'_>) {
///         bus.publish(self.command, controller(bus.now().seconds()));   // the controller's side
///         while let Some(message) = bus.receive(self.command) {          // the joint's side, through the relay
///             self.target = message.number_at::<&str>(&[]).unwrap_or(self.target);
///         }
///     }
/// }
/// ```
pub struct Bus<'a> {
    pub(crate) now: SimTime,
    pub(crate) wires: &'a mut dyn Wires,
}

impl Bus<'_> {
    /// Opens a topic by its name on the wire. Opening it again returns the same port. Topics that are not in the space
    /// work in the same way, but are neither observed nor disturbed.
    pub fn open(&mut self, path: &str) -> Port {
        self.wires.open(path)
    }

    /// Subscribes to this topic; messages without a subscriber are not kept.
    pub fn subscribe(&mut self, port: Port) {
        self.wires.subscribe(port);
    }

    /// Publishes a message at the current time.
    pub fn publish(&mut self, port: Port, value: impl Into<Value>) {
        self.wires.publish(self.now, port, value.into());
    }

    /// The next message that has reached the subscribers of this topic.
    pub fn receive(&mut self, port: Port) -> Option<Value> {
        self.wires.receive(port)
    }

    /// Offers to do this to a node of the space that is a part of the simulator; called when it starts. Operations on
    /// nodes need it, and give [orders](Bus::order) in later steps.
    ///
    /// ```
    /// # use sesame_relay::simulator::{Bus, NodeFault, NodeOrder, Port};
    /// struct Planner { target: Port, stands: bool }
    ///
    /// impl Planner {
    ///     fn open(bus: &mut Bus<'_>) -> Planner {
    ///         bus.offer("planner", &[NodeFault::Pause]);
    ///         Planner { target: bus.open("cart/target"), stands: false }
    ///     }
    ///     fn step(&mut self, bus: &mut Bus<'_>) {
    ///         while let Some(order) = bus.order("planner") {
    ///             self.stands = order == NodeOrder::Pause;
    ///         }
    ///         if !self.stands {
    ///             bus.publish(self.target, 1.0);
    ///         }
    ///     }
    /// }
    /// ```
    pub fn offer(&mut self, node: &str, faults: &[NodeFault]) {
        self.wires.nodes().offer(node, faults);
    }

    /// The next order of this step for a node that was [offered](Bus::offer).
    pub fn order(&mut self, node: &str) -> Option<NodeOrder> {
        self.wires.nodes().take(node)
    }

    /// The current time: the end of the current step.
    pub fn now(&self) -> SimTime {
        self.now
    }
}

/// The implementation of a bus: the in-process transport with its relay, or a loopback in a simulator's own tests.
pub(crate) trait Wires {
    fn open(&mut self, path: &str) -> Port;
    fn subscribe(&mut self, port: Port);
    fn publish(&mut self, now: SimTime, port: Port, value: Value);
    fn receive(&mut self, port: Port) -> Option<Value>;
    /// The nodes that are parts of the simulator.
    fn nodes(&mut self) -> &mut Offered;
}

pub mod bench;
#[cfg(feature = "serve")]
mod hosted;
#[cfg(feature = "serve")]
mod serve;

#[cfg(feature = "serve")]
pub use hosted::{Hosted, Message};
#[cfg(feature = "serve")]
pub use serve::serve;
