//! Nodes, topics and operations that probably do not belong together.

use std::collections::{BTreeMap, BTreeSet};

use crate::diagnostic::{Code, Diagnostic};
use crate::model::{Declaration, MetricSource, Space, TopicId};

/// Operations whose name ends with the name of a topic that they do not disturb.
pub(super) fn misnamed_operations(space: &Space, diagnostics: &mut Vec<Diagnostic>) {
    let topics: BTreeMap<&str, &Declaration> =
        space.topics.values().map(|topic| (topic.declaration.name.as_str(), &topic.declaration)).collect();
    for operation in space.operations.values() {
        let name = &operation.declaration.name;
        // The endings of a name, the longest first.
        let ends = || name.match_indices('_').map(|(at, _)| &name[at + 1..]);
        let Some(own) = operation.topic().map(|topic| &space.topics[topic].declaration) else { continue };
        // `command_lost` is named after `command`, even if there is a topic `lost`.
        let begins = name.strip_prefix(own.name.as_str()).is_some_and(|rest| rest.is_empty() || rest.starts_with('_'));
        if begins || ends().any(|end| end == own.name) {
            continue;
        }
        // The longest is meant: `cut_link_speed` is named after `link_speed` even if there is a `speed` too.
        let Some(meant) = ends().find_map(|end| topics.get(end)) else { continue };
        let title = format!("operation `{name}` is named after `{}` but disturbs `{}`", meant.name, own.name);
        let diagnostic = Diagnostic::new(Code::MISNAMED_OPERATION, operation.declaration.span, title)
            .label(format!("this acts on `{}`", own.name))
            .secondary(meant.span, "the operation's name ends with the name of this topic");
        diagnostics.push(diagnostic);
    }
}

/// Operations on topics without a subscriber, if nodes say what they subscribe to: no node subscribes to the topic, no
/// monitor needs it, and no outbound metric reads it.
pub(super) fn unheard_operations(space: &Space, diagnostics: &mut Vec<Diagnostic>) {
    let mut heard: BTreeSet<TopicId> = space.nodes.values().flat_map(|node| &node.subscribes).copied().collect();
    if heard.is_empty() {
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
        let Some(topic) = operation.topic().filter(|topic| !heard.contains(topic)) else { continue };
        let topic = &space.topics[topic].declaration;
        let title =
            format!("operation `{}` has no effect: no node subscribes to `{}`", operation.declaration.name, topic.name);
        diagnostics.push(
            Diagnostic::new(Code::NOBODY_HEARS, operation.declaration.span, title)
                .label("no monitor and no outbound metric reads its topic either")
                .secondary(topic.span, "the topic is declared here")
                .note("if the simulator does not subscribe to the topic either, a campaign ends with an error after the reference run"),
        );
    }
}

/// Topics that more than one node or monitor publishes.
pub(super) fn two_publishers(space: &Space, diagnostics: &mut Vec<Diagnostic>) {
    let mut publishers: BTreeMap<TopicId, Vec<(&str, &Declaration)>> = BTreeMap::new();
    for node in space.nodes.values() {
        for &topic in &node.publishes {
            publishers.entry(topic).or_default().push(("node", &node.declaration));
        }
    }
    for eddi in space.eddis.values() {
        if let Some(topic) = eddi.publishes {
            publishers.entry(topic).or_default().push(("monitor", &eddi.declaration));
        }
    }
    for (topic, publishers) in publishers {
        let [(of_first, first), (of_second, second), ..] = publishers[..] else { continue };
        let topic = &space.topics[topic].declaration;
        let title = if of_first == of_second {
            format!("{of_first}s `{}` and `{}` both publish `{}`", first.name, second.name, topic.name)
        } else {
            format!("{of_first} `{}` and {of_second} `{}` both publish `{}`", first.name, second.name, topic.name)
        };
        let diagnostic = Diagnostic::new(Code::TWO_PUBLISHERS, second.span, title)
            .label("also publishes it")
            .secondary(first.span, "publishes it")
            .secondary(topic.span, "the topic is declared here");
        diagnostics.push(diagnostic);
    }
}
