//! What vehicles send to an address: who sends which messages, how often, and what is in them.
//!
//! A scan listens in the place of the ground station and sends nothing. Messages that the definitions do not have are
//! listed by their numbers.

use std::collections::{BTreeMap, BTreeSet};
use std::io::ErrorKind;
use std::net::{SocketAddr, UdpSocket};
use std::path::PathBuf;
use std::time::{Duration, Instant};

use sesame_interfaces::mavlink::Definitions;
use sesame_plan::WireType;
use sesame_relay::transport::TransportError;
use sesame_relay::value::Value;
use sesame_scan::{Arrivals, Facts, FoundField, FoundNode, FoundTopic, FoundType, System, TypeSource};

use crate::definitions;
use crate::frame::{Frame, values};
use crate::network::{LARGEST_DATAGRAM, read_url};

/// The most topics that are kept.
const MOST_TOPICS: usize = 10_000;

/// The most senders that are kept.
const MOST_PEERS: usize = 1000;

/// The most elements of a list that a sample shows, and the most letters of a text.
const MOST_SHOWN: usize = 4;
const LONGEST_TEXT: usize = 40;

/// The node in whose place a scan listens.
pub const STATION: &str = "station";

/// What is listened to.
#[derive(Debug, Clone)]
pub struct ScanOptions {
    /// The address to which the vehicles send, `udp://…`.
    pub url: String,
    /// The files that define messages.
    pub definitions: Vec<String>,
    /// The folder to which these are relative.
    pub folder: PathBuf,
    /// For how long.
    pub listening: Duration,
}

/// Why nothing can be heard.
#[derive(Debug, thiserror::Error)]
pub enum ScanError {
    /// An address or a file cannot be used.
    #[error("{0}")]
    Settings(String),
    /// Nothing can listen at the address.
    #[error(
        "nothing can listen at `{url}`: {how}; end the ground station that listens there, or let the vehicles send to \
         another address, too, and name that"
    )]
    Address {
        /// The address.
        url: String,
        /// Why not.
        how: String,
    },
}

impl From<TransportError> for ScanError {
    fn from(error: TransportError) -> Self {
        ScanError::Settings(error.to_string())
    }
}

/// Listens at an address.
pub fn scan(options: &ScanOptions) -> Result<Facts, ScanError> {
    let definitions = definitions::read(&options.definitions, &options.folder).map_err(ScanError::Settings)?;
    let own = read_url(&options.url)?;
    let wrong = |error: std::io::Error| ScanError::Address { url: options.url.clone(), how: error.to_string() };
    let socket = UdpSocket::bind(own).map_err(wrong)?;
    let begin = Instant::now();
    let mut heard = Heard::default();
    let mut buffer = vec![0; LARGEST_DATAGRAM];
    loop {
        let rest = options.listening.saturating_sub(begin.elapsed());
        if rest.is_zero() {
            break;
        }
        socket.set_read_timeout(Some(rest)).map_err(wrong)?;
        match socket.recv_from(&mut buffer) {
            Ok((length, from)) => heard.take(&definitions, &buffer[..length], from, begin.elapsed()),
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
            Err(error) => return Err(wrong(error)),
        }
    }
    // A space names an address to which a runner can send.
    let url = if own.ip().is_unspecified() { format!("udp://127.0.0.1:{}", own.port()) } else { options.url.clone() };
    let system = System::Mavlink { url, definitions: options.definitions.clone() };
    Ok(heard.facts(&definitions, system, options.listening))
}

/// Which messages of which component of which system.
type Key = (u8, u8, u32);

/// What was heard so far.
#[derive(Default)]
struct Heard {
    messages: BTreeMap<Key, Messages>,
    /// The systems of each sender.
    peers: BTreeMap<SocketAddr, BTreeSet<u8>>,
    /// Whether there was more than is kept.
    cut: bool,
}

/// The messages of one kind from one component.
#[derive(Default)]
struct Messages {
    arrivals: Arrivals,
    /// How many of them are not as defined, and why the first of them is not.
    unreadable: u64,
    why: Option<String>,
    /// What was in the first that is as defined, by its fields.
    sample: Option<Vec<Option<Value>>>,
    peers: BTreeSet<SocketAddr>,
}

impl Heard {
    /// One more datagram.
    fn take(&mut self, definitions: &Definitions, datagram: &[u8], from: SocketAddr, at: Duration) {
        let mut rest = datagram;
        while let Some(frame) = Frame::first(rest) {
            rest = &rest[frame.bytes.len()..];
            let key = (frame.system, frame.component, frame.id);
            let is_new = !self.messages.contains_key(&key) && self.messages.len() >= MOST_TOPICS;
            if is_new || (!self.peers.contains_key(&from) && self.peers.len() >= MOST_PEERS) {
                self.cut = true;
                continue;
            }
            self.peers.entry(from).or_default().insert(frame.system);
            let messages = self.messages.entry(key).or_default();
            messages.arrivals.add(at);
            messages.peers.insert(from);
            let Some(definition) = definitions.numbered(frame.id) else { continue };
            match values(&frame, definition) {
                Ok(sample) => _ = messages.sample.get_or_insert(sample),
                Err(why) => {
                    messages.unreadable += 1;
                    messages.why.get_or_insert(why);
                }
            }
        }
    }

