//! A server that answers as rosapi does, in both kinds of ROS; one without it; and what anybody may say.

use std::net::SocketAddr;
use std::thread;

use futures_util::{SinkExt as _, StreamExt as _};
use in_words::words;
use proptest::prelude::*;
use serde_json::json;
use tokio::net::TcpListener;
use tokio_tungstenite::tungstenite::Message as Frame;

use super::*;

/// Types in words, as a `.msg` file has them.
mod in_words {
    use sesame_plan::{Interface, WireType};

    fn ty(ty: &WireType) -> String {
        match ty {
            WireType::Primitive { primitive } => format!("{primitive:?}").to_lowercase(),
            WireType::String { .. } => "string".to_owned(),
            WireType::WString { .. } => "wstring".to_owned(),
            WireType::Interface { name } => name.clone(),
            WireType::Array { of, length } => format!("{}[{length}]", self::ty(of)),
            WireType::Sequence { of, .. } => format!("{}[]", self::ty(of)),
        }
    }

    pub(super) fn words(interface: &Interface) -> String {
        let fields: Vec<String> =
            interface.fields.iter().map(|field| format!("{} {}", ty(&field.ty), field.name)).collect();
        format!("{}: {}", interface.name, fields.join(", "))
    }
}

/// What a server answers to a service with an argument; nothing where it does not have the service.
type Answers = fn(service: &str, argument: &str) -> Option<Json>;

fn serve(answers: Answers) -> SocketAddr {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    listener.set_nonblocking(true).unwrap();
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    let serve = async move {
        let listener = TcpListener::from_std(listener).unwrap();
        let (stream, _) = listener.accept().await.unwrap();
        let mut socket = tokio_tungstenite::accept_async(stream).await.unwrap();
        while let Some(Ok(Frame::Text(text))) = socket.next().await {
            let said: Json = serde_json::from_str(&text).unwrap();
            let answers = if said["op"] == "call_service" {
                let argument = said["args"].as_object().and_then(|arguments| arguments.values().next()?.as_str());
                let service = said["service"].as_str().unwrap();
                let values = answers(service.strip_prefix("/rosapi/").unwrap(), argument.unwrap_or_default());
                let result = values.is_some();
                let values = values.unwrap_or_else(|| json!(format!("Service {service} does not exist")));
                vec![json!({ "op": "service_response", "id": said["id"], "service": service, "values": values,
                            "result": result })]
            } else if said["topic"] == "/nothing" {
                vec![json!({ "op": "status", "id": said["id"], "level": "error", "msg": "no such topic" })]
            } else {
                let message = |x: f64| json!({ "op": "publish", "topic": said["topic"], "msg": { "data": x } });
                vec![message(0.0), json!({ "op": "publish", "topic": "/other", "msg": {} }), message(1.5)]
            };
            for answer in answers {
                socket.send(Frame::text(answer.to_string())).await.unwrap();
            }
        }
    };
    thread::spawn(move || runtime.block_on(serve));
    address
}

fn scanner(address: SocketAddr) -> Scanner {
    let options = ScanOptions { url: format!("ws://{address}"), token: None, trust: None, folder: PathBuf::new() };
    Scanner::connect(&options, None).unwrap()
}

fn typedef(name: &str, fields: &[(&str, &str, i64)]) -> Json {
    let of = |part: fn(&(&str, &str, i64)) -> Json| fields.iter().map(part).collect::<Vec<Json>>();
    json!({
        "type": name,
        "fieldnames": of(|field| field.0.into()),
        "fieldtypes": of(|field| field.1.into()),
        "fieldarraylen": of(|field| field.2.into()),
        "examples": [], "constnames": [], "constvalues": [],
    })
}

/// As the rosapi of ROS 2 does.
fn ros2(service: &str, argument: &str) -> Option<Json> {
    Some(match (service, argument) {
        ("topics", _) => json!({ "topics": ["/aim", "/joints", "/rosout", "/client_count"],
                                 "types": ["std_msgs/msg/Float64", "cell_msgs/msg/Joints", "rcl_interfaces/msg/Log",
                                           "std_msgs/msg/Int32"] }),
        ("services", _) => json!({ "services": ["/reset", "/rosapi/topics", "/arm/get_parameters"] }),
        ("service_type", "/reset") => json!({ "type": "std_srvs/srv/Trigger" }),
        ("nodes", _) => json!({ "nodes": ["/arm", "/rosapi", "/rosbridge_websocket", "/view"] }),
        ("node_details", "/arm") => json!({ "publishing": ["/joints", "/rosout"], "subscribing": ["/aim"],
                                            "services": ["/reset", "/arm/get_parameters"] }),
        ("node_details", "/view") => json!({ "publishing": [], "subscribing": ["/joints", "/wanted"], "services": [] }),
        ("message_details", "cell_msgs/msg/Joints") => json!({ "typedefs": [
            typedef("cell_msgs/Joints", &[("header", "std_msgs/Header", -1), ("position", "double", 0),
                                          ("_some", "double, 3", 0), ("covariance", "float64", 36)]),
            typedef("std_msgs/Header", &[("stamp", "builtin_interfaces/Time", -1), ("frame_id", "string", -1)]),
        ] }),
        _ => return None,
    })
}

