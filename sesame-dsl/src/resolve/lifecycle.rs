//! The clauses of a system in addition to its simulator: launching, terminating, the budget of the relay.

use super::placeholders::Purpose;
use super::{Kind, Resolver};
use crate::diagnostic::{Code, Diagnostic};
use crate::model::{self, Id as _, Lifecycle, ReadyWhen, TopicId};
use crate::span::Span;
use crate::syntax::ast::lifecycle as written;
use crate::syntax::ast::{self, Name, Quantity, System, Text};
use crate::units::Unit;

/// What a node says in addition to its topics.
pub(super) struct RestOfNode {
    pub(super) launch: Option<model::Launch>,
    pub(super) answers: Vec<(TopicId, TopicId)>,
    pub(super) every_step: Vec<TopicId>,
    pub(super) broker: Option<String>,
}

impl<'a> Resolver<'a> {
    pub(super) fn lifecycle(&mut self) -> Option<Lifecycle> {
        let systems = &self.file.systems;
        let launches = self.one_of_all(systems, |system| &system.launches, "launch");
        let terminates = self.one_of_all(systems, |system| &system.terminates, "terminate");
        let budgets = self.one_of_all(systems, |system| &system.relay_budgets, "relay budget");
        let launch = match launches {
            Some((span, launch)) => self.launch(*span, launch, Purpose::Argument).map(Some),
            None => Some(None),
        };
        let terminate = match terminates {
            Some((span, command)) => self.command(*span, command, Purpose::Argument).map(Some),
            None => Some(None),
        };
        let relay_budget = match budgets {
            Some((span, budget)) => self.relay_budget(*span, budget).map(Some),
            None => Some(None),
        };
        Some(Lifecycle { launch: launch?, terminate: terminate?, relay_budget: relay_budget? })
    }

