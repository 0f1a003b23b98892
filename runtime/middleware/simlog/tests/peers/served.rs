//! A simulator of ours, served and driven over version 2.

use std::net::SocketAddr;
use std::sync::mpsc;
use std::time::Duration;

use sesame_base::observation::Outcome;
use sesame_plan::testing::{field, latency, message, metric, operation, test_of, use_of};
use sesame_plan::{
    Choice, Distribution, Drain, FieldRef, MessageId, MetricSource, OperationKind, SimlogVersion, TopicId, Type,
};
use sesame_relay::evaluate::{Custom, evaluate};
use sesame_relay::message::record;
use sesame_relay::metric::MetricTable;
use sesame_relay::simulator::{Bus, Port, Progress, Setup, Simulator, SimulatorError};
use sesame_relay::value::Value;
use sesame_relay::wire::WireTable;
use sesame_simlog::client::{Client, ClientOptions};
use sesame_simlog::server;

use crate::recorder::{Change, Recorder, plan, run, transport};

const REAL: Type = Type::Real { unit: None };

/// A controller, and a cart that moves by what it hears until it has arrived.
struct Cart {
    target: Port,
    state: Port,
    zone: Port,
    at: f64,
}

impl Simulator for Cart {
    fn start(setup: &Setup, bus: &mut Bus<'_>) -> Result<Self, SimulatorError> {
        if setup.step.nanos() > 1_000_000_000 {
            return Err(SimulatorError("steps are too long".to_owned()));
        }
        let [target, state, zone] = ["joint", "cart", "safetyzones/Z1"].map(|path| bus.open(path));
        bus.subscribe(target);
        bus.publish(state, [-1.0, 0.0, 0.0]);
        Ok(Cart { target, state, zone, at: 0.0 })
    }

    fn step(&mut self, bus: &mut Bus<'_>) -> Result<Progress, SimulatorError> {
        bus.publish(self.target, 0.5);
        while let Some(heard) = bus.receive(self.target) {
            self.at += heard.number_at::<&str>(&[]).unwrap_or(f64::NAN);
        }
        bus.publish(self.state, [self.at, bus.now().seconds(), 0.0]);
        let fields =
            [("zone", "Z1".into()), ("level", Value::Real(self.at)), ("object1", "a".into()), ("object2", "b".into())];
        bus.publish(self.zone, record(&fields));
        Ok(if self.at >= 100.0 { Progress::Ended } else { Progress::Running })
    }
}

fn served(options: server::ServerOptions) -> SocketAddr {
    let (sender, receiver) = mpsc::channel();
    // It serves until the test's process ends.
    std::thread::spawn(move || {
        server::serve(&options, |address| sender.send(address).expect("it is awaited"), Cart::start)
    });
    receiver.recv_timeout(Duration::from_secs(120)).expect("it listens")
}

fn anywhere() -> server::ServerOptions {
    server::ServerOptions::new(([127, 0, 0, 1], 0).into())
}

const DOUBLED: Change = |path, value| match value {
    Value::Real(x) if path == "joint" => Some(Value::Real(2.0 * x)),
    other => Some(other),
};

#[test]
fn a_simulator_of_ours_is_disturbed_over_the_protocol() {
    let url = format!("http://{}", served(anywhere()));
    let zone = Type::Message { id: MessageId(0) };
    let topics = [("joint", REAL), ("cart", Type::Point { unit: None }), ("safetyzones/Z1", zone)];
    let mut plan = plan(&url, SimlogVersion::V2, &topics);
    plan.messages = vec![message("SafetyZone", vec![field("zone", Type::Text), field("level", REAL)])];
    let mut transport = transport(&plan);
    let mut first = Recorder::new(&plan, DOUBLED);
    // What is delivered arrives a step later, and twice as large: one more in each step after the first.
    assert_eq!(run(transport.as_mut(), 500, &mut first), Ok(101));
    let positions = first.numbers("cart", &["x"]);
    let expected: Vec<f64> = std::iter::once(-1.0).chain((0..=100).map(f64::from)).collect();
    assert_eq!(positions, expected, "at the start, and in each step");
    assert_eq!(first.numbers("safetyzones/Z1", &["level"]), expected[1..]);
    assert_eq!(first.of("cart")[0].0.nanos(), 0);
    let mut second = Recorder::new(&plan, DOUBLED);
    assert_eq!(run(transport.as_mut(), 500, &mut second), Ok(101), "each run begins anew");
    assert_eq!(first.published, second.published);
    assert_eq!(transport.incidents().notes, [""; 0]);
}

