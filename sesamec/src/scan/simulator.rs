//! What differs from one middleware to the other: the first line, and the block of the simulator.

use std::fmt::Write as _;

use sesame_notation::quoted;
use sesame_plan::Dialect;
use sesame_scan::{CLOCK, Facts, FoundService, System};

use super::comments::{LeftOut, on_one_line};
use super::expressible::is_ros_name;
use super::origin::Origin;

/// The first line of the space, which says what was looked at.
pub(super) fn heading(facts: &Facts) -> String {
    let command = facts.system.kind().properties().keyword;
    let whereabouts = match &facts.system {
        System::Ros2 { domain } => format!("in domain {domain}"),
        System::Ros1 { master } => format!("at the master {}", quoted(master)),
        System::Rosbridge { url, .. } => format!("behind the bridge {}", quoted(url)),
        System::Mqtt { url } => format!("at the broker {}", quoted(url)),
        System::Simlog { url, steps: 0, .. } => format!("at the simulator {}, without a step", quoted(url)),
        System::Simlog { url, steps, .. } => format!("at the simulator {}, which took {steps} steps", quoted(url)),
    };
    let said = on_one_line(&format!("What `sesamec scan {command}` found {whereabouts} in {} s", facts.seconds));
    format!("// {said}. Each `decide:` is a question to a person.\n")
}

/// The name of the space.
pub(super) fn space_name(system: &System) -> String {
    match system {
        System::Ros2 { domain } => format!("domain_{domain}"),
        System::Rosbridge { .. } => "bridged_system".to_owned(),
        other => format!("{}_system", other.kind().properties().keyword),
    }
}

/// Whether a scan of this middleware learns who publishes and who subscribes.
pub(super) fn knows_nodes(system: &System) -> bool {
    match system {
        System::Rosbridge { rosapi, .. } => *rosapi,
        other => other.is_ros(),
    }
}

/// What a scan of this middleware cannot see.
pub(super) fn unseen(facts: &Facts, left_out: &mut LeftOut) {
    let nodes = "such as `node control { publishes order  subscribes state }`";
    match &facts.system {
        System::Ros2 { .. } | System::Ros1 { .. } | System::Rosbridge { rosapi: true, .. } => {}
        System::Rosbridge { rosapi: false, .. } => left_out.decide(
            "other topics, services and nodes: without rosapi only topics that were named with `--topic` were looked at",
        ),
        System::Mqtt { .. } => left_out.decide(&format!(
            "the nodes, {nodes}: a broker does not tell who publishes and who subscribes"
        )),
        System::Simlog { .. } => left_out.decide(&format!(
            "other topics, which the protocol does not list: only those that were named were looked at; and the \
             nodes, {nodes}"
        )),
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

/// The block of the simulator.
pub(super) fn block(name: &str, facts: &Facts, origin: Origin<'_>, clock: Option<&str>) -> String {
    let system = &facts.system;
    let mut text = launching(system);
    let head = match system {
        System::Ros2 { domain } => format!("ros2 {{\ndomain {domain}\n"),
        System::Ros1 { master } => format!("ros1 {} {{\n", quoted(master)),
        System::Rosbridge { url, dialect: Dialect::Ros2, .. } => format!("rosbridge {} {{\n", quoted(url)),
        System::Rosbridge { url, dialect: Dialect::Ros1, .. } => {
            format!("rosbridge {} {{\ndialect ros1\n", quoted(url))
        }
        System::Mqtt { url } => format!("mqtt {} {{\nquality {}\n", quoted(url), quality(facts)),
        System::Simlog { url, protocol, step_ms, .. } => {
            let protocol = if *protocol == 3 { "protocol 3\n" } else { "" };
            let decide = "// decide: whether this is the length of a step\n";
            format!("simlog {} {{\n{decide}step {step_ms}ms\n{protocol}", quoted(url))
        }
    };
    _ = write!(text, "simulator {name} = {head}");
    for setting in origin.settings {
        _ = writeln!(text, "{setting}");
    }
    if system.is_ros() {
        of_ros(facts, origin, clock, &mut text);
    }
    text.push_str("}\n");
    text
}

/// How the system is started: a scan sees what runs, not how that began.
fn launching(system: &System) -> String {
    let example = match system {
        System::Ros2 { .. } => r#"launch "ros2" "run" "PACKAGE" "PROGRAM" "{ros-args}""#,
        System::Ros1 { .. } => r#"launch "rosrun" "PACKAGE" "PROGRAM" "{ros-args}""#,
        System::Rosbridge { .. } => r#"launch "PROGRAM" "{ros-args}""#,
        System::Mqtt { .. } => r#"launch "PROGRAM" { ready when line "ready" within 30s }"#,
        System::Simlog { .. } => r#"launch "PROGRAM" "--port" "{port}" { ready when port "{port}" within 30s }"#,
    };
    format!("// decide: how the system is started, with `launch` here or in each node; for example\n// {example}\n")
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
