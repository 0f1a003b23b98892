//! Messages between clients of one broker, or of two, with the runner between them.

use std::cell::RefCell;
use std::path::Path;
use std::time::Instant;

use sesame_patience::Watch;
use sesame_plan::{CampaignPlan, Test};
use sesame_relay::metric::MetricTable;
use sesame_relay::relay::Relay;
use sesame_relay::transport::Transport;
use sesame_relay::wire::WireTable;
use sesame_tests::{fresh_folder, relay_for_a_moment};
use sesamec::frontend::{Look, SESAME};

use crate::peers::{Broker, Client, LIMIT, packages};

/// A space of one topic, `peer`, at this broker, of nodes that may have another one.
pub(crate) fn space(broker: &str, settings: &str, nodes: &str) -> String {
    format!(
        "space peers\n\
         system {{\n\
           simulator peers = mqtt \"{broker}\" {{ {settings} }}\n\
           message Peer {{ speed: real[m/s] }}\n\
           topic peer = \"peers/one/speed\" : Peer\n\
           {nodes}\n\
         }}\n\
         metric disturbed minimise = fuzzing_time()\n\
         operation hole on peer = blackhole\n\
         operation faster on peer.speed = bias [0m/s, 1000m/s]\n\
         test fast {{ faster bias 500m/s from 0s to 60s }}\n\
         campaign look {{\n\
           objectives disturbed\n\
           operations hole, faster 1 per test\n\
           search     random {{ evaluations 1 }}\n\
           end        after 60s\n\
         }}\n"
    )
}

/// The plan of a space.
pub(crate) fn plan(text: &str) -> CampaignPlan {
    let checked = (SESAME.check)("peers.sesame", text, Look::Short);
    assert_eq!(checked.errors, 0, "{text}\n{}", checked.diagnostics);
    checked.plans.into_iter().next().expect("there is a campaign").plan
}

/// The runner, driven by hand.
pub(crate) struct System {
    plan: CampaignPlan,
    transport: Box<dyn Transport>,
}

impl System {
    pub(crate) fn new(text: &str, folder: &Path) -> System {
        let plan = plan(text);
        System { transport: sesame_mqtt::mqtt(folder.to_owned()).transport(&plan), plan }
    }

    /// Connects, and relays until something holds.
    pub(crate) fn relay_until(
        &mut self,
        test: &Test,
        mut ready: impl FnMut(),
        mut done: impl FnMut() -> bool,
    ) -> Result<(), String> {
        let wires = WireTable::new(&self.plan);
        let metrics = MetricTable::new(&self.plan, &wires, &[]).expect("the metrics need no hooks");
        let mut relay = Relay::new(&self.plan, &wires, test, metrics.start(), &[]).expect("the test fits the plan");
        let watch = Watch::over("the runner");
        relay.begin();
        self.transport.reset(1, &mut relay).map_err(|error| error.to_string())?;
        ready();
        let limit = Instant::now() + 3 * LIMIT;
        while !done() {
            watch.goes_on();
            assert!(Instant::now() < limit, "nothing came of it: {:?}", self.notes());
            relay_for_a_moment(&mut *self.transport, &mut relay).map_err(|error| error.to_string())?;
        }
        Ok(())
    }

    pub(crate) fn notes(&mut self) -> Vec<String> {
        self.transport.incidents().notes
    }
}

/// What a publisher said, and a subscriber heard, of so many messages.
struct Exchange<'a> {
    packages: &'a Path,
    /// The ports of the publisher and of the subscriber, and their topics.
    ports: [u16; 2],
    topics: [&'a str; 2],
    /// Quality, and what else a publisher is told.
    quality: &'a str,
    more: &'a [&'a str],
}

