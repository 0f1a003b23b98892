//! Messages between a vehicle and a ground station, with the runner between them.

use std::path::Path;
use std::time::Instant;

use sesame_patience::{LIMIT, Watch};
use sesame_plan::{CampaignPlan, Test};
use sesame_relay::metric::MetricTable;
use sesame_relay::relay::Relay;
use sesame_relay::transport::Transport;
use sesame_relay::wire::WireTable;
use sesame_tests::{Port, fresh_folder, relay_for_a_moment};
use sesamec::frontend::{Look, SESAME};

use crate::peers::{Peer, common, python};

/// How many positions a vehicle sends; with every fifth come other datagrams.
const COUNT: usize = 40;

fn space(definitions: &Path, ports: [u16; 2]) -> String {
    let [ground, vehicle] = ports;
    format!(
        "space peers\n\
         system {{\n\
           simulator air = mavlink \"udp://127.0.0.1:{ground}\" {{\n\
             types \"{}\"\n\
             proxy vehicle \"udp://127.0.0.1:{vehicle}\"\n\
           }}\n\
           message Position {{ alt: int[mm] }}\n\
           message Order {{ param2: real[m/s] }}\n\
           message Heartbeat {{ custom_mode: int }}\n\
           topic position  = \"1/GLOBAL_POSITION_INT\" : Position\n\
           topic order     = \"255/COMMAND_LONG\" : Order\n\
           topic heartbeat = \"1/1/HEARTBEAT\" : Heartbeat\n\
           node vehicle {{ publishes position, heartbeat  subscribes order }}\n\
           node station {{ publishes order  subscribes position, heartbeat }}\n\
         }}\n\
         metric disturbed minimise = fuzzing_time()\n\
         metric highest maximise default 0m = max(position.alt)\n\
         operation hole on position = blackhole\n\
         operation late on position = latency [0s, 5s]\n\
         operation lift on position.alt = bias [-1000m, 1000m]\n\
         operation hurry on order.param2 to vehicle = scale [0, 10]\n\
         operation other on heartbeat = blackhole within [50s, 60s]\n\
         test still {{ other from 59s to 60s }}\n\
         test lost {{ hole from 0s to 60s }}\n\
         test slow {{ late delay 1s from 0s to 60s }}\n\
         test changed {{ lift bias 500m from 0s to 60s  hurry factor 3 from 0s to 60s }}\n\
         campaign look {{\n\
           objectives disturbed\n\
           operations hole, late, lift, hurry, other 1..2 per test\n\
           search     random {{ evaluations 1 }}\n\
           end        after 60s\n\
         }}\n",
        definitions.display()
    )
}

fn plan(text: &str) -> CampaignPlan {
    let checked = (SESAME.check)("peers.sesame", text, Look::Short);
    assert_eq!(checked.errors, 0, "{text}\n{}", checked.diagnostics);
    checked.plans.into_iter().next().expect("there is a campaign").plan
}

/// A run of a test with both peers.
struct Run {
    vehicle: Peer,
    station: Peer,
    notes: Vec<String>,
}

/// Relays until the station has heard enough. `None` where there is no peer.
fn run(test: &str, done: impl Fn(&mut Peer, &mut Peer) -> bool) -> Option<Run> {
    let python = python()?;
    let folder = fresh_folder(&format!("mavlink-{test}"));
    let held = [Port::free_of_udp(), Port::free_of_udp()];
    let ports = [held[0].number(), held[1].number()];
    let plan = plan(&space(&common(&python), ports));
    let test: Test = plan.tests.iter().find(|known| known.name == test).expect("the test is there").test.clone();
    let addresses = ports.map(|port| format!("127.0.0.1:{port}"));
    let mut station = Peer::start(&python, &["ground", &addresses[0]]);
    let mut vehicle = Peer::start(&python, &["vehicle", &addresses[1], &COUNT.to_string()]);
    let mut transport: Box<dyn Transport> = sesame_mavlink::mavlink(folder).transport(&plan);
    let wires = WireTable::new(&plan);
    let metrics = MetricTable::new(&plan, &wires, &[]).expect("the metrics need no hooks");
    let mut relay = Relay::new(&plan, &wires, &test, metrics.start(), &[]).expect("the test fits the plan");
    let watch = Watch::over("the runner");
    relay.begin();
    transport.reset(1, &mut relay).unwrap_or_else(|error| panic!("{error}"));
    vehicle.go();
    let limit = Instant::now() + 3 * LIMIT;
    while !done(&mut vehicle, &mut station) {
        watch.goes_on();
        assert!(Instant::now() < limit, "nothing came of it: {:?}", transport.incidents().notes);
        relay_for_a_moment(&mut *transport, &mut relay).unwrap_or_else(|error| panic!("{error}"));
    }
    let notes = transport.incidents().notes;
    transport.close();
    Some(Run { vehicle, station, notes })
}

