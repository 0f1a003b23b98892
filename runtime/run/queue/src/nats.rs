//! A queue that a broker of NATS keeps, with JetStream: a work queue with acknowledgements and redelivery, in files.
//!
//! Each campaign has a stream of tests, a stream of results and a store of files of its own, which are removed with it.
//! Who is there is said on subjects that nobody keeps. Messages that are too large for the broker travel as files.

#![expect(clippy::disallowed_methods, reason = "an adapter: it knows since when agents were not heard")]

mod connection;

use std::collections::{BTreeMap, VecDeque};
use std::fmt::Display;
use std::future::Future;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use async_nats::connection::State;
use async_nats::jetstream::consumer::{AckPolicy, PullConsumer, pull};
use async_nats::jetstream::context::GetStreamErrorKind;
use async_nats::jetstream::message::{AckKind, Acker, PublishMessage};
use async_nats::jetstream::object_store::{self, GetErrorKind, InfoErrorKind, ObjectInfo, ObjectStore};
use async_nats::jetstream::stream::{self, RetentionPolicy, StorageType};
use async_nats::jetstream::{self, Context, ErrorCode, kv};
use async_nats::{Client, Subject};
use futures_util::StreamExt as _;
use tokio::io::AsyncReadExt as _;
use tokio::runtime::Runtime;
use tokio::task::JoinHandle;

use self::connection::Connection;
use crate::announcement::is_campaign_id;
use crate::message::digest_of;
use crate::queue::{Held, LARGEST_FILE, PRESENT, Queue, QueueError};

pub use self::connection::Access;

/// A test whose agent was not heard for so long is delivered to somebody else.
const LOST: Duration = Duration::from_secs(2);

/// How often an agent says that it still holds a test: several times until it counts as lost.
const BEAT: Duration = Duration::from_millis(400);

/// How long a result that was taken out and not confirmed stays away.
const CONFIRMED: Duration = Duration::from_secs(30);

/// How long an answer of the broker is awaited.
const PATIENCE: Duration = Duration::from_secs(5);

/// How many bytes in a second the slowest network carries that is waited for.
const SLOWEST: u64 = 100_000;

/// What a message needs in addition to its content.
const OVERHEAD: usize = 4096;

/// How many results are fetched at once.
const TOGETHER: usize = 64;

/// The bucket of announcements.
const CAMPAIGNS: &str = "sesame-campaigns";

/// On which subject agents say that they are there.
const AGENTS: &str = "sesame.agent";

/// The mark of a message whose content is a file, followed by its hash. Sealed messages begin with a hexadecimal digit.
const IN_FILE: u8 = b'@';

/// Agents by their names, when they were last heard, and what they said.
type Heard = Arc<Mutex<BTreeMap<String, (Instant, Vec<u8>)>>>;

/// A connection to a broker.
pub struct Nats {
    /// Where it is, without secrets.
    url: String,
    client: Client,
    context: Context,
    heard: Heard,
    /// By campaign: the consumers of tests, and those of results.
    consumers: Mutex<BTreeMap<(String, Part), PullConsumer>>,
    /// Results that were fetched and not handed out yet.
    fetched: Mutex<VecDeque<jetstream::Message>>,
    /// Last, so that it ends after what runs on it.
    runtime: Runtime,
}

/// A stream of a campaign.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Part {
    Tests,
    Results,
}

impl Part {
    const ALL: [Part; 2] = [Part::Tests, Part::Results];

    fn word(self) -> &'static str {
        match self {
            Part::Tests => "tests",
            Part::Results => "results",
        }
    }

    fn stream(self, campaign: &str) -> String {
        format!("sesame-{campaign}-{}", self.word())
    }

    fn subject(self, campaign: &str) -> String {
        format!("sesame.{campaign}.{}", self.word())
    }
}

fn files(campaign: &str) -> String {
    format!("sesame-{campaign}-files")
}

