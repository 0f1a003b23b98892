//! The parts of expressions, whatever they mean.

use crate::syntax::ast::{Expression, ExpressionKind};

/// What `found` makes of the first part of an expression of which it makes anything: the expression itself, then its
/// parts from left to right, each before its own parts.
pub(super) fn first_part<'e, T>(expression: &'e Expression, found: &impl Fn(&'e Expression) -> Option<T>) -> Option<T> {
    found(expression).or_else(|| parts(expression).find_map(|part| first_part(part, found)))
}

/// The expressions that an expression is made of.
fn parts(expression: &Expression) -> Box<dyn Iterator<Item = &Expression> + '_> {
    match &expression.kind {
        ExpressionKind::Field(_)
        | ExpressionKind::Members(..)
        | ExpressionKind::Number(_)
        | ExpressionKind::Truth(_)
        | ExpressionKind::Text(_)
        | ExpressionKind::Point(_)
        | ExpressionKind::Region(_) => Box::new(std::iter::empty()),
        ExpressionKind::Negate(of) | ExpressionKind::Prefixed(_, of) => Box::new(std::iter::once(&**of)),
        ExpressionKind::Sum(terms) | ExpressionKind::Product(terms) => Box::new(terms.iter().map(|(_, of)| of)),
        ExpressionKind::Compare(left, _, right)
        | ExpressionKind::Until(left, _, right)
        | ExpressionKind::Implies(left, right) => Box::new([&**left, &**right].into_iter()),
        ExpressionKind::All(all)
        | ExpressionKind::Any(all)
        | ExpressionKind::AtLeast(_, all)
        | ExpressionKind::Call(_, all) => Box::new(all.iter()),
    }
}
