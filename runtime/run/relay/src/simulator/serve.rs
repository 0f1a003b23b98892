//! A simulator in Rust as a program of its own: it is served on standard input and output, in the protocol of
//! `docs/process.md`.
//!
//! A runner reaches it as it reaches a program in any other language, in a process of its own: a lab's stand-in, or a
//! simulator that must not take the runner down with it. Its runs are those that it has inside a runner: what is
//! published before the simulator receives something passes through the relay in the same order and at the same time.

use std::collections::{BTreeMap, VecDeque};
use std::io::{self, BufRead, Read as _, Write};

use serde::Deserialize;
use serde_json::value::RawValue;

use sesame_base::time::SimTime;

use crate::json;
use crate::simulator::{Bus, Offered, OrderToNode, Port, Progress, Setup, Simulator, SimulatorError, Wires};
use crate::value::{Fields, Record, Value};

/// The longest line that is read, in bytes; the runner's own limit.
const LINE_LIMIT: u64 = 16 << 20;

/// Serves a simulator to a runner on the two streams, which for a program are its standard input and output, until the
/// input ends. Anything else that the program says belongs on standard error. An error means that a stream failed, or
/// that the other side is not a runner. `start` makes the simulator of each run; most often it is [`Simulator::start`].
///
/// ```no_run
/// # use sesame_relay::simulator::{Simulator, serve};
/// # fn main_of<Cell: Simulator>() -> std::io::Result<()> {
/// serve(std::io::stdin().lock(), std::io::stdout().lock(), Cell::start)
/// # }
/// ```
pub fn serve<S: Simulator>(
    input: impl BufRead,
    output: impl Write,
    mut start: impl FnMut(&Setup, &mut Bus<'_>) -> Result<S, SimulatorError>,
) -> io::Result<()> {
    let mut lines = Lines { input, output, line: String::new() };
    let mut world: Option<World<S>> = None;
    while let Some(request) = lines.next()? {
        match request {
            Request::Reset(reset) => {
                let setup = Setup::new(reset.seed, SimTime::from_seconds(reset.step));
                let setup = setup.with_parameters(reset.parameters);
                world = match World::start(&setup, &mut start, &mut lines)? {
                    Ok(started) => Some(started),
                    Err(error) => {
                        lines.answer(&failed(&error))?;
                        None
                    }
                };
            }
            Request::Step(step) => {
                let Some(running) = &mut world else { return Err(wrong("a step before a reset")) };
                if let Err(error) = running.step(step, &mut lines)? {
                    lines.answer(&failed(&error))?;
                    world = None;
                }
            }
            Request::Deliver(_) => return Err(wrong("messages that nothing was published for")),
        }
    }
    Ok(())
}

/// A line of the runner.
#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
enum Request {
    Reset(Reset),
    Step(Step),
    Deliver(Vec<Message>),
}

#[derive(Deserialize)]
struct Reset {
    seed: u64,
    /// Seconds.
    step: f64,
    /// What is not as the simulator has it.
    #[serde(default)]
    parameters: BTreeMap<String, f64>,
}

#[derive(Deserialize)]
struct Step {
    #[serde(default)]
    orders: Vec<OrderToNode>,
    #[serde(default)]
    messages: Vec<Message>,
}

#[derive(Deserialize)]
struct Message {
    topic: String,
    value: Box<RawValue>,
}

fn wrong(what: impl std::fmt::Display) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, format!("the runner sent {what}"))
}

fn failed(SimulatorError(words): &SimulatorError) -> Vec<u8> {
    let mut line = b"{\"failed\":".to_vec();
    json::quoted(words, &mut line);
    line.push(b'}');
    line
}

struct Lines<R, W> {
    input: R,
    output: W,
    line: String,
}

impl<R: BufRead, W: Write> Lines<R, W> {
    /// The next request; `None` at the end of the input.
    fn next(&mut self) -> io::Result<Option<Request>> {
        self.line.clear();
        self.input.by_ref().take(LINE_LIMIT).read_line(&mut self.line)?;
        if self.line.is_empty() {
            return Ok(None);
        }
        if !self.line.ends_with('\n') && self.line.len() as u64 == LINE_LIMIT {
            return Err(wrong(format!("a line of more than {LINE_LIMIT} bytes")));
        }
        match serde_json::from_str(&self.line) {
            Ok(request) => Ok(Some(request)),
            Err(error) => Err(wrong(format!("what is not a request: {error}"))),
        }
    }

