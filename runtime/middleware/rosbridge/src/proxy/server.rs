//! Where proxies listen, and who is let in.

#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "an adapter: it waits for clients and for a bridge, in a thread of its own"
)]

use std::collections::BTreeSet;
use std::io;
use std::net::{SocketAddr, TcpListener as Listener};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use sesame_plan::Renamed;
use sesame_relay::transport::TransportError;
use sesame_relay::transport::bus::secret::Token;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{Semaphore, oneshot};
use tokio_rustls::TlsAcceptor;
use tokio_rustls::rustls::ServerConfig;
use tokio_tungstenite::accept_hdr_async_with_config;
use tokio_tungstenite::tungstenite::handshake::server::{Callback, ErrorResponse, Request, Response};
use tokio_tungstenite::tungstenite::http::StatusCode;
use tokio_tungstenite::tungstenite::http::header::AUTHORIZATION;
use tokio_tungstenite::tungstenite::protocol::WebSocketConfig;

use super::names::Names;
use super::tunnel;
use crate::client::Address;
use crate::reader::Limits;

/// How many clients a proxy serves at once, with those that are being let in.
const CLIENTS: usize = 64;

/// How long a client may take until it is let in.
const LET_IN_WITHIN: Duration = Duration::from_secs(5);

/// How many notes may wait; further ones are lost.
const NOTES: usize = 100;

/// One proxy, with all that it needs read.
pub(crate) struct Proxy {
    /// The node that its clients are.
    pub(crate) node: String,
    /// Its address, with placeholders filled.
    pub(crate) url: String,
    /// What clients have to show.
    pub(crate) token: Option<Token>,
    /// What it shows to clients of TLS.
    pub(crate) tls: Option<Arc<ServerConfig>>,
    /// Whether it may be reached from other machines.
    pub(crate) public: bool,
    /// What is changed in the names that its clients use.
    pub(crate) renamed: Renamed,
    /// The bridge, for each of its clients.
    pub(crate) bridge: Address,
}

/// Proxies that listen. Once they are dropped, all their connections have ended and their addresses are free.
pub(crate) struct Proxies {
    listening: Vec<Arc<Listening>>,
    notes: Receiver<String>,
    /// Dropped with this, which ends the thread.
    running: Option<(oneshot::Sender<()>, JoinHandle<()>)>,
}

impl Drop for Proxies {
    fn drop(&mut self) {
        if let Some((running, thread)) = self.running.take() {
            drop(running);
            // It ends as soon as it has done what it is doing for a client.
            thread.join().ok();
        }
    }
}

/// A proxy that listens.
struct Listening {
    proxy: Proxy,
    places: Arc<Semaphore>,
    joined: Mutex<Joined>,
    notes: SyncSender<String>,
}

/// The clients of a proxy that reach the bridge.
#[derive(Debug, Default)]
struct Joined {
    clients: usize,
    /// When the last one was there.
    last: Option<Instant>,
}

impl Proxies {
    /// Begins to listen at all addresses, or says at which that is not possible.
    pub(crate) fn listen(proxies: Vec<Proxy>) -> Result<Proxies, TransportError> {
        let (notes, noted) = sync_channel(NOTES);
        let mut listeners = Vec::new();
        for proxy in proxies {
            let listener = bind(&proxy)?;
            let listening = Arc::new(Listening {
                proxy,
                places: Arc::new(Semaphore::new(CLIENTS)),
                joined: Mutex::default(),
                notes: notes.clone(),
            });
            listeners.push((listening, listener));
        }
        let listening = listeners.iter().map(|(listening, _)| Arc::clone(listening)).collect();
        let (running, ended) = oneshot::channel();
        let failed = |error: io::Error| TransportError::Wiring(format!("no proxy can be started: {error}"));
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(failed)?;
        let serve = async move {
            for (listening, listener) in listeners {
                tokio::spawn(serve(listening, listener));
            }
            // Its sender is only ever dropped.
            ended.await.ok();
        };
        let in_thread = move || runtime.block_on(serve);
        let thread = thread::Builder::new().name("rosbridge proxy".to_owned()).spawn(in_thread).map_err(failed)?;
        Ok(Proxies { listening, notes: noted, running: Some((running, thread)) })
    }

