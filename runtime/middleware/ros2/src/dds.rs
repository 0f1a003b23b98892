//! DDS: samples as bytes, in and out, and who else is there.

mod sample;

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::net::Ipv4Addr;
use std::time::Duration;

use rustdds::mio1::{Events, Interest, Poll, Token, event::Event, event::Source as _};
use rustdds::policy::{Durability, History, Reliability};
use rustdds::rpc::SampleIdentity;
use rustdds::{
    DomainParticipant, DomainParticipantBuilder, DomainParticipantStatusEvent, DomainParticipantStatusListener, GUID,
    Publisher, QosPolicies, QosPolicyBuilder, RTPSEntity as _, StatusEvented as _, Subscriber, Topic, TopicKind,
    WriteOptionsBuilder, no_key,
};

use sesame_relay::transport::TransportError;

pub(crate) use self::sample::Sample;
use self::sample::{Adapter, with_encoding};

/// How many samples a reliable writer keeps until they are acknowledged, and a reader until they are taken.
const DEPTH: i32 = 1000;

/// How long a write waits for a reliable subscriber that is behind, before the sample is given up.
const PATIENCE: Duration = Duration::from_millis(100);

/// One participant of a domain.
pub(crate) struct Participant {
    // Dropped before the participant.
    readers: Vec<Option<no_key::SimpleDataReader<Sample, Adapter>>>,
    writers: Vec<Option<no_key::DataWriter<Sample, Adapter>>>,
    topics: BTreeMap<String, Topic>,
    publisher: Publisher,
    subscriber: Subscriber,
    listener: DomainParticipantStatusListener,
    poll: Poll,
    events: Events,
    /// The positions of readers that may have samples. Asking one costs a system call or two, so only these are asked.
    ready: BTreeSet<usize>,
    domain: DomainParticipant,
}

/// A reader of a participant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct ReaderId(usize);

/// A writer of a participant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct WriterId(usize);

/// A sample that has arrived.
#[derive(Debug)]
pub(crate) struct Received {
    pub(crate) reader: ReaderId,
    /// Who wrote it, and its number there.
    pub(crate) identity: SampleIdentity,
    /// The sample to which it belongs: for a reply, its request.
    pub(crate) related: Option<SampleIdentity>,
    pub(crate) sample: Sample,
    /// When it arrived, to put the samples of several readers into order.
    arrived: rustdds::Timestamp,
}

impl Received {
    /// How long ago it arrived.
    pub(crate) fn age(&self) -> Duration {
        let ticks = rustdds::Timestamp::now().to_ticks().saturating_sub(self.arrived.to_ticks());
        // There are 2³² of them in a second.
        Duration::from_secs(ticks >> 32) + Duration::from_nanos(((ticks & 0xFFFF_FFFF) * 1_000_000_000) >> 32)
    }
}

/// A publisher or a subscriber that somebody announces.
#[derive(Debug, Clone)]
pub(crate) struct Endpoint {
    pub(crate) guid: GUID,
    /// The name of its topic in DDS.
    pub(crate) topic: String,
    /// The name of its type in DDS.
    pub(crate) type_name: String,
    pub(crate) qos: QosPolicies,
    /// What its middleware says besides: of ROS, the hash of its type.
    pub(crate) user_data: Vec<u8>,
}

/// What cannot be done, in words for the user.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(crate) struct DdsError(pub(crate) String);

impl From<DdsError> for TransportError {
    fn from(error: DdsError) -> Self {
        TransportError::ConnectionLost { to: "the domain of ROS 2".to_owned(), how: error.0 }
    }
}

fn failed(what: &str) -> impl Fn(&dyn std::fmt::Display) -> DdsError + '_ {
    move |reason| DdsError(format!("{what}: {reason}"))
}

