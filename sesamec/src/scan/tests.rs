//! Spaces of systems that were never there.

use std::collections::{BTreeMap, BTreeSet};

use proptest::prelude::*;
use serde_json::Value as Json;
use sesame_dsl::interfaces::{Folders, Interfaces, wire_type};
use sesame_plan::{Dialect, Interface, InterfaceField};
use sesame_scan::{
    Conventions, Facts, FoundAction, FoundField, FoundNode, FoundService, FoundTopic, FoundType, Payloads, System,
    TypeSource,
};

use super::{FILE, Origin, Types, by_payloads, check_settings, checked_space, types_by_payloads};
use crate::frontend::{Look, SESAME};

/// Folders with nothing but a broken definition.
struct Made;

impl Interfaces for Made {
    fn find(&self, _: Folders<'_>, name: &str) -> Result<Option<Vec<Interface>>, String> {
        match name {
            "broken_msgs/msg/Broken" => Err("Broken.msg: line 1 is\u{1b}[2J no field".to_owned()),
            _ => Ok(None),
        }
    }
}

fn topic(path: &str, ty: &str, publishers: &[&str], subscribers: &[&str]) -> FoundTopic {
    let all = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
    FoundTopic {
        path: path.to_owned(),
        ty: Some(ty.to_owned()),
        publishers: all(publishers),
        subscribers: all(subscribers),
        reliable: Some(true),
        transient_local: Some(false),
        messages: 51,
        rate: Some(10.0),
        ..FoundTopic::default()
    }
}

fn service(path: &str, ty: &str) -> FoundService {
    let ty = Some(ty.to_owned());
    FoundService { path: path.to_owned(), ty, servers: vec!["/cell".to_owned()], clients: Vec::new() }
}

fn facts(topics: Vec<FoundTopic>, services: Vec<FoundService>, nodes: &[&str]) -> Facts {
    let node = |name: &&str| FoundNode { name: (*name).to_owned(), count: 1, ..FoundNode::default() };
    let nodes = nodes.iter().map(node).collect();
    Facts { seconds: 5.0, nodes, topics, services, ..Facts::of(System::Ros2 { domain: 7 }) }
}

fn layout(name: &str, fields: &[(&str, &str)]) -> Interface {
    let field = |(name, ty): &(&str, &str)| InterfaceField {
        name: (*name).to_owned(),
        ty: wire_type(ty, Dialect::Ros2).unwrap(),
    };
    Interface { name: name.to_owned(), fields: fields.iter().map(field).collect() }
}

/// The space of what was found, with layouts that nodes described. It passes its check, and is formatted.
fn written(facts: &Facts, described: &[Interface]) -> String {
    let folders = Folders { written: &[], file: FILE, dialect: Dialect::Ros2 };
    let mut types = Types::of_topics(facts, &Made, folders);
    assert!(types.missing().iter().all(|name| facts.topics.iter().any(|topic| topic.ty.as_ref() == Some(name))));
    types.add_described(&BTreeMap::from([(String::new(), described.to_vec())]), &Made, folders);
    checked(facts, types, &[])
}

/// The space of what was found. It passes its check, and is formatted.
fn checked(facts: &Facts, mut types: Types, settings: &[&str]) -> String {
    let services = BTreeSet::from(["std_srvs/srv/Trigger".to_owned(), "std_srvs/srv/Empty".to_owned()]);
    let settings: Vec<String> = settings.iter().map(|&line| line.to_owned()).collect();
    let origin = Origin { folders: &[], services: &services, settings: &settings };
    let text = checked_space(&SESAME, facts, &mut types, origin).unwrap();
    let checked = (SESAME.check)(FILE, &text, Look::Short);
    assert_eq!(checked.errors, 0, "{}\n{text}", checked.diagnostics);
    assert_eq!((SESAME.format)(FILE, &text, Look::Short).unwrap(), text);
    text
}

const FLOAT: &str = "std_msgs/msg/Float64";