    fn answer(&mut self, line: &[u8]) -> io::Result<()> {
        self.output.write_all(line)?;
        self.output.write_all(b"\n")?;
        self.output.flush()
    }
}

/// A simulator in the middle of a run.
struct World<S> {
    simulator: S,
    topics: Topics,
    now: SimTime,
    step: SimTime,
}

impl<S: Simulator> World<S> {
    /// Starts a simulator and says so. The outer error is one of the streams.
    fn start<R: BufRead, W: Write>(
        setup: &Setup,
        start: &mut impl FnMut(&Setup, &mut Bus<'_>) -> Result<S, SimulatorError>,
        lines: &mut Lines<R, W>,
    ) -> io::Result<Result<World<S>, SimulatorError>> {
        let mut topics = Topics::default();
        // Before it is ready nothing is delivered: what it publishes now reaches its subscribers with the first step.
        let mut wires = Remote { topics: &mut topics, turn: None::<Turn<'_, R, W>> };
        let simulator = match start(setup, &mut Bus { now: SimTime::ZERO, wires: &mut wires }) {
            Ok(simulator) => simulator,
            Err(error) => return Ok(Err(error)),
        };
        let parameters = setup.asked();
        let mut line = b"{\"ready\":{\"publishes\":".to_vec();
        names(topics.opened.iter(), &mut line);
        line.extend_from_slice(b",\"subscribes\":");
        names(topics.opened.iter().filter(|topic| topic.inbox.is_some()), &mut line);
        if !parameters.is_empty() {
            line.extend_from_slice(b",\"parameters\":");
            list(parameters.iter().map(String::as_str), &mut line);
        }
        let offers = topics.nodes.offers();
        if !offers.is_empty() {
            line.extend_from_slice(b",\"nodes\":");
            line.extend(serde_json::to_vec(offers).expect("names are plain data"));
        }
        line.extend_from_slice(b",\"resets\":true,\"messages\":[");
        line.append(&mut topics.pending);
        line.extend_from_slice(b"]}}");
        lines.answer(&line)?;
        Ok(Ok(World { simulator, topics, now: SimTime::ZERO, step: setup.step }))
    }

    /// Advances by one step, with what has been ordered and delivered since the last one, and says that it is over.
    fn step<R: BufRead, W: Write>(
        &mut self,
        Step { orders, messages }: Step,
        lines: &mut Lines<R, W>,
    ) -> io::Result<Result<(), SimulatorError>> {
        for order in orders {
            self.topics.nodes.give(order);
        }
        self.topics.deliver(messages)?;
        self.now = self.now + self.step;
        let turn = Turn { lines, fault: None };
        let mut wires = Remote { topics: &mut self.topics, turn: Some(turn) };
        let progress = self.simulator.step(&mut Bus { now: self.now, wires: &mut wires });
        if let Some(fault) = wires.turn.and_then(|turn| turn.fault) {
            return Err(fault);
        }
        let ended = match progress {
            Ok(progress) => progress == Progress::Ended,
            Err(error) => return Ok(Err(error)),
        };
        let mut line = b"{\"done\":{\"messages\":[".to_vec();
        line.append(&mut self.topics.pending);
        line.extend_from_slice(format!("],\"ended\":{ended}}}}}").as_bytes());
        lines.answer(&line)?;
        Ok(Ok(()))
    }
}

fn names<'a>(topics: impl Iterator<Item = &'a Topic>, line: &mut Vec<u8>) {
    list(topics.map(|topic| topic.path.as_str()), line);
}

fn list<'a>(texts: impl Iterator<Item = &'a str>, line: &mut Vec<u8>) {
    line.push(b'[');
    for (at, text) in texts.enumerate() {
        if at > 0 {
            line.push(b',');
        }
        json::quoted(text, line);
    }
    line.push(b']');
}

/// The topics that a simulator has opened.
#[derive(Default)]
struct Topics {
    ports: BTreeMap<String, usize>,
    opened: Vec<Topic>,
    /// What was published since the runner was last told, as the items of a list in JSON.
    pending: Vec<u8>,
    nodes: Offered,
}

struct Topic {
    path: String,
    /// What has been delivered; `None` without a subscription.
    inbox: Option<VecDeque<Value>>,
    /// What was last published: JSON does not say whether `1` is a whole number.
    like: Option<Value>,
}

