//! Conditions in formulas: true or false at one moment.

use std::cmp::Ordering;

use super::Resolver;
use super::formula::position;
use super::read::read_in;
use crate::diagnostic::{Code, Diagnostic};
use crate::model::{Comparison, Condition, Expression, Input, TextTest, Type};
use crate::span::Span;
use crate::syntax::ast::{self, ExpressionKind, Path, PrefixWord, Relation};

impl<'a> Resolver<'a> {
    pub(super) fn condition(&mut self, inputs: &mut Vec<Input>, expression: &'a ast::Expression) -> Option<Condition> {
        match &expression.kind {
            ExpressionKind::Truth(value) => Some(Condition::Constant(*value)),
            ExpressionKind::All(parts) => self.conditions(inputs, parts).map(Condition::All),
            ExpressionKind::Any(parts) => self.conditions(inputs, parts).map(Condition::Any),
            ExpressionKind::Compare(left, comparison, right) => {
                let comparison = relation(*comparison);
                let equality = matches!(comparison, Comparison::Equal | Comparison::NotEqual);
                if self.is_text(left) || self.is_text(right) {
                    return self.compared_texts(inputs, left, comparison, right).map(Condition::Input);
                }
                if equality && self.is_condition(left) && self.is_condition(right) {
                    let left = self.condition(inputs, left);
                    let right = self.condition(inputs, right);
                    let same = Condition::Same { left: Box::new(left?), right: Box::new(right?) };
                    return Some(if comparison == Comparison::Equal { same } else { Condition::Not(Box::new(same)) });
                }
                let (sides, _) = self.common(inputs, &[left, right])?;
                let [left, right] = <[Expression; 2]>::try_from(sides).expect("two parts give two numbers");
                self.one_outcome(expression, &left, comparison, &right);
                Some(Condition::Compare { left, by: comparison, right })
            }
            ExpressionKind::Field(_) | ExpressionKind::Members(..) | ExpressionKind::Call(..)
                if self.is_condition(expression) =>
            {
                self.truth(inputs, expression).map(Condition::Input)
            }
            ExpressionKind::Prefixed(prefixes, of) => {
                if let Some(prefix) = prefixes.iter().find(|prefix| prefix.word != PrefixWord::Not) {
                    self.of_one_moment(prefix.span);
                    return None;
                }
                let of = self.condition(inputs, of)?;
                Some(if prefixes.len() % 2 == 1 { Condition::Not(Box::new(of)) } else { of })
            }
            ExpressionKind::Implies(premise, conclusion) => {
                let premise = self.condition(inputs, premise);
                let conclusion = self.condition(inputs, conclusion);
                Some(Condition::Any(vec![Condition::Not(Box::new(premise?)), conclusion?]))
            }
            ExpressionKind::AtLeast(..) => {
                self.only_in_a_guarantee(expression.span);
                None
            }
            ExpressionKind::Until(_, until, _) => {
                self.of_one_moment(until.span);
                None
            }
            _ => {
                // Mistakes in the number itself come first.
                let before = self.diagnostics.len();
                self.number(inputs, expression);
                if self.diagnostics.len() == before {
                    let title = format!("`{}` is a number, but a condition is needed", self.text(expression.span));
                    let diagnostic = Diagnostic::new(Code::WRONG_TYPE, expression.span, title);
                    self.report(diagnostic.label("expected a comparison such as `link0 > 2.5rad`"));
                }
                None
            }
        }
    }

    /// Warns of a comparison whose outcome no message can change.
    fn one_outcome(&mut self, whole: &ast::Expression, left: &Expression, by: Comparison, right: &Expression) {
        let (order, why) = match (left, right) {
            (Expression::Constant(left), Expression::Constant(right)) => (left.partial_cmp(right), "two constants"),
            _ if left == right => (Some(Ordering::Equal), "a value with itself"),
            _ => return,
        };
        let holds = order.is_some_and(|order| match by {
            Comparison::AtMost => order.is_le(),
            Comparison::Below => order.is_lt(),
            Comparison::AtLeast => order.is_ge(),
            Comparison::Above => order.is_gt(),
            Comparison::Equal => order.is_eq(),
            Comparison::NotEqual => order.is_ne(),
        });
        let title = format!("`{}` compares {why}", self.text(whole.span));
        let label = if holds { "always true" } else { "always false" };
        self.report(Diagnostic::new(Code::ONE_OUTCOME, whole.span, title).label(label));
    }

    fn of_one_moment(&mut self, word: Span) {
        let word_text = self.text(word);
        let title = format!("`{word_text}` is only allowed inside `robustness(…)`");
        let diagnostic = Diagnostic::new(Code::NOT_A_FORMULA, word, title)
            .label("temporal operator outside `robustness(…)`")
            .note("for example `robustness(always zones.level > 0mm)`");
        self.report(diagnostic);
    }

    /// How many of several conditions hold, is for guarantees to say.
    pub(super) fn only_in_a_guarantee(&mut self, span: Span) {
        let title = "`… of (…)` is only allowed in a guarantee of a monitor";
        let diagnostic = Diagnostic::new(Code::NOT_A_FORMULA, span, title)
            .label("not allowed here")
            .note("here, conditions are joined by `and` and `or`");
        self.report(diagnostic);
    }

    /// The position of a `bool` input, which the expression is according to [`Self::is_condition`].
    pub(super) fn truth(&mut self, inputs: &mut Vec<Input>, expression: &'a ast::Expression) -> Option<u32> {
        let read = read_in(expression)?;
        if matches!(read.word, Some((ast::Members::Sum, _))) {
            self.not_summed(expression.span, read.path, "a `bool`");
            return None;
        }
        let read = self.read(&read)?;
        Some(position(inputs, read.input(None)))
    }