/// Whole runs with operations: the relay is the real one.
#[test]
fn operations_act_on_messages_of_the_protocol() {
    let url = format!("http://{}", served(anywhere()));
    let mut plan = plan(&url, SimlogVersion::V2, &[("joint", REAL), ("cart", Type::Point { unit: None })]);
    let latency = latency(Distribution::Fixed, Drain::Finish);
    plan.operations = vec![operation(0, OperationKind::Bias), operation(0, latency)];
    plan.campaign.end_after = 1.0;
    let state = FieldRef { topic: TopicId(1), path: vec!["x".to_owned()] };
    plan.metrics = vec![metric("position", MetricSource::Last { input: state })];
    let wires = WireTable::new(&plan);
    let metrics = MetricTable::new(&plan, &wires, &[]).expect("they are sound");
    let mut transport = transport(&plan);
    let mut evaluated = |operations| {
        let test = test_of(operations);
        evaluate(&plan, &wires, &metrics, transport.as_mut(), &test, 1, &mut Custom::none()).expect("it fits the plan")
    };
    let value = |value| vec![Choice::Value { value }];
    // Fifty steps; the first message arrives in the second one, and each moves the cart by a half.
    let reference = evaluated(Vec::new());
    assert_eq!(reference.outcome, Outcome::Completed, "{reference:?}");
    assert_eq!(reference.metrics[0].value, Some(24.5));
    // The messages of 0.2 s to 0.4 s are larger by a quarter: of ten steps.
    let biased = evaluated(vec![use_of(0, 0.2, 0.4, value(0.25), 1)]);
    assert_eq!((biased.metrics[0].value, biased.operations[0].counters.changed), (Some(27.0), 10));
    // All before the last one are later by 0.1 s: that of 0.9 s is due at the end of the last step, and arrives in it.
    let late = evaluated(vec![use_of(1, 0.0, 1.0, value(0.1), 1)]);
    assert_eq!((late.metrics[0].value, late.operations[0].counters.delayed), (Some(22.5), 49));
    assert_eq!(evaluated(vec![use_of(1, 0.0, 1.0, value(0.1), 1)]).metrics, late.metrics, "equal tests are equal");
}

#[test]
fn whoever_has_no_token_is_refused() {
    let address = served(server::ServerOptions { token: Some("secret".to_owned()), ..anywhere() });
    let asked = |token: Option<&str>| {
        let url = format!("http://{address}");
        let token = token.map(str::to_owned);
        let mut client = Client::connect(&ClientOptions { token, ..ClientOptions::new(&url, SimlogVersion::V2) })?;
        client.set_step(20)
    };
    assert_eq!(asked(Some("secret")), Ok(()));
    for wrong in [None, Some("Secret")] {
        let refused = asked(wrong).unwrap_err().to_string();
        assert!(refused.contains("does not carry the token"), "{refused}");
    }
}

#[test]
fn other_machines_need_a_token() {
    for token in [None, Some(String::new())] {
        let options = server::ServerOptions { token, ..server::ServerOptions::new(([0, 0, 0, 0], 0).into()) };
        let refused = server::serve(&options, |_| panic!("nobody may listen"), Cart::start).unwrap_err();
        assert!(refused.to_string().contains("needs a token"), "{refused}");
    }
}

#[test]
fn what_cannot_be_done_is_said() {
    let url = format!("http://{}", served(anywhere()));
    let mut client = Client::connect(&ClientOptions::new(&url, SimlogVersion::V2)).expect("it listens");
    let said = client.step().unwrap_err().to_string();
    assert!(said.contains("no run has begun"), "{said}");
    for (milliseconds, why) in
        [(0, "not a valid step length"), (-5, "not a valid step length"), (5000, "steps are too long")]
    {
        let said = client.set_step(milliseconds).unwrap_err().to_string();
        assert!(said.contains(why), "{said}");
    }
    client.set_step(20).expect("that is a length");
    client.listen("carts/in", "").expect("it is asked for only");
    let said = client.await_streams(Duration::from_secs(120)).unwrap_err().to_string();
    assert!(said.contains("no topic `carts/in`"), "{said}");
}
