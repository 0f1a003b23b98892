//! Operations that keep the angles which they change within one turn.

use sesame_plan::Turn;

use super::Resolver;
use crate::diagnostic::{Code, Diagnostic};
use crate::model::{Domain, OperationKind, Parameter};
use crate::span::Span;
use crate::syntax::ast;
use crate::units::{Dimension, Unit, convert, dimension, product};

/// How far a written turn may be from a whole one, in turns: `6.2832rad` is meant to be one.
const TOLERANCE: f64 = 1e-4;

impl<'a> Resolver<'a> {
    /// The turn in which an operation of a kind keeps the values that it adds to, with these parameters.
    pub(super) fn wrapped(
        &mut self,
        body: &'a ast::OperationBody,
        (word, turn): (Span, Option<&'a ast::Range>),
        kind: &OperationKind,
        parameters: &[Parameter],
    ) -> Option<Turn> {
        let clause = turn.map_or(word, |turn| word.to(turn.span));
        let Some(amount) = parameters.first().filter(|_| kind.adds()) else {
            let title = format!("`wrapped` has no effect on `{}`", kind.words());
            let diagnostic = Diagnostic::new(Code::IDLE_CLAUSE, clause, title).label("remove this").note(
                "only `random offset`, `bias`, `drift`, `noise` and `random walk` add to an angle, which may then be \
                 beyond one turn",
            );
            self.report(diagnostic);
            return None;
        };
        // A rate is that of what drifts.
        let unit = match kind {
            OperationKind::Drift => product(amount.unit.as_ref(), Some(&Unit::seconds()), false)?.0,
            _ => amount.unit.clone(),
        };
        let of_point = matches!(amount.domain, Domain::Point { .. }) || amount.name == "x";
        let found = dimension(unit.as_ref());
        if of_point || found != Dimension::ANGLE {
            let first = body.targets.first()?.places.first()?;
            let is = if of_point { "a point".to_owned() } else { found.name() };
            let title = format!("`{}` is {is}, but only angles wrap", self.text(first.span));
            let diagnostic = Diagnostic::new(Code::WRONG_UNIT, clause, title)
                .label("remove this")
                .secondary(first.span, "expected a number with the unit of an angle, such as `real[rad]`");
            self.report(diagnostic);
            return None;
        }
        let whole = convert(1.0, Some(&Unit::revolutions()), unit.as_ref());
        let Some(written) = turn else { return Some(Turn { low: -whole / 2.0, high: whole / 2.0 }) };
        let range = self.range(written, unit.as_ref(), "`wrapped`")?;
        if ((range.high - range.low) / whole - 1.0).abs() > TOLERANCE {
            let unit = unit.as_ref().map_or("", Unit::text);
            let title = format!("`{}` is not one turn", self.text(written.span));
            let diagnostic = Diagnostic::new(Code::OUT_OF_RANGE, written.span, title)
                .label(format!("expected a range of {whole}{unit}"))
                .note(
                    "angles that differ by whole turns are the same; without a range they stay within half a turn of 0",
                );
            self.report(diagnostic);
            return None;
        }
        Some(Turn { low: range.low, high: range.low + whole })
    }
}
