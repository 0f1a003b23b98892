//! Conditions: those of tests, and the building blocks of those that a campaign grows.

use super::quantity::is_bare_and_not_positive;
use super::words::list;
use super::{Kind, Resolver};
use crate::clocks::clock_of;
use crate::diagnostic::{Code, Diagnostic};
use crate::interfaces::ConstantValue;
use crate::model::condition::{Comparison, Condition, ConditionSpace, Integers, Operand, ValueRange, Variable};
use crate::model::{Activation, End, Id as _, Metric, MetricId, MetricSource, Range};
use crate::span::Span;
use crate::syntax::ast::{self, ByCondition, ExpressionKind, PrefixWord, Relation, Trigger, TriggerEnd};
use crate::units::{Unit, convert, dimension};

const EXAMPLE: &str = "expected a comparison such as `near_zone1 > 2`";

impl<'a> Resolver<'a> {
    // ----- tests

    pub(super) fn trigger(&mut self, trigger: &'a Trigger) -> Option<Activation> {
        let start = self.switch(&trigger.start);
        let end = match &trigger.end {
            TriggerEnd::Until(condition) => self.switch(condition).map(End::Condition),
            TriggerEnd::For(length) => self.length(length).map(End::Length),
        };
        let times = match trigger.times {
            Some(times) => self.times_activated(times),
            None => Some(1),
        };
        Some(Activation::Condition { start: start?, end: end?, times: times? })
    }

    fn length(&mut self, quantity: &ast::Quantity) -> Option<f64> {
        let title = "an activation must last longer than 0s";
        self.above_zero(quantity, &Unit::seconds(), "the duration of an activation", title)
    }

    fn times_activated(&mut self, times: ast::Count) -> Option<u32> {
        self.count(times, 1, "the number of activations")
    }

    /// A whole condition, which switches an operation on or off or ends a test.
    pub(super) fn switch(&mut self, expression: &'a ast::Expression) -> Option<Condition> {
        let condition = self.condition_over_metrics(expression)?;
        let depth = condition.depth();
        if depth > Condition::MAX_DEPTH {
            let title = format!("this condition has {depth} levels, but the limit is {}", Condition::MAX_DEPTH);
            let diagnostic = Diagnostic::new(Code::TOO_LARGE, expression.span, title)
                .label("nested too deeply")
                .note("each `and` and each `or` adds a level; move part of the condition into a metric");
            self.report(diagnostic);
            return None;
        }
        Some(condition)
    }

    fn condition_over_metrics(&mut self, expression: &'a ast::Expression) -> Option<Condition> {
        if let Some((path, sought)) = truth_sought(expression)
            && self.is_true_or_false(path)
        {
            return self.truth_of(path, sought);
        }
        let (parts, all) = match &expression.kind {
            ExpressionKind::All(parts) => (parts, true),
            ExpressionKind::Any(parts) => (parts, false),
            ExpressionKind::Compare(left, by, right) => return self.comparison(expression, left, *by, right),
            kind => {
                let written = self.text(expression.span);
                let title = match kind {
                    ExpressionKind::Field(_) => format!("`{written}` is not compared with anything"),
                    _ => format!("`{written}` is not a comparison"),
                };
                self.report(Diagnostic::new(Code::NOT_A_CONDITION, expression.span, title).label(EXAMPLE));
                return None;
            }
        };
        // All are resolved, so that a mistake in one does not hide one in another.
        let parts: Vec<_> = parts.iter().map(|part| self.condition_over_metrics(part)).collect();
        let parts: Vec<Condition> = parts.into_iter().collect::<Option<_>>()?;
        let join = if all { Condition::And } else { Condition::Or };
        parts.into_iter().reduce(|left, right| join(Box::new(left), Box::new(right)))
    }

    /// Whether a path means a metric that is true or false: a part of a monitor, or a metric of whether one holds.
    fn is_true_or_false(&self, path: &ast::Path) -> bool {
        let metric = match self.names.get(path.topic.text.as_str()) {
            Some(definition) if path.is_name() && definition.kind == Kind::Metric => {
                self.metrics[definition.index].as_ref()
            }
            _ => None,
        };
        metric.is_some_and(Self::is_truth) || self.is_part(path)
    }