impl Nats {
    /// Connects to a broker, for example at `nats://127.0.0.1:4222`. It must be there now; a connection that breaks
    /// later is made again.
    pub fn connect(url: &str, access: &Access) -> Result<Self, QueueError> {
        let Connection { place, runtime, client, context } = connection::connect(url, access)?;
        let heard = Heard::default();
        let subscribed = runtime.block_on(async {
            let mut subscriber = client.subscribe(format!("{AGENTS}.*")).await.map_err(|error| error.to_string())?;
            let heard = Arc::clone(&heard);
            tokio::spawn(async move {
                while let Some(message) = subscriber.next().await {
                    hear(&heard, &message.subject, message.payload.to_vec());
                }
            });
            // From now on, what agents say is heard.
            client.flush().await.map_err(|error| error.to_string())
        });
        subscribed.map_err(|reason| QueueError::Refused { place: place.clone(), reason })?;
        let (consumers, fetched) = (Mutex::default(), Mutex::default());
        Ok(Nats { url: place, client, context, heard, consumers, fetched, runtime })
    }

    fn unreachable(&self, error: &impl Display) -> QueueError {
        QueueError::Unreachable { place: self.url.clone(), reason: error.to_string() }
    }

    fn block<T, E: Display>(&self, what: impl Future<Output = Result<T, E>>) -> Result<T, QueueError> {
        self.block_for(2 * PATIENCE, what)
    }

    fn block_for<T, E: Display>(
        &self,
        limit: Duration,
        what: impl Future<Output = Result<T, E>>,
    ) -> Result<T, QueueError> {
        let limited = async { tokio::time::timeout(limit, what).await };
        match self.runtime.block_on(limited) {
            Ok(result) => result.map_err(|error| self.unreachable(&error)),
            Err(_) => Err(self.unreachable(&format!("no answer within {} s", limit.as_secs()))),
        }
    }

    /// The consumer of a part of a campaign, which is made where it is not there.
    fn consumer(&self, campaign: &str, part: Part) -> Result<PullConsumer, QueueError> {
        let key = (campaign.to_owned(), part);
        if let Some(consumer) = lock(&self.consumers).get(&key) {
            return Ok(consumer.clone());
        }
        let config = pull::Config {
            durable_name: Some("sesame".to_owned()),
            ack_policy: AckPolicy::Explicit,
            ack_wait: match part {
                Part::Tests => LOST,
                Part::Results => CONFIRMED,
            },
            max_deliver: -1,
            max_ack_pending: -1,
            ..pull::Config::default()
        };
        let stream = part.stream(campaign);
        let consumer = self.block(async {
            let stream = self.context.get_stream(stream).await.map_err(|error| error.to_string())?;
            stream.get_or_create_consumer("sesame", config).await.map_err(|error| error.to_string())
        })?;
        lock(&self.consumers).insert(key, consumer.clone());
        Ok(consumer)
    }

    /// What was made for a consumer is not there any more, or was made anew.
    fn forget(&self, campaign: &str) {
        lock(&self.consumers).retain(|(of, _), _| of != campaign);
    }

    /// Whether the broker has a stream; an error says that it did not answer.
    async fn has_stream(&self, stream: &str) -> Result<bool, String> {
        match self.context.get_stream(stream).await {
            Ok(_) => Ok(true),
            Err(error) if is_missing(&error.kind()) => Ok(false),
            Err(error) => Err(error.to_string()),
        }
    }

    /// The files of a campaign; `None` if it has no room in the broker.
    async fn store(&self, campaign: &str) -> Result<Option<ObjectStore>, String> {
        let name = files(campaign);
        if !self.has_stream(&format!("OBJ_{name}")).await? {
            return Ok(None);
        }
        self.context.get_object_store(name).await.map(Some).map_err(|error| error.to_string())
    }

    /// The announcements of campaigns; `None` if there was never one.
    async fn campaigns(&self) -> Result<Option<kv::Store>, String> {
        if !self.has_stream(&format!("KV_{CAMPAIGNS}")).await? {
            return Ok(None);
        }
        self.context.get_key_value(CAMPAIGNS).await.map(Some).map_err(|error| error.to_string())
    }

    /// The content of a message, or what stands for it where it is too large.
    fn carried(&self, campaign: &str, content: &[u8]) -> Result<Vec<u8>, QueueError> {
        if content.len() + OVERHEAD <= self.client.server_info().max_payload {
            return Ok(content.to_vec());
        }
        let hash = digest_of(content);
        self.put_file(campaign, &hash, content)?;
        Ok([&[IN_FILE], hash.as_bytes()].concat())
    }

