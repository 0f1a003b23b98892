//! The transport to nodes of ROS behind a bridge: the runner is one of its clients.
//!
//! Publishers of topics that are cut publish on `TOPIC/undisturbed`, and the relay on `TOPIC`. Of a service that is
//! cut, the server is on `SERVICE/undisturbed`, and the runner offers `SERVICE` in its place.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use sesame_lifecycle::launch::LaunchContext;
use sesame_plan::{CampaignPlan, Channel, Clock, Dialect, Ros, Rosbridge};
use sesame_relay::transport::bus::echo::Echoes;
use sesame_relay::transport::bus::secret::{Token, identity, trusted};
use sesame_relay::transport::bus::{Bus, Event, FOUND_AGAIN_WITHIN, Settings, on_bus, tls};
use sesame_relay::transport::{Connect, Transport, TransportError};
use sesame_relay::value::Value;
use sesame_relay::wire::Line;

use crate::bare;
use crate::client::{Address, Client, ConnectError, Incoming};
use crate::echo::content;
use crate::operation::{Compression, Level, Operation};
use crate::payload::{Payloads, type_name};
use crate::proxy::{Proxies, Proxy};

/// How long a bridge may take to find the nodes behind it, once it is subscribed to: it does not say when it has.
const SETTLE: Duration = Duration::from_millis(500);

/// How many calls are remembered; the oldest are forgotten.
const CALLS: usize = 10_000;

/// Connects to nodes of ROS behind a bridge; launched programs run in this folder.
pub fn rosbridge(folder: PathBuf) -> Connect {
    Connect::new(connect, folder)
}

fn connect(plan: &CampaignPlan, folder: &Path) -> Box<dyn Transport> {
    let (sesame_plan::Transport::Rosbridge(rosbridge), Some(ros)) = (&plan.simulator.transport, &plan.simulator.ros)
    else {
        unreachable!("the generator connects each kind of simulator by its own transport")
    };
    let bridge = Bridge::new(plan, rosbridge, ros, folder);
    on_bus(plan, Box::new(bridge), Settings::of(plan), context(plan, rosbridge, folder))
}

/// Where launched programs run: as they would for a runner that is a node of ROS itself.
fn context(plan: &CampaignPlan, rosbridge: &Rosbridge, folder: &Path) -> LaunchContext {
    let context = LaunchContext::of_worker(folder.to_owned()).remapping(plan);
    match rosbridge.dialect {
        Dialect::Ros1 => {
            let logs = ("ROS_LOG_DIR".to_owned(), context.folder.join("ros").display().to_string());
            LaunchContext { environment: vec![logs], ..context }
        }
        Dialect::Ros2 => context.in_domain(rosbridge.domain),
    }
}

struct Bridge {
    plan: CampaignPlan,
    settings: Rosbridge,
    ros: Ros,
    folder: PathBuf,
    payloads: Payloads,
    lines: Vec<Line>,
    client: Option<Client>,
    /// Where other clients connect, once it listens.
    proxies: Option<Proxies>,
    /// What they reported.
    reported: VecDeque<String>,
    /// Where it is, with placeholders filled.
    url: String,
    connected: Instant,
    /// The position of a source or clock by its topic.
    topics: BTreeMap<String, Heard>,
    /// Calls of services that go on under numbers of ours.
    calls: BTreeMap<u64, Call>,
    count: u64,
    /// Topics of which a message did not fit.
    misfits: BTreeSet<String>,
    /// What is awaited back from the bridge, if the plan has a relay budget.
    echoes: Option<Echoes>,
}

/// A call of a service that the runner offers.
#[derive(Debug, Clone)]
struct Call {
    service: String,
    /// The id that the caller gave, if any.
    id: Option<String>,
}

/// What a topic is for.
#[derive(Debug, Clone, Copy)]
enum Heard {
    Source {
        line: usize,
        source: usize,
    },
    /// The runner publishes on it: what comes from there went through the bridge.
    Sink {
        line: usize,
        sink: usize,
    },
    Clock,
}

