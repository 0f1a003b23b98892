//! Operations: what they disturb, and how.

use sesame_grammar::Rule;
use sesame_plan::Counted;

use super::reader::{Pair, Reader, child, children, expect_child, first_of};
use crate::diagnostic::{Code, Diagnostic, Suggestion};
use crate::span::Span;
use crate::syntax::ast::{
    Amounts, Chosen, Contained, Count, Custom, CustomParameter, Distribution, Domain, Drain, Item, Moment, New,
    NewValue, NotFinite, OnNode, Operation, OperationBody, OperationKind, Path, Point, Range, Resource, Scene, Stuck,
    Target, Text, UnitName,
};

impl Reader<'_> {
    pub(super) fn operation(&mut self, pair: &Pair<'_>) -> Operation {
        let head = self.head(pair);
        let written = after_equals(pair).expect("an operation has a kind");
        let kind_word = self.keyword_span(&written);
        let kind = self.operation_kind(&written);
        let mut signed = |rule| {
            let clauses = children(pair, rule);
            clauses
                .map(|clause| (self.keyword_span(&clause), self.signed(&expect_child(&clause, Rule::signed))))
                .collect()
        };
        let priority = signed(Rule::priority);
        let inclusion = signed(Rule::inclusion);
        let mut ranges = |rule| {
            let clauses = children(pair, rule);
            clauses
                .map(|clause| (self.keyword_span(&clause), self.range(&expect_child(&clause, Rule::range))))
                .collect()
        };
        let within = ranges(Rule::within);
        let lengths = ranges(Rule::for_lengths);
        let contains = children(pair, Rule::start_contains)
            .map(|clause| (self.keyword_span(&clause), self.contained(&clause)))
            .collect();
        let mut counted = Vec::new();
        for (rule, by) in [(Rule::next_messages, Counted::Next), (Rule::every_messages, Counted::Every)] {
            counted
                .extend(children(pair, rule).map(|clause| (by, self.keyword_span(&clause), self.only_range(&clause))));
        }
        let wrapped = children(pair, Rule::wrapped)
            .map(|clause| (self.keyword_span(&clause), child(&clause, Rule::range).map(|range| self.range(&range))))
            .collect();
        let untimed = children(pair, Rule::untimed).map(|untimed| self.span(&untimed)).collect();
        let mut nodes = |rule| child(pair, rule).map(|nodes| (self.keyword_span(&nodes), self.with_members(&nodes)));
        let from = nodes(Rule::from_nodes);
        let to = nodes(Rule::to_nodes);
        let chosen = child(pair, Rule::chosen).map(|chosen| self.chosen(&chosen));
        let targets = child(pair, Rule::targets).map_or_else(Vec::new, |targets| self.targets(&targets));
        let resource = first_of(pair, &[Rule::on_node, Rule::on_parameter]).map(|resource| self.resource(&resource));
        let body = OperationBody {
            targets,
            chosen,
            resource,
            from,
            to,
            kind,
            kind_word,
            within,
            lengths,
            priority,
            inclusion,
            untimed,
            counted,
            wrapped,
            contains,
        };
        Operation { head, body }
    }

    /// A parameter of the simulator, which a test chooses like an operation before the start of its run.
    pub(super) fn scene_parameter(&mut self, pair: &Pair<'_>) -> Operation {
        let ty = expect_child(pair, Rule::scene_type);
        let unit = child(&ty, Rule::unit_in_brackets).map(|unit| self.unit(&expect_child(&unit, Rule::unit)));
        let usual = child(pair, Rule::default_value).map(|usual| self.signed(&expect_child(&usual, Rule::signed)));
        let kind = OperationKind::Scene(Scene {
            known_as: child(pair, Rule::text).map(|name| self.text_of(&name)),
            integer: child(&ty, Rule::k_int).is_some(),
            unit,
            range: self.only_range(pair),
            usual,
        });
        Operation { head: self.head(pair), body: OperationBody::of_kind(kind, self.keyword_span(pair)) }
    }

    fn resource(&mut self, pair: &Pair<'_>) -> Resource {
        Resource {
            parameter: child(pair, Rule::text).map(|parameter| self.text_of(&parameter)),
            node: self.with_member(&expect_child(pair, Rule::with_member)),
            chosen: child(pair, Rule::chosen).map(|chosen| self.chosen(&chosen)),
            span: self.span(pair),
        }
    }

    /// How many members of a group a test chooses.
    fn chosen(&mut self, pair: &Pair<'_>) -> Chosen {
        let span = self.span(pair);
        let mut numbers = children(pair, Rule::number).map(|number| self.count(&number));
        let least = numbers.next().unwrap_or(Count { value: Some(1), span });
        let most = numbers.next().unwrap_or(least);
        Chosen { least, most, span }
    }

    /// The places of each topic together.
    pub(super) fn targets(&mut self, pair: &Pair<'_>) -> Vec<Target> {
        let mut targets: Vec<Target> = Vec::new();
        for place in children(pair, Rule::target) {
            let place = self.path(&place);
            match targets.iter_mut().find(|target| target.topic.text == place.topic.text) {
                Some(target) => {
                    target.span = target.span.to(place.span);
                    target.places.push(place);
                }
                None => targets.push(Target { topic: place.topic.clone(), span: place.span, places: vec![place] }),
            }
        }
        targets
    }

    fn operation_kind(&mut self, kind: &Pair<'_>) -> OperationKind {
        match kind.as_rule() {
            Rule::random_value => match (child(kind, Rule::value_mode), child(kind, Rule::constants)) {
                (Some(mode), _) => OperationKind::Random {
                    absolute: child(&mode, Rule::k_absolute).is_some(),
                    amounts: self.amounts(kind).expect("a random value says what is drawn from"),
                },
                (None, Some(constants)) => OperationKind::RandomConstant(self.constants(&constants)),
                (None, None) => OperationKind::RandomText(self.listed(&expect_child(kind, Rule::text_domain))),
            },
            Rule::stuck_at => {
                let [texts, truth, constants] =
                    [Rule::text_domain, Rule::truth, Rule::constants].map(|rule| child(kind, rule));
                OperationKind::StuckAt(match (texts, truth, constants) {
                    (Some(texts), ..) => Stuck::Texts(self.listed(&texts)),
                    (_, Some(truth), _) => Stuck::Truth(child(&truth, Rule::k_true).is_some(), self.span(&truth)),
                    (.., Some(constants)) => Stuck::Constants(self.constants(&constants)),
                    _ => Stuck::Amounts(self.amounts(kind).expect("a value is stuck at something")),
                })
            }
            Rule::not_finite => OperationKind::NotFinite(match (child(kind, Rule::k_nan), child(kind, Rule::minus)) {
                (Some(_), _) => NotFinite::Nan,
                (None, None) => NotFinite::Infinity,
                (None, Some(_)) => NotFinite::MinusInfinity,
            }),
            Rule::burst_loss => OperationKind::BurstLoss {
                span: self.keyword_span(kind).to(self.span(&expect_child(kind, Rule::k_loss))),
                enter: self.ranges(kind, Rule::burst_enter),
                leave: self.ranges(kind, Rule::burst_leave),
                loss: self.ranges(kind, Rule::burst_drops),
            },
            Rule::latency => OperationKind::Latency {
                range: self.only_range(kind),
                distribution: children(kind, Rule::distribution)
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
                drain: self.drains(kind),
            },
            Rule::reorder => OperationKind::Reorder { range: self.only_range(kind), drain: self.drains(kind) },
            Rule::custom => OperationKind::Custom(self.custom(kind)),
            Rule::set_parameter => {
                let values = children(kind, Rule::new_value).map(|value| self.new_value(&value)).collect();
                OperationKind::OnNode(OnNode::Set(match child(kind, Rule::range) {
                    Some(range) => New::Range(self.range(&range)),
                    None => New::Values(values),
                }))
            }
            Rule::transition => {
                let name = self.name(&expect_child(kind, Rule::transition_name));
                OperationKind::OnNode(OnNode::Transition(name))
            }
            Rule::pause => OperationKind::OnNode(OnNode::Pause),
            Rule::slow => OperationKind::OnNode(OnNode::Slow(self.only_range(kind))),
            Rule::kill => OperationKind::OnNode(OnNode::Kill),
            rule => OperationKind::Plain { rule, amounts: self.amounts(kind) },
        }
    }

    fn new_value(&mut self, pair: &Pair<'_>) -> NewValue {
        let found = first_of(pair, &[Rule::truth, Rule::text, Rule::value_list]).expect("it has a value");
        let span = self.span(&found);
        match found.as_rule() {
            Rule::truth => NewValue::Truth(child(&found, Rule::k_true).is_some(), span),
            Rule::text => NewValue::Text(self.any_text(&found)),
            _ => NewValue::List(children(&found, Rule::list_item).map(|item| self.item(&item)).collect(), span),
        }
    }

    fn item(&mut self, pair: &Pair<'_>) -> Item {
        let found = first_of(pair, &[Rule::truth, Rule::text, Rule::signed]).expect("an item has a value");
        match found.as_rule() {
            Rule::truth => Item::Truth(child(&found, Rule::k_true).is_some(), self.span(&found)),
            Rule::text => Item::Text(self.any_text(&found)),
            _ => Item::Number(self.signed(&found)),
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
        let mut ends = [next(), next()];
        drop(points);
        if let Some(unit) = child(&expect_child(&corners, Rule::corners_end), Rule::unit).map(|unit| self.unit(&unit)) {
            self.unit_of_corners(&mut ends, &unit);
        }
        Some(Amounts::Corners(Box::new(ends), self.span(&corners)))
    }

    /// Reports a unit after the `]` of a box, and reads it as that of its corners without one.
    fn unit_of_corners(&mut self, corners: &mut [Point; 2], unit: &UnitName) {
        let title = "the unit of a box is given for each point, after its `)`";
        let mut diagnostic = Diagnostic::new(Code::WRONG_UNIT, unit.span, title).label("unexpected unit");
        let mut edits = vec![(unit.span, String::new())];
        let without = corners.iter_mut().filter(|corner| corner.coordinates[0].unit.is_none());
        for corner in without {
            edits.push((corner.span.end(), unit.text.clone()));
            for coordinate in &mut corner.coordinates {
                coordinate.unit = Some(unit.clone());
            }
        }
        let message = if edits.len() == 1 { "remove this unit" } else { "write the unit after each point" };
        edits.sort_by_key(|(span, _)| span.lo);
        diagnostic.suggestions.push(Suggestion::possible(message, edits));
        self.report(diagnostic);
    }

    fn constants(&mut self, pair: &Pair<'_>) -> Vec<Path> {
        children(pair, Rule::constant_name).map(|name| self.path(&name)).collect()
    }

    fn listed(&mut self, pair: &Pair<'_>) -> Vec<Text> {
        children(&expect_child(pair, Rule::texts), Rule::text).map(|text| self.any_text(&text)).collect()
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

    fn custom(&mut self, pair: &Pair<'_>) -> Custom {
        let span = self.keyword_span(pair);
        let moment = child(pair, Rule::moment).map(|moment| self.moment(&moment));
        let mut custom = Custom { span, moment, parameters: vec![], has_errors: false };
        let block = expect_child(pair, Rule::custom_parameters);
        custom.has_errors = self.members(&block, |reader, member| {
            let word = expect_child(&member, Rule::parameter_name);
            let domains = [Rule::number_domain, Rule::point_domain, Rule::text_domain, Rule::file_domain];
            let domain = first_of(&member, &domains).expect("a parameter has a domain");
            custom.parameters.push(CustomParameter {
                name: reader.name(&word),
                doc: Self::doc(&member),
                span: reader.span(&domain),
                domain: reader.domain(&domain),
            });
        });
        custom
    }

    pub(super) fn moment(&mut self, pair: &Pair<'_>) -> (Span, Moment) {
        let moment = if child(pair, Rule::k_before).is_some() { Moment::BeforeStart } else { Moment::AfterEnd };
        (self.span(pair), moment)
    }

    fn domain(&mut self, pair: &Pair<'_>) -> Domain {
        let unit = child(pair, Rule::unit_in_brackets).map(|unit| self.unit(&expect_child(&unit, Rule::unit)));
        match pair.as_rule() {
            Rule::number_domain => Domain::Number {
                integer: child(pair, Rule::k_int).is_some(),
                unit,
                range: self.range(&expect_child(pair, Rule::range)),
            },
            Rule::point_domain => {
                let mut corners = children(pair, Rule::point).map(|point| self.point(&point)).collect::<Vec<_>>();
                let high = corners.pop().expect("a box has two corners");
                let low = corners.pop().expect("a box has two corners");
                Domain::Point { unit, corners: Box::new([low, high]) }
            }
            rule => {
                let texts = expect_child(pair, Rule::texts);
                let texts = children(&texts, Rule::text);
                if rule == Rule::file_domain {
                    Domain::Files(texts.map(|text| self.text_of(&text)).collect())
                } else {
                    Domain::Texts(texts.map(|text| self.any_text(&text)).collect())
                }
            }
        }
    }

    /// What stands in one `start contains`.
    fn contained(&mut self, pair: &Pair<'_>) -> Vec<Contained> {
        let mut found = Vec::new();
        for item in pair.clone().into_inner() {
            match item.as_rule() {
                Rule::metric_name => found.push(Contained::Variable(self.metric_name(&item))),
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

/// What an operation is: the first construct after its `=`.
fn after_equals<'i>(pair: &Pair<'i>) -> Option<Pair<'i>> {
    let mut after = pair.clone().into_inner().skip_while(|inner| inner.as_rule() != Rule::equals).skip(1);
    after.find(|inner| inner.as_rule() != Rule::COMMENT)
}
