//! Operations of known tests with their windows and conditions, and what the conditions of a campaign are made of.

use sesame_grammar::Rule;

use super::ast::{Activation, ByCondition, Choice, Contained, Count, Name, Range, TestOperation, Trigger, TriggerEnd};
use super::parse::{Pair, Reader, child, children, expect_child, first_of};
use super::syntax_error::Place;

impl Reader<'_> {
    pub(super) fn test_operation(&mut self, pair: &Pair<'_>) -> TestOperation {
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
                    _ => Choice::Text(self.text_of(&value)),
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
        TestOperation { operation, choices, activation, seed }
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

    fn times(&mut self, pair: &Pair<'_>) -> Count {
        self.count(&expect_child(pair, Rule::number))
    }

    pub(super) fn by_condition(&mut self, pair: &Pair<'_>) -> ByCondition {
        let mut found = ByCondition {
            variables: vec![],
            ranges: vec![],
            depth: vec![],
            integers: vec![],
            lengths: vec![],
            times: vec![],
        };
        for variable in children(pair, Rule::condition_variable) {
            found.variables.push(self.name(&expect_child(&variable, Rule::name)));
            found.ranges.push(child(&variable, Rule::range).map(|range| self.range(&range)));
        }
        if let Some(settings) = child(pair, Rule::condition_settings) {
            // Each setting has a default, so a block that is damaged lacks none.
            self.members(&settings, Place::Condition, |reader, setting| {
                let span = reader.keyword_span(&setting);
                match setting.as_rule() {
                    Rule::setting_depth => {
                        found.depth.push((span, reader.count(&expect_child(&setting, Rule::number))));
                    }
                    _ => found.integers.push((span, reader.range(&expect_child(&setting, Rule::range)))),
                }
            });
        }
        for lengths in children(pair, Rule::for_lengths) {
            found.lengths.push((self.keyword_span(&lengths), self.range(&expect_child(&lengths, Rule::range))));
        }
        for times in children(pair, Rule::at_most_times) {
            found.times.push((self.keyword_span(&times), self.times(&times)));
        }
        found
    }

    /// What stands in one `start contains`.
    pub(super) fn contained(&mut self, pair: &Pair<'_>) -> Vec<Contained> {
        let mut found = Vec::new();
        for item in pair.clone().into_inner() {
            match item.as_rule() {
                Rule::name => found.push(Contained::Variable(self.name(&item))),
                Rule::contained_integer => {
                    let range = self.range(&expect_child(&item, Rule::range));
                    found.push(Contained::Integer(self.span(&item), range));
                }
                _ => {}
            }
        }
        found
    }
}
