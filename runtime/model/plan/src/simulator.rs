//! The simulator of a system: its kind, what is fixed for a kind, and how a runner reaches it.

use serde::{Deserialize, Serialize};

use crate::{Clock, Dialect, Interface, Lifecycle, Mqtt, Proxy, Ros, Ros1, Ros2, Rosbridge, Simlog, Stepping, Wiring};

/// The simulator, and how the runner reaches it.
///
/// Whether it has what systems of ROS have, and a wiring, follows from its [kind](SimulatorProperties): a plan in which
/// that is not so is not sound.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(from = "Written", into = "Written")]
pub struct Simulator {
    /// Its name in the space.
    pub name: String,
    /// Its kind, with the settings that only this kind has.
    pub transport: Transport,
    /// What systems of ROS have in common; `None` for others.
    pub ros: Option<Ros>,
    /// Where clients connect that do not connect to the server itself; empty where there
    /// [are none](SimulatorProperties::proxies).
    pub proxies: Vec<Proxy>,
    /// How each topic of the plan is cut, in their order; empty where the simulator itself brings all messages.
    pub wiring: Vec<Wiring>,
    /// What starts and ends the system around it.
    pub lifecycle: Lifecycle,
}

/// How a runner exchanges messages with a simulator: the settings that one kind of simulator has, and others do not.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Transport {
    /// A Rust type linked into the runner, stepped in lock-step with the relay.
    InProcess {
        /// Path of the type, for example `kuka_cell_sim::Cell`.
        path: String,
        /// Simulation time of one step, in nanoseconds; positive.
        step_ns: u64,
    },
    /// A program that the runner starts and with which it exchanges lines of JSON.
    Process {
        /// The program: a name to be found on `PATH`, or a path relative to the folder of the `.sesame` file, in which
        /// the program runs. Where that folder is, generated code knows; a plan is the same wherever it lies.
        program: String,
        /// Its arguments, one by one; no shell reads them.
        arguments: Vec<String>,
        /// Simulation time of one step, in nanoseconds; positive. `None` for a simulator that runs freely: nobody steps
        /// it, so equal tests need not give equal results.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        step_ns: Option<u64>,
    },
    /// Nodes of ROS 2.
    Ros2(Ros2),
    /// Nodes of ROS behind a server that speaks the rosbridge protocol.
    Rosbridge(Rosbridge),
    /// Nodes of ROS 1.
    Ros1(Ros1),
    /// A system whose messages go over brokers of MQTT.
    Mqtt(Mqtt),
    /// A simulator that speaks SimlogAPI.
    Simlog(Simlog),
    /// Vehicles that speak `MAVLink` over UDP, each at a proxy, and their ground station.
    Mavlink {
        /// Where the ground station listens, for example `udp://127.0.0.1:14550`. It may contain placeholders as that
        /// of a [`Remote`](crate::Remote).
        url: String,
        /// The files that define messages, relative to the folder of the `.sesame` file.
        definitions: Vec<String>,
    },
}

