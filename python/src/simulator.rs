//! A simulator that is a class in Python in this process: created for each test, stepped by calls.
//!
//! Its messages pass through the relay in the order in which a program behind the process protocol would have them, so
//! both give the same results. `bus` is the only object that the class sees of this: its methods find the step that is
//! being taken in a scoped variable of the thread, since what is borrowed for a step cannot be handed to Python.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::OnceLock;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
use scoped_tls_hkt::scoped_thread_local;

use sesame_base::time::SimTime;
use sesame_plan::{CampaignPlan, Type};
use sesame_relay::message::Mismatch;
use sesame_relay::relay::Exchange;
use sesame_relay::simulator::{NodeFault, NodeOrder, Offers, OrderToNode, Progress, no_such_parameter};
use sesame_relay::transport::node_orders::NodeOrders;
use sesame_relay::transport::topics::{Format, Opened, Published, Refused, STEP_LIMIT, Topics};
use sesame_relay::transport::{Capabilities, Connect, Incidents, Transport, TransportError};
use sesame_relay::value::Value;

use crate::raised;
use crate::value::{self, Shapes};

/// The class that this process simulates with, and what the package offers to it.
static CLASS: OnceLock<Class> = OnceLock::new();

#[derive(Debug)]
struct Class {
    simulator: Py<PyAny>,
    /// `sesamec._world`: the types of what simulators are given.
    world: Py<PyModule>,
}

/// Connects to a class; a process has one.
pub(crate) fn connect(py: Python<'_>, simulator: Py<PyAny>) -> PyResult<Connect> {
    let world = py.import("sesamec._world")?.unbind();
    if CLASS.set(Class { simulator, world }).is_err() {
        return Err(PyRuntimeError::new_err("this process has a simulator already"));
    }
    Ok(Connect::new(transport, std::path::PathBuf::new()))
}

fn transport(plan: &CampaignPlan, _: &Path) -> Box<dyn Transport> {
    let step_ns = plan.simulator.step_ns().unwrap_or_default();
    Box::new(InThisProcess {
        world: None,
        topics: Topics::default(),
        orders: NodeOrders::default(),
        plan: plan.clone(),
        now: SimTime::ZERO,
        step: SimTime::from_nanos(i64::try_from(step_ns).unwrap_or(i64::MAX)),
        incidents: Incidents::default(),
    })
}

struct InThisProcess {
    world: Option<World>,
    topics: Topics<Calls>,
    orders: NodeOrders,
    plan: CampaignPlan,
    now: SimTime,
    step: SimTime,
    incidents: Incidents,
}

/// An object of the class, and the bus that it is given.
struct World {
    step: Py<PyAny>,
    object: Py<PyAny>,
    bus: Py<Bus>,
}

/// Payloads of Python, and the messages that the simulator has not taken yet.
#[derive(Debug, Default)]
struct Calls {
    shapes: Shapes,
    paths: BTreeMap<String, Py<PyString>>,
    inbox: Vec<(Py<PyString>, Py<PyAny>, f64)>,
}

impl Calls {
    fn collect(&mut self, py: Python<'_>, path: &str, at: Option<SimTime>, payload: PyResult<Bound<'_, PyAny>>) {
        let known = self.paths.get(path).map(|path| path.clone_ref(py));
        let path = known.unwrap_or_else(|| {
            let name = PyString::new(py, path).unbind();
            self.paths.insert(path.to_owned(), name.clone_ref(py));
            name
        });
        // What was read of Python or of JSON can be written again.
        let payload = payload.map_or_else(|_| py.None(), Bound::unbind);
        self.inbox.push((path, payload, at.unwrap_or_default().seconds()));
    }
}

impl Format for Calls {
    type Payload<'a> = &'a Bound<'a, PyAny>;

    fn read(&mut self, plan: &CampaignPlan, ty: &Type, payload: &Self::Payload<'_>) -> Result<Value, Mismatch> {
        value::read(plan, &mut self.shapes, ty, payload)
    }

    fn pass_on(&mut self, path: &str, at: Option<SimTime>, payload: &Self::Payload<'_>) {
        self.collect(payload.py(), path, at, value::copied(payload));
    }

    fn deliver(&mut self, path: &str, at: Option<SimTime>, value: &Value) {
        Python::attach(|py| self.collect(py, path, at, value::write(py, value)));
    }

    fn clear(&mut self) {
        self.inbox.clear();
    }
}

