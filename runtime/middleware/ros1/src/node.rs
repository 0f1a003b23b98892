//! A node of ROS 1 that takes messages without knowing their types, and publishes and serves under the types of others.
//!
//! Written on threads that block, without a runtime: one for each connection, and three that listen and watch.
//! Everything is bounded: messages that wait in either direction, connections, and what each of them may send.
//!
//! It binds one address only. That is the loopback interface, unless `ROS_HOSTNAME` or `ROS_IP` names another one.

mod host;
mod inbox;
mod listen;
mod lock;
mod publication;
mod receive;
mod send;
mod serve;
mod service;
mod shared;
mod subscription;
mod watch;

use std::net::{SocketAddr, TcpListener};
use std::sync::atomic::AtomicUsize;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use crate::connection::{Connection, Stop};
use crate::master::{Address, AskError, Master};

use self::inbox::Inbox;
pub(crate) use self::inbox::Incoming;
use self::lock::lock;
pub(crate) use self::publication::Publication;
pub(crate) use self::service::Service;
use self::shared::Shared;
pub(crate) use self::subscription::Subscription;

/// How long it takes at most to find out that nobody listens at an address.
const LOOK: Duration = Duration::from_millis(100);

/// A node. Dropping it takes it out of the graph.
pub(crate) struct Node {
    shared: Arc<Shared>,
    /// Where it listens, to be woken.
    listens: [SocketAddr; 2],
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