    /// What a message says; `None` if it stands for a file that is gone.
    fn content(&self, campaign: &str, payload: &[u8]) -> Result<Option<Vec<u8>>, QueueError> {
        match payload.split_first() {
            Some((&IN_FILE, hash)) => {
                let hash = String::from_utf8_lossy(hash);
                let content = self.file(campaign, &hash)?;
                Ok(content.filter(|content| digest_of(content) == hash))
            }
            _ => Ok(Some(payload.to_vec())),
        }
    }

    fn publish(&self, campaign: &str, part: Part, content: &[u8]) -> Result<(), QueueError> {
        let content = self.carried(campaign, content)?;
        // What is sent again after an answer that did not come is one message all the same.
        let id = digest_of(&content);
        self.block(async {
            let message = PublishMessage::build().payload(content.into()).message_id(id);
            let publish = self.context.send_publish(part.subject(campaign), message);
            publish.await.map_err(|error| error.to_string())?.await.map_err(|error| error.to_string())
        })?;
        Ok(())
    }

    /// The next message of a consumer.
    fn next(&self, consumer: &PullConsumer, wait: Duration) -> Result<Option<jetstream::Message>, QueueError> {
        self.block(async {
            let expires = wait.max(Duration::from_millis(1));
            let batch = consumer.batch().max_messages(1).expires(expires).messages();
            let mut batch = batch.await.map_err(|error| error.to_string())?;
            match tokio::time::timeout(wait + PATIENCE, batch.next()).await {
                Ok(next) => next.transpose().map_err(|error| error.to_string()),
                Err(_) => Err("no answer".to_owned()),
            }
        })
    }
}

/// Whether the broker says that it has no such stream.
fn is_missing(kind: &GetStreamErrorKind) -> bool {
    matches!(kind, GetStreamErrorKind::JetStream(answer) if answer.error_code() == ErrorCode::STREAM_NOT_FOUND)
}

fn hear(heard: &Heard, subject: &Subject, said: Vec<u8>) {
    let Some(agent) = subject.strip_prefix(AGENTS).and_then(|rest| rest.strip_prefix('.')) else { return };
    let mut heard = lock(heard);
    if said.is_empty() {
        heard.remove(agent);
    } else {
        heard.insert(agent.to_owned(), (Instant::now(), said));
    }
    heard.retain(|_, (last, _)| last.elapsed() < PRESENT);
}

/// What is known of a file; `None` if it is not there.
async fn info(store: &ObjectStore, hash: &str) -> Result<Option<ObjectInfo>, String> {
    match store.info(hash).await {
        Ok(info) => Ok(Some(info).filter(|info| !info.deleted)),
        Err(error) if error.kind() == InfoErrorKind::NotFound => Ok(None),
        Err(error) => Err(error.to_string()),
    }
}

/// How long a file of so many bytes may take, however slow the network is.
fn time_for(bytes: u64) -> Duration {
    2 * PATIENCE + Duration::from_secs(bytes / SLOWEST)
}

