//! The transport with a simulator of version 3.

use sesame_plan::testing::{field, message};
use sesame_plan::{CampaignPlan, MessageId, SimlogVersion, Type};
use sesame_relay::transport::{Fault, TransportError};
use sesame_relay::value::Value;

use crate::peer::Peer;
use crate::recorder::{Change, Recorder, plan, run, transport};

const REAL: Type = Type::Real { unit: None };
const STEPS: u32 = 500;

fn cell(peer: &Peer) -> CampaignPlan {
    let zone = Type::Message { id: MessageId(0) };
    let mut plan = plan(&peer.url(), SimlogVersion::V3, &[("joint", REAL), ("cart", REAL), ("zone", zone)]);
    let fields = [("zone", Type::Text), ("level", REAL), ("near", Type::Bool), ("at", Type::Point { unit: None })];
    plan.messages = vec![message("Zone", fields.map(|(name, ty)| field(name, ty)).to_vec())];
    plan
}

const DOUBLED: Change = |path, value| match value {
    Value::Real(x) if path == "joint" => Some(Value::Real(2.0 * x)),
    other => Some(other),
};

#[test]
fn messages_pass_in_every_step() {
    let Some(peer) = Peer::start("simulator3.py", &[]) else { return };
    let plan = cell(&peer);
    let (mut transport, mut relay) = (transport(&plan), Recorder::new(&plan, DOUBLED));
    assert_eq!(run(transport.as_mut(), STEPS, &mut relay), Ok(STEPS));
    let times: Vec<f64> = (1..=STEPS).map(|step| f64::from(step) * 0.02).collect();
    let (joint, cart) = (relay.numbers("joint", &[]), relay.numbers("cart", &[]));
    assert_eq!([joint.len(), cart.len(), relay.of("zone").len()], [500; 3]);
    for (at, t) in times.iter().enumerate() {
        assert!((joint[at] - t.sin()).abs() < 1e-9, "joint {at} is {}", joint[at]);
        assert_eq!(cart.get(at + 1).copied().unwrap_or(2.0 * joint[at]), 2.0 * joint[at], "cart {at}");
    }
    let (_, last) = relay.of("zone").last().expect("there are messages");
    assert_eq!(last.number_at(&["level"]), Some(290.0));
    assert_eq!(last.at(&["near"]), Some(&Value::Bool(true)));
    assert_eq!(last.at(&["at"]), Some(&Value::Point([10.0, 0.0, 1.0])));
}

#[test]
fn the_simulation_may_end() {
    let Some(peer) = Peer::start("simulator3.py", &["--end-at", "7"]) else { return };
    let plan = cell(&peer);
    let mut relay = Recorder::new(&plan, DOUBLED);
    assert_eq!(run(transport(&plan).as_mut(), 100, &mut relay), Ok(7));
    assert_eq!(relay.of("joint").len(), 7);
}

#[test]
fn a_clock_that_goes_back_is_an_error() {
    let Some(peer) = Peer::start("simulator3.py", &["--back-at", "5"]) else { return };
    let plan = cell(&peer);
    let back = run(transport(&plan).as_mut(), 100, &mut Recorder::new(&plan, DOUBLED)).unwrap_err();
    assert_eq!(back.fault(), Fault::WrongClock, "{back}");
}

#[test]
fn a_topic_that_is_not_there_is_named() {
    let Some(peer) = Peer::start("simulator3.py", &[]) else { return };
    let plan = plan(&peer.url(), SimlogVersion::V3, &[("joint", REAL), ("carts", REAL)]);
    let refused = run(transport(&plan).as_mut(), 10, &mut Recorder::new(&plan, DOUBLED));
    let Err(TransportError::Wiring(said)) = refused else { panic!("{refused:?}") };
    assert!(said.contains("no topic `SIM://carts/out`"), "{said}");
}
