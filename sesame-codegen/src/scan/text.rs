//! The text of a space from what was found.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use sesame_dsl::diagnostic::visible;
use sesame_legacy::Names;
use sesame_notation::quoted;
use sesame_ros2::scan::{CLOCK, Facts, FoundNode, FoundService, FoundTopic, NOBODY, TypeSource};

use super::groups::{Line, fold};
use super::types::Types;
use super::{blocks, is_ros_name};

/// Of what the space is made.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Origin<'a> {
    /// The folders with definitions of types, as they are written.
    pub(crate) folders: &'a [String],
    /// The types of services that have a layout.
    pub(crate) services: &'a BTreeSet<String>,
}

/// The names that stand for what was found.
struct Named<'a> {
    simulator: String,
    /// Messages by their types.
    messages: BTreeMap<&'a str, String>,
    /// Topics as the space has them.
    topics: Vec<(String, Line<'a>)>,
    services: Vec<(String, &'a FoundService)>,
    nodes: Vec<(String, &'a FoundNode)>,
}

/// What cannot be said in the language, one comment each.
#[derive(Default)]
struct Unsaid(Vec<String>);

impl Unsaid {
    fn decide(&mut self, what: &str) {
        self.0.push(format!("// decide: {}\n", on_one_line(what)));
    }
}

/// A space with its system, in need of formatting.
pub(crate) fn space(facts: &Facts, types: &Types, origin: Origin<'_>) -> String {
    let mut unsaid = Unsaid::default();
    let clock = clock(facts);
    let topics = sayable_topics(facts, types, origin, clock, &mut unsaid);
    let services = sayable_services(facts, origin, &mut unsaid);
    for action in &facts.actions {
        unsaid.decide(&format!("the language has no actions: {} of type {}", quoted(&action.path), quoted(&action.ty)));
    }
    let needed = types.needed(topics.iter().map(|topic| topic.ty.as_str()));
    let mut names = Names::default();
    let named = name_all(&mut names, facts, &needed, &topics, &services, &mut unsaid);
    let simulator = &named.simulator;

    let mut text = format!(
        "// What `sesamec scan ros2` found in domain {} in {} s. Each `decide:` is a question to a person.\n",
        facts.domain, facts.seconds
    );
    if facts.cut {
        text.push_str("// decide: there are more than 10,000 publishers and subscribers; the rest is missing here\n");
    }
    _ = writeln!(text, "space domain_{}\n\nsystem {{", facts.domain);
    text.push_str(&simulator_block(simulator, facts, origin, clock));
    let sections = [
        blocks::messages(types, &named.messages, &needed),
        topic_lines(&named),
        service_lines(&named),
        unsaid.0.concat(),
        nodes(&named),
    ];
    for section in sections.iter().filter(|section| !section.is_empty()) {
        _ = write!(text, "\n{section}");
    }
    text.push_str("}\n");
    text
}

/// The topic of a clock that somebody publishes.
fn clock(facts: &Facts) -> Option<&str> {
    let clocks = facts.topics.iter().filter(|topic| topic.ty == CLOCK && !topic.publishers.is_empty());
    let mut clocks: Vec<&str> = clocks.map(|topic| topic.path.as_str()).filter(|path| is_ros_name(path)).collect();
    clocks.sort_by_key(|path| *path != "/clock");
    clocks.first().copied()
}

fn simulator_block(name: &str, facts: &Facts, origin: Origin<'_>, clock: Option<&str>) -> String {
    let mut text = String::from(
        "// decide: how the system is started, with `launch` here or in each node; for example\n\
         // launch \"ros2\" \"launch\" \"PACKAGE\" \"FILE\" \"{ros-args}\"\n",
    );
    _ = writeln!(text, "simulator {name} = ros2 {{\ndomain {}", facts.domain);
    if !origin.folders.is_empty() {
        let folders: Vec<String> = origin.folders.iter().map(|folder| quoted(folder)).collect();
        _ = writeln!(text, "types  {}", folders.join(", "));
    }
    match clock {
        Some(clock) => _ = writeln!(text, "clock  {}", quoted(clock)),
        None => text.push_str("// decide: nobody publishes a clock, so simulation time is wall time\n"),
    }
    for word in ["step", "reset"] {
        for service in facts.services.iter().filter(|service| is_control(service, word)) {
            let path = quoted(&service.path);
            let clause = if word == "step" {
                format!("step 20ms by service {path}` (with the length of a step) if this takes one step")
            } else {
                format!("reset by service {path}` if this sets the simulator to time zero")
            };
            _ = writeln!(text, "// decide: `{}", on_one_line(&clause));
        }
    }
    text.push_str("}\n");
    text
}

/// Whether a service may be the one that steps or resets a simulator.
fn is_control(service: &FoundService, word: &str) -> bool {
    let last = service.path.rsplit('/').next().unwrap_or_default().to_ascii_lowercase();
    let fits = matches!(service.ty.as_str(), "std_srvs/srv/Trigger" | "std_srvs/srv/Empty");
    fits && is_ros_name(&service.path) && !service.servers.is_empty() && last.contains(word)
}

/// Topics that the space can have; the others become comments.
fn sayable_topics<'a>(
    facts: &'a Facts,
    types: &Types,
    origin: Origin<'_>,
    clock: Option<&str>,
    unsaid: &mut Unsaid,
) -> Vec<&'a FoundTopic> {
    let (mut paths, mut sayable) = (BTreeSet::new(), Vec::new());
    for topic in &facts.topics {
        let what = format!("{} of type {}", quoted(&topic.path), quoted(&topic.ty));
        if topic.ty == CLOCK && clock == Some(topic.path.as_str()) {
            continue;
        }
        if !is_ros_name(&topic.path) {
            unsaid.decide(&format!("topic {what} has no name of ROS"));
        } else if let Some(problem) = types.problem(&topic.ty) {
            unsaid.decide(&format!("topic {what} cannot be used: {problem}"));
        } else if types.source(&topic.ty) == TypeSource::Unknown {
            let add = if origin.folders.is_empty() { "name one with `types`" } else { "name another one with `types`" };
            unsaid.decide(&format!("no folder has the type of topic {what}, and no node described it; {add}"));
        } else if !paths.insert(topic.path.as_str()) {
            unsaid.decide(&format!("topic {what} is used with another type as well"));
        } else {
            sayable.push(topic);
        }
    }
    sayable
}