/// What a program has to know to find a system that it joins.
#[derive(Debug, PartialEq, Eq)]
pub enum Endpoint<'a> {
    /// The domain of ROS 2.
    Domain(&'a mut u16),
    /// The address of the bridge, broker or master.
    Address(&'a mut String),
}

impl Simulator {
    /// A simulator that has nothing but the settings of its kind.
    pub fn new(name: &str, transport: Transport) -> Simulator {
        let (proxies, wiring, lifecycle) = (Vec::new(), Vec::new(), Lifecycle::default());
        Simulator { name: name.to_owned(), transport, ros: None, proxies, wiring, lifecycle }
    }

    /// What is fixed for its kind.
    pub fn properties(&self) -> SimulatorProperties {
        self.transport.kind().properties()
    }

    /// Simulation time of one step, in nanoseconds; `None` for a system that runs freely.
    pub fn step_ns(&self) -> Option<u64> {
        match &self.transport {
            Transport::InProcess { step_ns, .. } => Some(*step_ns),
            Transport::Process { step_ns, .. } => *step_ns,
            Transport::Simlog(simlog) => Some(simlog.step_ns),
            _ => self.stepping().map(|step| step.step_ns),
        }
    }

    /// How nodes of ROS are stepped; `None` for a system that is none of ROS, or runs freely.
    pub fn stepping(&self) -> Option<&Stepping> {
        self.ros.as_ref()?.step.as_ref()
    }

    /// Whether it has a clock of its own, on a topic of ROS.
    pub fn has_a_clock(&self) -> bool {
        self.ros.as_ref().is_some_and(|ros| matches!(ros.clock, Clock::Topic { .. }))
    }

    /// The ROS of its nodes; `None` for a system without ROS.
    pub fn dialect(&self) -> Option<Dialect> {
        match &self.transport {
            Transport::Rosbridge(rosbridge) => Some(rosbridge.dialect),
            _ => self.properties().ros,
        }
    }

    /// The Rust type that it is; `None` for a simulator that is not a part of the runner.
    pub fn rust_type(&self) -> Option<&str> {
        if let Transport::InProcess { path, .. } = &self.transport { Some(path) } else { None }
    }

    /// The program that it is, with its arguments; `None` for a simulator that is none that the runner starts.
    pub fn program(&self) -> Option<(&str, &[String])> {
        match &self.transport {
            Transport::Process { program, arguments, .. } => Some((program.as_str(), arguments.as_slice())),
            _ => None,
        }
    }

    /// The brokers over which its messages go; `None` for a system without brokers.
    pub fn brokers(&self) -> Option<&Mqtt> {
        if let Transport::Mqtt(mqtt) = &self.transport { Some(mqtt) } else { None }
    }

    /// The same, to be changed.
    pub fn brokers_mut(&mut self) -> Option<&mut Mqtt> {
        if let Transport::Mqtt(mqtt) = &mut self.transport { Some(mqtt) } else { None }
    }

    /// The settings of a simulator that speaks SimlogAPI, to be changed; `None` for others.
    pub fn simlog_mut(&mut self) -> Option<&mut Simlog> {
        if let Transport::Simlog(simlog) = &mut self.transport { Some(simlog) } else { None }
    }

    /// The addresses at which its system is found, then those at which nodes find the runner; none where it has none.
    pub fn addresses(&self) -> Vec<&str> {
        let mut addresses: Vec<&str> = match &self.transport {
            Transport::Rosbridge(rosbridge) => vec![&rosbridge.remote.url],
            Transport::Ros1(ros1) => vec![&ros1.master],
            Transport::Simlog(simlog) => vec![&simlog.url],
            Transport::Mavlink { url, .. } => vec![url],
            _ => Vec::new(),
        };
        addresses.extend(self.brokers().into_iter().flat_map(Mqtt::all).map(|broker| broker.remote.url.as_str()));
        addresses.extend(self.proxies.iter().map(|proxy| proxy.url.as_str()));
        addresses
    }

    /// The address of the one system that all workers would use; `None` if each has its own, with which several can run
    /// at a time.
    pub fn shared_address(&self) -> Option<&str> {
        self.addresses().into_iter().find(|address| is_shared(address))
    }

    /// Where a program that joins it finds it, to be changed; `None` for a simulator that nobody joins.
    pub fn endpoint(&mut self) -> Option<Endpoint<'_>> {
        match &mut self.transport {
            Transport::Ros2(ros2) => Some(Endpoint::Domain(&mut ros2.domain)),
            Transport::Rosbridge(rosbridge) => Some(Endpoint::Address(&mut rosbridge.remote.url)),
            Transport::Ros1(ros1) => Some(Endpoint::Address(&mut ros1.master)),
            Transport::Mqtt(mqtt) => Some(Endpoint::Address(&mut mqtt.broker.remote.url)),
            _ => None,
        }
    }
}

