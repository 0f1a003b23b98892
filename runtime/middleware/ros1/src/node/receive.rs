//! Topics to which the node subscribes.

use std::sync::Arc;
use std::time::{Duration, Instant};

use sesame_codec::error::LARGEST;
use sesame_codec::ros1::Codec;

use super::inbox::Incoming;
use super::lock::lock;
use super::publication::Offer;
use super::shared::Shared;
use super::subscription::{Publisher, Subscription};
use crate::connection::Connection;
use crate::contact::{self, ContactError};
use crate::definition::Texts;
use crate::master::{Address, AskError};
use crate::protocol::header::{ANY, Header};

/// How long it is waited until a publisher that cannot be reached is tried again: at first, and at most.
const PAUSES: [Duration; 2] = [Duration::from_millis(50), Duration::from_secs(1)];

/// The most publishers of a topic.
const MOST_PUBLISHERS: usize = 200;

/// The most bytes of a message.
const MOST_BYTES: usize = LARGEST;

impl Shared {
    /// Subscribes. What arrives comes with the position that is returned.
    pub(crate) fn subscribe(self: &Arc<Self>, subscription: Subscription) -> Result<usize, AskError> {
        let (topic, ty) = (subscription.topic.clone(), subscription.ty.clone());
        let at = {
            let mut subscriptions = lock(&self.subscriptions);
            subscriptions.push(subscription);
            subscriptions.len() - 1
        };
        let publishers = self.master.subscribe(&topic, &ty)?;
        self.add_publishers(at, &publishers);
        Ok(at)
    }

    /// Registers all subscriptions again, at a master that has forgotten them. Connections stay.
    pub(super) fn subscribe_again(self: &Arc<Self>) -> Result<(), AskError> {
        let all: Vec<(String, String)> = lock(&self.subscriptions)
            .iter()
            .map(|subscription| (subscription.topic.clone(), subscription.ty.clone()))
            .collect();
        for (at, (topic, ty)) in all.into_iter().enumerate() {
            let publishers = self.master.subscribe(&topic, &ty)?;
            self.add_publishers(at, &publishers);
        }
        Ok(())
    }

    /// What the master says of the publishers of a topic.
    pub(super) fn update_publishers(self: &Arc<Self>, topic: &str, uris: &[String]) {
        let all: Vec<usize> = {
            let mut subscriptions = lock(&self.subscriptions);
            let of_topic = subscriptions.iter_mut().enumerate().filter(|(_, subscription)| subscription.topic == topic);
            of_topic
                .map(|(at, subscription)| {
                    for (uri, publisher) in &mut subscription.publishers {
                        publisher.listed = uris.contains(uri);
                    }
                    at
                })
                .collect()
        };
        for at in all {
            self.add_publishers(at, uris);
        }
    }

    fn add_publishers(self: &Arc<Self>, subscription: usize, uris: &[String]) {
        for uri in uris {
            {
                let mut subscriptions = lock(&self.subscriptions);
                let publishers = &mut subscriptions[subscription].publishers;
                if let Some(known) = publishers.get_mut(uri) {
                    known.listed = true;
                    continue;
                }
                if publishers.len() >= MOST_PUBLISHERS || *uri == self.master.uri {
                    continue;
                }
                publishers.insert(uri.clone(), Publisher { listed: true, node: None });
            }
            let uri = uri.clone();
            self.spawn_connection(move |shared| shared.listen_to(subscription, &uri));
        }
    }

