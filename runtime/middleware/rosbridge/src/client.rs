//! A client of a bridge, over a WebSocket: operations out, operations in, from a thread of its own.
//!
//! What stands (subscriptions, advertisements) is sent again whenever the connection was lost and found again. Both
//! queues are bounded: if nobody takes what comes in, the socket is not read, so the bridge has to wait.

#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "an adapter: it waits for a bridge, in a thread of its own"
)]

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use futures_util::stream::{SplitSink, SplitStream};
use futures_util::{SinkExt as _, StreamExt as _};
use sesame_relay::transport::bus::tls;
use tokio::net::TcpStream;
use tokio::sync::mpsc;
use tokio_tungstenite::tungstenite::client::IntoClientRequest as _;
use tokio_tungstenite::tungstenite::http::header::AUTHORIZATION;
use tokio_tungstenite::tungstenite::http::{HeaderValue, StatusCode};
use tokio_tungstenite::tungstenite::protocol::WebSocketConfig;
use tokio_tungstenite::tungstenite::{Error as SocketError, Message as Frame};
use tokio_tungstenite::{Connector, MaybeTlsStream, WebSocketStream, connect_async_tls_with_config};

use crate::operation::Operation;
use crate::reader::{Limits, Reader};

/// How many operations may wait, in each direction.
const WAITING: usize = 10_000;

/// How long a server may take until a connection stands.
const CONNECT_WITHIN: Duration = Duration::from_secs(5);

/// How long to wait before a lost connection is tried again.
const PAUSE: Duration = Duration::from_millis(50);

pub(crate) type Socket = WebSocketStream<MaybeTlsStream<TcpStream>>;

/// Where a bridge is, and how it is reached.
#[derive(Clone)]
pub struct Address {
    /// Its address: `ws://…` or `wss://…`.
    pub url: String,
    /// What it wants to be shown. It is never part of an error.
    pub token: Option<String>,
    /// The authorities that are trusted instead of those that the system trusts, as the text of a PEM file.
    pub trusted: Option<Vec<u8>>,
    /// How long a connection that was lost may be tried again.
    pub found_again_within: Duration,
}

/// Why there is no connection.
#[derive(Debug, thiserror::Error)]
pub enum ConnectError {
    /// Nobody is there yet: it may be tried again.
    #[error("nothing answers at `{url}`: {reason}")]
    NoAnswer {
        /// The address.
        url: String,
        /// The reason, as the system says it.
        reason: String,
    },
    /// Somebody is there, and trying again does not help.
    #[error("`{url}` refused the connection: {reason}")]
    Refused {
        /// The address.
        url: String,
        /// The reason, with the remedy.
        reason: String,
    },
}

/// What comes from a bridge.
#[derive(Debug)]
pub enum Incoming {
    /// An operation, and when it arrived.
    Operation(Box<Operation>, Instant),
    /// A frame that is not an operation, in words. The connection goes on.
    Malformed(String),
    /// The connection was lost for this long, and is there again.
    FoundAgain(Duration),
    /// The connection was lost and not found again, in words.
    Lost(String),
}

/// A connection to a bridge.
pub struct Client {
    outgoing: mpsc::Sender<String>,
    incoming: Receiver<Incoming>,
    /// What is sent again to a bridge that is found again.
    standing: Arc<Mutex<Vec<String>>>,
    stands: Arc<AtomicBool>,
}

impl Client {
    /// Connects, within a few seconds.
    pub fn connect(address: &Address) -> Result<Client, ConnectError> {
        let (outgoing, to_send) = mpsc::channel(WAITING);
        let (received, incoming) = sync_channel(WAITING);
        let (connected, outcome) = sync_channel(1);
        let standing = Arc::new(Mutex::new(Vec::new()));
        let stands = Arc::new(AtomicBool::new(true));
        let line = Line {
            address: address.clone(),
            to_send,
            received,
            standing: Arc::clone(&standing),
            stands: Arc::clone(&stands),
        };
        let refused = |error: io::Error| ConnectError::Refused { url: address.url.clone(), reason: error.to_string() };
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(refused)?;
        let in_thread = move || runtime.block_on(line.run(&connected));
        thread::Builder::new().name("rosbridge".to_owned()).spawn(in_thread).map_err(refused)?;
        match outcome.recv() {
            Ok(Ok(())) => Ok(Client { outgoing, incoming, standing, stands }),
            Ok(Err(error)) => Err(error),
            Err(_) => Err(ConnectError::Refused { url: address.url.clone(), reason: "its thread ended".to_owned() }),
        }
    }