/// Whether an address is the same for all workers: it has none of the placeholders for which each has a value of its
/// own.
pub fn is_shared(address: &str) -> bool {
    !["{port}", "{worker}", "{domain}"].iter().any(|own| address.contains(own))
}

/// A simulator as JSON has it: all that its kind says of it is in one object.
#[derive(Serialize, Deserialize)]
struct Written {
    name: String,
    transport: Settings,
    #[serde(default, skip_serializing_if = "Lifecycle::is_default")]
    lifecycle: Lifecycle,
}

/// The settings of a simulator as JSON has them, in this order. Those are missing that its kind does not have.
#[derive(Serialize, Deserialize)]
struct Settings {
    #[serde(flatten)]
    own: Transport,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    clock: Option<Clock>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    step: Option<Stepping>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    reset: Option<String>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    proxies: Vec<Proxy>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    interfaces: Option<Vec<Interface>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    wiring: Option<Vec<Wiring>>,
}

impl From<Written> for Simulator {
    fn from(Written { name, transport, lifecycle }: Written) -> Self {
        let Settings { own, clock, step, reset, proxies, interfaces, wiring } = transport;
        let ros = clock.zip(interfaces).map(|(clock, interfaces)| Ros { clock, step, reset, interfaces });
        Simulator { name, transport: own, ros, proxies, wiring: wiring.unwrap_or_default(), lifecycle }
    }
}

impl From<Simulator> for Written {
    fn from(simulator: Simulator) -> Self {
        let on_a_bus = simulator.properties().bus.is_some();
        let Simulator { name, transport, ros, proxies, wiring, lifecycle } = simulator;
        let mut settings = Settings {
            own: transport,
            clock: None,
            step: None,
            reset: None,
            proxies,
            interfaces: None,
            wiring: (on_a_bus || !wiring.is_empty()).then_some(wiring),
        };
        if let Some(Ros { clock, step, reset, interfaces }) = ros {
            let (clock, interfaces) = (Some(clock), Some(interfaces));
            settings = Settings { clock, step, reset, interfaces, ..settings };
        }
        Written { name, transport: settings, lifecycle }
    }
}

/// A kind of simulator: a [`Transport`] without its settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SimulatorKind {
    /// A Rust type linked into the runner.
    InProcess,
    /// A program that the runner starts.
    Process,
    /// Nodes of ROS 2.
    Ros2,
    /// Nodes of ROS behind a server that speaks the rosbridge protocol.
    Rosbridge,
    /// Nodes of ROS 1.
    Ros1,
    /// A system whose messages go over brokers of MQTT.
    Mqtt,
    /// A simulator that speaks SimlogAPI.
    Simlog,
    /// Vehicles that speak `MAVLink` over UDP, and their ground station.
    Mavlink,
}

impl Transport {
    /// Which kind of simulator it is for.
    pub const fn kind(&self) -> SimulatorKind {
        match self {
            Transport::InProcess { .. } => SimulatorKind::InProcess,
            Transport::Process { .. } => SimulatorKind::Process,
            Transport::Ros2(_) => SimulatorKind::Ros2,
            Transport::Rosbridge(_) => SimulatorKind::Rosbridge,
            Transport::Ros1(_) => SimulatorKind::Ros1,
            Transport::Mqtt(_) => SimulatorKind::Mqtt,
            Transport::Simlog(_) => SimulatorKind::Simlog,
            Transport::Mavlink { .. } => SimulatorKind::Mavlink,
        }
    }
}

/// How addresses begin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Schemes {
    /// Over plain TCP.
    pub plain: &'static str,
    /// Over TLS, if there is such a way.
    pub encrypted: Option<&'static str>,
    /// A whole address, for examples.
    pub example: &'static str,
}

