//! Operations and known tests.

use super::quantity::percent;
use super::{Kind, Resolver};
use crate::diagnostic::{Code, Diagnostic};
use crate::model::{self, Choice, Distribution, Drain, Id as _, OperationId, OperationKind, Parameter, Range, Shape};
use crate::span::Span;
use crate::syntax::ast;
use crate::units::{Unit, convert};

impl<'a> Resolver<'a> {
    pub(super) fn operations(&mut self) {
        for operation in &self.file.operations {
            let resolved = self.operation(operation);
            self.operations.push(resolved);
        }
    }

    fn operation(&mut self, operation: &'a ast::Operation) -> Option<model::Operation> {
        let body = operation.body.as_ref()?;
        let what = self.target_and_kind(body);
        let within = match self.single(&body.within, "within") {
            Some(range) => self.within(range).map(Some),
            None => Some(None),
        };
        let priority = match self.single(&body.priority, "priority") {
            Some(quantity) => self.priority(quantity),
            None => Some(0),
        };
        let inclusion = match self.single(&body.inclusion, "inclusion") {
            Some(quantity) => self.inclusion(quantity),
            None => Some(1.0),
        };
        self.at_most_one(&body.untimed, "untimed");
        self.between_nodes(body);
        let (target, kind) = what?;
        Some(model::Operation {
            declaration: self.declaration(&operation.head),
            target,
            kind,
            within: within?,
            priority: priority?,
            inclusion: inclusion?,
            timed: body.untimed.is_empty(),
        })
    }

    fn target_and_kind(&mut self, body: &'a ast::OperationBody) -> Option<(model::FieldPath, OperationKind)> {
        match &body.kind {
            ast::OperationKind::Random { absolute, range } => {
                let (target, unit, integer) = self.number_field(&body.target, "a random value")?;
                let what = format!("`{}`", self.text(body.target.span));
                let permitted = self.range(range, unit.as_ref(), &what)?;
                if integer {
                    let low = self.whole(permitted.low, range.low.span, &what);
                    if !self.whole(permitted.high, range.high.span, &what) || !low {
                        return None;
                    }
                }
                self.one_value(permitted, range);
                let mode = if *absolute { model::ValueMode::Absolute } else { model::ValueMode::Offset };
                Some((target, OperationKind::RandomValue { mode, range: permitted, integer, unit }))
            }
            ast::OperationKind::PacketLoss(range) => {
                let target = self.whole_messages(&body.target, "packet loss drops");
                let loss = self.probabilities(range, "the loss")?;
                self.one_value(loss, range);
                Some((target?, OperationKind::PacketLoss { loss }))
            }
            ast::OperationKind::Latency { range, uniform, drain } => {
                let target = self.whole_messages(&body.target, "latency delays");
                self.at_most_one(uniform, "uniform");
                let drain = match self.single(drain, "drain") {
                    None | Some(ast::Drain::Finish) => Drain::Finish,
                    Some(ast::Drain::Flush) => Drain::Flush,
                    Some(ast::Drain::Drop) => Drain::Drop,
                };
                let distribution = if uniform.is_empty() { Distribution::Fixed } else { Distribution::Uniform };
                let delay = self.times(range, "the delay")?;
                self.one_value(delay, range);
                Some((target?, OperationKind::Latency { delay, distribution, drain }))
            }
            ast::OperationKind::Blackhole => {
                Some((self.whole_messages(&body.target, "a blackhole drops")?, OperationKind::Blackhole))
            }
        }
    }

    /// A range without width leaves nothing to choose.
    fn one_value(&mut self, found: Range, range: &ast::Range) {
        if found.low == found.high {
            let title = "this range has one value only";
            let diagnostic = Diagnostic::new(Code::ONE_VALUE, range.span, title);
            self.report(diagnostic.label("tests have nothing to choose here"));
        }
    }

    fn whole_messages(&mut self, path: &'a ast::Path, does: &str) -> Option<model::FieldPath> {
        let (target, _) = self.field(path)?;
        if target.fields.is_empty() {
            return Some(target);
        }
        let fields = Span { lo: path.topic.span.hi, ..path.span };
        let diagnostic =
            Diagnostic::new(Code::WRONG_TYPE, fields, format!("{does} whole messages, not a field of them"))
                .label("expected a topic")
                .suggest("leave the field out", fields, "");
        self.report(diagnostic);
        None
    }

    fn within(&mut self, range: &ast::Range) -> Option<Range> {
        let found = self.times(range, "`within`")?;
        if found.low == found.high {
            let diagnostic = Diagnostic::new(Code::BAD_WINDOW, range.span, "the operation is never active")
                .label("this window is empty");
            self.report(diagnostic);
            return None;
        }
        Some(found)
    }

