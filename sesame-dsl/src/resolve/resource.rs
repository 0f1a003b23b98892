//! Operations on nodes and their parameters.

use sesame_grammar::Rule;
use sesame_plan::SimulatorProperties;

use super::disturbance::number;
use super::nodes::node_of_plans;
use super::{Kind, Resolver};
use crate::diagnostic::{Code, Diagnostic};
use crate::model::{Id as _, NodeId, OperationKind, Parameter, Range};
use crate::span::Span;
use crate::syntax::ast;

/// Whether a kind that is a rule of the grammar acts on nodes or their parameters instead of messages.
pub(super) fn acts_on_nodes(rule: Rule) -> bool {
    matches!(rule, Rule::set_parameter | Rule::pause | Rule::slow | Rule::kill)
}

impl<'a> Resolver<'a> {
    /// What an operation does to a node or a parameter.
    pub(super) fn on_resource(
        &mut self,
        resource: &'a ast::Resource,
        body: &'a ast::OperationBody,
    ) -> Option<(OperationKind, Vec<Parameter>)> {
        let (rule, amounts) = self.kind_for(resource, body)?;
        let has_nodes = self.has_nodes(resource, rule);
        let found = self.nodes_named(&resource.node);
        let parameters = match (rule, amounts) {
            (Rule::set_parameter, Some(ast::Amounts::Range(range))) => {
                Some(vec![number("value", None, self.range(range, None, "the parameter")?)])
            }
            (Rule::slow, Some(ast::Amounts::Range(range))) => self.kept_share(range).map(|share| vec![share]),
            (_, None) => Some(Vec::new()),
            (rule, Some(_)) => unreachable!("the grammar has no operation on a node that is {rule:?} with this amount"),
        };
        // The members of a group follow each other.
        let node = *found?.first()?;
        if !has_nodes {
            return None;
        }
        let can = match rule {
            Rule::set_parameter => true,
            _ if self.orders_nodes() => true,
            rule => self.is_launched(resource, node, body.kind_word) & (rule != Rule::slow || self.runs_freely(body)),
        };
        if !can {
            return None;
        }
        let node = node_of_plans(node);
        let kind = match (rule, &resource.parameter) {
            (Rule::set_parameter, Some(parameter)) => OperationKind::Set { node, parameter: parameter.text.clone() },
            (Rule::pause, None) => OperationKind::Pause { node },
            (Rule::slow, None) => OperationKind::Slow { node },
            (Rule::kill, None) => OperationKind::Kill { node },
            _ => unreachable!("the kind was found to be for what it acts on"),
        };
        Some((kind, parameters?))
    }

    /// Whether the nodes are parts of the simulator, which does to them what operations want.
    fn orders_nodes(&self) -> bool {
        self.kind().is_some_and(|(kind, _)| kind.properties().orders_nodes)
    }

    /// Reports a simulator that cannot do to its nodes what an operation wants.
    fn has_nodes(&mut self, resource: &ast::Resource, rule: Rule) -> bool {
        let sets = rule == Rule::set_parameter;
        let can = |kind: SimulatorProperties| kind.reaches_nodes || (kind.orders_nodes && !sets);
        let Some((word, simulator)) = self.without(can) else { return true };
        let (title, label, note) = if sets {
            (
                format!("nodes of a simulator of kind `{word}` have no parameters"),
                "only nodes of a `ros2` simulator have parameters",
                "a parameter of the whole simulator is a scene, as in `parameter gain: real in [0, 2]`; `process`, \
                 `in_process` and `ros2` take it",
            )
        } else {
            (
                format!("simulator kind `{word}` has no nodes that an operation could act on"),
                "only nodes of `ros2`, `process` and `in_process` simulators can be paused, slowed and killed",
                "disturb the topics of the node instead, for example with `blackhole` or `latency`",
            )
        };
        let diagnostic = Diagnostic::new(Code::NODE_OUT_OF_REACH, resource.span, title)
            .label(label)
            .secondary(simulator, "the simulator is declared here")
            .note(note);
        self.report(diagnostic);
        false
    }