    fn not_summed(&mut self, span: Span, path: &Path, is: &str) {
        let title = format!("`{}` is {is}, which cannot be summed", self.text(path.span));
        let label = "expected a number after `sum of`";
        self.report(Diagnostic::new(Code::WRONG_TYPE, span, title).label(label));
    }

    /// Whether an expression is a text, of a message or written. Reports nothing.
    pub(super) fn is_text(&self, expression: &ast::Expression) -> bool {
        match &expression.kind {
            _ if self.written_text(expression).is_some() => true,
            _ => read_in(expression).and_then(|read| self.type_of_read(&read)) == Some(Type::Text),
        }
    }

    /// The text that an expression is without any message: one in quotes, or a constant. Reports nothing.
    fn written_text(&self, expression: &ast::Expression) -> Option<String> {
        match &expression.kind {
            ExpressionKind::Text(text) => Some(text.text.clone()),
            ExpressionKind::Field(path) => self.text_constant(path),
            _ => None,
        }
    }

    /// The position of an input that is whether a text of a message is, or is not, one that is written.
    pub(super) fn compared_texts(
        &mut self,
        inputs: &mut Vec<Input>,
        left: &'a ast::Expression,
        by: Comparison,
        right: &'a ast::Expression,
    ) -> Option<u32> {
        for side in [left, right] {
            if let ExpressionKind::Field(path) = &side.kind
                && let Some(constant) = self.constant_of(path)
            {
                constant?;
            }
        }
        let (of, text) = match [left, right].map(|side| self.written_text(side)) {
            [_, Some(text)] => (left, text),
            [Some(text), None] => (right, text),
            [None, None] if !matches!(by, Comparison::Equal | Comparison::NotEqual) => {
                self.texts_have_no_order(left.span.to(right.span));
                return None;
            }
            [None, None] => {
                let (text, other) = if self.is_text(left) { (left, right) } else { (right, left) };
                let title = format!("`{}` can only be compared with a text in double quotes", self.text(text.span));
                let diagnostic = Diagnostic::new(Code::WRONG_TYPE, other.span, title)
                    .label("expected a text in double quotes, such as `\"ready\"`");
                self.report(diagnostic);
                return None;
            }
        };
        let read = match &of.kind {
            _ if self.written_text(of).is_some() => {
                let title = format!("`{}` compares two constants", self.text(left.span.to(right.span)));
                let diagnostic = Diagnostic::new(Code::WRONG_TYPE, left.span.to(right.span), title);
                self.report(diagnostic.label("expected a topic or field of type `text` on one side"));
                return None;
            }
            _ if self.is_text(of) => read_in(of)?,
            _ => {
                // Mistakes in the other side itself come first.
                let before = self.diagnostics.len();
                if !self.is_condition(of) {
                    self.number(inputs, of);
                }
                if self.diagnostics.len() == before {
                    let title = format!("`{}` is not a text", self.text(of.span));
                    let label = "expected a topic or field of type `text`";
                    self.report(Diagnostic::new(Code::WRONG_TYPE, of.span, title).label(label));
                }
                return None;
            }
        };
        let test = match by {
            Comparison::Equal => TextTest::Is(text),
            Comparison::NotEqual => TextTest::IsNot(text),
            _ => {
                self.texts_have_no_order(left.span.to(right.span));
                return None;
            }
        };
        if matches!(read.word, Some((ast::Members::Sum, _))) {
            self.not_summed(of.span, read.path, "a `text`");
            return None;
        }
        let read = self.read(&read)?;
        Some(position(inputs, read.input(Some(test))))
    }

    fn texts_have_no_order(&mut self, span: Span) {
        let diagnostic = Diagnostic::new(Code::WRONG_TYPE, span, "texts have no order");
        self.report(diagnostic.label("compare them with `==` or `!=`"));
    }

    fn conditions(&mut self, inputs: &mut Vec<Input>, parts: &'a [ast::Expression]) -> Option<Vec<Condition>> {
        let conditions: Vec<_> = parts.iter().map(|part| self.condition(inputs, part)).collect();
        conditions.into_iter().collect()
    }

    /// Whether an expression is a condition rather than a number. Reports nothing.
    pub(super) fn is_condition(&self, expression: &ast::Expression) -> bool {
        match &expression.kind {
            ExpressionKind::Truth(_)
            | ExpressionKind::Compare(..)
            | ExpressionKind::All(_)
            | ExpressionKind::Any(_)
            | ExpressionKind::AtLeast(..)
            | ExpressionKind::Prefixed(..)
            | ExpressionKind::Until(..)
            | ExpressionKind::Implies(..) => true,
            _ => read_in(expression).and_then(|read| self.type_of_read(&read)) == Some(Type::Bool),
        }
    }
}

/// How two numbers are compared.
pub(super) fn relation(relation: Relation) -> Comparison {
    match relation {
        Relation::Comparison(ast::Comparison::AtMost) => Comparison::AtMost,
        Relation::Comparison(ast::Comparison::Below) => Comparison::Below,
        Relation::Comparison(ast::Comparison::AtLeast) => Comparison::AtLeast,
        Relation::Comparison(ast::Comparison::Above) => Comparison::Above,
        Relation::Comparison(ast::Comparison::Equal) => Comparison::Equal,
        Relation::NotEqual => Comparison::NotEqual,
    }
}
