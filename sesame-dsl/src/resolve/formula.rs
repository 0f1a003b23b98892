//! Formulas of metrics: their inputs, their units, and how values over time are reduced to one.

use super::Resolver;
use super::depth;
use super::function::is_function;
use super::parts::first_part;
use super::score::scores;
use crate::clocks::{Clock, clock_of};
use crate::diagnostic::{Code, Diagnostic, Suggestion};
use crate::interfaces::ConstantValue;
use crate::model::{Aggregate, Condition, Expression, FieldPath, Formula, Id as _, Input, Members};
use crate::model::{MetricSource, Type};
use crate::span::Span;
use crate::syntax::ast::{self, ExpressionKind, FormulaKind, Name, Path, PrefixWord};
use crate::units::{Unit, convert, dimension, product};

/// The outermost functions of a formula. `last` is first: a formula without any most likely means it.
pub(super) const AGGREGATES: [&str; 7] = ["last", "min", "max", "mean", "count", "duration", "robustness"];
/// The deepest expression. A plan is JSON, whose readers limit its depth.
pub(super) const MAX_DEPTH: usize = 40;

/// A number with its unit; `None` for a plain one.
pub(super) type Number = (Expression, Option<Unit>);

impl<'a> Resolver<'a> {
    /// A formula, with the unit of its value.
    pub(super) fn formula(&mut self, formula: &'a ast::Formula) -> Option<(MetricSource, Option<Unit>)> {
        if let Some(score) = self.score(formula) {
            return score;
        }
        self.no_horizon(formula);
        if let FormulaKind::Plain(whole) = &formula.kind
            && let ExpressionKind::Call(name, arguments) = &whole.kind
            && name.text == "robustness"
            && let [of] = arguments.as_slice()
        {
            return self.robustness(formula, of);
        }
        let mut inputs = Vec::new();
        let when = self.single(&formula.when, "when").map(|when| self.condition(&mut inputs, when));
        let (aggregate, unit) = match &formula.kind {
            FormulaKind::WhenThen(condition, value) => {
                let condition = self.condition(&mut inputs, condition);
                let value = self.number(&mut inputs, value);
                let condition = match (condition?, when) {
                    (first, None) => first,
                    (first, Some(second)) => Condition::All(vec![first, second?]),
                };
                let (value, unit) = value?;
                return self.finish(formula, inputs, Aggregate::Last { of: value }, Some(condition), unit);
            }
            FormulaKind::Plain(expression) => self.aggregate(&mut inputs, expression)?,
        };
        let when = match when {
            Some(when) => Some(when?),
            None => None,
        };
        self.finish(formula, inputs, aggregate, when, unit)
    }

    fn finish(
        &mut self,
        formula: &'a ast::Formula,
        inputs: Vec<Input>,
        aggregate: Aggregate,
        when: Option<Condition>,
        unit: Option<Unit>,
    ) -> Option<(MetricSource, Option<Unit>)> {
        let whole = match &formula.kind {
            FormulaKind::WhenThen(condition, value) => condition.span.to(value.span),
            FormulaKind::Plain(expression) => expression.span,
        };
        // All clauses are resolved, so that a mistake in one does not hide one in another.
        let every = match self.single(&formula.every, "every") {
            Some(every) => self.every(formula.every[0].0, every, &aggregate).map(Some),
            None => Some(None),
        };
        let per = match self.single(&formula.per, "per") {
            Some(per) => self.per(per, &inputs).map(Some),
            None => Some(None),
        };
        if let Some(&span) = formula.whole.first() {
            let title = "`whole windows` is only allowed with `robustness(…)`";
            let note = "only temporal formulas have windows of time that the end of a run can cut short";
            self.report(Diagnostic::new(Code::IDLE_CLAUSE, span, title).label("remove this").note(note));
        }
        self.at_most_one(&formula.outbound, "outbound");
        let outbound = !formula.outbound.is_empty();
        if inputs.is_empty() {
            self.no_topic(whole);
            return None;
        }
        let (every, per) = (every?, per?);
        self.members_fit(&inputs, whole)?;
        let lasting = match &aggregate {
            Aggregate::Duration { .. } => Some("`duration`"),
            _ => every.map(|_| "`every`"),
        };
        self.elements_fit(&inputs, lasting, whole)?;
        if let Some((word, path)) =
            formula.per.first().filter(|_| inputs.iter().any(|input| input.members == Members::First))
        {
            let title = "`per` cannot be combined with `each pair of`";
            let diagnostic = Diagnostic::new(Code::UNPAIRED, word.to(path.span), title)
                .label("remove this")
                .note("each pair already has a state of its own");
            self.report(diagnostic);
            return None;
        }
        if depth::of_aggregate(&aggregate).max(when.as_ref().map_or(0, depth::of_condition)) > MAX_DEPTH {
            self.too_deep("formula", whole);
            return None;
        }
        if let (Aggregate::Last { of: Expression::Input(0) }, None, None, None, false) =
            (&aggregate, &when, every, &per, outbound)
            && self.members_of(&inputs[0].field) == 1
            && inputs[0].list.is_none()
            && inputs[0].memory.is_empty()
        {
            return Some((MetricSource::Last(inputs[0].field.clone()), unit));
        }
        Some((MetricSource::Formula(Formula { inputs, aggregate, when, every, per, outbound }), unit))
    }

