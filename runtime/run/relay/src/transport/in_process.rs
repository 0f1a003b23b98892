//! A simulator that is a Rust type inside the runner, stepped in lock-step.

use std::collections::{BTreeMap, VecDeque};
use std::path::{Path, PathBuf};

use sesame_base::time::SimTime;
use sesame_plan::CampaignPlan;

use crate::message;
use crate::relay::{Delivery, Exchange};
use crate::simulator::{Bus, Offered, Port, Progress, Setup, Simulator, SimulatorError, Wires};
use crate::transport::node_orders::NodeOrders;
use crate::transport::topics::STEP_LIMIT;
use crate::transport::{Capabilities, Connect, Transport, TransportError, unknown_topic};
use crate::value::Value;
use crate::wire::Wire;

/// Connects to a simulator that is a Rust type inside the runner.
pub fn in_process<S: Simulator + 'static>() -> Connect {
    Connect { make: connect::<S>, folder: PathBuf::new() }
}

fn connect<S: Simulator + 'static>(plan: &CampaignPlan, _: &Path) -> Box<dyn Transport> {
    let Some(step_ns) = plan.simulator.step_ns() else {
        unreachable!("the generator connects each kind of simulator by its own transport")
    };
    Box::new(InProcess::<S> {
        simulator: None,
        bus: InProcessBus::default(),
        orders: NodeOrders::default(),
        plan: plan.clone(),
        now: SimTime::ZERO,
        step: SimTime::from_nanos(i64::try_from(step_ns).unwrap_or(i64::MAX)),
    })
}

struct InProcess<S> {
    simulator: Option<S>,
    bus: InProcessBus,
    orders: NodeOrders,
    plan: CampaignPlan,
    now: SimTime,
    step: SimTime,
}

impl<S: Simulator> Transport for InProcess<S> {
    fn capabilities(&self) -> Capabilities {
        Capabilities { lock_stepped: true, resets: true }
    }

    fn reset(&mut self, seed: u64, relay: &mut dyn Exchange) -> Result<(), TransportError> {
        self.simulator = None;
        self.now = SimTime::ZERO;
        self.bus = InProcessBus::new(relay.wires().len());
        self.orders = NodeOrders::default();
        let setup = Setup::new(seed, self.step).with_parameters(relay.parameters().iter().cloned());
        let mut linked = RelayedBus { board: &mut self.bus, plan: &self.plan, relay };
        let started = S::start(&setup, &mut Bus { now: SimTime::ZERO, wires: &mut linked });
        self.simulator = Some(started.map_err(failed)?);
        setup.unknown_parameter().map_or(Ok(()), |unknown| Err(failed(unknown)))?;
        self.bus.every_wire_is_open(&self.plan, relay)?;
        NodeOrders::are_offered(&self.plan, self.bus.nodes.offers())?;
        self.bus.every_message_fits()
    }

    fn advance(&mut self, until: SimTime, relay: &mut dyn Exchange) -> Result<Progress, TransportError> {
        let Some(simulator) = &mut self.simulator else {
            return Err(TransportError::Simulator("it was stepped before it was started".to_owned()));
        };
        if self.now + self.step > until {
            return Ok(Progress::Ended);
        }
        self.now = self.now + self.step;
        self.bus.published = 0;
        relay.advance(self.now, &mut self.bus.deliveries);
        self.bus.deliver();
        for order in self.orders.take(&self.plan, self.now, relay) {
            self.bus.nodes.give(order);
        }
        let mut linked = RelayedBus { board: &mut self.bus, plan: &self.plan, relay };
        let progress = simulator.step(&mut Bus { now: self.now, wires: &mut linked });
        self.bus.every_message_fits()?;
        progress.map_err(failed)
    }

    fn now(&self) -> SimTime {
        self.now
    }

    fn close(&mut self) {
        self.simulator = None;
    }
}

fn failed(error: SimulatorError) -> TransportError {
    TransportError::Simulator(error.0)
}

/// The bus of one run: the simulator's topics, which of them the relay knows, and the messages that have arrived on
/// them.
#[derive(Default)]
struct InProcessBus {
    by_path: BTreeMap<String, usize>,
    lines: Vec<Line>,
    /// The line of each of the relay's wires.
    by_wire: Vec<Option<usize>>,
    deliveries: Vec<Delivery>,
    mismatch: Option<TransportError>,
    /// Messages since the last step began.
    published: u64,
    nodes: Offered,
}

/// One topic of the simulator.
struct Line {
    path: String,
    wire: Option<Wire>,
    /// The messages that have arrived for the subscribers; `None` without subscribers.
    inbox: Option<VecDeque<Value>>,
    /// Whether a message has been compared with the declared type.
    checked: bool,
}

impl InProcessBus {
    fn new(wires: usize) -> Self {
        InProcessBus { by_wire: vec![None; wires], ..InProcessBus::default() }
    }