    /// The one clause of all systems; further ones are reported.
    fn one_of_all<T>(
        &mut self,
        systems: &'a [System],
        clauses: fn(&System) -> &Vec<(Span, T)>,
        what: &str,
    ) -> Option<&'a (Span, T)> {
        let spans: Vec<Span> =
            systems.iter().flat_map(|system| clauses(system).iter().map(|(span, _)| *span)).collect();
        self.at_most_one(&spans, what);
        if what != "relay budget"
            && let Some(&span) = spans.first()
        {
            self.has_programs(span, what);
        }
        systems.iter().find_map(|system| clauses(system).first())
    }

    /// Reports a command for a simulator that is part of the runner.
    fn has_programs(&mut self, span: Span, what: &str) {
        let Some((word, simulator)) = self.without(|kind| !kind.in_runner) else { return };
        let title = format!("`{what}` has nothing to do: simulator kind `{word}` is part of the runner");
        let diagnostic = Diagnostic::new(Code::NOTHING_TO_LAUNCH, span, title)
            .label(format!("remove this `{what}`"))
            .secondary(simulator, "the simulator is declared here")
            .note(
                "what the simulator needs, it starts in `Simulator::reset`, or a custom operation `before start` does",
            );
        self.report(diagnostic);
    }

    /// What a node says in addition to its topics.
    pub(super) fn rest_of_node(
        &mut self,
        node: &'a ast::Node,
        publishes: Option<&[TopicId]>,
        subscribes: Option<&[TopicId]>,
    ) -> Option<RestOfNode> {
        let is_group = node.named.as_ref().is_some_and(|named| named.text.contains('{'));
        let mut has_name = true;
        if let (Some(written), false, Some((kind, simulator))) = (&node.named, is_group, self.other_than_ros()) {
            let title = format!("simulator kind `{kind}` has no names of nodes");
            let diagnostic = Diagnostic::new(Code::NOT_ROS, written.span, title)
                .label("only nodes of a simulator of ROS have a name in addition to their own; remove it")
                .secondary(simulator, "the simulator is declared here")
                .note("a name with braces, such as `\"{r1,r2}\"`, declares a group of nodes");
            self.report(diagnostic);
            has_name = false;
        }
        let launch = match self.single(&node.launches, "launch") {
            Some(launch) => {
                let span = node.launches[0].0;
                self.has_programs(span, "launch");
                let purpose = if is_group { Purpose::ArgumentOfMember } else { Purpose::Argument };
                self.launch(span, launch, purpose).map(Some)
            }
            None => Some(None),
        };
        let mut answers = Some(Vec::new());
        for answer in self.single(&node.answers, "answers").into_iter().flatten() {
            let to = self.answered(node, &answer.to, subscribes, "subscribe to");
            let with = self.answered(node, &answer.with, publishes, "publish");
            match (&mut answers, to, with) {
                (Some(answers), Some(to), Some(with)) => answers.push((to, with)),
                _ => answers = None,
            }
        }
        let mut every_step = Some(Vec::new());
        for name in self.single(&node.every_step, "every step").into_iter().flatten() {
            match (&mut every_step, self.answered(node, name, publishes, "publish")) {
                (Some(topics), Some(topic)) => topics.push(topic),
                _ => every_step = None,
            }
        }
        let broker = self.broker_of(node);
        Some(RestOfNode {
            launch: launch.filter(|_| has_name)?,
            answers: answers?,
            every_step: every_step?,
            broker: broker.ok()?,
        })
    }

    /// A topic of an answer, which is among those that the node says it publishes or subscribes to.
    fn answered(&mut self, node: &ast::Node, name: &'a Name, among: Option<&[TopicId]>, does: &str) -> Option<TopicId> {
        let topic = TopicId::from_index(self.find(name, Kind::Topic)?);
        if among?.contains(&topic) {
            return Some(topic);
        }
        let title = format!("node `{}` does not {does} `{}`", node.head.name.text, name.text);
        let diagnostic = Diagnostic::new(Code::WHICH_NODES, name.span, title)
            .label(format!("a node answers what it subscribes to with what it publishes; add `{}` there", name.text))
            .secondary(node.head.name.span, "the node is declared here");
        self.report(diagnostic);
        None
    }

    fn ready(&mut self, ready: &'a written::Ready) -> Option<model::Ready> {
        let when = match &ready.when {
            written::ReadyWhen::Topic(topic) => {
                self.find(topic, Kind::Topic).map(|topic| ReadyWhen::Topic(TopicId::from_index(topic)))
            }
            written::ReadyWhen::Port(port) => self.port(port).map(ReadyWhen::Port),
            written::ReadyWhen::Clock(span) => self.clock(*span),
            written::ReadyWhen::Line(text) => Some(ReadyWhen::Line(text.text.clone())),
        };
        let within = self.positive(&ready.within, &Unit::seconds(), "the time until the program is ready");
        Some(model::Ready { when: when?, within: within? })
    }

    /// The number of a port, or a text that is one once its placeholders are replaced.
    fn port(&mut self, port: &Text) -> Option<String> {
        if port.text.trim().is_empty() || !self.placeholders(port, Purpose::Port) {
            return None;
        }
        let replaced = port.text.contains("{port}") || port.text.contains("{worker}");
        let number = port.text.replace("{port}", "1").replace("{worker}", "1");
        let sound = !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit());
        if !sound || (!replaced && !number.parse::<u16>().is_ok_and(|port| port > 0)) {
            let title = format!("`{}` is not a port", port.text);
            let diagnostic = Diagnostic::new(Code::OUT_OF_RANGE, port.span, title)
                .label("expected a number from 1 to 65535, or a text such as `\"{port}\"`");
            self.report(diagnostic);
            return None;
        }
        Some(port.text.clone())
    }

    /// The clock of the simulator, which only some have.
    fn clock(&mut self, span: Span) -> Option<ReadyWhen> {
        if self.has_a_clock() || self.simulators().next().is_none_or(|simulator| simulator.transport.is_none()) {
            return Some(ReadyWhen::Clock);
        }
        let diagnostic = Diagnostic::new(Code::CLAUSE_MISSING, span, "the simulator has no clock that could advance")
            .label("only a simulator of ROS with a `clock \"TOPIC\"` has one")
            .note("wait for a `topic`, a `port` or a `line` instead");
        self.report(diagnostic);
        None
    }

    fn launch(&mut self, span: Span, launch: &'a written::Launch, purpose: Purpose) -> Option<model::Launch> {
        let command = self.command(span, &launch.command, purpose);
        let ready = match self.single(&launch.ready, "ready when") {
            Some(ready) => self.ready(ready).map(Some),
            None => Some(None),
        };
        Some(model::Launch { command: command?, ready: ready? })
    }

    fn command(&mut self, span: Span, command: &'a written::Command, purpose: Purpose) -> Option<model::Command> {
        let sound = command.arguments.iter().map(|argument| self.placeholders(argument, purpose));
        let sound = sound.fold(true, |all, one| all & one);
        // Empty texts were reported where they were read.
        let arguments = command.arguments.iter().map(|argument| argument.text.clone()).collect();
        let program = self.program(&command.program)?;
        sound.then_some(model::Command { span, program, arguments })
    }

    fn relay_budget(&mut self, span: Span, budget: &'a written::RelayBudget) -> Option<model::RelayBudget> {
        let latency = self.single(&budget.latency, "latency");
        let jitter = self.single(&budget.jitter, "jitter");
        if latency.is_none() && jitter.is_none() {
            if !budget.has_errors {
                let diagnostic =
                    Diagnostic::new(Code::CLAUSE_MISSING, span, "`relay budget` needs `latency` or `jitter`");
                self.report(diagnostic.label("add at least one of them").note("for example `latency 5ms`"));
            }
            return None;
        }
        let mut time = |quantity: Option<&Quantity>, what: &str| match quantity {
            Some(quantity) => self.positive(quantity, &Unit::seconds(), what).map(Some),
            None => Some(None),
        };
        let latency = time(latency, "the latency of a relay");
        let jitter = time(jitter, "the jitter of a relay");
        Some(model::RelayBudget { span, latency: latency?, jitter: jitter? })
    }
}