impl Participant {
    /// Joins a domain. It is heard on this machine only, unless `network` says otherwise.
    pub(crate) fn join(domain: u16, network: bool) -> Result<Self, DdsError> {
        let joining = format!("cannot join domain {domain}");
        let joining = failed(&joining);
        let mut builder = DomainParticipantBuilder::new(domain);
        if !network {
            builder = builder.with_only_networks([Ipv4Addr::LOCALHOST]);
        }
        let participant = builder.build().map_err(|error| joining(&error))?;
        let qos = QosPolicyBuilder::new().build();
        let publisher = participant.create_publisher(&qos).map_err(|error| joining(&error))?;
        let subscriber = participant.create_subscriber(&qos).map_err(|error| joining(&error))?;
        let poll = Poll::new().map_err(|error| joining(&error))?;
        let mut listener = participant.status_listener();
        listener
            .as_status_source_mio1()
            .register(poll.registry(), STATUS, Interest::READABLE)
            .map_err(|error| joining(&error))?;
        Ok(Participant {
            readers: Vec::new(),
            writers: Vec::new(),
            topics: BTreeMap::new(),
            publisher,
            subscriber,
            listener,
            poll,
            events: Events::with_capacity(256),
            ready: BTreeSet::new(),
            domain: participant,
        })
    }

    pub(crate) fn guid(&self) -> GUID {
        self.domain.guid()
    }

    fn topic(&mut self, name: &str, type_name: &str) -> Result<Topic, DdsError> {
        if let Some(topic) = self.topics.get(name) {
            return Ok(topic.clone());
        }
        let qos = QosPolicyBuilder::new().build();
        let created = self.domain.create_topic(name.to_owned(), type_name.to_owned(), &qos, TopicKind::NoKey);
        let topic = created.map_err(|error| failed(&format!("cannot use topic `{name}`"))(&error))?;
        self.topics.insert(name.to_owned(), topic.clone());
        Ok(topic)
    }

    /// Subscribes to a topic.
    pub(crate) fn read(&mut self, topic: &str, type_name: &str, qos: &QosPolicies) -> Result<ReaderId, DdsError> {
        let what = format!("cannot subscribe to `{topic}`");
        let what = failed(&what);
        let of = self.topic(topic, type_name)?;
        let mut reader = self
            .subscriber
            .create_simple_datareader_no_key::<Sample, Adapter>(&of, Some(qos.clone()))
            .map_err(|error| what(&error))?;
        let at = self.readers.len();
        reader.register(self.poll.registry(), Token(at), Interest::READABLE).map_err(|error| what(&error))?;
        self.readers.push(Some(reader));
        Ok(ReaderId(at))
    }

    /// Publishes on a topic.
    pub(crate) fn publish(&mut self, topic: &str, type_name: &str, qos: &QosPolicies) -> Result<WriterId, DdsError> {
        let of = self.topic(topic, type_name)?;
        let writer = self
            .publisher
            .create_datawriter_no_key::<Sample, Adapter>(&of, Some(qos.clone()))
            .map_err(|error| failed(&format!("cannot publish on `{topic}`"))(&error))?;
        self.writers.push(Some(writer));
        Ok(WriterId(self.writers.len() - 1))
    }

    pub(crate) fn writer_guid(&self, writer: WriterId) -> Option<GUID> {
        self.writers[writer.0].as_ref().map(rustdds::RTPSEntity::guid)
    }

    pub(crate) fn reader_guid(&self, reader: ReaderId) -> Option<GUID> {
        self.readers[reader.0].as_ref().map(no_key::SimpleDataReader::guid)
    }

    /// Publishes a sample. False if a subscriber is so far behind that the sample is given up.
    pub(crate) fn write(
        &self,
        writer: WriterId,
        sample: Sample,
        related: Option<SampleIdentity>,
    ) -> Result<Option<SampleIdentity>, DdsError> {
        let Some(writer) = &self.writers[writer.0] else { return Ok(None) };
        let options = WriteOptionsBuilder::new().related_sample_identity_opt(related).build();
        match with_encoding(sample.encoding(), || writer.write_with_options(sample, options)) {
            Ok(identity) => Ok(Some(identity)),
            Err(rustdds::dds::result::WriteError::WouldBlock { .. }) => Ok(None),
            Err(error) => Err(DdsError(format!("cannot publish: {error}"))),
        }
    }