    pub(super) fn no_topic(&mut self, whole: Span) {
        let diagnostic = Diagnostic::new(Code::NOT_A_FORMULA, whole, "this formula reads no topic")
            .label("no message changes this value")
            .note("a metric is computed from messages, so its formula must name a topic");
        self.report(diagnostic);
    }

    /// How many topics on the wire have this field.
    pub(super) fn members_of(&self, field: &FieldPath) -> usize {
        self.system.topics[field.topic.index()].as_ref().map_or(0, |topic| topic.paths.len())
    }

    // ----- reducing values over time to one

    fn aggregate(
        &mut self,
        inputs: &mut Vec<Input>,
        expression: &'a ast::Expression,
    ) -> Option<(Aggregate, Option<Unit>)> {
        let (name, arguments) = match &expression.kind {
            ExpressionKind::Call(name, arguments) if AGGREGATES.contains(&name.text.as_str()) => (name, arguments),
            ExpressionKind::Call(name, _) if !is_function(&name.text) => {
                let known: Vec<&str> = AGGREGATES.into_iter().chain(scores()).collect();
                self.unknown_function(name, &known);
                return None;
            }
            _ => {
                self.no_aggregate(expression);
                return None;
            }
        };
        let [argument] = arguments.as_slice() else {
            if matches!(name.text.as_str(), "min" | "max") && arguments.len() > 1 {
                self.no_aggregate(expression);
                return None;
            }
            let title = format!("`{}(…)` takes one value, not {}", name.text, arguments.len());
            let label = "expected one value between the parentheses";
            self.report(Diagnostic::new(Code::NOT_A_FORMULA, expression.span, title).label(label));
            return None;
        };
        Some(match name.text.as_str() {
            "count" => (Aggregate::Count { of: self.condition(inputs, argument)? }, None),
            "duration" => (Aggregate::Duration { of: self.condition(inputs, argument)? }, Some(Unit::seconds())),
            word => {
                let (value, unit) = match self.whole_list(name, argument) {
                    Some((path, all)) => self.numeric_input(inputs, path, Some((all, name.span)))?,
                    None => self.number(inputs, argument)?,
                };
                let aggregate = match word {
                    "min" => Aggregate::Min { of: value },
                    "max" => Aggregate::Max { of: value },
                    "mean" => Aggregate::Mean { of: value },
                    _ => Aggregate::Last { of: value },
                };
                (aggregate, unit)
            }
        })
    }

    /// Elements of a list whose least or greatest over time is asked for: `min(scan.ranges)` is
    /// `min(min of scan.ranges)`.
    fn whole_list(&self, name: &Name, argument: &'a ast::Expression) -> Option<(&'a Path, ast::Members)> {
        let all = match name.text.as_str() {
            "min" => ast::Members::Min,
            "max" => ast::Members::Max,
            _ => return None,
        };
        let ExpressionKind::Field(path) = &argument.kind else { return None };
        let several = |step: &ast::Step| matches!(step, ast::Step::Elements(..) | ast::Step::Each(_));
        let of_all = matches!(self.type_read(path, None), Some(Type::List(_)));
        (of_all || path.elements.iter().any(several)).then_some((path, all))
    }

    fn no_aggregate(&mut self, expression: &'a ast::Expression) {
        let span = expression.span;
        let condition = self.is_condition(expression);
        if condition && of_time(expression) {
            self.no_robustness(expression);
            return;
        }
        if let Some((call, name)) = aggregate_in(expression) {
            self.over_time(call, name, moved_inside(expression));
            return;
        }
        if !self.reads_a_topic(expression) {
            self.no_topic(span);
            return;
        }
        let word = if condition { "count" } else { "last" };
        let title = format!("`{}` changes during a test, but a metric is a single number", self.text(span));
        let mut diagnostic = Diagnostic::new(Code::NOT_A_FORMULA, span, title).label(if condition {
            "reduce it to a number with `count` or `duration`"
        } else {
            "reduce it to a single number with `last`, `min`, `max` or `mean`"
        });
        diagnostic.suggestions.push(Suggestion::possible(
            format!("use {}", if condition { "the number of messages for which it holds" } else { "its last value" }),
            vec![(Span { hi: span.lo, ..span }, format!("{word}(")), (span.end(), ")".to_owned())],
        ));
        self.report(diagnostic);
    }

