//! A client that blocks: a connection to a simulator, on a thread of its own.
//!
//! Each stream of messages is opened by a task of its own, since a server may acknowledge it with its first message
//! only, which no step may wait for.

mod connect;
mod error;
mod inbox;

use std::future::Future;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::thread::JoinHandle;
use std::time::Duration;

use sesame_plan::SimlogVersion;
use tokio::runtime::{Builder, Handle};
use tokio::sync::oneshot;
use tonic::service::interceptor::InterceptedService;
use tonic::transport::Channel;
use tonic::{Status, Streaming};

use self::connect::{Bearer, connected, endpoint, next_port};
use self::inbox::Inbox;
use crate::message::Message;
use crate::proto::simulator3::sim_server_api_client::SimServerApiClient;
use crate::proto::simulator3::{SimStatus, StepRequest as StepRequest3};
use crate::proto::v2::simlog_api_client::SimlogApiClient as Api2;
use crate::proto::v2::{InjectRequest, PubRequest, RosMessage, StepRequest, StepSizeRequest, TopicDescriptor};
use crate::proto::v3::simlog_api_client::SimlogApiClient as Api3;
use crate::proto::v3::{self, SimlogMessage, Subscriber, SubscriptionRequest, TopicInfoRequest};

pub use self::error::ClientError;
pub use self::inbox::{Bounds, Heard};

/// The largest message that is taken, in bytes.
const MESSAGE_LIMIT: usize = 4 << 20;

/// Where a simulator is, and how it is spoken to.
#[derive(Debug, Clone)]
pub struct Options {
    /// Its URL, `http://HOST:PORT` or `https://HOST:PORT`.
    pub url: String,
    /// The URL of its topics in version 3; `None` for the port after that of `url`.
    pub topics_url: Option<String>,
    /// The version of the protocol.
    pub version: SimlogVersion,
    /// The certificates (PEM) of whoever vouches for an `https://` URL.
    pub ca: Option<Vec<u8>>,
    /// Sent with each call (`authorization: Bearer …`).
    pub token: Option<String>,
    /// How long connecting may take, and an answer.
    pub patience: Duration,
    /// How much may wait to be taken.
    pub bounds: Bounds,
}