#[test]
fn a_system_is_its_nodes_topics_and_services() {
    let topics = vec![
        FoundTopic {
            transient_local: Some(true),
            rate: None,
            messages: 1,
            ..topic("/map", "std_msgs/msg/String", &["/cell"], &[])
        },
        topic("/clock", "rosgraph_msgs/msg/Clock", &["/cell"], &["/arm/driver"]),
        topic("/robots/r1/level", FLOAT, &["/cell"], &["/arm/driver"]),
        FoundTopic { rate: Some(123.4), ..topic("/robots/r2/level", FLOAT, &["/cell"], &["/arm/driver"]) },
        FoundTopic { reliable: Some(false), ..topic("/command", FLOAT, &["/arm/driver", "?"], &["/cell"]) },
        topic("/wanted", FLOAT, &[], &["/cell"]),
    ];
    let services = vec![
        service("/cell/reset_world", "std_srvs/srv/Empty"),
        service("/cell/step", "std_srvs/srv/Trigger"),
        service("/cell/plan", "nav_msgs/srv/GetPlan"),
    ];
    let mut facts = facts(topics, services, &["/arm/driver", "/cell", "/idle"]);
    let (path, ty) = ("/go".to_owned(), "nav2_msgs/action/NavigateToPose".to_owned());
    facts.actions.push(FoundAction { path, ty, ..FoundAction::default() });
    facts.nodes[2].count = 2;
    insta::assert_snapshot!(written(&facts, &[]));
}

#[test]
fn strange_names_become_names_or_comments() {
    let long = format!("/{}", "a".repeat(200));
    let longer = format!("{long}/b");
    let topics = vec![
        topic("/metric", FLOAT, &["/system"], &[]),
        topic("/a/b", FLOAT, &["/system"], &[]),
        topic("/a_b", FLOAT, &["/system"], &[]),
        topic("/A_B", FLOAT, &["/system"], &[]),
        topic("/step_request", FLOAT, &["/robots"], &[]),
        topic(&long, FLOAT, &["/robots"], &[]),
        topic(&longer, FLOAT, &["/x\" {\n} system {"], &[]),
        topic("/x\" : real\n}\u{1b}[2J", FLOAT, &["/robots"], &[]),
        topic("/{a,b}", FLOAT, &["/robots"], &[]),
        topic("/2nd", FLOAT, &["/robots"], &[]),
        topic("", FLOAT, &["/robots"], &[]),
        topic("/a/b", "std_msgs/msg/Bool", &["/robots"], &[]),
    ];
    let services = vec![service("/step", "std_srvs/srv/Trigger"), service("/re\u{7}set", "std_srvs/srv/Trigger")];
    let facts =
        Facts { cut: true, ..facts(topics, services, &["/system", "/robots", "/domain_7", "/x\" {\n} system {"]) };
    let text = written(&facts, &[]);
    assert!(!text.chars().any(|c| c.is_control() && c != '\n'));
    insta::assert_snapshot!(text);
}

