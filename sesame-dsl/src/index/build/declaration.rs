//! What each kind of declaration mentions.

use super::{Indexer, SystemIds};
use crate::index::DefinitionId;
use crate::span::Span;
use crate::syntax::ast::eddi::{Eddi, State};
use crate::syntax::ast::lifecycle::{Command, Launch, ReadyWhen};
use crate::syntax::ast::physical::Physical;
use crate::syntax::ast::{
    self, Activation, ActivationMode, Campaign, Contained, Formula, FormulaKind, Metric, MetricSource, Operation,
    OperationBody, Resource, System, Test, Text, TriggerEnd,
};

impl<'a> Indexer<'a> {
    pub(super) fn system(&mut self, system: &'a System, ids: &SystemIds) {
        let System {
            span: _,
            simulators: _,
            messages,
            topics,
            services: _,
            actions: _,
            nodes,
            launches,
            terminates,
            relay_budgets: _,
            has_errors: _,
        } = system;
        for (message, &id) in messages.iter().zip(&ids.messages) {
            for field in &message.fields {
                self.type_of(&field.ty, id);
            }
        }
        for (topic, &id) in topics.iter().zip(&ids.topics) {
            self.type_of(&topic.ty, id);
        }
        for (node, &id) in nodes.iter().zip(&ids.nodes) {
            let lists = [&node.publishes, &node.subscribes, &node.serves, &node.calls];
            for listed in lists.into_iter().flatten().flat_map(|(_, listed)| listed) {
                self.mention(&listed.name, id);
            }
            self.mention_all(&node.every_step, id);
            for answer in node.answers.iter().flat_map(|(_, answers)| answers) {
                self.mention(&answer.to, id);
                self.mention(&answer.with, id);
            }
            self.launches(&node.launches, id);
        }
        // What is launched has no name of its own; it is the simulator's system.
        if let Some(&within) = ids.simulators.first() {
            self.launches(launches, within);
            self.commands(terminates.iter().map(|(_, command)| command), within);
        }
    }

    fn launches(&mut self, launches: &'a [(Span, Launch)], within: DefinitionId) {
        self.commands(launches.iter().map(|(_, launch)| &launch.command), within);
        for (_, ready) in launches.iter().flat_map(|(_, launch)| &launch.ready) {
            if let ReadyWhen::Topic(topic) = &ready.when {
                self.mention(topic, within);
            }
        }
    }

    /// The scenes in the arguments of programs.
    fn commands(&mut self, commands: impl Iterator<Item = &'a Command>, within: DefinitionId) {
        for (word, place) in commands.flat_map(|command| &command.arguments).flat_map(Text::placeholders) {
            let scene = self.names.get(word).filter(|id| self.scenes.contains(id)).copied();
            if let (Some(scene), Some(place)) = (scene, place) {
                self.refer(place, Some(scene), within);
            }
        }
    }

    pub(super) fn metric(&mut self, metric: &'a Metric, id: DefinitionId) {
        let Metric { head: _, ty, directions: _, defaults: _, initials: _, trends: _, accepts: _, source } = metric;
        if let Some(ty) = ty {
            self.type_of(ty, id);
        }
        match source {
            MetricSource::Hook { hooks, has_errors: _ } => self.mention_all(hooks, id),
            MetricSource::FuzzingTime => {}
            MetricSource::Formula(formula) => {
                let Formula { kind, when, every: _, per, outbound: _, whole: _, within: _ } = &**formula;
                match kind {
                    FormulaKind::WhenThen(condition, value) => {
                        self.expression(condition, id);
                        self.expression(value, id);
                    }
                    FormulaKind::Plain(expression) => self.expression(expression, id),
                }
                for (_, condition) in when {
                    self.expression(condition, id);
                }
                for (_, path) in per {
                    self.path(path, id);
                }
            }
        }
    }

    pub(super) fn operation(&mut self, operation: &'a Operation, id: DefinitionId) {
        let OperationBody {
            targets,
            chosen: _,
            resource,
            from,
            to,
            kind,
            kind_word: _,
            within: _,
            lengths: _,
            priority: _,
            inclusion: _,
            untimed: _,
            counted: _,
            wrapped: _,
            contains,
        } = &operation.body;
        for place in targets.iter().flat_map(|target| &target.places) {
            self.path(place, id);
        }
        for constant in kind.constants() {
            self.path(constant, id);
        }
        if let Some(Resource { parameter: _, node, chosen: _, span: _ }) = resource {
            self.mention(&node.name, id);
        }
        for node in from.iter().chain(to).flat_map(|(_, nodes)| nodes) {
            self.mention(&node.name, id);
        }
        for contained in contains.iter().flat_map(|(_, contained)| contained) {
            if let Contained::Variable(name) = contained {
                self.mention_metric(name, id);
            }
        }
    }

