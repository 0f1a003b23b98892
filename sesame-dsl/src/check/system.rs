//! Nodes, topics and operations that probably do not fit together.

use std::collections::BTreeMap;

use crate::diagnostic::{Code, Diagnostic};
use crate::model::{Declaration, NodeId, Space, TopicId};

/// Operations whose name ends in the name of a topic that they do not disturb.
pub(super) fn misnamed_operations(space: &Space, diagnostics: &mut Vec<Diagnostic>) {
    let topics: BTreeMap<&str, &Declaration> =
        space.topics.values().map(|topic| (topic.declaration.name.as_str(), &topic.declaration)).collect();
    for operation in space.operations.values() {
        let name = &operation.declaration.name;
        // What a name ends in, the longest first.
        let ends = || name.match_indices('_').map(|(at, _)| &name[at + 1..]);
        let Some(own) = operation.topic().map(|topic| &space.topics[topic].declaration) else { continue };
        if name == &own.name || ends().any(|end| end == own.name) {
            continue;
        }
        // The longest is meant: `cut_link_speed` is named for `link_speed` where there is a `speed` too.
        let Some(meant) = ends().find_map(|end| topics.get(end)) else { continue };
        let title = format!("operation `{name}` is named for `{}` and disturbs `{}`", meant.name, own.name);
        let diagnostic = Diagnostic::new(Code::MISNAMED_OPERATION, operation.declaration.span, title)
            .label(format!("it acts on `{}`", own.name))
            .also(meant.span, "its name ends in that of this topic");
        diagnostics.push(diagnostic);
    }
}

/// Topics that more than one node publishes.
pub(super) fn two_publishers(space: &Space, diagnostics: &mut Vec<Diagnostic>) {
    let mut publishers: BTreeMap<TopicId, Vec<NodeId>> = BTreeMap::new();
    for (id, node) in space.nodes.iter() {
        for &topic in &node.publishes {
            publishers.entry(topic).or_default().push(id);
        }
    }
    for (topic, nodes) in publishers {
        let [first, second, ..] = nodes[..] else { continue };
        let [first, second] = [first, second].map(|id| &space.nodes[id].declaration);
        let topic = &space.topics[topic].declaration;
        let title = format!("nodes `{}` and `{}` both publish `{}`", first.name, second.name, topic.name);
        let diagnostic = Diagnostic::new(Code::TWO_PUBLISHERS, second.span, title)
            .label("publishes it too")
            .also(first.span, "publishes it")
            .also(topic.span, "the topic");
        diagnostics.push(diagnostic);
    }
}
