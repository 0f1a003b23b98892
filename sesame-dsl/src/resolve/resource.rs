//! Operations on nodes and their parameters.

use sesame_notation::quoted;
use sesame_plan::SimulatorProperties;

use super::disturbance::number;
use super::nodes::node_of_plans;
use super::{Kind, Resolver};
use crate::diagnostic::{Code, Diagnostic};
use crate::model::{Domain, Id as _, NewValue, NodeId, OperationKind, Parameter, Range, Transition};
use crate::similar::most_similar;
use crate::span::Span;
use crate::syntax::ast::{self, Item, New, OnNode};

impl<'a> Resolver<'a> {
    /// What an operation does to a node or a parameter.
    pub(super) fn on_resource(
        &mut self,
        resource: &'a ast::Resource,
        body: &'a ast::OperationBody,
    ) -> Option<(OperationKind, Vec<Parameter>)> {
        let written = self.kind_for(resource, body)?;
        let has_nodes = self.has_nodes(resource, written);
        // The members of a group follow each other.
        let node = self.nodes_named(&resource.node).and_then(|found| found.first().copied()).filter(|_| has_nodes);
        let word = body.kind_word;
        let (kind, parameter) = match written {
            OnNode::Set(new) => {
                let (values, value) = self.new_values(new)?;
                let parameter = resource.parameter.as_ref().expect("`set` was found to be on a parameter").text.clone();
                (OperationKind::Set { node: node_of_plans(node?), parameter, values }, Some(value))
            }
            OnNode::Transition(name) => {
                let transition = self.transition(name)?;
                (OperationKind::Transition { node: node_of_plans(node?), transition }, None)
            }
            OnNode::Slow(range) => {
                let share = self.kept_share(range)?;
                let node = node?;
                if !(self.can_be_stopped(resource, node, word) & self.runs_freely(word)) {
                    return None;
                }
                (OperationKind::Slow { node: node_of_plans(node) }, Some(share))
            }
            OnNode::Pause | OnNode::Kill => {
                let node = node.filter(|node| self.can_be_stopped(resource, *node, word)).map(node_of_plans)?;
                let pauses = matches!(written, OnNode::Pause);
                (if pauses { OperationKind::Pause { node } } else { OperationKind::Kill { node } }, None)
            }
        };
        Some((kind, parameter.into_iter().collect()))
    }

    /// The transition of this name.
    fn transition(&mut self, name: &'a ast::Name) -> Option<Transition> {
        if let Some(known) = Transition::ALL.into_iter().find(|known| known.word() == name.text) {
            return Some(known);
        }
        let diagnostic = if name.text == "shutdown" {
            Diagnostic::new(Code::UNKNOWN_NAME, name.span, "a node does not come back from `shutdown`")
                .label("expected a transition that can be undone")
                .note("to end a node for a while, use `kill`, which starts it again")
        } else {
            let words = Transition::ALL.map(Transition::word);
            let title = format!("no transition named `{}`", name.text);
            let label = "expected `configure`, `activate`, `deactivate` or `cleanup`";
            let diagnostic = Diagnostic::new(Code::UNKNOWN_NAME, name.span, title).label(label);
            match most_similar(&name.text, words) {
                Some(similar) => diagnostic.did_you_mean(name.span, similar),
                None => diagnostic,
            }
        };
        self.report(diagnostic);
        None
    }

    /// What a parameter is set to: values that are all different and of one type, or none for a number; and what a test
    /// chooses.
    fn new_values(&mut self, written: &'a New) -> Option<(Vec<NewValue>, Parameter)> {
        let written = match written {
            New::Range(range) => {
                return Some((Vec::new(), number("value", None, self.range(range, None, "the parameter")?)));
            }
            New::Values(written) => written,
        };
        let mut values: Vec<NewValue> = Vec::new();
        let mut texts: Vec<String> = Vec::new();
        for new in written {
            let value = self.new_value(new)?;
            let text = in_choices(&value);
            if let Some(before) = texts.iter().position(|known| *known == text) {
                self.listed_twice(new.span(), written[before].span());
                return None;
            }
            if let Some(other) = values.iter().position(|known| !are_alike(known, &value)) {
                self.report_mixed((new.span(), value.is()), (written[other].span(), values[other].is()));
                return None;
            }
            values.push(value);
            texts.push(text);
        }
        let domain = Domain::Texts(texts);
        Some((values, Parameter { name: "value".to_owned(), doc: String::new(), unit: None, domain }))
    }