    /// Listens to a publisher, again and again for as long as the master names it.
    fn listen_to(self: &Arc<Self>, at: usize, uri: &str) {
        let mut pause = PAUSES[0];
        while !self.stop.is_set() {
            match self.meet_publisher(at, uri) {
                Ok(connection) => {
                    self.take_messages(at, uri, connection);
                    pause = PAUSES[0];
                }
                Err(Problem::Told(problem)) => self.note(problem),
                // It has gone, or is not yet ready: it is tried again.
                Err(Problem::Unreachable) => {}
            }
            let mut subscriptions = lock(&self.subscriptions);
            let publishers = &mut subscriptions[at].publishers;
            if publishers.get(uri).is_none_or(|publisher| !publisher.listed) {
                publishers.remove(uri);
                return;
            }
            drop(subscriptions);
            self.pause(pause);
            pause = (pause * 2).min(PAUSES[1]);
        }
    }

    /// Connects to a publisher, and takes over its type.
    fn meet_publisher(self: &Arc<Self>, at: usize, uri: &str) -> Result<Connection, Problem> {
        let (topic, ty, codec, feeds) = {
            let subscriptions = lock(&self.subscriptions);
            let subscription = &subscriptions[at];
            (
                subscription.topic.clone(),
                subscription.ty.clone(),
                subscription.codec.clone(),
                subscription.feeds.clone(),
            )
        };
        let asked = Address::read(uri).ok_or(Problem::Unreachable)?;
        let met = contact::subscribe(&asked, [&self.name, &topic, &ty], &self.stop);
        let (connection, theirs) = met.map_err(|error| match error {
            ContactError::Unreachable(_) => Problem::Unreachable,
            ContactError::Broken(problem) => {
                Problem::Told(format!("the header of a publisher of `{topic}` is broken: {problem}"))
            }
        })?;
        let node = node_of(&theirs);
        if let Some(problem) = wrong(&theirs, &topic, &ty, codec.as_deref()) {
            return Err(Problem::Told(format!("`{node}` is not listened to: {problem}")));
        }
        let offer = Offer::of(&theirs);
        for feed in feeds {
            self.offer(feed, &node, &offer)
                .map_err(|problem| Problem::Told(format!("`{node}` is not listened to: {problem}")))?;
        }
        let mut subscriptions = lock(&self.subscriptions);
        let subscription = &mut subscriptions[at];
        if subscription.lost {
            self.note(format!("`{node}` publishes on `{topic}` again"));
        }
        if let Some(publisher) = subscription.publishers.get_mut(uri) {
            publisher.node = Some(node);
        }
        Ok(connection)
    }

    /// Takes the messages of a publisher until its connection ends.
    fn take_messages(&self, at: usize, uri: &str, mut connection: Connection) {
        let problem = loop {
            match connection.read_frame(MOST_BYTES, None) {
                Ok(bytes) => {
                    let (bytes, arrived) = (bytes.into(), Instant::now());
                    if !self.inbox.push(Incoming::Message { subscription: at, bytes, arrived }) {
                        return;
                    }
                }
                Err(error) => break error,
            }
        };
        if self.stop.is_set() {
            return;
        }
        let mut subscriptions = lock(&self.subscriptions);
        let subscription = &mut subscriptions[at];
        subscription.lost = true;
        let node = subscription.publishers.get_mut(uri).and_then(|publisher| publisher.node.take()).unwrap_or_default();
        self.note(format!("`{node}` no longer publishes on `{}`: {problem}", subscription.topic));
    }
}

/// Why a publisher is not listened to.
enum Problem {
    /// It does not answer.
    Unreachable,
    /// It is not what was declared, in a sentence.
    Told(String),
}

fn node_of(header: &Header) -> String {
    let node = header.get("callerid");
    if node.is_empty() { "a publisher without a name".to_owned() } else { node.to_owned() }
}

