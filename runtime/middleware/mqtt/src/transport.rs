//! The runner as a client of brokers: a bus.

use std::collections::hash_map::DefaultHasher;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::hash::{Hash as _, Hasher as _};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::{Duration, Instant};

use bytes::Bytes;
use rumqttc::v5::mqttbytes::v5::{Publish, PublishProperties};
use sesame_lifecycle::launch::LaunchContext;
use sesame_plan::{BrokerAt, CampaignPlan, Mqtt};
use sesame_relay::json::Codec;
use sesame_relay::transport::bus::echo::Echoes;
use sesame_relay::transport::bus::secret::{Token, trusted};
use sesame_relay::transport::bus::{Bus, Event, Settings, on_bus, tls};
use sesame_relay::transport::{Connect, Transport, TransportError};
use sesame_relay::value::Value;
use sesame_relay::wire::Line;

use crate::address::Address;
use crate::connection::{Account, Connection, Passed, Received};
use crate::routes::{Role, Routes, Topic};
use crate::session::quality;

/// How many messages may wait for the relay, besides those that wait while it publishes.
const WAITING: usize = 10_000;

/// How long a broker may take no messages.
const STUCK: Duration = Duration::from_secs(10);

/// Connects to a system whose messages go over brokers of MQTT; launched programs run in this folder.
pub fn mqtt(folder: PathBuf) -> Connect {
    Connect::new(connect, folder)
}

fn connect(plan: &CampaignPlan, folder: &Path) -> Box<dyn Transport> {
    let Some(mqtt) = plan.simulator.brokers() else {
        unreachable!("the generator connects each kind of simulator by its own transport")
    };
    let context = LaunchContext::of_worker(folder.to_owned()).remapping(plan);
    let bus = Brokers {
        worker: context.worker,
        codec: Codec::new(plan),
        echoes: plan.simulator.lifecycle.relay_budget.map(|_| Echoes::default()),
        plan: plan.clone(),
        mqtt: mqtt.clone(),
        folder: folder.to_owned(),
        lines: Vec::new(),
        routes: Routes::default(),
        connections: Vec::new(),
        urls: Vec::new(),
        incoming: None,
        early: VecDeque::new(),
        unready: BTreeMap::new(),
        latest: BTreeMap::new(),
        misfits: BTreeSet::new(),
        notes: VecDeque::new(),
    };
    on_bus(plan, Box::new(bus), Settings::of(plan), context)
}

struct Brokers {
    plan: CampaignPlan,
    mqtt: Mqtt,
    folder: PathBuf,
    worker: u32,
    codec: Codec,
    lines: Vec<Line>,
    routes: Routes,
    /// By the position of the broker.
    connections: Vec<Connection>,
    urls: Vec<String>,
    incoming: Option<Receiver<(BrokerAt, Passed)>>,
    /// What came in while a broker took no more messages.
    early: VecDeque<(BrokerAt, Passed)>,
    /// Brokers that are not connected yet.
    unready: BTreeMap<BrokerAt, String>,
    /// How the latest message of each line came: what is published in its place is like it.
    latest: BTreeMap<usize, Manner>,
    /// Topics of which a message did not fit.
    misfits: BTreeSet<String>,
    /// What is to be noted.
    notes: VecDeque<String>,
    /// What is awaited back from a broker, if the plan has a relay budget.
    echoes: Option<Echoes>,
}

/// How a message is sent, apart from its payload.
#[derive(Debug, Clone, Default)]
struct Manner {
    retain: bool,
    properties: Option<PublishProperties>,
}

impl Manner {
    /// The manner of a message, for others that it is passed to: what is between this client and its broker is left
    /// out.
    fn of(publish: &Publish) -> Manner {
        let properties = publish.properties.clone().map(|properties| PublishProperties {
            topic_alias: None,
            subscription_identifiers: Vec::new(),
            ..properties
        });
        Manner { retain: publish.retain, properties }
    }
}