impl Topics {
    fn publish(&mut self, port: Port, value: Value) {
        let topic = &mut self.opened[port.0];
        if !self.pending.is_empty() {
            self.pending.push(b',');
        }
        self.pending.extend_from_slice(b"{\"topic\":");
        json::quoted(&topic.path, &mut self.pending);
        self.pending.extend_from_slice(b",\"value\":");
        json::encode(&value, &mut self.pending);
        self.pending.push(b'}');
        topic.like = Some(value);
    }

    fn deliver(&mut self, messages: Vec<Message>) -> io::Result<()> {
        for Message { topic, value } in messages {
            let Some(topic) = self.ports.get(&topic).and_then(|&port| self.opened.get_mut(port)) else { continue };
            let Some(inbox) = &mut topic.inbox else { continue };
            let read = read(topic.like.as_ref(), value.get());
            inbox.push_back(read.ok_or_else(|| wrong(format!("{value} on `{}`", topic.path)))?);
        }
        Ok(())
    }
}

/// A turn in which the runner answers what is published.
struct Turn<'a, R, W> {
    lines: &'a mut Lines<R, W>,
    fault: Option<io::Error>,
}

struct Remote<'a, 'b, R, W> {
    topics: &'a mut Topics,
    /// `None` while the runner cannot answer.
    turn: Option<Turn<'b, R, W>>,
}

impl<R: BufRead, W: Write> Remote<'_, '_, R, W> {
    /// Sends what was published through the relay, and takes what reaches subscribers.
    fn exchange(&mut self) {
        let Some(Turn { lines, fault }) = &mut self.turn else { return };
        if self.topics.pending.is_empty() || fault.is_some() {
            return;
        }
        let mut line = b"{\"publish\":[".to_vec();
        line.append(&mut self.topics.pending);
        line.extend_from_slice(b"]}");
        let answered = lines.answer(&line).and_then(|()| lines.next()).and_then(|request| match request {
            Some(Request::Deliver(messages)) => self.topics.deliver(messages),
            Some(Request::Reset(_) | Request::Step(_)) => Err(wrong("another request than `deliver`")),
            None => Err(io::ErrorKind::UnexpectedEof.into()),
        });
        *fault = answered.err();
    }
}

impl<R: BufRead, W: Write> Wires for Remote<'_, '_, R, W> {
    fn open(&mut self, path: &str) -> Port {
        let Topics { ports, opened, .. } = &mut *self.topics;
        if let Some(&port) = ports.get(path) {
            return Port(port);
        }
        ports.insert(path.to_owned(), opened.len());
        opened.push(Topic { path: path.to_owned(), inbox: None, like: None });
        Port(opened.len() - 1)
    }

    fn subscribe(&mut self, port: Port) {
        self.topics.opened[port.0].inbox.get_or_insert_default();
    }

    fn publish(&mut self, _: SimTime, port: Port, value: Value) {
        self.topics.publish(port, value);
    }

    fn receive(&mut self, port: Port) -> Option<Value> {
        self.exchange();
        self.topics.opened[port.0].inbox.as_mut()?.pop_front()
    }

    fn nodes(&mut self) -> &mut Offered {
        &mut self.topics.nodes
    }
}

/// Reads a value of the kind of another; without one, as JSON has it. `None` if it is none of this kind.
fn read(like: Option<&Value>, text: &str) -> Option<Value> {
    Some(match like {
        Some(Value::Bool(_)) => Value::Bool(serde_json::from_str(text).ok()?),
        Some(Value::Int(_)) => Value::Int(json::int(text).ok()?),
        Some(Value::Real(_)) => Value::Real(json::real(text).ok()?),
        Some(Value::Text(_)) => Value::Text(serde_json::from_str::<String>(text).ok()?.into()),
        Some(Value::Point(_)) => {
            let axes: [&RawValue; 3] = serde_json::from_str(text).ok()?;
            let mut point = [0.0; 3];
            for (axis, value) in point.iter_mut().zip(axes) {
                *axis = json::real(value.get()).ok()?;
            }
            Value::Point(point)
        }
        Some(Value::List(items)) => {
            let all: Vec<&RawValue> = serde_json::from_str(text).ok()?;
            Value::List(all.into_iter().map(|item| read(items.first(), item.get())).collect::<Option<_>>()?)
        }
        Some(Value::Record(record)) => {
            let values: BTreeMap<String, &RawValue> = serde_json::from_str(text).ok()?;
            let of = |(name, like)| read(Some(like), values.get::<str>(name)?.get());
            let fields = record.iter().map(|(name, like)| (name.as_str(), like)).map(of);
            Value::Record(Record::new(record.fields(), fields.collect::<Option<_>>()?))
        }
        Some(Value::Undeclared(_) | Value::Opaque(_)) | None => untyped(serde_json::from_str(text).ok()?)?,
    })
}

