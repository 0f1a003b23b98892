//! The simulator with its subscribers, on one thread.

use std::collections::BTreeMap;
use std::sync::mpsc::Receiver;

use sesame_base::time::SimTime;
use sesame_plan::WireNames;
use sesame_relay::simulator::{Bus, Hosted, Message, Progress, Setup, Simulator, SimulatorError};
use sesame_relay::value::Value;
use tokio::sync::{mpsc, oneshot};
use tonic::Status;

use crate::expected_type::ExpectedType;
use crate::proto::v2::RosMessage;
use crate::ros;

/// How many subscribers there may be.
const SUBSCRIBERS: usize = 256;

/// How many messages are kept for the first subscriber of a topic.
const KEPT: usize = 1000;

type Answer<T> = oneshot::Sender<Result<T, Status>>;
type Messages = mpsc::Sender<Result<RosMessage, Status>>;

/// A call.
pub(super) enum Request {
    Begin { milliseconds: i64, answer: Answer<()> },
    Step { answer: Answer<i32> },
    Find { name: String, answer: Answer<()> },
    Listen { name: String, messages: Messages, answer: Answer<()> },
    Cut { injected: String, target: String, messages: Messages, answer: Answer<()> },
    Publish { name: String, data: RosMessage, answer: Answer<()> },
}

/// Somebody who hears a topic.
struct Subscriber {
    /// The simulator's name of the topic.
    topic: String,
    messages: Messages,
    /// The name under which messages are published in place of those of the topic, if it is cut.
    injected: Option<String>,
}

/// The simulator of a run, if one has begun, and who hears it.
pub(super) struct World<S, F> {
    names: WireNames,
    seed: u64,
    start: F,
    run: Option<Hosted<S>>,
    ended: bool,
    subscribers: Vec<Subscriber>,
    /// What was published before the first step, for who subscribes until then.
    initial: BTreeMap<String, Vec<Value>>,
}

