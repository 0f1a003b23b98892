//! Spaces of systems that were never there.

use std::collections::{BTreeMap, BTreeSet};

use sesame_dsl::interfaces::{Folders, Interfaces, wire_type};
use sesame_plan::{Interface, InterfaceField};
use sesame_ros2::scan::{Facts, FoundAction, FoundNode, FoundService, FoundTopic};

use super::{FILE, Origin, Types, checked_space};
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
        ty: ty.to_owned(),
        publishers: all(publishers),
        subscribers: all(subscribers),
        reliable: true,
        messages: 51,
        rate: Some(10.0),
        ..FoundTopic::default()
    }
}

fn service(path: &str, ty: &str) -> FoundService {
    FoundService { path: path.to_owned(), ty: ty.to_owned(), servers: vec!["/cell".to_owned()], clients: Vec::new() }
}

fn facts(topics: Vec<FoundTopic>, services: Vec<FoundService>, nodes: &[&str]) -> Facts {
    let node = |name: &&str| FoundNode { name: (*name).to_owned(), count: 1, ..FoundNode::default() };
    Facts {
        domain: 7,
        seconds: 5.0,
        cut: false,
        nodes: nodes.iter().map(node).collect(),
        topics,
        services,
        actions: Vec::new(),
        types: Vec::new(),
    }
}

fn layout(name: &str, fields: &[(&str, &str)]) -> Interface {
    let field = |(name, ty): &(&str, &str)| InterfaceField { name: (*name).to_owned(), ty: wire_type(ty).unwrap() };
    Interface { name: name.to_owned(), fields: fields.iter().map(field).collect() }
}

/// The space of what was found, with layouts that nodes described. It passes its check, and is formatted.
fn written(facts: &Facts, described: &[Interface]) -> String {
    let folders = Folders { written: &[], file: FILE };
    let mut types = Types::of_topics(facts, &Made, folders);
    assert!(types.missing().iter().all(|name| facts.topics.iter().any(|topic| topic.ty == *name)));
    types.add_described(&BTreeMap::from([(String::new(), described.to_vec())]), &Made, folders);
    let services = BTreeSet::from(["std_srvs/srv/Trigger".to_owned(), "std_srvs/srv/Empty".to_owned()]);
    let text = checked_space(&SESAME, facts, &mut types, Origin { folders: &[], services: &services }).unwrap();
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
            transient_local: true,
            rate: None,
            messages: 1,
            ..topic("/map", "std_msgs/msg/String", &["/cell"], &[])
        },
        topic("/clock", "rosgraph_msgs/msg/Clock", &["/cell"], &["/arm/driver"]),
        topic("/robots/r1/level", FLOAT, &["/cell"], &["/arm/driver"]),
        FoundTopic { rate: Some(123.4), ..topic("/robots/r2/level", FLOAT, &["/cell"], &["/arm/driver"]) },
        FoundTopic { reliable: false, ..topic("/command", FLOAT, &["/arm/driver", "?"], &["/cell"]) },
        topic("/wanted", FLOAT, &[], &["/cell"]),
    ];
    let services = vec![
        service("/cell/reset_world", "std_srvs/srv/Empty"),
        service("/cell/step", "std_srvs/srv/Trigger"),
        service("/cell/plan", "nav_msgs/srv/GetPlan"),
    ];
    let mut facts = facts(topics, services, &["/arm/driver", "/cell", "/idle"]);
    facts.actions.push(FoundAction { path: "/go".to_owned(), ty: "nav2_msgs/action/NavigateToPose".to_owned() });
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
