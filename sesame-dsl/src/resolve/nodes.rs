//! `from` and `to` of an operation: the nodes that send and receive the messages it applies to.

use super::{Kind, Resolver};
use crate::diagnostic::{Code, Diagnostic};
use crate::span::Span;
use crate::syntax::ast::{Name, OperationBody, Target, Transport};

impl<'a> Resolver<'a> {
    /// Nodes must publish or subscribe to the topic, and the transport must tell them apart.
    pub(super) fn between_nodes(&mut self, body: &'a OperationBody) {
        let Some(target) = &body.target else { return };
        let Some(topic) = self.names.get(target.topic.text.as_str()).copied() else { return };
        if topic.kind != Kind::Topic {
            return;
        }
        for (nodes, from) in [(&body.from, true), (&body.to, false)] {
            let Some((span, names)) = nodes else { continue };
            for index in self.find_all(names, Kind::Node).into_iter().flatten() {
                self.on_its_way(target, topic.index, index, from, names);
            }
            self.tells_nodes_apart(*span, from);
        }
    }

    fn on_its_way(&mut self, target: &Target, topic: usize, node: usize, from: bool, names: &[Name]) {
        let Some(node) = self.system.nodes[node].as_ref() else { return };
        let lists = if from { &node.publishes } else { &node.subscribes };
        if lists.iter().any(|id| crate::model::Id::index(*id) == topic) {
            return;
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
    }

    fn tells_nodes_apart(&mut self, span: Span, from: bool) {
        let Some(simulator) = self.simulators().next() else { return };
        let word = match &simulator.transport {
            Some(Transport::InProcess(_)) => "in_process",
            Some(Transport::Process(_)) => "process",
            None => return,
        };
        let who = if from { "which node publishes a message" } else { "which node receives a message" };
        let title = format!("simulator kind `{word}` does not report {who}");
        let diagnostic = Diagnostic::new(Code::WHICH_NODES, span, title)
            .label("remove the nodes; the operation then applies to every message of its topic")
            .secondary(simulator.head.name.span, "the simulator is declared here");
        self.report(diagnostic);
    }
}