    /// Whether a value depends on messages at all.
    fn reads_a_topic(&self, expression: &ast::Expression) -> bool {
        let reads = |part: &ast::Expression| match &part.kind {
            ExpressionKind::Field(path) => self.scene_at(path).is_none(),
            ExpressionKind::Members(..) => true,
            _ => false,
        };
        first_part(expression, &|part| reads(part).then_some(())).is_some()
    }

    fn no_robustness(&mut self, expression: &'a ast::Expression) {
        let span = expression.span;
        let title = format!("`{}` is a condition, but a metric is a number", self.text(span));
        let mut diagnostic = Diagnostic::new(Code::NOT_A_FORMULA, span, title).label("expected a number");
        diagnostic.suggestions.push(Suggestion::possible(
            "use its robustness: by how much it holds".to_owned(),
            vec![(Span { hi: span.lo, ..span }, "robustness(".to_owned()), (span.end(), ")".to_owned())],
        ));
        self.report(diagnostic);
    }

    fn every(&mut self, word: Span, every: &ast::Quantity, aggregate: &Aggregate) -> Option<f64> {
        let name = match aggregate {
            Aggregate::Min { .. } => "min",
            Aggregate::Max { .. } => "max",
            Aggregate::Duration { .. } => "duration",
            Aggregate::Last { .. } | Aggregate::Mean { .. } | Aggregate::Count { .. } => {
                let title = "the interval of `every` must be greater than 0s";
                return self.above_zero(every, &Unit::seconds(), "`every`", title);
            }
        };
        self.value(every, Some(&Unit::seconds()), "`every`")?;
        let diagnostic =
            Diagnostic::new(Code::IDLE_CLAUSE, word.to(every.span), format!("`every` has no effect on `{name}(…)`"))
                .label("remove this")
                .note("only `count`, `mean`, `last` and `when … then …` depend on how often messages arrive");
        self.report(diagnostic);
        None
    }

    fn per(&mut self, path: &'a Path, inputs: &[Input]) -> Option<FieldPath> {
        let (field, ty) = self.field(path)?;
        if !matches!(ty, Type::Text | Type::Int(_)) {
            let is = super::words::type_in_words(&ty);
            let title = format!("`per` needs a `text` or an integer, but `{}` is {is}", self.text(path.span));
            let label = "expected a `text` or an integer";
            self.report(Diagnostic::new(Code::WRONG_TYPE, path.span, title).label(label));
            return None;
        }
        if !inputs.iter().any(|input| input.field.topic == field.topic) {
            let title = format!("the formula does not read `{}`", path.topic.text);
            let diagnostic = Diagnostic::new(Code::IDLE_CLAUSE, path.span, title)
                .label("expected a field of a topic that the formula reads");
            self.report(diagnostic);
            return None;
        }
        Some(field)
    }

    // ----- numbers

    pub(super) fn number(&mut self, inputs: &mut Vec<Input>, expression: &'a ast::Expression) -> Option<Number> {
        if let ExpressionKind::Field(path) = &expression.kind
            && let Some(constant) = self.constant_of(path)
        {
            return match constant? {
                ConstantValue::Number(number) => Some((Expression::Constant(number), None)),
                ConstantValue::Text(_) => self.not_a_number(expression.span, "a text"),
            };
        }
        match &expression.kind {
            ExpressionKind::Number(quantity) => {
                let unit = self.unit_in_formula(quantity)?;
                (!quantity.value.is_nan()).then_some((Expression::Constant(quantity.value), unit))
            }
            ExpressionKind::Field(path) => match (self.named_clock(path), self.scene_at(path)) {
                (Some(clock), _) => Some((clock.expression.clone(), Some(Unit::seconds()))),
                (None, Some(scene)) => self.value_of_scene(path, scene),
                (None, None) => self.numeric_input(inputs, path, None),
            },
            ExpressionKind::Members(members, word, path) => self.numeric_input(inputs, path, Some((*members, *word))),
            ExpressionKind::Negate(of) => {
                let (of, unit) = self.number(inputs, of)?;
                Some((Expression::Negate(Box::new(of)), unit))
            }
            ExpressionKind::Sum(terms) => {
                let parts: Vec<&ast::Expression> = terms.iter().map(|(_, term)| term).collect();
                let (parts, unit) = self.common(inputs, &parts)?;
                let terms = terms.iter().zip(parts);
                let terms =
                    terms.map(|((minus, _), part)| if *minus { Expression::Negate(Box::new(part)) } else { part });
                Some((Expression::Sum(terms.collect()), unit))
            }
            ExpressionKind::Product(factors) => self.product(inputs, factors),
            ExpressionKind::Call(name, arguments) => self.call(inputs, expression, name, arguments),
            ExpressionKind::Truth(_)
            | ExpressionKind::Compare(..)
            | ExpressionKind::All(_)
            | ExpressionKind::Any(_)
            | ExpressionKind::AtLeast(..)
            | ExpressionKind::Prefixed(..)
            | ExpressionKind::Until(..)
            | ExpressionKind::Implies(..) => self.not_a_number(expression.span, "a condition"),
            ExpressionKind::Text(_) => self.not_a_number(expression.span, "a text"),
            ExpressionKind::Point(_) => self.not_a_number(expression.span, "a point"),
            ExpressionKind::Region(_) => self.not_a_number(expression.span, "a region"),
        }
    }

