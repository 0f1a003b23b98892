//! Listening to a domain.

use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, Instant};

use rustdds::QosPolicies;
use rustdds::policy::{Durability, History, Reliability};
use sesame_plan::Interface;
use sesame_scan::{Arrivals, Facts, System};

use super::assemble::{Seen, assemble, type_hash};
use super::{MOST_ENDPOINTS, ask};
use crate::dds::{DdsError, Endpoint, Participant, ReaderId};
use crate::graph::{DISCOVERY_TOPIC, DISCOVERY_TYPE, NodeInfo, Nodes};
use crate::names::{self, Kind};

/// How often it is looked who is there.
const LOOK: Duration = Duration::from_millis(100);

/// The most topics whose messages are counted.
const MOST_COUNTED: usize = 1000;

/// The most participants whose nodes are kept.
const MOST_PARTICIPANTS: usize = 1000;

/// Why nothing can be heard.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct ScanError(String);

impl From<DdsError> for ScanError {
    fn from(error: DdsError) -> Self {
        ScanError(error.0)
    }
}

/// Listens to a domain.
pub struct Scanner {
    domain: u16,
    listened: Duration,
    pub(super) dds: Participant,
    info: NodeInfo,
    info_reader: ReaderId,
    nodes: Nodes,
    participants: BTreeSet<crate::graph::Gid>,
    /// The topics whose messages are counted, by their names and types in DDS.
    counted: BTreeMap<(String, String), ReaderId>,
    heard: BTreeMap<ReaderId, Arrivals>,
}

impl Scanner {
    /// Joins a domain: of this machine only, unless `network` says otherwise.
    pub fn join(domain: u16, network: bool) -> Result<Self, ScanError> {
        let mut dds = Participant::join(domain, network)?;
        let info_reader = dds.read(DISCOVERY_TOPIC, DISCOVERY_TYPE, &kept_qos())?;
        Ok(Scanner {
            domain,
            listened: Duration::ZERO,
            dds,
            info: NodeInfo::new(),
            info_reader,
            nodes: Nodes::default(),
            participants: BTreeSet::new(),
            counted: BTreeMap::new(),
            heard: BTreeMap::new(),
        })
    }

    /// Listens for so long. Messages are counted and thrown away.
    pub fn listen(&mut self, time: Duration) -> Result<(), ScanError> {
        let (start, mut looked) = (now(), None::<Instant>);
        let (mut received, mut unreadable) = (Vec::new(), Vec::new());
        loop {
            let at = now();
            let Some(left) = time.checked_sub(at - start).filter(|left| !left.is_zero()) else { break };
            if looked.is_none_or(|looked| at - looked >= LOOK) {
                looked = Some(at);
                self.count_new_topics()?;
            }
            let waited = self.dds.wait(Some(left.min(LOOK)));
            waited.map_err(|error| ScanError(format!("cannot listen to domain {}: {error}", self.domain)))?;
            while self.dds.event().is_some() {}
            self.dds.take(&mut received, &mut unreadable);
            unreadable.clear();
            let arrived = now();
            for received in received.drain(..) {
                if received.reader != self.info_reader {
                    self.heard.entry(received.reader).or_default().add(self.listened + (arrived - start));
                } else if let Some((participant, nodes)) = self.info.read(received.sample.0)
                    && (self.participants.len() < MOST_PARTICIPANTS || self.participants.contains(&participant))
                {
                    self.participants.insert(participant);
                    self.nodes.learn(participant, nodes);
                }
            }
        }
        self.listened += time;
        Ok(())
    }