    fn new_value(&mut self, written: &'a ast::NewValue) -> Option<NewValue> {
        let items = match written {
            ast::NewValue::Truth(truth, _) => return Some(NewValue::Bool(*truth)),
            ast::NewValue::Text(text) => return Some(NewValue::Text(text.text.clone())),
            ast::NewValue::List(items, _) => items,
        };
        let (mut numbers, mut truths, mut texts) = (Vec::new(), Vec::new(), Vec::new());
        for item in items {
            let first = &items[0];
            if of_item(item) != of_item(first) {
                self.report_mixed((item.span(), of_item(item)), (first.span(), of_item(first)));
                return None;
            }
            match item {
                Item::Number(number) => numbers.push(self.value(number, None, "the parameter")?),
                Item::Truth(truth, _) => truths.push(*truth),
                Item::Text(text) => texts.push(text.text.clone()),
            }
        }
        Some(match (truths.is_empty(), texts.is_empty()) {
            (false, _) => NewValue::Bools(truths),
            (_, false) => NewValue::Texts(texts),
            (true, true) => NewValue::Numbers(numbers),
        })
    }

    /// Reports values of different types where they must be of one.
    fn report_mixed(&mut self, (span, is): (Span, &str), (first, first_is): (Span, &str)) {
        let title = format!("`{}` is {is}, but `{}` is {first_is}", self.text(span), self.text(first));
        let diagnostic = Diagnostic::new(Code::WRONG_TYPE, span, title)
            .label(format!("expected {first_is}: a parameter has one type"))
            .secondary(first, "the other is here");
        self.report(diagnostic);
    }

    /// Whether the nodes are parts of the simulator, which pauses, slows and kills them itself.
    fn orders_nodes(&self) -> bool {
        self.kind().is_some_and(|(kind, _)| kind.properties().orders_nodes)
    }

    /// Reports a simulator on whose nodes this kind of operation cannot act.
    fn has_nodes(&mut self, resource: &ast::Resource, written: &OnNode) -> bool {
        const INSTEAD: &str = "disturb the topics of the node instead, for example with `blackhole` or `latency`";
        let of_ros = matches!(written, OnNode::Set(_) | OnNode::Transition(_));
        let can = |kind: SimulatorProperties| kind.reaches_nodes || (kind.orders_nodes && !of_ros);
        let Some((word, simulator)) = self.without(can) else { return true };
        let (title, label, note) = match written {
            OnNode::Set(_) => (
                format!("nodes of a simulator of kind `{word}` have no parameters"),
                "only nodes of a `ros2` simulator have parameters",
                "a parameter of the whole simulator is a scene, as in `parameter gain: real in [0, 2]`; `process`, \
                 `in_process` and `ros2` take it",
            ),
            OnNode::Transition(_) => (
                format!("nodes of a simulator of kind `{word}` have no lifecycle"),
                "only nodes of a `ros2` simulator take transitions",
                INSTEAD,
            ),
            OnNode::Pause | OnNode::Slow(_) | OnNode::Kill => (
                format!("simulator kind `{word}` has no nodes that an operation could act on"),
                "only nodes of `ros2`, `process` and `in_process` simulators can be paused, slowed and killed",
                INSTEAD,
            ),
        };
        let diagnostic = Diagnostic::new(Code::NODE_OUT_OF_REACH, resource.span, title)
            .label(label)
            .secondary(simulator, "the simulator is declared here")
            .note(note);
        self.report(diagnostic);
        false
    }