    /// Whether the bridge is there at this moment.
    pub fn stands(&self) -> bool {
        self.stands.load(Ordering::Relaxed)
    }

    /// Says something once. Waits while too much waits to be said; false if the connection is lost for good.
    pub fn say(&self, text: String) -> bool {
        self.outgoing.blocking_send(text).is_ok()
    }

    /// Says something, and says it again to a bridge that is found again.
    pub fn stand(&self, operation: &Operation) -> bool {
        let text = operation.text();
        self.standing.lock().unwrap_or_else(PoisonError::into_inner).push(text.clone());
        self.say(text)
    }

    /// What comes next, waited for at most this long.
    pub fn receive(&self, timeout: Duration) -> Option<Incoming> {
        match self.incoming.recv_timeout(timeout) {
            Ok(incoming) => Some(incoming),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => Some(Incoming::Lost("its thread ended".to_owned())),
        }
    }
}

/// The connection, in its thread. It ends when the client is dropped.
struct Line {
    address: Address,
    to_send: mpsc::Receiver<String>,
    received: SyncSender<Incoming>,
    standing: Arc<Mutex<Vec<String>>>,
    stands: Arc<AtomicBool>,
}

/// Why a connection ended.
enum End {
    /// The client was dropped.
    Dropped,
    /// In words.
    Lost(String),
}

impl Line {
    async fn run(mut self, connected: &SyncSender<Result<(), ConnectError>>) {
        let mut socket = match open(&self.address).await {
            Ok(socket) => socket,
            Err(error) => {
                connected.try_send(Err(error)).ok();
                return;
            }
        };
        connected.try_send(Ok(())).ok();
        loop {
            let End::Lost(how) = self.serve(socket).await else { return };
            self.stands.store(false, Ordering::Relaxed);
            let lost = Instant::now();
            socket = loop {
                tokio::time::sleep(PAUSE).await;
                if self.to_send.is_closed() {
                    return;
                }
                match self.again().await {
                    Ok(socket) => break socket,
                    Err(_) if lost.elapsed() < self.address.found_again_within => {}
                    Err(error) => {
                        self.received.send(Incoming::Lost(format!("{how}, and then {error}"))).ok();
                        return;
                    }
                }
            };
            self.stands.store(true, Ordering::Relaxed);
            // If nobody takes it any more, the client is gone.
            if self.pass(Incoming::FoundAgain(lost.elapsed())).await.is_err() {
                return;
            }
        }
    }

    /// Connects anew, and says what stands. What was to be said meanwhile is not said: it is about a time that is over.
    async fn again(&mut self) -> Result<Socket, ConnectError> {
        let mut socket = open(&self.address).await?;
        while self.to_send.try_recv().is_ok() {}
        let standing = self.standing.lock().unwrap_or_else(PoisonError::into_inner).clone();
        for text in standing {
            socket.send(Frame::text(text)).await.map_err(|error| failed(&self.address, &error))?;
        }
        Ok(socket)
    }

    /// Passes frames until the connection ends.
    async fn serve(&mut self, socket: Socket) -> End {
        let (mut sink, mut stream) = socket.split();
        let mut reader = Reader::new(Limits::default());
        loop {
            tokio::select! {
                text = self.to_send.recv() => {
                    let Some(text) = text else {
                        close(&mut sink).await;
                        return End::Dropped;
                    };
                    if let Err(error) = sink.send(Frame::text(text)).await {
                        return End::Lost(error.to_string());
                    }
                }
                frame = next(&mut stream) => {
                    let incoming = match frame {
                        Err(how) => return End::Lost(how),
                        Ok(Frame::Text(text)) => reader.text(&text),
                        Ok(Frame::Binary(bytes)) => reader.bytes(&bytes),
                        Ok(Frame::Ping(_) | Frame::Pong(_) | Frame::Close(_) | Frame::Frame(_)) => Ok(None),
                    };
                    let incoming = match incoming {
                        Ok(None) => continue,
                        Ok(Some(operation)) => Incoming::Operation(Box::new(operation), Instant::now()),
                        Err(error) => Incoming::Malformed(error.to_string()),
                    };
                    if self.pass(incoming).await.is_err() {
                        return End::Dropped;
                    }
                }
            }
        }
    }

