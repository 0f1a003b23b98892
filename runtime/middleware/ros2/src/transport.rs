//! The transport to a system of ROS 2 nodes.
//!
//! For each run the runner is a node between the others. A topic that is cut has its publishers on names of their own,
//! and the relay publishes on the name that subscribers know. A run begins when every wire has somebody at both ends.

mod assembly;
mod change;
mod domain;
mod free_running;
mod lock_stepped;
mod orders;
mod presence;
mod served;
mod service;
mod session;
mod traffic;
mod wall_clock;
mod watch;
mod wires;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use sesame_base::time::SimTime;
use sesame_lifecycle::launch::{LaunchContext, Launched};
use sesame_plan::{CampaignPlan, NodeId, Ros};
use sesame_relay::relay::{Delivery, Exchange};
use sesame_relay::simulator::Progress;
use sesame_relay::transport::clock::Ticks;
use sesame_relay::transport::relay_latency::{AddedOnWire, join, objections};
use sesame_relay::transport::round::Promises;
use sesame_relay::transport::{
    Capabilities, Connect, Incidents, Transport, TransportError, wall_clock, wall_time_since,
};
use sesame_relay::wire::{Wire, WireTable};

use self::change::Change;
use self::domain::Domain;
use self::session::{Session, in_ros};
use self::wall_clock::now;

/// How long a system may take until it is complete, where nothing else is declared.
const COMPLETE_WITHIN: Duration = Duration::from_secs(30);

/// The last domain whose ports exist.
const LAST_DOMAIN: u16 = 232;

/// How long nothing may come in while something must.
const SILENCE: Duration = Duration::from_secs(10);

/// Connects to a system of ROS 2 nodes; launched programs run in this folder.
pub fn ros2(folder: PathBuf) -> Connect {
    Connect::new(connect, folder)
}

fn connect(plan: &CampaignPlan, folder: &Path) -> Box<dyn Transport> {
    let (sesame_plan::Transport::Ros2(ros2), Some(ros)) = (&plan.simulator.transport, &plan.simulator.ros) else {
        unreachable!("the generator connects each kind of simulator by its own transport")
    };
    Box::new(System::new(plan.clone(), ros2.domain, ros.clone(), folder.to_owned()))
}

/// A system of ROS 2 nodes.
struct System {
    plan: CampaignPlan,
    ros: Ros,
    domain: u16,
    // Ended before the session: what it launched may want to say goodbye.
    launched: Launched,
    session: Option<Session>,
    reserved: Option<Domain>,
    now: SimTime,
    /// What the clock showed at time zero.
    zero: Zero,
    ticks: Ticks,
    /// When the clock went on last.
    ticked: Instant,
    deliveries: Vec<Delivery>,
    incidents: Incidents,
    /// How long messages were kept, of sessions that have ended since it was asked for.
    added: Vec<AddedOnWire>,
    wires: WireTable,
    /// What operations have changed and not yet restored.
    changes: Vec<Change>,
    /// What its nodes promise to publish in a step.
    promises: Promises,
    /// The wires on which nodes owe answers that are stopped: these come when the nodes go on.
    postponed: BTreeMap<NodeId, Vec<Wire>>,
    /// Nodes that have forgotten what they owe: they were killed and started again, or brought back to a state.
    restarted: BTreeSet<NodeId>,
    /// Whether something could not be restored, so that the next run must start afresh.
    spoilt: bool,
}

/// Where simulation time is counted from.
#[derive(Debug, Clone, Copy)]
enum Zero {
    /// From this moment of wall time.
    Wall(Instant),
    /// From this time of the clock, in nanoseconds.
    Clock(i64),
    /// It is counted in steps.
    Steps,
}

impl Zero {
    /// Simulation time now where it is wall time; else what it was.
    fn wall_clock(self, was: SimTime) -> SimTime {
        match self {
            Zero::Wall(zero) => wall_time_since(zero),
            Zero::Clock(_) | Zero::Steps => was,
        }
    }
}

impl System {
    fn new(plan: CampaignPlan, domain: u16, ros: Ros, folder: PathBuf) -> Self {
        let context = LaunchContext::of_worker(folder).remapping(&plan).in_domain(domain);
        let domain = u16::try_from(context.domain).unwrap_or(u16::MAX);
        let wires = WireTable::new(&plan);
        System {
            added: Vec::new(),
            promises: Promises::new(&plan, &wires),
            wires,
            changes: Vec::new(),
            postponed: BTreeMap::new(),
            spoilt: false,
            restarted: BTreeSet::new(),
            launched: Launched::new(&plan, context),
            domain,
            plan,
            ros,
            session: None,
            reserved: None,
            now: SimTime::ZERO,
            zero: Zero::Steps,
            ticks: Ticks::default(),
            ticked: now(),
            deliveries: Vec::new(),
            incidents: Incidents::default(),
        }
    }

