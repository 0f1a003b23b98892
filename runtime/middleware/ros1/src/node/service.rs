//! A service that the node offers, and the calls that wait for their reply.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::mpsc::SyncSender;

use crate::protocol::header::Header;

/// A service that the node offers.
#[derive(Debug)]
pub(crate) struct Service {
    /// The name under which clients call it.
    pub(crate) path: String,
    /// The name under which its server is called.
    pub(crate) server: String,
    /// What the server says of itself, as soon as it is there.
    pub(crate) offer: Option<Header>,
}

impl Service {
    pub(crate) fn new(path: &str, server: &str) -> Self {
        Service { path: path.to_owned(), server: server.to_owned(), offer: None }
    }
}

/// What a client gets: the reply, or why there is none.
pub(super) type Outcome = Result<Arc<[u8]>, String>;

/// The calls that wait for their reply, by their numbers.
#[derive(Debug, Default)]
pub(super) struct Calls {
    pub(super) last: u64,
    pub(super) waiting: BTreeMap<u64, SyncSender<Outcome>>,
}