/// What the bus can ask of the step that is being taken.
trait Turn {
    fn publish(&mut self, topic: &str, payload: &Bound<'_, PyAny>) -> bool;
    fn take(&mut self) -> Vec<(Py<PyString>, Py<PyAny>, f64)>;
    fn take_orders(&mut self) -> Vec<OrderToNode>;
    fn end(&mut self);
    fn now(&self) -> SimTime;
}

scoped_thread_local!(static mut TURN: for<'a> &'a mut (dyn Turn + 'a));

/// A step that is being taken.
struct Taken<'t> {
    topics: &'t mut Topics<Calls>,
    relay: &'t mut dyn Exchange,
    plan: &'t CampaignPlan,
    now: SimTime,
    orders: Vec<OrderToNode>,
    ended: bool,
    failure: Option<TransportError>,
}

impl Turn for Taken<'_> {
    fn publish(&mut self, topic: &str, payload: &Bound<'_, PyAny>) -> bool {
        let messages = std::iter::once(Published { path: topic, payload, delivered: false });
        let refused = match self.topics.publish(self.plan, self.now, messages, self.relay) {
            Ok(()) => return true,
            Err(Refused::TooMany) => TransportError::Simulator(format!(
                "it publishes more than {STEP_LIMIT} messages in the step to {}",
                self.now
            )),
            Err(Refused::NotPublished(path)) => TransportError::Simulator(format!(
                "it published a message on `{path}`, which is not in its `publishes`"
            )),
            Err(Refused::Intercepted(_)) => unreachable!("nothing is delivered before it was published"),
            Err(Refused::WrongType(error)) => error,
        };
        self.failure.get_or_insert(refused);
        false
    }

    fn take(&mut self) -> Vec<(Py<PyString>, Py<PyAny>, f64)> {
        std::mem::take(&mut self.topics.format.inbox)
    }

    fn take_orders(&mut self) -> Vec<OrderToNode> {
        std::mem::take(&mut self.orders)
    }

    fn end(&mut self) {
        self.ended = true;
    }

    fn now(&self) -> SimTime {
        self.now
    }
}

/// The way of a simulator's messages through the relay, while it takes a step.
#[pyclass(frozen, module = "sesamec")]
pub(crate) struct Bus {
    /// The length of a step in seconds.
    #[pyo3(get)]
    step: f64,
    message: Py<PyAny>,
    order: Py<PyAny>,
}

/// The step that is being taken in this thread.
fn turn<T>(call: impl FnOnce(&mut dyn Turn) -> T) -> PyResult<T> {
    if TURN.is_set() {
        Ok(TURN.with(call))
    } else {
        Err(PyRuntimeError::new_err("the bus can be used only by `start` and `step`, and in their thread"))
    }
}

#[pymethods]
impl Bus {
    /// Simulation time at the end of this step, in seconds.
    #[getter]
    fn time(&self) -> PyResult<f64> {
        turn(|turn| turn.now().seconds())
    }

    /// Sends a message through the relay. What reaches subscribers is in `messages()`: without disturbance the same
    /// message, with a latency none, or an earlier one.
    fn publish(&self, topic: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
        if turn(|turn| turn.publish(topic, value))? {
            return Ok(());
        }
        Err(PyRuntimeError::new_err(format!("a message on `{topic}` was refused")))
    }

    /// The messages that have reached subscribers since the last call.
    fn messages(&self, py: Python<'_>) -> PyResult<Vec<Py<PyAny>>> {
        let messages = turn(|turn| turn.take())?;
        messages.into_iter().map(|(topic, value, time)| self.message.call1(py, (topic, value, time))).collect()
    }

    /// What operations want done to the simulator's nodes from this step on.
    fn orders(&self, py: Python<'_>) -> PyResult<Vec<Py<PyAny>>> {
        let orders = turn(|turn| turn.take_orders())?;
        let told = |OrderToNode { node, order }: OrderToNode| {
            let (word, share) = match order {
                NodeOrder::Pause => ("pause", None),
                NodeOrder::Slow { share } => ("slow", Some(share)),
                NodeOrder::Resume => ("resume", None),
                NodeOrder::Kill => ("kill", None),
                NodeOrder::Restart => ("restart", None),
            };
            self.order.call1(py, (node, word, share))
        };
        orders.into_iter().map(told).collect()
    }

    /// The scenario ends with this step.
    fn end(&self) -> PyResult<()> {
        turn(|turn| turn.end())
    }
}

impl InThisProcess {
    /// Calls the simulator, which may use the bus meanwhile.
    fn call(
        &mut self,
        relay: &mut dyn Exchange,
        orders: Vec<OrderToNode>,
        what: &Py<PyAny>,
        bus: &Py<Bus>,
    ) -> Result<Progress, TransportError> {
        let mut taken = Taken {
            topics: &mut self.topics,
            relay,
            plan: &self.plan,
            now: self.now,
            orders,
            ended: false,
            failure: None,
        };
        let returned = Python::attach(|py| TURN.set(&mut taken, || what.call1(py, (bus,))));
        let (ended, failure) = (taken.ended, taken.failure);
        if let Some(failure) = failure {
            return Err(failure);
        }
        returned.map_err(|error| self.failed(&error))?;
        Ok(if ended { Progress::Ended } else { Progress::Running })
    }