    fn not_a_number(&mut self, span: Span, is: &str) -> Option<Number> {
        let title = format!("`{}` is {is}, but a number is needed", self.text(span));
        self.report(Diagnostic::new(Code::WRONG_TYPE, span, title).label("expected a number"));
        None
    }

    /// The word for the time that a path is, if it is none of what the space declares.
    pub(super) fn named_clock(&self, path: &Path) -> Option<&'static Clock> {
        clock_of(path).filter(|clock| path.is_name() && !self.names.contains_key(clock.word))
    }

    /// The unit of a number in a formula, where `2rad*link0` is a likely mistake.
    #[expect(clippy::option_option, reason = "the outer `None` means a mistake, the inner is the number's")]
    fn unit_in_formula(&mut self, quantity: &ast::Quantity) -> Option<Option<Unit>> {
        let Some(name) = &quantity.unit else { return Some(None) };
        let unit = self.unit(name);
        if unit.is_none()
            && name.text.contains(['*', '/'])
            && let Some(diagnostic) = self.diagnostics.last_mut()
        {
            diagnostic.notes.push("to multiply or divide, put a space before `*` or `/`".to_owned());
        }
        Some(Some(unit?))
    }

    fn numeric_input(
        &mut self,
        inputs: &mut Vec<Input>,
        path: &'a Path,
        members: Option<(ast::Members, Span)>,
    ) -> Option<Number> {
        let before = self.diagnostics.len();
        let read = self.number_read(path, members);
        if let Some(Clock { word, means, .. }) = clock_of(path)
            && let Some(diagnostic) = self.diagnostics.get_mut(before)
        {
            diagnostic.notes.push(format!("`{word}` is {means} unless something in the space is named `{word}`"));
        }
        let (read, unit) = read?;
        Some((Expression::Input(position(inputs, read.input(None))), unit))
    }

    fn product(&mut self, inputs: &mut Vec<Input>, factors: &'a [(bool, ast::Expression)]) -> Option<Number> {
        // All are resolved, so that a mistake in one does not hide one in another.
        let numbers: Vec<_> = factors.iter().map(|(_, factor)| self.number(inputs, factor)).collect();
        let mut whole: Option<Number> = None;
        for ((divides, factor), number) in factors.iter().zip(numbers) {
            let (number, unit) = number?;
            let Some((left, left_unit)) = whole.take() else {
                whole = Some((number, unit));
                continue;
            };
            let Some((unit, scale)) = product(left_unit.as_ref(), unit.as_ref(), *divides) else {
                let title = "the unit of this product is too large or too small";
                let label = "its scale cannot be represented";
                self.report(Diagnostic::new(Code::UNKNOWN_UNIT, factor.span, title).label(label));
                return None;
            };
            let value = match (left, *divides) {
                (left, true) => Expression::Divide { value: Box::new(left), by: Box::new(number) },
                (Expression::Product(mut before), false) => {
                    before.push(number);
                    Expression::Product(before)
                }
                (left, false) => Expression::Product(vec![left, number]),
            };
            whole = Some((scaled(value, scale), unit));
        }
        whole
    }

    /// Numbers that are added, compared or chosen from, all in the unit of the first that is not a constant.
    pub(super) fn common(
        &mut self,
        inputs: &mut Vec<Input>,
        parts: &[&'a ast::Expression],
    ) -> Option<(Vec<Expression>, Option<Unit>)> {
        let literal = |part: &&'a ast::Expression| match &part.kind {
            ExpressionKind::Number(quantity) => Some(quantity),
            _ => None,
        };
        let leading = parts.iter().position(|part| literal(part).is_none()).unwrap_or(0);
        let first = self.number(inputs, parts[leading]);
        let Some((first, unit)) = first else {
            // The others may contain mistakes of their own.
            for (_, part) in parts.iter().enumerate().filter(|(at, part)| *at != leading && literal(part).is_none()) {
                self.number(inputs, part);
            }
            return None;
        };
        let name = format!("`{}`", self.text(parts[leading].span));
        let mut first = Some(first);
        let mut numbers = Vec::with_capacity(parts.len());
        for (at, part) in parts.iter().enumerate() {
            let number = if at == leading {
                first.take()
            } else if let Some(quantity) = literal(part) {
                self.value(quantity, unit.as_ref(), &name).map(Expression::Constant)
            } else {
                self.converted(inputs, part, unit.as_ref(), &name)
            };
            numbers.push(number);
        }
        Some((numbers.into_iter().collect::<Option<_>>()?, unit))
    }

    fn converted(
        &mut self,
        inputs: &mut Vec<Input>,
        part: &'a ast::Expression,
        unit: Option<&Unit>,
        name: &str,
    ) -> Option<Expression> {
        let (number, own) = self.number(inputs, part)?;
        let [found, wanted] = [dimension(own.as_ref()), dimension(unit)];
        if found == wanted {
            return Some(scaled(number, convert(1.0, own.as_ref(), unit)));
        }
        let title = format!("`{}` is {}, but {name} is {}", self.text(part.span), found.name(), wanted.name());
        let label = format!("expected {}", wanted.name());
        self.report(Diagnostic::new(Code::WRONG_UNIT, part.span, title).label(label));
        None
    }
}