    /// The rule and the amount of a kind that is for what the operation acts on; other kinds are reported.
    fn kind_for(
        &mut self,
        resource: &ast::Resource,
        body: &'a ast::OperationBody,
    ) -> Option<(Rule, Option<&'a ast::Amounts>)> {
        let node = &resource.node.name.text;
        let kind = match &body.kind {
            ast::OperationKind::Plain { rule, amounts } if acts_on_nodes(*rule) => Some((*rule, amounts.as_ref())),
            _ => None,
        };
        let word = self.text(body.kind_word);
        let (span, title, label) = match (kind, &resource.parameter) {
            (Some((Rule::set_parameter, _)), None) => (
                resource.span,
                "`set` needs the parameter that it sets".to_owned(),
                format!("expected a parameter, for example `parameter \"gain\" of {node}`"),
            ),
            (Some((Rule::set_parameter, _)), Some(_)) | (Some(_), None) => return kind,
            (Some(_), Some(_)) => (
                resource.span,
                format!("`{word}` acts on a node, not on one of its parameters"),
                format!("expected `node {node}`"),
            ),
            (None, None) => (
                body.kind_word,
                "this kind of operation acts on messages, not on a node".to_owned(),
                "expected `pause`, `slow` or `kill`".to_owned(),
            ),
            (None, Some(_)) => (
                body.kind_word,
                "this kind of operation acts on messages, not on a parameter".to_owned(),
                "expected `set`".to_owned(),
            ),
        };
        let mut diagnostic = Diagnostic::new(Code::WRONG_TYPE, span, title).label(label);
        if let (Some(_), Some(_)) = (kind, &resource.parameter) {
            diagnostic = diagnostic.suggest("use the node", span, format!("node {node}"));
        }
        if kind.is_none() {
            diagnostic = diagnostic.note("to disturb messages, write the name of a topic after `on`");
        }
        self.report(diagnostic);
        None
    }

    /// Reports a kind that is for nodes on a topic.
    pub(super) fn needs_a_node(&mut self, target: &'a ast::Target, rule: Rule, word: Span) {
        let word = self.text(word);
        let topic = &target.topic.text;
        let is_node = self.names.get(topic.as_str()).is_some_and(|named| named.kind == Kind::Node);
        let (title, label) = if rule == Rule::set_parameter {
            let node = self.declared_or(Kind::Node, "controller");
            (
                "`set` acts on a parameter of a node, not on messages".to_owned(),
                format!("expected a parameter, for example `parameter \"gain\" of {node}`"),
            )
        } else {
            let label = "expected `node` and the name of a node";
            (format!("`{word}` acts on a node, not on messages"), label.to_owned())
        };
        let mut diagnostic = Diagnostic::new(Code::WRONG_TYPE, target.span, title).label(label);
        if rule == Rule::set_parameter {
            diagnostic = diagnostic.note("to replace values in messages, use `stuck at`");
        } else if is_node {
            diagnostic = diagnostic.suggest("write `node` before its name", target.span, format!("node {topic}"));
        }
        self.report(diagnostic);
    }

    /// The share of the time that a slowed node keeps: never all of it, which would do nothing, and never none of it,
    /// which is a pause.
    fn kept_share(&mut self, range: &'a ast::Range) -> Option<Parameter> {
        let all = Range { low: f64::MIN_POSITIVE, high: 100f64.next_down() };
        let share = self.percentages(range, "the share of the time", all, "more than 0% and below 100%")?;
        Some(number("share", None, share))
    }

    /// Reports a node that the runner does not launch, so that it has no process to stop.
    fn is_launched(&mut self, resource: &ast::Resource, node: NodeId, word: Span) -> bool {
        let Some(node) = self.system.nodes[node.index()].as_ref() else { return false };
        if node.launch.is_some() {
            return true;
        }
        let name = &node.declaration.name;
        let title =
            format!("`{}` needs a node that the runner launches, but `{name}` has no `launch`", self.text(word));
        let diagnostic = Diagnostic::new(Code::NODE_OUT_OF_REACH, resource.node.span, title)
            .label("the runner does not know its process")
            .secondary(node.declaration.span, "add a `launch` to this node")
            .note("for example `launch \"ros2\" \"run\" \"PACKAGE\" \"PROGRAM\" \"{ros-args}\"`");
        self.report(diagnostic);
        false
    }

    /// Reports a slowed node of a simulator that waits for its nodes in every step.
    fn runs_freely(&mut self, body: &ast::OperationBody) -> bool {
        let Some(step) = self.transport().and_then(|transport| transport.settings.steppings.first()) else {
            return true;
        };
        let title = "`slow` has no effect on a node of a stepped simulator";
        let diagnostic = Diagnostic::new(Code::NODE_OUT_OF_REACH, body.kind_word, title)
            .label("a step takes as long as its nodes need, so a share of the time changes nothing")
            .secondary(step.0, "the simulator is stepped here")
            .note("to delay what the node publishes, use `latency` on its topics");
        self.report(diagnostic);
        false
    }
}
