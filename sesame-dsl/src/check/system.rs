//! Nodes, topics and operations that probably do not belong together.

use std::collections::{BTreeMap, BTreeSet};

use sesame_plan::without_member;

use crate::diagnostic::{Code, Diagnostic};
use crate::model::{Channel, Declaration, MetricSource, Node, Operation, Space, TopicId, TopicMembers};
use crate::resolve::list;

/// Operations whose name ends with the name of a topic that they do not disturb.
pub(super) fn misnamed_operations(space: &Space, diagnostics: &mut Vec<Diagnostic>) {
    let topics: BTreeMap<&str, &Declaration> =
        space.topics.values().map(|topic| (topic.declaration.name.as_str(), &topic.declaration)).collect();
    for operation in space.operations.values() {
        let name = &operation.declaration.name;
        // The endings of a name, the longest first.
        let ends = || name.match_indices('_').map(|(at, _)| &name[at + 1..]);
        let own: Vec<&Declaration> = operation.topics().map(|topic| &space.topics[topic].declaration).collect();
        // `command_lost` is named after `command`, even if there is a topic `lost`.
        let begins = |own: &str| name.strip_prefix(own).is_some_and(|rest| rest.is_empty() || rest.starts_with('_'));
        if own.is_empty() || own.iter().any(|own| begins(&own.name) || ends().any(|end| end == own.name)) {
            continue;
        }
        let own = list(&own.iter().map(|own| own.name.as_str()).collect::<Vec<_>>());
        // The longest is meant: `cut_link_speed` is named after `link_speed` even if there is a `speed` too.
        let Some(meant) = ends().find_map(|end| topics.get(end)) else { continue };
        let title = format!("operation `{name}` is named after `{}` but disturbs {own}", meant.name);
        let diagnostic = Diagnostic::new(Code::MISNAMED_OPERATION, operation.declaration.span, title)
            .label(format!("this acts on {own}"))
            .secondary(meant.span, "the operation's name ends with the name of this topic");
        diagnostics.push(diagnostic);
    }
}

/// Operations on topics without a subscriber, if nodes say what they subscribe to: no node subscribes to the topic, no
/// monitor needs it, and no outbound metric reads it.
pub(super) fn unheard_operations(space: &Space, diagnostics: &mut Vec<Diagnostic>) {
    let mut subscribed: BTreeSet<TopicId> = BTreeSet::new();
    let mut heard: BTreeSet<TopicId> = BTreeSet::new();
    for node in space.nodes.values() {
        subscribed.extend(node.subscribes.iter().map(|used| used.topic));
        let disturbed = node.subscribes.iter().filter(|used| !hears_itself_alone(space, node, used));
        heard.extend(disturbed.map(|used| used.topic));
    }
    if subscribed.is_empty() {
        return;
    }
    for metric in space.metrics.values() {
        match &metric.source {
            MetricSource::Robustness(robustness) if robustness.outbound => {
                heard.extend(robustness.inputs.iter().map(|input| input.field.topic));
            }
            MetricSource::Formula(formula) if formula.outbound => {
                heard.extend(formula.inputs.iter().map(|input| input.field.topic));
            }
            _ => {}
        }
    }
    for eddi in space.eddis.values() {
        let delivered = eddi.evidence.iter().filter(|evidence| !evidence.inbound);
        heard.extend(delivered.flat_map(|evidence| &evidence.inputs).map(|input| input.field.topic));
    }
    for operation in space.operations.values() {
        let unheard = operation.topics().filter(|topic| !heard.contains(topic));
        let unheard: Vec<(&Declaration, bool)> =
            unheard.map(|topic| (&space.topics[topic].declaration, subscribed.contains(&topic))).collect();
        let Some(&(topic, is_subscribed)) = unheard.first() else { continue };
        if unheard.len() < operation.targets.len() {
            let partly = |&(topic, is_subscribed): &_| partly_unheard(operation, topic, is_subscribed);
            diagnostics.extend(unheard.iter().map(partly));
            continue;
        }
        let why = why_unheard(&format!("`{}`", topic.name), is_subscribed);
        let title = format!("operation `{}` has no effect: {why}", operation.declaration.name);
        diagnostics.push(
            Diagnostic::new(Code::NOBODY_HEARS, operation.declaration.span, title)
                .label("no monitor and no outbound metric reads its topic either")
                .secondary(topic.span, "the topic is declared here")
                .note("if the simulator does not subscribe to the topic either, a campaign ends with an error after the reference run"),
        );
    }
}

/// Whether a node of ROS subscribes only to paths of a topic that it publishes itself. One rule renames both, so that
/// what operations do on these paths does not reach it.
fn hears_itself_alone(space: &Space, node: &Node, used: &TopicMembers) -> bool {
    let topic = &space.topics[used.topic];
    let one_rule = space.simulator.ros.is_some() && space.simulator.proxies.is_empty();
    let own = node.publishes.iter().find(|own| own.topic == used.topic);
    let count = u32::try_from(topic.paths.len()).unwrap_or(u32::MAX);
    let publishes = |member: u32| own.is_some_and(|own| own.has(member));
    one_rule && topic.channel == Channel::Topic && (0..count).all(|member| !used.has(member) || publishes(member))
}

