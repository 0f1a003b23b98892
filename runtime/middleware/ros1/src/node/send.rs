//! Topics on which the node publishes, under the types of the publishers whose messages it passes on.
//!
//! Before such a publisher is there, nobody knows the topic: its type is not known. So it is without the runner, too.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex};

use super::lock::lock;
use super::publication::{Link, Offer, Publication};
use super::shared::Shared;
use crate::connection::{Connection, LOOK};
use crate::master::AskError;
use crate::protocol::header::Header;

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
            .filter_map(|publication| Some((publication.topic.clone(), publication.offer.as_ref()?.ty.clone())))
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
        let found = publications.iter_mut().find(|publication| publication.topic == topic);
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
