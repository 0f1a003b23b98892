//! Physical labs.

use sesame_grammar::Rule;

use super::reader::{Pair, Reader, child, children, expect_child};
use crate::syntax::ast::Amounts;
use crate::syntax::ast::physical::{Budget, Fit, Form, Physical, RankOrder, Shape, ShapePlace};

impl Reader<'_> {
    pub(super) fn physical(&mut self, pair: &Pair<'_>) -> Physical {
        let mut lab = Physical {
            head: self.head(pair),
            simulators: vec![],
            repeats: vec![],
            costs: vec![],
            excludes: vec![],
            ranks: vec![],
            budgets: vec![],
            tolerances: vec![],
            interlocks: vec![],
            shapes: vec![],
            fits: vec![],
            has_errors: false,
        };
        lab.has_errors = self.members(pair, |reader, member| {
            let span = reader.keyword_span(&member);
            match member.as_rule() {
                Rule::simulator => lab.simulators.push((span, reader.simulator(&member))),
                Rule::repeats => lab.repeats.push((span, reader.count(&expect_child(&member, Rule::number)))),
                Rule::cost => {
                    let each = child(&member, Rule::per_operation)
                        .map(|each| reader.signed(&expect_child(&each, Rule::signed)));
                    lab.costs.push((span, (reader.signed(&expect_child(&member, Rule::signed)), each)));
                }
                Rule::exclude => {
                    let metric = reader.name(&expect_child(&member, Rule::name));
                    lab.excludes.push((metric, reader.bound(&expect_child(&member, Rule::bound))));
                }
                Rule::rank => {
                    let keys = children(&member, Rule::rank_key).map(|key| {
                        let order = match child(&key, Rule::signed) {
                            Some(value) => RankOrder::ClosestTo(reader.signed(&value)),
                            None if child(&key, Rule::k_descending).is_some() => RankOrder::Descending,
                            None => RankOrder::Ascending,
                        };
                        (reader.name(&expect_child(&key, Rule::name)), order)
                    });
                    lab.ranks.push((span, keys.collect()));
                }
                Rule::budget => {
                    let mut numbers = children(&member, Rule::signed).map(|number| reader.signed(&number));
                    let limit = numbers.next().expect("a budget has a limit");
                    let lambda = numbers.next().expect("a budget has a lambda");
                    drop(numbers);
                    lab.budgets.push((span, Budget { limit, lambda, over: reader.names(&member) }));
                }
                Rule::tolerance => {
                    let tolerated = children(&member, Rule::tolerated).map(|one| {
                        let metric = reader.name(&expect_child(&one, Rule::name));
                        (metric, reader.signed(&expect_child(&one, Rule::signed)))
                    });
                    lab.tolerances.push((span, tolerated.collect()));
                }
                Rule::interlock => lab.interlocks.push((span, reader.names(&member))),
                Rule::shape => lab.shapes.push(reader.shape(&member)),
                _ => {
                    let fitted = member.clone().into_inner().filter_map(|one| reader.fit(&one));
                    lab.fits.push((span, fitted.collect()));
                }
            }
        });
        lab
    }

    /// One thing that may be fitted; `None` for the words around them.
    fn fit(&mut self, one: &Pair<'_>) -> Option<Fit> {
        let range = self.range(&child(one, Rule::range)?);
        let targets = child(one, Rule::targets).map_or_else(Vec::new, |targets| self.targets(&targets));
        Some(match one.as_rule() {
            Rule::fit_delay => Fit::Delay(targets, range),
            Rule::fit_parameter => Fit::Parameter(self.text_of(&expect_child(one, Rule::text)), range),
            _ => {
                let rule = match () {
                    () if child(one, Rule::k_scale).is_some() => Rule::scale,
                    () if child(one, Rule::k_bias).is_some() => Rule::bias,
                    () => Rule::noise,
                };
                Fit::Relay { rule, targets, amounts: Amounts::Range(range) }
            }
        })
    }

    fn shape(&mut self, pair: &Pair<'_>) -> Shape {
        let form = match child(pair, Rule::sphere) {
            Some(sphere) => Form::Sphere(self.signed(&expect_child(&sphere, Rule::signed))),
            None => Form::Box(self.point(&expect_child(&expect_child(pair, Rule::cuboid), Rule::point))),
        };
        let place = match child(pair, Rule::carried) {
            Some(carried) => ShapePlace::Carried(self.text_of(&expect_child(&carried, Rule::text))),
            None => ShapePlace::Fixed(self.point(&expect_child(&expect_child(pair, Rule::fixed), Rule::point))),
        };
        let expand = child(pair, Rule::expand).map(|expand| self.signed(&expect_child(&expand, Rule::signed)));
        Shape { head: self.head(pair), form, place, expand }
    }
}
