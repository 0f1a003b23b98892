//! What is at a master: nodes, topics, services, and the layouts of their messages.
//!
//! The master is asked who is there, and publishers what they publish: they hand out the definitions of their types.
//! Nothing is registered and nothing is published, but messages of publishers are counted for a while. Types have the
//! names that a space has for them, which are those of ROS 2.

use std::collections::{BTreeMap, BTreeSet};
use std::thread;
use std::time::{Duration, Instant};

use sesame_interfaces::ros1::interface;
use sesame_plan::Interface;
use sesame_scan::{Arrivals, Facts, FoundNode, FoundService, FoundTopic, System};

use crate::connection::{Connection, Stop};
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

/// How many topics are kept at most, and how many nodes and services.
pub const MOST: usize = 10_000;

/// The most publishers whose messages are counted.
const MOST_COUNTED: usize = 200;

/// What was found at a master.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// All of it, but the types.
    pub facts: Facts,
    /// Types as publishers describe them, each after those that it contains.
    pub layouts: BTreeMap<String, Vec<Interface>>,
}

/// Why nothing can be seen.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ScanError {
    /// This is not an address.
    #[error("`{0}` is not the address of a master, such as `http://127.0.0.1:11311`")]
    Address(String),
    /// The master does not answer.
    #[error(transparent)]
    Ask(#[from] AskError),
}

/// Looks at what is at a master, and counts messages for a while. Nodes that were not asked within the time for asking
/// count as those that do not answer.
pub fn scan(master: &str, asking: Duration, listening: Duration) -> Result<Found, ScanError> {
    let at = Address::read(master).ok_or_else(|| ScanError::Address(master.to_owned()))?;
    let asked = Master { at, caller: CALLER.to_owned(), uri: String::new(), stop: Stop::default() };
    let state = asked.state()?;
    let declared: BTreeMap<String, String> = asked.types()?.into_iter().collect();
    let scan = Scan { master: asked, until: Instant::now() + asking };
    let (mut nodes, mut topics) = (nodes(&state), topics(&state, &declared));
    let mut services = services(&state);
    let cut = [nodes.len(), topics.len(), services.len()].into_iter().any(|found| found > MOST);
    nodes.truncate(MOST);
    topics.truncate(MOST);
    services.truncate(MOST);
    for node in &mut nodes {
        node.answers = Some(scan.has_time() && scan.master.is_alive(&node.name));
    }
    for service in &mut services {
        service.ty = scan.server(&service.path);
    }
    let answering: BTreeSet<&str> =
        nodes.iter().filter(|node| node.answers == Some(true)).map(|node| node.name.as_str()).collect();
    let mut layouts = BTreeMap::new();
    let mut counted = Vec::new();
    for (at, topic) in topics.iter_mut().enumerate() {
        let names: BTreeSet<String> = topic.publishers.iter().cloned().collect();
        let mut header = None;
        for node in names.iter().filter(|node| answering.contains(node.as_str())) {
            if header.is_some() && counted.len() >= MOST_COUNTED {
                break;
            }
            let Some((connection, theirs)) = scan.publisher(node, topic) else { continue };
            header.get_or_insert(theirs);
            if counted.len() < MOST_COUNTED {
                counted.push((at, connection));
            }
        }
        if let Some(header) = header {
            learn(topic, &header, &mut layouts);
        }
    }
    let heard = count(counted, listening);
    for (at, arrivals) in heard {
        topics[at].messages += arrivals.messages();
        topics[at].rate = match (topics[at].rate, arrivals.rate()) {
            (Some(one), Some(other)) => Some(one + other),
            (one, other) => one.or(other),
        };
    }
    let system = System::Ros1 { master: master.to_owned() };
    let facts = Facts { seconds: listening.as_secs_f64(), cut, nodes, topics, services, ..Facts::of(system) };
    Ok(Found { facts, layouts })
}

/// Counts the messages of publishers, each on a thread of its own, for so long. They are thrown away.
fn count(publishers: Vec<(usize, Connection)>, listening: Duration) -> Vec<(usize, Arrivals)> {
    let begin = Instant::now();
    let one = |(at, mut connection): (usize, Connection)| {
        let mut arrivals = Arrivals::default();
        // One that always has something to read never waits, so its time is looked at here.
        while begin.elapsed() < listening && connection.skip_frame(begin + listening).is_ok() {
            arrivals.add(begin.elapsed());
        }
        (at, arrivals)
    };
    thread::scope(|scope| {
        let threads: Vec<_> = publishers.into_iter().map(|publisher| scope.spawn(move || one(publisher))).collect();
        // None of them panics.
        threads.into_iter().filter_map(|thread| thread.join().ok()).collect()
    })
}

struct Scan {
    master: Master,
    until: Instant,
}

impl Scan {
    fn has_time(&self) -> bool {
        Instant::now() < self.until
    }

