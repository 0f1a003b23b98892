//! Services that the node offers in the place of their servers, and calls of servers.

use std::io;
use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::time::{Duration, Instant};

use super::inbox::Incoming;
use super::lock::lock;
use super::service::{Outcome, Service};
use super::shared::Shared;
use crate::connection::{Connection, LOOK};
use crate::contact::{self, ContactError};
use crate::master::AskError;
use crate::protocol::header::{self, ANY, Header};

/// The most bytes of a request or reply.
const MOST_BYTES: usize = 64 << 20;

/// How long a client may take to hear what it calls.
const HANDSHAKE: Duration = Duration::from_secs(5);

/// Why a call has no reply.
#[derive(Debug, thiserror::Error)]
pub(crate) enum CallError {
    /// The master does not know.
    #[error(transparent)]
    Ask(#[from] AskError),
    /// Nobody serves it.
    #[error("nobody serves `{0}`")]
    Nobody(String),
    /// The connection to the server was lost.
    #[error("the server of `{service}` was lost: {error}")]
    Lost {
        /// The service.
        service: String,
        /// How.
        error: io::Error,
    },
    /// The server says that it cannot do it.
    #[error("the server of `{service}` says: {why}")]
    Failed {
        /// The service.
        service: String,
        /// What it says.
        why: String,
    },
}

impl Shared {
    /// Adds a service; it is offered when its server is there.
    pub(crate) fn add_service(&self, service: Service) -> usize {
        let mut services = lock(&self.services);
        services.push(service);
        services.len() - 1
    }

    /// Offers services whose servers are there.
    pub(super) fn offer_services(&self, is_served: &dyn Fn(&str) -> bool) -> Result<(), AskError> {
        let waiting: Vec<(usize, String, String)> = lock(&self.services)
            .iter()
            .enumerate()
            .filter(|(_, service)| service.offer.is_none() && is_served(&service.server))
            .map(|(at, service)| (at, service.path.clone(), service.server.clone()))
            .collect();
        for (at, path, server) in waiting {
            // A server that has ended without a word is still known; one that comes is asked the next time.
            let Ok((theirs, _)) = self.call(&server, None, None) else { continue };
            self.master.serve(&path, &self.served_at())?;
            lock(&self.services)[at].offer = Some(theirs);
        }
        Ok(())
    }

    /// Registers all services again, at a master that has forgotten them.
    pub(super) fn serve_again(&self) -> Result<(), AskError> {
        let all: Vec<String> = lock(&self.services)
            .iter()
            .filter(|service| service.offer.is_some())
            .map(|service| service.path.clone())
            .collect();
        all.iter().try_for_each(|path| self.master.serve(path, &self.served_at()))
    }

    /// Gives a client the reply to its call; nobody waits for a second one.
    pub(crate) fn reply(&self, call: u64, outcome: Outcome) {
        let waiting = lock(&self.calls).waiting.remove(&call);
        if let Some(client) = waiting {
            // A client that has gone needs no reply.
            let _ = client.try_send(outcome);
        }
    }

    /// Calls the server of a service; its reply comes in with the number of the call. Without a number nobody wants it.
    pub(crate) fn pass_call(self: &Arc<Self>, service: usize, call: Option<u64>, request: Arc<[u8]>) {
        let server = lock(&self.services)[service].server.clone();
        self.spawn_connection(move |shared| {
            let replied = shared.call(&server, Some(&request), None);
            let Some(call) = call else { return };
            match replied {
                Ok((_, bytes)) => {
                    let arrived = Instant::now();
                    shared.inbox.push(Incoming::Reply { service, call, bytes, arrived });
                }
                Err(error) => {
                    shared.note(error.to_string());
                    shared.reply(call, Err(error.to_string()));
                }
            }
        });
    }

