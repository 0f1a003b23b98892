//! Peers in this process, on the DDS library that the relay uses too: as fast as peers can be, where Python's would be
//! all that is measured. Messages are bytes.

use std::io;
use std::net::Ipv4Addr;
use std::time::Duration;

use rustdds::bytes::Bytes;
use rustdds::mio1::{Events, Interest, Poll, Token, event::Source as _};
use rustdds::no_key::{DataWriter, Decode, DefaultDecoder, DeserializerAdapter, SerializerAdapter, SimpleDataReader};
use rustdds::policy::{History, Reliability};
use rustdds::{
    DomainParticipant, DomainParticipantBuilder, QosPolicies, QosPolicyBuilder, RepresentationIdentifier, Topic,
    TopicKind,
};

/// Any message, as it is.
#[derive(Debug, Clone)]
pub struct Raw(Bytes);

struct Adapter;

#[derive(Clone)]
struct Decoder;

impl DeserializerAdapter<Raw> for Adapter {
    type Error = io::Error;
    type Decoded = Raw;

    fn supported_encodings() -> &'static [RepresentationIdentifier] {
        const ONE: [RepresentationIdentifier; 1] = [RepresentationIdentifier::CDR_LE];
        &ONE
    }

    fn transform_decoded(decoded: Raw) -> Raw {
        decoded
    }
}

impl Decode<'_, Raw> for Decoder {
    type Error = io::Error;

    fn decode_bytes(self, bytes: &[u8], _: RepresentationIdentifier) -> io::Result<Raw> {
        Ok(Raw(Bytes::copy_from_slice(bytes)))
    }
}

impl DefaultDecoder<Raw> for Adapter {
    type Decoder = Decoder;
    const DECODER: Decoder = Decoder;
}

impl SerializerAdapter<Raw> for Adapter {
    type Error = io::Error;

    fn output_encoding() -> RepresentationIdentifier {
        RepresentationIdentifier::CDR_LE
    }

    fn to_bytes(raw: &Raw) -> io::Result<Bytes> {
        Ok(raw.0.clone())
    }
}

fn qos() -> QosPolicies {
    QosPolicyBuilder::new()
        .reliability(Reliability::Reliable { max_blocking_time: rustdds::Duration::from_millis(100) })
        .history(History::KeepLast { depth: 1000 })
        .build()
}

/// Joins a domain, on this machine only.
pub fn participant(domain: u16) -> DomainParticipant {
    let builder = DomainParticipantBuilder::new(domain).with_only_networks([Ipv4Addr::LOCALHOST]);
    builder.build().expect("the domain can be joined")
}

fn topic(of: &DomainParticipant, topic: &str, type_name: &str) -> Topic {
    of.create_topic(topic.to_owned(), type_name.to_owned(), &qos(), TopicKind::NoKey).expect("a topic can be had")
}

/// A reliable publisher.
#[expect(missing_debug_implementations, reason = "what it wraps has none")]
pub struct Writer(DataWriter<Raw, Adapter>);

impl Writer {
    /// On a topic of this name and type, as DDS has them.
    pub fn new(of: &DomainParticipant, name: &str, type_name: &str) -> Writer {
        let publisher = of.create_publisher(&qos()).expect("a publisher can be had");
        Writer(publisher.create_datawriter_no_key(&topic(of, name, type_name), None).expect("a writer can be had"))
    }

    /// Publishes a message; its subscribers keep up.
    pub fn write(&self, message: Raw) {
        self.0.write(message, None).expect("the subscriber keeps up");
    }
}

/// A reliable subscriber.
#[expect(missing_debug_implementations, reason = "what it wraps has none")]
pub struct Reader {
    source: SimpleDataReader<Raw, Adapter>,
    poll: Poll,
    events: Events,
}

impl Reader {
    /// A reader of a topic of this name and type, as DDS has them.
    pub fn new(of: &DomainParticipant, name: &str, type_name: &str) -> Reader {
        let subscriber = of.create_subscriber(&qos()).expect("a subscriber can be had");
        let topic = topic(of, name, type_name);
        let mut source = subscriber.create_simple_datareader_no_key(&topic, None).expect("a reader can be had");
        let poll = Poll::new().expect("events can be waited for");
        source.register(poll.registry(), Token(0), Interest::READABLE).expect("a reader has events");
        Reader { source, poll, events: Events::with_capacity(16) }
    }

    /// Waits for messages, 50 ms at most, and hands on all that have come.
    pub fn take(&mut self, mut each: impl FnMut(Raw)) {
        self.poll.poll(&mut self.events, Some(Duration::from_millis(50))).expect("events can be waited for");
        self.source.drain_read_notifications();
        while let Some(change) = self.source.try_take_one().expect("bytes can always be read") {
            each(change.sample);
        }
    }
}

/// The type of [`joints`].
pub const JOINTS: &str = "sensor_msgs::msg::dds_::JointState_";

/// The joints of an arm with seven of them. The stamp is the message's number.
pub fn joints(number: u64) -> Raw {
    let mut bytes = number.to_le_bytes().to_vec();
    let text = |bytes: &mut Vec<u8>, text: &str| {
        bytes.resize(bytes.len().next_multiple_of(4), 0);
        bytes.extend(u32::try_from(text.len() + 1).expect("it is short").to_le_bytes());
        bytes.extend(text.bytes().chain([0]));
    };
    text(&mut bytes, "base");
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    bytes.extend(7u32.to_le_bytes());
    (1..=7).for_each(|at| text(&mut bytes, &format!("joint_{at}")));
    for list in 0..3 {
        bytes.resize(bytes.len().next_multiple_of(4), 0);
        bytes.extend(7u32.to_le_bytes());
        bytes.resize(bytes.len().next_multiple_of(8), 0);
        (0..7).for_each(|at| bytes.extend((f64::from(list) + f64::from(at) / 7.0).to_le_bytes()));
    }
    Raw(bytes.into())
}

/// The number of such a message.
pub fn number(joints: &Raw) -> u64 {
    u64::from_le_bytes(joints.0[..8].try_into().expect("a message is longer"))
}
