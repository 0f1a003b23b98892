use std::cell::RefCell;

use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use sesame_base::time::SimTime;
use sesame_plan::testing::{field, message, minimal, node, topic, topics};
use sesame_plan::{MessageId, Node, Proxy as Declared, Simulator, TopicId, TopicMembers, Type, Wiring};
use sesame_relay::wire::{WireTable, lines};

use super::*;

/// A heartbeat of component 3 of system 7, as pymavlink makes it.
const HEARTBEAT: [u8; 21] = [253, 9, 0, 0, 41, 7, 3, 0, 0, 0, 64, 226, 1, 0, 2, 3, 81, 4, 3, 184, 80];

/// How long anything may take; only a hang takes so long.
const LIMIT: Duration = Duration::from_secs(60);

const SMALL: &str = include_str!("../../../interfaces/tests/small.xml");

/// A plan with a drone at a proxy and a station, whose heartbeats are cut.
fn plan(station: SocketAddr, paths: &[&str]) -> CampaignPlan {
    let ty = Type::Message { id: MessageId(0) };
    let definitions = vec!["small.xml".to_owned()];
    let url = format!("udp://{station}");
    let proxy =
        Declared { node: NodeId(0), url: "udp://127.0.0.1:0".to_owned(), token: None, identity: None, public: false };
    let topics: Vec<_> = paths.iter().map(|path| topic(path, &[path], ty.clone())).collect();
    let all: Vec<TopicMembers> = (0..).map(TopicId).map(TopicMembers::All).take(topics.len()).collect();
    CampaignPlan {
        messages: vec![message("Heartbeat", vec![field("custom_mode", Type::Int { unit: None })])],
        nodes: vec![Node { publishes: all.clone(), ..node("drone") }, Node { subscribes: all, ..node("station") }],
        simulator: Simulator {
            proxies: vec![proxy],
            wiring: vec![Wiring { cut: true, ..Wiring::default() }; topics.len()],
            ..Simulator::new("air", sesame_plan::Transport::Mavlink { url, definitions })
        },
        topics,
        ..minimal()
    }
}

/// The runner between a drone and a station, which are plain sockets.
struct System {
    network: Network,
    drone: UdpSocket,
    station: UdpSocket,
    events: VecDeque<Event>,
    _folder: tempfile::TempDir,
}

impl System {
    fn new(paths: &[&str]) -> System {
        System::of(|station| plan(station, paths)).unwrap()
    }

    fn of(plan: impl Fn(SocketAddr) -> CampaignPlan) -> Result<System, TransportError> {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("small.xml"), SMALL).unwrap();
        let [drone, station] = [(); 2].map(|()| UdpSocket::bind("127.0.0.1:0").unwrap());
        for socket in [&drone, &station] {
            socket.set_read_timeout(Some(Duration::from_millis(1))).unwrap();
        }
        let plan = plan(station.local_addr().unwrap());
        let sesame_plan::Transport::Mavlink { url, definitions } = plan.simulator.transport.clone() else { panic!() };
        let mut network = Network::new(&plan, url, definitions, folder.path().to_owned());
        let address = |url: &str| url.to_owned();
        network.listen(&address)?;
        assert!(network.connect(&lines(&plan, &WireTable::new(&plan)), &address)?);
        drone.connect(network.proxies[0].socket.local_addr().unwrap()).unwrap();
        Ok(System { network, drone, station, events: VecDeque::new(), _folder: folder })
    }

    /// What happens next.
    fn event(&mut self) -> Event {
        let early = self.events.pop_front();
        early.unwrap_or_else(|| self.network.receive(LIMIT).unwrap().expect("something happens"))
    }

    /// The next datagram for a side, and where it comes from.
    fn heard(&mut self, side: End) -> (Vec<u8>, SocketAddr) {
        let limit = Instant::now() + LIMIT;
        let mut buffer = [0; 2000];
        loop {
            self.events.extend(self.network.receive(Duration::from_millis(1)).unwrap());
            let socket = if side == End::Ground { &self.station } else { &self.drone };
            if let Ok((length, from)) = socket.recv_from(&mut buffer) {
                return (buffer[..length].to_vec(), from);
            }
            assert!(Instant::now() < limit, "nothing comes");
        }
    }
}

#[test]
fn datagrams_go_both_ways_and_messages_of_topics_through_the_relay() {
    let mut system = System::new(&["7/HEARTBEAT"]);
    assert_eq!(system.network.missing().len(), 1);
    system.drone.send(b"no message").unwrap();
    let (bytes, link) = system.heard(End::Ground);
    assert_eq!(bytes, b"no message");
    assert!(system.network.missing().is_empty());
    system.station.send_to(b"an answer", link).unwrap();
    assert_eq!(system.heard(End::Vehicle).0, b"an answer");
    system.drone.send(&[&HEARTBEAT[..], b"behind it"].concat()).unwrap();
    let Event::Message { line: 0, source: 0, value, .. } = system.event() else { panic!("it is a message") };
    assert_eq!(value.number_at(&["custom_mode"]), Some(123_456.0));
    // The relay decides when it goes on; what was behind it in the datagram comes after it.
    system.network.publish(0, 0, &value, None).unwrap();
    let mut changed = value.clone();
    *changed.at_mut(&["custom_mode"]).unwrap() = Value::Int(1);
    system.network.publish(0, 0, &changed, None).unwrap();
    assert_eq!(system.heard(End::Ground).0, HEARTBEAT);
    let (bytes, _) = system.heard(End::Ground);
    assert_eq!((bytes[10], &bytes[4..10], bytes.len()), (1, &HEARTBEAT[4..10], 21));
    assert_eq!(system.heard(End::Ground).0, b"behind it");
}

