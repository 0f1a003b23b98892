//! What is at a master: nodes, topics, services, and the layouts of their messages.
//!
//! [`Facts`] are data that anybody can read. The master is asked who is there, and one publisher of each type what it
//! publishes: it hands out the definition. Nothing is registered and nothing is published.

use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, Instant};

use serde::Serialize;
use sesame_interfaces::ros1::type_name;
use sesame_plan::WireType;

use crate::connection::Stop;
use crate::contact;
use crate::definition::Texts;
use crate::master::{Address, AskError, Master, State};
use crate::protocol::header::{ANY, Header};

/// The name under which it asks.
const CALLER: &str = "/sesame_scan";

/// What every master has: a node that collects what others log.
const LOGGER: &str = "/rosout";

/// The topics of logs.
const LOGS: [&str; 2] = ["/rosout", "/rosout_agg"];

/// The services that every node has.
const EVERYWHERE: [&str; 2] = ["/get_loggers", "/set_logger_level"];

/// What was seen at a master.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Facts {
    /// The address of the master.
    pub master: String,
    /// The nodes, by name, without the one that collects logs.
    pub nodes: Vec<FoundNode>,
    /// The topics, by path, without those of logs.
    pub topics: Vec<FoundTopic>,
    /// The services, by path, without those that every node has.
    pub services: Vec<FoundService>,
    /// The types of the topics, and those that they contain, by name.
    pub types: Vec<FoundType>,
}

/// A node.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct FoundNode {
    /// Its name with its namespace, for example `/cell/arm`.
    pub name: String,
    /// Whether it answers; the master also knows nodes that have ended without a word.
    pub answers: bool,
    /// The topics that it publishes.
    pub publishes: Vec<String>,
    /// The topics to which it subscribes.
    pub subscribes: Vec<String>,
    /// The services that it serves.
    pub serves: Vec<String>,
}

/// A topic.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct FoundTopic {
    /// Its path.
    pub path: String,
    /// Its type as ROS 1 names it, for example `sensor_msgs/JointState`; `*` if nobody said it.
    #[serde(rename = "type")]
    pub ty: String,
    /// Whether its publisher keeps the last message for late subscribers, if one was asked.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub latching: Option<bool>,
    /// The node of each publisher.
    pub publishers: Vec<String>,
    /// The node of each subscriber.
    pub subscribers: Vec<String>,
}

/// A service.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct FoundService {
    /// Its path.
    pub path: String,
    /// Its type, for example `std_srvs/Trigger`, if its server answers.
    #[serde(rename = "type", skip_serializing_if = "Option::is_none")]
    pub ty: Option<String>,
    /// Its server.
    pub servers: Vec<String>,
}

/// A type of messages.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct FoundType {
    /// Its name, for example `sensor_msgs/JointState`.
    pub name: String,
    /// Its MD5, if its layout is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub md5: Option<String>,
    /// Its fields in the order of the wire; none if its layout is unknown.
    pub fields: Vec<FoundField>,
    /// Why its layout is unknown.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub problem: Option<String>,
}

/// A field of a type.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct FoundField {
    /// Its name.
    pub name: String,
    /// Its type, as in a `.msg` file.
    #[serde(rename = "type")]
    pub ty: String,
}

/// Why nothing can be seen.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ScanError {
    /// This is no address.
    #[error("`{0}` is not the address of a master, such as `http://127.0.0.1:11311`")]
    Address(String),
    /// The master does not answer.
    #[error(transparent)]
    Ask(#[from] AskError),
}

/// Looks at what is at a master. Nodes that were not asked within this time count as those that do not answer.
pub fn scan(master: &str, within: Duration) -> Result<Facts, ScanError> {
    let at = Address::read(master).ok_or_else(|| ScanError::Address(master.to_owned()))?;
    let asked = Master { at, caller: CALLER.to_owned(), uri: String::new(), stop: Stop::default() };
    let state = asked.state()?;
    let declared: BTreeMap<String, String> = asked.types()?.into_iter().collect();
    let scan = Scan { master: asked, until: Instant::now() + within };
    let mut nodes = nodes(&state);
    for node in &mut nodes {
        node.answers = scan.has_time() && scan.master.is_alive(&node.name);
    }
    let answering: BTreeSet<&str> = nodes.iter().filter(|node| node.answers).map(|node| node.name.as_str()).collect();
    let mut topics = topics(&state, &declared);
    let mut types = BTreeMap::new();
    for topic in &mut topics {
        let mut publishers = topic.publishers.iter().filter(|node| answering.contains(node.as_str()));
        if let Some(header) = publishers.find_map(|node| scan.publisher(node, topic)) {
            topic.latching = Some(header.is("latching"));
            header.get("type").clone_into(&mut topic.ty);
            describe(&header, &mut types);
        }
        if topic.ty != ANY && !types.contains_key(&topic.ty) {
            let problem = Some("nobody who publishes it says what it is".to_owned());
            let found = FoundType { name: topic.ty.clone(), md5: None, fields: Vec::new(), problem };
            types.insert(topic.ty.clone(), found);
        }
    }
    let services = services(&state, |path| scan.server(path));
    Ok(Facts { master: master.to_owned(), nodes, topics, services, types: types.into_values().collect() })
}

