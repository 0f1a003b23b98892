//! Topics on which the node publishes, under the types of the publishers whose messages it passes on.
//!
//! Before such a publisher is there, nobody knows the topic: its type is not known. So it is without the runner, too.

use std::collections::{BTreeSet, VecDeque};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex};

use sesame_plan::Interface;

use super::{Shared, lock};
use crate::connection::{Connection, LOOK};
use crate::definition::{Texts, TypeError};
use crate::master::AskError;
use crate::protocol::header::Header;

/// The most messages that wait for a subscriber; beyond them the oldest are dropped.
const MOST: usize = 10_000;

/// The most bytes of messages that wait for a subscriber.
const MOST_BYTES: usize = 256 << 20;

/// What the publishers of a topic say of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Offer {
    pub(super) ty: String,
    pub(super) md5: String,
    pub(super) definition: String,
    pub(super) latching: bool,
}

impl Offer {
    pub(super) fn of(header: &Header) -> Self {
        let get = |name: &str| header.get(name).to_owned();
        let latching = header.is("latching");
        Offer { ty: get("type"), md5: get("md5sum"), definition: get("message_definition"), latching }
    }
}

/// A topic on which the node publishes.
#[derive(Debug)]
pub(crate) struct Publication {
    pub(crate) topic: String,
    /// Its type, as soon as it is known.
    pub(super) offer: Option<Offer>,
    /// Whether its type is what the space says, because nobody else publishes on it. The space knows no constants, so
    /// the MD5 of a subscriber that has a type of the same name is as good.
    by_space: bool,
    /// Those of its publishers that are latching: as many messages are kept for subscribers that come later.
    latching: BTreeSet<String>,
    latest: VecDeque<Arc<[u8]>>,
    links: Vec<Arc<Link>>,
}

/// A subscriber.
#[derive(Debug)]
struct Link {
    node: String,
    waiting: Mutex<Waiting>,
    filled: Condvar,
    gone: AtomicBool,
}

/// Messages for a subscriber.
#[derive(Debug, Default)]
struct Waiting {
    queue: VecDeque<Arc<[u8]>>,
    bytes: usize,
}

impl Waiting {
    /// Adds a message; false if older ones had to go.
    fn push(&mut self, message: &Arc<[u8]>) -> bool {
        self.bytes += message.len();
        self.queue.push_back(Arc::clone(message));
        let mut fits = true;
        while self.queue.len() > MOST || (self.bytes > MOST_BYTES && self.queue.len() > 1) {
            self.bytes -= self.queue.pop_front().map_or(0, |oldest| oldest.len());
            fits = false;
        }
        fits
    }
}

impl Publication {
    pub(crate) fn new(topic: &str) -> Self {
        let (latest, links) = (VecDeque::new(), Vec::new());
        Publication { topic: topic.to_owned(), offer: None, by_space: false, latching: BTreeSet::new(), latest, links }
    }

    /// A topic on which nobody else publishes, with the layouts of the space.
    pub(crate) fn of_space(topic: &str, interfaces: &[Interface], ty: &str) -> Result<Self, TypeError> {
        let texts = Texts::of_layout(interfaces);
        let (md5, definition) = (texts.md5(ty)?, texts.definition(ty)?);
        let offer = Offer { ty: ty.to_owned(), md5, definition, latching: false };
        Ok(Publication { offer: Some(offer), by_space: true, ..Publication::new(topic) })
    }

    /// The nodes that listen.
    pub(crate) fn connected(&self) -> impl Iterator<Item = &str> {
        self.links.iter().filter(|link| !link.gone.load(Ordering::Relaxed)).map(|link| link.node.as_str())
    }
}

impl Shared {
    /// Adds a publication; it is offered when its type is known.
    pub(crate) fn add_publication(&self, publication: Publication) -> Result<usize, AskError> {
        let known = publication.offer.as_ref().map(|offer| (publication.topic.clone(), offer.ty.clone()));
        let at = {
            let mut publications = lock(&self.publications);
            publications.push(publication);
            publications.len() - 1
        };
        if let Some((topic, ty)) = known {
            self.master.publish(&topic, &ty)?;
        }
        Ok(at)
    }

    /// Offers a publication with what one of its publishers says of it; an error if another one said something else.
    pub(super) fn offer(&self, at: usize, publisher: &str, offer: &Offer) -> Result<(), String> {
        let topic = {
            let mut publications = lock(&self.publications);
            let publication = &mut publications[at];
            let is_new = publication.offer.is_none();
            match &mut publication.offer {
                Some(known) if known.md5 != offer.md5 => {
                    return Err(format!(
                        "its `{}` is not that of others that publish on `{}`: the MD5 is {} and not {}",
                        offer.ty, publication.topic, offer.md5, known.md5
                    ));
                }
                Some(known) => known.latching |= offer.latching,
                none => *none = Some(offer.clone()),
            }
            if offer.latching {
                publication.latching.insert(publisher.to_owned());
            }
            if !is_new {
                return Ok(());
            }
            publication.topic.clone()
        };
        // A master that does not answer now hears of it when it is back.
        let _ = self.master.publish(&topic, &offer.ty);
        Ok(())
    }

