//! What a system says beside its simulator and messages: how it is launched and ended, and what a relay may cost.

use sesame_grammar::Rule;

use super::ast::{Name, Quantity, Text};
use super::parse::{Pair, Reader, child, children, expect_child};
use super::syntax_error::Place;
use crate::span::Span;

/// A program that the system needs beside its simulator.
#[derive(Debug)]
pub(crate) struct Launch {
    pub(crate) command: Command,
    pub(crate) ready: Vec<(Span, Ready)>,
}

/// A program and its arguments; at least the program.
#[derive(Debug)]
pub(crate) struct Command {
    pub(crate) program: Text,
    pub(crate) arguments: Vec<Text>,
}

/// When a launched system counts as ready.
#[derive(Debug)]
pub(crate) struct Ready {
    pub(crate) topic: Name,
    pub(crate) within: Quantity,
}

/// What a relay may add.
#[derive(Debug)]
pub(crate) struct RelayBudget {
    pub(crate) latency: Vec<(Span, Quantity)>,
    pub(crate) jitter: Vec<(Span, Quantity)>,
    pub(crate) damaged: bool,
}

impl Reader<'_> {
    pub(super) fn launch(&mut self, pair: &Pair<'_>) -> Launch {
        let mut launch = Launch { command: self.command(pair), ready: vec![] };
        if let Some(settings) = child(pair, Rule::launch_settings) {
            self.members(&settings, Place::Launch, |reader, ready| {
                let topic = reader.name(&expect_child(&ready, Rule::name));
                let within = reader.signed(&expect_child(&ready, Rule::signed));
                launch.ready.push((reader.keyword_span(&ready), Ready { topic, within }));
            });
        }
        launch
    }

    pub(super) fn command(&mut self, pair: &Pair<'_>) -> Command {
        let mut texts = children(pair, Rule::text).map(|text| self.text_of(&text)).collect::<Vec<_>>().into_iter();
        Command { program: texts.next().expect("a command has a program"), arguments: texts.collect() }
    }

    pub(super) fn relay_budget(&mut self, pair: &Pair<'_>) -> RelayBudget {
        let mut budget = RelayBudget { latency: vec![], jitter: vec![], damaged: false };
        let settings = expect_child(pair, Rule::budget_settings);
        budget.damaged = self.members(&settings, Place::Budget, |reader, setting| {
            let value = (reader.keyword_span(&setting), reader.signed(&expect_child(&setting, Rule::signed)));
            match setting.as_rule() {
                Rule::setting_latency => budget.latency.push(value),
                _ => budget.jitter.push(value),
            }
        });
        budget
    }
}
