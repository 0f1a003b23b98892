//! The transport with a simulator of version 2.

use sesame_base::time::SimTime;
use sesame_plan::testing::{field, message, topic};
use sesame_plan::{CampaignPlan, MessageId, SimlogVersion, Transport, Type};
use sesame_relay::transport::{Fault, TransportError};
use sesame_relay::value::Value;

use crate::peer::Peer;
use crate::recorder::{Change, Recorder, STEP, plan, run, settles, transport};

const REAL: Type = Type::Real { unit: None };
const INT: Type = Type::Int { unit: None };
const POINT: Type = Type::Point { unit: None };
const STEPS: u32 = 500;

fn of(id: u32) -> Type {
    Type::Message { id: MessageId(id) }
}

fn list(of: Type) -> Type {
    Type::List { of: Box::new(of) }
}

/// All that the simulator publishes every step, except for what is JSON of the space's own.
fn everything(url: &str) -> CampaignPlan {
    let topics = [
        ("joint", REAL),
        ("cart", Type::Text),
        ("point", POINT),
        ("stamped", of(2)),
        ("turn", of(3)),
        ("trajectory_point", of(4)),
        ("trajectory", of(5)),
        ("clock", of(1)),
        ("safetyzones/Z1", of(6)),
        ("command", of(7)),
        ("state", of(8)),
    ];
    let mut plan = plan(url, SimlogVersion::V2, &topics);
    plan.messages = vec![
        message("Time", vec![field("sec", INT), field("nsec", INT)]),
        message("Header", vec![field("seq", INT), field("stamp", of(0)), field("frame_id", Type::Text)]),
        message("PointStamped", vec![field("header", of(1)), field("point", POINT)]),
        message("Quaternion", ["x", "y", "z", "w"].map(|name| field(name, REAL)).to_vec()),
        message("JointTrajectoryPoint", vec![field("positions", list(REAL))]),
        message("JointTrajectory", vec![field("joint_names", list(Type::Text)), field("points", list(of(4)))]),
        message("SafetyZone", vec![field("zone", Type::Text), field("level", REAL), field("object2", Type::Text)]),
        message("SafetyZoneCmd", vec![field("cmd", Type::Text)]),
        message("State", vec![field("t", REAL), field("tags", list(Type::Text))]),
    ];
    plan
}

const UNDISTURBED: Change = |_, value| Some(value);

/// Adds a half to the target of the joint.
const BIASED: Change = |path, value| match value {
    Value::Real(x) if path == "joint" => Some(Value::Real(x + 0.5)),
    other => Some(other),
};

fn near(found: &[f64], expected: impl Iterator<Item = f64>) {
    for (at, (found, expected)) in found.iter().zip(expected).enumerate() {
        let tolerance = 1e-5 * expected.abs().max(1.0);
        assert!((found - expected).abs() < tolerance, "message {at} is {found}, not {expected}");
    }
}

fn times() -> impl Iterator<Item = f64> + Clone {
    (1..=STEPS).map(|step| f64::from(step) * 0.02)
}

/// Five hundred steps with a message of each kind in each of them.
fn five_hundred_steps(arguments: &[&str]) {
    let Some(peer) = Peer::start("simulator2.py", arguments) else { return };
    let plan = everything(&peer.url());
    let (mut transport, mut relay) = (transport(&plan), Recorder::new(&plan, BIASED));
    assert_eq!(run(transport.as_mut(), STEPS, &mut relay), Ok(STEPS));
    assert_eq!(relay.subscribed, ["joint"], "nobody hears the relay where nothing is cut");
    for topic in &plan.topics {
        let heard = relay.of(&topic.name);
        let wanted: Vec<SimTime> =
            (1..=STEPS).map(|step| SimTime::from_nanos(STEP.nanos() * i64::from(step))).collect();
        let found: Vec<SimTime> = heard.iter().map(|(time, _)| *time).collect();
        assert_eq!(found, wanted, "`{}` has one message in each step", topic.name);
    }
    near(&relay.numbers("joint", &[]), times().map(f64::sin));
    near(&relay.numbers("point", &["x"]), times());
    near(&relay.numbers("stamped", &["point", "y"]), times().map(f64::cos));
    near(&relay.numbers("stamped", &["header", "seq"]), (1..=STEPS).map(f64::from));
    near(&relay.numbers("turn", &["z"]), times().map(f64::sin));
    near(&relay.numbers("clock", &["stamp", "nsec"]), times().map(|t| (t.fract() * 1e9).round() % 1e9));
    near(&relay.numbers("safetyzones/Z1", &["level"]), times().map(|t| 300.0 - t));
    near(&relay.numbers("state", &["t"]), times());
    let (_, last) = relay.of("command").last().expect("there are messages");
    assert_eq!(last.at(&["cmd"]), Some(&Value::from("stop")));
    let (_, last) = relay.of("trajectory").last().expect("there are messages");
    let Some(Value::List(points)) = last.at(&["points"]) else { panic!("a trajectory has points") };
    let Some(Value::List(positions)) = points[1].at(&["positions"]) else { panic!("a point has positions") };
    assert_eq!(positions, &[Value::Real(10.0), Value::Real(20.0)]);
    // The cart hears what was disturbed, one step later: so it says it two steps after the first target.
    let said: Vec<&Value> = relay.of("cart").iter().map(|(_, value)| value).collect();
    assert_eq!(said[0], &Value::from("none"));
    let said: Vec<f64> = said[1..].iter().map(|value| text(value).parse().expect("it is a number")).collect();
    near(&said, times().map(|t| t.sin() + 0.5));
    assert_eq!(transport.incidents().notes, [""; 0]);
}