    /// What a publisher says of a topic, with the connection on which its messages follow.
    fn publisher(&self, node: &str, topic: &FoundTopic) -> Option<(Connection, Header)> {
        if !self.has_time() {
            return None;
        }
        let uri = self.master.ask("lookupNode", &[node]).ok()?;
        let at = Address::read(uri.text()?)?;
        let (connection, header) = contact::subscribe(&at, [CALLER, &topic.path, ANY], &self.master.stop).ok()?;
        (header.get("error").is_empty() && !header.get("type").is_empty()).then_some((connection, header))
    }

    /// The type of a service, as its server says.
    fn server(&self, path: &str) -> Option<String> {
        if !self.has_time() {
            return None;
        }
        let at = self.master.server(path).ok()??;
        let (_, header) = contact::serve(&at, [CALLER, path], true, &self.master.stop).ok()?;
        let ty = header.get("type");
        (!ty.is_empty()).then(|| interface(ty).replacen("/msg/", "/srv/", 1))
    }
}

fn nodes(state: &State) -> Vec<FoundNode> {
    let mut nodes: BTreeMap<String, FoundNode> = BTreeMap::new();
    let mut add = |side: &[(String, Vec<String>)], list: fn(&mut FoundNode) -> &mut Vec<String>| {
        for (path, names) in side {
            for name in names.iter().filter(|name| *name != LOGGER) {
                let node = nodes.entry(name.clone()).or_insert_with(|| FoundNode {
                    name: name.clone(),
                    count: 1,
                    ..FoundNode::default()
                });
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
                ty: declared.get(path).filter(|ty| *ty != ANY).map(|ty| interface(ty)),
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

fn services(state: &State) -> Vec<FoundService> {
    let found = state.servers.iter().filter(|(path, _)| !is_everywhere(path));
    let service = |(path, servers): &(String, Vec<String>)| FoundService {
        path: path.clone(),
        servers: servers.clone(),
        ..FoundService::default()
    };
    let mut services: Vec<FoundService> = found.map(service).collect();
    services.sort_by(|one, other| one.path.cmp(&other.path));
    services
}

/// Whether every node has this service.
fn is_everywhere(path: &str) -> bool {
    EVERYWHERE.iter().any(|end| path.ends_with(end))
}

/// What a publisher says of its topic, and the layout of its type if it was not known before.
fn learn(topic: &mut FoundTopic, header: &Header, layouts: &mut BTreeMap<String, Vec<Interface>>) {
    let (name, md5) = (header.get("type"), header.get("md5sum"));
    let ty = interface(name);
    topic.latching = Some(header.is("latching"));
    topic.hash =
        Some(md5.to_owned()).filter(|md5| md5.len() == 32 && md5.bytes().all(|digit| digit.is_ascii_hexdigit()));
    topic.ty = Some(ty.clone());
    if layouts.contains_key(&ty) {
        return;
    }
    let described = || {
        let texts = Texts::of_definition(name, header.get("message_definition"))?;
        Ok((texts.md5(name)?, texts.layout(name)?))
    };
    match described() {
        Ok((of_definition, layout)) if of_definition == md5 => {
            layouts.insert(ty, layout);
        }
        Ok(_) => {
            let problem = "its publisher hands out a definition that does not have its MD5";
            topic.problem = Some(problem.to_owned());
        }
        Err(error) => topic.problem = Some(crate::definition::TypeError::to_string(&error)),
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
            let texts = |nodes: &[&str]| nodes.iter().map(|&node| node.to_owned()).collect();
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
        let shown: Vec<_> =
            topics.iter().map(|topic| (topic.path.as_str(), topic.ty.as_deref(), topic.subscribers.len())).collect();
        assert_eq!(shown, [("/a", None, 1), ("/joints", Some("sensor_msgs/msg/JointState"), 2)]);
        assert_eq!(services(&state).len(), 1);
    }

    #[test]
    fn a_type_is_what_its_publisher_hands_out_if_it_has_its_md5() {
        let text = "time at\nbyte[4] raw\nInner[] all\n\n=========================================================\
                    =======================\nMSG: p/Inner\nfloat64 x\n";
        let md5 = Texts::of_definition("p/M", text).unwrap().md5("p/M").unwrap();
        let mut layouts = BTreeMap::new();
        let mut learned = |text: &str, md5: &str| {
            let mut topic = FoundTopic::default();
            learn(&mut topic, &header(text, md5), &mut layouts);
            topic
        };
        let problem = learned(text, "0123").problem.unwrap();
        assert_eq!(problem, "its publisher hands out a definition that does not have its MD5");
        assert_eq!(learned("Inner one", &md5).problem.unwrap(), "there is no definition of `p/Inner`");
        let topic = learned(text, &md5);
        assert_eq!((topic.ty.as_deref(), topic.hash, topic.problem), (Some("p/msg/M"), Some(md5), None));
        let names: Vec<&str> = layouts["p/msg/M"].iter().map(|interface| interface.name.as_str()).collect();
        assert_eq!(names, ["builtin_interfaces/msg/Time", "p/msg/Inner", "p/msg/M"]);
    }
}
