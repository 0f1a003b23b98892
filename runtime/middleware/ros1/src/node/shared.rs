//! What all threads of a node share: what it has declared, what came in, and its end.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use super::inbox::Inbox;
use super::lock::lock;
use super::publication::Publication;
use super::service::{Calls, Service};
use super::subscription::Subscription;
use crate::connection::{LOOK, Stop};
use crate::master::{Master, State};

/// The most connections at a time, in each direction.
const MOST_CONNECTIONS: usize = 500;

/// The most characters of a note, in which may be what others sent.
const LONGEST_NOTE: usize = 600;

/// What all threads of a node know.
pub(crate) struct Shared {
    pub(crate) name: String,
    /// The host by which others reach it.
    pub(super) host: String,
    /// The port for messages and calls.
    pub(super) port: u16,
    pub(crate) master: Master,
    pub(crate) stop: Stop,
    pub(crate) inbox: Inbox,
    pub(super) subscriptions: Mutex<Vec<Subscription>>,
    pub(super) publications: Mutex<Vec<Publication>>,
    pub(super) services: Mutex<Vec<Service>>,
    pub(super) calls: Mutex<Calls>,
    pub(super) seen: Mutex<Seen>,
    pub(super) threads: Mutex<Vec<JoinHandle<()>>>,
    pub(super) connections: AtomicUsize,
}

/// What was seen last.
#[derive(Debug, Default)]
pub(super) struct Seen {
    pub(super) state: Option<State>,
    /// Since when the master does not answer.
    pub(super) silent_since: Option<Instant>,
}

impl Shared {
    /// Starts a thread that ends when the node does.
    pub(super) fn spawn(self: &Arc<Self>, work: impl FnOnce(&Arc<Shared>) + Send + 'static) {
        let shared = Arc::clone(self);
        let started = thread::Builder::new().name("ros1".to_owned()).spawn(move || work(&shared));
        let mut threads = lock(&self.threads);
        threads.retain(|thread| !thread.is_finished());
        match started {
            Ok(thread) => threads.push(thread),
            Err(error) => self.note(format!("a thread for a connection of ROS 1 cannot be started: {error}")),
        }
    }

    /// Starts a thread for a connection, if there are not too many.
    pub(super) fn spawn_connection(self: &Arc<Self>, work: impl FnOnce(&Arc<Shared>) + Send + 'static) {
        if self.connections.fetch_add(1, Ordering::Relaxed) >= MOST_CONNECTIONS {
            self.connections.fetch_sub(1, Ordering::Relaxed);
            self.note(format!(
                "more than {MOST_CONNECTIONS} connections of ROS 1 were wanted; the others were refused"
            ));
            return;
        }
        self.spawn(move |shared| {
            work(shared);
            shared.connections.fetch_sub(1, Ordering::Relaxed);
        });
    }

    /// Something for the user to know.
    pub(super) fn note(&self, mut note: String) {
        if let Some((end, _)) = note.char_indices().nth(LONGEST_NOTE) {
            note.truncate(end);
            note.push('…');
        }
        self.inbox.note(note);
    }

    /// Waits, but not beyond the end of the node.
    pub(super) fn pause(&self, time: Duration) {
        let end = Instant::now() + time;
        while !self.stop.is_set() {
            let left = end.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return;
            }
            thread::sleep(left.min(LOOK));
        }
    }

    /// Where calls of services reach it.
    pub(super) fn served_at(&self) -> String {
        format!("rosrpc://{}:{}", self.host, self.port)
    }

    /// Takes the node out of the graph. A master that is gone has forgotten it anyway.
    pub(super) fn unregister(&self) {
        let ask = |method: &str, parameters: &[&str]| self.master.ask(method, parameters).is_ok();
        let topics: Vec<String> =
            lock(&self.subscriptions).iter().map(|subscription| subscription.topic.clone()).collect();
        let offered: Vec<String> = lock(&self.publications)
            .iter()
            .filter(|publication| publication.offer.is_some())
            .map(|publication| publication.topic.clone())
            .collect();
        let served: Vec<String> = lock(&self.services)
            .iter()
            .filter(|service| service.offer.is_some())
            .map(|service| service.path.clone())
            .collect();
        let uri = self.master.uri.as_str();
        let at = self.served_at();
        // The first question without an answer is the last one.
        let _ = topics.iter().all(|topic| ask("unregisterSubscriber", &[topic, uri]))
            && offered.iter().all(|topic| ask("unregisterPublisher", &[topic, uri]))
            && served.iter().all(|service| ask("unregisterService", &[service, &at]));
    }
}