    fn priority(&mut self, quantity: &ast::Quantity) -> Option<i32> {
        let value = self.value(quantity, None, "a priority")?;
        if value.fract() == 0.0 && (f64::from(i32::MIN)..=f64::from(i32::MAX)).contains(&value) {
            #[expect(clippy::cast_possible_truncation, reason = "it is whole and in the range of i32")]
            return Some(value as i32);
        }
        let title = format!("`{}` cannot be a priority", self.text(quantity.span));
        self.report(Diagnostic::new(Code::BAD_NUMBER, quantity.span, title).label("expected a whole number"));
        None
    }

    fn inclusion(&mut self, quantity: &ast::Quantity) -> Option<f64> {
        let value = self.value(quantity, Some(&percent()), "the inclusion")?;
        let found = Range { low: value, high: value };
        let all = Range { low: 0.0, high: 100.0 };
        self.inside(found, quantity.span, all, "the inclusion", "0% to 100%", None)
            .then(|| self.probability(quantity, value))
    }

    // ----- known tests

    pub(super) fn tests(&mut self) {
        for test in &self.file.tests {
            let resolved = self.test(test);
            self.tests.push(resolved);
        }
    }

    fn test(&mut self, test: &'a ast::Test) -> Option<model::Test> {
        let mut complete = !test.damaged;
        if test.operations.is_empty() && !test.damaged {
            self.missing(&test.head.name, "an operation", "jitter offset [0.1rad, 0.2rad] from 8s to 57s");
            complete = false;
        }
        let mut operations = Vec::new();
        for (position, operation) in test.operations.iter().enumerate() {
            match self.test_operation(operation) {
                Some((id, choice, window)) => operations.push(model::TestOperation {
                    operation: id,
                    choice,
                    window,
                    draw_seed: match operation.seed {
                        Some(seed) => seed.value?,
                        None => model::draw_seed(&test.head.name.text, position),
                    },
                }),
                None => complete = false,
            }
        }
        let mut expectations = Vec::new();
        for expectation in &test.expectations {
            match self.bound(&expectation.metric, &expectation.bound) {
                Some((metric, bound)) => expectations.push(model::Expectation { metric, bound }),
                None => complete = false,
            }
        }
        complete.then(|| model::Test { declaration: self.declaration(&test.head), operations, expectations })
    }

    fn test_operation(&mut self, test: &'a ast::TestOperation) -> Option<(OperationId, Option<Choice>, Range)> {
        let index = self.find(&test.operation, Kind::Operation);
        let window = test.window.as_ref().and_then(|window| self.test_window(window));
        let index = index?;
        let operation = self.operations[index].clone()?;
        let choice = self.choice(test, index, &operation);
        if let (Some(window), Some(within), Some(written)) = (window, operation.within, &test.window)
            && !within.contains(window)
        {
            let declared = self.file.operations[index].body.as_ref().and_then(|body| body.within.first());
            let mut diagnostic = Diagnostic::new(
                Code::BAD_WINDOW,
                written.span,
                format!("`{}` may not be active all of this time", test.operation.text),
            )
            .label("leaves what `within` permits");
            if let Some((_, range)) = declared {
                diagnostic = diagnostic.also(range.span, "permitted is this");
            }
            self.report(diagnostic);
            return None;
        }
        Some((OperationId::from_index(index), choice?, window?))
    }

    fn test_window(&mut self, window: &ast::Range) -> Option<Range> {
        let seconds = Unit::seconds();
        let low = self.value(&window.low, Some(&seconds), "an end of a window");
        let high = self.value(&window.high, Some(&seconds), "an end of a window");
        let [low, high] = [low?, high?];
        if low > high {
            self.reversed(window, "this window ends before it begins");
            return None;
        }
        if low < 0.0 || low == high {
            let title = if low < 0.0 { "this window begins before the test" } else { "this window is empty" };
            let label = if low < 0.0 { "tests begin at 0s" } else { "the operation would never be active" };
            self.report(Diagnostic::new(Code::BAD_WINDOW, window.span, title).label(label));
            return None;
        }
        Some(Range { low, high })
    }