    /// Hands on what came in, as soon as there is room.
    async fn pass(&self, mut incoming: Incoming) -> Result<(), ()> {
        loop {
            match self.received.try_send(incoming) {
                Ok(()) => return Ok(()),
                Err(TrySendError::Disconnected(_)) => return Err(()),
                Err(TrySendError::Full(back)) => incoming = back,
            }
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
    }
}

async fn next(stream: &mut SplitStream<Socket>) -> Result<Frame, String> {
    match stream.next().await {
        None | Some(Ok(Frame::Close(_))) => Err("it was closed".to_owned()),
        Some(Ok(frame)) => Ok(frame),
        Some(Err(error)) => Err(error.to_string()),
    }
}

async fn close(sink: &mut SplitSink<Socket, Frame>) {
    // A bridge that does not answer is not waited for.
    tokio::time::timeout(Duration::from_millis(200), sink.close()).await.ok();
}

/// Connects once.
pub(crate) async fn open(address: &Address) -> Result<Socket, ConnectError> {
    let refused = |reason: String| ConnectError::Refused { url: address.url.clone(), reason };
    let mut request = address.url.as_str().into_client_request().map_err(|error| refused(error.to_string()))?;
    if let Some(token) = &address.token {
        let mut header = HeaderValue::try_from(format!("Bearer {token}"))
            .map_err(|_| refused("the token has characters that HTTP has no room for".to_owned()))?;
        header.set_sensitive(true);
        request.headers_mut().insert(AUTHORIZATION, header);
    }
    let connector = match &address.trusted {
        Some(pem) => Some(Connector::Rustls(tls::client(Some(pem)).map_err(refused)?)),
        None => None,
    };
    let limits = WebSocketConfig::default().max_message_size(Some(Limits::default().operation));
    let connecting = connect_async_tls_with_config(request, Some(limits), true, connector);
    match tokio::time::timeout(CONNECT_WITHIN, connecting).await {
        Ok(Ok((socket, _))) => Ok(socket),
        Ok(Err(error)) => Err(failed(address, &error)),
        Err(_) => {
            let reason = format!("no answer within {} s", CONNECT_WITHIN.as_secs());
            Err(ConnectError::NoAnswer { url: address.url.clone(), reason })
        }
    }
}

fn failed(address: &Address, error: &SocketError) -> ConnectError {
    let url = address.url.clone();
    match error {
        // A server is there, but it does not speak TLS, or not with us.
        SocketError::Io(error) if matches!(error.kind(), io::ErrorKind::InvalidData | io::ErrorKind::UnexpectedEof) => {
            ConnectError::Refused { url, reason: format!("{error}; does it speak TLS?") }
        }
        SocketError::Io(error) => ConnectError::NoAnswer { url, reason: error.to_string() },
        SocketError::Http(response) if response.status() == StatusCode::UNAUTHORIZED => {
            let reason = if address.token.is_some() {
                "it does not accept the token (401)".to_owned()
            } else {
                "it wants a token (401); add `token from env \"NAME\"` to the simulator, or `--token-env NAME` to a scan"
                    .to_owned()
            };
            ConnectError::Refused { url, reason }
        }
        SocketError::Http(response) => {
            ConnectError::Refused { url, reason: format!("it answers {}", response.status()) }
        }
        error => ConnectError::Refused { url, reason: error.to_string() },
    }
}

#[cfg(test)]
mod tests {
    use std::net::SocketAddr;

    use serde_json::json;
    use tokio::net::TcpListener;
    use tokio_tungstenite::accept_hdr_async;
    use tokio_tungstenite::tungstenite::handshake::server::{Callback, ErrorResponse, Request, Response};

    use super::*;

    const SECRET: &str = "s3cret-of-the-hall";

    struct WantsSecret;

    impl Callback for WantsSecret {
        fn on_request(self, request: &Request, response: Response) -> Result<Response, ErrorResponse> {
            let shown = request.headers().get(AUTHORIZATION).and_then(|value| value.to_str().ok());
            if shown == Some(&format!("Bearer {SECRET}")) {
                return Ok(response);
            }
            let mut refused = ErrorResponse::new(None);
            *refused.status_mut() = StatusCode::UNAUTHORIZED;
            Err(refused)
        }
    }

