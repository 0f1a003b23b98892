//! What operations disturb, and how.

use sesame_grammar::Rule;

use super::ast::{Amounts, Distribution, Drain, NotFinite, OperationKind, Place, Range, Step, Stuck, Target, Text};
use super::parse::{Pair, Reader, child, children, expect_child, first_of};
use crate::span::Span;

const KINDS: [Rule; 18] = [
    Rule::random_value,
    Rule::stuck_at,
    Rule::bias,
    Rule::drift,
    Rule::noise,
    Rule::scale,
    Rule::not_finite,
    Rule::freeze,
    Rule::stale_value,
    Rule::clock_skew,
    Rule::packet_loss,
    Rule::burst_loss,
    Rule::rate_limit,
    Rule::latency,
    Rule::reorder,
    Rule::duplicate,
    Rule::blackhole,
    Rule::custom,
];

impl Reader<'_> {
    pub(super) fn target(&mut self, pair: &Pair<'_>) -> Target {
        let places: Vec<Place> = children(pair, Rule::target).map(|place| self.place(&place)).collect();
        let topic = places.first().expect("an operation has a target").topic.clone();
        Target { topic, places, span: self.span(pair) }
    }

    fn place(&mut self, pair: &Pair<'_>) -> Place {
        let steps = pair.clone().into_inner().filter_map(|step| match step.as_rule() {
            Rule::field_name => Some(Step::Field(self.field_name(&step))),
            Rule::element => Some(match child(&step, Rule::number) {
                Some(number) => Step::Element(self.count(&number), self.span(&step)),
                None => Step::Each(self.span(&step)),
            }),
            _ => None,
        });
        let steps = steps.collect();
        Place { topic: self.name(&expect_child(pair, Rule::name)), steps, span: self.span(pair) }
    }

    pub(super) fn operation_kind(&mut self, pair: &Pair<'_>) -> OperationKind {
        let kind = first_of(pair, &KINDS).expect("an operation has a kind");
        match kind.as_rule() {
            Rule::random_value => match child(&kind, Rule::value_mode) {
                Some(mode) => OperationKind::Random {
                    absolute: child(&mode, Rule::k_absolute).is_some(),
                    amounts: self.amounts(&kind).expect("a random value says what is drawn from"),
                },
                None => OperationKind::RandomText(self.listed(&expect_child(&kind, Rule::text_domain))),
            },
            Rule::stuck_at => {
                OperationKind::StuckAt(match (child(&kind, Rule::text_domain), child(&kind, Rule::truth)) {
                    (Some(texts), _) => Stuck::Texts(self.listed(&texts)),
                    (_, Some(truth)) => Stuck::Truth(child(&truth, Rule::k_true).is_some(), self.span(&truth)),
                    _ => Stuck::Amounts(self.amounts(&kind).expect("a value is stuck at something")),
                })
            }
            Rule::bias => OperationKind::Bias(self.amounts(&kind).expect("a bias has a range")),
            Rule::drift => OperationKind::Drift(self.amounts(&kind).expect("a drift has a range")),
            Rule::noise => OperationKind::Noise(self.only_range(&kind)),
            Rule::scale => OperationKind::Scale(self.only_range(&kind)),
            Rule::not_finite => {
                OperationKind::NotFinite(match (child(&kind, Rule::k_nan), child(&kind, Rule::minus)) {
                    (Some(_), _) => NotFinite::Nan,
                    (None, None) => NotFinite::Infinity,
                    (None, Some(_)) => NotFinite::MinusInfinity,
                })
            }
            Rule::freeze => OperationKind::Freeze,
            Rule::stale_value => OperationKind::Stale(self.only_range(&kind)),
            Rule::clock_skew => OperationKind::ClockSkew(self.only_range(&kind)),
            Rule::packet_loss => OperationKind::PacketLoss(self.only_range(&kind)),
            Rule::burst_loss => OperationKind::BurstLoss {
                span: self.keyword_span(&kind).to(self.span(&expect_child(&kind, Rule::k_loss))),
                enter: self.ranges(&kind, Rule::burst_enter),
                leave: self.ranges(&kind, Rule::burst_leave),
                loss: self.ranges(&kind, Rule::burst_drops),
            },
            Rule::rate_limit => OperationKind::RateLimit(self.only_range(&kind)),
            Rule::latency => OperationKind::Latency {
                range: self.only_range(&kind),
                distribution: children(&kind, Rule::distribution)
                    .map(|written| {
                        let word = first_of(&written, &[Rule::k_fixed, Rule::k_uniform, Rule::k_normal]);
                        let distribution = match word.expect("a distribution has a name").as_rule() {
                            Rule::k_fixed => Distribution::Fixed,
                            Rule::k_uniform => Distribution::Uniform,
                            _ => Distribution::Normal,
                        };
                        (self.span(&written), distribution)
                    })
                    .collect(),
                drain: self.drains(&kind),
            },
            Rule::reorder => OperationKind::Reorder { range: self.only_range(&kind), drain: self.drains(&kind) },
            Rule::duplicate => OperationKind::Duplicate(self.only_range(&kind)),
            Rule::blackhole => OperationKind::Blackhole,
            _ => OperationKind::Custom(self.custom(&kind)),
        }
    }

    fn only_range(&mut self, pair: &Pair<'_>) -> Range {
        self.range(&expect_child(pair, Rule::range))
    }

    fn ranges(&mut self, pair: &Pair<'_>, rule: Rule) -> Vec<(Span, Range)> {
        children(pair, rule).map(|clause| (self.keyword_span(&clause), self.only_range(&clause))).collect()
    }

    fn amounts(&mut self, pair: &Pair<'_>) -> Option<Amounts> {
        if let Some(range) = child(pair, Rule::range) {
            return Some(Amounts::Range(self.range(&range)));
        }
        let corners = child(pair, Rule::corners)?;
        let mut points = children(&corners, Rule::point).map(|point| self.point(&point));
        let mut next = || points.next().expect("a box has two corners");
        Some(Amounts::Corners(Box::new([next(), next()]), self.span(&corners)))
    }

    fn listed(&mut self, pair: &Pair<'_>) -> Vec<Text> {
        children(&expect_child(pair, Rule::texts), Rule::text).map(|text| self.text_of(&text)).collect()
    }

    fn drains(&mut self, pair: &Pair<'_>) -> Vec<(Span, Drain)> {
        let drains = children(pair, Rule::drain).map(|drain| {
            let mode = match first_of(&drain, &[Rule::k_finish, Rule::k_flush, Rule::k_drop]) {
                Some(mode) if mode.as_rule() == Rule::k_flush => Drain::Flush,
                Some(mode) if mode.as_rule() == Rule::k_drop => Drain::Drop,
                _ => Drain::Finish,
            };
            (self.keyword_span(&drain), mode)
        });
        drains.collect()
    }
}
