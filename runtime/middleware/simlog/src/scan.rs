//! What comes on topics of a simulator: messages, and what they have in common.
//!
//! The protocol lists no topics in either version, so whoever scans names them. Version 3 tells whether a topic exists,
//! and what its value is now; version 2 tells nothing before a message comes. A step is taken only if that is asked
//! for.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use sesame_plan::{SimlogVersion, WireNames};
use sesame_scan::{Arrivals, Conventions, Facts, FoundTopic, Payloads, System};

use crate::client::{Client, ClientError, ClientOptions, Heard};

/// The most topics that are listened to.
pub const MOST_TOPICS: usize = 1000;

/// How long a simulator is waited for to acknowledge what is listened to: some do not until their first message.
const ACKNOWLEDGED: Duration = Duration::from_millis(300);

/// For how long nothing may come in until the messages of the last step are complete.
const QUIET: Duration = Duration::from_millis(500);

/// What is looked at.
#[derive(Debug, Clone)]
pub struct Wanted {
    /// The paths of topics, as in a space.
    pub topics: Vec<String>,
    /// How their names on the wire follow from them.
    pub names: WireNames,
    /// How many steps are taken.
    pub steps: u64,
    /// The length of each, in milliseconds.
    pub step_ms: u64,
    /// How long messages are waited for without a step, or after the last one.
    pub listening: Duration,
}

/// What was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// All of it; topics have no types yet.
    pub facts: Facts,
    /// What the payloads of each topic have in common.
    pub payloads: Payloads,
    /// How payloads are written in this version.
    pub conventions: Conventions,
}

/// Looks at topics of a simulator.
pub fn scan(options: &ClientOptions, wanted: &Wanted) -> Result<Found, ClientError> {
    let mut scan = Scan {
        client: Client::connect(options)?,
        begin: now(),
        topics: Vec::new(),
        streams: BTreeMap::new(),
        arrivals: BTreeMap::new(),
        payloads: Payloads::default(),
    };
    for path in wanted.topics.iter().take(MOST_TOPICS) {
        scan.listen(path, wanted, options.version)?;
    }
    scan.client.await_streams(ACKNOWLEDGED)?;
    let mut steps = 0;
    if wanted.steps > 0 {
        scan.client.set_step(i64::try_from(wanted.step_ms).unwrap_or(i64::MAX))?;
        while steps < wanted.steps {
            let stepped = scan.client.step()?;
            steps += 1;
            scan.take(Duration::ZERO)?;
            if stepped.ended {
                break;
            }
        }
    }
    let until = now() + wanted.listening;
    loop {
        let left = until.saturating_duration_since(now());
        let quiet = if steps > 0 { QUIET.min(left) } else { left };
        if left.is_zero() || (!scan.take(quiet)? && steps > 0) {
            break;
        }
    }
    Ok(scan.found(options, wanted, steps))
}

struct Scan {
    client: Client,
    begin: Instant,
    topics: Vec<FoundTopic>,
    /// The topics of the client's streams.
    streams: BTreeMap<usize, usize>,
    arrivals: BTreeMap<usize, Arrivals>,
    payloads: Payloads,
}

impl Scan {
    /// Listens to a topic, if there is one.
    fn listen(&mut self, path: &str, wanted: &Wanted, version: SimlogVersion) -> Result<(), ClientError> {
        let mut topic = FoundTopic { path: path.to_owned(), ..FoundTopic::default() };
        let [heard, cut] = [wanted.names.heard(path), wanted.names.cut(path)];
        let mut name = Some(heard.clone());
        if version == SimlogVersion::V3 {
            let [has_heard, has_cut] = [self.client.has(&heard)?, self.client.has(&cut)?];
            topic.can_be_cut = Some(has_cut);
            name = if has_heard { Some(heard.clone()) } else { Some(cut.clone()).filter(|_| has_cut) };
        }
        let at = self.topics.len();
        match name {
            Some(name) => {
                self.streams.insert(self.client.listen(&name, "")?, at);
                // What a topic is now may be all that there is without a step. Not every server tells it.
                for message in self.client.read(&name).unwrap_or_default() {
                    self.payloads.add(path, &message.payload());
                }
            }
            None => topic.problem = Some(format!("the simulator has neither `{heard}` nor `{cut}`")),
        }
        self.topics.push(topic);
        Ok(())
    }

    /// Takes what has come. Whether anything has.
    fn take(&mut self, limit: Duration) -> Result<bool, ClientError> {
        let heard = self.client.take(limit)?;
        let (any, at) = (!heard.is_empty(), now().saturating_duration_since(self.begin));
        for Heard { stream, message } in heard {
            let Some(&topic) = self.streams.get(&stream) else { continue };
            self.arrivals.entry(topic).or_default().add(at);
            self.payloads.add(&self.topics[topic].path, &message.payload());
        }
        Ok(any)
    }

    fn found(mut self, options: &ClientOptions, wanted: &Wanted, steps: u64) -> Found {
        for (at, topic) in self.topics.iter_mut().enumerate() {
            let arrivals = self.arrivals.get(&at).copied().unwrap_or_default();
            topic.messages = arrivals.messages();
            // A simulator that is stepped publishes as fast as it is stepped.
            topic.rate = arrivals.rate().filter(|_| steps == 0);
            if topic.problem.is_none() && self.payloads.get(&topic.path).is_none() {
                let remedy =
                    if steps == 0 { "take steps with `--steps N`" } else { "take more steps with `--steps N`" };
                topic.problem = Some(format!("nothing came on it; is there such a topic? Else {remedy}"));
            }
        }
        let (protocol, conventions) = match options.version {
            SimlogVersion::V2 => (2, Conventions::Simlog2),
            SimlogVersion::V3 => (3, Conventions::Simlog3),
        };
        let system = System::Simlog { url: options.url.clone(), protocol, step_ms: wanted.step_ms, steps };
        let facts = Facts {
            seconds: self.begin.elapsed().as_millis() as f64 / 1000.0,
            cut: wanted.topics.len() > MOST_TOPICS || self.payloads.is_cut(),
            topics: self.topics,
            ..Facts::of(system)
        };
        Found { facts, payloads: self.payloads, conventions }
    }
}

fn now() -> Instant {
    Instant::now()
}