    /// All of it.
    fn facts(self, definitions: &Definitions, system: System, listening: Duration) -> Facts {
        let mut facts = Facts { seconds: listening.as_secs_f64(), cut: self.cut, ..Facts::of(system) };
        let nodes = self.nodes();
        for (&key, messages) in &self.messages {
            let mut topic = self.topic(definitions, key, messages);
            let publishers: BTreeSet<&String> = messages.peers.iter().filter_map(|peer| nodes.get(peer)).collect();
            topic.publishers = publishers.into_iter().cloned().collect();
            let (Some(definition), Some(sample)) = (definitions.numbered(key.2), &messages.sample) else {
                facts.topics.push(topic);
                continue;
            };
            topic.ty = Some(definition.name.clone());
            topic.subscribers = vec![STATION.to_owned()];
            facts.topics.push(topic);
            if facts.types.iter().any(|ty| ty.name == definition.name) {
                continue;
            }
            let field = |(field, value): (&sesame_interfaces::mavlink::Field, &Option<Value>)| FoundField {
                optional: false,
                name: field.name.clone(),
                ty: in_words(&field.wire_type()),
                unit: field.unit.clone(),
                sample: value.as_ref().map(shown),
            };
            facts.types.push(FoundType {
                name: definition.name.clone(),
                source: TypeSource::Dialect,
                fields: definition.fields.iter().zip(sample).map(field).collect(),
                left_out: Vec::new(),
                problem: None,
            });
        }
        facts.topics.sort_by(|one, other| one.path.cmp(&other.path));
        facts.types.sort_by(|one, other| one.name.cmp(&other.name));
        facts.nodes = found_nodes(&nodes, &facts.topics);
        facts
    }

    /// The topic of some messages. Its name says the component only if another one of the system sends the same.
    fn topic(&self, definitions: &Definitions, key: Key, messages: &Messages) -> FoundTopic {
        let (system, component, id) = key;
        let name = definitions.numbered(id).map_or_else(|| format!("#{id}"), |definition| definition.name.clone());
        let several = self.messages.keys().any(|&(s, c, i)| (s, i) == (system, id) && c != component);
        let path = if several { format!("{system}/{component}/{name}") } else { format!("{system}/{name}") };
        let count = messages.arrivals.messages();
        let problem = match (&messages.sample, &messages.why) {
            (Some(_), _) => None,
            (None, Some(why)) => Some(format!("of {} of its {count} messages: {why}", messages.unreadable)),
            (None, None) => Some("the files define no message with this number".to_owned()),
        };
        FoundTopic { path, messages: count, rate: messages.arrivals.rate(), problem, ..FoundTopic::default() }
    }

    /// The node of each sender, which a proxy could stand for: senders of the same systems are one.
    fn nodes(&self) -> BTreeMap<SocketAddr, String> {
        let name = |systems: &BTreeSet<u8>| {
            let numbers: Vec<String> = systems.iter().take(MOST_SHOWN).map(u8::to_string).collect();
            let word = if systems.len() == 1 { "vehicle" } else { "vehicles" };
            let more = match systems.len().saturating_sub(MOST_SHOWN) {
                0 => String::new(),
                more => format!("_and_{more}_more"),
            };
            format!("{word}_{}{more}", numbers.join("_"))
        };
        self.peers.iter().map(|(peer, systems)| (*peer, name(systems))).collect()
    }
}

/// The nodes with their topics: the vehicles, and the ground station in whose place the scan listened.
fn found_nodes(of_peers: &BTreeMap<SocketAddr, String>, topics: &[FoundTopic]) -> Vec<FoundNode> {
    let mut counts: BTreeMap<&String, usize> = BTreeMap::new();
    for name in of_peers.values() {
        *counts.entry(name).or_default() += 1;
    }
    let paths = |of: &dyn Fn(&FoundTopic) -> bool| {
        topics.iter().filter(|topic| of(topic)).map(|topic| topic.path.clone()).collect::<Vec<_>>()
    };
    let mut nodes: Vec<FoundNode> = counts
        .iter()
        .map(|(&name, &count)| FoundNode {
            name: name.clone(),
            count,
            publishes: paths(&|topic| topic.publishers.contains(name)),
            ..FoundNode::default()
        })
        .collect();
    if !nodes.is_empty() {
        let subscribes = paths(&|topic| !topic.subscribers.is_empty());
        nodes.push(FoundNode { name: STATION.to_owned(), count: 1, subscribes, ..FoundNode::default() });
    }
    nodes
}

/// A type of a field in the words that facts have for types.
fn in_words(ty: &WireType) -> String {
    match ty {
        WireType::Primitive { primitive } => primitive.name().to_owned(),
        WireType::Array { of, length } => format!("{}[{length}]", in_words(of)),
        _ => "string".to_owned(),
    }
}

/// A value in a few words.
fn shown(value: &Value) -> String {
    match value {
        Value::Int(number) => number.to_string(),
        // A `float` has the digits of a `float`.
        #[expect(clippy::cast_possible_truncation, reason = "the digits that are shown are those of both")]
        Value::Real(number) if f64::from(*number as f32) == *number => (*number as f32).to_string(),
        Value::Real(number) => number.to_string(),
        Value::List(items) => {
            let mut words: Vec<String> = items.iter().take(MOST_SHOWN).map(shown).collect();
            if items.len() > MOST_SHOWN {
                words.push("…".to_owned());
            }
            format!("[{}]", words.join(", "))
        }
        Value::Text(text) => {
            let text: &str = text;
            let short: String = text.chars().take(LONGEST_TEXT).collect();
            let more = if short.len() < text.len() { "…" } else { "" };
            format!("\"{short}{more}\"")
        }
        _ => String::new(),
    }
}

#[cfg(test)]
mod tests;