/// The position of an input, which is added if it is new.
pub(super) fn position(inputs: &mut Vec<Input>, input: Input) -> u32 {
    let at = inputs.iter().position(|known| *known == input).unwrap_or_else(|| {
        inputs.push(input);
        inputs.len() - 1
    });
    u32::try_from(at).expect("a formula has fewer than 2^32 inputs")
}

/// The first aggregate over time in an expression.
fn aggregate_in(expression: &ast::Expression) -> Option<(Span, &Name)> {
    first_part(expression, &|part| match &part.kind {
        ExpressionKind::Call(name, arguments) => {
            let aggregate = AGGREGATES.contains(&name.text.as_str());
            (aggregate && (arguments.len() == 1 || !is_function(&name.text))).then_some((part.span, name))
        }
        _ => None,
    })
}

/// A sum that begins with an aggregate that a constant can be moved into: `max(x) - 3m` is `max(x - 3m)`.
fn moved_inside(expression: &ast::Expression) -> Option<Suggestion> {
    let ExpressionKind::Sum(terms) = &expression.kind else { return None };
    let ([(false, first)], rest) = terms.split_at_checked(1)? else { return None };
    let ExpressionKind::Call(name, arguments) = &first.kind else { return None };
    let [argument] = arguments.as_slice() else { return None };
    let shifts = matches!(name.text.as_str(), "min" | "max" | "mean" | "last");
    let constant = rest.iter().all(|(_, term)| matches!(term.kind, ExpressionKind::Number(_)));
    if !shifts || !constant || first.parenthesised || expression.parenthesised {
        return None;
    }
    let closing = Span { lo: argument.span.hi, hi: first.span.hi, ..first.span };
    let edits = vec![(closing, String::new()), (expression.span.end(), ")".to_owned())];
    Some(Suggestion::possible(format!("move the constant into `{}(…)`", name.text), edits))
}

/// Whether an expression has a temporal operator.
fn of_time(expression: &ast::Expression) -> bool {
    match &expression.kind {
        ExpressionKind::Until(..) => true,
        ExpressionKind::Prefixed(prefixes, of) => {
            prefixes.iter().any(|prefix| prefix.word != PrefixWord::Not) || of_time(of)
        }
        ExpressionKind::All(parts) | ExpressionKind::Any(parts) => parts.iter().any(of_time),
        ExpressionKind::Implies(premise, conclusion) => of_time(premise) || of_time(conclusion),
        _ => false,
    }
}

/// A number times a constant, unless that is one.
pub(super) fn scaled(value: Expression, scale: f64) -> Expression {
    match value {
        value if scale == 1.0 => value,
        Expression::Constant(constant) => Expression::Constant(constant * scale),
        value => Expression::Product(vec![value, Expression::Constant(scale)]),
    }
}
