//! Numbers with units, converted to the unit that their place requires.

use super::Resolver;
use crate::diagnostic::{Code, Diagnostic, Suggestion};
use crate::model::Range;
use crate::span::Span;
use crate::syntax::ast::{self, Quantity, UnitName};
use crate::units::{Unit, UnitError, convert, dimension};

impl Resolver<'_> {
    pub(super) fn unit(&mut self, name: &UnitName) -> Option<Unit> {
        let error = match Unit::parse(&name.text) {
            Ok(unit) => return Some(unit),
            Err(error) => error,
        };
        let diagnostic = match error {
            UnitError::Unknown { symbol, similar } => {
                let mut diagnostic =
                    Diagnostic::new(Code::UNKNOWN_UNIT, name.span, format!("no unit named `{symbol}`"))
                        .label("unknown unit");
                for meant in &similar {
                    let replacement = name.text.replace(&symbol, meant);
                    diagnostic = diagnostic.suggest(format!("did you mean `{meant}`?"), name.span, replacement);
                }
                if similar.is_empty() {
                    diagnostic = diagnostic.note("`sesamec explain E0301` lists the units");
                }
                diagnostic
            }
            UnitError::TooLarge => {
                let title = format!("the unit `{}` is too large or too small", name.text);
                Diagnostic::new(Code::UNKNOWN_UNIT, name.span, title).label("its scale cannot be represented")
            }
        };
        self.report(diagnostic);
        None
    }

    /// A quantity as a number in a unit. `what` is the subject of "… is a length": for example "the field `level`".
    pub(super) fn value(&mut self, quantity: &Quantity, unit: Option<&Unit>, what: &str) -> Option<f64> {
        let from = match &quantity.unit {
            Some(name) => Some(self.unit(name)?),
            None => None,
        };
        if quantity.value.is_nan() {
            return None;
        }
        let written = self.text(quantity.span);
        // A plain number is not a percentage: `0.4` and `40` would both be plausible.
        if dimension(from.as_ref()) == dimension(unit) && (from.is_some() || unit.is_none()) {
            let value = convert(quantity.value, from.as_ref(), unit);
            if !value.is_finite() {
                let title = format!("`{written}` is too large");
                self.report(
                    Diagnostic::new(Code::BAD_NUMBER, quantity.span, title)
                        .label("greater than 1.8e308 in the unit of this place"),
                );
                return None;
            }
            return Some(value);
        }
        let diagnostic = match (from, unit) {
            (None, Some(unit)) => {
                let is = wanted(unit);
                let diagnostic = Diagnostic::new(Code::WRONG_UNIT, quantity.span, format!("`{written}` has no unit"))
                    .label(format!("{what} is {is}"));
                self.with_unit(diagnostic, &[quantity], unit)
            }
            (Some(from), None) => {
                let title = format!("`{written}` is {}, but {what} is a plain number", from.dimension().name());
                let diagnostic = Diagnostic::new(Code::WRONG_UNIT, quantity.span, title).label("expected no unit");
                let name = quantity.unit.as_ref().map_or(quantity.span, |name| name.span);
                diagnostic.suggest("remove the unit", name, "")
            }
            (from, unit) => {
                let is = unit.map_or("a plain number".to_owned(), wanted);
                let measures = dimension(from.as_ref()).name();
                let title = format!("`{written}` is {measures}, but {what} is {is}");
                Diagnostic::new(Code::WRONG_UNIT, quantity.span, title).label(format!("expected {is}"))
            }
        };
        self.report(diagnostic);
        None
    }

    /// A range in a unit, its ends in order.
    pub(super) fn range(&mut self, range: &ast::Range, unit: Option<&Unit>, what: &str) -> Option<Range> {
        if let (None, None, Some(unit)) = (&range.low.unit, &range.high.unit, unit) {
            self.without_units(range, unit, what);
            return None;
        }
        let low = self.value(&range.low, unit, what);
        let high = self.value(&range.high, unit, what);
        let [low, high] = [low?, high?];
        if low <= high {
            return Some(Range { low, high });
        }
        self.reversed(range, "this range is reversed");
        None
    }

    /// Reports a range whose ends both have no unit as one mistake.
    fn without_units(&mut self, range: &ast::Range, unit: &Unit, what: &str) {
        let title = format!("`{}` has no units", self.text(range.span));
        let diagnostic =
            Diagnostic::new(Code::WRONG_UNIT, range.span, title).label(format!("{what} is {}", wanted(unit)));
        let diagnostic = self.with_unit(diagnostic, &[&range.low, &range.high], unit);
        self.report(diagnostic);
    }

    /// A diagnostic with what numbers without a unit may mean. From -1 to 1, a share is probably written as a
    /// fraction.
    fn with_unit(&self, mut diagnostic: Diagnostic, numbers: &[&Quantity], unit: &Unit) -> Diagnostic {
        // A sign right behind a number would continue its unit: `0/h`.
        let glued = |number: &&Quantity| {
            let after = &self.sources.file(number.span.file).text()[number.span.range().end..];
            after.starts_with(|c: char| matches!(c, '/' | '*' | '^' | '%') || c.is_alphanumeric())
        };
        if numbers.iter().any(glued) {
            return diagnostic;
        }
        // Zero is the same in both.
        let share = |number: &&Quantity| (-1.0..=1.0).contains(&number.value);
        let zero = numbers.iter().all(|number| number.value == 0.0);
        if unit.text() == "%" && numbers.iter().all(share) && !zero {
            let percentage = |number: f64| sesame_notation::Unit::Share.number(number);
            let percentages = numbers.iter().map(|number| (number.span, percentage(number.value)));
            let message = "write the fraction as a percentage";
            diagnostic.suggestions.push(Suggestion::possible(message, percentages.collect()));
        }
        let units = numbers.iter().map(|number| (number.span.end(), unit.text().to_owned()));
        let message = format!("add the unit `{}`", unit.text());
        diagnostic.suggestions.push(Suggestion::possible(message, units.collect()));
        diagnostic
    }

    pub(super) fn reversed(&mut self, range: &ast::Range, title: &str) {
        let code = if title.contains("window") { Code::BAD_WINDOW } else { Code::REVERSED_RANGE };
        let [low, high] = [&range.low, &range.high].map(|end| self.text(end.span));
        let mut diagnostic =
            Diagnostic::new(code, range.span, title).label(format!("`{low}` is greater than `{high}`"));
        diagnostic.suggestions.push(Suggestion::possible(
            "swap the two ends".to_owned(),
            vec![(range.low.span, high.to_owned()), (range.high.span, low.to_owned())],
        ));
        self.report(diagnostic);
    }

    /// Checks that a range lies inside another; `permitted` is the other in words, after "expected".
    pub(super) fn inside(
        &mut self,
        inner: Range,
        span: Span,
        outer: Range,
        what: &str,
        permitted: &str,
        declared: Option<Span>,
    ) -> bool {
        if outer.contains(inner) {
            return true;
        }
        let written = self.text(span);
        let mut diagnostic =
            Diagnostic::new(Code::OUT_OF_RANGE, span, format!("`{written}` is out of range for {what}"))
                .label(format!("expected {permitted}"));
        if let Some(declared) = declared {
            diagnostic = diagnostic.secondary(declared, "the permitted range is declared here");
        }
        self.report(diagnostic);
        false
    }

    /// Checks that a number is whole.
    pub(super) fn whole(&mut self, value: f64, span: Span, what: &str) -> bool {
        // Beyond 2^53 not every whole number is a float, so a range there would not mean what it says.
        let exact = value.fract() == 0.0 && value.abs() <= (1u64 << 53) as f64;
        if !exact {
            let title = format!("`{}` is not a whole number, but {what} needs one", self.text(span));
            let diagnostic = Diagnostic::new(Code::BAD_NUMBER, span, title);
            self.report(diagnostic.label("expected a whole number of at most 2^53"));
        }
        exact
    }

    /// A range of percentages between 0 and 100, as probabilities.
    pub(super) fn probabilities(&mut self, range: &ast::Range, what: &str) -> Option<Range> {
        let all = Range { low: 0.0, high: 100.0 };
        self.percentages(range, what, all, "0% to 100%")
    }

    /// A range of percentages that are permitted, as fractions; `permitted` is what is permitted in words.
    pub(super) fn percentages(&mut self, range: &ast::Range, what: &str, all: Range, permitted: &str) -> Option<Range> {
        let found = self.range(range, Some(&percent()), what)?;
        self.inside(found, range.span, all, what, permitted, None).then(|| Range {
            low: self.probability(&range.low, found.low),
            high: self.probability(&range.high, found.high),
        })
    }

    /// A percentage as a probability: the float nearest to what is written.
    ///
    /// Dividing the nearest float by 100 would round twice, and a fifth of all probabilities could not be written at
    /// all.
    pub(super) fn probability(&self, quantity: &Quantity, percentage: f64) -> f64 {
        let exact = match &quantity.unit {
            Some(unit) if unit.text == "%" => hundredth(self.text(quantity.span).trim_end_matches('%').trim_end()),
            _ => None,
        };
        exact.unwrap_or_else(|| convert(percentage, Some(&percent()), None))
    }

    /// A quantity that must be greater than 0, as a number in a unit; `title` says so. A number that is not greater is
    /// out of range whatever unit it lacks.
    pub(super) fn above_zero(&mut self, quantity: &Quantity, unit: &Unit, what: &str, title: &str) -> Option<f64> {
        let value = if is_bare_and_not_positive(quantity) { 0.0 } else { self.value(quantity, Some(unit), what)? };
        if value > 0.0 {
            return Some(value);
        }
        let label = format!("expected more than 0{}", unit.text());
        self.report(Diagnostic::new(Code::OUT_OF_RANGE, quantity.span, title).label(label));
        None
    }

    /// A range of times that are not negative, in seconds.
    pub(super) fn times(&mut self, range: &ast::Range, what: &str) -> Option<Range> {
        let found = self.range(range, Some(&Unit::seconds()), what)?;
        let all = Range { low: 0.0, high: f64::INFINITY };
        self.inside(found, range.span, all, what, "0s or more", None).then_some(found)
    }
}

