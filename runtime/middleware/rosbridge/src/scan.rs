//! What is behind a bridge: nodes, topics, services, and what messages have in common.
//!
//! A server with the services of rosapi is asked who is there. One without lists nothing, so whoever scans names the
//! topics. Messages are counted and looked at, and nothing is published.

mod assemble;
mod rosapi;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use serde_json::Value as Json;
use sesame_plan::{Dialect, Interface, Secret};
use sesame_relay::transport::TransportError;
use sesame_relay::transport::bus::secret::{Token, trusted};
use sesame_scan::{Arrivals, Facts, FoundTopic, Payloads, System};

use self::assemble::Graph;
use crate::bare;
use crate::client::{Address, Client, ConnectError, Incoming};
use crate::operation::{Level, Operation};
use crate::payload::type_name;

/// How long an answer may take.
const ANSWER: Duration = Duration::from_secs(5);

/// How long the server may be asked who is there, all questions together.
const ASKING: Duration = Duration::from_secs(60);

/// The most topics that are listened to.
const MOST_LISTENED: usize = 1000;

/// How a bridge is reached.
#[derive(Debug, Clone)]
pub struct ScanOptions {
    /// Its address.
    pub url: String,
    /// Where the token is that it wants.
    pub token: Option<Secret>,
    /// A file with the certificates of authorities that are trusted.
    pub trust: Option<String>,
    /// The folder to which files are relative.
    pub folder: PathBuf,
}

/// Why nothing can be seen.
#[derive(Debug, thiserror::Error)]
pub enum ScanError {
    /// A secret or a certificate cannot be used.
    #[error(transparent)]
    Settings(#[from] TransportError),
    /// There is no connection.
    #[error(transparent)]
    Connect(#[from] ConnectError),
    /// The connection was lost.
    #[error("the connection to the bridge at `{url}` was lost: {how}")]
    Lost {
        /// The address.
        url: String,
        /// How.
        how: String,
    },
}

/// A topic that somebody named.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Wanted {
    /// Its path.
    pub path: String,
    /// Its type, as a space names it, if it is known.
    pub ty: Option<String>,
}

/// Looks at what is behind a bridge.
pub struct Scanner {
    url: String,
    client: Client,
    begin: Instant,
    /// The number of the next question.
    next: u64,
    listened: Duration,
    arrivals: BTreeMap<String, Arrivals>,
    payloads: Payloads,
    /// What the server reported on topics, by path.
    refused: BTreeMap<String, String>,
    facts: Facts,
}

impl Scanner {
    /// Connects to a bridge.
    pub fn connect(options: &ScanOptions, dialect: Option<Dialect>) -> Result<Self, ScanError> {
        let token = options.token.as_ref().map(|secret| Token::read(secret, &options.folder)).transpose()?;
        let address = Address {
            url: options.url.clone(),
            token: token.map(|token| token.reveal().to_owned()),
            trusted: options.trust.as_ref().map(|path| trusted(path, &options.folder)).transpose()?,
            // A bridge that goes away while it is looked at has not been seen.
            found_again_within: Duration::ZERO,
        };
        let client = Client::connect(&address)?;
        let system =
            System::Rosbridge { url: options.url.clone(), dialect: dialect.unwrap_or_default(), rosapi: false };
        Ok(Scanner {
            url: options.url.clone(),
            client,
            begin: now(),
            next: 0,
            listened: Duration::ZERO,
            arrivals: BTreeMap::new(),
            payloads: Payloads::default(),
            refused: BTreeMap::new(),
            facts: Facts::of(system),
        })
    }