impl Bridge {
    fn new(plan: &CampaignPlan, settings: &Rosbridge, ros: &Ros, folder: &Path) -> Self {
        Bridge {
            payloads: Payloads::new(plan, settings.dialect, &ros.interfaces),
            plan: plan.clone(),
            settings: settings.clone(),
            ros: ros.clone(),
            folder: folder.to_owned(),
            lines: Vec::new(),
            client: None,
            proxies: None,
            reported: VecDeque::new(),
            url: String::new(),
            connected: now(),
            topics: BTreeMap::new(),
            calls: BTreeMap::new(),
            count: 0,
            misfits: BTreeSet::new(),
            echoes: plan.simulator.lifecycle.relay_budget.map(|_| Echoes::default()),
        }
    }

    fn address(&self, url: String) -> Result<Address, TransportError> {
        let remote = &self.settings.remote;
        let token = remote.token.as_ref().map(|secret| Token::read(secret, &self.folder)).transpose()?;
        Ok(Address {
            url,
            token: token.map(|token| token.reveal().to_owned()),
            trusted: remote.trust.as_ref().map(|path| trusted(path, &self.folder)).transpose()?,
            found_again_within: FOUND_AGAIN_WITHIN,
        })
    }

    /// A proxy with all that it needs read.
    fn proxy(&self, proxy: &sesame_plan::Proxy, fill: &dyn Fn(&str) -> String) -> Result<Proxy, TransportError> {
        let node = self.plan.node(proxy.node).name.clone();
        let tls = match &proxy.identity {
            Some(files) => {
                let (certificate, key) = identity(files, &self.folder)?;
                let problem = |problem| TransportError::Wiring(format!("the proxy of node `{node}`: {problem}"));
                Some(tls::server(&certificate, &key).map_err(problem)?)
            }
            None => None,
        };
        Ok(Proxy {
            url: fill(&proxy.url),
            token: proxy.token.as_ref().map(|secret| Token::read(secret, &self.folder)).transpose()?,
            tls,
            public: proxy.public,
            renamed: self.plan.renamed(proxy.node),
            bridge: self.address(fill(&self.settings.remote.url))?,
            node,
        })
    }

    /// The type of a line's messages, as this ROS names it; that of a service without its direction.
    fn type_of(&self, line: &Line) -> String {
        let interface = self.plan.topic(line.topic).interface.as_deref().unwrap_or_default();
        let interface = match line.channel {
            Channel::Topic => interface,
            Channel::Request => interface.trim_end_matches("_Request"),
            Channel::Reply => interface.trim_end_matches("_Response"),
        };
        type_name(interface, self.settings.dialect)
    }

    /// Says what the runner wants to hear, and what it will say.
    fn introduce(&mut self, client: &Client) {
        self.topics.clear();
        let compression = match self.settings.compression {
            sesame_plan::Compression::None => None,
            sesame_plan::Compression::Cbor => Some(Compression::Cbor),
            sesame_plan::Compression::Png => Some(Compression::Png),
        };
        let subscribe = |topic: &str, ty: String| Operation::Subscribe {
            id: Some(format!("sesame subscribe {topic}")),
            topic: topic.to_owned(),
            ty: Some(ty),
            throttle_rate: None,
            queue_length: Some(0),
            fragment_size: None,
            compression,
        };
        for (at, line) in self.lines.iter().enumerate() {
            let ty = self.type_of(line);
            match line.channel {
                Channel::Topic => {
                    // Before anything is heard, so that what is heard can go on.
                    for sink in &line.sinks {
                        client.stand(&Operation::Advertise {
                            id: Some(format!("sesame advertise {}", sink.path)),
                            topic: sink.path.clone(),
                            ty: ty.clone(),
                            latch: None,
                            queue_size: None,
                        });
                    }
                    if self.echoes.is_some() {
                        for (sink, of) in line.sinks.iter().enumerate() {
                            self.topics.insert(of.path.clone(), Heard::Sink { line: at, sink });
                            client.stand(&subscribe(&of.path, ty.clone()));
                        }
                    }
                    for (source, of) in line.sources.iter().enumerate() {
                        self.topics.insert(of.path.clone(), Heard::Source { line: at, source });
                        client.stand(&subscribe(&of.path, ty.clone()));
                    }
                }
                Channel::Request => {
                    client.stand(&Operation::AdvertiseService { service: line.path.clone(), ty });
                }
                Channel::Reply => {}
            }
        }
        if let Clock::Topic { path } = &self.ros.clock {
            self.topics.insert(path.clone(), Heard::Clock);
            client.stand(&subscribe(path, type_name("rosgraph_msgs/msg/Clock", self.settings.dialect)));
        }
    }