#[test]
fn the_topic_that_names_the_sender_most_precisely_gets_the_message() {
    let mut system = System::new(&["HEARTBEAT", "7/HEARTBEAT", "7/4/HEARTBEAT", "8/HEARTBEAT"]);
    let layout = system.network.topics[0].layout.clone();
    for ((of, component), wanted) in [((7, 3), 1), ((7, 4), 2), ((8, 1), 3), ((9, 1), 0)] {
        let sender = Sender { system: of, component, sequence: 0 };
        system.drone.send(&layout.make(sender, &[Value::Int(5)])).unwrap();
        let Event::Message { line, .. } = system.event() else { panic!("it is a message") };
        assert_eq!(line, wanted);
    }
}

#[test]
fn what_cannot_be_read_goes_on_and_is_said_once() {
    let mut system = System::new(&["7/HEARTBEAT"]);
    let mut damaged = HEARTBEAT;
    damaged[12] ^= 1;
    for _ in 0..3 {
        system.drone.send(&damaged).unwrap();
    }
    for _ in 0..3 {
        assert_eq!(system.heard(End::Ground).0, damaged);
    }
    let Event::Note(note) = system.event() else { panic!("it is a note") };
    assert!(note.starts_with("a message on `7/HEARTBEAT` is not as declared and goes on as it came: "), "{note}");
    assert!(system.events.is_empty());
}

#[test]
fn a_message_that_the_runner_makes_goes_to_its_subscribers() {
    let mut system = System::of(|station| {
        let mut plan = plan(station, &["255/HEARTBEAT"]);
        let [drone, station] = &mut plan.nodes[..] else { panic!("there are two nodes") };
        (drone.publishes, drone.subscribes) = (Vec::new(), topics(&[0]));
        (station.publishes, station.subscribes) = (topics(&[0]), Vec::new());
        plan
    })
    .unwrap();
    system.drone.send(b"here").unwrap();
    system.heard(End::Ground);
    let fields = sesame_relay::value::Fields::new(["custom_mode"]);
    let made = Value::Record(sesame_relay::value::Record::new(&fields, vec![Value::Int(6)]));
    for number in 0..2 {
        system.network.publish(0, 0, &made, None).unwrap();
        let (bytes, _) = system.heard(End::Vehicle);
        assert_eq!(bytes[..11], [253, 1, 0, 0, number, 255, 190, 0, 0, 0, 6]);
    }
}

#[test]
fn nodes_are_distinguished_by_their_proxies() {
    let all = topics(&[0]);
    let mut system = System::of(|station| {
        let mut plan = plan(station, &["HEARTBEAT"]);
        for node in &mut plan.nodes {
            (node.publishes, node.subscribes) = (all.clone(), all.clone());
        }
        let (publishers, subscribers) = (vec![NodeId(0)], vec![NodeId(0)]);
        plan.simulator.wiring = vec![Wiring { cut: true, publishers, subscribers, joined: false }];
        plan
    })
    .unwrap();
    let drone = NodeId(0);
    system.drone.send(&HEARTBEAT).unwrap();
    let Event::Message { source, value: up, .. } = system.event() else { panic!("it is a message") };
    assert_eq!(system.network.topics[0].line.sources[source].publisher, Some(drone));
    // What goes to the station goes to nobody that is told apart.
    let sinks: Vec<Option<NodeId>> = system.network.topics[0].line.sinks.iter().map(|sink| sink.subscriber).collect();
    assert_eq!(sinks, [None, Some(drone)]);
    system.network.publish(0, 1, &up, None).unwrap();
    system.network.publish(0, 0, &up, None).unwrap();
    let (bytes, link) = system.heard(End::Ground);
    assert_eq!(bytes, HEARTBEAT);
    system.station.send_to(&HEARTBEAT, link).unwrap();
    let Event::Message { source, value: down, .. } = system.event() else { panic!("it is a message") };
    assert_eq!(system.network.topics[0].line.sources[source].publisher, None);
    system.network.publish(0, 0, &down, None).unwrap();
    system.drone.send(b"after it").unwrap();
    assert_eq!(system.heard(End::Ground).0, b"after it", "the station has heard its heartbeat once");
    system.network.publish(0, 1, &down, None).unwrap();
    assert_eq!(system.heard(End::Vehicle).0, HEARTBEAT);
    system.station.send_to(b"after it", link).unwrap();
    assert_eq!(system.heard(End::Vehicle).0, b"after it", "the drone has heard its heartbeat once");
}

