//! What differs from one middleware to the other: the first line, and the block of the simulator.

use std::fmt::Write as _;

use sesame_notation::quoted;
use sesame_plan::Dialect;
use sesame_scan::{CLOCK, Facts, FoundService, System};

use super::comments::{LeftOut, on_one_line};
use super::expressible::is_ros_name;
use super::grouped_nodes::Node;
use super::groups::Line;
use super::origin::Origin;

/// What a space says of a kind of system that was scanned, besides what it says of all.
struct Row {
    /// Where it was found.
    whereabouts: String,
    /// The name of its space; `None` for its kind.
    space: Option<String>,
    /// Whether a scan learns who publishes and who subscribes.
    knows_nodes: bool,
    /// What a scan cannot see.
    unseen: Option<String>,
    /// An example of how it is started.
    launch: &'static str,
    /// Its kind, with its address.
    head: String,
    /// Its own settings, which come first.
    settings: String,
    /// The address after whose port come those of proxies, which its nodes need.
    proxies: Option<String>,
}

/// The table of all kinds of systems: all that differs between them.
fn row(system: &System) -> Row {
    let nodes = "such as `node control { publishes order  subscribes state }`";
    let in_ros = r#"launch "rosrun" "PACKAGE" "PROGRAM" "{ros-args}""#;
    let at = |url: &str| format!("{} {}", system.kind().properties().keyword, quoted(url));
    let row = Row {
        whereabouts: String::new(),
        space: None,
        knows_nodes: true,
        unseen: None,
        launch: r#"launch "PROGRAM" { ready when line "ready" within 30s }"#,
        head: String::new(),
        settings: String::new(),
        proxies: None,
    };
    match system {
        System::Ros2 { domain } => Row {
            whereabouts: format!("in domain {domain}"),
            space: Some(format!("domain_{domain}")),
            launch: r#"launch "ros2" "run" "PACKAGE" "PROGRAM" "{ros-args}""#,
            head: "ros2".to_owned(),
            settings: format!("domain {domain}\n"),
            ..row
        },
        System::Ros1 { master } => {
            Row { whereabouts: format!("at the master {}", quoted(master)), launch: in_ros, head: at(master), ..row }
        }
        System::Rosbridge { url, dialect, rosapi } => Row {
            whereabouts: format!("behind the bridge {}", quoted(url)),
            space: Some("bridged_system".to_owned()),
            knows_nodes: *rosapi,
            unseen: (!rosapi).then(|| {
                "other topics, services and nodes: without rosapi only topics that were named with `--topic` were \
                 looked at"
                    .to_owned()
            }),
            launch: r#"launch "PROGRAM" "{ros-args}""#,
            head: at(url),
            settings: if *dialect == Dialect::Ros1 { "dialect ros1\n".to_owned() } else { String::new() },
            ..row
        },
        System::Mqtt { url } => Row {
            whereabouts: format!("at the broker {}", quoted(url)),
            knows_nodes: false,
            unseen: Some(format!("the nodes, {nodes}: a broker does not tell who publishes and who subscribes")),
            head: at(url),
            ..row
        },
        System::Simlog { url, protocol, step_ms, steps } => Row {
            whereabouts: match steps {
                0 => format!("at the simulator {}, without a step", quoted(url)),
                steps => format!("at the simulator {}, which took {steps} steps", quoted(url)),
            },
            knows_nodes: false,
            unseen: Some(format!(
                "other topics, which the protocol does not list: only those that were named were looked at; and the \
                 nodes, {nodes}"
            )),
            launch: r#"launch "PROGRAM" "--port" "{port}" { ready when port "{port}" within 30s }"#,
            head: at(url),
            settings: {
                let protocol = if *protocol == 3 { "protocol 3\n" } else { "" };
                format!("// decide: whether this is the length of a step\nstep {step_ms}ms\n{protocol}")
            },
            ..row
        },
        System::Mavlink { url, definitions } => Row {
            whereabouts: format!("at the address {}", quoted(url)),
            unseen: Some(
                "what the ground station sends, such as `topic orders = \"255/COMMAND_LONG\" : Order`: the scan \
                 listened in its place"
                    .to_owned(),
            ),
            head: at(url),
            settings: {
                let files: Vec<String> = definitions.iter().map(|file| quoted(file)).collect();
                format!("types {}\n", files.join(", "))
            },
            proxies: Some(url.clone()),
            ..row
        },
    }
}

/// The first line of the space, which says what was looked at.
pub(super) fn heading(facts: &Facts) -> String {
    let command = facts.system.kind().properties().keyword;
    let whereabouts = row(&facts.system).whereabouts;
    let said = on_one_line(&format!("What `sesamec scan {command}` found {whereabouts} in {} s", facts.seconds));
    format!("// {said}. Each `decide:` is a question to a person.\n")
}

/// The name of the space.
pub(super) fn space_name(system: &System) -> String {
    row(system).space.unwrap_or_else(|| format!("{}_system", system.kind().properties().keyword))
}

/// Whether a scan of this middleware learns who publishes and who subscribes.
pub(super) fn knows_nodes(system: &System) -> bool {
    row(system).knows_nodes
}

/// What a scan of this middleware cannot see.
pub(super) fn unseen(facts: &Facts, left_out: &mut LeftOut) {
    if let Some(unseen) = row(&facts.system).unseen {
        left_out.decide(&unseen);
    }
}

