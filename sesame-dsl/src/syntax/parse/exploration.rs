//! What a campaign does to cover more cells, how it confirms what it finds, and when it has done enough.

use sesame_grammar::Rule;

use super::reader::{Pair, Reader, child, children, expect_child};
use crate::span::Span;
use crate::syntax::ast::{Confirm, Count, Coverage, CoverageAxis, Exploration, ExplorationKind, Name, Stop, Typical};

impl Reader<'_> {
    pub(super) fn coverage(&mut self, pair: &Pair<'_>, span: Span) -> Coverage {
        let mut coverage =
            Coverage { span, axes: vec![], hits: vec![], stops: vec![], failsafes: vec![], has_errors: false };
        coverage.has_errors = self.members(pair, |reader, member| {
            let span = reader.keyword_span(&member);
            match member.as_rule() {
                Rule::coverage_axis => {
                    let dimension = expect_child(&member, Rule::dimension);
                    coverage.axes.push(CoverageAxis {
                        dimension: Name { text: dimension.as_str().to_owned(), span: reader.span(&dimension) },
                        range: reader.range(&expect_child(&member, Rule::range)),
                        cells: reader.count(&expect_child(&member, Rule::number)),
                    });
                }
                Rule::coverage_stop => {
                    coverage.stops.push((span, reader.signed(&expect_child(&member, Rule::signed))));
                }
                rule => {
                    let count = (span, reader.count(&expect_child(&member, Rule::number)));
                    if rule == Rule::coverage_hits { &mut coverage.hits } else { &mut coverage.failsafes }.push(count);
                }
            }
        });
        coverage
    }

    pub(super) fn boost(&mut self, pair: &Pair<'_>, span: Span) -> Exploration {
        let fixed = child(pair, Rule::k_fixed).is_some();
        let kind = if fixed { ExplorationKind::BoostFixed } else { ExplorationKind::BoostLinear };
        let mut boost = empty(span, kind);
        boost.has_errors = self.members(&expect_child(pair, Rule::boost_settings), |reader, setting| {
            let span = reader.keyword_span(&setting);
            let mut counts =
                children(&setting, Rule::number).map(|number| reader.count(&number)).collect::<Vec<Count>>();
            let last = counts.pop().expect("a setting of `boost` has a number");
            match setting.as_rule() {
                Rule::boost_generations => boost.generations.push((span, last)),
                Rule::boost_iterations => boost.iterations.push((span, last)),
                Rule::boost_tries => boost.tries.push((span, last)),
                Rule::boost_drop => boost.drops.push((span, last)),
                _ => boost.children.push((span, [counts.pop().expect("there are two numbers"), last])),
            }
        });
        boost
    }

    pub(super) fn construct(&mut self, pair: &Pair<'_>, span: Span) -> Exploration {
        let mut construct = empty(span, ExplorationKind::Construct);
        construct.has_errors = self.members(&expect_child(pair, Rule::construct_settings), |reader, setting| {
            let share = (reader.keyword_span(&setting), reader.signed(&expect_child(&setting, Rule::signed)));
            match setting.as_rule() {
                Rule::construct_share => construct.shares.push(share),
                _ => construct.untils.push(share),
            }
        });
        construct
    }

    pub(super) fn predict(&mut self, pair: &Pair<'_>, span: Span) -> Exploration {
        let mut predict = empty(span, ExplorationKind::Predict);
        predict.has_errors = self.members(&expect_child(pair, Rule::predict_settings), |reader, setting| {
            let count = reader.count(&expect_child(&setting, Rule::number));
            predict.candidates.push((reader.keyword_span(&setting), count));
        });
        predict
    }

    pub(super) fn confirm(&mut self, pair: &Pair<'_>, span: Span) -> Confirm {
        let times = self.count(&expect_child(pair, Rule::number));
        let mut confirm = Confirm { span, times, by: vec![], violations: vec![] };
        if let Some(settings) = child(pair, Rule::confirm_settings) {
            self.members(&settings, |reader, setting| {
                if setting.as_rule() == Rule::confirm_violations {
                    confirm.violations.push((reader.keyword_span(&setting), ()));
                    return;
                }
                let typical = if child(&setting, Rule::k_mean).is_some() {
                    Typical::Mean
                } else if child(&setting, Rule::k_median).is_some() {
                    Typical::Median
                } else {
                    Typical::Quantile(reader.signed(&expect_child(&setting, Rule::signed)))
                };
                confirm.by.push((reader.keyword_span(&setting), typical));
            });
        }
        confirm
    }

    pub(super) fn novelty(&mut self, pair: &Pair<'_>, span: Span) -> Exploration {
        let mut novelty = empty(span, ExplorationKind::Novelty);
        novelty.has_errors = self.members(&expect_child(pair, Rule::novelty_settings), |reader, setting| {
            let span = reader.keyword_span(&setting);
            match setting.as_rule() {
                Rule::novelty_over => novelty.overs.push((span, reader.names(&setting))),
                _ => novelty.neighbours.push((span, reader.count(&expect_child(&setting, Rule::number)))),
            }
        });
        novelty
    }

    pub(super) fn stop(&mut self, pair: &Pair<'_>, span: Span) -> Stop {
        let mut stop = Stop {
            span,
            times: vec![],
            stagnations: vec![],
            discoveries: vec![],
            completenesses: vec![],
            causes: vec![],
            pairs: vec![],
            has_errors: false,
        };
        stop.has_errors = self.members(&expect_child(pair, Rule::stop_settings), |reader, rule| {
            let span = reader.keyword_span(&rule);
            let quantity = child(&rule, Rule::signed).map(|signed| reader.signed(&signed));
            let count = child(&rule, Rule::number).map(|number| reader.count(&number));
            match (rule.as_rule(), quantity, count) {
                (Rule::stop_time, Some(quantity), _) => stop.times.push((span, quantity)),
                (Rule::stop_stagnation, Some(quantity), Some(generations)) => {
                    stop.stagnations.push((span, (generations, quantity)));
                }
                (Rule::stop_discovery, Some(quantity), _) => stop.discoveries.push((span, quantity)),
                (Rule::stop_completeness, Some(quantity), _) => stop.completenesses.push((span, quantity)),
                (Rule::stop_causes, _, Some(tests)) => stop.causes.push((span, tests)),
                (Rule::stop_pairs, ..) => stop.pairs.push((span, ())),
                (rule, ..) => unreachable!("a rule of `stop` has what the grammar says: {rule:?}"),
            }
        });
        stop
    }
}

fn empty(span: Span, kind: ExplorationKind) -> Exploration {
    Exploration {
        span,
        kind,
        generations: vec![],
        iterations: vec![],
        tries: vec![],
        children: vec![],
        drops: vec![],
        shares: vec![],
        untils: vec![],
        candidates: vec![],
        neighbours: vec![],
        overs: vec![],
        has_errors: false,
    }
}
