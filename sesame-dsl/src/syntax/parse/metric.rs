//! Metrics and requirements.

use sesame_grammar::Rule;

use super::reader::{Pair, Reader, child, children, comparison, expect_child, first_of};
use crate::syntax::ast::{Bound, Direction, Metric, MetricSource, Requirement, Trend};

impl Reader<'_> {
    pub(super) fn metric(&mut self, pair: &Pair<'_>) -> Metric {
        let head = self.head(pair);
        let ty = child(pair, Rule::metric_type).map(|ty| self.type_of(&expect_child(&ty, Rule::type_of)));
        let directions = children(pair, Rule::direction).map(|direction| {
            let value =
                if child(&direction, Rule::k_maximise).is_some() { Direction::Maximise } else { Direction::Minimise };
            (self.span(&direction), value)
        });
        let directions = directions.collect();
        let mut values = |rule| {
            let clauses = children(pair, rule);
            clauses
                .map(|clause| (self.keyword_span(&clause), self.signed(&expect_child(&clause, Rule::signed))))
                .collect()
        };
        let defaults = values(Rule::default_value);
        let initials = values(Rule::initial_value);
        let trends = children(pair, Rule::trend).map(|trend| {
            let value = if child(&trend, Rule::k_rising).is_some() { Trend::Rising } else { Trend::Falling };
            (self.span(&trend), value)
        });
        let trends = trends.collect();
        let accepts = children(pair, Rule::accepts).map(|accepts| self.span(&accepts)).collect();
        let sources = [Rule::hook_block, Rule::formula, Rule::fuzzing_time];
        let source = first_of(pair, &sources).expect("a metric has a source");
        let source = match source.as_rule() {
            Rule::hook_block => {
                let mut hooks = Vec::new();
                let has_errors = self.members(&source, |reader, hook| {
                    hooks.push((reader.keyword_span(&hook), reader.names(&hook)));
                });
                MetricSource::Hook { hooks, has_errors }
            }
            Rule::formula => MetricSource::Formula(Box::new(self.formula(&source))),
            _ => MetricSource::FuzzingTime,
        };
        Metric { head, ty, directions, defaults, initials, trends, accepts, source }
    }

    pub(super) fn requirement(&mut self, pair: &Pair<'_>) -> Requirement {
        Requirement {
            head: self.head(pair),
            text: self.text_of(&expect_child(pair, Rule::text)),
            metric: self.metric_name(&expect_child(pair, Rule::metric_name)),
            bound: self.bound(&expect_child(pair, Rule::bound)),
        }
    }

    pub(super) fn bound(&mut self, pair: &Pair<'_>) -> Bound {
        if let Some(within) = child(pair, Rule::bound_within) {
            return Bound::Within(self.range(&expect_child(&within, Rule::range)));
        }
        let comparison = comparison(pair).expect("a bound compares or encloses");
        match child(pair, Rule::constant_name) {
            Some(constant) => Bound::Constant(comparison, self.path(&constant)),
            None => Bound::Compare(comparison, self.signed(&expect_child(pair, Rule::signed))),
        }
    }
}