    fn failed(&mut self, error: &PyErr) -> TransportError {
        let (message, traceback) = raised::told(error);
        self.incidents.notes.push(traceback);
        TransportError::Simulator(message)
    }

    fn create(&mut self, seed: u64, relay: &mut dyn Exchange) -> Result<World, TransportError> {
        let class = CLASS.get().ok_or_else(|| TransportError::Simulator("this process has no simulator".to_owned()))?;
        let step = self.step.seconds();
        let parameters: Vec<(String, f64)> = relay.parameters().to_vec();
        let created = Python::attach(|py| {
            let world = class.world.bind(py);
            let values = PyDict::new(py);
            for (name, value) in &parameters {
                values.set_item(name, value)?;
            }
            let setup = world.getattr("Setup")?.call1((seed, step, values))?;
            let object = class.simulator.bind(py).call1((&setup,))?;
            let told = world.getattr("description")?.call1((&object,))?;
            let (publishes, subscribes, nodes): (Vec<String>, Vec<String>, BTreeMap<String, Vec<String>>) =
                told.extract()?;
            let asked: Vec<String> = setup.getattr("asked")?.extract()?;
            let bus =
                Bus { step, message: world.getattr("Message")?.unbind(), order: world.getattr("Order")?.unbind() };
            let bus = Py::new(py, bus)?;
            let created = World { step: object.getattr("step")?.unbind(), object: object.unbind(), bus };
            PyResult::Ok((created, publishes, subscribes, nodes, asked))
        });
        let (world, publishes, subscribes, nodes, asked) = created.map_err(|error| self.failed(&error))?;
        if let Some((unknown, _)) = parameters.iter().find(|(name, _)| !asked.contains(name)) {
            return Err(TransportError::Simulator(no_such_parameter(unknown, &asked)));
        }
        let nodes = offers(nodes)?;
        let opened = Opened { publishes: &publishes, subscribes: &subscribes, nodes: &nodes, times: true };
        self.topics.open(&self.plan, opened, relay)?;
        Ok(world)
    }
}

/// What a simulator offers for its nodes.
fn offers(told: BTreeMap<String, Vec<String>>) -> Result<Offers, TransportError> {
    let faults = [NodeFault::Pause, NodeFault::Slow, NodeFault::Kill];
    let fault = |node: &str, word: &str| {
        faults.into_iter().find(|fault| fault.word() == word).ok_or_else(|| {
            let problem = format!("it offers `{word}` for its node `{node}`; there are `pause`, `slow` and `kill`");
            TransportError::Simulator(problem)
        })
    };
    told.into_iter()
        .map(|(node, words)| {
            let faults = words.iter().map(|word| fault(&node, word)).collect::<Result<_, _>>()?;
            Ok((node, faults))
        })
        .collect()
}

impl Transport for InThisProcess {
    fn capabilities(&self) -> Capabilities {
        Capabilities { lock_stepped: true, resets: true }
    }

    fn reset(&mut self, seed: u64, relay: &mut dyn Exchange) -> Result<(), TransportError> {
        self.close();
        self.now = SimTime::ZERO;
        self.topics.clear();
        self.orders = NodeOrders::default();
        let world = self.create(seed, relay)?;
        let start = Python::attach(|py| world.object.bind(py).getattr_opt("start").map(|it| it.map(Bound::unbind)));
        if let Some(start) = start.map_err(|error| self.failed(&error))? {
            self.call(relay, Vec::new(), &start, &world.bus)?;
        }
        self.world = Some(world);
        Ok(())
    }

    fn advance(&mut self, until: SimTime, relay: &mut dyn Exchange) -> Result<Progress, TransportError> {
        let Some(world) = self.world.take() else {
            return Err(TransportError::Simulator("it was stepped before it was started".to_owned()));
        };
        if self.now + self.step > until {
            self.world = Some(world);
            return Ok(Progress::Ended);
        }
        self.now = self.now + self.step;
        self.topics.published = 0;
        relay.advance(self.now, &mut self.topics.deliveries);
        self.topics.deliver(relay, None);
        let orders = self.orders.take(&self.plan, self.now, relay);
        let progress = self.call(relay, orders, &world.step, &world.bus);
        self.world = Some(world);
        progress
    }

    fn now(&self) -> SimTime {
        self.now
    }

    fn close(&mut self) {
        let Some(world) = self.world.take() else { return };
        Python::attach(|py| {
            let closed =
                world.object.bind(py).getattr_opt("close").and_then(|close| close.map(|it| it.call0()).transpose());
            if let Err(error) = closed {
                self.incidents.notes.push(raised::told(&error).1);
            }
            drop(world);
        });
    }

    fn incidents(&mut self) -> Incidents {
        std::mem::take(&mut self.incidents)
    }
}