/// What is wrong with a publisher.
fn wrong(header: &Header, topic: &str, ty: &str, codec: Option<&Codec>) -> Option<String> {
    let (error, found) = (header.get("error"), header.get("type"));
    if !error.is_empty() {
        return Some(format!("it refuses: {error}"));
    }
    if found.is_empty() || header.get("md5sum").is_empty() {
        return Some(format!("it does not say what it publishes on `{topic}`"));
    }
    if found != ty && found != ANY && ty != ANY {
        return Some(format!("it publishes `{found}` on `{topic}`; expected `{ty}`"));
    }
    // A definition that does not have the MD5 that goes with it says nothing.
    let texts = Texts::of_definition(found, header.get("message_definition")).ok()?;
    if texts.md5(found).ok()? != header.get("md5sum") {
        return None;
    }
    let difference = codec?.difference(&texts.layout(found).ok()?, found)?;
    Some(format!("`{found}` has another layout than the space says: {difference}"))
}

#[cfg(test)]
mod tests {
    use sesame_plan::{Interface, InterfaceField, Primitive, WireType};
    use sesame_relay::wire::Wanted;

    use super::*;

    const DEFINITION: &str = "Header header\nfloat64[] values\n================================================================================\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n";

    /// What a publisher says, with the MD5 of this definition.
    fn header(definition: &str) -> Header {
        let md5 = Texts::of_definition("p/M", DEFINITION).unwrap().md5("p/M").unwrap();
        Header::new(&[("type", "p/M"), ("md5sum", &md5), ("message_definition", definition)])
    }

    /// The layout of a space, as ROS 2 has it, with a field of this name and primitive.
    fn codec(values: &str, primitive: Primitive) -> Codec {
        let number = |primitive| WireType::Primitive { primitive };
        let field = |name: &str, ty| InterfaceField { name: name.to_owned(), ty };
        let nested = |name: &str| WireType::Interface { name: name.to_owned() };
        let interface = |name: &str, fields| Interface { name: name.to_owned(), fields };
        let time = vec![field("sec", number(Primitive::Int32)), field("nanosec", number(Primitive::Uint32))];
        let stamped = vec![field("stamp", nested("builtin_interfaces/msg/Time")), field("frame_id", WireType::STRING)];
        let many = WireType::Sequence { of: Box::new(number(primitive)), bound: None };
        let all = [
            interface("builtin_interfaces/msg/Time", time),
            interface("std_msgs/msg/Header", stamped),
            interface("p/msg/M", vec![field("header", nested("std_msgs/msg/Header")), field(values, many)]),
        ];
        Codec::new(&all, "p/msg/M", &Wanted::All).unwrap()
    }

    #[test]
    fn a_publisher_with_another_layout_is_not_listened_to() {
        let wrong = |header: &Header, codec: &Codec| super::wrong(header, "/m", "p/M", Some(codec));
        let header = header(DEFINITION);
        assert_eq!(wrong(&header, &codec("values", Primitive::Float64)), None, "the number of the header aside");
        assert_eq!(
            wrong(&header, &codec("values", Primitive::Float32)).unwrap(),
            "`p/M` has another layout than the space says: types `message, float32[]` of `header, values`, not `message, \
             float64[]`"
        );
        assert_eq!(
            wrong(&header, &codec("value", Primitive::Float64)).unwrap(),
            "`p/M` has another layout than the space says: fields `header, value`, not `header, values`"
        );
    }

    #[test]
    fn a_definition_that_is_not_that_of_its_md5_says_nothing() {
        let codec = codec("value", Primitive::Float32);
        for definition in ["", "int8 other", "no definition"] {
            assert_eq!(wrong(&header(definition), "/m", "p/M", Some(&codec)), None, "{definition}");
        }
    }

    #[test]
    fn who_does_not_say_what_it_publishes_is_not_listened_to() {
        let wrong = |header: &Header| super::wrong(header, "/m", "p/M", None);
        assert_eq!(wrong(&Header::refusal("no")).unwrap(), "it refuses: no");
        assert_eq!(wrong(&Header::new(&[])).unwrap(), "it does not say what it publishes on `/m`");
        let other = Header::new(&[("type", "p/N"), ("md5sum", "1")]);
        assert_eq!(wrong(&other).unwrap(), "it publishes `p/N` on `/m`; expected `p/M`");
    }
}