/// What is fixed for a kind of simulator: the one table of words, features, addresses and of what a runner can do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(clippy::struct_excessive_bools, reason = "a row of a table, many columns of which are yes or no")]
pub struct SimulatorProperties {
    /// Its word in the language and in plans. The function of the runtime that connects to it is named so, too.
    pub keyword: &'static str,
    /// The feature of the runtime, and of `sesamec`, that reaches it; `None` if every runner can.
    pub feature: Option<&'static str>,
    /// The feature that it takes in place of that one at an address over TLS; `None` if it takes no other.
    pub feature_over_tls: Option<&'static str>,
    /// How its addresses begin; `None` if it has no address.
    pub address: Option<Schemes>,
    /// What a runner, or a monitor as a program of its own, is between its nodes: `as a node of ROS 2`. `None` where
    /// the simulator itself brings all messages, so that no topic is wired and no node told apart.
    pub bus: Option<&'static str>,
    /// The ROS of its messages, unless its settings say another; `None` if they are of none.
    pub ros: Option<Dialect>,
    /// Whether it is a part of the runner, so that there is nothing to launch, and nothing to start again after a
    /// crash.
    pub in_runner: bool,
    /// Whether nobody but the runner may be connected to it.
    pub one_client: bool,
    /// Whether nodes can be at brokers of their own.
    pub brokers: bool,
    /// Whether the runner can stand for its server towards some nodes.
    pub proxies: bool,
    /// Whether a topic that is cut has a second name, on which its publishers are: `TOPIC/undisturbed`. Where it has
    /// none, the runner is between the addresses of nodes, or brings the messages itself.
    pub renames: bool,
    /// Whether the name of a topic says which of the messages it carries that the user's files define.
    pub named_messages: bool,
    /// Whether the runner reaches its nodes themselves: it sets their parameters, pauses, slows and kills them, and
    /// asks them for a step.
    pub reaches_nodes: bool,
    /// Whether its nodes are parts of the simulator, which pauses, slows and kills them itself when the runner says so.
    pub orders_nodes: bool,
    /// Whether a run can begin with other values of the simulator's parameters.
    pub takes_parameters: bool,
    /// Whether its messages may lack fields, as those in JSON may.
    pub optional_fields: bool,
}

impl SimulatorKind {
    /// All of them.
    pub const ALL: [SimulatorKind; 8] = [
        SimulatorKind::InProcess,
        SimulatorKind::Process,
        SimulatorKind::Ros2,
        SimulatorKind::Rosbridge,
        SimulatorKind::Ros1,
        SimulatorKind::Mqtt,
        SimulatorKind::Simlog,
        SimulatorKind::Mavlink,
    ];

    /// The kind with this word.
    pub fn from_keyword(keyword: &str) -> Option<SimulatorKind> {
        SimulatorKind::ALL.into_iter().find(|kind| kind.properties().keyword == keyword)
    }

