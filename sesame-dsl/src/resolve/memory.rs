//! What formulas compute from successive messages: `previous`, `rate` and `integral` of a value that messages carry.
//!
//! Their argument is a topic or field, not a calculation: it is at messages that there is a next value, and the values
//! of a calculation over several topics belong to no message.

use sesame_plan::{Finite, Reduction};

use super::Resolver;
use super::elements::Reading;
use super::formula::{Number, position, scaled};
use super::read::{Read, Remembers, computed, memory_named, read_in};
use super::words::type_in_words;
use crate::diagnostic::{Code, Diagnostic};
use crate::model::{Expression, Input, Members, Memory, Type};
use crate::span::Span;
use crate::syntax::ast::{self, ExpressionKind, Name};
use crate::units::{Unit, dimension, product};

impl<'a> Resolver<'a> {
    /// The number that one of these functions computes.
    pub(super) fn remembered(&mut self, inputs: &mut Vec<Input>, call: &'a ast::Expression) -> Option<Number> {
        let (memory, of) = computed(call);
        let of_messages = |path| self.named_clock(path).is_none() && self.scene_at(path).is_none();
        let read = read_in(call).filter(|read| of_messages(read.path));
        let Some(read) = read else {
            let innermost = memory.first().map_or("previous", |(_, name)| name.text.as_str());
            self.calculated(innermost, of);
            return None;
        };
        let reading = self.read(&read)?;
        let (Type::Int(unit) | Type::Real(unit)) = &reading.ty else {
            self.not_a_number_before(call.span, &read, &reading.ty);
            return None;
        };
        let unit = unit.clone();
        let input = reading.input(None);
        if !input.is_integral() {
            return Some((Expression::Input(position(inputs, input)), unit));
        }
        let (unit, scale) = product(unit.as_ref(), Some(&Unit::seconds()), false).or_else(|| {
            self.no_unit(call.span);
            None
        })?;
        Some((scaled(Expression::Integral(position(inputs, input)), scale), unit))
    }

    /// What a formula reads, and what it computes from successive values of it. The type of an integral is that of what
    /// is integrated.
    pub(super) fn read(&mut self, read: &Read<'a>) -> Option<Reading> {
        let mut reading = self.reading(read.path, read.word)?;
        let start = read.word.map_or(read.path.span, |(_, word)| word);
        for &(memory, name) in &read.memory {
            let whole = name.span.to(read.path.span);
            if reading.memory.last() == Some(&Memory::Integral) {
                let title = format!("`{}(…)` of an integral is not possible", name.text);
                let diagnostic = Diagnostic::new(Code::NOT_A_FORMULA, name.span, title)
                    .label("expected a value of messages inside")
                    .note("an integral grows between messages, so it is the last that is computed");
                self.report(diagnostic);
                return None;
            }
            let (memory, ty) = match (memory, &reading.ty) {
                (Remembers::Previous, ty) => (Memory::Previous, ty.clone()),
                (Remembers::Integral, Type::Int(unit) | Type::Real(unit)) => {
                    (Memory::Integral, Type::Real(unit.clone()))
                }
                (Remembers::Rate, Type::Int(unit) | Type::Real(unit)) => {
                    (Memory::Rate, Type::Real(self.per_second(unit.as_ref(), whole)?))
                }
                (Remembers::Rate, Type::Point(unit)) => {
                    (Memory::Rate, Type::Point(self.per_second(unit.as_ref(), whole)?))
                }
                (Remembers::Unwrapped, Type::Int(unit) | Type::Real(unit)) => {
                    let turn = self.turn(&name.text, start.to(read.path.span), unit.as_ref())?;
                    (Memory::Unwrapped { turn: Finite(turn) }, Type::Real(unit.clone()))
                }
                (_, ty) => {
                    let ty = ty.clone();
                    self.not_remembered(name, start.to(read.path.span), &ty);
                    return None;
                }
            };
            reading.ty = ty;
            reading.memory.push(memory);
        }
        self.one_by_one(read, &reading)?;
        Some(reading)
    }

    /// The unit of a rate.
    #[expect(clippy::option_option, reason = "the outer `None` means a mistake, the inner is a plain number")]
    fn per_second(&mut self, unit: Option<&Unit>, span: Span) -> Option<Option<Unit>> {
        // Shares stay shares: `%` becomes `%/s`.
        let plain = unit.filter(|unit| dimension(Some(unit)) == dimension(None));
        if let Some(rate) = plain.and_then(|unit| Unit::parse(&format!("{}/s", unit.text())).ok()) {
            return Some(Some(rate));
        }
        let Some((rate, _)) = product(unit, Some(&Unit::seconds()), true) else {
            self.no_unit(span);
            return None;
        };
        Some(rate)
    }

    fn no_unit(&mut self, span: Span) {
        let title = "the unit of this value is too large or too small";
        let label = "its scale cannot be represented";
        self.report(Diagnostic::new(Code::UNKNOWN_UNIT, span, title).label(label));
    }

