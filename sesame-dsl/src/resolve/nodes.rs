//! Nodes, and groups of them: which topics they use, and of which groups only their own members; `from` and `to` of an
//! operation, the nodes that send and receive the messages it applies to.

use std::collections::BTreeMap;
use std::ops::Range;

use super::{Kind, Resolver};
use crate::diagnostic::{Code, Diagnostic};
use crate::groups::{Expanded, expand, own_members};
use crate::model::{self, Channel, Id as _, NodeId, TopicId, TopicMembers};
use crate::span::Span;
use crate::syntax::ast::{self, OperationBody, Target, WithMember};

/// The node of an id, as plans know it: their nodes are those of the space, in the same order.
pub(super) fn node_of_plans(node: NodeId) -> sesame_plan::NodeId {
    sesame_plan::NodeId(u32::try_from(node.index()).expect("a file has fewer than 2^32 declarations"))
}

/// What a node says of the members of a group of topics.
pub(super) enum Said {
    /// Nothing: its own ones.
    Own,
    All,
    /// These, by their positions.
    These(Vec<u32>),
}

/// A topic that a node lists.
pub(super) struct Listed {
    pub(super) topic: TopicId,
    pub(super) said: Said,
    /// What the topic's path stands for.
    pub(super) members: Vec<Expanded>,
    /// Where it is listed.
    pub(super) span: Span,
}

impl<'a> Resolver<'a> {
    /// Gives the nodes of the system their ids: one to each, and to each member of a group.
    pub(super) fn count_nodes(&mut self) {
        let mut next = 0;
        let counts = self.ast_nodes().map(|node| match &node.named {
            Some(named) => expand(&named.text).map_or(1, |members| members.len()),
            None => 1,
        });
        self.system.node_ids = counts
            .map(|count| {
                next += count;
                next - count..next
            })
            .collect();
    }

    /// The ids of a declared node, by its position among the declarations.
    pub(super) fn ids_of_node(&self, declared: usize) -> Range<usize> {
        self.system.node_ids[declared].clone()
    }

    pub(super) fn nodes(&mut self) {
        for (declared, node) in self.ast_nodes().enumerate() {
            let members = match &node.named {
                // An empty text was reported where it was read.
                Some(named) if named.text.trim().is_empty() => None,
                Some(named) => self.expanded(named, "node"),
                None => Some(vec![Expanded::one(&node.head.name.text)]),
            };
            let mut publishes = self.topics_listed(&node.publishes, "publishes");
            let mut subscribes = self.topics_listed(&node.subscribes, "subscribes");
            self.parts_listed(&node.serves, true, [&mut publishes, &mut subscribes]);
            self.parts_listed(&node.calls, false, [&mut publishes, &mut subscribes]);
            let ids = |listed: &Option<Vec<Listed>>| -> Option<Vec<TopicId>> {
                Some(listed.as_ref()?.iter().map(|listed| listed.topic).collect())
            };
            let rest = self.rest_of_node(node, ids(&publishes).as_deref(), ids(&subscribes).as_deref());
            let complete = (|| Some((members?, publishes?, subscribes?, rest?)))();
            let Some((members, publishes, subscribes, rest)) = complete else {
                let count = self.ids_of_node(declared).len();
                self.system.nodes.extend(std::iter::repeat_with(|| None).take(count));
                continue;
            };
            for member in &members {
                let node = self.member_of_node(node, member, &members, [&publishes, &subscribes], &rest);
                self.system.nodes.push(node);
            }
        }
    }

    /// A node, or the member of a group of nodes.
    fn member_of_node(
        &mut self,
        node: &'a ast::Node,
        member: &Expanded,
        members: &[Expanded],
        [publishes, subscribes]: [&[Listed]; 2],
        rest: &super::lifecycle::RestOfNode,
    ) -> Option<model::Node> {
        let mut declaration = self.declaration(&node.head);
        if members.len() > 1 {
            declaration.name = sesame_plan::with_member(&declaration.name, &member.name);
        }
        let used = |listed: &[Listed]| listed.iter().map(|listed| listed.used_by(member, members)).collect();
        let named = match &node.named {
            Some(written) if self.is_of_ros() => Some(self.absolute(&member.path, written.span, "node")?),
            _ => None,
        };
        let mut launch = rest.launch.clone();
        for argument in launch.iter_mut().flat_map(|launch| &mut launch.command.arguments) {
            *argument = argument.replace("{member}", &member.name);
        }
        Some(model::Node {
            declaration,
            publishes: used(publishes),
            subscribes: used(subscribes),
            named,
            launch,
            answers: rest.answers.clone(),
            every_step: rest.every_step.clone(),
            broker: rest.broker.clone(),
        })
    }