    fn line_of(&self, path: &str, channel: Channel) -> Option<usize> {
        self.lines.iter().position(|line| line.channel == channel && line.path == path)
    }

    fn event(&mut self, incoming: Incoming) -> Result<Option<Event>, TransportError> {
        match incoming {
            Incoming::Operation(operation, arrived) => self.operation(*operation, arrived),
            Incoming::Malformed(problem) => Ok(Some(Event::Note(format!(
                "the bridge at `{}` sent something that is not part of its protocol: {problem}",
                self.url
            )))),
            Incoming::FoundAgain(after) => Ok(Some(Event::Note(format!(
                "the connection to the bridge at `{}` was lost for {:.1} s; everything is subscribed to again, and \
                 messages may be missing",
                self.url,
                after.as_secs_f64()
            )))),
            Incoming::Lost(how) => Err(self.lost(how)),
        }
    }

    fn operation(&mut self, operation: Operation, arrived: Instant) -> Result<Option<Event>, TransportError> {
        match operation {
            Operation::Publish { topic, msg, .. } => match self.topics.get(&topic) {
                Some(&Heard::Source { line, source }) => Ok(Some(self.message(line, source, None, &msg, arrived))),
                Some(&Heard::Sink { line, sink }) => {
                    let back = self.echoes.as_mut().and_then(|echoes| echoes.heard(line, sink, content(&msg), arrived));
                    Ok(back.map(|added| Event::Returned { line, added }))
                }
                Some(Heard::Clock) => Ok(Some(match clock(&msg) {
                    Some(nanos) => Event::Clock(nanos),
                    None => Event::Note(format!("a message on the clock `{topic}` is none of a clock")),
                })),
                None => Ok(None),
            },
            Operation::CallService { id, service, args, .. } => {
                let Some(line) = self.line_of(&service, Channel::Request) else { return Ok(None) };
                self.count += 1;
                self.calls.insert(self.count, Call { service, id });
                if self.calls.len() > CALLS {
                    self.calls.pop_first();
                }
                let args = args.unwrap_or_else(|| serde_json::json!({}));
                Ok(Some(self.message(line, 0, Some(self.count), &args, arrived)))
            }
            Operation::ServiceResponse { id, values, result, .. } => {
                let Some(call) = id.as_deref().and_then(|id| id.strip_prefix(CALL)?.parse().ok()) else {
                    return Ok(None);
                };
                self.replied(call, values, result, arrived)
            }
            Operation::Status { level: level @ (Level::Warning | Level::Error), msg, .. } => {
                let level = if level == Level::Error { "an error" } else { "a warning" };
                let said: String = msg.chars().take(500).collect();
                Ok(Some(Event::Note(format!("the bridge at `{}` reports {level}: {said}", self.url))))
            }
            _ => Ok(None),
        }
    }

    /// A reply of a server that the runner has called for somebody.
    fn replied(
        &mut self,
        call: u64,
        values: Option<serde_json::Value>,
        result: bool,
        arrived: Instant,
    ) -> Result<Option<Event>, TransportError> {
        let Some(Call { service, id }) = self.calls.get(&call).cloned() else { return Ok(None) };
        let Some(line) = self.line_of(&service, Channel::Reply) else { return Ok(None) };
        let values = values.unwrap_or_else(|| serde_json::json!({}));
        if result {
            return Ok(Some(self.message(line, 0, Some(call), &values, arrived)));
        }
        // There is no reply that operations could act on: the client gets the bridge's error.
        self.say(Operation::ServiceResponse { id, service, values: Some(values), result: false }.text())?;
        Ok(None)
    }

