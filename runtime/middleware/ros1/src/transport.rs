//! The transport to a system of ROS 1 nodes.
//!
//! For each run the runner is a node between the others. A topic that is cut has its publishers on names of their own,
//! and the relay publishes on the name that subscribers know, with the type, the definition and the latching of the
//! original publishers. A service that is cut is served under the name that clients know, in the same way.

mod lost;
mod presence;
#[cfg(test)]
mod tests;
mod wired;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use sesame_lifecycle::launch::LaunchContext;
use sesame_plan::{CampaignPlan, Channel, Clock, Ros};
use sesame_relay::transport::bus::{Bus, Event, FOUND_AGAIN_WITHIN, Settings, on_bus};
use sesame_relay::transport::{Connect, Transport, TransportError};
use sesame_relay::value::Value;
use sesame_relay::wire::Line;

use self::lost::lost;
use self::wired::{Clocked, Role, Wired, wire};
use crate::master::Address;
use crate::node::{Incoming, Node, Subscription};

/// The name of the runner's node, before the number of its worker.
const NODE: &str = "/sesame_relay_";

/// The name of a guest's node, before that of its monitor.
const GUEST: &str = "/sesame_monitor_";

/// The type of a clock.
const CLOCK: &str = "rosgraph_msgs/Clock";

/// How long the master may leave calls unanswered before it counts as away.
const UNANSWERED: Duration = Duration::from_secs(1);

/// Connects to a system of ROS 1 nodes; launched programs run in this folder.
///
/// The runner listens on the loopback interface, unless `ROS_HOSTNAME` or `ROS_IP` names another address of this
/// machine, as nodes of ROS have it; then it binds this address, and no other. Launched programs get `ROS_MASTER_URI`,
/// folders of their own in `ROS_HOME` and `ROS_LOG_DIR`, and `ROS_IP=127.0.0.1`, unless one of these variables is set.
pub fn ros1(folder: PathBuf) -> Connect {
    Connect::new(connect, folder)
}

fn connect(plan: &CampaignPlan, folder: &Path) -> Box<dyn Transport> {
    in_context(plan, LaunchContext::of_worker(folder.to_owned()))
}

/// The transport of a worker whose programs run in this context.
fn in_context(plan: &CampaignPlan, context: LaunchContext) -> Box<dyn Transport> {
    let (sesame_plan::Transport::Ros1(ros1), Some(ros)) = (&plan.simulator.transport, &plan.simulator.ros) else {
        unreachable!("the generator connects each kind of simulator by its own transport")
    };
    let context = in_ros(plan, &ros1.master, context);
    let bus = Ros1Bus {
        plan: plan.clone(),
        master: ros1.master.clone(),
        ros: ros.clone(),
        name: node_name(plan, context.worker),
        node: None,
        lines: Vec::new(),
        roles: Vec::new(),
        services: Vec::new(),
        clock: None,
    };
    on_bus(plan, Box::new(bus), Settings::of(plan), context)
}

/// What this process is called as a node: if two nodes have one name, the master ends the first.
fn node_name(plan: &CampaignPlan, worker: u32) -> String {
    match plan.monitors.iter().find(|monitor| monitor.publishes.is_some()) {
        Some(monitor) if plan.is_guest() => format!("{GUEST}{}", monitor.name),
        _ => format!("{NODE}{worker}"),
    }
}

/// What launched programs are given.
fn in_ros(plan: &CampaignPlan, master: &str, context: LaunchContext) -> LaunchContext {
    let own = |name: &str| context.folder.join(name).display().to_string();
    let mut environment = vec![
        ("ROS_MASTER_URI".to_owned(), master.to_owned()),
        ("ROS_HOME".to_owned(), own("ros")),
        ("ROS_LOG_DIR".to_owned(), own("ros/log")),
    ];
    if ["ROS_IP", "ROS_HOSTNAME"].iter().all(|name| std::env::var_os(name).is_none()) {
        environment.push(("ROS_IP".to_owned(), "127.0.0.1".to_owned()));
    }
    LaunchContext { environment, ..context.remapping(plan) }
}

struct Ros1Bus {
    plan: CampaignPlan,
    /// The address of the master, as the plan has it.
    master: String,
    ros: Ros,
    name: String,
    node: Option<Node>,
    lines: Vec<Wired>,
    /// What each subscription of the node is for, by its position.
    roles: Vec<Role>,
    /// The lines of each service of the node: that of requests and that of replies, where it has one.
    services: Vec<[Option<usize>; 2]>,
    clock: Option<Clocked>,
}

impl Ros1Bus {
    fn node(&self) -> Result<&Node, TransportError> {
        self.node.as_ref().ok_or_else(|| TransportError::Simulator("ROS 1 was used before it was connected".to_owned()))
    }

    /// A message that came in, as an event; one that cannot be read goes on as it is.
    fn event(&self, line: usize, source: usize, call: Option<u64>, bytes: &Arc<[u8]>, arrived: Instant) -> Event {
        let wired = &self.lines[line];
        match wired.codec.read(Arc::clone(bytes)) {
            Ok(value) => Event::Message { line, source, value, call, arrived },
            Err(error) => {
                let sinks = if wired.line.cut { wired.line.sinks.len() } else { 0 };
                for sink in 0..sinks {
                    self.send(line, sink, bytes, call);
                }
                let (path, interface) = (&wired.line.path, &wired.interface);
                Event::Note(format!("a message on `{path}` is not a `{interface}`, and goes on unchanged: {error}"))
            }
        }
    }

