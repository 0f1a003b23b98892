//! A connection to a broker, in a thread of its own. If it is lost it is looked for again, and everything is subscribed
//! to anew. Both queues are bounded: if nobody takes what comes in, the socket is not read, so the broker has to wait.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{SyncSender, TrySendError};
use std::thread;
use std::time::{Duration, Instant};

use rumqttc::v5::mqttbytes::QoS;
use rumqttc::v5::mqttbytes::v5::Publish;
use sesame_plan::BrokerAt;
use sesame_relay::transport::bus::FOUND_AGAIN_WITHIN;
use sesame_relay::transport::bus::secret::Token;
use tokio::sync::mpsc;

use crate::address::Address;
use crate::session::{End, Session};

/// How many messages may wait to be sent.
const WAITING: usize = 1000;

/// How long to wait before a broker is tried again.
const PAUSE: Duration = Duration::from_millis(50);

/// Where a broker is, as whom the runner is there, and what for.
pub(crate) struct Account {
    pub(crate) address: Address,
    pub(crate) tls: Option<Arc<rustls::ClientConfig>>,
    /// The name by which the broker tells clients apart.
    pub(crate) client: String,
    pub(crate) user: Option<String>,
    pub(crate) token: Option<Token>,
    /// Topics; for each, whether what the runner publishes there is to come back.
    pub(crate) subscriptions: Vec<(String, bool)>,
    pub(crate) quality: QoS,
}

impl Account {
    pub(crate) fn password(&self) -> &str {
        self.token.as_ref().map_or("", Token::reveal)
    }
}

/// What comes from a broker.
#[derive(Debug)]
pub(crate) enum Passed {
    /// Everything is subscribed to.
    Ready,
    /// A message, and when it arrived.
    Message(Box<Publish>, Instant),
    /// The connection was lost for this long, and is there again.
    FoundAgain(Duration),
    /// There is nobody, in words. It is tried again.
    NoAnswer(String),
    /// The broker does not let the runner in, or is lost for good, in words.
    Refused(String),
    /// The connection was lost and not found again, in words.
    Lost(String),
}

/// Where what comes from a broker goes.
pub(crate) struct Received {
    pub(crate) broker: BrokerAt,
    pub(crate) queue: SyncSender<(BrokerAt, Passed)>,
}

impl Received {
    /// Hands on what came in, as soon as there is room; an error if nobody wants it any more.
    pub(crate) async fn pass(&self, passed: Passed) -> Result<(), ()> {
        let mut passed = (self.broker, passed);
        loop {
            match self.queue.try_send(passed) {
                Ok(()) => return Ok(()),
                Err(TrySendError::Disconnected(_)) => return Err(()),
                Err(TrySendError::Full(back)) => passed = back,
            }
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
    }
}

/// The sending side of a connection. Dropping it ends the connection.
pub(crate) struct Connection {
    outgoing: mpsc::Sender<Publish>,
    stands: Arc<AtomicBool>,
}

impl Connection {
    /// Begins to connect; how that goes is among what comes in.
    pub(crate) fn start(account: Account, received: Received) -> io::Result<Connection> {
        let (outgoing, to_send) = mpsc::channel(WAITING);
        let runtime = tokio::runtime::Builder::new_current_thread().enable_io().enable_time().build()?;
        let stands = Arc::new(AtomicBool::new(false));
        let shown = Arc::clone(&stands);
        let run = move || runtime.block_on(run(account, to_send, received, &shown));
        thread::Builder::new().name("mqtt".to_owned()).spawn(run)?;
        Ok(Connection { outgoing, stands })
    }

    /// Whether the broker is there at this moment.
    pub(crate) fn stands(&self) -> bool {
        self.stands.load(Ordering::Relaxed)
    }

    /// Sends a message, or gives it back if too many wait. An error if the connection is lost for good.
    pub(crate) fn send(&self, publish: Publish) -> Result<Option<Publish>, ()> {
        match self.outgoing.try_send(publish) {
            Ok(()) => Ok(None),
            Err(mpsc::error::TrySendError::Full(back)) => Ok(Some(back)),
            Err(mpsc::error::TrySendError::Closed(_)) => Err(()),
        }
    }
}

async fn run(account: Account, mut to_send: mpsc::Receiver<Publish>, received: Received, stands: &AtomicBool) {
    // How the connection ended and when; `None` before there was one.
    let mut lost: Option<(String, Instant)> = None;
    let mut again: Vec<Publish> = Vec::new();
    loop {
        let how = match Session::begin(&account).await {
            Ok(mut session) => {
                let found = match lost.take() {
                    None => Passed::Ready,
                    Some((_, since)) => Passed::FoundAgain(since.elapsed()),
                };
                if received.pass(found).await.is_err() {
                    return;
                }
                stands.store(true, Ordering::Relaxed);
                let resent = session.resend(&mut again).await;
                let end = match resent {
                    Ok(()) => session.serve(&mut to_send, &received).await,
                    Err(end) => end,
                };
                stands.store(false, Ordering::Relaxed);
                again.append(&mut session.unacknowledged());
                lost = Some((String::new(), Instant::now()));
                end
            }
            Err(end) => end,
        };
        let how = match how {
            End::Dropped => return,
            // A broker that is being started again may refuse at first.
            End::Refused(how) if lost.is_none() => {
                received.pass(Passed::Refused(how)).await.ok();
                return;
            }
            End::Refused(how) | End::Broken(how) => how,
        };
        match &mut lost {
            Some((first, since)) => {
                if first.is_empty() {
                    first.clone_from(&how);
                }
                if since.elapsed() >= FOUND_AGAIN_WITHIN {
                    let how = if *first == how { how } else { format!("{first}, and then: {how}") };
                    received.pass(Passed::Lost(how)).await.ok();
                    return;
                }
            }
            None => {
                if received.pass(Passed::NoAnswer(how)).await.is_err() {
                    return;
                }
            }
        }
        tokio::time::sleep(PAUSE).await;
        if to_send.is_closed() {
            return;
        }
    }
}