    /// The topics of a list, each once.
    fn topics_listed(&mut self, clauses: &'a [(Span, Vec<WithMember>)], word: &str) -> Option<Vec<Listed>> {
        let mut found: Vec<Listed> = Vec::new();
        let mut first: BTreeMap<(&str, Option<Option<&str>>), Span> = BTreeMap::new();
        let mut complete = true;
        for listed in self.single(clauses, word).into_iter().flatten() {
            let member = listed.member.as_ref().map(|member| member.name.as_deref());
            if let Some(before) = first.insert((&listed.name.text, member), listed.span) {
                self.listed_twice(listed.span, before);
                complete = false;
                continue;
            }
            let Some(index) = self.find(&listed.name, Kind::Topic) else {
                complete = false;
                continue;
            };
            let topic = TopicId::from_index(index);
            let known = found.iter_mut().find(|known| known.topic == topic);
            match (known, self.said(topic, listed)) {
                (_, None) => complete = false,
                (None, Some(said)) => {
                    let members = self.members_of_topic(topic);
                    found.push(Listed { topic, said, members, span: listed.span });
                }
                (Some(Listed { said: Said::These(known), .. }), Some(Said::These(more))) => {
                    known.extend(more);
                    known.sort_unstable();
                }
                (Some(_), Some(_)) => {
                    let whole =
                        first.iter().find(|((name, _), span)| **name == listed.name.text && **span != listed.span);
                    self.listed_twice(listed.span, whole.map_or(listed.span, |(_, span)| *span));
                    complete = false;
                }
            }
        }
        complete.then_some(found)
    }

    /// What a list says of the members of a topic. `None` was reported.
    pub(super) fn said(&mut self, topic: TopicId, listed: &WithMember) -> Option<Said> {
        Some(match &listed.member {
            None => Said::Own,
            Some(ast::Member { name: None, .. }) => Said::All,
            Some(ast::Member { name: Some(wanted), span }) => {
                Said::These(vec![self.named_member(topic, &listed.name, wanted, *span)?])
            }
        })
    }

    /// The nodes of a list: of a group, all members or the one that is named.
    pub(super) fn nodes_listed(&mut self, listed: &'a [WithMember]) -> Option<Vec<NodeId>> {
        let mut found: Vec<NodeId> = Vec::new();
        let mut complete = true;
        let mut spans: BTreeMap<NodeId, Span> = BTreeMap::new();
        for one in listed {
            let Some(nodes) = self.nodes_named(one) else {
                complete = false;
                continue;
            };
            if let Some(&before) = nodes.iter().find_map(|node| spans.get(node)) {
                self.listed_twice(one.span, before);
                complete = false;
                continue;
            }
            spans.extend(nodes.iter().map(|&node| (node, one.span)));
            found.extend(nodes);
        }
        complete.then_some(found)
    }

    /// The nodes of a name: one, all of a group, or its member in brackets.
    pub(super) fn nodes_named(&mut self, one: &'a WithMember) -> Option<Vec<NodeId>> {
        let declared = self.find(&one.name, Kind::Node)?;
        let ids = self.ids_of_node(declared);
        let all = || ids.clone().map(NodeId::from_index).collect();
        let Some(member) = &one.member else { return Some(all()) };
        let Some(wanted) = &member.name else { return Some(all()) };
        let node = self.ast_nodes().nth(declared)?;
        let members = node.named.as_ref().and_then(|named| expand(&named.text).ok()).unwrap_or_default();
        let at = self.member_named(&members, wanted, member.span, ("node", &one.name.text, node.head.name.span))?;
        Some(vec![NodeId::from_index(ids.start + at as usize)])
    }

    /// The one node of a name; reports a group.
    pub(super) fn node_named(&mut self, one: &'a WithMember) -> Option<NodeId> {
        let nodes = self.nodes_named(one)?;
        if let [node] = nodes[..] {
            return Some(node);
        }
        let title = format!("`{}` is a group of {} nodes, but one node is needed", one.name.text, nodes.len());
        let mut diagnostic = Diagnostic::new(Code::UNPAIRED, one.span, title).label("expected one of its members");
        let first = nodes.first().and_then(|node| self.system.nodes.get(node.index())?.as_ref());
        if let Some(first) = first {
            diagnostic = diagnostic.note(format!("for example `{}`", first.declaration.name));
        }
        self.report(diagnostic);
        None
    }