    /// Which proxies have no client that reaches the bridge, in words; and those whose last client came a moment ago.
    pub(crate) fn missing(&self, settle: Duration) -> Vec<String> {
        let missing = |listening: &Arc<Listening>| {
            let Proxy { node, url, .. } = &listening.proxy;
            let joined = listening.joined.lock().unwrap_or_else(PoisonError::into_inner);
            match joined.last {
                _ if joined.clients == 0 => {
                    Some(format!("no client of node `{node}` is connected to its proxy at `{url}`"))
                }
                Some(last) if last.elapsed() < settle => {
                    Some(format!("a client has just connected to the proxy of node `{node}`"))
                }
                _ => None,
            }
        };
        self.listening.iter().filter_map(missing).collect()
    }

    /// What happened meanwhile that a user should know: each once.
    pub(crate) fn notes(&self) -> Vec<String> {
        let notes: BTreeSet<String> = self.notes.try_iter().collect();
        notes.into_iter().collect()
    }
}

fn bind(proxy: &Proxy) -> Result<Listener, TransportError> {
    let Proxy { node, url, token, tls, public, .. } = proxy;
    let failed = |problem: &str| {
        TransportError::Wiring(format!("the proxy of node `{node}` cannot listen at `{url}`: {problem}"))
    };
    let at = url.split_once("://").map_or(url.as_str(), |(_, at)| at).trim_end_matches('/');
    let listener = Listener::bind(at).map_err(|error| failed(&error.to_string()))?;
    let address = listener.local_addr().map_err(|error| failed(&error.to_string()))?;
    let is_guarded = *public && token.is_some() && tls.is_some();
    if !address.ip().is_loopback() && !is_guarded {
        return Err(failed("other machines could connect; it needs `public`, a `token` and `wss://`"));
    }
    listener.set_nonblocking(true).map_err(|error| failed(&error.to_string()))?;
    Ok(listener)
}

async fn serve(listening: Arc<Listening>, listener: Listener) {
    let listener = match TcpListener::from_std(listener) {
        Ok(listener) => listener,
        Err(error) => return listening.note(&format!("no longer listens: {error}")),
    };
    loop {
        let (stream, from) = match listener.accept().await {
            Ok(accepted) => accepted,
            // For example too many open files: it may pass.
            Err(error) => {
                listening.note(&format!("could not let a client in: {error}"));
                tokio::time::sleep(Duration::from_millis(100)).await;
                continue;
            }
        };
        let Ok(place) = Arc::clone(&listening.places).try_acquire_owned() else {
            listening.note(&format!("has {CLIENTS} clients, and refused one more from {}", from.ip()));
            continue;
        };
        let listening = Arc::clone(&listening);
        tokio::spawn(async move {
            Box::pin(listening.client(stream, from)).await;
            drop(place);
        });
    }
}

impl Listening {
    async fn client(&self, stream: TcpStream, from: SocketAddr) {
        stream.set_nodelay(true).ok();
        match &self.proxy.tls {
            None => self.let_in(stream, from).await,
            Some(tls) => {
                let accepting = TlsAcceptor::from(Arc::clone(tls)).accept(stream);
                match tokio::time::timeout(LET_IN_WITHIN, accepting).await {
                    Ok(Ok(stream)) => Box::pin(self.let_in(stream, from)).await,
                    Ok(Err(error)) => {
                        self.note(&format!("refused a client from {}: it does not speak TLS: {error}", from.ip()));
                    }
                    Err(_) => self.note(&format!("refused a client from {}: it was silent", from.ip())),
                }
            }
        }
    }

