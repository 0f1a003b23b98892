//! One client of a proxy and its own connection to the bridge.

#![expect(
    clippy::disallowed_methods,
    reason = "an adapter: it waits for clients and for a bridge, in a thread of its own"
)]

use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use futures_util::stream::{SplitSink, SplitStream};
use futures_util::{SinkExt as _, StreamExt as _};
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::sync::mpsc;
use tokio_tungstenite::WebSocketStream;
use tokio_tungstenite::tungstenite::Message as Frame;
use tokio_tungstenite::tungstenite::protocol::CloseFrame;
use tokio_tungstenite::tungstenite::protocol::frame::coding::CloseCode;

use super::names::{FromBridge, FromClient, Names, refused};
use crate::client::{Address, Socket, open};

/// How many reports may wait for a client: with more, it is not read.
const REPORTS: usize = 64;

/// How long to wait before a connection to the bridge is tried again.
const PAUSE: Duration = Duration::from_millis(50);

/// How long the closing of a connection may take.
const CLOSE_WITHIN: Duration = Duration::from_millis(200);

/// Why a tunnel ended for which the client is not to blame, in words.
pub(super) type Broken = String;

/// Which side went away.
enum Gone {
    Client,
    Bridge,
}

/// Passes frames between a client and the bridge until the client goes away. While a bridge is away, the client is not
/// read; a bridge that comes back is told again what lasts. `connected` is told whenever frames can pass, and when they
/// cannot any more. `open_now` is called whenever frames can pass, and
/// `awaiting` when they cannot.
pub(super) async fn run<S: AsyncRead + AsyncWrite + Unpin>(
    client: WebSocketStream<S>,
    bridge: &Address,
    names: Names,
    connected: impl Fn(bool),
) -> Result<(), Broken> {
    let (mut to_client, mut from_client) = client.split();
    let names = Mutex::new(names);
    loop {
        let socket = match find(bridge, &names).await {
            Ok(socket) => socket,
            Err(problem) => {
                let reason = CloseFrame { code: CloseCode::Restart, reason: "the bridge is away".into() };
                let goodbye = to_client.send(Frame::Close(Some(reason)));
                tokio::time::timeout(CLOSE_WITHIN, goodbye).await.ok();
                return Err(problem);
            }
        };
        connected(true);
        let (mut to_bridge, mut from_bridge) = socket.split();
        let (report, mut reports) = mpsc::channel(REPORTS);
        let gone = tokio::select! {
            gone = towards_bridge(&mut from_client, &mut to_bridge, &names, &report) => gone,
            gone = towards_client(&mut from_bridge, &mut to_client, &names, &mut reports) => gone,
        };
        connected(false);
        match gone {
            Gone::Client => {
                tokio::time::timeout(CLOSE_WITHIN, to_bridge.close()).await.ok();
                return Ok(());
            }
            // It may be back soon.
            Gone::Bridge => {}
        }
    }
}

/// Connects to the bridge, for as long as it may be away, and says what lasts.
async fn find(bridge: &Address, names: &Mutex<Names>) -> Result<Socket, Broken> {
    let begun = Instant::now();
    loop {
        let problem = match open(bridge).await {
            Ok(mut socket) => match introduce(&mut socket, names).await {
                Ok(()) => return Ok(socket),
                Err(problem) => problem,
            },
            Err(problem) => problem.to_string(),
        };
        if begun.elapsed() >= bridge.found_again_within {
            return Err(problem);
        }
        tokio::time::sleep(PAUSE).await;
    }
}

async fn introduce(socket: &mut Socket, names: &Mutex<Names>) -> Result<(), Broken> {
    let standing = names.lock().unwrap_or_else(PoisonError::into_inner).standing();
    for frame in standing {
        socket.send(Frame::text(frame)).await.map_err(|error| error.to_string())?;
    }
    Ok(())
}

async fn towards_bridge<S: AsyncRead + AsyncWrite + Unpin>(
    from_client: &mut SplitStream<WebSocketStream<S>>,
    to_bridge: &mut SplitSink<Socket, Frame>,
    names: &Mutex<Names>,
    report: &mpsc::Sender<String>,
) -> Gone {
    loop {
        let Some(Ok(frame)) = from_client.next().await else { return Gone::Client };
        let from_client = |text: &str| names.lock().unwrap_or_else(PoisonError::into_inner).client_text(text);
        let becomes = match &frame {
            Frame::Text(text) => from_client(text),
            // Some bridges take a text as bytes too.
            Frame::Binary(bytes) => match std::str::from_utf8(bytes) {
                Ok(text) => from_client(text),
                Err(_) => refused(None, "bytes that are not UTF-8"),
            },
            Frame::Close(_) => return Gone::Client,
            Frame::Ping(_) | Frame::Pong(_) | Frame::Frame(_) => continue,
        };
        let frame = match becomes {
            FromClient::Unchanged => frame,
            FromClient::Changed(text) => Frame::text(text),
            FromClient::Waits => continue,
            FromClient::Refused(status) => {
                if report.send(status).await.is_err() {
                    return Gone::Client;
                }
                continue;
            }
        };
        if to_bridge.send(frame).await.is_err() {
            return Gone::Bridge;
        }
    }
}

async fn towards_client<S: AsyncRead + AsyncWrite + Unpin>(
    from_bridge: &mut SplitStream<Socket>,
    to_client: &mut SplitSink<WebSocketStream<S>, Frame>,
    names: &Mutex<Names>,
    reports: &mut mpsc::Receiver<String>,
) -> Gone {
    loop {
        let frame = tokio::select! {
            Some(status) = reports.recv() => {
                if to_client.send(Frame::text(status)).await.is_err() {
                    return Gone::Client;
                }
                continue;
            }
            frame = from_bridge.next() => match frame {
                Some(Ok(frame)) => frame,
                Some(Err(_)) | None => return Gone::Bridge,
            },
        };
        let becomes = {
            let mut names = names.lock().unwrap_or_else(PoisonError::into_inner);
            match &frame {
                Frame::Text(text) => names.bridge_text(text),
                Frame::Binary(bytes) => names.bridge_bytes(bytes),
                Frame::Close(_) => return Gone::Bridge,
                Frame::Ping(_) | Frame::Pong(_) | Frame::Frame(_) => continue,
            }
        };
        let frames = match becomes {
            FromBridge::Unchanged => vec![frame],
            FromBridge::Texts(texts) => texts.into_iter().map(Frame::text).collect(),
            FromBridge::Bytes(bytes) => vec![Frame::binary(bytes)],
        };
        for frame in frames {
            if to_client.send(frame).await.is_err() {
                return Gone::Client;
            }
        }
    }
}