    fn send(&self, line: usize, sink: usize, bytes: &Arc<[u8]>, call: Option<u64>) {
        let (Some(node), wired) = (&self.node, &self.lines[line]) else { return };
        match wired.line.channel {
            Channel::Topic => node.publish(wired.sinks[sink], bytes),
            Channel::Request => node.pass_call(wired.service, call, Arc::clone(bytes)),
            Channel::Reply => {
                if let Some(call) = call {
                    node.reply(call, Ok(Arc::clone(bytes)));
                }
            }
        }
    }

    /// Something that came in, as an event.
    fn incoming(&self, incoming: Incoming) -> Option<Event> {
        match incoming {
            Incoming::Note(note) => Some(Event::Note(note)),
            Incoming::Message { subscription, bytes, arrived } => match self.roles.get(subscription)? {
                Role::Clock => Some(wired::clock(&bytes).map_or_else(
                    || Event::Note(format!("a message of the clock is not a `{CLOCK}`, and is left out")),
                    Event::Clock,
                )),
                Role::Source { line, source } => Some(self.event(*line, *source, None, &bytes, arrived)),
            },
            Incoming::Call { service, call, bytes, arrived } => {
                let [request, _] = self.services.get(service)?;
                let Some(line) = *request else {
                    self.node.as_ref()?.pass_call(service, Some(call), bytes);
                    return None;
                };
                Some(self.event(line, 0, Some(call), &bytes, arrived))
            }
            Incoming::Reply { service, call, bytes, arrived } => {
                let [_, reply] = self.services.get(service)?;
                let Some(line) = *reply else {
                    self.node.as_ref()?.reply(call, Ok(bytes));
                    return None;
                };
                Some(self.event(line, 0, Some(call), &bytes, arrived))
            }
        }
    }
}

impl Bus for Ros1Bus {
    fn connect(&mut self, lines: &[Line], address: &dyn Fn(&str) -> String) -> Result<bool, TransportError> {
        let master = address(&self.master);
        let at = Address::read(&master).ok_or_else(|| {
            TransportError::Wiring(format!(
                "`{master}` is not the address of a master, such as `http://127.0.0.1:11311`"
            ))
        })?;
        let started = Node::start(&at, &self.name).map_err(|error| TransportError::Wiring(error.to_string()))?;
        let Some(node) = started else { return Ok(false) };
        let lost = |error: crate::master::AskError| lost(&at, &error.to_string());
        (self.lines, self.roles, self.services) = (Vec::new(), Vec::new(), Vec::new());
        for line in lines {
            let mut wired = wire(&self.plan, &self.ros.interfaces, line)?;
            if line.channel == Channel::Topic {
                let (roles, position) = (&mut self.roles, self.lines.len());
                let each = |source| roles.push(Role::Source { line: position, source });
                wired.subscribe(&node, &self.ros.interfaces, each)?;
            } else {
                wired.serve(&node, &self.lines, &mut self.services, self.lines.len());
            }
            self.lines.push(wired);
        }
        if let Clock::Topic { path } = &self.ros.clock {
            let path = wired::absolute(path);
            self.roles.push(Role::Clock);
            let subscription = node.subscribe(Subscription::new(&path, CLOCK, None, Vec::new())).map_err(lost)?;
            self.clock = Some(Clocked { path, subscription });
        }
        node.watch();
        self.node = Some(node);
        Ok(true)
    }

    fn missing(&mut self) -> Vec<String> {
        presence::missing(self)
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Event>, TransportError> {
        let until = Instant::now() + timeout;
        loop {
            let node = self.node()?;
            let silent = node.silent_for();
            if silent > FOUND_AGAIN_WITHIN {
                return Err(lost(&node.master.at, &format!("it has not answered for {} s", silent.as_secs())));
            }
            let Some(incoming) = node.inbox.pop(until.saturating_duration_since(Instant::now())) else {
                return Ok(None);
            };
            if let Some(event) = self.incoming(incoming) {
                return Ok(Some(event));
            }
        }
    }

    fn is_connected(&self) -> bool {
        self.node.as_ref().is_some_and(|node| node.silent_for() < UNANSWERED)
    }

    fn publish(&mut self, line: usize, sink: usize, value: &Value, call: Option<u64>) -> Result<(), TransportError> {
        let wired = &self.lines[line];
        let bytes = wired
            .codec
            .write(value)
            .map_err(|error| TransportError::WrongType { path: wired.line.path.clone(), reason: error.to_string() })?;
        self.send(line, sink, &bytes, call);
        Ok(())
    }

    fn is_heard(&self, line: usize) -> bool {
        presence::is_heard(self, line)
    }

    fn reset(&mut self, within: Duration) -> Result<(), TransportError> {
        let (Some(service), Some(node)) = (&self.ros.reset, &self.node) else { return Ok(()) };
        let service = wired::absolute(service);
        let failed = |problem: String| TransportError::Simulator(format!("the reset by `{service}` failed: {problem}"));
        let (header, reply) =
            node.call(&service, Some(&[]), Some(within)).map_err(|error| failed(error.to_string()))?;
        match header.get("type") {
            "std_srvs/Empty" => Ok(()),
            "std_srvs/Trigger" => match wired::trigger(&reply) {
                Some(Ok(())) => Ok(()),
                Some(Err(message)) => Err(failed(message)),
                None => Err(failed("its reply is none of `std_srvs/Trigger`".to_owned())),
            },
            other => Err(TransportError::Wiring(format!(
                "service `{service}` is of type `{other}`; expected `std_srvs/Trigger` or `std_srvs/Empty`"
            ))),
        }
    }

    fn disconnect(&mut self) {
        self.node = None;
        self.clock = None;
    }
}