impl Brokers {
    fn start(&mut self, lines: &[Line], address: &dyn Fn(&str) -> String) -> Result<(), TransportError> {
        self.lines = lines.to_vec();
        self.routes = Routes::new(&self.plan, &self.mqtt, lines, self.echoes.is_some());
        self.misfits.clear();
        self.notes.clear();
        self.latest.clear();
        self.early.clear();
        if let Some(echoes) = &mut self.echoes {
            echoes.clear();
        }
        let (queue, incoming) = sync_channel(WAITING);
        self.incoming = Some(incoming);
        for (at, broker) in self.mqtt.all().into_iter().enumerate() {
            let url = address(&broker.remote.url);
            let wrong = |problem: String| TransportError::Wiring(format!("the broker at `{url}`: {problem}"));
            let address = Address::read(&url).map_err(TransportError::Wiring)?;
            let pem = broker.remote.trust.as_ref().map(|path| trusted(path, &self.folder)).transpose()?;
            let tls = if address.tls { Some(tls::client(pem.as_deref()).map_err(wrong)?) } else { None };
            let token = broker.remote.token.as_ref().map(|secret| Token::read(secret, &self.folder)).transpose()?;
            let account = Account {
                address,
                tls,
                client: format!("sesame-relay-{}-{}-{at}", std::process::id(), self.worker),
                user: broker.user.clone(),
                token,
                subscriptions: self.routes.subscriptions(at),
                quality: quality(self.mqtt.quality),
            };
            let received = Received { broker: at, queue: queue.clone() };
            let connection = Connection::start(account, received).map_err(|error| wrong(error.to_string()))?;
            self.connections.push(connection);
            self.unready.insert(at, "it does not answer yet".to_owned());
            self.urls.push(url);
        }
        Ok(())
    }

    /// The next thing that came in, waited for at most this long.
    fn next(&mut self, timeout: Duration) -> Result<Option<(BrokerAt, Passed)>, TransportError> {
        if let Some(early) = self.early.pop_front() {
            return Ok(Some(early));
        }
        let Some(incoming) = &self.incoming else { return Err(self.lost(0, "it was closed")) };
        match incoming.recv_timeout(timeout) {
            Ok(passed) => Ok(Some(passed)),
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => Err(self.lost(0, "its thread ended")),
        }
    }

    fn event(&mut self, broker: BrokerAt, passed: Passed) -> Result<Option<Event>, TransportError> {
        match passed {
            Passed::Message(publish, arrived) => self.message(broker, &publish, arrived),
            Passed::Ready => {
                self.unready.remove(&broker);
                Ok(None)
            }
            Passed::NoAnswer(how) => {
                self.unready.insert(broker, how);
                Ok(None)
            }
            Passed::FoundAgain(after) => Ok(Some(Event::Note(format!(
                "the connection to the broker at `{}` was lost for {:.1} s; everything is subscribed to again, and \
                 messages may be missing",
                self.urls[broker],
                after.as_secs_f64()
            )))),
            Passed::Refused(how) => Err(TransportError::Wiring(format!(
                "the broker at `{}` refused the connection: {how}",
                self.urls[broker]
            ))),
            Passed::Lost(how) => Err(self.lost(broker, &how)),
        }
    }

    /// A message for the relay. One that does not fit is noted once per topic, and nothing reads it.
    fn message(
        &mut self,
        broker: BrokerAt,
        publish: &Publish,
        arrived: Instant,
    ) -> Result<Option<Event>, TransportError> {
        let Ok(topic) = std::str::from_utf8(&publish.topic) else { return Ok(None) };
        let (line, source, on_to) = match self.routes.heard.get(&(broker, topic.to_owned())) {
            None => return Ok(None),
            Some(&Role::Sink { line, sink }) => {
                let back =
                    self.echoes.as_mut().and_then(|echoes| echoes.heard(line, sink, hash(&publish.payload), arrived));
                return Ok(back.map(|added| Event::Returned { line, added }));
            }
            Some(Role::Source { line, source, on_to }) => (*line, *source, on_to.clone()),
        };
        let manner = Manner::of(publish);
        for other in on_to {
            let topic = (other, self.lines[line].path.clone());
            self.send(&topic, &publish.payload, &manner)?;
        }
        let text = std::str::from_utf8(&publish.payload);
        let read = text
            .map_err(|_| "it is not UTF-8".to_owned())
            .and_then(|text| self.codec.read(self.lines[line].topic, text).map_err(|mismatch| mismatch.to_string()));
        match read {
            Ok(value) => {
                self.latest.insert(line, manner);
                Ok(Some(Event::Message { line, source, value, call: None, arrived }))
            }
            Err(mismatch) => {
                if self.misfits.insert(topic.to_owned()) {
                    let said = "is not of its declared type, so nothing reads it";
                    self.notes.push_back(format!("a message on `{topic}` {said}: {mismatch}"));
                }
                self.latest.insert(line, manner);
                let value = Value::Opaque(Arc::from(&publish.payload[..]));
                Ok(Some(Event::Message { line, source, value, call: None, arrived }))
            }
        }
    }