    /// A server that wants the secret, sends these frames to each client, and tells what it is told.
    fn server(frames: Vec<Frame>) -> (SocketAddr, Receiver<String>) {
        let (told, tells) = sync_channel(100);
        let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        listener.set_nonblocking(true).unwrap();
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        let serve = async move {
            let listener = TcpListener::from_std(listener).unwrap();
            while let Ok((stream, _)) = listener.accept().await {
                let Ok(mut socket) = accept_hdr_async(stream, WantsSecret).await else { continue };
                for frame in &frames {
                    socket.send(frame.clone()).await.unwrap();
                }
                // Each client is gone after its second frame.
                for _ in 0..2 {
                    if let Some(Ok(Frame::Text(text))) = socket.next().await {
                        told.try_send(text.to_string()).unwrap();
                    }
                }
            }
        };
        thread::spawn(move || runtime.block_on(serve));
        (address, tells)
    }

    fn at(scheme: &str, address: SocketAddr, token: Option<&str>) -> Address {
        Address {
            url: format!("{scheme}://{address}"),
            token: token.map(str::to_owned),
            trusted: None,
            found_again_within: Duration::from_secs(5),
        }
    }

    fn refused(address: &Address) -> String {
        let said = match Client::connect(address) {
            Ok(_) => panic!("it was let in"),
            Err(error @ ConnectError::Refused { .. }) => error.to_string(),
            Err(error) => panic!("not refused: {error}"),
        };
        assert!(!said.contains(SECRET) && !said.contains("wrong-secret"), "{said}");
        said
    }

    #[test]
    fn a_wrong_token_none_and_tls_to_a_plain_port_are_refused_without_a_secret_in_the_words() {
        let (address, _told) = server(Vec::new());
        let said = refused(&at("ws", address, Some("wrong-secret")));
        assert_eq!(said, format!("`ws://{address}` refused the connection: it does not accept the token (401)"));
        let said = refused(&at("ws", address, None));
        assert!(said.ends_with("it wants a token (401); add `token from env \"NAME\"` to the simulator, or `--token-env NAME` to a scan"), "{said}");
        refused(&at("wss", address, Some(SECRET)));
    }

    #[test]
    fn where_nobody_listens_is_no_answer() {
        let free = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
        assert!(matches!(Client::connect(&at("ws", free, None)), Err(ConnectError::NoAnswer { .. })));
    }

    #[test]
    fn what_stands_is_said_again_after_a_loss_and_malformed_frames_change_nothing() {
        let good = r#"{"op":"publish","topic":"/a","msg":{"data":1}}"#;
        let mut frames: Vec<Frame> = (0u32..10_000).map(|at| Frame::text(format!("{{\"op\":\"{at}"))).collect();
        frames.push(Frame::binary(vec![0xff; 64]));
        frames.push(Frame::text(good));
        let (address, told) = server(frames);
        let client = Client::connect(&at("ws", address, Some(SECRET))).unwrap();
        let subscribe = Operation::Unsubscribe { id: None, topic: "/a".to_owned() };
        assert!(client.stand(&subscribe));
        assert!(client.say("\"once\"".to_owned()));
        let (mut malformed, mut operations, mut found_again) = (0, 0, 0);
        while operations < 2 {
            match client.receive(Duration::from_secs(10)).expect("the server sends something") {
                Incoming::Operation(operation, _) => {
                    let Operation::Publish { msg, .. } = *operation else { panic!("{operation:?}") };
                    assert_eq!(msg, json!({ "data": 1 }));
                    operations += 1;
                }
                Incoming::Malformed(_) => malformed += 1,
                Incoming::FoundAgain(_) => found_again += 1,
                Incoming::Lost(how) => panic!("{how}"),
            }
        }
        assert_eq!((malformed, found_again), (2 * 10_001, 1));
        let told: Vec<String> = (0..3).map(|_| told.recv_timeout(Duration::from_secs(5)).unwrap()).collect();
        assert_eq!(told, [subscribe.text(), "\"once\"".to_owned(), subscribe.text()]);
    }
}