    /// The choice for the operation's parameter.
    #[expect(clippy::option_option, reason = "the outer says whether it was in order, the inner is the model's")]
    fn choice(
        &mut self,
        test: &'a ast::TestOperation,
        index: usize,
        operation: &model::Operation,
    ) -> Option<Option<Choice>> {
        let name = &test.operation.text;
        let Some(parameter) = operation.parameter() else {
            let Some((word, choice)) = test.choices.first() else { return Some(None) };
            let title = format!("`{name}` has no parameter to choose");
            let span = word.span.to(choice.span());
            self.report(Diagnostic::new(Code::WRONG_CHOICE, span, title).label("leave this out"));
            return None;
        };
        let example = match parameter.shape {
            Shape::Value => format!("{} {}", parameter.name, in_unit(parameter.range.low, &parameter)),
            Shape::Range => format!(
                "{} [{}, {}]",
                parameter.name,
                in_unit(parameter.range.low, &parameter),
                in_unit(parameter.range.high, &parameter)
            ),
        };
        let Some((word, choice)) = test.choices.iter().find(|(word, _)| word.text == parameter.name) else {
            let (span, title) = match test.choices.first() {
                Some((word, _)) => (word.span, format!("`{name}` has no parameter named `{}`", word.text)),
                None => (test.operation.span, format!("no `{}` is chosen for `{name}`", parameter.name)),
            };
            let mut diagnostic =
                Diagnostic::new(Code::WRONG_CHOICE, span, title).label(format!("expected for example `{example}`"));
            if !test.choices.is_empty() {
                diagnostic = diagnostic.suggest("its parameter is", span, parameter.name);
            }
            self.report(diagnostic);
            return None;
        };
        for (other, _) in &test.choices {
            if !std::ptr::eq(other, word) {
                let (code, title) = if other.text == word.text {
                    (Code::CLAUSE_TWICE, format!("`{}` is chosen twice", other.text))
                } else {
                    (Code::WRONG_CHOICE, format!("`{name}` has no parameter named `{}`", other.text))
                };
                let label = format!("its only parameter is `{}`", parameter.name);
                self.report(Diagnostic::new(code, other.span, title).label(label));
            }
        }
        self.chosen(choice, index, &parameter, &example).map(Some)
    }

    fn chosen(&mut self, choice: &ast::Choice, index: usize, parameter: &Parameter, example: &str) -> Option<Choice> {
        // Probabilities are percentages in the language and fractions in the model.
        let probability = matches!(self.file.operations[index].body.as_ref()?.kind, ast::OperationKind::PacketLoss(_));
        let hundred = percent();
        let unit = if probability { Some(&hundred) } else { parameter.unit.as_ref() };
        let what = format!("`{}`", parameter.name);
        let (found, chosen) = match (choice, parameter.shape) {
            (ast::Choice::Value(quantity), Shape::Value) => {
                let value = self.value(quantity, unit, &what)?;
                let value = if probability { self.probability(quantity, value) } else { value };
                (Range { low: value, high: value }, Choice::Value(value))
            }
            (ast::Choice::Range(range), Shape::Range) => {
                let range = self.range(range, unit, &what)?;
                (range, Choice::Range(range))
            }
            (ast::Choice::Value(quantity), Shape::Range) => {
                let written = self.text(quantity.span);
                let diagnostic = Diagnostic::new(
                    Code::WRONG_CHOICE,
                    quantity.span,
                    format!("{what} is a range, from which each message draws anew"),
                )
                .label(format!("expected a range, for example `{example}`"))
                .suggest("always draw this value", quantity.span, format!("[{written}, {written}]"));
                self.report(diagnostic);
                return None;
            }
            (ast::Choice::Range(range), Shape::Value) => {
                let diagnostic = Diagnostic::new(
                    Code::WRONG_CHOICE,
                    range.span,
                    format!("{what} is one value in a test, not a range"),
                )
                .label(format!("expected one value, for example `{example}`"));
                self.report(diagnostic);
                return None;
            }
        };
        let span = choice.span();
        let body = self.file.operations[index].body.as_ref()?;
        let declared = match &body.kind {
            ast::OperationKind::Random { range, .. }
            | ast::OperationKind::PacketLoss(range)
            | ast::OperationKind::Latency { range, .. } => Some(range.span),
            ast::OperationKind::Blackhole => None,
        };
        let permitted = declared.map_or(String::new(), |declared| format!("`{}`", self.text(declared)));
        if !self.inside(found, span, parameter.range, &what, &permitted, declared) {
            return None;
        }
        if parameter.integer && !(self.whole(found.low, span, &what) && self.whole(found.high, span, &what)) {
            return None;
        }
        Some(chosen)
    }
}

/// A value of a parameter as the language writes it.
fn in_unit(value: f64, parameter: &Parameter) -> String {
    match &parameter.unit {
        Some(unit) => format!("{value}{}", unit.text()),
        None if parameter.name == "loss" => format!("{}%", convert(value, None, Some(&percent()))),
        None => value.to_string(),
    }
}