    /// Checks that there is one series of values to remember, or one for each member of a group.
    fn one_by_one(&mut self, read: &Read<'a>, reading: &Reading) -> Option<()> {
        let Some((memory, name)) = read.memory.last() else { return Some(()) };
        let whole = name.span.to(read.path.span);
        let called = &name.text;
        if read.memory.len() > Input::DEEPEST_MEMORY {
            let limit = Input::DEEPEST_MEMORY;
            let title =
                format!("these functions are nested {} levels deep, but the limit is {limit}", read.memory.len());
            self.report(Diagnostic::new(Code::TOO_LARGE, whole, title).label("nested too deeply"));
            return None;
        }
        if reading.list.as_ref().is_some_and(|list| list.reduction == Reduction::Each) {
            let title = format!("`{called}(…)` cannot be combined with `each of` a list");
            let diagnostic = Diagnostic::new(Code::UNPAIRED, whole, title)
                .label("an element has no identity from one message to the next")
                .note("choose one element, such as `[0]` or `[name == \"elbow\"]`");
            self.report(diagnostic);
            return None;
        }
        let joined = matches!(reading.members, Members::Min | Members::Max | Members::Sum);
        if *memory == Remembers::Integral && joined && self.members_of(&reading.field) > 1 {
            let written = self.text(read.path.span).to_owned();
            let title = format!("`{}` is a group of topics, but one value is integrated", read.path.topic.text);
            let argument = read.word.map_or(read.path.span, |(_, word)| word.to(read.path.span));
            let diagnostic = Diagnostic::new(Code::UNPAIRED, argument, title)
                .label("expected one topic or one member")
                .suggest("use the integral of each member", argument, format!("each of {written}"));
            self.report(diagnostic);
            return None;
        }
        Some(())
    }

    /// Reports an argument that is no value of messages.
    fn calculated(&mut self, name: &str, of: &'a ast::Expression) {
        if let ExpressionKind::Call(inner, arguments) = &of.kind
            && memory_named(&inner.text).is_some()
        {
            self.wrong_count(of.span, &inner.text, "one value", arguments.len());
            return;
        }
        let written = self.text(of.span);
        let title = format!("`{name}(…)` needs a topic or field, but `{written}` is not a value of a message");
        let diagnostic = Diagnostic::new(Code::NOT_A_FORMULA, of.span, title).label("expected a topic or field");
        let diagnostic = diagnostic.note(match &of.kind {
            ExpressionKind::Sum(terms) if terms.iter().all(|(_, term)| read_in(term).is_some()) => {
                let terms = terms.iter().enumerate().map(|(at, (minus, term))| {
                    let sign = match (at, minus) {
                        (0, _) => "",
                        (_, true) => " - ",
                        (_, false) => " + ",
                    };
                    format!("{sign}{name}({})", self.text(term.span))
                });
                format!("write `{}`", terms.collect::<String>())
            }
            _ => format!("it is computed from the messages of one topic: apply `{name}` to what is read of them"),
        });
        self.report(diagnostic);
    }

    /// Reports a value of which there is no rate or no integral.
    fn not_remembered(&mut self, name: &Name, argument: Span, ty: &Type) {
        let (called, written) = (&name.text, self.text(argument));
        let title = format!("`{called}(…)` needs a number, but `{written}` is {}", type_in_words(ty));
        let mut diagnostic = Diagnostic::new(Code::WRONG_TYPE, argument, title).label("expected a number");
        match ty {
            Type::Bool if memory_named(called) == Some(Remembers::Integral) => {
                diagnostic = diagnostic.note(format!("`duration({written})` is the time during which it is true"));
            }
            Type::Bool => {
                diagnostic = diagnostic.note(format!("`previous({written}) != {written}` holds when it changes"));
            }
            Type::Point(_) => {
                for coordinate in ["x", "y", "z"] {
                    diagnostic = diagnostic.suggest(
                        format!("use its coordinate `{coordinate}`"),
                        argument.end(),
                        format!(".{coordinate}"),
                    );
                }
            }
            _ => {}
        }
        self.report(diagnostic);
    }

    /// Reports a previous value or a rate that is no number although one is needed.
    fn not_a_number_before(&mut self, span: Span, read: &Read<'a>, ty: &Type) {
        if !matches!(ty, Type::Bool | Type::Text | Type::Point(_)) {
            // Whole messages and lists are reported as without a memory.
            self.number_read(read.path, read.word);
            return;
        }
        let written = self.text(span);
        let title = format!("a formula needs a number, but `{written}` is {}", type_in_words(ty));
        let mut diagnostic = Diagnostic::new(Code::WRONG_TYPE, span, title).label("expected a number");
        if let Type::Point(unit) = ty {
            let unit = unit.as_ref().map_or("", Unit::text);
            diagnostic = diagnostic.note(format!("`distance({written}, (0, 0, 0){unit})` is its length"));
        }
        self.report(diagnostic);
    }

    /// The type of what a formula reads; `None` also where that is a mistake. Reports nothing.
    pub(super) fn type_of_read(&self, read: &Read<'_>) -> Option<Type> {
        let ty = self.type_read(read.path, read.word.map(|(word, _)| word))?;
        let kept = read.memory.iter().all(|(memory, _)| *memory == Remembers::Previous);
        match ty {
            Type::Bool | Type::Text if !kept => None,
            ty => Some(ty),
        }
    }
}
