//! Metrics that are the robustness of a temporal formula: its signals, their common unit, and the scope of its
//! operators.

use super::Resolver;
use super::boolean::relation;
use super::depth;
use super::formula::{MAX_DEPTH, scaled};
use crate::diagnostic::{Code, Diagnostic, Suggestion};
use crate::model::{Comparison, Expression, Input, Interval, MetricSource, Point, Robustness, Temporal};
use crate::span::Span;
use crate::syntax::ast::{self, ExpressionKind, Prefix, PrefixWord, Relation};
use crate::units::{Unit, convert, dimension};

/// The robustness of `true`, and negated of `false`, compared with numbers that are measured: greater than any of them,
/// so that a `bool` decides and never limits.
const DECISIVE: f64 = 1e9;

/// The signals that a formula compares.
#[derive(Default)]
struct Signals {
    inputs: Vec<Input>,
    computed: Vec<Expression>,
    /// The unit of all comparisons, and the first of them.
    unit: Option<(Option<Unit>, Span)>,
    /// Positions of the `bool` signals.
    truths: Vec<usize>,
}

impl Signals {
    /// The position of a signal, which is added if it is new.
    fn signal(&mut self, signal: Expression) -> usize {
        self.computed.iter().position(|known| *known == signal).unwrap_or_else(|| {
            self.computed.push(signal);
            self.computed.len() - 1
        })
    }

    /// That an input which is true or false is true.
    fn truth(&mut self, input: u32) -> Temporal {
        let signal = self.signal(Expression::Input(input));
        if !self.truths.contains(&signal) {
            self.truths.push(signal);
        }
        Temporal::Predicate(signal, Comparison::Above, 0.0)
    }
}

impl<'a> Resolver<'a> {
    /// The robustness of a formula, with its unit.
    pub(super) fn robustness(
        &mut self,
        formula: &'a ast::Formula,
        of: &'a ast::Expression,
    ) -> Option<(MetricSource, Option<Unit>)> {
        self.no_clauses(formula);
        self.at_most_one(&formula.outbound, "outbound");
        self.at_most_one(&formula.whole, "whole windows");
        let mut parts = Signals::default();
        let resolved = self.temporal(&mut parts, of)?;
        let Signals { inputs, computed: mut signals, unit, truths } = parts;
        let amount = if unit.is_some() { DECISIVE } else { 1.0 };
        for at in truths {
            let twice = Expression::Product(vec![signals[at].clone(), Expression::Constant(2.0 * amount)]);
            signals[at] = Expression::Sum(vec![twice, Expression::Constant(-amount)]);
        }
        if signals.iter().map(depth::of_expression).max().max(Some(resolved.depth())) > Some(MAX_DEPTH) {
            self.too_deep("formula", of.span);
            return None;
        }
        if inputs.is_empty() {
            self.no_topic(of.span);
            return None;
        }
        self.members_fit(&inputs, of.span)?;
        self.elements_fit(&inputs, Some("`robustness`"), of.span)?;
        let outbound = !formula.outbound.is_empty();
        let whole_windows = !formula.whole.is_empty();
        let robustness = Robustness { inputs, signals, formula: resolved, outbound, whole_windows };
        Some((MetricSource::Robustness(robustness), unit.and_then(|(unit, _)| unit)))
    }

    /// Reports clauses about messages: a robustness depends on the values of signals over time only.
    fn no_clauses(&mut self, formula: &'a ast::Formula) {
        let clauses = [
            (
                formula.when.first().map(|(word, when)| word.to(when.span)),
                "when",
                "write `a implies b` to require `b` while `a` holds",
            ),
            (
                formula.every.first().map(|(word, every)| word.to(every.span)),
                "every",
                "a value counts for as long as it lasts, however often messages arrive",
            ),
            (
                formula.per.first().map(|(word, per)| word.to(per.span)),
                "per",
                "use `each of` to distinguish the members of a group",
            ),
        ];
        for (span, word, note) in clauses {
            let Some(span) = span else { continue };
            let title = format!("`{word}` cannot be combined with `robustness(…)`");
            self.report(Diagnostic::new(Code::IDLE_CLAUSE, span, title).label("remove this").note(note));
        }
    }

