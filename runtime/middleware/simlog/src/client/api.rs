//! The calls of a version, connected.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use sesame_plan::SimlogVersion;
use tokio::runtime::Handle;
use tonic::service::interceptor::InterceptedService;
use tonic::transport::Channel;

use super::connect::{Bearer, connected, endpoint, next_port};
use super::error::ClientError;
use super::inbox::Bounds;
use crate::proto::simulator3::sim_server_api_client::SimServerApiClient;
use crate::proto::v2::simlog_api_client::SimlogApiClient as Api2;
use crate::proto::v3::simlog_api_client::SimlogApiClient as Api3;

/// The largest message that is taken, in bytes.
const MESSAGE_LIMIT: usize = 4 << 20;

/// Where a simulator is, and how it is spoken to.
#[derive(Debug, Clone)]
pub struct ClientOptions {
    /// Its URL, `http://HOST:PORT` or `https://HOST:PORT`.
    pub url: String,
    /// The URL of its topics in version 3; `None` for the port after that of `url`.
    pub topics_url: Option<String>,
    /// The version of the protocol.
    pub version: SimlogVersion,
    /// The certificates (PEM) of the authorities that vouch for an `https://` URL.
    pub ca: Option<Vec<u8>>,
    /// Sent with each call (`authorization: Bearer …`).
    pub token: Option<String>,
    /// How long connecting may take, and an answer.
    pub patience: Duration,
    /// How much may wait to be taken.
    pub bounds: Bounds,
}

impl ClientOptions {
    /// The options for a URL: without TLS and token, and with a patience of ten seconds.
    pub fn new(url: &str, version: SimlogVersion) -> Self {
        ClientOptions {
            url: url.to_owned(),
            topics_url: None,
            version,
            ca: None,
            token: None,
            patience: Duration::from_secs(10),
            bounds: Bounds::default(),
        }
    }
}

pub(super) type Line = InterceptedService<Channel, Bearer>;

/// The calls of a version.
#[derive(Debug, Clone)]
pub(super) enum Api {
    V2(Box<Api2<Line>>),
    V3 { topics: Box<Api3<Line>>, simulator: Box<SimServerApiClient<Line>> },
}

struct Endpoints {
    urls: Vec<String>,
    bearer: Bearer,
}

impl Endpoints {
    fn of(options: &ClientOptions) -> Result<Self, ClientError> {
        let mut urls = vec![options.url.clone()];
        if options.version == SimlogVersion::V3 {
            urls.push(match &options.topics_url {
                Some(url) => url.clone(),
                None => next_port(&options.url)?,
            });
        }
        Ok(Endpoints { urls, bearer: Bearer::new(&options.url, options.token.as_deref())? })
    }
}

/// Connects to all servers of a simulator, on the thread of this runtime.
pub(super) fn connect(options: &ClientOptions, handle: &Handle) -> Result<Api, ClientError> {
    let Endpoints { urls, bearer } = Endpoints::of(options)?;
    let mut lines = Vec::new();
    for url in urls {
        let endpoint = endpoint(&url, options.ca.as_deref())?;
        let (sender, receiver) = sync_channel(1);
        let within = options.patience;
        let connecting = connected(url.clone(), endpoint, within);
        handle.spawn(async move { sender.send(connecting.await).ok() });
        // It ends by itself a little after its time.
        let late = |how: RecvTimeoutError| ClientError::Unreachable { url, limit: within, how: how.to_string() };
        let channel = receiver.recv_timeout(within + Duration::from_secs(1)).map_err(late)??;
        lines.push(InterceptedService::new(channel, bearer.clone()));
    }
    let mut lines = lines.into_iter();
    let (first, second) = (lines.next(), lines.next());
    Ok(match (first, second) {
        (Some(simulator), Some(topics)) => Api::V3 {
            topics: Box::new(Api3::new(topics).max_decoding_message_size(MESSAGE_LIMIT)),
            simulator: Box::new(SimServerApiClient::new(simulator).max_decoding_message_size(MESSAGE_LIMIT)),
        },
        (Some(simulator), None) => Api::V2(Box::new(Api2::new(simulator).max_decoding_message_size(MESSAGE_LIMIT))),
        (None, _) => unreachable!("there is always a URL"),
    })
}

/// A name that no other subscriber has: of this process, its count of clients, and the time.
pub(super) fn uuid() -> String {
    static CLIENTS: AtomicU64 = AtomicU64::new(0);
    let client = CLIENTS.fetch_add(1, Ordering::Relaxed);
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    format!("{:08x}-0000-4000-8000-{:08x}{:04x}", std::process::id(), since.subsec_nanos(), client % (1 << 16))
}
