//! Operations and tests.

use sesame_notation::quoted;

use super::examples;
use super::quantity::percent;
use super::words::list;
use super::{Kind, Resolver};
use crate::diagnostic::{Code, Diagnostic};
use crate::model::{
    self, Activation, Choice, ChoiceKind, Counted, Domain, Id as _, MessageRun, Messages, OperationId, OperationKind,
    Parameter, Range,
};

use crate::span::Span;
use crate::syntax::ast;
use crate::units::Unit;

impl<'a> Resolver<'a> {
    pub(super) fn operations(&mut self) {
        for operation in &self.file.operations {
            let resolved = self.operation(operation);
            self.operations.push(resolved);
        }
    }

    fn operation(&mut self, operation: &'a ast::Operation) -> Option<model::Operation> {
        let body = &operation.body;
        let what = match &body.kind {
            ast::OperationKind::Scene(scene) => {
                self.scene(&operation.head.name, scene).map(|(kind, value)| (Vec::new(), kind, vec![value]))
            }
            _ => self.targets_and_kind(body),
        };
        let within = match self.single(&body.within, "within") {
            Some(range) => self.within(range).map(Some),
            None => Some(None),
        };
        let lengths = match self.single(&body.lengths, "for") {
            Some(range) => self.window_lengths(range, within.flatten()).map(Some),
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
        let between = self.between_nodes(body);
        let constraints = self.constraints(&body.contains);
        let (mut targets, kind, mut parameters) = what?;
        let (counted, counts): (Vec<Counted>, Vec<Parameter>) = self.counted(body, &kind)?.into_iter().unzip();
        let wrapped = match self.single(&body.wrapped, "wrapped") {
            Some(turn) => Some(self.wrapped(body, (body.wrapped[0].0, turn.as_ref()), &kind, &parameters)?),
            None => None,
        };
        let (nodes, choice) = match &body.resource {
            Some(resource) => self.members_of_node(resource)?,
            None => (None, self.members_of_targets(body, &mut targets)?),
        };
        for choice in counts.into_iter().chain(choice) {
            if parameters.iter().any(|parameter| parameter.name == choice.name) {
                let title = format!("this operation has a parameter `{}` of its own", choice.name);
                let diagnostic = Diagnostic::new(Code::DEFINED_TWICE, operation.head.name.span, title)
                    .label("a test chooses members of a group or messages by this name; rename the parameter");
                self.report(diagnostic);
                return None;
            }
            parameters.push(choice);
        }
        let [from, to] = between?;
        Some(model::Operation {
            declaration: self.declaration(&operation.head),
            targets,
            nodes,
            from,
            to,
            kind,
            parameters,
            within: within?,
            lengths: lengths?,
            priority: priority?,
            inclusion: inclusion?,
            timed: body.untimed.is_empty(),
            counted,
            wrapped,
            constraints: constraints?,
        })
    }

    fn targets_and_kind(
        &mut self,
        body: &'a ast::OperationBody,
    ) -> Option<(Vec<model::Target>, OperationKind, Vec<Parameter>)> {
        if let (ast::OperationKind::Custom(custom), None) = (&body.kind, &body.resource) {
            return self.custom(custom, body);
        }
        let (targets, kind, parameters) = match &body.resource {
            Some(resource) => {
                let (kind, parameters) = self.on_resource(resource, body)?;
                (Vec::new(), kind, parameters)
            }
            None => self.disturbances(body)?,
        };
        let mut said: Vec<Span> = Vec::new();
        for parameter in parameters.iter().filter(|_| !is_constant(&kind)) {
            let (Domain::Number { range, .. }, Some(span)) = (&parameter.domain, body.kind.written(&parameter.name))
            else {
                continue;
            };
            // The axes of a box may be fixed, as long as one is not.
            let of_box = |parameter: &Parameter| matches!(&parameter.domain, Domain::Number { range, .. } if range.low < range.high);
            if !said.contains(&span) && (parameter.name != "x" || !parameters.iter().any(of_box)) {
                self.one_value(*range, span);
            }
            said.push(span);
        }
        Some((targets, kind, parameters))
    }

    /// What an operation does to messages: the same on each of its topics.
    fn disturbances(
        &mut self,
        body: &'a ast::OperationBody,
    ) -> Option<(Vec<model::Target>, OperationKind, Vec<Parameter>)> {
        let (first, further) = body.targets.split_first().expect("only custom operations can act on nothing");
        let (target, kind, parameters) = self.disturbance(first, body)?;
        let mut targets = vec![target];
        let mut complete = true;
        for written in further {
            let before = self.diagnostics.len();
            match self.disturbance(written, body) {
                Some((target, same, equal)) if same == kind && equal == parameters => targets.push(target),
                found => {
                    complete = false;
                    // The amounts fit the first topic, so the mistake is that this one is unlike it.
                    let of_target =
                        |found: &Diagnostic| written.span.lo <= found.span.lo && found.span.hi <= written.span.hi;
                    if found.is_some() || !self.diagnostics[before..].iter().any(of_target) {
                        self.diagnostics.truncate(before);
                        self.report_unlike(first, written);
                    }
                }
            }
        }
        complete.then_some((targets, kind, parameters))
    }

    fn report_unlike(&mut self, first: &ast::Target, other: &ast::Target) {
        let [one, title] = [first.span, other.span].map(|span| self.text(span));
        let title = format!("`{title}` and `{one}` have different types or units");
        let diagnostic = Diagnostic::new(Code::WRONG_TYPE, other.span, title)
            .label("a test makes one choice for all topics; declare another operation for this one")
            .secondary(first.span, "the first is here");
        self.report(diagnostic);
    }

    /// Warns of a range that leaves nothing to choose.
    pub(super) fn one_value(&mut self, found: Range, span: Span) {
        if found.low == found.high {
            let title = "this range contains only one value";
            let diagnostic = Diagnostic::new(Code::ONE_VALUE, span, title);
            self.report(diagnostic.label("a search has nothing to vary here"));
        }
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
        let title = format!("`{}` is not a valid priority", self.text(quantity.span));
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

    // ----- tests

    pub(super) fn tests(&mut self, requirements: &[Option<model::Requirement>]) {
        for test in &self.file.tests {
            let resolved = self.test(test, requirements);
            self.tests.push(resolved);
        }
    }

    fn test(&mut self, test: &'a ast::Test, requirements: &[Option<model::Requirement>]) -> Option<model::Test> {
        let mut complete = !test.has_errors;
        if test.operations.is_empty() && !test.has_errors {
            let example = self.example_of_use();
            self.missing(test.head.name.span, &test.head.name.text, "an operation", &example);
            complete = false;
        }
        let mut operations = Vec::new();
        for (position, operation) in test.operations.iter().enumerate() {
            match self.test_operation(operation) {
                Some((id, choices, activation, messages)) => operations.push(model::TestOperation {
                    operation: id,
                    choices,
                    activation,
                    messages,
                    draw_seed: match operation.seed {
                        Some(seed) => seed.value?,
                        None => model::draw_seed(&test.head.name.text, position),
                    },
                }),
                None => complete = false,
            }
        }
        self.copies_in_test(test, &operations);
        let mut expectations = Vec::new();
        for expectation in &test.expectations {
            let expected = match expectation {
                ast::Expectation::Metric { metric, bound } => self.bound(metric, bound),
                ast::Expectation::Requirement(name) => {
                    let found = self.find(name, Kind::Requirement).and_then(|index| requirements[index].as_ref());
                    found.map(|requirement| (requirement.metric, requirement.bound))
                }
            };
            match expected {
                Some((metric, bound)) => expectations.push(model::Expectation { metric, bound }),
                None => complete = false,
            }
        }
        let simulator_seed = match self.single(&test.simulator_seeds, "simulator seed") {
            Some(seed) => Some(seed.value?),
            None => None,
        };
        let declaration = self.declaration(&test.head);
        complete.then_some(model::Test { declaration, operations, expectations, simulator_seed })
    }

    /// Warns of copies of one operation that are active at the same time, unless the campaigns permit it, and of copies
    /// with equal seeds. For each copy, only the first conflicting one before it is named.
    fn copies_in_test(&mut self, test: &'a ast::Test, operations: &[model::TestOperation]) {
        if operations.len() != test.operations.len() {
            return;
        }
        let may_overlap = copies_may_overlap(self.file);
        let written: Vec<_> = operations.iter().zip(&test.operations).collect();
        for (at, (later, at_later)) in written.iter().enumerate() {
            let name = &at_later.operation.text;
            let earlier = || written[..at].iter().filter(|(earlier, _)| earlier.operation == later.operation);
            let clash = earlier().find_map(|(earlier, at_earlier)| {
                let (Activation::Window(a), Activation::Window(b)) = (&earlier.activation, &later.activation) else {
                    return None;
                };
                let (ast::Activation::Window(first), ast::Activation::Window(second)) =
                    (&at_earlier.activation, &at_later.activation)
                else {
                    return None;
                };
                (a.low < b.high && b.low < a.high).then_some((first.span, second.span))
            });
            if let (Some((first, second)), false) = (clash, may_overlap) {
                let title =
                    format!("two copies of `{name}` are active at the same time in test `{}`", test.head.name.text);
                let diagnostic = Diagnostic::new(Code::COPIES_OVERLAP, second, title)
                    .label("together the copies may exceed what the operation declares")
                    .secondary(first, "the first copy is active here")
                    .note("if this is intended, add `may overlap` after `per test` in the campaigns");
                self.report(diagnostic);
            }
            let twin = earlier().find(|(earlier, _)| earlier.draw_seed == later.draw_seed);
            if let (Some((_, twin)), Some(seed)) = (twin, at_later.seed) {
                let span = twin.seed.map_or(twin.operation.span, |seed| seed.span);
                let title = format!("two copies of `{name}` have the same seed in test `{}`", test.head.name.text);
                let diagnostic = Diagnostic::new(Code::EQUAL_SEEDS, seed.span, title)
                    .label("the seed of an earlier copy")
                    .secondary(span, "the earlier copy");
                self.report(diagnostic.note(
                    "with the same seed, both copies draw the same random numbers for a message; give each its own",
                ));
            }
        }
    }

    fn test_operation(
        &mut self,
        test: &'a ast::TestOperation,
    ) -> Option<(OperationId, Vec<Choice>, Activation, Option<Messages>)> {
        let index = self.find(&test.operation, Kind::Operation);
        let activation = match &test.activation {
            ast::Activation::Window(window) => self.test_window(window).map(Activation::Window),
            ast::Activation::Trigger(trigger) => self.trigger(trigger),
            ast::Activation::Moment(..) => Some(Activation::Offline),
        };
        let index = index?;
        let operation = self.operations[index].clone()?;
        let choices = self.choices(test, index, &operation);
        if !self.fits_moment(test, index, &operation) {
            return None;
        }
        if let (Some(Activation::Window(window)), Some(within), ast::Activation::Window(written)) =
            (&activation, operation.within, &test.activation)
            && !within.contains(*window)
        {
            let declared = self.file.operations[index].body.within.first();
            let mut diagnostic = Diagnostic::new(
                Code::BAD_WINDOW,
                written.span,
                format!("`{}` is active outside its permitted window", test.operation.text),
            )
            .label("leaves the window given by `within`");
            if let Some((_, range)) = declared {
                diagnostic = diagnostic.secondary(range.span, "the permitted window");
            }
            self.report(diagnostic);
            return None;
        }
        let activation = activation?;
        if !self.fits_lengths(test, index, &operation, &activation) {
            return None;
        }
        let messages = Messages::of_runs(self.listed_messages(test, &operation)?);
        Some((OperationId::from_index(index), choices?, activation, messages))
    }

    /// The only messages that an operation alters: none where the test lists none; `None` after an error.
    fn listed_messages(&mut self, test: &ast::TestOperation, operation: &model::Operation) -> Option<Vec<MessageRun>> {
        /// Results record numbers up to this one.
        const GREATEST: u64 = i64::MAX.unsigned_abs();
        let (Some(first), Some(last)) = (test.messages.first(), test.messages.last()) else {
            return Some(Vec::new());
        };
        let name = &test.operation.text;
        if operation.targets.is_empty() {
            let title = format!("`{name}` acts on no messages");
            let diagnostic = Diagnostic::new(Code::WRONG_CHOICE, first.span.to(last.span), title);
            self.report(diagnostic.label("remove this list"));
            return None;
        }
        let wires = self.wires_acted_on(operation)?;
        let mut runs = Vec::new();
        for run in &test.messages {
            let (from, to) = (run.first.value?, run.last.map_or(run.first.value, |last| last.value)?);
            let wire = run.wire.map_or(Some(1), |wire| wire.value)?;
            let problem = if from > to {
                Some((Code::REVERSED_RANGE, format!("message {from} comes after message {to}"), "swap the two"))
            } else if to > GREATEST {
                let title = format!("message {to} is beyond what can be recorded");
                Some((Code::BAD_NUMBER, title, "expected at most 9223372036854775807"))
            } else if wire == 0 || wire > wires as u64 {
                let title = match wires {
                    1 => format!("`{name}` acts on one wire, not on wire {wire}"),
                    _ => format!("`{name}` acts on wires 1 to {wires}, not on wire {wire}"),
                };
                Some((Code::WRONG_CHOICE, title, "no messages of the operation are there"))
            } else {
                None
            };
            if let Some((code, title, label)) = problem {
                self.report(Diagnostic::new(code, run.span, title).label(label));
                return None;
            }
            // It is at most the number of wires.
            let wire = u32::try_from(wire - 1).ok()?;
            runs.push(MessageRun { wire, first: from, last: to });
        }
        Some(runs)
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

    /// A choice for each of the operation's parameters.
    fn choices(
        &mut self,
        test: &'a ast::TestOperation,
        index: usize,
        operation: &model::Operation,
    ) -> Option<Vec<Choice>> {
        let name = &test.operation.text;
        let parameters = &operation.parameters;
        if parameters.is_empty() {
            let Some((word, choice)) = test.choices.first() else { return Some(Vec::new()) };
            let title = format!("`{name}` has no parameters");
            let span = word.span.to(choice.span());
            self.report(Diagnostic::new(Code::WRONG_CHOICE, span, title).label("remove this"));
            return None;
        }
        let named = |name: &str| parameters.iter().any(|parameter| parameter.name == name);
        let mut unknown = test.choices.iter().filter(|(word, _)| !named(&word.text));
        let mut choices = Vec::new();
        for parameter in parameters {
            let example = examples::choice(parameter, &operation.kind);
            let mut written = test.choices.iter().filter(|(word, _)| word.text == parameter.name);
            let Some((first, choice)) = written.next() else {
                // An unknown name was meant for this one.
                self.report(not_chosen(&test.operation, unknown.next(), parameter, &example));
                continue;
            };
            for (again, _) in written {
                let title = format!("duplicate value for `{}`", again.text);
                let diagnostic = Diagnostic::new(Code::CLAUSE_TWICE, again.span, title).label("remove one of the two");
                self.report(diagnostic.secondary(first.span, "first given here"));
            }
            let example = examples::value(parameter, &operation.kind);
            choices.extend(self.chosen(choice, index, operation, parameter, &example));
        }
        for (other, _) in unknown {
            let title = format!("`{name}` has no parameter named `{}`", other.text);
            let names: Vec<&str> = parameters.iter().map(|parameter| parameter.name.as_str()).collect();
            let label = match names.as_slice() {
                [only] => format!("its only parameter is `{only}`"),
                several => format!("its parameters are {}", list(several)),
            };
            self.report(Diagnostic::new(Code::WRONG_CHOICE, other.span, title).label(label));
        }
        (choices.len() == parameters.len()).then_some(choices)
    }

    fn chosen(
        &mut self,
        choice: &ast::Choice,
        index: usize,
        operation: &model::Operation,
        parameter: &Parameter,
        example: &str,
    ) -> Option<Choice> {
        let what = format!("`{}`", parameter.name);
        let span = choice.span();
        match (choice, &parameter.domain) {
            (ast::Choice::Point(point), Domain::Point { low, high }) => {
                let chosen = self.coordinates(point, parameter.unit.as_ref(), &what)?;
                let declared = self.declared(index, parameter);
                let unit = parameter.unit.as_ref().map_or("", Unit::text);
                let mut complete = true;
                for axis in 0..3 {
                    let found = Range { low: chosen[axis], high: chosen[axis] };
                    let all = Range { low: low[axis], high: high[axis] };
                    let permitted = format!("{}{unit} to {}{unit}", all.low, all.high);
                    let place = point.coordinates[axis].span;
                    complete &= self.inside(found, place, all, &what, &permitted, declared);
                }
                complete.then_some(Choice::Point { point: chosen })
            }
            (ast::Choice::Text(text), Domain::Texts(items) | Domain::Files(items)) => {
                if items.contains(&text.text) {
                    return Some(Choice::Text { text: text.text.clone() });
                }
                let title = format!("`{}` is not a permitted value of {what}", self.text(text.span));
                let listed: Vec<String> = items.iter().map(|item| quoted(item)).collect();
                let mut diagnostic = Diagnostic::new(Code::OUT_OF_RANGE, text.span, title)
                    .label(format!("expected one of {}", listed.join(", ")));
                if let Some(declared) = self.declared(index, parameter) {
                    diagnostic = diagnostic.secondary(declared, "the permitted values are declared here");
                }
                self.report(diagnostic);
                None
            }
            (ast::Choice::Value(_) | ast::Choice::Range(_), Domain::Number { range, shape, integer }) => {
                let probability = operation.kind.has_probabilities() && !*integer;
                self.chosen_number(choice, index, (parameter, probability), (*range, *shape, *integer), example)
            }
            (_, domain) => {
                let kind = match domain {
                    Domain::Number { .. } => "a number",
                    Domain::Point { .. } => "a point",
                    Domain::Texts(_) | Domain::Files(_) => "a `text` in double quotes",
                };
                let diagnostic = Diagnostic::new(Code::WRONG_CHOICE, span, format!("{what} must be {kind}"))
                    .label(format!("expected, for example, `{example}`"));
                self.report(diagnostic);
                None
            }
        }
    }

    fn chosen_number(
        &mut self,
        choice: &ast::Choice,
        index: usize,
        (parameter, probability): (&Parameter, bool),
        (permitted_range, shape, integer): (Range, ChoiceKind, bool),
        example: &str,
    ) -> Option<Choice> {
        // Probabilities are percentages in the language and fractions in the model.
        let hundred = percent();
        let unit = if probability { Some(&hundred) } else { parameter.unit.as_ref() };
        let what = format!("`{}`", parameter.name);
        let span = choice.span();
        let (found, chosen) = match (choice, shape) {
            (ast::Choice::Value(quantity), ChoiceKind::Value) => {
                let value = self.value(quantity, unit, &what)?;
                let value = if probability { self.probability(quantity, value) } else { value };
                (Range { low: value, high: value }, Choice::Value { value })
            }
            (ast::Choice::Range(range), ChoiceKind::Range) => {
                let range = self.range(range, unit, &what)?;
                (range, Choice::Range { low: range.low, high: range.high })
            }
            (_, ChoiceKind::Range) => {
                let written = self.text(span);
                let diagnostic = Diagnostic::new(Code::WRONG_CHOICE, span, format!("{what} must be a range in a test"))
                    .label(format!("expected a range, for example `{example}`"))
                    .note("a value is drawn from the range for each message")
                    .fix("use a range with this value only", span, format!("[{written}, {written}]"));
                self.report(diagnostic);
                return None;
            }
            (_, ChoiceKind::Value) => {
                let mut diagnostic = Diagnostic::new(
                    Code::WRONG_CHOICE,
                    span,
                    format!("{what} must be a single value in a test, not a range"),
                )
                .label(format!("expected one value, for example `{example}`"));
                if let ast::Choice::Range(range) = choice
                    && self.text(range.low.span) == self.text(range.high.span)
                {
                    diagnostic = diagnostic.suggest("use this value alone", span, self.text(range.low.span));
                }
                self.report(diagnostic);
                return None;
            }
        };
        let declared = self.declared(index, parameter);
        let permitted = declared.map_or(String::new(), |declared| format!("a value in `{}`", self.text(declared)));
        if !self.inside(found, span, permitted_range, &what, &permitted, declared) {
            return None;
        }
        if integer && !(self.whole(found.low, span, &what) && self.whole(found.high, span, &what)) {
            return None;
        }
        Some(chosen)
    }

    /// Where the permitted values of a parameter are declared.
    fn declared(&self, index: usize, parameter: &Parameter) -> Option<Span> {
        let body = &self.file.operations[index].body;
        if let Some((.., range)) = body.counted.iter().find(|(counted, ..)| counted.name() == parameter.name) {
            return Some(range.span);
        }
        match &body.kind {
            ast::OperationKind::Custom(custom) => {
                custom.parameters.iter().find(|written| written.name.text == parameter.name).map(|written| written.span)
            }
            kind => kind.written(&parameter.name),
        }
    }
}

/// What is wrong where a test chooses nothing for a parameter, but perhaps for another that does not exist.
fn not_chosen(
    operation: &ast::Name,
    instead: Option<&(ast::Name, ast::Choice)>,
    parameter: &Parameter,
    example: &str,
) -> Diagnostic {
    let (name, span) = (&operation.text, operation.span);
    if let Some((word, choice)) = instead {
        let title = format!("`{name}` has no parameter named `{}`", word.text);
        return Diagnostic::new(Code::WRONG_CHOICE, word.span.to(choice.span()), title)
            .label(format!("expected, for example, `{example}`"))
            .did_you_mean(word.span, &parameter.name);
    }
    let title = format!("`{name}` is missing a value for `{}`", parameter.name);
    let diagnostic =
        Diagnostic::new(Code::WRONG_CHOICE, span, title).label(format!("add one, for example `{example}`"));
    if examples::is_fixed(parameter) {
        return diagnostic.suggest(format!("add `{example}`"), span.end(), format!(" {example}"));
    }
    diagnostic
}

/// Whether an operation is there to hold something at one value.
fn is_constant(kind: &OperationKind) -> bool {
    matches!(kind, OperationKind::StuckAt { .. } | OperationKind::Set { .. })
}

/// Whether there are campaigns that search, and all of them permit copies of one operation to act at the same time.
fn copies_may_overlap(file: &ast::File) -> bool {
    let mut searching = file.campaigns.iter().filter_map(|campaign| campaign.operations.first()).peekable();
    searching.peek().is_some()
        && searching.all(|operations| operations.copies.is_some_and(|(_, copies)| copies == model::Copies::MayOverlap))
}
