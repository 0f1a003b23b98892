//! `from` and `to` of an operation: the nodes that send and receive the messages it applies to.

use super::{Kind, Resolver};
use crate::diagnostic::{Code, Diagnostic};
use crate::model::{Channel, Id as _, NodeId};
use crate::span::Span;
use crate::syntax::ast::{Name, OperationBody, Target};

/// The node at a position, as plans know it: their nodes are those of the space, in the same order.
pub(super) fn node_of_plans(position: usize) -> sesame_plan::NodeId {
    sesame_plan::NodeId(u32::try_from(position).expect("a file has fewer than 2^32 declarations"))
}

impl<'a> Resolver<'a> {
    /// Nodes must publish or subscribe to the topic, and the transport must tell them apart.
    pub(super) fn between_nodes(&mut self, body: &'a OperationBody) -> Option<[Vec<NodeId>; 2]> {
        let Some(target) = &body.target else {
            let Some((span, _)) = body.from.as_ref().or(body.to.as_ref()) else {
                return Some([Vec::new(), Vec::new()]);
            };
            let title = format!("`{}` limits messages, but this operation acts on none", self.text(*span));
            let label = "remove the nodes; after `on` stands the node on which it acts";
            self.report(Diagnostic::new(Code::WHICH_NODES, *span, title).label(label));
            return None;
        };
        let topic = self.names.get(target.topic.text.as_str()).copied().filter(|topic| topic.kind == Kind::Topic)?;
        let of_service = self.system.topics.get(topic.index).and_then(Option::as_ref);
        let of_service = of_service.is_some_and(|topic| topic.channel != Channel::Topic);
        if let (true, Some((span, _))) = (of_service, body.from.as_ref().or(body.to.as_ref())) {
            let title = format!("`{}` is of a service, whose clients are not distinguished", target.topic.text);
            let diagnostic = Diagnostic::new(Code::WHICH_NODES, *span, title)
                .label("remove the nodes; the operation then applies to all calls of the service");
            self.report(diagnostic);
            return None;
        }
        let mut lists = |nodes: &'a Option<(Span, Vec<Name>)>, from: bool| {
            let Some((span, names)) = nodes else { return Some(Vec::new()) };
            let found = self.find_all(names, Kind::Node);
            let mut fits = true;
            for &index in found.iter().flatten() {
                fits &= self.on_its_way(target, topic.index, index, from, names);
            }
            fits &= self.tells_nodes_apart(*span, from);
            found.filter(|_| fits).map(|found| found.into_iter().map(NodeId::from_index).collect())
        };
        let from = lists(&body.from, true);
        let to = lists(&body.to, false);
        Some([from?, to?])
    }

    fn on_its_way(&mut self, target: &Target, topic: usize, node: usize, from: bool, names: &[Name]) -> bool {
        let Some(node) = self.system.nodes[node].as_ref() else { return false };
        let lists = if from { &node.publishes } else { &node.subscribes };
        if lists.iter().any(|id| id.index() == topic) {
            return true;
        }
        let name = names.iter().find(|name| name.text == node.declaration.name);
        let span = name.map_or(target.span, |name| name.span);
        let does = if from { "publishes" } else { "subscribes to" };
        let not = if from { "publish" } else { "subscribe to" };
        let title = format!("node `{}` does not {not} `{}`", node.declaration.name, target.topic.text);
        let diagnostic = Diagnostic::new(Code::WHICH_NODES, span, title)
            .label(format!("expected a node that {does} it"))
            .secondary(node.declaration.span, "the node is declared here");
        self.report(diagnostic);
        false
    }

    fn tells_nodes_apart(&mut self, span: Span, from: bool) -> bool {
        let Some((word, simulator)) = self.without(|kind| kind.bus.is_some()) else { return true };
        let who = if from { "which node publishes a message" } else { "which node receives a message" };
        let title = format!("simulator kind `{word}` does not report {who}");
        let diagnostic = Diagnostic::new(Code::WHICH_NODES, span, title)
            .label("remove the nodes; the operation then applies to every message of its topic")
            .secondary(simulator, "the simulator is declared here");
        self.report(diagnostic);
        false
    }
}
