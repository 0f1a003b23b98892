//! What is published at a broker: topics, how their messages are sent, and what their payloads have in common.
//!
//! Nothing is published. A broker tells neither who publishes nor who subscribes, and of topics only those on which
//! something comes while it is listened to, or is retained.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::{Duration, Instant};

use rumqttc::v5::mqttbytes::QoS;
use rumqttc::v5::mqttbytes::v5::Publish;
use sesame_plan::Secret;
use sesame_relay::transport::TransportError;
use sesame_relay::transport::bus::secret::{Token, trusted};
use sesame_relay::transport::bus::tls;
use sesame_scan::{Arrivals, Facts, FoundTopic, Payloads, System};

use crate::address::Address;
use crate::connection::{Account, Connection, Passed, Received};

/// How many messages may wait to be looked at.
const WAITING: usize = 1000;

/// The most topics that are kept.
pub const MOST_TOPICS: usize = 10_000;

/// How long it may take until everything is subscribed to.
const READY_WITHIN: Duration = Duration::from_secs(10);

/// What is listened to, and how the broker is reached.
#[derive(Debug, Clone)]
pub struct ScanOptions {
    /// The address of the broker, `mqtt://…` or `mqtts://…`.
    pub url: String,
    /// The filters of topics, such as `#`.
    pub filters: Vec<String>,
    /// For how long.
    pub listening: Duration,
    /// As whom.
    pub user: Option<String>,
    /// Where the password is.
    pub password: Option<Secret>,
    /// A file with the certificates of authorities that are trusted.
    pub trust: Option<String>,
    /// The folder to which files are relative.
    pub folder: PathBuf,
}

/// What was found at a broker.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// All of it; topics have no types yet.
    pub facts: Facts,
    /// What the payloads of each topic have in common.
    pub payloads: Payloads,
}

/// Why nothing can be heard.
#[derive(Debug, thiserror::Error)]
pub enum ScanError {
    /// An address, a secret or a certificate cannot be used.
    #[error("{0}")]
    Settings(String),
    /// Nobody answers.
    #[error("no broker answers at `{url}`: {how}; start it, or name the address of the one that runs")]
    NoAnswer {
        /// The address.
        url: String,
        /// How it failed.
        how: String,
    },
    /// The broker does not let anybody in who says this.
    #[error("the broker at `{url}` refused the connection: {how}")]
    Refused {
        /// The address.
        url: String,
        /// Its reason.
        how: String,
    },
    /// The connection was lost.
    #[error("the connection to the broker at `{url}` was lost: {how}")]
    Lost {
        /// The address.
        url: String,
        /// How.
        how: String,
    },
}

impl From<TransportError> for ScanError {
    fn from(error: TransportError) -> Self {
        ScanError::Settings(error.to_string())
    }
}

/// Listens at a broker.
pub fn scan(options: &ScanOptions) -> Result<Found, ScanError> {
    let (queue, incoming) = sync_channel(WAITING);
    let account = account(options)?;
    let received = Received { broker: 0, queue };
    // It ends when this is dropped.
    let _connection = Connection::start(account, received).map_err(|error| ScanError::Settings(error.to_string()))?;
    let mut heard = Heard::default();
    let ready = Instant::now() + READY_WITHIN;
    let begin = loop {
        match next(&incoming, options, ready)? {
            Some(Passed::Ready) => break Instant::now(),
            // Trying again is for brokers that are launched; one that is looked at runs.
            Some(Passed::NoAnswer(how)) => return Err(ScanError::NoAnswer { url: options.url.clone(), how }),
            Some(Passed::Message(publish, _)) => heard.take(&publish, Duration::ZERO),
            Some(_) => {}
            None => {
                let how = format!("no answer within {} s", READY_WITHIN.as_secs());
                return Err(ScanError::NoAnswer { url: options.url.clone(), how });
            }
        }
    };
    while begin.elapsed() < options.listening {
        match next(&incoming, options, begin + options.listening)? {
            Some(Passed::Message(publish, arrived)) => heard.take(&publish, arrived.saturating_duration_since(begin)),
            Some(_) => {}
            None => break,
        }
    }
    let system = System::Mqtt { url: options.url.clone() };
    let cut = heard.cut || heard.payloads.is_cut();
    let topics = heard.topics.into_iter().map(|(path, topic)| topic.found(path)).collect();
    let facts = Facts { seconds: options.listening.as_secs_f64(), cut, topics, ..Facts::of(system) };
    Ok(Found { facts, payloads: heard.payloads })
}

fn account(options: &ScanOptions) -> Result<Account, ScanError> {
    let address = Address::read(&options.url).map_err(ScanError::Settings)?;
    let pem = options.trust.as_ref().map(|path| trusted(path, &options.folder)).transpose()?;
    let tls = if address.tls { Some(tls::client(pem.as_deref()).map_err(ScanError::Settings)?) } else { None };
    let token = options.password.as_ref().map(|secret| Token::read(secret, &options.folder)).transpose()?;
    let filters: BTreeSet<&String> = options.filters.iter().collect();
    Ok(Account {
        address,
        tls,
        client: format!("sesame-scan-{}", std::process::id()),
        user: options.user.clone(),
        token,
        subscriptions: filters.into_iter().map(|filter| (filter.clone(), false)).collect(),
        // The highest one, so that each message comes with the quality with which it was published.
        quality: QoS::ExactlyOnce,
    })
}