    /// What is fixed for it.
    pub const fn properties(self) -> SimulatorProperties {
        match self {
            SimulatorKind::InProcess => SimulatorProperties {
                in_runner: true,
                orders_nodes: true,
                takes_parameters: true,
                optional_fields: true,
                ..properties("in_process")
            },
            SimulatorKind::Process => SimulatorProperties {
                orders_nodes: true,
                takes_parameters: true,
                optional_fields: true,
                ..properties("process")
            },
            SimulatorKind::Ros2 => SimulatorProperties {
                feature: Some("ros2"),
                bus: Some("as a node of ROS 2"),
                ros: Some(Dialect::Ros2),
                renames: true,
                reaches_nodes: true,
                takes_parameters: true,
                ..properties("ros2")
            },
            SimulatorKind::Rosbridge => SimulatorProperties {
                feature: Some("rosbridge"),
                address: Some(Schemes { plain: "ws://", encrypted: Some("wss://"), example: "ws://127.0.0.1:9090" }),
                bus: Some("as a client of the rosbridge server"),
                ros: Some(Dialect::Ros2),
                proxies: true,
                renames: true,
                ..properties("rosbridge")
            },
            SimulatorKind::Ros1 => SimulatorProperties {
                feature: Some("ros1"),
                address: Some(Schemes { plain: "http://", encrypted: None, example: "http://127.0.0.1:11311" }),
                bus: Some("as a node of ROS 1"),
                ros: Some(Dialect::Ros1),
                renames: true,
                ..properties("ros1")
            },
            SimulatorKind::Mqtt => SimulatorProperties {
                feature: Some("mqtt"),
                address: Some(Schemes {
                    plain: "mqtt://",
                    encrypted: Some("mqtts://"),
                    example: "mqtt://127.0.0.1:1883",
                }),
                bus: Some("as a client of the MQTT broker"),
                brokers: true,
                renames: true,
                optional_fields: true,
                ..properties("mqtt")
            },
            SimulatorKind::Simlog => SimulatorProperties {
                feature: Some("simlog"),
                feature_over_tls: Some("simlog-tls"),
                address: Some(Schemes {
                    plain: "http://",
                    encrypted: Some("https://"),
                    example: "http://127.0.0.1:8089",
                }),
                one_client: true,
                ..properties("simlog")
            },
            SimulatorKind::Mavlink => SimulatorProperties {
                feature: Some("mavlink"),
                address: Some(Schemes { plain: "udp://", encrypted: None, example: "udp://127.0.0.1:14550" }),
                bus: Some("between vehicles and their ground station"),
                proxies: true,
                one_client: true,
                named_messages: true,
                ..properties("mavlink")
            },
        }
    }
}

/// A simulator that every runner reaches, and that brings all messages itself.
const fn properties(keyword: &'static str) -> SimulatorProperties {
    SimulatorProperties {
        keyword,
        feature: None,
        feature_over_tls: None,
        address: None,
        bus: None,
        ros: None,
        in_runner: false,
        one_client: false,
        brokers: false,
        proxies: false,
        renames: false,
        named_messages: false,
        reaches_nodes: false,
        orders_nodes: false,
        takes_parameters: false,
        optional_fields: false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Simulators in the JSON of plans, one in each line: of each kind one with all that it can have, then one with as
    /// little as possible.
    const IN_JSON: &str = include_str!("fixtures/simulators.jsonl");

    /// Digests of campaigns are over these bytes, and results of earlier releases hold them.
    #[test]
    fn each_kind_keeps_its_form_in_json() {
        let mut kinds = Vec::new();
        for text in IN_JSON.lines() {
            let read: Simulator = serde_json::from_str(text).unwrap();
            assert_eq!(serde_json::to_string(&read).unwrap(), text);
            let properties = read.properties();
            assert!(text.contains(&format!(r#""kind":"{}""#, properties.keyword)), "{text}");
            assert_eq!(read.ros.is_some(), properties.ros.is_some(), "{text}");
            assert_eq!(text.contains("wiring"), properties.bus.is_some(), "{text}");
            kinds.push(read.transport.kind());
        }
        kinds.dedup();
        assert_eq!(kinds, SimulatorKind::ALL);
    }

    #[test]
    fn each_kind_has_a_word_of_its_own_and_addresses_begin_as_they_should() {
        for kind in SimulatorKind::ALL {
            let properties = kind.properties();
            assert_eq!(SimulatorKind::from_keyword(properties.keyword), Some(kind));
            let example = properties.address.map(|Schemes { plain, example, .. }| example.starts_with(plain));
            assert_ne!(example, Some(false), "{properties:?}");
        }
        assert_eq!(SimulatorKind::from_keyword("dds"), None);
    }

    #[test]
    fn what_is_wrong_in_shared_settings_is_said() {
        let of_ros = IN_JSON.lines().find(|text| text.contains("ros2")).unwrap();
        let read = serde_json::from_str::<Simulator>(&of_ros.replace(r#""cut":true"#, r#""cut":"yes""#));
        let said = read.unwrap_err().to_string();
        assert!(said.contains("expected a boolean"), "{said}");
    }
}