/// The topic of a clock that somebody publishes.
pub(super) fn clock(facts: &Facts) -> Option<&str> {
    let has_clock = facts.system.is_ros();
    let of_all = knows_nodes(&facts.system);
    let clocks = facts
        .topics
        .iter()
        .filter(|topic| has_clock && topic.ty.as_deref() == Some(CLOCK) && (!of_all || !topic.publishers.is_empty()));
    let mut clocks: Vec<&str> = clocks.map(|topic| topic.path.as_str()).filter(|path| is_ros_name(path)).collect();
    clocks.sort_by_key(|path| *path != "/clock");
    clocks.first().copied()
}

/// The block of the simulator, whose nodes have these names.
pub(super) fn block(
    name: &str,
    facts: &Facts,
    origin: Origin<'_>,
    clock: Option<&str>,
    nodes: &[(String, Line<Node<'_>>)],
) -> String {
    let Row { launch, head, settings, proxies, .. } = row(&facts.system);
    // A scan sees what runs, not how that began.
    let mut text =
        format!("// decide: how the system is started, with `launch` here or in each node; for example\n// {launch}\n");
    _ = write!(text, "simulator {name} = {head} {{\n{settings}");
    if let System::Mqtt { .. } = facts.system {
        _ = writeln!(text, "quality {}", quality(facts));
    }
    for setting in origin.settings {
        _ = writeln!(text, "{setting}");
    }
    if facts.system.is_ros() {
        of_ros(facts, origin, clock, &mut text);
    }
    if let Some(url) = proxies {
        text.push_str(&lines_of_proxies(&url, nodes));
    }
    text.push_str("}\n");
    text
}

/// What a node is called that stands for those of which nothing was heard.
pub(super) const UNHEARD: &str = "vehicle";

/// A proxy for each node that publishes, at the ports after that of an address.
fn lines_of_proxies(url: &str, nodes: &[(String, Line<Node<'_>>)]) -> String {
    let port = url.rsplit(':').next().and_then(|port| port.trim_end_matches('/').parse::<u16>().ok());
    // With room for all that a scan keeps.
    let port = port.filter(|port| *port < 60_000).unwrap_or(14_550);
    let publishes = |line: &Line<Node<'_>>| line.of.iter().any(|node| !node.found.publishes.is_empty());
    let mut names: Vec<&str> =
        nodes.iter().filter(|(_, line)| publishes(line)).map(|(name, _)| name.as_str()).collect();
    if names.is_empty() {
        names.push(UNHEARD);
    }
    let mut text = "// decide: the addresses to which the vehicles send, instead of the ground station\n".to_owned();
    for (port, name) in (port + 1..).zip(names) {
        _ = writeln!(text, "proxy {name} \"udp://127.0.0.1:{port}\"");
    }
    text
}

/// Whether nodes have proxies, and there is none that could have one.
pub(super) fn lacks_a_node(facts: &Facts) -> bool {
    row(&facts.system).proxies.is_some() && facts.nodes.iter().all(|node| node.publishes.is_empty())
}

/// What the name of a topic is made of: where the last part of a path says which message it carries, that part and then
/// those who send it.
pub(super) fn words_of_topic(system: &System, path: &str) -> String {
    match path.rsplit_once('/') {
        Some((sender, message)) if system.kind().properties().named_messages => {
            format!("{}/{sender}", message.to_ascii_lowercase())
        }
        _ => path.to_owned(),
    }
}

/// The quality of service: the highest one of a message that came.
fn quality(facts: &Facts) -> &'static str {
    match facts.topics.iter().filter_map(|topic| topic.quality).max() {
        Some(0) => "at_most_once",
        Some(2) => "exactly_once",
        _ => "at_least_once",
    }
}

/// What systems of ROS have: folders of types, a clock, and services that may step or reset them.
fn of_ros(facts: &Facts, origin: Origin<'_>, clock: Option<&str>, text: &mut String) {
    if !origin.folders.is_empty() {
        let folders: Vec<String> = origin.folders.iter().map(|folder| quoted(folder)).collect();
        _ = writeln!(text, "types  {}", folders.join(", "));
    }
    match clock {
        Some(clock) => _ = writeln!(text, "clock  {}", quoted(clock)),
        None => text.push_str("// decide: nobody publishes a clock, so simulation time is wall time\n"),
    }
    let can_step = facts.system.kind().properties().reaches_nodes;
    let words = if can_step { &["step", "reset"][..] } else { &["reset"][..] };
    for word in words {
        for service in facts.services.iter().filter(|service| is_control(service, word)) {
            let path = quoted(&service.path);
            let clause = if *word == "step" {
                format!("step 20ms by service {path}` (with the length of a step) if this takes one step")
            } else {
                format!("reset by service {path}` if this sets the simulator to time zero")
            };
            _ = writeln!(text, "// decide: `{}", on_one_line(&clause));
        }
    }
}

/// Whether a service may be the one that steps or resets a simulator.
fn is_control(service: &FoundService, word: &str) -> bool {
    let last = service.path.rsplit('/').next().unwrap_or_default().to_ascii_lowercase();
    let fits = matches!(service.ty.as_deref(), Some("std_srvs/srv/Trigger" | "std_srvs/srv/Empty"));
    fits && is_ros_name(&service.path) && !service.servers.is_empty() && last.contains(word)
}