    /// Sleeps until something may have happened, at most for this long; `None` is for as long as it takes.
    pub(crate) fn wait(&mut self, timeout: Option<Duration>) -> io::Result<()> {
        match self.poll.poll(&mut self.events, timeout) {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => return Ok(()),
            other => other?,
        }
        let tokens = self.events.iter().map(Event::token).filter(|&token| token != STATUS);
        self.ready.extend(tokens.map(usize::from));
        Ok(())
    }

    /// The samples that have arrived, in the order of their arrival, and what cannot be read.
    pub(crate) fn take(&mut self, received: &mut Vec<Received>, unreadable: &mut Vec<(ReaderId, String)>) {
        if self.ready.is_empty() && self.wait(Some(Duration::ZERO)).is_err() {
            // Whoever waits next is told why. Until then all are asked.
            self.ready.extend(0..self.readers.len());
        }
        let before = received.len();
        for at in std::mem::take(&mut self.ready) {
            let Some(Some(reader)) = self.readers.get(at) else { continue };
            reader.drain_read_notifications();
            loop {
                match reader.try_take_one() {
                    Ok(None) => break,
                    Ok(Some(change)) => received.push(Received {
                        reader: ReaderId(at),
                        identity: SampleIdentity {
                            writer_guid: change.writer_guid,
                            sequence_number: change.sequence_number,
                        },
                        related: change.write_options.related_sample_identity(),
                        arrived: change.receive_instant,
                        sample: change.sample,
                    }),
                    Err(error) => unreadable.push((ReaderId(at), error.to_string())),
                }
            }
        }
        received[before..].sort_by_key(|received| received.arrived);
    }

    /// What has happened to others since the last call. It may be incomplete; [`Participant::publishers`] is not.
    pub(crate) fn event(&self) -> Option<DomainParticipantStatusEvent> {
        self.listener.try_recv_status()
    }

    /// All publishers that others announce.
    pub(crate) fn publishers(&self) -> Vec<Endpoint> {
        let own = self.domain.guid().prefix;
        let writers = self.domain.discovered_writers().into_iter().map(|writer| Endpoint {
            guid: writer.publication_topic_data.key,
            topic: writer.publication_topic_data.topic_name.clone(),
            type_name: writer.publication_topic_data.type_name.clone(),
            qos: writer.publication_topic_data.qos(),
            user_data: writer.user_data,
        });
        writers.filter(|writer| writer.guid.prefix != own).collect()
    }

    /// All subscribers that others announce.
    pub(crate) fn subscribers(&self) -> Vec<Endpoint> {
        let own = self.domain.guid().prefix;
        let readers = self.domain.discovered_readers().into_iter().map(|reader| {
            let (data, user_data) = (reader.subscription_topic_data, reader.user_data);
            Endpoint {
                guid: data.key(),
                topic: data.topic_name().clone(),
                type_name: data.type_name().clone(),
                qos: data.qos(),
                user_data,
            }
        });
        readers.filter(|reader| reader.guid.prefix != own).collect()
    }
}

/// The token of what happens to others; readers have their positions.
const STATUS: Token = Token(usize::MAX);

/// What a stand-in for these publishers offers and asks for: as little as the weakest of them, so that whoever matched
/// them matches it, and nobody else does. Without publishers it is what services have: reliable, and nothing is kept.
pub(crate) fn mirrored<'a>(publishers: impl IntoIterator<Item = &'a QosPolicies>) -> QosPolicies {
    let patience = rustdds::Duration::from_std(PATIENCE);
    let mut publishers = publishers.into_iter().peekable();
    let mut reliable = true;
    let mut durable = publishers.peek().is_some();
    for qos in publishers {
        reliable &= !matches!(qos.reliability(), Some(Reliability::BestEffort));
        durable &= !matches!(qos.durability(), None | Some(Durability::Volatile));
    }
    QosPolicyBuilder::new()
        .reliability(if reliable {
            Reliability::Reliable { max_blocking_time: patience }
        } else {
            Reliability::BestEffort
        })
        .durability(if durable { Durability::TransientLocal } else { Durability::Volatile })
        .history(History::KeepLast { depth: if durable { 1 } else { DEPTH } })
        .build()
}