    /// Puts the relay's deliveries into the inboxes of their subscribers.
    fn deliver(&mut self) {
        for Delivery { wire, value, .. } in self.deliveries.drain(..) {
            let line = self.by_wire[wire.index()].map(|line| &mut self.lines[line]);
            if let Some(inbox) = line.and_then(|line| line.inbox.as_mut()) {
                inbox.push_back(value);
            }
        }
    }

    /// The simulator knows all topics, but for those that are for monitors only.
    fn every_wire_is_open(&self, plan: &CampaignPlan, relay: &dyn Exchange) -> Result<(), TransportError> {
        let wires = relay.wires();
        let is_closed = |wire: &Wire| self.by_wire[wire.index()].is_none();
        let missing = wires.iter().find(|wire| is_closed(wire) && !plan.is_state_of_monitor(wires.topic(*wire)));
        let Some(missing) = missing else { return Ok(()) };
        Err(unknown_topic(wires.path(missing), self.by_path.keys()))
    }

    fn every_message_fits(&mut self) -> Result<(), TransportError> {
        self.mismatch.take().map_or(Ok(()), Err)
    }
}

/// The bus with the relay, as the simulator sees it during one call.
struct RelayedBus<'a> {
    board: &'a mut InProcessBus,
    plan: &'a CampaignPlan,
    relay: &'a mut dyn Exchange,
}

impl Wires for RelayedBus<'_> {
    fn open(&mut self, path: &str) -> Port {
        if let Some(&line) = self.board.by_path.get(path) {
            return Port(line);
        }
        let at = self.board.lines.len();
        let wire = self.relay.wires().find(path);
        if let Some(wire) = wire {
            self.board.by_wire[wire.index()] = Some(at);
        }
        self.board.by_path.insert(path.to_owned(), at);
        self.board.lines.push(Line { path: path.to_owned(), wire, inbox: None, checked: false });
        Port(at)
    }

    fn subscribe(&mut self, port: Port) {
        let line = &mut self.board.lines[port.0];
        line.inbox.get_or_insert_default();
        if let Some(wire) = line.wire {
            self.relay.subscribed(wire);
        }
    }

    fn publish(&mut self, now: SimTime, port: Port, value: Value) {
        self.board.published += 1;
        if self.board.published > STEP_LIMIT {
            let flood = format!("it publishes more than {STEP_LIMIT} messages in the step to {now}");
            self.board.mismatch.get_or_insert(TransportError::Simulator(flood));
            return;
        }
        let line = &mut self.board.lines[port.0];
        let Some(wire) = line.wire else {
            if let Some(inbox) = &mut line.inbox {
                inbox.push_back(value);
            }
            return;
        };
        if !line.checked {
            line.checked = true;
            let declared = &self.plan.topic(self.relay.wires().topic(wire)).ty;
            if let Err(mismatch) = message::fits(self.plan, declared, &value) {
                let wrong = TransportError::WrongType { path: line.path.clone(), reason: mismatch.to_string() };
                self.board.mismatch.get_or_insert(wrong);
                return;
            }
        }
        self.relay.message(now, wire, value, &mut self.board.deliveries);
        self.board.deliver();
    }

    fn receive(&mut self, port: Port) -> Option<Value> {
        self.board.lines[port.0].inbox.as_mut()?.pop_front()
    }

    fn nodes(&mut self) -> &mut Offered {
        &mut self.board.nodes
    }
}

#[cfg(test)]
mod tests {
    use sesame_base::observation::Outcome;
    use sesame_plan::testing::{
        evidence_above, guarantee, in_process as simulator, metric, minimal, monitor, node, operation, test_of, topic,
        use_of,
    };
    use sesame_plan::{
        FieldRef, Gate, MetricSource, Mitigation, MitigationValue, Monitor, MonitorState, NodeId, OperationKind,
        SafeState, TopicId, Type,
    };

    use super::*;
    use crate::evaluate::{Custom, evaluate};
    use crate::metric::MetricTable;
    use crate::simulator::{NodeFault, NodeOrder};
    use crate::wire::WireTable;

    /// It comes nearer by one in each step, until it is told to stop. It does not know the topic of the monitor.
    struct Robot {
        distance: f64,
        stopped: bool,
        ports: [Port; 2],
    }

    impl Simulator for Robot {
        fn start(_: &Setup, bus: &mut Bus<'_>) -> Result<Self, SimulatorError> {
            let ports = ["distance", "stop"].map(|path| bus.open(path));
            bus.subscribe(ports[1]);
            Ok(Robot { distance: 10.0, stopped: false, ports })
        }

        fn step(&mut self, bus: &mut Bus<'_>) -> Result<Progress, SimulatorError> {
            while let Some(stop) = bus.receive(self.ports[1]) {
                self.stopped = stop == Value::Bool(true);
            }
            self.distance -= if self.stopped { 0.0 } else { 1.0 };
            bus.publish(self.ports[0], self.distance);
            Ok(Progress::Running)
        }
    }