    /// Asks rosapi who is there. False if the server does not have it. The types tell which ROS it is, unless that is
    /// known already.
    pub fn ask(&mut self, dialect: Option<Dialect>) -> Result<bool, ScanError> {
        let until = now() + ASKING;
        let mut graph = Graph::default();
        let Some(topics) = self.call("topics", &[])? else { return Ok(false) };
        graph.topics = rosapi::topics(&topics);
        for at in 0..graph.topics.len() {
            // Servers of old do not tell the types with the topics.
            if graph.topics[at].1.is_empty() && now() < until {
                let path = graph.topics[at].0.clone();
                let answer = self.call("topic_type", &[("topic", &path)])?;
                graph.topics[at].1 = answer.and_then(|answer| rosapi::text(&answer, "type")).unwrap_or_default();
            }
        }
        let services = self.call("services", &[])?;
        for path in services.map(|answer| rosapi::texts(&answer, "services")).unwrap_or_default() {
            let mut ty = None;
            if assemble::is_of_the_system(&path) && now() < until {
                ty = self.call("service_type", &[("service", &path)])?.and_then(|answer| rosapi::text(&answer, "type"));
            }
            graph.services.push((path, ty.unwrap_or_default()));
        }
        match self.call("nodes", &[])?.map(|answer| rosapi::texts(&answer, "nodes")) {
            Some(nodes) if !nodes.is_empty() => {
                for name in nodes {
                    let mut details = rosapi::Details::default();
                    if assemble::is_node_of_the_system(&name) && now() < until {
                        let answer = self.call("node_details", &[("node", &name)])?;
                        details = answer.map(|answer| rosapi::details(&answer)).unwrap_or_default();
                    }
                    graph.nodes.push((name, details));
                }
            }
            // Without nodes there are still those who publish and subscribe.
            _ => {
                for (path, _) in graph.topics.clone() {
                    for (service, field) in [("publishers", "publishers"), ("subscribers", "subscribers")] {
                        if now() >= until {
                            break;
                        }
                        let names = self.call(service, &[("topic", &path)])?;
                        let names = names.map(|answer| rosapi::texts(&answer, field)).unwrap_or_default();
                        graph.add(&path, names, service == "publishers");
                    }
                }
            }
        }
        graph.late = now() >= until;
        let dialect = dialect.unwrap_or_else(|| graph.dialect());
        self.facts = graph.facts(System::Rosbridge { url: self.url.clone(), dialect, rosapi: true });
        Ok(true)
    }

    /// Adds topics that somebody named.
    pub fn add(&mut self, wanted: &[Wanted]) {
        for wanted in wanted {
            match self.facts.topics.iter_mut().find(|topic| topic.path == wanted.path) {
                Some(known) => known.ty = wanted.ty.clone().or(known.ty.take()),
                None => self.facts.topics.push(FoundTopic {
                    path: wanted.path.clone(),
                    ty: wanted.ty.clone(),
                    ..FoundTopic::default()
                }),
            }
        }
        self.facts.topics.sort_by(|one, other| one.path.cmp(&other.path));
    }

    /// What is there by now.
    pub fn facts(&self) -> &Facts {
        &self.facts
    }

    /// Listens to all topics for so long.
    pub fn listen(&mut self, time: Duration) -> Result<(), ScanError> {
        let System::Rosbridge { dialect, .. } = self.facts.system else {
            unreachable!("what is behind a bridge is behind a bridge")
        };
        self.facts.cut |= self.facts.topics.len() > MOST_LISTENED;
        for topic in self.facts.topics.iter().take(MOST_LISTENED) {
            self.client.say(
                Operation::Subscribe {
                    id: Some(format!("{TOPIC}{}", topic.path)),
                    topic: topic.path.clone(),
                    ty: topic.ty.as_ref().map(|ty| type_name(ty, dialect)),
                    throttle_rate: None,
                    queue_length: None,
                    fragment_size: None,
                    compression: None,
                }
                .text(),
            );
        }
        let until = now() + time;
        loop {
            let left = until.saturating_duration_since(now());
            if left.is_zero() {
                break;
            }
            if let Some(incoming) = self.client.receive(left) {
                self.take(incoming)?;
            }
        }
        self.listened += time;
        Ok(())
    }

    /// The layouts of types, as rosapi describes them. Types that it does not know are missing.
    pub fn describe(&mut self, types: &[String]) -> Result<BTreeMap<String, Vec<Interface>>, ScanError> {
        let System::Rosbridge { dialect, rosapi: true, .. } = self.facts.system else { return Ok(BTreeMap::new()) };
        let (until, mut described) = (now() + ASKING, BTreeMap::new());
        for ty in types {
            if now() >= until {
                break;
            }
            let answer = self.call("message_details", &[("type", &type_name(ty, dialect))])?;
            if let Some(layouts) = answer.and_then(|answer| rosapi::layouts(&answer)) {
                described.insert(ty.clone(), layouts);
            }
        }
        Ok(described)
    }