    /// Nodes must publish or subscribe to the topic, and the transport must tell them apart. The name of a group of
    /// nodes stands for its members that do.
    pub(super) fn between_nodes(&mut self, body: &'a OperationBody) -> Option<[Vec<NodeId>; 2]> {
        if body.targets.is_empty() {
            let Some((span, _)) = body.from.as_ref().or(body.to.as_ref()) else {
                return Some([Vec::new(), Vec::new()]);
            };
            let title = format!("`{}` limits messages, but this operation acts on none", self.text(*span));
            let label = "remove the nodes; after `on` stands the node on which it acts";
            self.report(Diagnostic::new(Code::WHICH_NODES, *span, title).label(label));
            return None;
        }
        let mut topics = Vec::new();
        for target in &body.targets {
            let topic = self.names.get(target.topic.text.as_str()).copied();
            let topic = topic.filter(|topic| topic.kind == Kind::Topic)?;
            let of_service = self.system.topics.get(topic.index).and_then(Option::as_ref);
            let of_service = of_service.is_some_and(|topic| topic.channel != Channel::Topic);
            if let (true, Some((span, _))) = (of_service, body.from.as_ref().or(body.to.as_ref())) {
                let title = format!("`{}` is of a service, whose clients are not distinguished", target.topic.text);
                let diagnostic = Diagnostic::new(Code::WHICH_NODES, *span, title)
                    .label("remove the nodes; the operation then applies to all calls of the service");
                self.report(diagnostic);
                return None;
            }
            topics.push((target, TopicId::from_index(topic.index)));
        }
        let mut lists = |nodes: &'a Option<(Span, Vec<WithMember>)>, from: bool| {
            let Some((span, listed)) = nodes else { return Some(Vec::new()) };
            let found = self.nodes_listed(listed);
            let mut fits = true;
            for one in listed.iter().filter(|_| found.is_some()) {
                for (target, topic) in &topics {
                    fits &= self.on_its_way(target, *topic, one, from);
                }
            }
            fits &= self.tells_nodes_apart(*span, from);
            let on_it =
                |node: &NodeId| topics.iter().any(|(_, topic)| self.is_on_its_way(*node, *topic, from) != Some(false));
            found.filter(|_| fits).map(|found| found.into_iter().filter(on_it).collect())
        };
        let from = lists(&body.from, true);
        let to = lists(&body.to, false);
        Some([from?, to?])
    }

    /// Whether a node publishes a topic, or subscribes to it; `None` for a node with a mistake.
    fn is_on_its_way(&self, node: NodeId, topic: TopicId, from: bool) -> Option<bool> {
        let node = self.system.nodes[node.index()].as_ref()?;
        let lists = if from { &node.publishes } else { &node.subscribes };
        Some(lists.iter().any(|used| used.topic == topic))
    }

    fn on_its_way(&mut self, target: &Target, topic: TopicId, one: &'a WithMember, from: bool) -> bool {
        let Some(nodes) = self.nodes_named(one) else { return false };
        let on_it: Option<Vec<bool>> = nodes.iter().map(|&node| self.is_on_its_way(node, topic, from)).collect();
        let Some(on_it) = on_it else { return false };
        if on_it.contains(&true) {
            return true;
        }
        let declared = nodes.first().and_then(|node| self.system.nodes[node.index()].as_ref());
        let Some(declared) = declared.map(|node| node.declaration.span) else { return false };
        let does = if from { "publishes" } else { "subscribes to" };
        let not = if from { "publish" } else { "subscribe to" };
        let title = format!("node `{}` does not {not} `{}`", one.name.text, target.topic.text);
        let diagnostic = Diagnostic::new(Code::WHICH_NODES, one.span, title)
            .label(format!("expected a node that {does} it"))
            .secondary(declared, "the node is declared here");
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

impl Listed {
    /// What a node uses of it, which may be a member of a group of nodes. Without a word, these are its own members of
    /// a group: those whose paths begin like its name or, if the topics and the nodes have the same members, the one of
    /// the same name; all where neither says anything.
    fn used_by(&self, node: &Expanded, nodes: &[Expanded]) -> TopicMembers {
        let count = self.members.len();
        let members = match &self.said {
            Said::All => None,
            Said::These(these) => Some(these.clone()),
            Said::Own => own_members(&self.members, &node.path).or_else(|| self.of_the_same_name(node, nodes)),
        };
        TopicMembers { topic: self.topic, members: members.filter(|members| members.len() < count) }
    }

    fn of_the_same_name(&self, node: &Expanded, nodes: &[Expanded]) -> Option<Vec<u32>> {
        let same = nodes.len() > 1 && self.members.len() == nodes.len();
        let at = self.members.iter().position(|member| member.name == node.name)?;
        let all = || nodes.iter().all(|node| self.members.iter().any(|member| member.name == node.name));
        (same && all()).then(|| vec![u32::try_from(at).expect("a group has fewer than 2^32 members")])
    }
}