    async fn let_in<S: AsyncRead + AsyncWrite + Unpin>(&self, stream: S, from: SocketAddr) {
        let mut problem = None;
        let check = Check { token: self.proxy.token.as_ref(), problem: &mut problem };
        let limits = WebSocketConfig::default().max_message_size(Some(Limits::default().operation));
        let accepting = accept_hdr_async_with_config(stream, check, Some(limits));
        let socket = match tokio::time::timeout(LET_IN_WITHIN, accepting).await {
            Ok(Ok(socket)) => socket,
            Ok(Err(error)) => {
                // What it sent could hold a secret; the words of the library do not repeat it.
                let problem = problem.map_or_else(|| error.to_string(), str::to_owned);
                return self.note(&format!("refused a client from {}: {problem}", from.ip()));
            }
            Err(_) => return self.note(&format!("refused a client from {}: it was silent", from.ip())),
        };
        let connected = Connected { of: self, is: Mutex::new(false) };
        let names = Names::new(&self.proxy.renamed);
        if let Err(problem) = tunnel::run(socket, &self.proxy.bridge, names, |is| connected.set(is)).await {
            self.note(&format!("sent a client away: {problem}"));
        }
    }

    fn note(&self, what: &str) {
        self.notes.try_send(format!("the proxy of node `{}` {what}", self.proxy.node)).ok();
    }
}

/// Whether one client reaches the bridge. It is counted as long as it does.
struct Connected<'a> {
    of: &'a Listening,
    is: Mutex<bool>,
}

impl Connected<'_> {
    fn set(&self, is: bool) {
        let mut joined = self.of.joined.lock().unwrap_or_else(PoisonError::into_inner);
        let was = std::mem::replace(&mut *self.is.lock().unwrap_or_else(PoisonError::into_inner), is);
        if is && !was {
            joined.clients += 1;
            joined.last = Some(Instant::now());
        } else if was && !is {
            joined.clients -= 1;
        }
    }
}

impl Drop for Connected<'_> {
    fn drop(&mut self) {
        self.set(false);
    }
}

/// Lets in clients that show the token, if there is one.
struct Check<'a> {
    token: Option<&'a Token>,
    /// Why the client was not let in.
    problem: &'a mut Option<&'static str>,
}

impl Callback for Check<'_> {
    fn on_request(self, request: &Request, response: Response) -> Result<Response, ErrorResponse> {
        *self.problem = self.token.and_then(|token| objection(request, token));
        if self.problem.is_none() {
            return Ok(response);
        }
        let mut refused = ErrorResponse::new(None);
        *refused.status_mut() = StatusCode::UNAUTHORIZED;
        Err(refused)
    }
}

/// Why a client that shows this is not let in. Browsers cannot send headers with a WebSocket: they show a token in the
/// address.
fn objection(request: &Request, token: &Token) -> Option<&'static str> {
    let in_header = request.headers().get(AUTHORIZATION).and_then(|value| value.to_str().ok()?.strip_prefix("Bearer "));
    let in_address = || request.uri().query()?.split('&').find_map(|part| part.strip_prefix("token="));
    match in_header.or_else(in_address) {
        None => Some("it showed no token"),
        Some(shown) if is_same(shown.as_bytes(), token.reveal().as_bytes()) => None,
        Some(_) => Some("it showed a wrong token"),
    }
}

/// Compares in a time that depends on the lengths only, so that it tells nothing about how much of a guess is right.
fn is_same(left: &[u8], right: &[u8]) -> bool {
    let differences = left.iter().zip(right).fold(0, |differences, (left, right)| differences | (left ^ right));
    left.len() == right.len() && std::hint::black_box(differences) == 0
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    // Other systems have one loopback address only, and there a connection of another test may take the port meanwhile.
    #[test]
    fn once_proxies_are_dropped_their_addresses_are_free() {
        let free = Listener::bind("127.0.0.2:0").unwrap().local_addr().unwrap();
        let url = format!("ws://{free}");
        let bridge = Address { url: url.clone(), token: None, trusted: None, found_again_within: Duration::ZERO };
        for _ in 0..100 {
            let proxy = Proxy {
                node: "station".to_owned(),
                url: url.clone(),
                token: None,
                tls: None,
                public: false,
                renamed: Renamed::default(),
                bridge: bridge.clone(),
            };
            drop(Proxies::listen(vec![proxy]).unwrap());
        }
    }
}
