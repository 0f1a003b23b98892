//! A node of ROS 1 that takes messages without knowing their types, and publishes and serves under the types of others.
//!
//! Written on threads that block, without a runtime: one for each connection, and three that listen and watch.
//! Everything is bounded: messages that wait in either direction, connections, and what each of them may send.
//!
//! It binds one address only. That is the loopback interface, unless `ROS_HOSTNAME` or `ROS_IP` names another one.

mod host;
mod inbox;
mod listen;
mod receive;
mod send;
mod serve;
mod watch;

use std::net::{SocketAddr, TcpListener};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use crate::connection::{Connection, Stop};
use crate::master::{Address, AskError, Master};

use self::inbox::Inbox;
pub(crate) use self::inbox::Incoming;
pub(crate) use self::receive::Subscription;
pub(crate) use self::send::Publication;
use self::serve::Calls;
pub(crate) use self::serve::Service;
use self::watch::Seen;

/// The most connections at a time, in each direction.
const MOST_CONNECTIONS: usize = 500;

/// The most characters of a note, in which may be what others sent.
const LONGEST_NOTE: usize = 600;

/// How long it takes at most to find out that nobody listens at an address.
const LOOK: Duration = Duration::from_millis(100);

/// A node. Dropping it takes it out of the graph.
pub(crate) struct Node {
    shared: Arc<Shared>,
    /// Where it listens, to be woken.
    listens: [SocketAddr; 2],
}

/// What all threads of a node know.
pub(crate) struct Shared {
    pub(crate) name: String,
    /// The host that others are told.
    host: String,
    /// The port for messages and calls.
    port: u16,
    pub(crate) master: Master,
    pub(crate) stop: Stop,
    pub(crate) inbox: Inbox,
    subscriptions: Mutex<Vec<Subscription>>,
    publications: Mutex<Vec<Publication>>,
    services: Mutex<Vec<Service>>,
    calls: Mutex<Calls>,
    seen: Mutex<Seen>,
    threads: Mutex<Vec<JoinHandle<()>>>,
    connections: AtomicUsize,
}

/// Why a node cannot be started.
#[derive(Debug, thiserror::Error)]
pub(crate) enum StartError {
    #[error(transparent)]
    Ask(#[from] AskError),
    #[error("the runner cannot listen for nodes of ROS 1: {0}")]
    Listen(String),
}

impl Node {
    /// A node of this name at a master; `None` if there is none yet.
    pub(crate) fn start(at: &Address, name: &str) -> Result<Option<Self>, StartError> {
        let stop = Stop::default();
        if Connection::to(&at.host, at.port, LOOK, &stop).is_err() {
            return Ok(None);
        }
        let host = host::host().map_err(StartError::Listen)?;
        let bind = || {
            let bound = TcpListener::bind((host.bind, 0)).and_then(|listener| Ok((listener.local_addr()?, listener)));
            bound.map_err(|error| StartError::Listen(format!("{}: {error}", host.bind)))
        };
        let ((asked_at, asked), (met_at, met)) = (bind()?, bind()?);
        let uri = format!("http://{}:{}/", host.name, asked_at.port());
        let master = Master { at: at.clone(), caller: name.to_owned(), uri, stop: stop.clone() };
        match master.ask("getPid", &[]) {
            Err(AskError::Silent { .. }) => return Ok(None),
            answer => answer?,
        };
        let shared = Arc::new(Shared {
            name: name.to_owned(),
            host: host.name,
            port: met_at.port(),
            master,
            stop,
            inbox: Inbox::default(),
            subscriptions: Mutex::default(),
            publications: Mutex::default(),
            services: Mutex::default(),
            calls: Mutex::default(),
            seen: Mutex::default(),
            threads: Mutex::default(),
            connections: AtomicUsize::default(),
        });
        shared.spawn(move |shared| listen::answer_questions(shared, &asked));
        shared.spawn(move |shared| listen::meet(shared, &met));
        Ok(Some(Node { shared, listens: [asked_at, met_at] }))
    }

    /// Begins to look who is there, once everything is declared.
    pub(crate) fn watch(&self) {
        self.shared.spawn(watch::watch);
    }
}

impl std::ops::Deref for Node {
    type Target = Arc<Shared>;
    fn deref(&self) -> &Arc<Shared> {
        &self.shared
    }
}

impl Drop for Node {
    fn drop(&mut self) {
        self.shared.unregister();
        self.shared.stop.set();
        self.shared.inbox.close();
        let wake = |at| std::net::TcpStream::connect_timeout(at, LOOK).is_ok();
        if !self.listens.iter().all(wake) {
            // A thread that listens ends when the next one comes; nobody waits for that.
            return;
        }
        let threads = std::mem::take(&mut *lock(&self.shared.threads));
        for thread in threads {
            // One that has panicked has ended too.
            let _ = thread.join();
        }
    }
}

impl Shared {
    /// Starts a thread that ends when the node does.
    fn spawn(self: &Arc<Self>, work: impl FnOnce(&Arc<Shared>) + Send + 'static) {
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
    fn spawn_connection(self: &Arc<Self>, work: impl FnOnce(&Arc<Shared>) + Send + 'static) {
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
    fn note(&self, mut note: String) {
        if let Some((end, _)) = note.char_indices().nth(LONGEST_NOTE) {
            note.truncate(end);
            note.push('…');
        }
        self.inbox.note(note);
    }

    /// Waits, but not beyond the end of the node.
    fn pause(&self, time: Duration) {
        let end = std::time::Instant::now() + time;
        while !self.stop.is_set() {
            let left = end.saturating_duration_since(std::time::Instant::now());
            if left.is_zero() {
                return;
            }
            thread::sleep(left.min(crate::connection::LOOK));
        }
    }

    /// Where calls of services reach it.
    fn served_at(&self) -> String {
        format!("rosrpc://{}:{}", self.host, self.port)
    }

    /// Takes the node out of the graph. A master that is gone has forgotten it anyway.
    fn unregister(&self) {
        let ask = |method: &str, parameters: &[&str]| self.master.ask(method, parameters).is_ok();
        let topics: Vec<String> = lock(&self.subscriptions).iter().map(|it| it.topic.clone()).collect();
        let offered: Vec<String> =
            lock(&self.publications).iter().filter(|it| it.offer.is_some()).map(|it| it.topic.clone()).collect();
        let served: Vec<String> =
            lock(&self.services).iter().filter(|it| it.offer.is_some()).map(|it| it.path.clone()).collect();
        let uri = self.master.uri.as_str();
        let at = self.served_at();
        // The first question without an answer is the last one.
        let _ = topics.iter().all(|topic| ask("unregisterSubscriber", &[topic, uri]))
            && offered.iter().all(|topic| ask("unregisterPublisher", &[topic, uri]))
            && served.iter().all(|service| ask("unregisterService", &[service, &at]));
    }
}

/// What a thread that panicked left is used all the same: each change is complete in itself.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