#[test]
fn types_that_no_folder_has_are_as_nodes_describe_them() {
    let types = ["Joint", "Nothing", "Place", "Circle", "Gap", "Names", "Large", "Undescribed"];
    let mut topics: Vec<FoundTopic> = types
        .iter()
        .map(|name| topic(&format!("/{name}"), &format!("cell_msgs/msg/{name}"), &["/cell"], &[]))
        .collect();
    topics.push(topic("/broken", "broken_msgs/msg/Broken", &["/cell"], &[]));
    topics.push(topic("/foreign", "Some::Thing\u{202e}", &["/cell"], &[]));
    topics.push(topic("/header", "std_msgs/msg/Header", &["/cell"], &[]));
    let described = [
        layout(
            "cell_msgs/msg/Joint",
            &[
                ("header", "std_msgs/msg/Header"),
                ("stamp", "builtin_interfaces/msg/Time"),
                ("place", "geometry_msgs/msg/Point"),
                ("corners", "cell_msgs/msg/Place[4]"),
                ("to", "bool"),
                ("count", "uint8"),
                ("number", "int32"),
                ("level", "float32"),
                ("angle", "float64"),
                ("covariance", "float64[36]"),
                ("some", "float64[<=3]"),
                ("names", "string[]"),
                ("wide", "wstring"),
            ],
        ),
        layout("cell_msgs/msg/Place", &[("x", "float64"), ("y", "float64"), ("z", "float64")]),
        layout("cell_msgs/msg/Nothing", &[("structure_needs_at_least_one_member", "uint8")]),
        layout("cell_msgs/msg/Circle", &[("inner", "cell_msgs/msg/Circle[]")]),
        layout("cell_msgs/msg/Gap", &[("inner", "cell_msgs/msg/Lost")]),
        layout("cell_msgs/msg/Names", &[("a b\n", "bool")]),
        layout("cell_msgs/msg/Large", &(0..20_000).map(|_| ("x", "bool")).collect::<Vec<_>>()),
        layout(FLOAT, &[("known", "bool")]),
    ];
    let text = written(&facts(topics, Vec::new(), &["/cell"]), &described);
    insta::assert_snapshot!(text);
}

#[test]
fn nothing_is_a_space_too() {
    insta::assert_snapshot!(written(&facts(Vec::new(), Vec::new(), &[]), &[]));
}

/// Topics with what their payloads have in common, of a middleware that has no types.
fn untyped(payloads: &[(&str, &str)]) -> (Vec<FoundTopic>, Payloads) {
    let mut found = Payloads::default();
    let mut topics = BTreeMap::<&str, FoundTopic>::new();
    for (path, payload) in payloads {
        found.add(path, &serde_json::from_str(payload).unwrap());
        let topic = topics.entry(path).or_default();
        (*path).clone_into(&mut topic.path);
        topic.messages += 1;
    }
    (topics.into_values().collect(), found)
}

#[test]
fn a_master_of_ros_1_has_the_types_that_publishers_hand_out() {
    let described = [layout(
        "cell_msgs/msg/Joint",
        &[("header", "std_msgs/msg/Header"), ("at", "builtin_interfaces/msg/Time"), ("raw", "int8[4]")],
    )];
    let joints = |path: &str| FoundTopic {
        reliable: None,
        transient_local: None,
        latching: Some(true),
        ..topic(path, "cell_msgs/msg/Joint", &["/arm"], &["/view"])
    };
    let any = FoundTopic { ty: None, ..joints("/any") };
    let wrong = FoundTopic { problem: Some("its MD5 is another one".to_owned()), ..joints("/wrong") };
    let unknown = FoundService { ty: None, ..service("/unknown", "") };
    let services = vec![service("/reset", "std_srvs/srv/Empty"), service("/step", "std_srvs/srv/Empty"), unknown];
    let clock = FoundTopic { latching: Some(false), ..topic("/clock", sesame_scan::CLOCK, &["/cell"], &[]) };
    let mut facts = facts(vec![any, clock, joints("/joints"), wrong], services, &["/arm", "/gone"]);
    facts.system = System::Ros1 { master: "http://127.0.0.1:11311".to_owned() };
    facts.nodes[1].answers = Some(false);
    insta::assert_snapshot!(written(&facts, &described));
}