impl Options {
    /// Those of a URL: without TLS and token, and with a patience of ten seconds.
    pub fn new(url: &str, version: SimlogVersion) -> Self {
        Options {
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

type Line = InterceptedService<Channel, Bearer>;

/// The calls of a version.
#[derive(Debug, Clone)]
enum Api {
    V2(Api2<Line>),
    V3 { topics: Api3<Line>, simulator: SimServerApiClient<Line> },
}

/// What a step has come to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stepped {
    /// Whether the simulation has ended.
    pub ended: bool,
    /// The simulator's clock in milliseconds, if it says it.
    pub clock_ms: Option<i64>,
}

/// A connection to a simulator. Dropping it ends the connection.
#[derive(Debug)]
pub struct Client {
    url: String,
    patience: Duration,
    api: Api,
    /// Of version 3: which subscriber this is.
    uuid: String,
    /// In milliseconds.
    step: i64,
    inbox: Arc<Inbox>,
    streams: usize,
    handle: Handle,
    /// Dropped to end the thread.
    stop: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

/// What a call will be answered.
#[derive(Debug)]
pub struct Answer<T> {
    url: String,
    what: String,
    receiver: Receiver<Result<T, ClientError>>,
}

impl<T> Answer<T> {
    /// The answer, if it comes within this time.
    pub fn wait(&self, limit: Duration) -> Result<Option<T>, ClientError> {
        match self.receiver.recv_timeout(limit) {
            Ok(answer) => answer.map(Some),
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => {
                let how = format!("{} was given up", self.what);
                Err(ClientError::Lost { url: self.url.clone(), how })
            }
        }
    }
}

impl Client {
    /// Connects to a simulator; tries again until the patience is over.
    pub fn connect(options: &Options) -> Result<Self, ClientError> {
        let url = options.url.clone();
        let failed = |how: std::io::Error| ClientError::Url { url: url.clone(), reason: how.to_string() };
        let runtime = Builder::new_current_thread().enable_io().enable_time().build().map_err(failed)?;
        let handle = runtime.handle().clone();
        let (stop, stopped) = oneshot::channel::<()>();
        let thread = std::thread::Builder::new().name("simlog".to_owned()).spawn(move || {
            // It ends with an error when the other end is dropped, which is what stops it.
            runtime.block_on(stopped).ok();
            runtime.shutdown_background();
        });
        let mut client = Client {
            patience: options.patience,
            api: api(options, &handle, Endpoints::of(options)?)?,
            uuid: uuid(),
            step: 0,
            inbox: Arc::new(Inbox::new(&url, options.bounds)),
            streams: 0,
            handle,
            stop: Some(stop),
            thread: Some(thread.map_err(failed)?),
            url,
        };
        client.create_subscriber();
        Ok(client)
    }

    /// Its URL.
    pub fn url(&self) -> &str {
        &self.url
    }

    /// Sets how much simulation time each step takes.
    pub fn set_step(&mut self, milliseconds: i64) -> Result<(), ClientError> {
        self.step = milliseconds;
        let Api::V2(api) = &self.api else { return Ok(()) };
        let mut api = api.clone();
        let request = StepSizeRequest { step: milliseconds };
        self.call("the length of a step", async move { api.set_step_size(request).await.map(drop) })
    }

    /// Asks the simulator to take a step.
    pub fn begin_step(&self) -> Answer<Stepped> {
        let step = self.step;
        let api = self.api.clone();
        self.ask("a step", async move {
            match api {
                Api::V2(mut api) => {
                    let code = api.step(StepRequest {}).await?.into_inner().code;
                    Ok(Stepped { ended: code < 0, clock_ms: None })
                }
                Api::V3 { mut simulator, .. } => {
                    let answer = simulator.step(StepRequest3 { delta_time: step }).await?;
                    let SimStatus { clock, alive, .. } = answer.into_inner();
                    Ok(Stepped { ended: !alive, clock_ms: Some(clock) })
                }
            }
        })
    }

    /// Takes a step.
    pub fn step(&self) -> Result<Stepped, ClientError> {
        self.finished(&self.begin_step())
    }

    /// Listens to a topic by its name on the wire. Gives the number of its stream.
    pub fn listen(&mut self, name: &str, kind: &str) -> Result<usize, ClientError> {
        let stream = self.next_stream();
        match self.api.clone() {
            Api::V2(mut api) => {
                let topic = descriptor(name, kind);
                self.open(stream, name, async move { api.subscribe(topic).await.map(tonic::Response::into_inner) });
            }
            Api::V3 { .. } => {
                self.has(name)?;
                self.subscribe(name, stream)?;
            }
        }
        Ok(stream)
    }

    /// Cuts a topic by its name on the wire. Gives the number of the stream on which its messages come, and the name
    /// under which messages are published in their place: in version 2 that is `injected`, in version 3 one that begins
    /// so.
    pub fn inject(&mut self, name: &str, injected: &str, kind: &str) -> Result<(usize, String), ClientError> {
        let stream = self.next_stream();
        match self.api.clone() {
            Api::V2(mut api) => {
                let [injected_topic, target] = [injected, name].map(|name| Some(descriptor(name, kind)));
                let request = InjectRequest { injected: injected_topic, target };
                self.open(stream, name, async move { api.inject(request).await.map(tonic::Response::into_inner) });
                Ok((stream, injected.to_owned()))
            }
            Api::V3 { topics: mut api, .. } => {
                self.has(name)?;
                let request =
                    v3::InjectRequest { target_path: name.to_owned(), shadow_path_prefix: injected.to_owned() };
                let paths = self.call(&format!("to cut `{name}`"), async move {
                    api.inject(request).await.map(tonic::Response::into_inner)
                })?;
                self.subscribe(&paths.shadow_path_out, stream)?;
                Ok((stream, paths.shadow_path_in))
            }
        }
    }

    /// Waits until the simulator has acknowledged all streams, at most so long. Whether it has: some do so with their
    /// first message only.
    pub fn await_streams(&self, limit: Duration) -> Result<bool, ClientError> {
        match self.api {
            Api::V2(_) => self.inbox.await_open(self.streams, limit),
            // Calls acknowledge them.
            Api::V3 { .. } => self.inbox.await_open(1, limit),
        }
    }

    /// Publishes messages, each under its name on the wire, and waits until the simulator has them all. All must be of
    /// the client's version; others are left out.
    pub fn publish(&self, messages: Vec<(String, Message)>) -> Result<(), ClientError> {
        match self.api.clone() {
            Api::V2(mut api) => {
                let requests = messages.into_iter().filter_map(|(name, message)| match message {
                    Message::V2(data) => {
                        Some(PubRequest { topic: Some(descriptor(&name, &data.r#type)), data: Some(*data) })
                    }
                    Message::V3(_) => None,
                });
                let requests = tokio_stream::iter(requests.collect::<Vec<_>>());
                self.call("published messages", async move { api.publish(requests).await.map(drop) })
            }
            Api::V3 { topics: mut api, .. } => {
                let requests = messages.into_iter().filter_map(|(topic, message)| match message {
                    Message::V3(data) => Some(v3::PubRequest { topic, data: Some(*data) }),
                    Message::V2(_) => None,
                });
                let requests = tokio_stream::iter(requests.collect::<Vec<_>>());
                self.call("published messages", async move { api.publish(requests).await.map(drop) })
            }
        }
    }

    /// What has come in, as soon as something has, at most after so long: then it is empty.
    pub fn take(&self, limit: Duration) -> Result<Vec<Heard>, ClientError> {
        self.inbox.take(limit)
    }

    fn next_stream(&mut self) -> usize {
        self.streams += 1;
        self.streams - 1
    }

    /// Of version 3: opens the one stream that carries all topics.
    fn create_subscriber(&mut self) {
        let Api::V3 { topics: mut api, .. } = self.api.clone() else { return };
        let subscriber = Subscriber { name: "sesame".to_owned(), uuid: self.uuid.clone() };
        let (inbox, url) = (Arc::clone(&self.inbox), self.url.clone());
        self.handle.spawn(async move {
            let failed = |status: &Status| inbox.fail(ClientError::of(&url, "a subscriber", status));
            let mut stream: Streaming<SimlogMessage> = match api.create_subscriber(subscriber).await {
                Ok(stream) => stream.into_inner(),
                Err(status) => return failed(&status),
            };
            inbox.opened();
            loop {
                match stream.message().await {
                    Ok(Some(message)) => {
                        let name = message.header.as_ref().map_or("", |header| &header.path).to_owned();
                        // What nobody has asked for belongs to nobody.
                        let Some(stream) = inbox.stream(&name) else { continue };
                        if !inbox.put(stream, &name, Message::V3(Box::new(message))) {
                            return;
                        }
                    }
                    Ok(None) => return inbox.fail(over(&url, "all topics")),
                    Err(status) => return failed(&status),
                }
            }
        });
    }

    /// Of version 2: opens a stream in a task of its own.
    fn open(
        &self,
        stream: usize,
        name: &str,
        opened: impl Future<Output = Result<Streaming<RosMessage>, Status>> + Send + 'static,
    ) {
        let (inbox, url, name) = (Arc::clone(&self.inbox), self.url.clone(), name.to_owned());
        self.handle.spawn(async move {
            let failed = |status: &Status| inbox.fail(ClientError::of(&url, &format!("topic `{name}`"), status));
            let mut messages = match opened.await {
                Ok(messages) => messages,
                Err(status) => return failed(&status),
            };
            inbox.opened();
            loop {
                match messages.message().await {
                    Ok(Some(message)) => {
                        if !inbox.put(stream, &name, Message::V2(Box::new(message))) {
                            return;
                        }
                    }
                    Ok(None) => return inbox.fail(over(&url, &format!("topic `{name}`"))),
                    Err(status) => return failed(&status),
                }
            }
        });
    }

    /// Of version 3: that there is such a topic.
    fn has(&self, name: &str) -> Result<(), ClientError> {
        let Api::V3 { topics: mut api, .. } = self.api.clone() else { return Ok(()) };
        let request = TopicInfoRequest { path: name.to_owned() };
        let info = self.call(&format!("topic `{name}`"), async move {
            api.get_topic_info(request).await.map(tonic::Response::into_inner)
        })?;
        if info.exists { Ok(()) } else { Err(ClientError::NoTopic { url: self.url.clone(), name: name.to_owned() }) }
    }

    /// Of version 3: adds a topic to the stream of all.
    fn subscribe(&self, name: &str, stream: usize) -> Result<(), ClientError> {
        let Api::V3 { topics: mut api, .. } = self.api.clone() else { return Ok(()) };
        self.inbox.name(name, stream);
        // A subscription needs the subscriber, whose task may not have created it yet. Not every server says when it has.
        if stream == 0 {
            self.inbox.await_open(1, self.patience / 10)?;
        }
        let request = SubscriptionRequest { path: name.to_owned(), subscriber_uuid: self.uuid.clone() };
        self.call(&format!("topic `{name}`"), async move { api.subscribe(request).await.map(drop) })
    }

    /// Calls and waits for the answer.
    fn call<T: Send + 'static>(
        &self,
        what: &str,
        call: impl Future<Output = Result<T, Status>> + Send + 'static,
    ) -> Result<T, ClientError> {
        self.finished(&self.ask(what, call))
    }

    fn finished<T>(&self, answer: &Answer<T>) -> Result<T, ClientError> {
        answer.wait(self.patience)?.ok_or_else(|| ClientError::Silent {
            url: self.url.clone(),
            what: answer.what.clone(),
            limit: self.patience,
        })
    }

    fn ask<T: Send + 'static>(
        &self,
        what: &str,
        call: impl Future<Output = Result<T, Status>> + Send + 'static,
    ) -> Answer<T> {
        let (sender, receiver) = sync_channel(1);
        let (url, what) = (self.url.clone(), what.to_owned());
        let answer = Answer { url: url.clone(), what: what.clone(), receiver };
        self.handle.spawn(async move {
            let answered = call.await.map_err(|status| ClientError::of(&url, &what, &status));
            // Whoever asked may have given up.
            sender.send(answered).ok();
        });
        answer
    }
}

impl Drop for Client {
    fn drop(&mut self) {
        drop(self.stop.take());
        if let Some(thread) = self.thread.take() {
            // It has no way to panic that is not reported already.
            thread.join().ok();
        }
    }
}

struct Endpoints {
    urls: Vec<String>,
    bearer: Bearer,
}

impl Endpoints {
    fn of(options: &Options) -> Result<Self, ClientError> {
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

/// Connects to all servers of a simulator.
fn api(options: &Options, handle: &Handle, Endpoints { urls, bearer }: Endpoints) -> Result<Api, ClientError> {
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
            topics: Api3::new(topics).max_decoding_message_size(MESSAGE_LIMIT),
            simulator: SimServerApiClient::new(simulator).max_decoding_message_size(MESSAGE_LIMIT),
        },
        (Some(simulator), None) => Api::V2(Api2::new(simulator).max_decoding_message_size(MESSAGE_LIMIT)),
        (None, _) => unreachable!("there is always a URL"),
    })
}

fn descriptor(name: &str, kind: &str) -> TopicDescriptor {
    TopicDescriptor { path: name.to_owned(), msg_type: kind.to_owned() }
}

fn over(url: &str, what: &str) -> ClientError {
    ClientError::Lost { url: url.to_owned(), how: format!("the stream of {what} ended") }
}

/// A name that no other subscriber has: of this process, and of its count of clients.
fn uuid() -> String {
    use std::sync::atomic::{AtomicU64, Ordering};
    static CLIENTS: AtomicU64 = AtomicU64::new(0);
    let client = CLIENTS.fetch_add(1, Ordering::Relaxed);
    let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default();
    format!("{:08x}-0000-4000-8000-{:012x}", std::process::id(), since.as_nanos() as u64 % (1 << 40) + client)
}