/// Why nobody hears what operations do on a topic, to which nodes may be subscribed nevertheless.
fn why_unheard(topic: &str, is_subscribed: bool) -> String {
    if is_subscribed {
        format!("only nodes that publish on {topic} subscribe to it, and they hear it undisturbed")
    } else {
        format!("no node subscribes to {topic}")
    }
}

/// An operation on several topics, one of which nobody hears.
fn partly_unheard(operation: &Operation, topic: &Declaration, is_subscribed: bool) -> Diagnostic {
    let (name, why) = (&operation.declaration.name, why_unheard("it", is_subscribed));
    let title = format!("operation `{name}` has no effect on `{}`: {why}", topic.name);
    Diagnostic::new(Code::NOBODY_HEARS, operation.declaration.span, title)
        .label("no monitor and no outbound metric reads this topic either")
        .secondary(topic.span, "the topic is declared here")
}

/// The names of topics that have many publishers by design, without their namespaces.
const SHARED: [&str; 5] = ["tf", "tf_static", "diagnostics", "rosout", "parameter_events"];

/// Topics, or members of groups, that more than one declared node or monitor publishes. The members of one group of
/// nodes share a topic because it is declared so, and a service or action may have many clients.
pub(super) fn two_publishers(space: &Space, diagnostics: &mut Vec<Diagnostic>) {
    let mut actions: BTreeSet<&str> = BTreeSet::new();
    for (id, topic) in space.topics.iter() {
        let is_shared = |path: &String| path.rsplit('/').next().is_some_and(|last| SHARED.contains(&last));
        let is_said = topic.action.as_deref().is_some_and(|action| actions.contains(action));
        if topic.channel == Channel::Request || is_said || topic.paths.iter().all(is_shared) {
            continue;
        }
        let publishers = publishers(space, id);
        let mut together: Vec<&Publisher<'_>> = Vec::new();
        for (at, later) in publishers.iter().enumerate() {
            let Some(earlier) = publishers[..at].iter().find(|earlier| earlier.shares(later)) else { continue };
            for one in [earlier, later] {
                if together.iter().all(|known| known.declaration.span != one.declaration.span) {
                    together.push(one);
                }
            }
        }
        let [first, second, further @ ..] = together.as_slice() else { continue };
        actions.extend(topic.action.as_deref());
        let (topic, kind) = (&topic.declaration, first.kind);
        let title = if !further.is_empty() {
            let names: Vec<&str> = together.iter().map(|one| one.name).collect();
            format!("{} all publish `{}`", list(&names), topic.name)
        } else if kind == second.kind {
            let (first, second) = (first.name, second.name);
            format!("{kind}s `{first}` and `{second}` both publish `{}`", topic.name)
        } else {
            let [first, second] = [first, second].map(|one| format!("{} `{}`", one.kind, one.name));
            format!("{first} and {second} both publish `{}`", topic.name)
        };
        let mut diagnostic = Diagnostic::new(Code::TWO_PUBLISHERS, second.declaration.span, title)
            .label("also publishes it")
            .secondary(first.declaration.span, "publishes it");
        for further in further {
            diagnostic = diagnostic.secondary(further.declaration.span, "publishes it as well");
        }
        diagnostics.push(diagnostic.secondary(topic.span, "the topic is declared here"));
    }
}

/// A declared node, with all members of a group of nodes, or a monitor.
struct Publisher<'a> {
    kind: &'static str,
    declaration: &'a Declaration,
    /// Its name, or that of the group of nodes.
    name: &'a str,
    /// The members of the topic that it publishes; `None` for all of them.
    members: Option<BTreeSet<u32>>,
}

impl Publisher<'_> {
    fn shares(&self, other: &Publisher<'_>) -> bool {
        match (&self.members, &other.members) {
            (Some(one), Some(other)) => !one.is_disjoint(other),
            _ => true,
        }
    }
}

/// Who publishes a topic, in the order of their declarations.
fn publishers(space: &Space, topic: TopicId) -> Vec<Publisher<'_>> {
    let mut publishers: Vec<Publisher<'_>> = Vec::new();
    for node in space.nodes.values() {
        let Some(used) = node.publishes.iter().find(|used| used.topic == topic) else { continue };
        let members = used.members.as_ref().map(|members| members.iter().copied().collect());
        match publishers.last_mut().filter(|last| last.declaration.span == node.declaration.span) {
            Some(Publisher { members: Some(known), .. }) if members.is_some() => {
                known.extend(members.into_iter().flatten());
            }
            Some(Publisher { members: known, .. }) => *known = None,
            None => {
                let declaration = &node.declaration;
                let name = without_member(&declaration.name);
                publishers.push(Publisher { kind: "node", declaration, name, members });
            }
        }
    }
    let eddis = space.eddis.values().filter(|eddi| eddi.publishes == Some(topic));
    publishers.extend(eddis.map(|eddi| {
        let declaration = &eddi.declaration;
        Publisher { kind: "monitor", declaration, name: &declaration.name, members: None }
    }));
    publishers
}