    /// Connects to the system, which is started if the plan says how.
    fn begin(&mut self, seed: u64, relay: &mut dyn Exchange) -> Result<(), TransportError> {
        self.undo(None)?;
        self.postponed.clear();
        self.restarted.clear();
        let is_of_another_scene = !self.launched.are_of(relay.arguments());
        if std::mem::take(&mut self.spoilt) || self.session.is_none() || self.ros.reset.is_none() || is_of_another_scene
        {
            self.launched.end();
            self.session = None;
            if self.domain > LAST_DOMAIN {
                let problem =
                    format!("domain {} is beyond the last one, {LAST_DOMAIN}; use fewer workers", self.domain);
                return Err(TransportError::Wiring(problem));
            }
            // A guest is in a domain that others use.
            if self.reserved.is_none() && !self.plan.is_guest() {
                self.reserved = Some(Domain::take(self.domain)?);
            }
            let session = Session::join(&self.plan, &self.ros, relay.wires(), self.domain)?;
            let session = self.session.insert(session);
            self.launched.start(seed, relay.arguments())?;
            session.assemble(&self.plan, &mut self.launched, COMPLETE_WITHIN)?;
        }
        let Some(session) = &mut self.session else { return Ok(()) };
        session.call_reset(&mut self.launched, now() + SILENCE)?;
        session.begin(&self.plan);
        session.tell_subscribers(relay);
        self.zero = match (&self.ros.clock, &self.ros.step) {
            (_, Some(_)) => Zero::Steps,
            (sesame_plan::Clock::Wall, None) => Zero::Wall(now()),
            (sesame_plan::Clock::Topic { .. }, None) => Zero::Clock(session.tick(&mut self.launched, now() + SILENCE)?),
        };
        match self.zero {
            Zero::Wall(_) => relay.clock_at_zero(wall_clock()),
            Zero::Clock(nanos) => relay.clock_at_zero(SimTime::from_nanos(nanos).seconds()),
            Zero::Steps => {}
        }
        self.ticked = now();
        self.set_parameters(relay.parameters())
    }

    fn fail(&mut self, error: TransportError) -> TransportError {
        // The outcome of a run that was stopped says for how long nothing came, and has no room for what it was.
        if matches!(error, TransportError::Silent { .. }) {
            self.incidents.notes.push(error.to_string());
        }
        self.incidents.killed |= self.launched.was_killed();
        self.close();
        error
    }
}

impl Transport for System {
    fn capabilities(&self) -> Capabilities {
        Capabilities { lock_stepped: self.ros.step.is_some(), resets: self.ros.reset.is_some() }
    }

    fn reset(&mut self, seed: u64, relay: &mut dyn Exchange) -> Result<(), TransportError> {
        self.now = SimTime::ZERO;
        self.deliveries.clear();
        let begun = self.begin(seed, relay);
        self.collect_notes();
        begun.map_err(|error| self.fail(error))
    }

    fn advance(&mut self, until: SimTime, relay: &mut dyn Exchange) -> Result<Progress, TransportError> {
        let advanced = match self.ros.step.as_ref().map(|step| step.step_ns) {
            Some(step) => self.take_step(SimTime::from_nanos(i64::try_from(step).unwrap_or(i64::MAX)), until, relay),
            None => self.run_freely(until, relay),
        };
        let advanced = match advanced {
            Ok(Progress::Ended) => self.undo(None).map(|()| Progress::Ended),
            other => other,
        };
        let ended = matches!(advanced, Ok(Progress::Ended));
        let advanced = advanced.and_then(|progress| self.look_around(ended, relay).map(|()| progress));
        self.collect_notes();
        advanced.map_err(|error| self.fail(error))
    }

    fn now(&self) -> SimTime {
        self.now
    }

    fn tell_waiting(&mut self, tell: Box<dyn FnMut(&str) + Send>) {
        self.launched.tell_waiting(tell);
    }

    fn close(&mut self) {
        self.changes.clear();
        self.judge_budget();
        self.launched.end();
        self.collect_notes();
        self.session = None;
    }

    fn incidents(&mut self) -> Incidents {
        self.judge_budget();
        std::mem::take(&mut self.incidents)
    }

    fn added(&mut self) -> Vec<AddedOnWire> {
        self.judge_budget();
        std::mem::take(&mut self.added)
    }
}

impl System {
    /// Notes who has come and gone, if it is time to look, and tells the relay who listens. A guest connects to those
    /// who have come.
    fn look_around(&mut self, ended: bool, relay: &mut dyn Exchange) -> Result<(), TransportError> {
        let now = now();
        let Some(session) = self.session.as_ref().filter(|session| ended || session.watch.is_due(now)) else {
            return Ok(());
        };
        session.tell_subscribers(relay);
        if self.plan.is_guest() {
            let Some(session) = &mut self.session else { return Ok(()) };
            session.watch.looked(now);
            session.discover()?;
            return Ok(());
        }
        let nodes = (0u32..).map(NodeId).take(self.plan.nodes.len());
        let absent = nodes.filter(|&node| self.is_absent(node)).map(|node| in_ros(&self.plan, node)).collect();
        if let Some(session) = &mut self.session {
            session.look_around(&self.plan, now, &absent);
        }
        Ok(())
    }

    /// Takes what the relay has added, and notes if that is more than its budget.
    fn judge_budget(&mut self) {
        let Some(added) = self.session.as_mut().and_then(|session| session.added.as_mut()) else { return };
        let new = added.take(&self.wires);
        if let Some(budget) = self.plan.simulator.lifecycle.relay_budget {
            self.incidents.notes.append(&mut objections(budget, &new));
        }
        join(&mut self.added, new);
    }

    fn collect_notes(&mut self) {
        if let Some(session) = &mut self.session {
            self.incidents.notes.append(&mut session.notes);
        }
        self.incidents.notes.append(&mut self.launched.take_notes());
    }
}

/// That nothing was heard for too long.
fn silent(awaited: String) -> TransportError {
    TransportError::Silent { awaited, limit: SILENCE.as_secs_f64() }
}