/// Whether all positions and the orders that answer them have come.
fn all_has_come(vehicle: &mut Peer, station: &mut Peer) -> bool {
    station.count("GLOBAL_POSITION_INT") == COUNT && vehicle.count("COMMAND_LONG") == COUNT
}

/// Whether a datagram is a position of version 2.
fn is_position(hex: &str) -> bool {
    hex.starts_with("fd") && &hex[14..20] == "210000"
}

/// Datagrams without their times.
fn hex(datagrams: Vec<(String, f64)>) -> Vec<String> {
    datagrams.into_iter().map(|(hex, _)| hex).collect()
}

#[test]
fn what_nothing_acts_on_arrives_bit_for_bit_in_its_order() {
    let Some(Run { mut vehicle, mut station, notes }) = run("still", all_has_come) else { return };
    let (sent, mut came) = (hex(vehicle.datagrams("sent")), hex(station.datagrams("came")));
    // Before it begins, the vehicle only says that it is there.
    let begin = came.iter().position(|datagram| *datagram == sent[0]).expect("the first one arrives");
    came.drain(..begin);
    // Two messages in one datagram are two datagrams if the relay has to look at them.
    assert_eq!(came.concat(), sent.concat());
    assert!(came.len() > sent.len());
    assert_eq!(hex(vehicle.datagrams("came")), hex(station.datagrams("sent")));
    assert_eq!(notes.len(), 1, "{notes:?}");
    assert!(notes[0].contains("messages on `1/1/HEARTBEAT` are signed"), "{notes:?}");
}

#[test]
fn changed_messages_are_accepted_with_their_numbers() {
    let Some(Run { mut vehicle, mut station, .. }) = run("changed", all_has_come) else { return };
    let heights = station.values("GLOBAL_POSITION_INT", "alt");
    let wanted = (0..COUNT).map(|number| 1000.0 * number as f64 + 500_000.0);
    assert_eq!(heights.iter().map(|(alt, _)| *alt).collect::<Vec<f64>>(), wanted.collect::<Vec<f64>>());
    let mut sent = vehicle.datagrams("sent");
    sent.retain(|(hex, _)| is_position(hex));
    let numbers: Vec<u64> = sent.iter().map(|(hex, _)| u64::from_str_radix(&hex[8..10], 16).unwrap()).collect();
    assert_eq!(heights.iter().map(|(_, number)| *number).collect::<Vec<u64>>(), numbers);
    // The station orders what it has heard, and the vehicle hears three times that.
    let speeds: Vec<f64> = vehicle.values("COMMAND_LONG", "param2").iter().map(|(speed, _)| *speed).collect();
    assert_eq!(speeds, (0..COUNT).map(|number| 3.0 * (number as f64 + 500.0)).collect::<Vec<f64>>());
}

#[test]
fn lost_messages_do_not_arrive_and_others_do() {
    // The last datagram of each group between the positions: `no message`.
    let no_message = "6e6f206d657373616765";
    let all_sent = |_: &mut Peer, station: &mut Peer| {
        hex(station.datagrams("came")).iter().filter(|datagram| *datagram == no_message).count() == COUNT / 5
    };
    let Some(Run { mut station, .. }) = run("lost", all_sent) else { return };
    assert_eq!(station.count("GLOBAL_POSITION_INT"), 0);
    assert!(station.count("HEARTBEAT") > COUNT / 5);
}

#[test]
fn late_messages_arrive_later() {
    let everything = |_: &mut Peer, station: &mut Peer| station.count("GLOBAL_POSITION_INT") == COUNT;
    let Some(Run { mut vehicle, mut station, .. }) = run("slow", everything) else { return };
    let came = station.datagrams("came");
    let mut sent = vehicle.datagrams("sent");
    sent.retain(|(hex, _)| is_position(hex));
    assert_eq!(sent.len(), COUNT);
    for (hex, at) in sent {
        let (_, arrived) = came.iter().find(|(other, _)| *other == hex).expect("each one arrives as it was sent");
        assert!(arrived - at >= 0.99, "it took {} s", arrived - at);
    }
}