    #[test]
    fn a_monitor_stops_a_simulator_that_does_not_know_its_topic() {
        let (distance, stop) = (TopicId(0), FieldRef { topic: TopicId(1), path: Vec::new() });
        let mitigation = Some(Mitigation { field: stop, value: MitigationValue::Bool(true) });
        let far = evidence_above("far", 0, 5.0);
        let plan = CampaignPlan {
            simulator: simulator("robot", "robot::Robot", 100_000_000),
            topics: vec![
                topic("distance", &["distance"], Type::Real { unit: None }),
                topic("stop", &["stop"], Type::Bool),
                topic("state", &["state"], Type::Int { unit: None }),
            ],
            metrics: vec![metric(
                "distance",
                MetricSource::Last { input: FieldRef { topic: distance, path: Vec::new() } },
            )],
            monitors: vec![Monitor {
                otherwise: SafeState { name: "halted".to_owned(), doc: String::new(), mitigation },
                ..monitor("cell", 2, vec![far], vec![guarantee("moves", 1, Gate::Evidence(0))])
            }],
            ..minimal()
        };
        plan.validate().unwrap();
        let wires = WireTable::new(&plan);
        let metrics = MetricTable::new(&plan, &wires, &[]).unwrap();
        let mut transport = in_process::<Robot>().transport(&plan);
        let run = || evaluate(&plan, &wires, &metrics, &mut *transport, &test_of(vec![]), 1, &mut Custom::none());
        let observed = std::iter::repeat_with(run).take(2).collect::<Result<Vec<_>, _>>().unwrap();
        let decisions: Vec<_> =
            observed[0].monitors[0].decisions.iter().map(|decision| (decision.time, decision.state)).collect();
        let moves = MonitorState::Guarantee(0);
        assert_eq!(decisions, [(0.0, MonitorState::Otherwise), (0.1, moves), (0.5, MonitorState::Otherwise)]);
        assert_eq!(observed[0].metrics[0].value, Some(5.0), "it stops in the step after it is told to");
        assert_eq!((&observed[1].monitors, observed[1].messages), (&observed[0].monitors, observed[0].messages));
    }

    /// A counter that stands still, or begins anew, as it is told.
    struct Counter {
        count: i64,
        runs: bool,
        port: Port,
    }

    impl Simulator for Counter {
        fn start(_: &Setup, bus: &mut Bus<'_>) -> Result<Self, SimulatorError> {
            bus.offer("counter", &[NodeFault::Pause, NodeFault::Kill]);
            Ok(Counter { count: 0, runs: true, port: bus.open("count") })
        }

        fn step(&mut self, bus: &mut Bus<'_>) -> Result<Progress, SimulatorError> {
            while let Some(order) = bus.order("counter") {
                self.runs = matches!(order, NodeOrder::Resume | NodeOrder::Restart);
                if order == NodeOrder::Kill {
                    self.count = 0;
                }
            }
            self.count += i64::from(self.runs);
            bus.publish(self.port, self.count);
            Ok(Progress::Running)
        }
    }

    #[test]
    fn a_simulator_does_to_its_nodes_what_operations_want() {
        let on = |kind| operation(0, kind);
        let node_of_plan = NodeId(0);
        let count = FieldRef { topic: TopicId(0), path: Vec::new() };
        let mut plan = CampaignPlan {
            simulator: simulator("counter", "counter::Counter", 100_000_000),
            topics: vec![topic("count", &["count"], Type::Int { unit: None })],
            nodes: vec![node("counter")],
            metrics: vec![metric("count", MetricSource::Last { input: count })],
            operations: vec![
                on(OperationKind::Pause { node: node_of_plan }),
                on(OperationKind::Kill { node: node_of_plan }),
            ],
            ..minimal()
        };
        plan.campaign.end_after = 1.0;
        let counts = |plan: &CampaignPlan, uses| {
            let (wires, test) = (WireTable::new(plan), test_of(uses));
            let metrics = MetricTable::new(plan, &wires, &[]).unwrap();
            let mut transport = in_process::<Counter>().transport(plan);
            evaluate(plan, &wires, &metrics, &mut *transport, &test, 1, &mut Custom::none()).unwrap()
        };
        let last = |uses| counts(&plan, uses).metrics[0].value;
        assert_eq!(last(vec![]), Some(10.0));
        assert_eq!(last(vec![use_of(0, 0.2, 0.5, vec![], 1)]), Some(7.0), "it stands still at 0.2, 0.3 and 0.4 s");
        assert_eq!(last(vec![use_of(1, 0.2, 0.5, vec![], 1)]), Some(6.0), "and begins anew at 0.5 s");

        plan.operations.push(on(OperationKind::Slow { node: node_of_plan }));
        let Outcome::Crash { message } = counts(&plan, vec![]).outcome else { panic!("it starts") };
        assert!(message.starts_with("the simulator does not offer to slow node `counter`"), "{message}");
    }
}