    pub(super) fn too_deep(&mut self, what: &str, span: Span) {
        let title = format!("this {what} is nested more than {MAX_DEPTH} levels deep");
        self.report(Diagnostic::new(Code::TOO_LARGE, span, title).label("nested too deeply"));
    }

    fn temporal(&mut self, parts: &mut Signals, expression: &'a ast::Expression) -> Option<Temporal> {
        match &expression.kind {
            ExpressionKind::All(of) => self.chain(parts, &of.iter().collect::<Vec<_>>()).map(Temporal::All),
            ExpressionKind::Any(of) => self.chain(parts, &of.iter().collect::<Vec<_>>()).map(Temporal::Any),
            ExpressionKind::Implies(premise, conclusion) => {
                let [premise, conclusion] = self.pair(parts, premise, conclusion)?;
                Some(Temporal::Implies(Box::new(premise), Box::new(conclusion)))
            }
            ExpressionKind::Until(left, until, right) => {
                let interval = self.interval(until.interval.as_ref());
                let [left, right] = self.pair(parts, left, right)?;
                let kind = if until.weak { Temporal::WeakUntil } else { Temporal::Until };
                Some(kind(interval?, Box::new(left), Box::new(right)))
            }
            ExpressionKind::Prefixed(prefixes, of) => self.prefixed(parts, prefixes, of),
            ExpressionKind::Truth(_) => {
                self.constant(expression.span);
                None
            }
            ExpressionKind::Compare(left, by, right) => {
                if self.is_text(left) || self.is_text(right) {
                    let input = self.compared_texts(&mut parts.inputs, left, relation(*by), right)?;
                    return Some(parts.truth(input));
                }
                if self.is_condition(left) || self.is_condition(right) {
                    return self.compared_truth(parts, expression, left, *by, right);
                }
                self.predicate(parts, expression, left, *by, right)
            }
            ExpressionKind::Field(_) | ExpressionKind::Members(..) | ExpressionKind::Call(..)
                if self.is_condition(expression) =>
            {
                let input = self.truth(&mut parts.inputs, expression)?;
                Some(parts.truth(input))
            }
            _ => {
                // It is a number; it is reported as in any condition.
                self.condition(&mut parts.inputs, expression);
                None
            }
        }
    }

    fn pair(
        &mut self,
        parts: &mut Signals,
        left: &'a ast::Expression,
        right: &'a ast::Expression,
    ) -> Option<[Temporal; 2]> {
        let both = self.chain(parts, &[left, right])?;
        Some(<[Temporal; 2]>::try_from(both).expect("two parts give two formulas"))
    }

