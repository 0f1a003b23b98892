//! The clauses of a system beside its simulator: launching, terminating, the budget of the relay.

use super::{Kind, Resolver};
use crate::diagnostic::{Code, Diagnostic};
use crate::model::{self, Id as _, Lifecycle, TopicId};
use crate::span::Span;
use crate::syntax::ast::lifecycle as written;
use crate::syntax::ast::{Quantity, System};
use crate::units::Unit;

impl<'a> Resolver<'a> {
    pub(super) fn lifecycle(&mut self) -> Option<Lifecycle> {
        let systems = &self.file.systems;
        let launches = self.one_of_all(systems, |system| &system.launches, "launch");
        let terminates = self.one_of_all(systems, |system| &system.terminates, "terminate");
        let budgets = self.one_of_all(systems, |system| &system.relay_budgets, "relay budget");
        let launch = match launches {
            Some((span, launch)) => self.launch(*span, launch).map(Some),
            None => Some(None),
        };
        let terminate = match terminates {
            Some((span, command)) => self.command(*span, command).map(Some),
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
        systems.iter().find_map(|system| clauses(system).first())
    }

    fn launch(&mut self, span: Span, launch: &'a written::Launch) -> Option<model::Launch> {
        let command = self.command(span, &launch.command);
        let ready = match self.single(&launch.ready, "ready when") {
            Some(ready) => {
                let topic = self.find(&ready.topic, Kind::Topic);
                let within = self.positive(&ready.within, &Unit::seconds(), "the time until the system is ready");
                Some(model::Ready { topic: TopicId::from_index(topic?), within: within? })
            }
            None => None,
        };
        Some(model::Launch { command: command?, ready })
    }

    fn command(&mut self, span: Span, command: &'a written::Command) -> Option<model::Command> {
        // Empty texts were reported where they were read.
        let arguments = command.arguments.iter().map(|argument| argument.text.clone()).collect();
        Some(model::Command { span, program: self.program(&command.program)?, arguments })
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
