use sesame_scan::LeftOut;

use super::*;

/// A heartbeat of component 3 of system 7, as pymavlink makes it.
const HEARTBEAT: [u8; 21] = [253, 9, 0, 0, 41, 7, 3, 0, 0, 0, 64, 226, 1, 0, 2, 3, 81, 4, 3, 184, 80];
/// The same in version 1.
const OF_VERSION_1: [u8; 17] = [254, 9, 41, 7, 3, 0, 64, 226, 1, 0, 2, 3, 81, 4, 3, 173, 104];
/// A message that no file defines, of component 1 of system 7.
const UNDEFINED: [u8; 13] = [253, 1, 0, 0, 0, 7, 1, 64, 226, 15, 5, 6, 7];

fn small() -> Definitions {
    let mut definitions = Definitions::default();
    definitions.add(include_str!("../../../interfaces/tests/small.xml")).unwrap();
    definitions
}

fn system() -> System {
    System::Mavlink { url: "udp://127.0.0.1:14550".to_owned(), definitions: vec!["small.xml".to_owned()] }
}

fn peer(port: u16) -> SocketAddr {
    SocketAddr::from(([127, 0, 0, 1], port))
}

/// What these datagrams, each with its sender, give in ten seconds.
fn facts(datagrams: &[(u16, &[u8])]) -> Facts {
    let (definitions, mut heard) = (small(), Heard::default());
    for (at, (port, datagram)) in datagrams.iter().enumerate() {
        heard.take(&definitions, datagram, peer(*port), Duration::from_millis(500 * at as u64));
    }
    heard.facts(&definitions, system(), Duration::from_secs(10))
}

#[test]
fn messages_have_their_sender_their_rate_and_what_was_in_the_first() {
    let two = [&HEARTBEAT[..], &UNDEFINED].concat();
    let facts = facts(&[(1, &two), (1, b"no message"), (1, &OF_VERSION_1)]);
    let [undefined, heartbeat] = &facts.topics[..] else { panic!("{:?}", facts.topics) };
    assert_eq!(undefined.path, "7/#1040960");
    assert_eq!(undefined.problem.as_deref(), Some("the files define no message with this number"));
    assert_eq!((heartbeat.path.as_str(), heartbeat.ty.as_deref()), ("7/HEARTBEAT", Some("HEARTBEAT")));
    assert_eq!((heartbeat.messages, heartbeat.rate, &heartbeat.problem), (2, Some(1.0), &None));
    assert_eq!(
        (&heartbeat.publishers[..], &heartbeat.subscribers[..]),
        (&["vehicle_7".into()][..], &[STATION.into()][..])
    );
    let [ty] = &facts.types[..] else { panic!("{:?}", facts.types) };
    assert_eq!((ty.source, &ty.left_out), (TypeSource::Dialect, &Vec::<LeftOut>::new()));
    let fields: Vec<_> =
        ty.fields.iter().map(|field| (&*field.name, &*field.ty, field.sample.as_deref().unwrap())).collect();
    let expected = [
        ("custom_mode", "uint32", "123456"),
        ("type", "uint8", "2"),
        ("autopilot", "uint8", "3"),
        ("base_mode", "uint8", "81"),
        ("system_status", "uint8", "4"),
        ("mavlink_version", "uint8", "3"),
    ];
    assert_eq!(fields, expected);
}

#[test]
fn senders_are_nodes_by_the_systems_behind_them() {
    let mut of_another = HEARTBEAT;
    (of_another[5], of_another[6]) = (8, 1);
    let mut gimbal = HEARTBEAT;
    gimbal[6] = 154;
    // Their checksums are wrong, as if they were of another definition.
    let facts = facts(&[(1, &HEARTBEAT), (1, &gimbal), (2, &HEARTBEAT), (3, &HEARTBEAT), (3, &of_another)]);
    let nodes: Vec<(&str, usize)> = facts.nodes.iter().map(|node| (node.name.as_str(), node.count)).collect();
    assert_eq!(nodes, [("vehicle_7", 2), ("vehicles_7_8", 1), (STATION, 1)]);
    let paths: Vec<&str> = facts.topics.iter().map(|topic| topic.path.as_str()).collect();
    assert_eq!(
        paths,
        ["7/154/HEARTBEAT", "7/3/HEARTBEAT", "8/HEARTBEAT"],
        "the component is named where several send it"
    );
    assert_eq!(facts.topics[1].publishers, ["vehicle_7", "vehicles_7_8"]);
    let problem = facts.topics[2].problem.as_deref().unwrap();
    assert!(problem.starts_with("of 1 of its 1 messages: its checksum is not that of a `HEARTBEAT`"), "{problem}");
    assert_eq!((facts.topics[2].ty.as_ref(), facts.topics[2].subscribers.len()), (None, 0));
}

#[test]
fn what_is_kept_is_bounded() {
    let (definitions, mut heard) = (small(), Heard::default());
    for number in 100..MOST_TOPICS + 105 {
        let mut frame = UNDEFINED;
        frame[7..10].copy_from_slice(&number.to_le_bytes()[..3]);
        heard.take(&definitions, &frame, peer(1), Duration::ZERO);
    }
    assert!(heard.cut);
    assert_eq!(heard.messages.len(), MOST_TOPICS);
    let mut heard = Heard::default();
    for port in (1..).take(MOST_PEERS + 1) {
        heard.take(&definitions, &UNDEFINED, peer(port), Duration::ZERO);
    }
    assert!(heard.cut);
    assert_eq!(heard.peers.len(), MOST_PEERS);
    assert_eq!(facts(&[]).nodes, []);
}

#[test]
fn values_are_shown_in_few_words() {
    let said = |value: Value| shown(&value);
    assert_eq!(said(Value::Real(f64::from(0.1_f32))), "0.1");
    assert_eq!(said(Value::Real(0.1)), "0.1");
    assert_eq!(said(Value::List((0..9).map(Value::Int).collect())), "[0, 1, 2, 3, …]");
    assert_eq!(said(Value::from("home")), "\"home\"");
    assert_eq!(said(Value::from(&*"é".repeat(50))), format!("\"{}…\"", "é".repeat(40)));
}

#[test]
fn an_address_that_is_taken_is_said() {
    let taken = UdpSocket::bind("127.0.0.1:0").unwrap();
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("small.xml"), include_str!("../../../interfaces/tests/small.xml")).unwrap();
    let options = ScanOptions {
        url: format!("udp://{}", taken.local_addr().unwrap()),
        definitions: vec!["small.xml".to_owned()],
        folder: folder.path().to_owned(),
        listening: Duration::from_millis(10),
    };
    let said = scan(&options).unwrap_err().to_string();
    assert!(said.starts_with(&format!("nothing can listen at `{}`: ", options.url)), "{said}");
    drop(taken);
    assert_eq!(scan(&options).unwrap().topics, []);
    let said = scan(&ScanOptions { definitions: vec!["none.xml".to_owned()], ..options }).unwrap_err().to_string();
    assert!(said.contains("none.xml` cannot be used"), "{said}");
}