#[test]
fn rosapi_of_ros_2_says_who_is_there() {
    let mut scanner = scanner(serve(ros2));
    assert!(scanner.ask(None).unwrap());
    let described = scanner.describe(&["cell_msgs/msg/Joints".to_owned(), "cell_msgs/msg/None".to_owned()]).unwrap();
    let layouts: Vec<String> = described["cell_msgs/msg/Joints"].iter().map(words).collect();
    assert_eq!(
        layouts,
        [
            "cell_msgs/msg/Joints: std_msgs/msg/Header header, float64[] position, float64[] some, \
             float64[36] covariance",
            "std_msgs/msg/Header: builtin_interfaces/msg/Time stamp, string frame_id",
        ]
    );
    assert_eq!(described.len(), 1);
    scanner.listen(Duration::from_millis(300)).unwrap();
    let (facts, payloads) = scanner.finish();
    let System::Rosbridge { dialect: Dialect::Ros2, rosapi: true, .. } = &facts.system else {
        panic!("{:?}", facts.system)
    };
    let topics: Vec<_> = facts
        .topics
        .iter()
        .map(|topic| {
            (
                topic.path.as_str(),
                topic.ty.as_deref(),
                topic.publishers.join(","),
                topic.subscribers.join(","),
                topic.messages,
            )
        })
        .collect();
    assert_eq!(
        topics,
        [
            ("/aim", Some("std_msgs/msg/Float64"), String::new(), "/arm".to_owned(), 2),
            ("/joints", Some("cell_msgs/msg/Joints"), "/arm".to_owned(), "/view".to_owned(), 2),
            ("/wanted", None, String::new(), "/view".to_owned(), 2),
        ]
    );
    assert_eq!(payloads.get("/aim").unwrap().count(), 2);
    assert_eq!(payloads.get("/other"), None, "nobody asked for it");
    let [reset] = &facts.services[..] else { panic!("{:?}", facts.services) };
    assert_eq!((reset.ty.as_deref(), &reset.servers[..]), (Some("std_srvs/srv/Trigger"), &["/arm".to_owned()][..]));
    let nodes: Vec<&str> = facts.nodes.iter().map(|node| node.name.as_str()).collect();
    assert_eq!(nodes, ["/arm", "/view"]);
    assert_eq!(facts.nodes[0].publishes, ["/joints"]);
}

/// As a rosapi of ROS 1 without lists of types and nodes.
fn ros1(service: &str, argument: &str) -> Option<Json> {
    Some(match (service, argument) {
        ("topics", _) => json!({ "topics": ["/aim"] }),
        ("topic_type", "/aim") => json!({ "type": "p/Aim" }),
        ("publishers", "/aim") => json!({ "publishers": ["/arm"] }),
        ("subscribers", "/aim") => json!({ "subscribers": ["/view", "/arm"] }),
        ("message_details", "p/Aim") => json!({ "typedefs": [
            typedef("p/Aim", &[("at", "time", -1), ("raw", "byte", 4), ("all", "p/Inner", 0)]),
            typedef("time", &[("secs", "int32", -1), ("nsecs", "int32", -1)]),
            typedef("p/Inner", &[("x", "float32", -1)]),
        ] }),
        _ => return None,
    })
}

#[test]
fn rosapi_of_ros_1_says_it_in_its_own_words() {
    let mut scanner = scanner(serve(ros1));
    assert!(scanner.ask(None).unwrap());
    let layouts = scanner.describe(&["p/msg/Aim".to_owned()]).unwrap();
    let layouts: Vec<String> = layouts["p/msg/Aim"].iter().map(words).collect();
    let expected =
        ["p/msg/Aim: builtin_interfaces/msg/Time at, uint8[4] raw, p/msg/Inner[] all", "p/msg/Inner: float32 x"];
    assert_eq!(layouts, expected);
    let facts = scanner.facts();
    assert!(matches!(facts.system, System::Rosbridge { dialect: Dialect::Ros1, .. }));
    assert_eq!(facts.topics[0].ty.as_deref(), Some("p/msg/Aim"));
    assert_eq!(facts.topics[0].subscribers, ["/arm", "/view"]);
    assert_eq!(facts.nodes.len(), 2);
}

#[test]
fn without_rosapi_topics_that_are_named_are_listened_to() {
    let mut scanner = scanner(serve(|_, _| None));
    assert!(!scanner.ask(None).unwrap());
    let wanted = |path: &str, ty: Option<&str>| Wanted { path: path.to_owned(), ty: ty.map(str::to_owned) };
    scanner.add(&[wanted("/aim", Some("std_msgs/msg/Float64")), wanted("/nothing", None), wanted("/untyped", None)]);
    scanner.listen(Duration::from_millis(300)).unwrap();
    let (facts, payloads) = scanner.finish();
    let said: Vec<_> = facts.topics.iter().map(|topic| (topic.messages, topic.problem.as_deref())).collect();
    let untyped = "messages come, but nobody says their type; name it with `--topic NAME:TYPE`";
    assert_eq!(said, [(2, None), (0, Some("the bridge says: no such topic")), (2, Some(untyped))]);
    assert_eq!(payloads.get("/aim").unwrap().count(), 2);
}

proptest! {
    #[test]
    fn whatever_an_answer_says_nothing_panics(answer in "\\PC*", field in "[a-z]*") {
        for answer in [json!(answer), json!({ &*field: answer }), json!({ "typedefs": [{ "type": answer }] }),
                       json!({ "topics": [answer, 1], "types": [null] })] {
            rosapi::layouts(&answer);
            rosapi::topics(&answer);
            rosapi::details(&answer);
        }
    }

    #[test]
    fn a_type_is_understood_whole_or_not_at_all(ty in "\\PC{0,12}", length in any::<i64>()) {
        let answer = json!({ "typedefs": [typedef("a/B", &[("x", &ty, length)])] });
        if let Some(layouts) = rosapi::layouts(&answer) {
            prop_assert_eq!(layouts[0].fields.len(), 1);
        }
    }
}