/// Services that the space can have; the others become comments.
fn sayable_services<'a>(facts: &'a Facts, origin: Origin<'_>, unsaid: &mut Unsaid) -> Vec<&'a FoundService> {
    let (mut paths, mut sayable) = (BTreeSet::new(), Vec::new());
    for service in &facts.services {
        let what = format!("{} of type {}", quoted(&service.path), quoted(&service.ty));
        if !is_ros_name(&service.path) {
            unsaid.decide(&format!("service {what} has no name of ROS"));
        } else if !origin.services.contains(&service.ty) {
            unsaid.decide(&format!("no folder has the type of service {what}"));
        } else if !paths.insert(service.path.as_str()) {
            unsaid.decide(&format!("service {what} is used with another type as well"));
        } else {
            sayable.push(service);
        }
    }
    sayable
}

fn name_all<'a>(
    names: &mut Names,
    facts: &'a Facts,
    needed: &[&'a str],
    topics: &[&'a FoundTopic],
    services: &[&'a FoundService],
    unsaid: &mut Unsaid,
) -> Named<'a> {
    let last = |path: &str| path.rsplit('/').next().unwrap_or_default().to_owned();
    let topics: Vec<_> = fold(topics).into_iter().map(|line| (names.take(&line.name, "topic"), line)).collect();
    let services: Vec<_> = services.iter().map(|service| (service_name(names, &service.path), *service)).collect();
    let mut nodes = Vec::new();
    for node in &facts.nodes {
        if is_ros_name(&node.name) {
            nodes.push((names.take(&node.name, "node"), node));
        } else {
            unsaid.decide(&format!("node {} has no name of ROS", quoted(&node.name)));
        }
    }
    let simulator = names.take("robots", "simulator");
    // Messages differ from each other in more than case, but from all else only as texts.
    let others: BTreeSet<&str> = topics
        .iter()
        .map(|(name, _)| name.as_str())
        .chain(services.iter().map(|(name, _)| name.as_str()))
        .chain(nodes.iter().map(|(name, _)| name.as_str()))
        .chain([simulator.as_str()])
        .collect();
    let mut of_messages = Names::default();
    let mut message = |ty: &str| loop {
        let name = of_messages.take(&last(ty), "Message");
        if !others.contains(name.as_str()) {
            return name;
        }
    };
    let messages = needed.iter().map(|ty| (*ty, message(ty))).collect();
    Named { simulator, messages, topics, services, nodes }
}

/// A name for a service, whose requests and replies have names that begin with it.
fn service_name(names: &mut Names, path: &str) -> String {
    let path: String = path.chars().take(40).collect();
    loop {
        let name = names.take(&path, "service");
        let [request, reply] = ["request", "reply"].map(|end| {
            let wanted = format!("{name}_{end}");
            names.take(&wanted, "service") == wanted
        });
        if request && reply {
            return name;
        }
    }
}

fn topic_lines(named: &Named<'_>) -> String {
    let lines = named.topics.iter().map(|(name, line)| {
        let message = &named.messages[line.topics[0].ty.as_str()];
        format!("topic {name} = {} : {message}  // {}\n", quoted(&line.path), topic_comment(&line.topics))
    });
    lines.collect()
}

/// Who uses a topic, its quality, and how many messages it had.
fn topic_comment(topics: &[&FoundTopic]) -> String {
    let first = topics[0];
    let mut words = vec![
        counted(first.publishers.len() as u64, "publisher"),
        counted(first.subscribers.len() as u64, "subscriber"),
    ];
    if !first.publishers.is_empty() {
        words.push(if first.reliable { "reliable" } else { "best effort" }.to_owned());
        if first.transient_local {
            words.push("transient local".to_owned());
        }
        let rates: Vec<f64> = topics.iter().filter_map(|topic| topic.rate).collect();
        let [least, most] = [f64::min, f64::max].map(|of| rates.iter().copied().reduce(of).map(rate));
        words.push(match (least, most) {
            (Some(least), Some(most)) if least == most => format!("{least} Hz"),
            (Some(least), Some(most)) => format!("{least} to {most} Hz"),
            _ => counted(topics.iter().map(|topic| topic.messages).sum(), "message"),
        });
    }
    if first.publishers.iter().chain(&first.subscribers).any(|by| by == NOBODY) {
        words.push("some of no known node".to_owned());
    }
    words.join(", ")
}

/// A rate to three digits.
fn rate(hertz: f64) -> String {
    if hertz >= 100.0 {
        format!("{hertz:.0}")
    } else if hertz >= 10.0 {
        format!("{hertz:.1}")
    } else {
        format!("{hertz:.2}")
    }
}

fn counted(n: u64, what: &str) -> String {
    match n {
        0 => format!("no {what}"),
        1 => format!("1 {what}"),
        n => format!("{n} {what}s"),
    }
}

fn service_lines(named: &Named<'_>) -> String {
    let lines = named.services.iter().map(|(name, service)| {
        let who = [counted(service.servers.len() as u64, "server"), counted(service.clients.len() as u64, "client")]
            .join(", ");
        format!("service {name} = {} : {}  // {who}\n", quoted(&service.path), quoted(&service.ty))
    });
    lines.collect()
}

fn nodes(named: &Named<'_>) -> String {
    let mut publishes = BTreeMap::<&str, BTreeSet<String>>::new();
    let mut subscribes = BTreeMap::<&str, BTreeSet<String>>::new();
    for (name, line) in &named.topics {
        for topic in &line.topics {
            for node in &topic.publishers {
                publishes.entry(node).or_default().insert(name.clone());
            }
            for node in &topic.subscribers {
                subscribes.entry(node).or_default().insert(name.clone());
            }
        }
    }
    for (name, service) in &named.services {
        let (request, reply) = (format!("{name}_request"), format!("{name}_reply"));
        for node in &service.servers {
            publishes.entry(node).or_default().insert(reply.clone());
            subscribes.entry(node).or_default().insert(request.clone());
        }
        for node in &service.clients {
            publishes.entry(node).or_default().insert(request.clone());
            subscribes.entry(node).or_default().insert(reply.clone());
        }
    }
    let mut text = String::new();
    for (name, node) in &named.nodes {
        if node.count > 1 {
            _ = writeln!(text, "// decide: {} nodes have this name; give each its own", node.count);
        }
        _ = writeln!(text, "node {name} {} {{", quoted(&node.name));
        for (word, of) in [("publishes", &publishes), ("subscribes", &subscribes)] {
            if let Some(topics) = of.get(node.name.as_str()) {
                let topics: Vec<&str> = topics.iter().map(String::as_str).collect();
                _ = writeln!(text, "{word:<10} {}", wrapped(&topics));
            }
        }
        text.push_str("}\n");
    }
    text
}

/// Names with commas between them, on lines that are not too long.
fn wrapped(names: &[&str]) -> String {
    const LONGEST: usize = 90;
    let (mut text, mut line) = (String::new(), 0);
    for name in names {
        let between = match line {
            0 => "",
            _ if line + name.len() > LONGEST => {
                line = 0;
                ",\n"
            }
            _ => ", ",
        };
        _ = write!(text, "{between}{name}");
        line += name.len() + 2;
    }
    text
}

/// Text for a comment: on one line, without signs that a terminal would interpret.
fn on_one_line(text: &str) -> String {
    let longest: String = visible(text).chars().take(400).collect();
    longest.replace(['\n', '\r', '\u{2028}', '\u{2029}', '\u{85}'], " ")
}