impl Exchange<'_> {
    fn through(&self, system: &mut System, test: &Test) -> [serde_json::Value; 2] {
        let ports = self.ports.map(|port| port.to_string());
        let batch = BATCH.to_string();
        let waiting = ["wait", &ports[1], self.topics[1], "1000", &batch, self.quality];
        let mut subscriber = Client::start(self.packages, &waiting);
        let saying = [&["publish", &ports[0], self.topics[0], "1000", &batch, self.quality], self.more].concat();
        let mut publisher = Client::start(self.packages, &saying);
        let mut batches = 0;
        let done = || {
            while subscriber.count() + BATCH >= batches * BATCH && batches * BATCH < 1000 {
                publisher.go();
                batches += 1;
            }
            subscriber.has_ended()
        };
        system.relay_until(test, || {}, done).unwrap_or_else(|error| panic!("{error}"));
        [publisher.end(), subscriber.end()]
    }
}

/// How many messages are sent at once. No more than twice as many are under way: of those of which none is to be
/// acknowledged, a broker of mosquitto drops what is more than twenty for one client.
const BATCH: u64 = 5;

const UNDISTURBED: &str = "peers/one/speed/undisturbed";
const TOPIC: &str = "peers/one/speed";

#[test]
fn a_thousand_messages_pass_at_each_quality_byte_for_byte() {
    let Some(packages) = packages() else { return };
    let folder = fresh_folder("mqtt_qualities");
    let broker = Broker::start(&folder);
    for (word, quality) in [("at_most_once", "0"), ("at_least_once", "1"), ("exactly_once", "2")] {
        let text = space(&format!("mqtt://127.0.0.1:{}", broker.port), &format!("quality {word}"), "");
        let mut system = System::new(&text, &folder);
        let exchange =
            Exchange { packages: &packages, ports: [broker.port; 2], topics: [UNDISTURBED, TOPIC], quality, more: &[] };
        let [said, heard] = exchange.through(&mut system, &Test::default());
        assert_eq!((&said["sent"], &heard["heard"]), (&1000.into(), &1000.into()), "{word}");
        assert_eq!(said["digest"], heard["digest"], "{word}");
        assert_eq!(system.notes(), [""; 0], "{word}");
    }
}

#[test]
fn between_two_brokers_names_stay_and_retained_messages_stay_retained() {
    let Some(packages) = packages() else { return };
    let folder = fresh_folder("mqtt_two");
    let brokers = [Broker::start(&folder), Broker::start(&folder)];
    let nodes = format!(
        "node one {{ publishes peer  broker \"mqtt://127.0.0.1:{}\" }}\n\
         node other {{ subscribes peer  broker \"mqtt://127.0.0.1:{}\" }}",
        brokers[0].port, brokers[1].port
    );
    let mut system = System::new(&space(&format!("mqtt://127.0.0.1:{}", brokers[0].port), "", &nodes), &folder);
    let ports = [brokers[0].port, brokers[1].port];
    let exchange = Exchange { packages: &packages, ports, topics: [TOPIC; 2], quality: "1", more: &["retain"] };
    let [said, heard] = exchange.through(&mut system, &Test::default());
    assert_eq!(said["digest"], heard["digest"]);
    assert_eq!(heard["retained"], 0, "it was there before");
    // The last message stays at the other broker.
    let waiting = ["wait", &brokers[1].port.to_string(), TOPIC, "1", "1", "1"];
    assert_eq!(Client::start(&packages, &waiting).end()["retained"], 1);
}

#[test]
fn what_an_operation_changes_is_changed_and_the_rest_of_a_payload_stays() {
    let Some(packages) = packages() else { return };
    let folder = fresh_folder("mqtt_faster");
    let broker = Broker::start(&folder);
    let mut system = System::new(&space(&format!("mqtt://127.0.0.1:{}", broker.port), "", ""), &folder);
    let exchange = Exchange {
        packages: &packages,
        ports: [broker.port; 2],
        topics: [UNDISTURBED, TOPIC],
        quality: "1",
        more: &[],
    };
    let test = system.plan.tests[0].test.clone();
    let [said, heard] = exchange.through(&mut system, &test);
    assert_ne!(said["digest"], heard["digest"]);
    assert_eq!(heard["heard"], 1000);
}

