//! A topic on which the node publishes, with its subscribers and what waits for them.

use std::collections::{BTreeSet, VecDeque};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex};

use sesame_plan::Interface;

use crate::definition::{Texts, TypeError};
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
    pub(super) by_space: bool,
    /// Its publishers that are latching: as many messages are kept for subscribers that come later.
    pub(super) latching: BTreeSet<String>,
    pub(super) latest: VecDeque<Arc<[u8]>>,
    pub(super) links: Vec<Arc<Link>>,
}

/// A subscriber.
#[derive(Debug)]
pub(super) struct Link {
    pub(super) node: String,
    pub(super) waiting: Mutex<Waiting>,
    pub(super) filled: Condvar,
    pub(super) gone: AtomicBool,
}

/// Messages for a subscriber.
#[derive(Debug, Default)]
pub(super) struct Waiting {
    pub(super) queue: VecDeque<Arc<[u8]>>,
    pub(super) bytes: usize,
}

impl Waiting {
    /// Adds a message; false if older ones had to go.
    pub(super) fn push(&mut self, message: &Arc<[u8]>) -> bool {
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

    /// The nodes that listen, each of them once: rospy may connect anew before it drops an earlier connection to the
    /// same publisher.
    pub(crate) fn connected(&self) -> BTreeSet<&str> {
        self.links.iter().filter(|link| !link.gone.load(Ordering::Relaxed)).map(|link| link.node.as_str()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_node_that_is_connected_twice_listens_once() {
        let link = |node: &str, gone| {
            let (waiting, filled) = (Mutex::default(), Condvar::new());
            Arc::new(Link { node: node.to_owned(), waiting, filled, gone: AtomicBool::new(gone) })
        };
        let mut publication = Publication::new("/peer");
        publication.links = vec![link("/near", false), link("/near", false), link("/far", true)];
        assert_eq!(publication.connected(), BTreeSet::from(["/near"]));
        publication.links.push(link("/far", false));
        assert_eq!(publication.connected(), BTreeSet::from(["/far", "/near"]));
    }

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