struct Scan {
    master: Master,
    until: Instant,
}

impl Scan {
    fn has_time(&self) -> bool {
        Instant::now() < self.until
    }

    /// What a publisher says of a topic.
    fn publisher(&self, node: &str, topic: &FoundTopic) -> Option<Header> {
        if !self.has_time() {
            return None;
        }
        let uri = self.master.ask("lookupNode", &[node]).ok()?;
        let at = Address::read(uri.text()?)?;
        let (_, header) = contact::subscribe(&at, [CALLER, &topic.path, &topic.ty], &self.master.stop).ok()?;
        (header.get("error").is_empty() && !header.get("type").is_empty()).then_some(header)
    }

    /// The type of a service, as its server says.
    fn server(&self, path: &str) -> Option<String> {
        if !self.has_time() {
            return None;
        }
        let at = self.master.server(path).ok()??;
        let (_, header) = contact::serve(&at, [CALLER, path], true, &self.master.stop).ok()?;
        Some(header.get("type").to_owned()).filter(|ty| !ty.is_empty())
    }
}

fn nodes(state: &State) -> Vec<FoundNode> {
    let mut nodes: BTreeMap<String, FoundNode> = BTreeMap::new();
    let mut add = |side: &[(String, Vec<String>)], list: fn(&mut FoundNode) -> &mut Vec<String>| {
        for (path, names) in side {
            for name in names.iter().filter(|name| *name != LOGGER) {
                let node = nodes
                    .entry(name.clone())
                    .or_insert_with(|| FoundNode { name: name.clone(), ..FoundNode::default() });
                if !LOGS.contains(&path.as_str()) && !is_everywhere(path) {
                    list(node).push(path.clone());
                }
            }
        }
    };
    add(&state.publishers, |node| &mut node.publishes);
    add(&state.subscribers, |node| &mut node.subscribes);
    add(&state.servers, |node| &mut node.serves);
    let mut nodes: Vec<FoundNode> = nodes.into_values().collect();
    for node in &mut nodes {
        for paths in [&mut node.publishes, &mut node.subscribes, &mut node.serves] {
            paths.sort_unstable();
        }
    }
    nodes
}

fn topics(state: &State, declared: &BTreeMap<String, String>) -> Vec<FoundTopic> {
    let mut topics: BTreeMap<String, FoundTopic> = BTreeMap::new();
    let mut add = |side: &[(String, Vec<String>)], list: fn(&mut FoundTopic) -> &mut Vec<String>| {
        for (path, names) in side.iter().filter(|(path, _)| !LOGS.contains(&path.as_str())) {
            let topic = topics.entry(path.clone()).or_insert_with(|| FoundTopic {
                path: path.clone(),
                ty: declared.get(path).cloned().unwrap_or_else(|| ANY.to_owned()),
                ..FoundTopic::default()
            });
            list(topic).extend(names.iter().cloned());
            list(topic).sort_unstable();
        }
    };
    add(&state.publishers, |topic| &mut topic.publishers);
    add(&state.subscribers, |topic| &mut topic.subscribers);
    topics.into_values().collect()
}

fn services(state: &State, ty: impl Fn(&str) -> Option<String>) -> Vec<FoundService> {
    let found = state.servers.iter().filter(|(path, _)| !is_everywhere(path));
    let service = |(path, servers): &(String, Vec<String>)| FoundService {
        path: path.clone(),
        ty: ty(path),
        servers: servers.clone(),
    };
    let mut services: Vec<FoundService> = found.map(service).collect();
    services.sort_by(|one, other| one.path.cmp(&other.path));
    services
}

/// Whether every node has this service.
fn is_everywhere(path: &str) -> bool {
    EVERYWHERE.iter().any(|end| path.ends_with(end))
}