    /// Registers all publications again, at a master that has forgotten them.
    pub(super) fn offer_again(&self) -> Result<(), AskError> {
        let all: Vec<(String, String)> = lock(&self.publications)
            .iter()
            .filter_map(|it| Some((it.topic.clone(), it.offer.as_ref()?.ty.clone())))
            .collect();
        all.iter().try_for_each(|(topic, ty)| self.master.publish(topic, ty))
    }

    /// Publishes a message.
    pub(crate) fn publish(&self, at: usize, message: &Arc<[u8]>) {
        let mut publications = lock(&self.publications);
        let publication = &mut publications[at];
        if !publication.latching.is_empty() {
            publication.latest.push_back(Arc::clone(message));
            while publication.latest.len() > publication.latching.len() {
                publication.latest.pop_front();
            }
        }
        publication.links.retain(|link| !link.gone.load(Ordering::Relaxed));
        for link in &publication.links {
            if !lock(&link.waiting).push(message) {
                let (node, topic) = (&link.node, &publication.topic);
                self.note(format!("`{node}` reads too slowly from `{topic}`: messages were dropped"));
            }
            link.filled.notify_one();
        }
    }

    /// Serves a subscriber until it goes; the header is the one that it sent.
    pub(super) fn serve_subscriber(&self, mut connection: Connection, header: &Header) {
        let node = header.get("callerid").to_owned();
        let link =
            Arc::new(Link { node, waiting: Mutex::default(), filled: Condvar::new(), gone: AtomicBool::new(false) });
        let answer = self.link(&link, header);
        let is_refused = answer.is_err();
        let answer = answer.unwrap_or_else(|refusal| Header::refusal(&refusal));
        if connection.write_all(&answer.write(), None).is_ok() && !is_refused {
            self.send_all(&link, connection);
        }
        link.gone.store(true, Ordering::Relaxed);
    }

    /// Adds a subscriber. Everything that is published from now on, and what was kept for it, is for it.
    fn link(&self, link: &Arc<Link>, header: &Header) -> Result<Header, String> {
        let (topic, md5) = (header.get("topic"), header.get("md5sum"));
        let mut publications = lock(&self.publications);
        let found = publications.iter_mut().find(|it| it.topic == topic);
        let known = found.and_then(|publication| Some((publication.offer.clone()?, publication)));
        let Some((mut offer, publication)) = known else { return Err(format!("`{topic}` is not published here")) };
        if publication.by_space && header.get("type") == offer.ty && md5 != "*" {
            md5.clone_into(&mut offer.md5);
        }
        if md5 != "*" && offer.md5 != "*" && md5 != offer.md5 {
            let (node, theirs, ours) = (&link.node, header.get("type"), &offer.ty);
            self.note(format!(
                "`{node}` hears nothing on `{topic}`: it wants `{theirs}` ({md5}), not `{ours}` ({})",
                offer.md5
            ));
            return Err(format!("`{topic}` is of type `{ours}` with MD5 {}, not `{theirs}` with {md5}", offer.md5));
        }
        let mut waiting = lock(&link.waiting);
        for message in &publication.latest {
            waiting.push(message);
        }
        publication.links.retain(|link| !link.gone.load(Ordering::Relaxed));
        publication.links.push(Arc::clone(link));
        Ok(Header::new(&[
            ("callerid", self.name.as_str()),
            ("latching", if offer.latching { "1" } else { "0" }),
            ("md5sum", &offer.md5),
            ("message_definition", &offer.definition),
            ("topic", topic),
            ("type", &offer.ty),
        ]))
    }

    fn send_all(&self, link: &Link, mut connection: Connection) {
        while !self.stop.is_set() {
            let waiting = lock(&link.waiting);
            let waited = link.filled.wait_timeout_while(waiting, LOOK, |waiting| waiting.queue.is_empty());
            let (mut waiting, _) = waited.unwrap_or_else(std::sync::PoisonError::into_inner);
            let next = waiting.queue.pop_front();
            waiting.bytes -= next.as_ref().map_or(0, |next| next.len());
            drop(waiting);
            let sent = match next {
                Some(message) => connection.write_frame(&message, None).is_ok(),
                None => !connection.is_closed(),
            };
            if !sent {
                return;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slow_subscriber_loses_the_oldest_messages_only() {
        let mut waiting = Waiting::default();
        let message = |at: usize| -> Arc<[u8]> { at.to_le_bytes().into() };
        assert!((0..MOST).all(|at| waiting.push(&message(at))));
        assert!(!waiting.push(&message(MOST)));
        assert_eq!((waiting.queue.len(), waiting.bytes), (MOST, 8 * MOST));
        assert_eq!(waiting.queue.front(), Some(&message(1)));
        let large: Arc<[u8]> = vec![0; MOST_BYTES].into();
        assert!(!waiting.push(&large));
        assert_eq!((waiting.queue.len(), waiting.bytes), (1, MOST_BYTES), "the last one is never dropped");
    }
}