#[test]
fn mistakes_are_said_before_anything_is_relayed() {
    let said = |change: fn(&mut CampaignPlan)| {
        let system = System::of(|station| {
            let mut plan = plan(station, &["7/HEARTBEAT"]);
            change(&mut plan);
            plan
        });
        system.err().expect("it is refused").to_string()
    };
    let path = |path: &str| System::of(|station| plan(station, &[path])).err().expect("it is refused").to_string();
    assert!(path("HEARTBEET").contains("topic `HEARTBEET`: the definitions have no message `HEARTBEET`"));
    assert!(path("300/HEARTBEAT").contains("`300` is not the number of a system or component"));
    assert!(path("1/2/3/HEARTBEAT").contains("expected `MESSAGE`, `SYSTEM/MESSAGE` or `SYSTEM/COMPONENT/MESSAGE`"));
    assert!(
        said(|plan| plan.messages[0].fields[0].name = "mode".to_owned()).contains("`HEARTBEAT` has no field `mode`")
    );
    assert!(said(|plan| plan.simulator.proxies[0].url = "udp://0.0.0.0:0".to_owned()).contains("other machines"));
    assert!(said(|plan| plan.simulator.proxies[0].url = "tcp://a".to_owned()).contains("write `udp://HOST:PORT`"));
}

#[test]
fn addresses_may_leave_the_port_to_the_convention() {
    let read = |url: &str| read_url(url).map(|address| address.to_string()).map_err(|error| error.to_string());
    assert_eq!(read("udp://127.0.0.1"), Ok("127.0.0.1:14550".to_owned()));
    assert_eq!(read("udp://127.0.0.1:9/"), Ok("127.0.0.1:9".to_owned()));
    assert_eq!(read("udp://[::1]:9"), Ok("[::1]:9".to_owned()));
    assert_eq!(read("udp://[::1]"), Ok("[::1]:14550".to_owned()));
    assert!(read("udp://:x").is_err());
}

#[test]
fn senders_are_bounded() {
    let mut system = System::new(&["7/HEARTBEAT"]);
    let from = |port: u16| Datagram {
        at: At::Proxy(0, SocketAddr::from(([127, 0, 0, 1], port))),
        bytes: HEARTBEAT.to_vec(),
        arrived: Instant::now(),
    };
    for port in 1..=100 {
        system.network.take(&from(port)).unwrap();
    }
    assert_eq!(system.network.links.len(), MOST_LINKS);
    let said = system.network.parts.iter().filter(|part| matches!(part, Part::Said(Event::Note(_)))).count();
    assert_eq!(said, 1);
}

#[test]
fn nothing_in_a_datagram_is_lost_added_or_reordered() {
    let piece = prop_oneof![
        Just(HEARTBEAT.to_vec()),
        proptest::collection::vec(any::<u8>(), 0..40),
        Just(vec![0xFD]),
        Just(vec![0xFE, 3, 0, 7, 3, 0, 1, 2, 3, 4, 5]),
    ];
    let pieces = proptest::collection::vec(piece, 0..8);
    for cut in [true, false] {
        // One for all cases: each one has sockets.
        let system = System::of(|station| {
            let mut plan = plan(station, &["7/HEARTBEAT"]);
            plan.simulator.wiring[0].cut = cut;
            plan
        });
        let system = RefCell::new(system.unwrap());
        let case = |pieces: Vec<Vec<u8>>| {
            let (network, bytes) = (&mut system.borrow_mut().network, pieces.concat());
            let at = At::Proxy(0, SocketAddr::from(([127, 0, 0, 1], 9)));
            network.take(&Datagram { at, bytes: bytes.clone(), arrived: Instant::now() }).unwrap();
            let (mut passed, mut heard) = (Vec::new(), 0);
            while let Some(part) = network.parts.pop_front() {
                match part {
                    Part::Unchanged(_, bytes) => passed.extend(bytes),
                    Part::Said(Event::Message { value: Value::Record(record), .. }) => {
                        heard += 1;
                        if cut {
                            let (_, frame) = Way::of(record.unchanged().unwrap()).unwrap();
                            passed.extend_from_slice(frame);
                        }
                    }
                    Part::Said(_) => {}
                }
            }
            prop_assert_eq!(passed, bytes);
            prop_assert!(heard >= pieces.iter().take_while(|piece| **piece == HEARTBEAT).count());
            Ok(())
        };
        TestRunner::default().run(&pieces, case).unwrap();
    }
}

#[test]
fn the_relay_runs_over_links() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("small.xml"), SMALL).unwrap();
    let station = UdpSocket::bind("127.0.0.1:0").unwrap();
    let plan = plan(station.local_addr().unwrap(), &["7/HEARTBEAT"]);
    let transport = mavlink(folder.path().to_owned()).transport(&plan);
    assert_eq!(transport.now(), SimTime::ZERO);
    assert!(!transport.capabilities().lock_stepped);
}