    /// Everything that was found, and what messages have in common.
    pub fn finish(mut self) -> (Facts, Payloads) {
        for topic in &mut self.facts.topics {
            let arrivals = self.arrivals.get(&topic.path).copied().unwrap_or_default();
            topic.messages = arrivals.messages();
            topic.rate = arrivals.rate();
            if topic.messages == 0 {
                topic.problem = self.refused.remove(&topic.path).map(|why| format!("the bridge says: {why}"));
            } else if topic.ty.is_none() {
                let problem = "messages come, but nobody says their type; name it with `--topic NAME:TYPE`";
                topic.problem = Some(problem.to_owned());
            }
        }
        self.facts.seconds = self.listened.as_secs_f64();
        self.facts.cut |= self.payloads.is_cut();
        (self.facts, self.payloads)
    }

    /// Calls a service of rosapi. What comes meanwhile is kept. `None` if there is no such service, or no answer.
    fn call(&mut self, service: &str, arguments: &[(&str, &str)]) -> Result<Option<Json>, ScanError> {
        self.next += 1;
        let id = format!("sesame_scan_{}", self.next);
        let arguments = arguments.iter().map(|(name, text)| ((*name).to_owned(), Json::from(*text)));
        let call = Operation::CallService {
            id: Some(id.clone()),
            service: format!("/rosapi/{service}"),
            ty: None,
            args: Some(Json::Object(arguments.collect())),
            fragment_size: None,
            compression: None,
        };
        if !self.client.say(call.text()) {
            return Err(ScanError::Lost { url: self.url.clone(), how: "it was closed".to_owned() });
        }
        let until = now() + ANSWER;
        loop {
            let left = until.saturating_duration_since(now());
            let incoming = if left.is_zero() { None } else { self.client.receive(left) };
            let Some(incoming) = incoming else { return Ok(None) };
            if let Incoming::Operation(operation, _) = &incoming {
                match &**operation {
                    Operation::ServiceResponse { id: Some(of), values, result, .. } if *of == id => {
                        return Ok(values.clone().filter(|_| *result));
                    }
                    Operation::Status { id: Some(of), level: Level::Error, .. } if *of == id => return Ok(None),
                    _ => {}
                }
            }
            self.take(incoming)?;
        }
    }

    /// Whether this is a topic that it subscribed to.
    fn listens_to(&self, topic: &str) -> bool {
        self.facts.topics.iter().take(MOST_LISTENED).any(|known| known.path == topic)
    }

    fn take(&mut self, incoming: Incoming) -> Result<(), ScanError> {
        match incoming {
            Incoming::Operation(operation, arrived) => match *operation {
                Operation::Publish { topic, mut msg, .. } if self.listens_to(&topic) => {
                    bare::as_reals(&mut msg);
                    let at = arrived.saturating_duration_since(self.begin);
                    self.payloads.add(&topic, &msg);
                    self.arrivals.entry(topic).or_default().add(at);
                }
                Operation::Status { id: Some(id), level: Level::Error, msg } => {
                    if let Some(topic) = id.strip_prefix(TOPIC)
                        && self.facts.topics.iter().any(|known| known.path == topic)
                    {
                        self.refused.insert(topic.to_owned(), msg.chars().take(300).collect());
                    }
                }
                _ => {}
            },
            Incoming::Lost(how) => return Err(ScanError::Lost { url: self.url.clone(), how }),
            Incoming::Malformed(_) | Incoming::FoundAgain(_) => {}
        }
        Ok(())
    }
}

/// What the identifiers of subscriptions begin with.
const TOPIC: &str = "sesame_scan:";

#[expect(clippy::disallowed_methods, reason = "an adapter: it waits for a bridge")]
fn now() -> Instant {
    Instant::now()
}

#[cfg(test)]
#[expect(clippy::disallowed_methods, clippy::disallowed_types, reason = "they have a server of their own")]
mod tests;
