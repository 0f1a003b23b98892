//! Known tests: operations with their windows and conditions.

use sesame_grammar::Rule;

use super::reader::{Pair, Reader, child, children, expect_child, first_of};
use crate::syntax::ast::{
    Activation, Choice, Count, Expectation, ListedRun, Name, Range, Test, TestOperation, Trigger, TriggerEnd,
};

impl Reader<'_> {
    pub(super) fn test(&mut self, pair: &Pair<'_>) -> Test {
        let head = self.head(pair);
        let mut test =
            Test { head, operations: vec![], expectations: vec![], simulator_seeds: vec![], has_errors: false };
        test.has_errors = self.members(pair, |reader, member| match member.as_rule() {
            Rule::expectation => test.expectations.push(match child(&member, Rule::bound) {
                Some(bound) => Expectation::Metric {
                    metric: reader.metric_name(&expect_child(&member, Rule::metric_name)),
                    bound: reader.bound(&bound),
                },
                None => Expectation::Requirement(reader.name(&expect_child(&member, Rule::name))),
            }),
            Rule::simulator_seed => {
                let span = reader.keyword_span(&member);
                test.simulator_seeds.push((span, reader.count(&expect_child(&member, Rule::number))));
            }
            _ => test.operations.push(reader.test_operation(&member)),
        });
        test
    }

    fn test_operation(&mut self, pair: &Pair<'_>) -> TestOperation {
        let operation = self.name(&expect_child(pair, Rule::name));
        let choices = children(pair, Rule::choice)
            .map(|choice| {
                let word = expect_child(&choice, Rule::parameter_name);
                let name = Name { text: word.as_str().to_owned(), span: self.span(&word) };
                let values = [Rule::range, Rule::signed, Rule::point, Rule::text];
                let value = first_of(&choice, &values).expect("a choice has a value");
                let value = match value.as_rule() {
                    Rule::range => Choice::Range(self.range(&value)),
                    Rule::signed => Choice::Value(self.signed(&value)),
                    Rule::point => Choice::Point(self.point(&value)),
                    _ => Choice::Text(self.any_text(&value)),
                };
                (name, value)
            })
            .collect();
        let activation = first_of(pair, &[Rule::window, Rule::moment, Rule::trigger]).expect("an operation has one");
        let activation = match activation.as_rule() {
            Rule::window => Activation::Window(self.window(&activation)),
            Rule::moment => {
                let (span, moment) = self.moment(&activation);
                Activation::Moment(span, moment)
            }
            _ => Activation::Trigger(Box::new(self.trigger(&activation))),
        };
        let seed = child(pair, Rule::draw_seed).map(|seed| self.count(&expect_child(&seed, Rule::number)));
        let messages = child(pair, Rule::listed_messages).map_or_else(Vec::new, |listed| {
            children(&listed, Rule::listed_run).map(|run| self.listed_run(&run)).collect()
        });
        TestOperation { operation, choices, activation, seed, messages }
    }

    fn listed_run(&mut self, pair: &Pair<'_>) -> ListedRun {
        let mut ends = children(pair, Rule::number).map(|end| self.count(&end)).collect::<Vec<_>>().into_iter();
        let first = ends.next().expect("a run has a first message");
        let wire = child(pair, Rule::on_wire).map(|wire| self.count(&expect_child(&wire, Rule::number)));
        ListedRun { span: self.span(pair), first, last: ends.next(), wire }
    }

    fn window(&mut self, pair: &Pair<'_>) -> Range {
        let mut ends = children(pair, Rule::signed).map(|end| self.signed(&end)).collect::<Vec<_>>();
        let high = ends.pop().expect("a window has an end");
        let low = ends.pop().expect("a window has a start");
        Range { span: low.span.to(high.span), low, high }
    }

    fn trigger(&mut self, pair: &Pair<'_>) -> Trigger {
        let start = self.switch(&expect_child(pair, Rule::switch));
        let end = if let Some(until) = child(pair, Rule::until_condition) {
            TriggerEnd::Until(self.switch(&expect_child(&until, Rule::switch)))
        } else {
            let length = expect_child(pair, Rule::for_length);
            TriggerEnd::For(self.signed(&expect_child(&length, Rule::signed)))
        };
        let times = child(pair, Rule::at_most_times).map(|times| self.times(&times));
        Trigger { start, end, times }
    }

    pub(super) fn times(&mut self, pair: &Pair<'_>) -> Count {
        self.count(&expect_child(pair, Rule::number))
    }
}