    /// A message for the relay. One that does not fit is noted once per topic, and nothing reads it.
    fn message(
        &mut self,
        line: usize,
        source: usize,
        call: Option<u64>,
        message: &serde_json::Value,
        arrived: Instant,
    ) -> Event {
        let value = self.payloads.read(self.lines[line].topic, message).unwrap_or_else(|mismatch| {
            let path = &self.lines[line].sources[source].path;
            if self.misfits.insert(path.clone()) {
                let said = "is not of its declared type, so nothing reads it";
                self.reported.push_back(format!("a message on `{path}` {said}: {mismatch}"));
            }
            Value::Opaque(Arc::from(message.to_string().into_bytes()))
        });
        Event::Message { line, source, value, call, arrived }
    }

    fn publish_text(&self, line: usize, sink: usize, text: &str, call: Option<u64>) -> Result<(), TransportError> {
        let (channel, path) = (self.lines[line].channel, &self.lines[line].sinks[sink].path);
        let quoted = |text: &str| serde_json::Value::from(text).to_string();
        let path = quoted(path);
        let text = bare::unmarked(text.to_owned());
        match (channel, call) {
            (Channel::Topic, _) => self.say(format!(r#"{{"op":"publish","topic":{path},"msg":{text}}}"#)),
            (Channel::Request, Some(call)) => {
                let (id, ty) = (quoted(&format!("{CALL}{call}")), quoted(&self.type_of(&self.lines[line])));
                self.say(format!(r#"{{"op":"call_service","id":{id},"service":{path},"type":{ty},"args":{text}}}"#))
            }
            (Channel::Reply, Some(call)) => {
                let Some(Call { id, .. }) = self.calls.get(&call) else { return Ok(()) };
                let id = id.as_ref().map_or(String::new(), |id| format!(r#""id":{},"#, quoted(id)));
                self.say(format!(r#"{{"op":"service_response",{id}"service":{path},"values":{text},"result":true}}"#))
            }
            // A message that an operation made up belongs to no call.
            (Channel::Request | Channel::Reply, None) => Ok(()),
        }
    }

    fn say(&self, text: String) -> Result<(), TransportError> {
        match &self.client {
            Some(client) if client.say(text) => Ok(()),
            _ => Err(self.lost("it was closed".to_owned())),
        }
    }

    fn lost(&self, how: String) -> TransportError {
        TransportError::ConnectionLost { to: format!("the bridge at `{}`", self.url), how }
    }

    fn client(&self) -> Result<&Client, TransportError> {
        self.client.as_ref().ok_or_else(|| self.lost("it was closed".to_owned()))
    }

    /// Passes something on that belongs to no run, and forgets notes about it.
    fn pass_on(&mut self, event: Event) -> Result<(), TransportError> {
        if let Event::Message { line, value, call, .. } = event
            && self.lines[line].cut
        {
            for sink in 0..self.lines[line].sinks.len() {
                self.publish(line, sink, &value, call)?;
            }
        }
        Ok(())
    }
}

/// What ids of calls begin with that the runner makes.
const CALL: &str = "sesame call ";

/// The id of the call that resets the simulator.
const RESET: &str = "sesame reset";

impl Bus for Bridge {
    fn listen(&mut self, address: &dyn Fn(&str) -> String) -> Result<(), TransportError> {
        if self.proxies.is_some() || self.plan.simulator.proxies.is_empty() {
            return Ok(());
        }
        let proxies = self.plan.simulator.proxies.iter().map(|proxy| self.proxy(proxy, address));
        self.proxies = Some(Proxies::listen(proxies.collect::<Result<_, _>>()?)?);
        Ok(())
    }

    fn connect(&mut self, lines: &[Line], address: &dyn Fn(&str) -> String) -> Result<bool, TransportError> {
        self.url = address(&self.settings.remote.url);
        let client = match Client::connect(&self.address(self.url.clone())?) {
            Ok(client) => client,
            Err(ConnectError::NoAnswer { .. }) => return Ok(false),
            Err(refused) => return Err(TransportError::Wiring(refused.to_string())),
        };
        self.lines = lines.to_vec();
        self.calls.clear();
        self.misfits.clear();
        if let Some(echoes) = &mut self.echoes {
            echoes.clear();
        }
        self.introduce(&client);
        self.client = Some(client);
        self.connected = now();
        Ok(true)
    }

    fn missing(&mut self) -> Vec<String> {
        let mut missing = self.proxies.as_ref().map_or_else(Vec::new, |proxies| proxies.missing(SETTLE));
        if self.connected.elapsed() < SETTLE {
            missing.push("the bridge has just been subscribed to".to_owned());
        }
        missing
    }

    fn is_connected(&self) -> bool {
        self.client.as_ref().is_some_and(Client::stands)
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Event>, TransportError> {
        if let Some(proxies) = &self.proxies {
            self.reported.extend(proxies.notes());
        }
        if let Some(note) = self.reported.pop_front() {
            return Ok(Some(Event::Note(note)));
        }
        let limit = now() + timeout;
        loop {
            let Some(incoming) = self.client()?.receive(limit.saturating_duration_since(now())) else {
                return Ok(None);
            };
            if let Some(event) = self.event(incoming)? {
                return Ok(Some(event));
            }
        }
    }

    fn publish(&mut self, line: usize, sink: usize, value: &Value, call: Option<u64>) -> Result<(), TransportError> {
        let text = self.payloads.write(self.lines[line].topic, value);
        if let Some(echoes) = self.echoes.as_mut().filter(|_| self.lines[line].channel == Channel::Topic)
            && let Ok(message) = serde_json::from_str(&text)
        {
            echoes.published(line, sink, content(&message));
        }
        self.publish_text(line, sink, &text, call)
    }

    fn hears_itself(&self) -> bool {
        self.echoes.is_some()
    }

    fn came(&mut self, line: usize, sink: usize, arrived: Instant) {
        if let Some(echoes) = &mut self.echoes {
            echoes.came(line, sink, arrived);
        }
    }

    fn reset(&mut self, within: Duration) -> Result<(), TransportError> {
        let Some(service) = self.ros.reset.clone() else { return Ok(()) };
        let call = Operation::CallService {
            id: Some(RESET.to_owned()),
            service: service.clone(),
            ty: None,
            args: Some(serde_json::json!({})),
            fragment_size: None,
            compression: None,
        };
        self.say(call.text())?;
        let limit = now() + within;
        loop {
            let Some(incoming) = self.client()?.receive(limit.saturating_duration_since(now())) else {
                let awaited = format!("the answer of `{service}`, which resets the simulator,");
                return Err(TransportError::Silent { awaited, limit: within.as_secs_f64() });
            };
            if let Some(answer) = answer_to_reset(&incoming) {
                return answer
                    .map_err(|said| TransportError::Simulator(format!("`{service}` does not reset it: {said}")));
            }
            if let Some(event) = self.event(incoming)? {
                self.pass_on(event)?;
            }
        }
    }

    fn disconnect(&mut self) {
        self.client = None;
    }
}

/// What the service said that resets the simulator, if this is it: for a failure, its words.
fn answer_to_reset(incoming: &Incoming) -> Option<Result<(), String>> {
    let Incoming::Operation(operation, _) = incoming else { return None };
    let Operation::ServiceResponse { id: Some(id), values, result, .. } = &**operation else { return None };
    if id != RESET {
        return None;
    }
    let said = values.clone().unwrap_or_default();
    let failed = !result || said.get("success") == Some(&serde_json::Value::Bool(false));
    Some(if failed { Err(said.to_string().chars().take(500).collect()) } else { Ok(()) })
}

/// The time in a `rosgraph_msgs` `Clock`, in nanoseconds.
fn clock(message: &serde_json::Value) -> Option<i64> {
    let clock = message.get("clock")?;
    let part = |names: [&str; 2]| names.iter().find_map(|name| clock.get(*name)).and_then(serde_json::Value::as_i64);
    let seconds = part(["sec", "secs"])?;
    let nanos = part(["nanosec", "nsecs"])?;
    seconds.checked_mul(1_000_000_000)?.checked_add(nanos)
}

#[expect(clippy::disallowed_methods, reason = "an adapter: it waits for other processes")]
fn now() -> Instant {
    Instant::now()
}
