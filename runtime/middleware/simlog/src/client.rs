//! A client that blocks: a connection to a simulator, on a thread of its own.
//!
//! Each stream of messages is opened by a task of its own, since a server may acknowledge it with its first message
//! only, which no step may wait for.

mod api;
mod connect;
mod error;
mod inbox;

use std::future::Future;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::thread::JoinHandle;
use std::time::Duration;

use tokio::runtime::{Builder, Handle};
use tokio::sync::oneshot;
use tonic::{Status, Streaming};

use self::api::{Api, uuid};
use self::inbox::Inbox;
use crate::message::Message;
use crate::proto::simulator3::{SimStatus, StepRequest as StepRequest3};
use crate::proto::v2::{InjectRequest, PubRequest, RosMessage, StepRequest, StepSizeRequest, TopicDescriptor};
use crate::proto::v3::{self, ReadRequest, SimlogMessage, Subscriber, SubscriptionRequest, TopicInfoRequest};

pub use self::api::ClientOptions;
pub use self::error::ClientError;
pub use self::inbox::{Bounds, Heard};

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
    /// Which subscriber this is, in version 3.
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
    pub fn connect(options: &ClientOptions) -> Result<Self, ClientError> {
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
            api: api::connect(options, &handle)?,
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
                self.must_have(name)?;
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
                self.must_have(name)?;
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

    /// Opens the one stream that carries all topics in version 3.
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

    /// Opens a stream of version 2 in a task of its own.
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

    /// Whether there is such a topic in version 3. Version 2 does not say.
    pub fn has(&self, name: &str) -> Result<bool, ClientError> {
        let Api::V3 { topics: mut api, .. } = self.api.clone() else { return Ok(true) };
        let request = TopicInfoRequest { path: name.to_owned() };
        let info = self.call(&format!("topic `{name}`"), async move {
            api.get_topic_info(request).await.map(tonic::Response::into_inner)
        })?;
        Ok(info.exists)
    }

    /// The latest message of a topic in version 3, if there was one. Version 2 does not say.
    pub fn read(&self, name: &str) -> Result<Vec<Message>, ClientError> {
        let Api::V3 { topics: mut api, .. } = self.api.clone() else { return Ok(Vec::new()) };
        let request = ReadRequest { path: vec![name.to_owned()] };
        let answer =
            self.call(
                &format!("topic `{name}`"),
                async move { api.read(request).await.map(tonic::Response::into_inner) },
            )?;
        Ok(answer.messages.into_iter().take(1).map(|message| Message::V3(Box::new(message))).collect())
    }

    fn must_have(&self, name: &str) -> Result<(), ClientError> {
        if self.has(name)? {
            return Ok(());
        }
        Err(ClientError::NoTopic { url: self.url.clone(), name: name.to_owned() })
    }

    /// Adds a topic to the stream of all in version 3.
    fn subscribe(&self, name: &str, stream: usize) -> Result<(), ClientError> {
        let Api::V3 { topics: mut api, .. } = self.api.clone() else { return Ok(()) };
        self.inbox.name(name, stream);
        // A subscription needs the subscriber, whose task may not have created it yet. Not every server says when it
        // has.
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
            // The caller may have given up.
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

fn descriptor(name: &str, kind: &str) -> TopicDescriptor {
    TopicDescriptor { path: name.to_owned(), msg_type: kind.to_owned() }
}

fn over(url: &str, what: &str) -> ClientError {
    ClientError::Lost { url: url.to_owned(), how: format!("the stream of {what} ended") }
}