fn text(value: &Value) -> &str {
    let Value::Text(text) = value else { panic!("{value:?} is not text") };
    text
}

#[test]
fn messages_of_all_kinds_pass_in_every_step() {
    five_hundred_steps(&["--eager"]);
}

#[test]
fn a_simulator_that_acknowledges_late_is_waited_for() {
    five_hundred_steps(&[]);
}

#[test]
fn topics_without_a_declared_count_are_given_time() {
    let Some(peer) = Peer::start("simulator2.py", &[]) else { return };
    let mut plan = plan(&peer.url(), SimlogVersion::V2, &[("joint", REAL)]);
    plan.topics.push(topic("seldom", &["seldom"], INT));
    settles(&mut plan, 300);
    let (mut transport, mut relay) = (transport(&plan), Recorder::new(&plan, UNDISTURBED));
    assert_eq!(run(transport.as_mut(), 30, &mut relay), Ok(30));
    let expected: Vec<(SimTime, Value)> =
        (1..=3).map(|n| (SimTime::from_nanos(STEP.nanos() * 10 * n), Value::Int(10 * n))).collect();
    assert_eq!(relay.of("seldom"), expected);
}

#[test]
fn the_simulation_may_end() {
    let Some(peer) = Peer::start("simulator2.py", &["--end-at", "7"]) else { return };
    let plan = plan(&peer.url(), SimlogVersion::V2, &[("joint", REAL)]);
    let (mut transport, mut relay) = (transport(&plan), Recorder::new(&plan, UNDISTURBED));
    assert_eq!(run(transport.as_mut(), 100, &mut relay), Ok(7));
    assert_eq!(relay.of("joint").len(), 7, "the last step counts");
    let mut again = Recorder::new(&plan, UNDISTURBED);
    assert_eq!(run(transport.as_mut(), 100, &mut again), Ok(7), "a new run begins anew");
    assert_eq!(again.of("joint"), relay.of("joint"), "equal runs are equal");
}

#[test]
fn a_run_that_does_not_begin_anew_is_refused() {
    let Some(peer) = Peer::start("simulator2.py", &["--goes-on"]) else { return };
    let plan = plan(&peer.url(), SimlogVersion::V2, &[("joint", REAL)]);
    let mut transport = transport(&plan);
    assert_eq!(run(transport.as_mut(), 10, &mut Recorder::new(&plan, UNDISTURBED)), Ok(10));
    let refused = run(transport.as_mut(), 10, &mut Recorder::new(&plan, UNDISTURBED)).unwrap_err().to_string();
    assert!(refused.contains("did not begin anew") && refused.contains("0.200 s"), "{refused}");
}

#[test]
fn what_is_not_of_its_type_is_an_error() {
    let Some(peer) = Peer::start("simulator2.py", &["--malformed"]) else { return };
    let plan = plan(&peer.url(), SimlogVersion::V2, &[("joint", REAL), ("point", POINT)]);
    let run = run(transport(&plan).as_mut(), 10, &mut Recorder::new(&plan, UNDISTURBED));
    let Err(TransportError::WrongType { path, reason }) = run else { panic!("{run:?}") };
    assert_eq!(path, "point");
    assert!(reason.contains("expected JSON, found text") && reason.contains("topic `point`"), "{reason}");
}

#[test]
fn a_lost_simulator_is_named() {
    let Some(peer) = Peer::start("simulator2.py", &["--die-at", "5"]) else { return };
    let plan = plan(&peer.url(), SimlogVersion::V2, &[("joint", REAL)]);
    let mut relay = Recorder::new(&plan, UNDISTURBED);
    let lost = run(transport(&plan).as_mut(), 10, &mut relay).unwrap_err();
    assert_eq!(lost.fault(), Fault::Disconnect, "{lost}");
    assert!(lost.to_string().contains(&peer.url()), "{lost}");
    assert_eq!(relay.of("joint").len(), 4);
}

#[test]
fn operations_of_the_plan_cut_their_topics() {
    let Some(peer) = Peer::start("simulator2.py", &[]) else { return };
    let mut plan = plan(&peer.url(), SimlogVersion::V2, &[("joint", REAL), ("cart", Type::Text)]);
    let Transport::Simlog(simlog) = &mut plan.simulator.transport else { panic!("it speaks SimlogAPI") };
    simlog.cut.clear();
    let operation = sesame_plan::testing::operation(0, sesame_plan::OperationKind::Blackhole);
    plan.operations = vec![operation];
    let dropped = |path: &str, value| (path != "joint").then_some(value);
    let (mut transport, mut relay) = (transport(&plan), Recorder::new(&plan, dropped));
    assert_eq!(run(transport.as_mut(), 10, &mut relay), Ok(10));
    assert_eq!(relay.of("joint").len(), 10);
    assert!(relay.of("cart").iter().all(|(_, said)| text(said) == "none"), "nothing has reached the cart");
}