    /// Whether a metric that is true or false is this. One that is neither yet is not.
    fn truth_of(&mut self, path: &'a ast::Path, truth: bool) -> Option<Condition> {
        let index = if path.is_name() { self.find(&path.topic, Kind::Metric)? } else { self.metric_of_path(path)? };
        let (left, right) = (Operand::Variable(MetricId::from_index(index)), number_of(truth));
        self.open_outcome(path.span, (left, right), Comparison::Equal)?;
        Some(Condition::Compare { left, by: Comparison::Equal, right })
    }

    fn comparison(
        &mut self,
        whole: &ast::Expression,
        left: &'a ast::Expression,
        by: Relation,
        right: &'a ast::Expression,
    ) -> Option<Condition> {
        let by = match by {
            Relation::Comparison(ast::Comparison::Below) => Some(Comparison::Below),
            Relation::Comparison(ast::Comparison::Above) => Some(Comparison::Above),
            Relation::Comparison(ast::Comparison::Equal) => Some(Comparison::Equal),
            Relation::Comparison(ast::Comparison::AtMost) => self.no_such_comparison(left, right, "<=", Some("<")),
            Relation::Comparison(ast::Comparison::AtLeast) => self.no_such_comparison(left, right, ">=", Some(">")),
            Relation::NotEqual => self.no_such_comparison(left, right, "!=", None),
        };
        let sides = [left, right].map(|side| self.side(side));
        let [left_side, right_side] = [sides[0]?, sides[1]?];
        let by = by?;
        let compared = match (left_side, right_side) {
            (Side::Number(left), Side::Number(right)) => {
                let outcome = match (left.unit.is_none(), right.unit.is_none()) {
                    (true, true) => ValueRange::exactly(left.value).outcome(by, ValueRange::exactly(right.value)),
                    _ => None,
                };
                let label = outcome.map_or("constant", |outcome| if outcome { "always true" } else { "always false" });
                let title = format!("`{}` compares two constants", self.text(whole.span));
                self.report(Diagnostic::new(Code::CONSTANT_COMPARISON, whole.span, title).label(label));
                return None;
            }
            (Side::Metric(metric), Side::Metric(other)) if metric == other => {
                let title = format!("`{}` compares a metric with itself", self.text(whole.span));
                let label = if by == Comparison::Equal { "always true" } else { "always false" };
                self.report(Diagnostic::new(Code::CONSTANT_COMPARISON, whole.span, title).label(label));
                return None;
            }
            (Side::Metric(metric), Side::Metric(other)) => {
                self.one_unit(metric, left.span, other, right.span)?;
                (Operand::Variable(metric), Operand::Variable(other))
            }
            (Side::Metric(metric), Side::Number(number)) => {
                (Operand::Variable(metric), Operand::Number(self.in_unit_of(metric, left.span, number)?))
            }
            (Side::Number(number), Side::Metric(metric)) => {
                (Operand::Number(self.in_unit_of(metric, right.span, number)?), Operand::Variable(metric))
            }
            (Side::Metric(metric), Side::Constant(number)) => {
                self.is_plain(metric, left.span, right.span)?;
                (Operand::Variable(metric), Operand::Number(number))
            }
            (Side::Constant(number), Side::Metric(metric)) => {
                self.is_plain(metric, right.span, left.span)?;
                (Operand::Number(number), Operand::Variable(metric))
            }
            (Side::Constant(_), Side::Number(_) | Side::Constant(_)) | (Side::Number(_), Side::Constant(_)) => {
                let title = format!("`{}` compares two constants", self.text(whole.span));
                self.report(Diagnostic::new(Code::CONSTANT_COMPARISON, whole.span, title).label("constant"));
                return None;
            }
            (Side::Metric(metric), Side::Truth(truth)) if self.equals_truth(metric, by) => {
                (Operand::Variable(metric), number_of(truth))
            }
            (Side::Truth(truth), Side::Metric(metric)) if self.equals_truth(metric, by) => {
                (number_of(truth), Operand::Variable(metric))
            }
            (Side::Truth(_), _) => return self.no_metric(left),
            (_, Side::Truth(_)) => return self.no_metric(right),
        };
        self.open_outcome(whole.span, compared, by)?;
        let (left, right) = compared;
        Some(Condition::Compare { left, by, right })
    }