    fn chain(&mut self, parts: &mut Signals, of: &[&'a ast::Expression]) -> Option<Vec<Temporal>> {
        let clear = self.reach(of);
        // All are resolved, so that a mistake in one does not hide one in another.
        let resolved: Vec<_> = of.iter().map(|part| self.temporal(parts, part)).collect();
        resolved.into_iter().collect::<Option<Vec<_>>>().filter(|_| clear)
    }

    /// Whether the scopes of temporal operators are clear in the parts of `and`, `or`, `implies` or `until`.
    fn reach(&mut self, of: &[&'a ast::Expression]) -> bool {
        let (last, before) = of.split_last().expect("an operator has operands");
        let mut clear = true;
        for part in before {
            let Some((word, alone, start)) = open_end(part) else { continue };
            clear = false;
            let name = self.text(word);
            let title = format!("the scope of `{name}` is ambiguous");
            let mut diagnostic = Diagnostic::new(Code::TEMPORAL_REACH, word, title)
                .label("add parentheses")
                .secondary(Span { lo: alone.hi, hi: last.span.hi, ..alone }, "does the scope include this?");
            let parentheses =
                |from: Span, to: Span| vec![(Span { hi: from.lo, ..from }, "(".to_owned()), (to.end(), ")".to_owned())];
            diagnostic
                .suggestions
                .push(Suggestion::possible(format!("apply `{name}` to all of it"), parentheses(start, last.span)));
            diagnostic.suggestions.push(Suggestion::possible(
                format!("apply `{name}` to the first part only"),
                parentheses(alone, alone),
            ));
            self.report(diagnostic);
        }
        clear
    }

    fn prefixed(&mut self, parts: &mut Signals, prefixes: &'a [Prefix], of: &'a ast::Expression) -> Option<Temporal> {
        if prefixes.len() > MAX_DEPTH {
            self.too_deep("formula", of.span);
            return None;
        }
        let intervals: Vec<_> = prefixes.iter().map(|prefix| self.interval(prefix.interval.as_ref())).collect();
        let mut of = self.temporal(parts, of)?;
        for (prefix, interval) in prefixes.iter().zip(intervals).rev() {
            let inner = Box::new(of);
            of = match prefix.word {
                PrefixWord::Not => Temporal::Not(inner),
                PrefixWord::Always => Temporal::Always(interval?, inner),
                PrefixWord::Eventually => Temporal::Eventually(interval?, inner),
            };
        }
        Some(of)
    }

    fn interval(&mut self, range: Option<&ast::Range>) -> Option<Interval> {
        let Some(range) = range else { return Some(Interval { from: 0.0, to: None }) };
        let seconds = self.range(range, Some(&Unit::seconds()), "an interval of time")?;
        if seconds.low < 0.0 {
            let title = "an interval cannot begin before 0s";
            let diagnostic = Diagnostic::new(Code::OUT_OF_RANGE, range.low.span, title)
                .label("expected 0s or more")
                .note("an interval is relative to the moment of evaluation, and temporal operators only look ahead");
            self.report(diagnostic);
            return None;
        }
        Some(Interval { from: seconds.low, to: Some(seconds.high) })
    }

    /// A comparison with `true` or `false`.
    fn compared_truth(
        &mut self,
        parts: &mut Signals,
        whole: &'a ast::Expression,
        left: &'a ast::Expression,
        by: Relation,
        right: &'a ast::Expression,
    ) -> Option<Temporal> {
        let equal = match relation(by) {
            Comparison::Equal => Some(true),
            Comparison::NotEqual => Some(false),
            _ => None,
        };
        let (of, value) = match (&left.kind, &right.kind) {
            (_, ExpressionKind::Truth(value)) => (left, Some(*value)),
            (ExpressionKind::Truth(value), _) => (right, Some(*value)),
            _ => (left, None),
        };
        let (Some(equal), Some(value), true) = (equal, value, self.is_condition(of)) else {
            let title = format!("the robustness of `{}` is not defined", self.text(whole.span));
            let diagnostic = Diagnostic::new(Code::WRONG_TYPE, whole.span, title)
                .label("a `bool` can only be compared with `true` or `false`, by `==` or `!=`")
                .note("combine `bool` values with `and`, `or`, `not` and `implies`");
            self.report(diagnostic);
            return None;
        };
        let of = self.temporal(parts, of)?;
        Some(if equal == value { of } else { Temporal::Not(Box::new(of)) })
    }

    /// A comparison of numbers: their difference is the signal, or what is compared with a constant.
    fn predicate(
        &mut self,
        parts: &mut Signals,
        whole: &'a ast::Expression,
        left: &'a ast::Expression,
        by: Relation,
        right: &'a ast::Expression,
    ) -> Option<Temporal> {
        let (sides, unit) = self.common(&mut parts.inputs, &[left, right])?;
        let [left, right] = <[Expression; 2]>::try_from(sides).expect("two parts give two numbers");
        if !varies(&left) && !varies(&right) {
            self.constant(whole.span);
            return None;
        }
        let by = relation(by);
        self.equality(whole.span, by);
        let scale = self.scale(parts, unit, whole.span)?;
        let (signal, by, constant) = match (left, right) {
            (left, Expression::Constant(constant)) => (left, by, constant),
            (Expression::Constant(constant), right) => (right, turned(by), constant),
            (left, right) => (Expression::Sum(vec![left, Expression::Negate(Box::new(right))]), by, 0.0),
        };
        let constant = constant * scale;
        if !constant.is_finite() {
            let title = format!("`{}` contains a number that is too large", self.text(whole.span));
            self.report(Diagnostic::new(Code::BAD_NUMBER, whole.span, title).label("greater than 1.8e308"));
            return None;
        }
        Some(Temporal::Predicate(parts.signal(scaled(signal, scale)), by, constant))
    }

    /// How many units of the formula one unit of a comparison is.
    fn scale(&mut self, parts: &mut Signals, unit: Option<Unit>, span: Span) -> Option<f64> {
        let Some((first, first_span)) = &parts.unit else {
            parts.unit = Some((unit, span));
            return Some(1.0);
        };
        let [found, wanted] = [dimension(unit.as_ref()), dimension(first.as_ref())];
        if found == wanted {
            return Some(convert(1.0, unit.as_ref(), first.as_ref()));
        }
        let title = format!(
            "`{}` compares {}, but `{}` compares {}",
            self.text(span),
            found.name(),
            self.text(*first_span),
            wanted.name()
        );
        let diagnostic = Diagnostic::new(Code::WRONG_UNIT, span, title)
            .label(format!("expected {}", wanted.name()))
            .secondary(*first_span, "the first comparison determines the unit")
            .note("robustness is a single number: to combine different units, divide both sides of each comparison by a scale, such as `zones.level / 300mm > 0`");
        self.report(diagnostic);
        None
    }

    fn constant(&mut self, span: Span) {
        let title = format!("`{}` is constant", self.text(span));
        let diagnostic = Diagnostic::new(Code::NOT_A_FORMULA, span, title);
        self.report(diagnostic.label("expected a comparison that involves a topic, such as `link0 > 2.5rad`"));
    }

    fn equality(&mut self, span: Span, by: Comparison) {
        let (word, sign) = match by {
            Comparison::Equal => ("equality", "positive"),
            Comparison::NotEqual => ("inequality", "negative"),
            _ => return,
        };
        let title = format!("the robustness of `{}` is never {sign}", self.text(span));
        let diagnostic = Diagnostic::new(Code::EQUALITY_WITHOUT_ROOM, span, title)
            .label(format!("{word} cannot have a {sign} robustness"))
            .note("compare with a tolerance, for example `abs(a - b) < 0.1`");
        self.report(diagnostic);
    }
}

/// The temporal operator whose scope the end of an expression belongs to without parentheses: the operator, everything
/// from it to that end, and where its operand begins.
fn open_end(expression: &ast::Expression) -> Option<(Span, Span, Span)> {
    if expression.parenthesised {
        return None;
    }
    match &expression.kind {
        ExpressionKind::Prefixed(prefixes, of) => {
            let at = prefixes.iter().position(|prefix| prefix.word != PrefixWord::Not);
            let Some(at) = at else { return open_end(of) };
            let start = prefixes.get(at + 1).map_or(of.span, |next| next.span);
            Some((prefixes[at].span, prefixes[at].span.to(of.span), start))
        }
        ExpressionKind::All(parts) | ExpressionKind::Any(parts) => parts.last().and_then(open_end),
        ExpressionKind::Implies(_, right) | ExpressionKind::Until(_, _, right) => open_end(right),
        _ => None,
    }
}

/// Whether a number may change during a run.
fn varies(of: &Expression) -> bool {
    matches!(of, Expression::Input(_) | Expression::Integral(_) | Expression::Time | Expression::Now)
        || of.points().iter().any(|point| matches!(point, Point::Input(_)))
        || of.parts().into_iter().any(varies)
}

/// A comparison read from right to left.
fn turned(by: Comparison) -> Comparison {
    match by {
        Comparison::AtMost => Comparison::AtLeast,
        Comparison::Below => Comparison::Above,
        Comparison::AtLeast => Comparison::AtMost,
        Comparison::Above => Comparison::Below,
        Comparison::Equal | Comparison::NotEqual => by,
    }
}