impl<S: Simulator, F: FnMut(&Setup, &mut Bus<'_>) -> Result<S, SimulatorError>> World<S, F> {
    pub(super) fn new(names: WireNames, seed: u64, start: F) -> Self {
        let (subscribers, initial) = (Vec::new(), BTreeMap::new());
        World { names, seed, start, run: None, ended: false, subscribers, initial }
    }

    /// Answers calls until no caller is left. A caller may have given up before the answer.
    pub(super) fn serve(&mut self, requests: &Receiver<Request>) {
        while let Ok(request) = requests.recv() {
            match request {
                Request::Begin { milliseconds, answer } => drop(answer.send(self.begin(milliseconds))),
                Request::Step { answer } => drop(answer.send(self.step())),
                Request::Find { name, answer } => drop(answer.send(self.find(&name).map(drop))),
                Request::Listen { name, messages, answer } => drop(answer.send(self.listen(&name, messages, None))),
                Request::Cut { injected, target, messages, answer } => {
                    drop(answer.send(self.listen(&target, messages, Some(injected))));
                }
                Request::Publish { name, data, answer } => drop(answer.send(self.publish(&name, &data))),
            }
        }
    }

    fn begin(&mut self, milliseconds: i64) -> Result<(), Status> {
        let step = milliseconds.checked_mul(1_000_000).filter(|nanoseconds| *nanoseconds > 0);
        let Some(step) = step else {
            return Err(Status::invalid_argument(format!("{milliseconds} ms is not a valid step length")));
        };
        let setup = Setup::new(self.seed, SimTime::from_nanos(step));
        self.run = None;
        let mut run = Hosted::start(&setup, &mut self.start).map_err(|error| Status::failed_precondition(error.0))?;
        self.ended = false;
        self.initial.clear();
        for Message { topic, value } in run.take() {
            let kept = self.initial.entry(topic).or_default();
            if kept.len() < KEPT {
                kept.push(value);
            }
        }
        self.run = Some(run);
        Ok(())
    }

    fn running(&mut self) -> Result<&mut Hosted<S>, Status> {
        self.run.as_mut().ok_or_else(|| Status::failed_precondition("no run has begun: set the length of a step"))
    }

    fn step(&mut self) -> Result<i32, Status> {
        if self.ended {
            return Ok(-1);
        }
        self.subscribers.retain(|subscriber| !subscriber.messages.is_closed());
        let cut: Vec<String> = self
            .subscribers
            .iter()
            .filter(|subscriber| subscriber.injected.is_some())
            .map(|subscriber| subscriber.topic.clone())
            .collect();
        let run = self.running()?;
        let topics: Vec<String> = run.topics().map(str::to_owned).collect();
        for topic in &topics {
            run.cut(topic, cut.contains(topic));
        }
        let progress = run.step().map_err(|error| Status::internal(error.0))?;
        let (now, published) = (run.now(), run.take());
        self.initial.clear();
        for Message { topic, value } in &published {
            self.send(topic, value, now)?;
        }
        self.ended = progress == Progress::Ended;
        Ok(if self.ended { -1 } else { 0 })
    }

    /// Sends a message to all who hear its topic. The stream of whoever does not keep up ends.
    fn send(&mut self, topic: &str, value: &Value, now: SimTime) -> Result<(), Status> {
        if self.subscribers.iter().all(|subscriber| subscriber.topic != topic) {
            return Ok(());
        }
        let message = written(topic, value, now)?;
        self.subscribers.retain(|subscriber| {
            subscriber.topic != topic || subscriber.messages.try_send(Ok(message.clone())).is_ok()
        });
        Ok(())
    }

    /// The simulator's name of a topic.
    fn find(&mut self, name: &str) -> Result<String, Status> {
        let names = self.names.clone();
        let run = self.running()?;
        let found = run.topics().find(|topic| names.cut(topic) == name || names.heard(topic) == name);
        found.map(str::to_owned).ok_or_else(|| Status::not_found(format!("there is no topic `{name}`")))
    }

    fn listen(&mut self, name: &str, messages: Messages, injected: Option<String>) -> Result<(), Status> {
        let topic = self.find(name)?;
        self.subscribers.retain(|subscriber| !subscriber.messages.is_closed());
        if self.subscribers.len() >= SUBSCRIBERS {
            return Err(Status::resource_exhausted(format!("there are {SUBSCRIBERS} subscribers already")));
        }
        if let Some(injected) = &injected {
            let taken = |subscriber: &Subscriber| {
                subscriber.injected.is_some()
                    && (subscriber.topic == topic || subscriber.injected.as_ref() == Some(injected))
            };
            if self.subscribers.iter().any(taken) {
                return Err(Status::already_exists(format!("`{name}` is cut already, or `{injected}` is in use")));
            }
        }
        for value in self.initial.remove(&topic).unwrap_or_default() {
            let message = written(&topic, &value, SimTime::ZERO)?;
            messages.try_send(Ok(message)).map_err(|_| Status::cancelled("the subscriber is gone"))?;
        }
        self.subscribers.push(Subscriber { topic, messages, injected });
        Ok(())
    }

    /// Delivers a message to a topic that is cut, or publishes one where nothing is cut.
    fn publish(&mut self, name: &str, data: &RosMessage) -> Result<(), Status> {
        let cut = self
            .subscribers
            .iter()
            .find(|subscriber| subscriber.injected.as_deref() == Some(name))
            .map(|subscriber| subscriber.topic.clone());
        let topic = match cut {
            Some(topic) => topic,
            None => self.find(name)?,
        };
        let run = self.running()?;
        // JSON does not say of which kind a value is, and nor does a text: the simulator's own values do.
        let Some(latest) = run.latest(&topic) else {
            let problem = format!("`{name}`: nothing was published there yet, so nobody knows what its messages are");
            return Err(Status::failed_precondition(problem));
        };
        let value = ros::read(&ExpectedType::of_value(latest), data)
            .map_err(|mismatch| Status::invalid_argument(format!("a message on `{name}` does not fit: {mismatch}")))?;
        run.deliver(&topic, value);
        Ok(())
    }
}

fn written(topic: &str, value: &Value, now: SimTime) -> Result<RosMessage, Status> {
    let kind = match value {
        Value::Record(_) => "MESSAGE",
        Value::Point(_) => "Point",
        _ => "STRING",
    };
    let now = u64::try_from(now.nanos()).unwrap_or_default();
    ros::message(value, kind, now)
        .map_err(|mismatch| Status::internal(format!("a message on `{topic}` cannot be written: {mismatch}")))
}