    /// Calls a service: what its server says of itself, and its reply. Without a request it is only asked who it is.
    pub(crate) fn call(
        &self,
        service: &str,
        request: Option<&[u8]>,
        within: Option<Duration>,
    ) -> Result<(Header, Arc<[u8]>), CallError> {
        let lost = |error: io::Error| CallError::Lost { service: service.to_owned(), error };
        let at = self.master.server(service)?.ok_or_else(|| CallError::Nobody(service.to_owned()))?;
        let failed = |why: String| CallError::Failed { service: service.to_owned(), why };
        let met = contact::serve(&at, [&self.name, service], request.is_none(), &self.stop);
        let (mut connection, theirs) = met.map_err(|error| match error {
            ContactError::Unreachable(error) => lost(error),
            ContactError::Broken(problem) => failed(format!("its header is broken: {problem}")),
        })?;
        if !theirs.get("error").is_empty() {
            return Err(failed(theirs.get("error").to_owned()));
        }
        let Some(request) = request else { return Ok((theirs, Arc::from([]))) };
        let deadline = within.map(|within| Instant::now() + within);
        connection.write_frame(request, deadline).map_err(lost)?;
        let mut ok = [0];
        connection.read_exact(&mut ok, deadline).map_err(lost)?;
        let reply = connection.read_frame(MOST_BYTES, deadline).map_err(lost)?;
        if ok == [0] { Err(failed(String::from_utf8_lossy(&reply).into_owned())) } else { Ok((theirs, reply.into())) }
    }

    /// Serves a client until it goes; the header is the one that it sent.
    pub(super) fn serve_client(&self, mut connection: Connection, header: &Header) {
        let (path, md5) = (header.get("service"), header.get("md5sum"));
        let known = {
            let services = lock(&self.services);
            let at = services.iter().position(|service| service.path == path);
            at.and_then(|at| Some((at, services[at].offer.clone()?)))
        };
        let deadline = Some(Instant::now() + HANDSHAKE);
        let refuse = |connection: &mut Connection, why: &str| {
            // A client that has gone cannot be told.
            let _ = connection.write_all(&Header::refusal(why).write(), deadline);
        };
        let Some((service, theirs)) = known else {
            return refuse(&mut connection, &format!("`{path}` is not served here"));
        };
        let real = theirs.get("md5sum");
        if md5 != ANY && real != ANY && !real.is_empty() && md5 != real {
            return refuse(&mut connection, &format!("`{path}` has MD5 {real}, not {md5}"));
        }
        let copied = ["md5sum", "request_type", "response_type", "type"].map(|name| (name, theirs.get(name)));
        let answer: Vec<(&str, &str)> = copied
            .into_iter()
            .filter(|(_, value)| !value.is_empty())
            .chain([("callerid", self.name.as_str())])
            .collect();
        if connection.write_all(&Header::new(&answer).write(), deadline).is_err() || header.is("probe") {
            return;
        }
        while let Ok(request) = connection.read_frame(MOST_BYTES, None) {
            let Some(outcome) = self.await_reply(service, request, &connection) else { return };
            let (ok, bytes) = match &outcome {
                Ok(reply) => (1, &reply[..]),
                Err(why) => (0, why.as_bytes()),
            };
            let reply = [&[ok][..], &header::length(bytes.len()), bytes].concat();
            if connection.write_all(&reply, None).is_err() || !header.is("persistent") {
                return;
            }
        }
    }

    /// Passes a call in, and waits for its reply; `None` if the client goes before.
    fn await_reply(&self, service: usize, request: Vec<u8>, connection: &Connection) -> Option<Outcome> {
        let (sender, receiver) = sync_channel(1);
        let call = {
            let mut calls = lock(&self.calls);
            calls.last += 1;
            let call = calls.last;
            calls.waiting.insert(call, sender);
            call
        };
        let mut outcome = None;
        if self.inbox.push(Incoming::Call { service, call, bytes: request.into(), arrived: Instant::now() }) {
            outcome = loop {
                match receiver.recv_timeout(LOOK) {
                    Ok(outcome) => break Some(outcome),
                    Err(RecvTimeoutError::Timeout) if !self.stop.is_set() && !connection.is_closed() => {}
                    Err(_) => break None,
                }
            };
        }
        lock(&self.calls).waiting.remove(&call);
        outcome
    }
}