    /// Sends a payload. While too many wait, what comes in is kept.
    fn send(&mut self, (broker, topic): &Topic, payload: &Bytes, manner: &Manner) -> Result<(), TransportError> {
        let mut publish = Publish::new(topic, quality(self.mqtt.quality), payload.clone(), manner.properties.clone());
        publish.retain = manner.retain;
        let limit = Instant::now() + STUCK;
        loop {
            match self.connections.get(*broker).map_or(Err(()), |connection| connection.send(publish)) {
                Ok(None) => return Ok(()),
                Ok(Some(back)) => publish = back,
                Err(()) => return Err(self.lost(*broker, "it was closed")),
            }
            if Instant::now() >= limit {
                return Err(self.lost(*broker, &format!("it takes no messages for {} s", STUCK.as_secs())));
            }
            let incoming = self.incoming.as_ref().filter(|_| self.early.len() < WAITING);
            match incoming.map(|incoming| incoming.recv_timeout(Duration::from_millis(1))) {
                Some(Ok(passed)) => self.early.push_back(passed),
                Some(Err(_)) => {}
                None => std::thread::sleep(Duration::from_millis(1)),
            }
        }
    }

    fn lost(&self, broker: BrokerAt, how: &str) -> TransportError {
        let url = self.urls.get(broker).map_or("", String::as_str);
        TransportError::ConnectionLost { to: format!("the broker at `{url}`"), how: how.to_owned() }
    }
}

impl Bus for Brokers {
    fn connect(&mut self, lines: &[Line], address: &dyn Fn(&str) -> String) -> Result<bool, TransportError> {
        if self.incoming.is_none() {
            self.start(lines, address)?;
        }
        let limit = Instant::now() + Duration::from_millis(100);
        while !self.unready.is_empty() {
            let left = limit.saturating_duration_since(Instant::now());
            // Messages that are retained come at once; they are of the system's state, and are for later.
            let mut early = std::mem::take(&mut self.early);
            let next = self.next(left);
            std::mem::swap(&mut early, &mut self.early);
            match next? {
                None => return Ok(false),
                Some(message @ (_, Passed::Message(..))) => self.early.push_back(message),
                Some((broker, passed)) => {
                    self.event(broker, passed)?;
                }
            }
        }
        Ok(true)
    }

    fn missing(&mut self) -> Vec<String> {
        let missing = self.unready.iter();
        missing.map(|(&broker, how)| format!("the broker at `{}`: {how}", self.urls[broker])).collect()
    }

    fn is_connected(&self) -> bool {
        self.connections.iter().all(Connection::stands)
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Event>, TransportError> {
        let limit = Instant::now() + timeout;
        loop {
            if let Some(note) = self.notes.pop_front() {
                return Ok(Some(Event::Note(note)));
            }
            let Some((broker, passed)) = self.next(limit.saturating_duration_since(Instant::now()))? else {
                return Ok(None);
            };
            if let Some(event) = self.event(broker, passed)? {
                return Ok(Some(event));
            }
        }
    }

    fn publish(&mut self, line: usize, sink: usize, value: &Value, _: Option<u64>) -> Result<(), TransportError> {
        let payload = match value {
            Value::Opaque(bytes) => Bytes::copy_from_slice(bytes),
            value => Bytes::from(self.codec.write(value)),
        };
        if let Some(echoes) = &mut self.echoes {
            echoes.published(line, sink, hash(&payload));
        }
        let manner = self.latest.get(&line).cloned().unwrap_or_default();
        for topic in self.routes.said[line][sink].clone() {
            self.send(&topic, &payload, &manner)?;
        }
        Ok(())
    }

    fn hears_itself(&self) -> bool {
        self.echoes.is_some()
    }

    fn came(&mut self, line: usize, sink: usize, arrived: Instant) {
        if let Some(echoes) = &mut self.echoes {
            echoes.came(line, sink, arrived);
        }
    }

    fn disconnect(&mut self) {
        self.connections.clear();
        self.incoming = None;
        self.urls.clear();
        self.unready.clear();
    }
}

fn hash(payload: &[u8]) -> u64 {
    let mut hasher = DefaultHasher::new();
    payload.hash(&mut hasher);
    hasher.finish()
}