#[test]
fn what_a_monitor_says_reaches_a_client_that_somebody_else_wrote() {
    let Some(packages) = packages() else { return };
    let folder = fresh_folder("mqtt_monitor");
    let broker = Broker::start(&folder);
    let text = space(&format!("mqtt://127.0.0.1:{}", broker.port), "", "topic state = \"eddi/state\" : int");
    let monitor = "eddi drive publishes state {\n\
                   evidence fast = peer.speed > 200m/s\n\
                   guarantee quick integrity 2 = fast\n\
                   otherwise slow\n}\n";
    let mut system = System::new(&text.replacen("metric disturbed", &format!("{monitor}metric disturbed"), 1), &folder);
    let port = broker.port.to_string();
    let mut subscriber = Client::start(&packages, &["wait", &port, "eddi/state", "2", "1", "1"]);
    let publisher = RefCell::new(Client::start(&packages, &["publish", &port, UNDISTURBED, "400", "400", "1"]));
    let ready = || publisher.borrow_mut().go();
    let relayed = system.relay_until(&Test::default(), ready, || subscriber.has_ended());
    relayed.unwrap_or_else(|error| panic!("{error}"));
    publisher.into_inner().end();
    let heard = subscriber.end();
    assert_eq!(heard["heard"], 2);
    let of_0_and_2 = "a953f09a1b6b6725b81956e9ad0b1eb49e3ad40004c04307ef8af6246a054116";
    assert_eq!(heard["digest"], of_0_and_2, "at first `0`, then `2`");
    assert_eq!(system.notes(), [""; 0]);
}

#[test]
fn after_a_broker_restarts_every_topic_is_back() {
    let Some(packages) = packages() else { return };
    let folder = fresh_folder("mqtt_restart");
    let mut broker = Broker::start(&folder);
    let port = broker.port;
    let mut system = System::new(&space(&format!("mqtt://127.0.0.1:{port}"), "", ""), &folder);
    let at = port.to_string();
    let mut subscriber = Client::start(&packages, &["wait", &at, TOPIC, "400", "50", "1"]);
    let publisher =
        RefCell::new(Client::start(&packages, &["publish", &at, UNDISTURBED, "1000000", "1000000", "1", "slowly"]));
    let ready = || publisher.borrow_mut().go();
    let mut heard_before = None;
    let outcome = system.relay_until(&Test::default(), ready, || {
        if heard_before.is_none() && subscriber.count() >= 50 {
            heard_before = Some(subscriber.count());
            broker.restart();
        }
        subscriber.has_ended()
    });
    assert_eq!(outcome, Ok(()));
    assert!(heard_before.is_some_and(|count| count < 400), "the broker was restarted before all had come");
    assert!(subscriber.end()["heard"].as_u64() >= Some(400));
    let notes = system.notes();
    let lost = format!("the connection to the broker at `mqtt://127.0.0.1:{port}` was lost for ");
    assert!(notes.iter().any(|note| note.starts_with(&lost)), "{notes:?}");
}

#[test]
fn ten_thousand_malformed_payloads_change_nothing_for_others() {
    let Some(packages) = packages() else { return };
    let folder = fresh_folder("mqtt_malformed");
    let broker = Broker::start(&folder);
    let mut system = System::new(&space(&format!("mqtt://127.0.0.1:{}", broker.port), "", ""), &folder);
    let at = broker.port.to_string();
    let mut subscriber = Client::start(&packages, &["wait", &at, TOPIC, "10100", "50", "1"]);
    let mut bad = Client::start(&packages, &["publish", &at, UNDISTURBED, "10000", "1000", "1", "malformed"]);
    let good = RefCell::new(Client::start(&packages, &["publish", &at, UNDISTURBED, "100", "100", "1", "slowly"]));
    let (ready, mut batches) = (|| good.borrow_mut().go(), 0);
    let outcome = system.relay_until(&Test::default(), ready, || {
        // Two thousand are under way at most, and the good ones among them.
        while subscriber.count() + 1000 >= batches * 1000 && batches < 10 {
            bad.go();
            batches += 1;
        }
        subscriber.has_ended()
    });
    assert_eq!(outcome, Ok(()));
    assert_eq!(subscriber.end()["heard"], 10_100, "all go on, as they came");
    let notes = system.notes();
    let [note] = &notes[..] else { panic!("it is said once: {notes:?}") };
    assert!(note.starts_with("a message on `peers/one/speed/undisturbed` is not of its declared type"), "{note}");
}