/// A value as JSON has it. There is none for `null`.
fn untyped(json: serde_json::Value) -> Option<Value> {
    Some(match json {
        serde_json::Value::Null => return None,
        serde_json::Value::Bool(truth) => Value::Bool(truth),
        serde_json::Value::Number(number) => match number.as_i64() {
            Some(whole) => Value::Int(whole),
            None => Value::Real(number.as_f64()?),
        },
        serde_json::Value::String(text) => Value::Text(text.into()),
        serde_json::Value::Array(items) => Value::List(items.into_iter().map(untyped).collect::<Option<_>>()?),
        serde_json::Value::Object(entries) => {
            let fields = Fields::new(entries.keys().map(String::as_str));
            Value::Record(Record::new(
                &fields,
                entries.into_iter().map(|(_, value)| untyped(value)).collect::<Option<_>>()?,
            ))
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulator::NodeFault;

    /// A controller and a cart that moves by what it hears, until it has arrived.
    struct Cart {
        target: Port,
        state: Port,
        at: f64,
    }

    impl Simulator for Cart {
        fn start(setup: &Setup, bus: &mut Bus<'_>) -> Result<Self, SimulatorError> {
            if setup.seed == 13 {
                return Err(SimulatorError("unlucky".to_owned()));
            }
            let (target, state) = (bus.open("cart/target"), bus.open("cart/state"));
            bus.subscribe(target);
            Ok(Cart { target, state, at: 0.0 })
        }

        fn step(&mut self, bus: &mut Bus<'_>) -> Result<Progress, SimulatorError> {
            bus.publish(self.target, 1.0);
            while let Some(message) = bus.receive(self.target) {
                let Value::Real(target) = message else { return Err(SimulatorError(format!("{message:?}"))) };
                self.at += target;
            }
            bus.publish(self.state, Value::Point([self.at, bus.now().seconds(), f64::NAN]));
            Ok(if self.at >= 3.0 { Progress::Ended } else { Progress::Running })
        }
    }

    /// What is answered to these lines, and how it ended.
    fn served(requests: &[&str]) -> (String, io::Result<()>) {
        let mut output = Vec::new();
        let ended = serve(requests.join("\n").as_bytes(), &mut output, Cart::start);
        (String::from_utf8(output).unwrap(), ended)
    }

    const RESET: &str = r#"{"reset":{"seed":1,"step":0.5,"topics":["cart/target"]}}"#;

    #[test]
    fn a_run_takes_turns_with_the_runner() {
        let (said, ended) = served(&[
            RESET,
            r#"{"step":{"time":0.5,"messages":[]}}"#,
            r#"{"deliver":[]}"#,
            r#"{"step":{"time":1.0,"messages":[{"topic":"cart/target","value":1}]}}"#,
            r#"{"deliver":[{"topic":"cart/target","value":2}, {"topic":"elsewhere","value":null}]}"#,
            RESET,
        ]);
        ended.unwrap();
        let ready = r#"{"ready":{"publishes":["cart/target","cart/state"],"subscribes":["cart/target"],"resets":true,"messages":[]}}"#;
        let publish = r#"{"publish":[{"topic":"cart/target","value":1.0}]}"#;
        let done = |at: &str, time: &str, ended: bool| {
            format!(
                "{{\"done\":{{\"messages\":[{{\"topic\":\"cart/state\",\"value\":[{at},{time},\"NaN\"]}}],\"ended\":{ended}}}}}"
            )
        };
        let expected = [ready, publish, &done("0.0", "0.5", false), publish, &done("3.0", "1.0", true), ready];
        assert_eq!(said.lines().collect::<Vec<_>>(), expected);
    }

    #[test]
    fn orders_to_nodes_come_with_their_step() {
        /// A node that says what it is told.
        struct Told(Port);

        impl Simulator for Told {
            fn start(_: &Setup, bus: &mut Bus<'_>) -> Result<Self, SimulatorError> {
                bus.offer("arm", &[NodeFault::Slow, NodeFault::Pause]);
                Ok(Told(bus.open("told")))
            }

            fn step(&mut self, bus: &mut Bus<'_>) -> Result<Progress, SimulatorError> {
                while let Some(order) = bus.order("arm") {
                    bus.publish(self.0, Value::from(format!("{order:?}").as_str()));
                }
                Ok(Progress::Running)
            }
        }

        let requests = [
            r#"{"reset":{"seed":1,"step":0.5}}"#,
            r#"{"step":{"time":0.5,"orders":[{"node":"arm","order":"pause"},{"node":"gate","order":"kill"}]}}"#,
            r#"{"step":{"time":1.0,"orders":[{"node":"arm","order":"slow","share":0.5}]}}"#,
            r#"{"step":{"time":1.5}}"#,
        ];
        let mut output = Vec::new();
        serve(requests.join("\n").as_bytes(), &mut output, Told::start).unwrap();
        let said = String::from_utf8(output).unwrap();
        let told = |what: &str| {
            format!("{{\"done\":{{\"messages\":[{{\"topic\":\"told\",\"value\":\"{what}\"}}],\"ended\":false}}}}")
        };
        let expected = [
            r#"{"ready":{"publishes":["told"],"subscribes":[],"nodes":{"arm":["pause","slow"]},"resets":true,"messages":[]}}"#,
            &told("Pause"),
            &told("Slow { share: 0.5 }"),
            r#"{"done":{"messages":[],"ended":false}}"#,
        ];
        assert_eq!(said.lines().collect::<Vec<_>>(), expected);
    }

    #[test]
    fn a_simulator_that_fails_says_why_and_can_be_reset() {
        let (said, ended) = served(&[r#"{"reset":{"seed":13,"step":0.5}}"#, RESET]);
        ended.unwrap();
        let mut lines = said.lines();
        assert_eq!(lines.next(), Some(r#"{"failed":"unlucky"}"#));
        assert!(lines.next().unwrap().starts_with(r#"{"ready""#), "{said}");
    }

    #[test]
    fn what_no_runner_sends_ends_the_program_with_a_reason() {
        let reason = |requests: &[&str]| served(requests).1.unwrap_err().to_string();
        assert_eq!(reason(&[r#"{"step":{"time":0.5}}"#]), "the runner sent a step before a reset");
        assert_eq!(reason(&[r#"{"deliver":[]}"#]), "the runner sent messages that nothing was published for");
        assert!(reason(&["hello"]).starts_with("the runner sent what is not a request: "));
        let step = r#"{"step":{"time":0.5}}"#;
        let text = r#"{"deliver":[{"topic":"cart/target","value":"far"}]}"#;
        assert_eq!(reason(&[RESET, step, text]), "the runner sent \"far\" on `cart/target`");
        assert_eq!(reason(&[RESET, step, RESET]), "the runner sent another request than `deliver`");
        assert_eq!(reason(&[RESET, step]), "unexpected end of file");
    }

    #[test]
    fn values_are_of_the_kind_that_was_published() {
        let like = |value: Value, text: &str| read(Some(&value), text);
        assert_eq!(like(Value::Real(0.5), "1"), Some(Value::Real(1.0)));
        assert_eq!(like(Value::Real(0.5), "\"Infinity\""), Some(Value::Real(f64::INFINITY)));
        assert_eq!(like(Value::Int(0), "2.0"), Some(Value::Int(2)));
        assert_eq!(like(Value::from("a"), "\"NaN\""), Some(Value::from("NaN")));
        assert_eq!(
            like(Value::List(vec![Value::Real(0.0)]), "[1, 2]"),
            read(Some(&Value::List(vec![Value::Real(9.0)])), "[1.0, 2.0]")
        );
        let fields = Fields::new(["level", "zone"]);
        let record = |level, zone| Value::Record(Record::new(&fields, vec![Value::Real(level), Value::from(zone)]));
        assert_eq!(like(record(0.0, ""), r#"{"zone":"Z1","level":3}"#), Some(record(3.0, "Z1")));
        assert_eq!(like(record(0.0, ""), r#"{"zone":"Z1"}"#), None);
        assert_eq!(read(None, "[1, 0.5]"), Some(Value::List(vec![Value::Int(1), Value::Real(0.5)])));
        assert_eq!(read(None, "null"), None);
    }
}