#[test]
fn a_bridge_without_rosapi_has_what_its_messages_have_in_common() {
    let (mut topics, payloads) = untyped(&[
        ("/aim", r#"{ "data": 1.5 }"#),
        (
            "/joint",
            r#"{ "header": { "stamp": { "sec": 1, "nanosec": 2 }, "frame_id": "" }, "at": { "x": 1, "y": 2, "z": 3 } }"#,
        ),
        (
            "/joint",
            r#"{ "header": { "stamp": { "sec": 1, "nanosec": 3 }, "frame_id": "" }, "at": { "x": 1, "y": 2, "z": null } }"#,
        ),
        ("/place", r#"{ "inner": { "level": 1, "names": ["a"], "more": null }, "all": [{ "deep": { "x": 1 } }] }"#),
        ("/text", r#""text""#),
        ("/untyped", r#"{ "x": 1 }"#),
    ]);
    let types = ["std_msgs/msg/Float64", "cell_msgs/msg/Joint", "cell_msgs/msg/Place", "cell_msgs/msg/Text"];
    for (topic, ty) in topics.iter_mut().zip(types) {
        topic.ty = Some(ty.to_owned());
    }
    topics.push(FoundTopic {
        path: "/silent".to_owned(),
        ty: Some("cell_msgs/msg/Silent".to_owned()),
        ..FoundTopic::default()
    });
    let (url, dialect) = ("wss://hall:9090".to_owned(), Dialect::Ros1);
    let facts = Facts { seconds: 3.5, topics, ..Facts::of(System::Rosbridge { url, dialect, rosapi: false }) };
    let mut types = Types::of_topics(&facts, &Made, Folders { written: &[], file: FILE, dialect: Dialect::Ros2 });
    types_by_payloads(&mut types, &facts, &payloads);
    insta::assert_snapshot!(checked(&facts, types, &["token from env \"HALL_TOKEN\"", "trust \"hall.pem\""]));
}

#[test]
fn a_broker_has_topics_of_fleets_as_groups_and_messages_as_their_payloads() {
    let state = |driving: bool, x: &str| {
        format!(
            r#"{{ "driving": {driving}, "headerId": 7, "agvPosition": {{ "x": {x}, "theta": 0.5 }}, "loads": [],
                 "errors": [{{ "errorType": "A", "level": 1 }}, {{ "errorType": "B" }}], "type": "state" }}"#
        )
    };
    let (one, other) = (state(true, "1"), state(false, "2.5"));
    let (mut topics, payloads) = untyped(&[
        ("uagv/v2/ACME/agv1/state", &one),
        ("uagv/v2/ACME/agv1/state", &other),
        ("uagv/v2/ACME/agv2/state", &one),
        ("uagv/v2/ACME/agv1/order", r#"{ "orderId": "a", "nodes": [{ "nodeId": "n" }] }"#),
        ("uagv/v2/ACME/agv2/order", r#"{ "orderId": "a", "nodes": [{ "nodeId": "n" }], "zoneSetId": "z" }"#),
        ("uagv/v2/other/agv2/state", r#"{ "battery": 1.5 }"#),
        ("level", "1"),
        ("switch on", "true"),
        ("names", r#"["a", "b"]"#),
        ("stack", r#"[{ "a": 1 }]"#),
        ("mixed", "null"),
        ("empty", "{}"),
        ("a,b/{c}", "1"),
        ("report", r#"{ "message": "text", "system": 1, "a b": 1 }"#),
    ]);
    for topic in &mut topics {
        (topic.retained, topic.quality) = (Some(topic.path.ends_with("order")), Some(1));
    }
    topics[0].problem = Some("1 of 2 payloads are not JSON".to_owned());
    let system = System::Mqtt { url: "mqtt://127.0.0.1:1883".to_owned() };
    let mut facts = Facts { seconds: 5.0, topics, ..Facts::of(system) };
    let types = by_payloads(&mut facts, &payloads, Conventions::Json);
    let text = checked(&facts, types, &["user \"scan\"", "password from file \"secret\""]);
    insta::assert_snapshot!(text);
}

#[test]
fn a_simulator_has_the_topics_that_were_named() {
    let (mut topics, payloads) = untyped(&[
        ("joints/R1/Link0/position", "0.25"),
        ("joints/R1/Link1/position", "1"),
        ("tool", r#"{ "x": 1.5, "y": 2, "z": 3 }"#),
        ("path", r#"{ "points": [{ "x": 1.5, "y": 2, "z": 3 }], "name": "p" }"#),
        ("word", r#""none""#),
        ("word", "0.5"),
    ]);
    topics.push(FoundTopic {
        path: "nowhere".to_owned(),
        problem: Some("nothing came on it".to_owned()),
        ..FoundTopic::default()
    });
    topics[0].can_be_cut = Some(false);
    let system = System::Simlog { url: "http://127.0.0.1:8089".to_owned(), protocol: 3, step_ms: 20, steps: 10 };
    let mut facts = Facts { seconds: 0.75, topics, ..Facts::of(system) };
    let types = by_payloads(&mut facts, &payloads, Conventions::Simlog2);
    insta::assert_snapshot!(checked(&facts, types, &["prefix \"SIM://\""]));
}

#[test]
fn vehicles_have_proxies_and_the_messages_of_their_dialect() {
    let system = |port: &str| System::Mavlink {
        url: format!("udp://127.0.0.1{port}"),
        definitions: vec!["../runtime/middleware/interfaces/tests/small.xml".to_owned()],
    };
    let field = |name: &str, ty: &str, unit: Option<&str>, sample: &str| FoundField {
        optional: false,
        name: name.to_owned(),
        ty: ty.to_owned(),
        unit: unit.map(str::to_owned),
        sample: Some(sample.to_owned()),
    };
    let dialect = |name: &str, fields: Vec<FoundField>| FoundType {
        name: name.to_owned(),
        source: TypeSource::Dialect,
        fields,
        left_out: Vec::new(),
        problem: None,
    };
    let everything = vec![
        field("wide", "float64", Some("m/s"), "0.5"),
        field("whole", "int32", Some("degE7"), "473977418"),
        field("row", "int16[3]", Some("mm"), "[1, 2, 3]"),
        field("name", "string", Some("m"), "\"a\n} // \u{1b}[2J\""),
        FoundField { sample: None, ..field("time", "uint64", Some("us"), "") },
    ];
    let types = vec![dialect("HEARTBEAT", vec![field("type", "uint8", None, "2")]), dialect("EVERYTHING", everything)];
    let heard = |path: &str, ty: &str, publishers: &[&str]| FoundTopic {
        reliable: None,
        transient_local: None,
        ..topic(path, ty, publishers, &["station"])
    };
    let problem = Some("the files define no message with this number".to_owned());
    let topics = vec![
        heard("1/HEARTBEAT", "HEARTBEAT", &["vehicle_1"]),
        heard("2/1/HEARTBEAT", "HEARTBEAT", &["vehicles_2_3"]),
        heard("2/154/HEARTBEAT", "HEARTBEAT", &["vehicles_2_3"]),
        heard("3/EVERYTHING", "EVERYTHING", &["vehicles_2_3"]),
        FoundTopic { ty: None, problem, ..heard("3/#7", "", &["vehicles_2_3"]) },
    ];
    let node = |name: &str, publishes: &[&str]| FoundNode {
        name: name.to_owned(),
        count: 1,
        publishes: publishes.iter().map(|path| (*path).to_owned()).collect(),
        ..FoundNode::default()
    };
    let nodes =
        vec![node("vehicle_1", &["1/HEARTBEAT"]), node("vehicles_2_3", &["3/EVERYTHING"]), node("station", &[])];
    let facts = Facts { seconds: 5.0, nodes, topics, types, ..Facts::of(system(":14550")) };
    insta::assert_snapshot!(checked(&facts, Types::of_found(&facts.types), &[]));
    // Without any, the space still passes its check.
    let nothing = checked(&Facts::of(system("")), Types::default(), &[]);
    assert!(
        nothing.contains("proxy vehicle \"udp://127.0.0.1:14551\"") && nothing.contains("node vehicle {"),
        "{nothing}"
    );
}

#[test]
fn settings_that_no_space_can_have_are_refused_before_anything_is_connected() {
    let said = |url: &str, settings: &[&str]| {
        let settings: Vec<String> = settings.iter().map(|&line| line.to_owned()).collect();
        check_settings(&SESAME, System::Mqtt { url: url.to_owned() }, &settings)
    };
    let secret = ["user \"scan\"", "password from env \"SECRET\""];
    assert_eq!(said("mqtt://127.0.0.1:1883", &secret), Ok(()));
    assert_eq!(said("mqtts://fleet.example", &secret), Ok(()));
    assert_eq!(
        said("mqtt://fleet.example", &secret),
        Err("a secret would go to `fleet.example` in plain text: expected `mqtts://` for an address beyond this machine"
            .to_owned())
    );
    assert!(said("mqtt://user:secret@fleet", &[]).unwrap_err().contains("is not the address of a simulator"));
    assert!(said("tcp://fleet\" {} }\u{1b}[2J", &[]).is_err());
}

/// Payloads of few shapes, on few topics.
fn anything() -> impl Strategy<Value = Vec<(String, Json)>> {
    let leaf = prop_oneof![
        Just(Json::Null),
        any::<bool>().prop_map(Json::from),
        (-3i64..3).prop_map(Json::from),
        (-3i8..3).prop_map(|n| Json::from(f64::from(n) / 2.0)),
        "\\PC{0,3}".prop_map(Json::from),
    ];
    let payload = leaf.prop_recursive(4, 16, 4, |inner| {
        let name =
            prop_oneof![Just("x".to_owned()), Just("y".to_owned()), Just("z".to_owned()), "\\PC{0,6}", "[a-z_]{1,9}"];
        prop_oneof![
            prop::collection::vec(inner.clone(), 0..3).prop_map(Json::from),
            prop::collection::btree_map(name, inner, 0..4)
                .prop_map(|fields| Json::Object(fields.into_iter().collect())),
        ]
    });
    let part = prop_oneof![
        Just("a".to_owned()),
        Just("b".to_owned()),
        Just("state".to_owned()),
        "\\PC{0,4}",
        Just("c d".to_owned())
    ];
    let path = prop::collection::vec(part, 1..4).prop_map(|parts| parts.join("/"));
    prop::collection::vec((path, payload), 0..12)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// The assertions are in [`checked`].
    #[test]
    fn whatever_is_published_anywhere_the_space_passes_its_check(published in anything(), which in 0..3) {
        let published: Vec<(String, String)> =
            published.into_iter().map(|(path, payload)| (path, payload.to_string())).collect();
        let published: Vec<(&str, &str)> = published.iter().map(|(a, b)| (a.as_str(), b.as_str())).collect();
        let (topics, payloads) = untyped(&published);
        let url = |scheme: &str| format!("{scheme}://127.0.0.1:1");
        let (system, conventions) = match which {
            0 => (System::Mqtt { url: url("mqtt") }, Conventions::Json),
            1 => (System::Simlog { url: url("http"), protocol: 2, step_ms: 20, steps: 1 }, Conventions::Simlog2),
            _ => (System::Simlog { url: url("http"), protocol: 3, step_ms: 20, steps: 1 }, Conventions::Simlog3),
        };
        let mut facts = Facts { topics, ..Facts::of(system) };
        let types = by_payloads(&mut facts, &payloads, conventions);
        checked(&facts, types, &[]);
    }

    #[test]
    fn whatever_comes_from_a_bridge_the_space_passes_its_check(published in anything()) {
        let published: Vec<(String, String)> =
            published.into_iter().map(|(path, payload)| (format!("/{path}"), payload.to_string())).collect();
        let published: Vec<(&str, &str)> = published.iter().map(|(a, b)| (a.as_str(), b.as_str())).collect();
        let (mut topics, payloads) = untyped(&published);
        for (at, topic) in topics.iter_mut().enumerate() {
            topic.ty = Some(format!("a/msg/T{}", at / 2));
        }
        let dialect = Dialect::Ros2;
        let system = System::Rosbridge { url: "ws://127.0.0.1:1".to_owned(), dialect, rosapi: false };
        let facts = Facts { topics, ..Facts::of(system) };
        let mut types = Types::of_topics(&facts, &Made, Folders { written: &[], file: FILE, dialect: Dialect::Ros2 });
        types_by_payloads(&mut types, &facts, &payloads);
        checked(&facts, types, &[]);
    }
}
