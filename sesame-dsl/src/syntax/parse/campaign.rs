//! Campaigns: their clauses, searches, and what conditions are grown from.

use std::sync::Arc;

use sesame_grammar::Rule;
use sesame_plan::{Copies, Setting, StrategyKind};

use super::reader::{Pair, Reader, child, children, expect_child};
use crate::span::Span;
use crate::syntax::ast::{
    ActivationMode, ByCondition, Campaign, Count, EndOfTest, Inherited, Operations, Passive, Record, Repeat, Search,
};

impl Reader<'_> {
    pub(super) fn campaign(&mut self, pair: &Pair<'_>) -> Campaign {
        let mut campaign = Campaign {
            head: self.head(pair),
            from: child(pair, Rule::campaign_from).map(|from| self.name(&expect_child(&from, Rule::name))),
            inherited: Inherited::default(),
            objectives: vec![],
            observes: vec![],
            operations: vec![],
            activates: vec![],
            searches: vec![],
            coverages: vec![],
            explorations: vec![],
            confirms: vec![],
            stops: vec![],
            repeats: vec![],
            passives: vec![],
            ends: vec![],
            records: vec![],
            has_errors: false,
            inherited_errors: false,
        };
        campaign.has_errors = self.members(pair, |reader, member| {
            let span = reader.keyword_span(&member);
            match member.as_rule() {
                Rule::objectives => campaign.objectives.push((span, reader.names(&member))),
                Rule::observes => campaign.observes.push((span, reader.metric_names(&member))),
                Rule::operations => {
                    let count = expect_child(&member, Rule::count);
                    let counts: Vec<Count> =
                        children(&count, Rule::number).map(|number| reader.count(&number)).collect();
                    let min = *counts.first().expect("a count has a number");
                    let max = *counts.last().expect("a count has a number");
                    let copies = [(Rule::may_overlap, Copies::MayOverlap), (Rule::at_most_once, Copies::Once)];
                    let copies = copies
                        .into_iter()
                        .find_map(|(rule, copies)| Some((reader.span(&child(&member, rule)?), copies)));
                    campaign.operations.push(Operations { span, names: reader.names(&member), min, max, copies });
                }
                Rule::activate => {
                    let mode = match child(&member, Rule::by_condition) {
                        Some(condition) => ActivationMode::Condition(reader.by_condition(&condition)),
                        None => ActivationMode::Time,
                    };
                    campaign.activates.push((span, mode));
                }
                Rule::search => campaign.searches.push(reader.search(&member, span)),
                Rule::coverage => campaign.coverages.push(reader.coverage(&member, span)),
                Rule::boost => campaign.explorations.push(reader.boost(&member, span)),
                Rule::predict => campaign.explorations.push(reader.predict(&member, span)),
                Rule::novelty => campaign.explorations.push(reader.novelty(&member, span)),
                Rule::confirm => campaign.confirms.push(reader.confirm(&member, span)),
                Rule::stop => campaign.stops.push(reader.stop(&member, span)),
                Rule::construct => campaign.explorations.push(reader.construct(&member, span)),
                Rule::end => {
                    let after = reader.signed(&expect_child(&member, Rule::signed));
                    let when = child(&member, Rule::end_when);
                    let when = when.map(|when| Arc::new(reader.switch(&expect_child(&when, Rule::switch))));
                    campaign.ends.push((span, EndOfTest { after, when }));
                }
                Rule::record => {
                    let all = child(&member, Rule::k_all).is_some();
                    campaign.records.push((span, if all { Record::All } else { Record::Failing }));
                }
                Rule::repeat => {
                    let seed = reader.seeds(&member);
                    campaign.repeats.push(Repeat {
                        span,
                        test: reader.name(&expect_child(&member, Rule::name)),
                        times: reader.count(&expect_child(&member, Rule::number)),
                        seed,
                    });
                }
                Rule::passive => {
                    let seed = reader.seeds(&member);
                    let times = reader.count(&expect_child(&member, Rule::number));
                    campaign.passives.push(Passive { span, times, seed });
                }
                other => unreachable!("{other:?} is not a member of a campaign"),
            }
        });
        campaign.inherited_errors = campaign.has_errors;
        campaign
    }

    fn search(&mut self, pair: &Pair<'_>, span: Span) -> Search {
        let mut search = Search {
            span,
            strategy: None,
            own: vec![],
            evaluations: vec![],
            seed: vec![],
            neighbours: vec![],
            keep_causes: vec![],
            has_errors: false,
        };
        if let Some(strategy) = child(pair, Rule::unsupported_strategy) {
            self.unsupported(&strategy);
            return search;
        }
        let written = pair.clone().into_inner().find_map(|word| StrategyKind::from_keyword(word.as_str()));
        search.strategy = written.or(Some(StrategyKind::Interleaved));
        let settings = expect_child(pair, Rule::search_settings);
        search.has_errors = self.members(&settings, |reader, setting| {
            let span = reader.keyword_span(&setting);
            if setting.as_rule() == Rule::setting_causes {
                search.keep_causes.push((span, ()));
                return;
            }
            let value = (span, reader.count(&expect_child(&setting, Rule::number)));
            match setting.as_rule() {
                Rule::strategy_setting => {
                    let own = setting.into_inner().find_map(|word| Setting::from_keyword(word.as_str()));
                    search.own.extend(own.map(|own| (span, (own, value.1))));
                }
                Rule::setting_evaluations => search.evaluations.push(value),
                Rule::setting_neighbours => search.neighbours.push(value),
                _ => search.seed.push(value),
            }
        });
        search
    }

    /// The seeds in the settings of a repetition.
    fn seeds(&mut self, pair: &Pair<'_>) -> Vec<(Span, Count)> {
        let mut seeds = Vec::new();
        if let Some(settings) = child(pair, Rule::repeat_settings) {
            self.members(&settings, |reader, setting| {
                let span = reader.keyword_span(&setting);
                seeds.push((span, reader.count(&expect_child(&setting, Rule::number))));
            });
        }
        seeds
    }

    fn by_condition(&mut self, pair: &Pair<'_>) -> ByCondition {
        let mut found = ByCondition {
            variables: vec![],
            ranges: vec![],
            steps: vec![],
            depth: vec![],
            integers: vec![],
            lengths: vec![],
            times: vec![],
        };
        for variable in children(pair, Rule::condition_variable) {
            found.variables.push(self.metric_name(&expect_child(&variable, Rule::metric_name)));
            found.ranges.push(child(&variable, Rule::range).map(|range| self.range(&range)));
            found.steps.push(child(&variable, Rule::signed).map(|step| self.signed(&step)));
        }
        if let Some(settings) = child(pair, Rule::condition_settings) {
            // Each setting has a default, so a block with errors lacks none.
            self.members(&settings, |reader, setting| {
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
}