/// Whether a number has no unit, and none that makes it greater than 0.
pub(super) fn is_bare_and_not_positive(quantity: &Quantity) -> bool {
    quantity.unit.is_none() && quantity.value <= 0.0
}

/// Whether both ends of a range are times.
pub(super) fn is_of_times(range: &ast::Range) -> bool {
    let is_time = |end: &Quantity| {
        let unit = end.unit.as_ref().and_then(|unit| Unit::parse(&unit.text).ok());
        unit.is_some_and(|unit| unit.dimension() == Unit::seconds().dimension())
    };
    is_time(&range.low) && is_time(&range.high)
}

/// A hundredth of an unsigned number as written; `None` for anything else.
fn hundredth(written: &str) -> Option<f64> {
    let (digits, exponent) = written.split_once(['e', 'E']).unwrap_or((written, "0"));
    let exponent = exponent.parse::<i64>().ok()?.checked_sub(2)?;
    format!("{digits}e{exponent}").parse().ok().filter(|value: &f64| value.is_finite())
}

/// The unit of probabilities in the language.
pub(super) fn percent() -> Unit {
    Unit::parse("%").expect("`%` is in the table")
}

fn wanted(unit: &Unit) -> String {
    if unit.text() == "%" {
        "a percentage in `%`".to_owned()
    } else {
        format!("{} in `{}`", unit.dimension().name(), unit.text())
    }
}