    pub(super) fn test(&mut self, test: &'a Test, id: DefinitionId) {
        let Test { head: _, operations, expectations, simulator_seeds: _, has_errors: _ } = test;
        for used in operations {
            let operation = self.mention(&used.operation, id);
            for (name, _) in &used.choices {
                // Parameters of other kinds of operations are words of the language.
                let own = operation.and_then(|operation| self.members.get(&(operation, name.text.as_str())).copied());
                if own.is_some() {
                    self.refer(name.span, own, id);
                }
            }
            if let Activation::Trigger(trigger) = &used.activation {
                self.expression(&trigger.start, id);
                if let TriggerEnd::Until(condition) = &trigger.end {
                    self.expression(condition, id);
                }
            }
        }
        for expectation in expectations {
            match expectation {
                ast::Expectation::Metric { metric, bound } => self.mention_bounded(metric, bound, id),
                ast::Expectation::Requirement(name) => {
                    self.mention(name, id);
                }
            }
        }
    }

    pub(super) fn campaign(&mut self, campaign: &'a Campaign, id: DefinitionId) {
        let Campaign {
            head: _,
            from,
            inherited: _,
            objectives,
            observes,
            operations,
            activates,
            searches: _,
            // Dimensions are words of the language.
            coverages: _,
            explorations: _,
            confirms: _,
            stops: _,
            repeats,
            passives: _,
            ends,
            records: _,
            has_errors: _,
            inherited_errors: _,
        } = campaign;
        if let Some(name) = from {
            self.mention(name, id);
        }
        self.mention_all(objectives, id);
        for name in observes.iter().flat_map(|(_, names)| names) {
            self.mention_metric(name, id);
        }
        for name in operations.iter().flat_map(|clause| &clause.names) {
            self.mention(name, id);
        }
        for (_, mode) in activates {
            if let ActivationMode::Condition(condition) = mode {
                for name in &condition.variables {
                    self.mention_metric(name, id);
                }
            }
        }
        for repeat in repeats {
            self.mention(&repeat.test, id);
        }
        for condition in ends.iter().filter_map(|(_, end)| end.when.as_ref()) {
            self.expression(condition, id);
        }
    }

    pub(super) fn eddi(&mut self, eddi: &'a Eddi, id: DefinitionId) {
        let Eddi { head: _, state, demands, evidence, guarantees, otherwise, has_errors: _ } = eddi;
        match state {
            State::Published(topic) => {
                self.mention(topic, id);
            }
            State::External(_, path) => path.iter().for_each(|path| self.path(path, id)),
        }
        for demand in demands {
            // A demand has the name of a guarantee of the other monitor.
            if let Some(other) = self.mention(&demand.eddi, id) {
                let guarantee = self.members.get(&(other, demand.head.name.text.as_str())).copied();
                self.refer(demand.head.name.span, guarantee, id);
            }
        }
        for expression in evidence
            .iter()
            .map(|item| &item.condition)
            .chain(guarantees.iter().filter_map(|guarantee| guarantee.gate.as_ref()))
        {
            self.expression(expression, id);
        }
        for (path, _) in otherwise.iter().filter_map(|(_, otherwise)| otherwise.mitigation.as_ref()) {
            self.path(path, id);
        }
    }

    pub(super) fn physical(&mut self, lab: &'a Physical, id: DefinitionId) {
        let Physical {
            head: _,
            simulators: _,
            repeats: _,
            costs: _,
            excludes,
            ranks,
            // Dimensions are words of the language.
            budgets: _,
            tolerances,
            interlocks,
            shapes: _,
            fits: _,
            has_errors: _,
        } = lab;
        for (metric, bound) in excludes {
            self.mention_bounded(metric, bound, id);
        }
        let ranked = ranks.iter().flat_map(|(_, keys)| keys).map(|(name, _)| name);
        let tolerated = tolerances.iter().flat_map(|(_, metrics)| metrics).map(|(name, _)| name);
        for name in ranked.chain(tolerated) {
            self.mention_metric(name, id);
        }
        self.mention_all(interlocks, id);
    }
}