    /// Subscribes to topics that have appeared.
    fn count_new_topics(&mut self) -> Result<(), DdsError> {
        let publishers = self.dds.publishers();
        for publisher in &publishers {
            let is_topic = matches!(names::in_ros(&publisher.topic), Some((Kind::Topic, _)));
            let key = (publisher.topic.clone(), publisher.type_name.clone());
            if !is_topic || self.counted.len() >= MOST_COUNTED || self.counted.contains_key(&key) {
                continue;
            }
            // A participant knows each topic with one type.
            if self.counted.keys().any(|(topic, _)| *topic == key.0) {
                continue;
            }
            let all_keep = publishers.iter().filter(|other| other.topic == key.0).all(|other| keeps(&other.qos));
            let reader = self.dds.read(&key.0, &key.1, &if all_keep { kept_qos() } else { counting_qos() })?;
            self.counted.insert(key, reader);
        }
        Ok(())
    }

    /// What is there by now.
    pub fn facts(&self) -> Facts {
        let (publishers, subscribers) = (self.dds.publishers(), self.dds.subscribers());
        let all = publishers.len() + subscribers.len();
        let mut nodes = BTreeMap::new();
        for node in self.nodes.iter() {
            for gid in node.writers.iter().chain(&node.readers) {
                nodes.insert(*gid, node.name.clone());
            }
        }
        let seen = |publishes: bool, endpoint: Endpoint| Seen {
            publishes,
            node: nodes.get(&endpoint.guid.to_bytes()).cloned(),
            reliable: matches!(endpoint.qos.reliability(), Some(Reliability::Reliable { .. })),
            transient_local: !matches!(endpoint.qos.durability(), None | Some(Durability::Volatile)),
            hash: type_hash(&endpoint.user_data),
            topic: endpoint.topic,
            type_name: endpoint.type_name,
        };
        let publishers = publishers.into_iter().map(|endpoint| seen(true, endpoint));
        let seen = publishers.chain(subscribers.into_iter().map(|endpoint| seen(false, endpoint)));
        let mut seen: Vec<Seen> = seen.collect();
        seen.sort_by(|a, b| (&a.topic, &a.type_name, &a.node).cmp(&(&b.topic, &b.type_name, &b.node)));
        seen.truncate(MOST_ENDPOINTS);
        let heard = self.counted.iter().filter_map(|(key, reader)| Some((key.clone(), *self.heard.get(reader)?)));
        let names = self.nodes.iter().map(|node| node.name.clone());
        let system = System::Ros2 { domain: self.domain };
        let facts = assemble(system, &seen, names.take(MOST_ENDPOINTS), &heard.collect());
        Facts { seconds: self.listened.as_secs_f64(), cut: all > MOST_ENDPOINTS, ..facts }
    }

    /// The layouts of types, from nodes that have topics of them: each with those that it contains, the type itself
    /// first. Types that no node describes in this time are missing.
    pub fn describe(
        &mut self,
        facts: &Facts,
        types: &[String],
        within: Duration,
    ) -> Result<BTreeMap<String, Vec<Interface>>, ScanError> {
        Ok(ask::describe(&mut self.dds, facts, types, within)?)
    }
}

/// Whether a publisher keeps messages for those who subscribe later, and sends them again until they have come.
fn keeps(qos: &QosPolicies) -> bool {
    matches!(qos.reliability(), Some(Reliability::Reliable { .. }))
        && !matches!(qos.durability(), None | Some(Durability::Volatile))
}

/// What is asked for of those who keep what they have said, such as which nodes they have, or `/tf_static`.
fn kept_qos() -> QosPolicies {
    rustdds::QosPolicyBuilder::new()
        .reliability(Reliability::Reliable { max_blocking_time: rustdds::Duration::ZERO })
        .durability(Durability::TransientLocal)
        .history(History::KeepLast { depth: 1000 })
        .build()
}

/// As little as possible, so that every publisher offers it and none waits for this subscriber.
fn counting_qos() -> QosPolicies {
    rustdds::QosPolicyBuilder::new()
        .reliability(Reliability::BestEffort)
        .durability(Durability::Volatile)
        .history(History::KeepLast { depth: 1000 })
        .build()
}

#[expect(clippy::disallowed_methods, reason = "an adapter: it waits for other processes")]
pub(super) fn now() -> Instant {
    Instant::now()
}