/// Adds the type that a publisher hands out, and those that it contains.
fn describe(header: &Header, types: &mut BTreeMap<String, FoundType>) {
    let name = header.get("type");
    if types.get(name).is_some_and(|known| known.problem.is_none()) {
        return;
    }
    let described = || {
        let texts = Texts::of_definition(name, header.get("message_definition"))?;
        let mut found = Vec::new();
        for interface in texts.layout(name)? {
            let name = type_name(&interface.name);
            // `time` and `duration` are not messages.
            if name.starts_with("builtin_interfaces/") {
                continue;
            }
            let fields = interface.fields.iter();
            let fields = fields.map(|field| FoundField { name: field.name.clone(), ty: written(&field.ty) }).collect();
            found.push(FoundType { md5: Some(texts.md5(&name)?), name, fields, problem: None });
        }
        Ok(found)
    };
    match described() {
        Ok(found) if found.last().and_then(|it| it.md5.as_deref()) == Some(header.get("md5sum")) => {
            types.extend(found.into_iter().map(|found| (found.name.clone(), found)));
        }
        other => {
            let problem = other.map_or_else(
                |error: crate::definition::TypeError| error.to_string(),
                |_| "its publisher hands out a definition that does not have its MD5".to_owned(),
            );
            let found = FoundType { name: name.to_owned(), md5: None, fields: Vec::new(), problem: Some(problem) };
            types.insert(name.to_owned(), found);
        }
    }
}

/// A type as a `.msg` file of ROS 1 writes it.
fn written(ty: &WireType) -> String {
    match ty {
        WireType::Primitive { primitive } => format!("{primitive:?}").to_lowercase(),
        WireType::String => "string".to_owned(),
        WireType::WString => "wstring".to_owned(),
        WireType::Interface { name } => match name.as_str() {
            "builtin_interfaces/msg/Time" => "time".to_owned(),
            "builtin_interfaces/msg/Duration" => "duration".to_owned(),
            name => type_name(name),
        },
        WireType::Array { of, length } => format!("{}[{length}]", written(of)),
        WireType::Sequence { of, .. } => format!("{}[]", written(of)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(definition: &str, md5: &str) -> Header {
        Header::new(&[("type", "p/M"), ("md5sum", md5), ("message_definition", definition)])
    }

    #[test]
    fn what_every_node_has_is_left_out() {
        let side = |pairs: &[(&str, &[&str])]| -> Vec<(String, Vec<String>)> {
            let texts = |nodes: &[&str]| nodes.iter().map(|&it| it.to_owned()).collect();
            pairs.iter().map(|(name, nodes)| ((*name).to_owned(), texts(nodes))).collect()
        };
        let state = State {
            publishers: side(&[("/rosout", &["/arm"]), ("/joints", &["/arm"]), ("/rosout_agg", &["/rosout"])]),
            subscribers: side(&[("/rosout", &["/rosout"]), ("/a", &["/arm"]), ("/joints", &["/view", "/arm"])]),
            servers: side(&[("/arm/get_loggers", &["/arm"]), ("/grip", &["/arm"])]),
        };
        let nodes = nodes(&state);
        assert_eq!(nodes.iter().map(|node| node.name.as_str()).collect::<Vec<_>>(), ["/arm", "/view"]);
        assert_eq!(nodes[0].publishes, ["/joints"]);
        assert_eq!(nodes[0].subscribes, ["/a", "/joints"]);
        assert_eq!(nodes[0].serves, ["/grip"]);
        let topics = topics(&state, &[("/joints".to_owned(), "sensor_msgs/JointState".to_owned())].into());
        let shown: Vec<_> = topics.iter().map(|it| (it.path.as_str(), it.ty.as_str(), it.subscribers.len())).collect();
        assert_eq!(shown, [("/a", "*", 1), ("/joints", "sensor_msgs/JointState", 2)]);
        assert_eq!(services(&state, |_| None).len(), 1);
    }

    #[test]
    fn a_type_is_what_its_publisher_hands_out_if_it_has_its_md5() {
        let text = "time at\nbyte[4] raw\nInner[] all\n\n=========================================================\
                    =======================\nMSG: p/Inner\nfloat64 x\n";
        let md5 = Texts::of_definition("p/M", text).unwrap().md5("p/M").unwrap();
        let mut types = BTreeMap::new();
        describe(&header(text, "0123"), &mut types);
        let problem = types["p/M"].problem.clone().unwrap();
        assert_eq!(problem, "its publisher hands out a definition that does not have its MD5");
        describe(&header("Inner one", &md5), &mut types);
        assert_eq!(types["p/M"].problem.clone().unwrap(), "there is no definition of `p/Inner`");
        describe(&header(text, &md5), &mut types);
        let fields: Vec<&str> = types["p/M"].fields.iter().map(|field| field.ty.as_str()).collect();
        assert_eq!(fields, ["time", "int8[4]", "p/Inner[]"]);
        assert_eq!(types.keys().collect::<Vec<_>>(), ["p/Inner", "p/M"]);
    }
}