    fn no_such_comparison(
        &mut self,
        left: &ast::Expression,
        right: &ast::Expression,
        sign: &str,
        near: Option<&str>,
    ) -> Option<Comparison> {
        let gap = Span { lo: left.span.hi, hi: right.span.lo, ..left.span };
        let written = self.text(gap);
        let mut diagnostic =
            Diagnostic::new(Code::NOT_A_CONDITION, gap, format!("`{sign}` is not allowed in a condition"))
                .label("expected `<`, `>` or `==`");
        if let Some(at) = written.find(sign) {
            let lo = gap.lo + u32::try_from(at).expect("files are small");
            let hi = lo + u32::try_from(sign.len()).expect("signs are short");
            let span = Span { lo, hi, ..gap };
            diagnostic.span = span;
            // The sign may occur in a comment as well.
            if let Some(near) = near.filter(|_| written.trim() == sign) {
                diagnostic = diagnostic.suggest(format!("use `{near}` instead"), span, near);
            }
        }
        self.report(diagnostic);
        None
    }

    fn side(&mut self, side: &'a ast::Expression) -> Option<Side<'a>> {
        match &side.kind {
            ExpressionKind::Number(quantity) => Some(Side::Number(quantity)),
            ExpressionKind::Truth(truth) => Some(Side::Truth(*truth)),
            ExpressionKind::Field(path) if self.is_constant(path) => match self.constant_of(path)?? {
                ConstantValue::Number(number) => Some(Side::Constant(number)),
                ConstantValue::Text(_) => self.no_metric(side),
            },
            ExpressionKind::Field(path) if self.is_part(path) => {
                self.metric_of_path(path).map(|index| Side::Metric(MetricId::from_index(index)))
            }
            ExpressionKind::Field(path) if path.is_name() => {
                let before = self.diagnostics.len();
                let found = self.find(&path.topic, Kind::Metric);
                if clock_of(path).is_some()
                    && let Some(diagnostic) = self.diagnostics.get_mut(before)
                {
                    let note = "to act from a time on, write a window such as `from 5s to 10s` instead of a condition";
                    diagnostic.notes.push(note.to_owned());
                }
                let index = found?;
                let id = MetricId::from_index(index);
                self.metrics[index].is_some().then_some(())?;
                self.known_during_a_test(id, side.span)?;
                Some(Side::Metric(id))
            }
            _ => self.no_metric(side),
        }
    }

    /// Whether a metric is true or false, and compared for being equal to one of these.
    fn equals_truth(&self, metric: MetricId, by: Comparison) -> bool {
        by == Comparison::Equal && Self::is_truth(self.metric_of(metric))
    }

    /// Reports a side of a comparison that is neither a metric nor a number.
    fn no_metric<T>(&mut self, side: &ast::Expression) -> Option<T> {
        let kind = &side.kind;
        let written = self.text(side.span);
        let title = match kind {
            ExpressionKind::Field(_) | ExpressionKind::Members(..) => {
                format!("`{written}` is not a metric")
            }
            ExpressionKind::Truth(_)
            | ExpressionKind::Compare(..)
            | ExpressionKind::All(_)
            | ExpressionKind::Any(_) => {
                format!("`{written}` is a condition, not a metric")
            }
            ExpressionKind::Text(_) => format!("`{written}` is a text, but metrics are numbers"),
            _ => format!("`{written}` is an expression, not a metric"),
        };
        let note = match kind {
                    ExpressionKind::Text(_) => format!(
                        "a condition compares metrics; `when tower == {written} then time` is a metric, and so is `when tower != {written} then time`: the greater of the two is the state that holds"
                    ),
                    _ => "a condition compares metrics; declare one for what you want to compare, for example `metric near = last(near1.level)`".to_owned(),
                };
        let diagnostic =
            Diagnostic::new(Code::NOT_A_CONDITION, side.span, title).label("expected a metric or a number").note(note);
        self.report(diagnostic);
        None
    }

    /// A robustness is known when the test has ended, so no condition can read it.
    fn known_during_a_test(&mut self, id: MetricId, span: Span) -> Option<()> {
        let metric = self.metric_of(id);
        if !matches!(metric.source, MetricSource::Robustness(_)) {
            return Some(());
        }
        let title = format!("`{}` has no value before the test has ended", self.text(span));
        let diagnostic = Diagnostic::new(Code::NOT_A_CONDITION, span, title)
            .label("a robustness is known only at the end of a test")
            .secondary(metric.declaration.span, "declared here");
        self.report(diagnostic);
        None
    }

    fn metric_of(&self, id: MetricId) -> &Metric {
        self.metrics[id.index()].as_ref().expect("a side of a comparison is a metric without mistakes")
    }

    fn in_unit_of(&mut self, metric: MetricId, span: Span, number: &ast::Quantity) -> Option<f64> {
        let unit = self.metric_of(metric).unit.clone();
        self.value(number, unit.as_ref(), &format!("metric `{}`", self.text(span)))
    }

    /// Reports a metric with a unit that is compared with a constant, which has none.
    pub(super) fn is_plain(&mut self, metric: MetricId, span: Span, constant: Span) -> Option<()> {
        let Some(unit) = self.metric_of(metric).unit.clone() else { return Some(()) };
        let [name, constant_name] = [span, constant].map(|span| self.text(span));
        let title = format!("`{constant_name}` is a plain number, but `{name}` is in `{}`", unit.text());
        self.report(Diagnostic::new(Code::WRONG_UNIT, constant, title).label("expected a number with a unit"));
        None
    }

    /// Two metrics are compared as plain numbers, so they must have the same unit.
    fn one_unit(&mut self, metric: MetricId, span: Span, other: MetricId, other_span: Span) -> Option<()> {
        let [unit, other_unit] = [metric, other].map(|id| self.metric_of(id).unit.clone());
        let [unit, other_unit] = [unit.as_ref(), other_unit.as_ref()];
        let in_words =
            |unit: Option<&Unit>| unit.map_or("a plain number".to_owned(), |unit| format!("in `{}`", unit.text()));
        if same_unit(unit, other_unit) {
            return Some(());
        }
        let [name, other_name] = [span, other_span].map(|span| self.text(span));
        let title = format!("`{other_name}` is {}, but `{name}` is {}", in_words(other_unit), in_words(unit));
        let mut diagnostic = Diagnostic::new(Code::WRONG_UNIT, span.to(other_span), title)
            .label("only metrics of the same unit can be compared");
        if dimension(unit) == dimension(other_unit) {
            diagnostic = diagnostic.note("compute one of the metrics in the unit of the other");
        }
        self.report(diagnostic);
        None
    }

    /// Reports a comparison whose outcome follows from what is known of its metrics.
    fn open_outcome(&mut self, span: Span, (left, right): (Operand, Operand), by: Comparison) -> Option<()> {
        let known = [left, right].map(|side| match side {
            Operand::Number(number) => ValueRange::exactly(number),
            Operand::Variable(metric) => self.known_of(self.metric_of(metric)),
        });
        let Some(outcome) = known[0].outcome(by, known[1]) else { return Some(()) };
        let mut diagnostic =
            Diagnostic::new(Code::CONSTANT_COMPARISON, span, format!("`{}` is always {outcome}", self.text(span)))
                .label("this is known before the test begins");
        for (side, known) in [left, right].into_iter().zip(known) {
            if let Operand::Variable(id) = side
                && known != ValueRange::NOTHING
            {
                let declared = &self.metric_of(id).declaration;
                let label = format!("`{}` is {}", declared.name, in_words(known, self.metric_of(id).unit.as_ref()));
                diagnostic = diagnostic.secondary(declared.span, label);
            }
        }
        self.report(diagnostic);
        None
    }

    // ----- campaigns

    pub(super) fn condition_space(&mut self, by: &'a ByCondition) -> Option<ConditionSpace> {
        let found = self.find_all(&by.variables, Kind::Metric);
        let mut variables = Some(Vec::new());
        for ((name, range), step) in by.variables.iter().zip(&by.ranges).zip(&by.steps) {
            // Mistakes in names are reported already.
            let reported = self.diagnostics.len();
            let index = self.find(name, Kind::Metric);
            self.diagnostics.truncate(reported);
            let variable = index.and_then(|index| {
                let ranges = range.as_ref().map(|range| (range, step.as_ref()));
                self.variable(name, MetricId::from_index(index), ranges)
            });
            match (&mut variables, variable) {
                (Some(variables), Some(variable)) => variables.push(variable),
                _ => variables = None,
            }
        }
        let depth = match self.single(&by.depth, "depth") {
            Some(&depth) => self.depth(depth),
            None => Some(ConditionSpace::DEFAULT_DEPTH),
        };
        let integers = match self.single(&by.integers, "integers") {
            Some(range) => self.integers(range, "`integers`"),
            None => Some(ConditionSpace::DEFAULT_INTEGERS),
        };
        let lengths = match self.single(&by.lengths, "for") {
            Some(range) => self.lengths(range).map(Some),
            None => Some(None),
        };
        let times = match self.single(&by.times, "at most") {
            Some(&times) => self.times_activated(times),
            None => Some(1),
        };
        found?;
        let [depth, times] = [depth?, times?];
        let space = ConditionSpace { variables: variables?, depth, integers: integers?, lengths: lengths?, times };
        if space.variables.iter().any(|variable| self.is_comparable(&space, variable)) {
            return Some(space);
        }
        let names: Vec<&str> = by.variables.iter().map(|name| name.text.as_str()).collect();
        let span = by.variables[0].span.to(by.variables[by.variables.len() - 1].span);
        let diagnostic = Diagnostic::new(Code::NOTHING_TO_GROW, span, "every condition of this campaign is constant")
            .label(format!(
                "no whole number from {} to {} lies within the known range of {}",
                space.integers.lowest,
                space.integers.highest,
                list(&names)
            ))
            .note("change `integers`, or add a metric whose values pass some of them");
        let diagnostic = self.with_a_step(diagnostic, by, &space);
        self.report(diagnostic);
        None
    }

    /// Whether a comparison of this variable may go both ways: with a whole number, or with another variable of its
    /// unit.
    pub(super) fn is_comparable(&self, space: &ConditionSpace, variable: &Variable) -> bool {
        let unit = |variable: &Variable| self.metric_of(variable.metric).unit.as_ref();
        variable.step.is_some()
            || variable.known.meets(space.integers)
            || space.variables.iter().any(|other| {
                other.metric != variable.metric
                    && same_unit(unit(variable), unit(other))
                    && variable.known.outcome(Comparison::Equal, other.known).is_none()
            })
    }

    /// Suggests thresholds of its own for the first variable with a known range.
    fn with_a_step(&self, diagnostic: Diagnostic, by: &ByCondition, space: &ConditionSpace) -> Diagnostic {
        let ranged =
            space.variables.iter().zip(&by.ranges).find_map(|(variable, range)| Some((variable, range.as_ref()?)));
        let Some((Variable { metric, known: ValueRange { low, high }, .. }, range)) = ranged else { return diagnostic };
        if low >= high || !(high - low).is_finite() {
            return diagnostic;
        }
        // About a hundred steps, by a power of ten.
        let apart = |decimals: i32| format!("1e{decimals}").parse::<f64>().unwrap_or(1.0);
        let Some(step) = (-12..13).rev().map(apart).find(|step| *step <= (high - low) / 50.0) else {
            return diagnostic;
        };
        let step = format!(" step {step}{}", unit_text(self.metric_of(*metric).unit.as_ref()));
        diagnostic.suggest(format!("use numbers that are not whole, with `{}`", step.trim()), range.span.end(), step)
    }

    fn variable(
        &mut self,
        name: &'a ast::Name,
        id: MetricId,
        range: Option<(&'a ast::Range, Option<&'a ast::Quantity>)>,
    ) -> Option<Variable> {
        let metric = self.metrics[id.index()].as_ref()?;
        let own = self.known_of(metric);
        self.known_during_a_test(id, name.span)?;
        let metric = self.metric_of(id);
        let (unit, initial, declared) = (metric.unit.clone(), metric.initial, metric.declaration.span);
        let Some((range, step)) = range else { return Some(Variable { metric: id, known: own, step: None }) };
        let what = format!("metric `{}`", name.text);
        let found = self.range(range, unit.as_ref(), &what)?;
        if let Some(initial) = initial
            && !(found.low..=found.high).contains(&initial)
        {
            let title = format!("the initial value of `{}` is outside this range", name.text);
            let diagnostic = Diagnostic::new(Code::OUT_OF_RANGE, range.span, title)
                .label(format!("expected a range that contains its `initial {initial}{}`", unit_text(unit.as_ref())))
                .secondary(declared, "declared here");
            self.report(diagnostic);
            return None;
        }
        let known = ValueRange { low: found.low.max(own.low), high: found.high.min(own.high) };
        if known.low > known.high {
            let title = format!("`{}` can never be in this range", name.text);
            let diagnostic = Diagnostic::new(Code::OUT_OF_RANGE, range.span, title)
                .label(format!("it is {}", in_words(own, unit.as_ref())))
                .secondary(declared, "declared here");
            self.report(diagnostic);
            return None;
        }
        let step = match step {
            Some(step) => Some(self.threshold_step(step, unit.as_ref(), &what, known)?),
            None => None,
        };
        Some(Variable { metric: id, known, step })
    }

    /// How far apart the numbers are that a variable is compared with.
    fn threshold_step(
        &mut self,
        written: &ast::Quantity,
        unit: Option<&Unit>,
        what: &str,
        known: ValueRange,
    ) -> Option<f64> {
        const MOST: f64 = sesame_plan::condition::Variable::MOST_STEPS;
        let step = self.value(written, unit, what)?;
        let room = known.high - known.low;
        let unit = unit_text(unit);
        let label = if step <= 0.0 {
            format!("expected more than 0{unit}")
        } else if step > room {
            format!("expected at most {room}{unit}, so that there are two numbers")
        } else if room / step > MOST {
            format!("expected at most a million steps in {room}{unit}")
        } else {
            return Some(step);
        };
        let title = format!("`{}` is no step through the range of {what}", self.text(written.span));
        self.report(Diagnostic::new(Code::OUT_OF_RANGE, written.span, title).label(label));
        None
    }

    fn depth(&mut self, count: ast::Count) -> Option<u32> {
        let depth = self.count(count, 1, "the depth of a condition")?;
        if depth <= ConditionSpace::MAX_DEPTH {
            return Some(depth);
        }
        let title = format!("a condition can have at most {} levels, not {depth}", ConditionSpace::MAX_DEPTH);
        let diagnostic = Diagnostic::new(Code::BAD_COUNT, count.span, title)
            .label(format!("expected {} or less", ConditionSpace::MAX_DEPTH))
            .note("each level doubles the number of comparisons that a condition can have");
        self.report(diagnostic);
        None
    }

    pub(super) fn integers(&mut self, range: &ast::Range, what: &str) -> Option<Integers> {
        let found = self.range(range, None, what)?;
        let low = self.whole(found.low, range.low.span, what);
        if !self.whole(found.high, range.high.span, what) || !low {
            return None;
        }
        #[expect(clippy::cast_possible_truncation, reason = "they are whole and at most 2^53")]
        Some(Integers { lowest: found.low as i64, highest: found.high as i64 })
    }

    fn lengths(&mut self, range: &ast::Range) -> Option<Range> {
        if !is_bare_and_not_positive(&range.low) {
            let found = self.times(range, "the duration of an activation")?;
            if found.low > 0.0 {
                return Some(found);
            }
        }
        let title = "an activation must last longer than 0s";
        self.report(Diagnostic::new(Code::OUT_OF_RANGE, range.low.span, title).label("expected more than 0s"));
        None
    }
}

/// One side of a comparison, as written.
#[derive(Clone, Copy)]
enum Side<'a> {
    Number(&'a ast::Quantity),
    /// A constant of a message, a plain number.
    Constant(f64),
    Metric(MetricId),
    Truth(bool),
}

/// The path that a condition names alone, and whether it is sought true: each `not` before it turns that around.
fn truth_sought(expression: &ast::Expression) -> Option<(&ast::Path, bool)> {
    match &expression.kind {
        ExpressionKind::Field(path) => Some((path, true)),
        ExpressionKind::Prefixed(prefixes, of) if prefixes.iter().all(|prefix| prefix.word == PrefixWord::Not) => {
            let ExpressionKind::Field(path) = &of.kind else { return None };
            Some((path, prefixes.len() % 2 == 0))
        }
        _ => None,
    }
}

/// A truth as the value of a metric.
fn number_of(truth: bool) -> Operand {
    Operand::Number(f64::from(u8::from(truth)))
}

/// Whether two metrics are in one unit, however it is written.
fn same_unit(unit: Option<&Unit>, other: Option<&Unit>) -> bool {
    dimension(unit) == dimension(other) && convert(1.0, other, unit) == 1.0
}

/// What is known of a number, for example `0s or more`.
fn in_words(known: ValueRange, unit: Option<&Unit>) -> String {
    let unit = unit_text(unit);
    match (known.low.is_finite(), known.high.is_finite()) {
        (true, true) => format!("from {}{unit} to {}{unit}", known.low, known.high),
        (true, false) => format!("{}{unit} or more", known.low),
        (false, true) => format!("{}{unit} or less", known.high),
        (false, false) => "any number".to_owned(),
    }
}

fn unit_text(unit: Option<&Unit>) -> &str {
    unit.map_or("", Unit::text)
}
