//! Formulas of metrics: from the grammar's pairs to flat chains.

use sesame_grammar::Rule;

use super::reader::{Pair, Reader, child, children, comparison, expect_child};
use crate::diagnostic::{Code, Diagnostic, Suggestion};
use crate::syntax::ast::{
    Corner, Expression, ExpressionKind, Formula, FormulaKind, Members, Name, Prefix, PrefixWord, Region, RegionKind,
    Relation, UnitName, Until,
};

impl Reader<'_> {
    pub(super) fn formula(&mut self, pair: &Pair<'_>) -> Formula {
        let kind = match child(pair, Rule::when_then) {
            Some(when_then) => {
                let mut parts = children(&when_then, Rule::expression).map(|part| self.expression(&part));
                let condition = parts.next().expect("`when` has a condition");
                FormulaKind::WhenThen(condition, parts.next().expect("`then` has a value"))
            }
            None => FormulaKind::Plain(self.expression(&expect_child(pair, Rule::expression))),
        };
        let when = children(pair, Rule::formula_when)
            .map(|when| (self.keyword_span(&when), self.expression(&expect_child(&when, Rule::expression))))
            .collect();
        let every = children(pair, Rule::formula_every)
            .map(|every| (self.keyword_span(&every), self.signed(&expect_child(&every, Rule::signed))))
            .collect();
        let per = children(pair, Rule::formula_per)
            .map(|per| (self.keyword_span(&per), self.path(&expect_child(&per, Rule::path))))
            .collect();
        let outbound = children(pair, Rule::formula_outbound).map(|outbound| self.span(&outbound)).collect();
        let whole = children(pair, Rule::formula_whole).map(|whole| self.span(&whole)).collect();
        let within = children(pair, Rule::formula_within)
            .map(|within| (self.keyword_span(&within), self.signed(&expect_child(&within, Rule::signed))))
            .collect();
        Formula { kind, when, every, per, outbound, whole, within }
    }

    pub(super) fn expression(&mut self, pair: &Pair<'_>) -> Expression {
        let mut sides = children(pair, Rule::disjunction)
            .map(|side| self.joined(&side, Rule::conjunction, Self::conjunction, ExpressionKind::Any));
        let first = sides.next().expect("an expression has a side");
        let second = sides.next();
        drop(sides);
        match second {
            None => first,
            Some(second) => self.whole(pair, ExpressionKind::Implies(Box::new(first), Box::new(second))),
        }
    }

    fn conjunction(&mut self, pair: &Pair<'_>) -> Expression {
        self.joined(pair, Rule::passage, Self::passage, ExpressionKind::All)
    }

    /// A condition that switches an operation on or off.
    pub(super) fn switch(&mut self, pair: &Pair<'_>) -> Expression {
        self.joined(pair, Rule::switch_conjunction, Self::switch_conjunction, ExpressionKind::Any)
    }

    fn switch_conjunction(&mut self, pair: &Pair<'_>) -> Expression {
        self.joined(pair, Rule::relation, Self::relation, ExpressionKind::All)
    }

    fn passage(&mut self, pair: &Pair<'_>) -> Expression {
        let mut sides: Vec<Expression> = children(pair, Rule::relation).map(|side| self.relation(&side)).collect();
        let right = sides.pop().expect("a passage has a side");
        let Some(left) = sides.pop() else { return right };
        let word = self.span(&expect_child(pair, Rule::k_until));
        let weak = child(pair, Rule::k_weak).map(|weak| self.span(&weak));
        let until = Until {
            span: weak.map_or(word, |weak| weak.to(word)),
            weak: weak.is_some(),
            interval: child(pair, Rule::range).map(|range| self.range(&range)),
        };
        self.whole(pair, ExpressionKind::Until(Box::new(left), until, Box::new(right)))
    }

    /// An expression that is all of a pair.
    fn whole(&self, pair: &Pair<'_>, kind: ExpressionKind) -> Expression {
        Expression { kind, span: self.span(pair), parenthesised: false }
    }

    fn joined(
        &mut self,
        pair: &Pair<'_>,
        rule: Rule,
        read: fn(&mut Self, &Pair<'_>) -> Expression,
        join: fn(Vec<Expression>) -> ExpressionKind,
    ) -> Expression {
        let mut parts: Vec<Expression> = children(pair, rule).map(|part| read(self, &part)).collect();
        if parts.len() == 1 {
            return parts.remove(0);
        }
        self.whole(pair, join(parts))
    }

    fn relation(&mut self, pair: &Pair<'_>) -> Expression {
        let mut sides: Vec<Expression> =
            children(pair, Rule::sum).map(|side| self.chain(&side, Rule::product, Rule::minus)).collect();
        let right = sides.pop().expect("a relation has a side");
        let relation = match comparison(pair) {
            Some(comparison) => Relation::Comparison(comparison),
            None => Relation::NotEqual,
        };
        let prefixes: Vec<Prefix> = children(pair, Rule::prefix).map(|prefix| self.prefix(&prefix)).collect();
        let of = match sides.pop() {
            None => right,
            Some(left) => {
                let span = left.span.to(right.span);
                let kind = ExpressionKind::Compare(Box::new(left), relation, Box::new(right));
                Expression { kind, span, parenthesised: false }
            }
        };
        if prefixes.is_empty() {
            return of;
        }
        self.whole(pair, ExpressionKind::Prefixed(prefixes, Box::new(of)))
    }

    fn prefix(&mut self, pair: &Pair<'_>) -> Prefix {
        let word = match pair {
            _ if child(pair, Rule::k_always).is_some() => PrefixWord::Always,
            _ if child(pair, Rule::k_eventually).is_some() => PrefixWord::Eventually,
            _ => PrefixWord::Not,
        };
        let interval = child(pair, Rule::range).map(|range| self.range(&range));
        Prefix { word, span: self.keyword_span(pair), interval }
    }

    /// A sum of products or a product of factors; `inverse` is the sign before what is subtracted or divides.
    fn chain(&mut self, pair: &Pair<'_>, link: Rule, inverse: Rule) -> Expression {
        let mut links = Vec::new();
        let mut inverted = false;
        for part in pair.clone().into_inner() {
            if part.as_rule() == link {
                let read = match link {
                    Rule::product => self.chain(&part, Rule::factor, Rule::over),
                    _ => self.factor(&part),
                };
                links.push((inverted, read));
            } else if part.as_rule() != Rule::COMMENT {
                inverted = part.as_rule() == inverse;
            }
        }
        if links.len() == 1 {
            return links.remove(0).1;
        }
        let kind = if link == Rule::product { ExpressionKind::Sum(links) } else { ExpressionKind::Product(links) };
        self.whole(pair, kind)
    }

    fn factor(&mut self, pair: &Pair<'_>) -> Expression {
        let span = self.span(pair);
        let negative = children(pair, Rule::minus).count() % 2 == 1;
        let operand = pair
            .clone()
            .into_inner()
            .find(|pair| !matches!(pair.as_rule(), Rule::minus | Rule::paren_open | Rule::COMMENT))
            .expect("a factor has an operand");
        let kind = match operand.as_rule() {
            Rule::quantity => ExpressionKind::Number(self.quantity(&operand)),
            Rule::some_of => {
                let count = self.count(&expect_child(&operand, Rule::number));
                let parts = children(&operand, Rule::expression).map(|part| self.expression(&part)).collect();
                ExpressionKind::AtLeast(count, parts)
            }
            Rule::truth => ExpressionKind::Truth(child(&operand, Rule::k_true).is_some()),
            Rule::text => ExpressionKind::Text(self.any_text(&operand)),
            Rule::point => ExpressionKind::Point(Box::new(self.point(&operand))),
            Rule::region => ExpressionKind::Region(self.region(&operand)),
            Rule::members => {
                let word = operand.clone().into_inner().next().expect("a choice of members begins with its word");
                let pair = child(&operand, Rule::k_pair);
                let members = match word.as_rule() {
                    Rule::k_max => Members::Max,
                    Rule::k_sum => Members::Sum,
                    Rule::reduction => match word.as_str() {
                        "min" => Members::Min,
                        "mean" => Members::Mean,
                        "count" => Members::Count,
                        _ => Members::Length,
                    },
                    _ if pair.is_some() => Members::EachPair,
                    _ => Members::Each,
                };
                let words = self.span(&word).to(self.span(&pair.unwrap_or(word)));
                ExpressionKind::Members(members, words, self.path(&expect_child(&operand, Rule::path)))
            }
            Rule::call => {
                let function = expect_child(&operand, Rule::function);
                let name = Name { text: function.as_str().to_owned(), span: self.span(&function) };
                let arguments =
                    children(&operand, Rule::expression).map(|argument| self.expression(&argument)).collect();
                ExpressionKind::Call(name, arguments)
            }
            Rule::path => ExpressionKind::Field(self.path(&operand)),
            _ => self.expression(&operand).kind,
        };
        let parenthesised = operand.as_rule() == Rule::expression;
        if !negative {
            return Expression { kind, span, parenthesised };
        }
        // A sign before a number is part of it, as everywhere in the language.
        match kind {
            ExpressionKind::Number(mut quantity) => {
                quantity.value = if quantity.value == 0.0 { 0.0 } else { -quantity.value };
                quantity.span = span;
                self.whole(pair, ExpressionKind::Number(quantity))
            }
            kind => {
                let of = Expression { kind, span, parenthesised };
                self.whole(pair, ExpressionKind::Negate(Box::new(of)))
            }
        }
    }

    /// The unit that is glued to the last parenthesis.
    fn unit_after(&mut self, pair: &Pair<'_>) -> Option<UnitName> {
        child(&expect_child(pair, Rule::point_end), Rule::unit).map(|unit| self.unit(&unit))
    }

    fn region(&mut self, pair: &Pair<'_>) -> Region {
        let kind = if child(pair, Rule::k_box).is_some() { RegionKind::Box } else { RegionKind::Polygon };
        let mut unit = self.unit_after(pair);
        let mut inside = Vec::new();
        let mut corners = Vec::new();
        for corner in children(pair, Rule::corner) {
            let coordinates: Vec<_> =
                children(&corner, Rule::coordinate).map(|coordinate| self.signed(&coordinate)).collect();
            inside.extend(coordinates.iter().filter_map(|coordinate| coordinate.unit.clone()));
            inside.extend(self.unit_after(&corner));
            corners.push(Corner { coordinates, span: self.span(&corner) });
        }
        if let Some(first) = inside.first().cloned() {
            let title = "the unit of a region is given once, after its last `)`";
            let mut diagnostic = Diagnostic::new(Code::WRONG_UNIT, first.span, title).label("unexpected unit");
            let meant = unit.as_ref().unwrap_or(&first).text.clone();
            // Other units would give other corners.
            if inside.iter().all(|own| own.text == meant) {
                let mut edits: Vec<_> = inside.iter().map(|own| (own.span, String::new())).collect();
                if unit.is_none() {
                    edits.push((self.span(pair).end(), meant));
                }
                let message =
                    if unit.is_some() { "remove the units inside" } else { "write the unit once, after the last `)`" };
                diagnostic.suggestions.push(Suggestion::possible(message, edits));
            }
            self.report(diagnostic);
            unit = unit.or(Some(first));
        }
        for coordinate in corners.iter_mut().flat_map(|corner| &mut corner.coordinates) {
            coordinate.unit.clone_from(&unit);
        }
        Region { kind, corners }
    }
}
