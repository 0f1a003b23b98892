//! How a system is launched and ended, and what a relay may cost.

use sesame_grammar::Rule;

use super::reader::{Pair, Reader, child, children, expect_child, first_of};
use crate::syntax::ast::Text;
use crate::syntax::ast::lifecycle::{Command, Launch, Ready, ReadyWhen, RelayBudget};

impl Reader<'_> {
    pub(super) fn launch(&mut self, pair: &Pair<'_>) -> Launch {
        let mut launch = Launch { command: self.command(pair), ready: vec![] };
        if let Some(settings) = child(pair, Rule::launch_settings) {
            self.members(&settings, |reader, ready| {
                let when = reader.ready_when(&ready);
                let within = reader.signed(&expect_child(&ready, Rule::signed));
                launch.ready.push((reader.keyword_span(&ready), Ready { when, within }));
            });
        }
        launch
    }

    fn ready_when(&mut self, ready: &Pair<'_>) -> ReadyWhen {
        let forms = [Rule::ready_topic, Rule::ready_port, Rule::ready_line, Rule::ready_clock];
        let when = first_of(ready, &forms).expect("something shows that it is ready");
        match when.as_rule() {
            Rule::ready_topic => ReadyWhen::Topic(self.name(&expect_child(&when, Rule::name))),
            Rule::ready_port => ReadyWhen::Port(if let Some(text) = child(&when, Rule::text) {
                self.text_of(&text)
            } else {
                let number = expect_child(&when, Rule::number);
                Text { text: number.as_str().to_owned(), span: self.span(&number) }
            }),
            Rule::ready_line => ReadyWhen::Line(self.text_of(&expect_child(&when, Rule::text))),
            _ => ReadyWhen::Clock(self.span(&when)),
        }
    }

    pub(super) fn command(&mut self, pair: &Pair<'_>) -> Command {
        let mut texts = children(pair, Rule::text).map(|text| self.text_of(&text)).collect::<Vec<_>>().into_iter();
        Command { program: texts.next().expect("a command has a program"), arguments: texts.collect() }
    }

    pub(super) fn relay_budget(&mut self, pair: &Pair<'_>) -> RelayBudget {
        let mut budget = RelayBudget { latency: vec![], jitter: vec![], has_errors: false };
        let settings = expect_child(pair, Rule::budget_settings);
        budget.has_errors = self.members(&settings, |reader, setting| {
            let value = (reader.keyword_span(&setting), reader.signed(&expect_child(&setting, Rule::signed)));
            match setting.as_rule() {
                Rule::setting_latency => budget.latency.push(value),
                _ => budget.jitter.push(value),
            }
        });
        budget
    }
}