    /// A kind that is for what the operation acts on; other kinds are reported.
    fn kind_for(&mut self, resource: &ast::Resource, body: &'a ast::OperationBody) -> Option<&'a OnNode> {
        let node = &resource.node.name.text;
        let kind = match &body.kind {
            ast::OperationKind::OnNode(kind) => Some(kind),
            _ => None,
        };
        let word = self.text(body.kind_word);
        let (span, title, label) = match (kind, &resource.parameter) {
            (Some(OnNode::Set(_)), None) => (
                resource.span,
                "`set` needs the parameter that it sets".to_owned(),
                format!("expected a parameter, for example `parameter \"gain\" of {node}`"),
            ),
            (Some(OnNode::Set(_)), Some(_)) | (Some(_), None) => return kind,
            (Some(_), Some(_)) => (
                resource.span,
                format!("`{word}` acts on a node, not on one of its parameters"),
                format!("expected `node {node}`"),
            ),
            (None, None) => (
                body.kind_word,
                "this kind of operation acts on messages, not on a node".to_owned(),
                "expected `pause`, `slow`, `kill` or `transition`".to_owned(),
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
    pub(super) fn needs_a_node(&mut self, target: &'a ast::Target, kind: &OnNode, word: Span) {
        let word = self.text(word);
        let topic = &target.topic.text;
        let is_node = self.names.get(topic.as_str()).is_some_and(|named| named.kind == Kind::Node);
        let sets = matches!(kind, OnNode::Set(_));
        let (title, label) = if sets {
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
        if sets {
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

    /// Reports a node that neither the simulator stops, nor the runner, which does not launch it and has no process to
    /// stop.
    fn can_be_stopped(&mut self, resource: &ast::Resource, node: NodeId, word: Span) -> bool {
        if self.orders_nodes() {
            return true;
        }
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
    fn runs_freely(&mut self, word: Span) -> bool {
        if self.orders_nodes() {
            return true;
        }
        let Some(step) = self.transport().and_then(|transport| transport.settings.steppings.first()) else {
            return true;
        };
        let title = "`slow` has no effect on a node of a stepped simulator";
        let diagnostic = Diagnostic::new(Code::NODE_OUT_OF_REACH, word, title)
            .label("a step takes as long as its nodes need, so a share of the time changes nothing")
            .secondary(step.0, "the simulator is stepped here")
            .note("to delay what the node publishes, use `latency` on its topics");
        self.report(diagnostic);
        false
    }
}

/// A value of a parameter as tests choose it: a text is itself, and anything else as it is written.
fn in_choices(value: &NewValue) -> String {
    fn list<T>(items: &[T], written: impl Fn(&T) -> String) -> String {
        format!("list [{}]", items.iter().map(written).collect::<Vec<_>>().join(", "))
    }
    match value {
        NewValue::Bool(truth) => truth.to_string(),
        NewValue::Number(number) => number.to_string(),
        NewValue::Text(text) => text.clone(),
        NewValue::Numbers(numbers) => list(numbers, f64::to_string),
        NewValue::Bools(truths) => list(truths, bool::to_string),
        NewValue::Texts(texts) => list(texts, |text| quoted(text)),
    }
}

/// Whether two values are of one type; an empty list is of that of any list.
fn are_alike(one: &NewValue, other: &NewValue) -> bool {
    let is_list = |value: &NewValue| matches!(value, NewValue::Numbers(_) | NewValue::Bools(_) | NewValue::Texts(_));
    let is_empty = |value: &NewValue| matches!(value, NewValue::Numbers(numbers) if numbers.is_empty());
    one.is() == other.is() || is_list(one) && is_list(other) && (is_empty(one) || is_empty(other))
}

/// What an item of a list is, in words.
fn of_item(item: &Item) -> &'static str {
    match item {
        Item::Truth(..) => "a `bool`",
        Item::Text(_) => "a text",
        Item::Number(_) => "a number",
    }
}