fn no_room(campaign: &str) -> String {
    format!("the campaign {campaign} has been removed")
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn checked(campaign: &str) -> &str {
    assert!(is_campaign_id(campaign), "`{campaign}` names no campaign");
    campaign
}

impl Queue for Nats {
    fn place(&self) -> String {
        self.url.clone()
    }

    fn make_room(&self, campaign: &str) -> Result<(), QueueError> {
        let campaign = checked(campaign);
        self.block(async {
            for part in Part::ALL {
                let config = stream::Config {
                    name: part.stream(campaign),
                    subjects: vec![part.subject(campaign)],
                    retention: RetentionPolicy::WorkQueue,
                    storage: StorageType::File,
                    ..stream::Config::default()
                };
                self.context.get_or_create_stream(config).await.map_err(|error| error.to_string())?;
            }
            if self.store(campaign).await?.is_none() {
                let config = object_store::Config { bucket: files(campaign), ..object_store::Config::default() };
                self.context.create_object_store(config).await.map_err(|error| error.to_string())?;
            }
            Ok::<_, String>(())
        })
    }

    fn announce(&self, campaign: &str, announcement: &[u8]) -> Result<(), QueueError> {
        let campaign = checked(campaign);
        let carried = self.carried(campaign, announcement)?;
        self.block(async {
            let campaigns = if let Some(campaigns) = self.campaigns().await? {
                campaigns
            } else {
                let config = kv::Config { bucket: CAMPAIGNS.to_owned(), history: 1, ..kv::Config::default() };
                self.context.create_key_value(config).await.map_err(|error| error.to_string())?
            };
            campaigns.put(campaign, carried.into()).await.map_err(|error| error.to_string())
        })?;
        Ok(())
    }

    fn announcements(&self) -> Result<Vec<(String, Vec<u8>)>, QueueError> {
        let carried = self.block(async {
            let Some(campaigns) = self.campaigns().await? else { return Ok(Vec::new()) };
            let mut keys = campaigns.keys().await.map_err(|error| error.to_string())?;
            let mut found = Vec::new();
            while let Some(key) = keys.next().await {
                let key = key.map_err(|error| error.to_string())?;
                if is_campaign_id(&key)
                    && let Some(carried) = campaigns.get(&key).await.map_err(|error| error.to_string())?
                {
                    found.push((key, carried));
                }
            }
            Ok::<_, String>(found)
        })?;
        let mut found = Vec::new();
        for (campaign, carried) in carried {
            if let Some(announcement) = self.content(&campaign, &carried)? {
                found.push((campaign, announcement));
            }
        }
        found.sort_unstable();
        Ok(found)
    }

    fn withdraw(&self, campaign: &str) -> Result<(), QueueError> {
        let stream = Part::Tests.stream(checked(campaign));
        self.block(async {
            let stream = self.context.get_stream(stream).await.map_err(|error| error.to_string())?;
            stream.purge().await.map_err(|error| error.to_string())
        })?;
        Ok(())
    }

    fn remove(&self, campaign: &str) -> Result<(), QueueError> {
        let campaign = checked(campaign);
        self.forget(campaign);
        self.block(async {
            if let Some(campaigns) = self.campaigns().await? {
                campaigns.purge(campaign).await.map_err(|error| error.to_string())?;
            }
            let mut streams = Part::ALL.map(|part| part.stream(campaign)).to_vec();
            streams.push(format!("OBJ_{}", files(campaign)));
            for stream in streams {
                if self.has_stream(&stream).await? {
                    self.context.delete_stream(&stream).await.map_err(|error| error.to_string())?;
                }
            }
            Ok::<_, String>(())
        })
    }

    fn put_test(&self, campaign: &str, test: &[u8]) -> Result<(), QueueError> {
        self.publish(checked(campaign), Part::Tests, test)
    }

    fn take_test(&self, campaign: &str, wait: Duration) -> Result<Option<Box<dyn Held>>, QueueError> {
        let consumer = self.consumer(checked(campaign), Part::Tests)?;
        let next = self.next(&consumer, wait);
        if next.is_err() {
            self.forget(campaign);
        }
        let Some(message) = next? else { return Ok(None) };
        let deliveries = message.info().map_or(1, |info| u64::try_from(info.delivered).unwrap_or(1));
        let (message, acker) = message.split();
        let acker = Arc::new(acker);
        let beating = Arc::clone(&acker);
        let beat = self.runtime.spawn(async move {
            loop {
                tokio::time::sleep(BEAT).await;
                // While the broker cannot be reached, the test may be given to somebody else: it is run twice.
                beating.ack_with(AckKind::Progress).await.ok();
            }
        });
        let (url, handle) = (self.url.clone(), self.runtime.handle().clone());
        let mut held = Box::new(OverNats { url, acker, beat, test: Vec::new(), deliveries, handle });
        let Some(test) = self.content(campaign, &message.payload)? else {
            // What it stands for is gone, with the campaign.
            held.finish()?;
            return Ok(None);
        };
        held.test = test;
        Ok(Some(held))
    }

    fn put_result(&self, campaign: &str, result: &[u8]) -> Result<(), QueueError> {
        self.publish(checked(campaign), Part::Results, result)
    }

    fn take_result(&self, campaign: &str, wait: Duration) -> Result<Option<Vec<u8>>, QueueError> {
        let consumer = self.consumer(checked(campaign), Part::Results)?;
        if lock(&self.fetched).is_empty() {
            let fetched = self.block(async {
                let fetch = consumer.fetch().max_messages(TOGETHER).messages();
                let mut fetched = fetch.await.map_err(|error| error.to_string())?;
                let mut messages = Vec::new();
                while let Some(message) = fetched.next().await {
                    messages.push(message.map_err(|error| error.to_string())?);
                }
                Ok::<_, String>(messages)
            });
            if fetched.is_err() {
                self.forget(campaign);
            }
            let mut fetched = fetched?;
            if fetched.is_empty() {
                fetched.extend(self.next(&consumer, wait)?);
            }
            lock(&self.fetched).extend(fetched);
        }
        let Some(message) = lock(&self.fetched).pop_front() else { return Ok(None) };
        let content = self.content(campaign, &message.payload)?;
        self.block(async { message.ack().await })?;
        if let Some((&IN_FILE, hash)) = message.payload.split_first() {
            // If it stays, it goes with the campaign.
            self.remove_file(campaign, &String::from_utf8_lossy(hash)).ok();
        }
        Ok(content)
    }

    fn put_file(&self, campaign: &str, hash: &str, content: &[u8]) -> Result<(), QueueError> {
        let (campaign, mut content) = (checked(campaign), content);
        self.block_for(time_for(content.len() as u64), async {
            let store = self.store(campaign).await?.ok_or_else(|| no_room(campaign))?;
            store.put(hash, &mut content).await.map_err(|error| error.to_string())
        })?;
        Ok(())
    }

    fn has_file(&self, campaign: &str, hash: &str) -> Result<bool, QueueError> {
        let campaign = checked(campaign);
        self.block(async {
            let Some(store) = self.store(campaign).await? else { return Ok(false) };
            info(&store, hash).await.map(|info| info.is_some())
        })
    }

    fn file(&self, campaign: &str, hash: &str) -> Result<Option<Vec<u8>>, QueueError> {
        let campaign = checked(campaign);
        let found = self.block(async {
            let Some(store) = self.store(campaign).await? else { return Ok(None) };
            Ok::<_, String>(info(&store, hash).await?.map(|info| (store, info.size as u64)))
        })?;
        let Some((store, size)) = found else { return Ok(None) };
        self.block_for(time_for(size), async {
            let object = match store.get(hash).await {
                Ok(object) => object,
                Err(error) if error.kind() == GetErrorKind::NotFound => return Ok(None),
                Err(error) => return Err(error.to_string()),
            };
            let mut content = Vec::new();
            object.take(LARGEST_FILE).read_to_end(&mut content).await.map_err(|error| error.to_string())?;
            Ok::<_, String>(Some(content))
        })
    }

    fn remove_file(&self, campaign: &str, hash: &str) -> Result<(), QueueError> {
        let campaign = checked(campaign);
        self.block(async {
            let Some(store) = self.store(campaign).await? else { return Ok(()) };
            if info(&store, hash).await?.is_some() {
                store.delete(hash).await.map_err(|error| error.to_string())?;
            }
            Ok::<_, String>(())
        })
    }

    fn present(&self, agent: &str, presence: &[u8]) -> Result<(), QueueError> {
        let said = presence.to_vec();
        self.block(self.client.publish(format!("{AGENTS}.{agent}"), said.into()))
    }

    fn absent(&self, agent: &str) -> Result<(), QueueError> {
        self.present(agent, &[])?;
        self.block(self.client.flush())
    }

    fn presences(&self) -> Result<Vec<Vec<u8>>, QueueError> {
        if self.client.connection_state() != State::Connected {
            return Err(self.unreachable(&"the connection is lost"));
        }
        let heard = lock(&self.heard);
        Ok(heard.values().filter(|(last, _)| last.elapsed() < PRESENT).map(|(_, said)| said.clone()).collect())
    }
}

/// A test that this process holds, as a task says again and again.
struct OverNats {
    url: String,
    acker: Arc<Acker>,
    beat: JoinHandle<()>,
    test: Vec<u8>,
    deliveries: u64,
    handle: tokio::runtime::Handle,
}

impl Drop for OverNats {
    fn drop(&mut self) {
        self.beat.abort();
    }
}

impl Held for OverNats {
    fn test(&self) -> &[u8] {
        &self.test
    }

    fn deliveries(&self) -> u64 {
        self.deliveries
    }

    fn finish(self: Box<Self>) -> Result<(), QueueError> {
        self.beat.abort();
        let said = async { tokio::time::timeout(PATIENCE, self.acker.double_ack_with(AckKind::Ack)).await };
        let reason = match self.handle.block_on(said) {
            Ok(Ok(())) => return Ok(()),
            Ok(Err(error)) => error.to_string(),
            Err(_) => "no answer".to_owned(),
        };
        Err(QueueError::Unreachable { place: self.url.clone(), reason })
    }
}