/// What comes next, waited for until then; nothing more if the time is over.
fn next(
    incoming: &Receiver<(usize, Passed)>,
    options: &ScanOptions,
    until: Instant,
) -> Result<Option<Passed>, ScanError> {
    let url = || options.url.clone();
    match incoming.recv_timeout(until.saturating_duration_since(Instant::now())) {
        Ok((_, Passed::Refused(how))) => Err(ScanError::Refused { url: url(), how }),
        Ok((_, Passed::Lost(how))) => Err(ScanError::Lost { url: url(), how }),
        Ok((_, passed)) => Ok(Some(passed)),
        Err(RecvTimeoutError::Timeout) => Ok(None),
        Err(RecvTimeoutError::Disconnected) => Err(ScanError::Lost { url: url(), how: "its thread ended".to_owned() }),
    }
}

/// What was heard so far.
#[derive(Default)]
struct Heard {
    topics: BTreeMap<String, Topic>,
    payloads: Payloads,
    /// Whether there were more topics.
    cut: bool,
}

#[derive(Debug, Clone, Copy, Default)]
struct Topic {
    arrivals: Arrivals,
    retained: bool,
    quality: u8,
    /// How many payloads were not JSON.
    unreadable: u64,
}

impl Heard {
    fn take(&mut self, publish: &Publish, at: Duration) {
        // An empty payload removes what was retained; it says nothing of a topic.
        let Ok(path) = std::str::from_utf8(&publish.topic) else { return };
        if publish.payload.is_empty() {
            return;
        }
        if self.topics.len() >= MOST_TOPICS && !self.topics.contains_key(path) {
            self.cut = true;
            return;
        }
        let topic = self.topics.entry(path.to_owned()).or_default();
        topic.arrivals.add(at);
        topic.retained |= publish.retain;
        topic.quality = topic.quality.max(match publish.qos {
            QoS::AtMostOnce => 0,
            QoS::AtLeastOnce => 1,
            QoS::ExactlyOnce => 2,
        });
        match serde_json::from_slice(&publish.payload) {
            Ok(payload) => self.payloads.add(path, &payload),
            Err(_) => topic.unreadable += 1,
        }
    }
}

impl Topic {
    fn found(self, path: String) -> FoundTopic {
        let messages = self.arrivals.messages();
        let problem = format!("{} of {messages} payloads are not JSON", self.unreadable);
        FoundTopic {
            path,
            retained: Some(self.retained),
            quality: Some(self.quality),
            messages,
            rate: self.arrivals.rate(),
            problem: Some(problem).filter(|_| self.unreadable > 0),
            ..FoundTopic::default()
        }
    }
}

#[cfg(test)]
#[expect(clippy::disallowed_types, reason = "a port that is free is one that was listened to")]
mod tests {
    use super::*;

    fn publish(topic: &str, payload: &str, quality: QoS) -> Publish {
        Publish::new(topic, quality, payload.to_owned(), None)
    }

    #[test]
    fn topics_are_what_their_messages_are_and_are_bounded() {
        let mut heard = Heard::default();
        heard.take(&Publish { retain: true, ..publish("a", "{\"x\": 1}", QoS::AtLeastOnce) }, Duration::ZERO);
        heard.take(&publish("a", "{\"x\": 2.5}", QoS::AtMostOnce), Duration::from_secs(2));
        heard.take(&publish("a", "", QoS::AtMostOnce), Duration::from_secs(2));
        heard.take(&publish("b", "{", QoS::AtMostOnce), Duration::ZERO);
        let found = |path: &str| heard.topics[path].found(path.to_owned());
        let a = found("a");
        assert_eq!((a.messages, a.rate, a.retained, a.quality), (2, Some(0.5), Some(true), Some(1)));
        assert_eq!(found("b").problem.as_deref(), Some("1 of 1 payloads are not JSON"));
        for number in 0..MOST_TOPICS + 5 {
            heard.take(&publish(&format!("t{number}"), "1", QoS::AtMostOnce), Duration::ZERO);
        }
        assert!(heard.cut);
        assert_eq!(heard.topics.len(), MOST_TOPICS);
    }

    #[test]
    fn a_broker_that_is_not_there_is_an_error() {
        let free = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
        let options = ScanOptions {
            url: format!("mqtt://{free}"),
            filters: vec!["#".to_owned()],
            listening: Duration::from_secs(2),
            user: None,
            password: None,
            trust: None,
            folder: PathBuf::new(),
        };
        let said = scan(&options).unwrap_err().to_string();
        assert!(said.starts_with(&format!("no broker answers at `mqtt://{free}`: ")), "{said}");
        let said = scan(&ScanOptions { url: "tcp://a".to_owned(), ..options }).unwrap_err().to_string();
        assert_eq!(said, "`tcp://a` is not the address of a broker; write `mqtt://HOST:PORT`");
    }
}
