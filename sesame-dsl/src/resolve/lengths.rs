//! How long an operation may be active at a time: the clause `for` of operations, and what tests and campaigns make of
//! it.

use sesame_plan::Lengths;

use super::Resolver;
use crate::diagnostic::{Code, Diagnostic};
use crate::model::condition::ConditionSpace;
use crate::model::{Activation, End, Operation, Range};
use crate::span::Span;
use crate::syntax::ast;

/// The permitted lengths as the plan has them.
pub(super) fn permitted(range: Range) -> Lengths {
    Lengths { low: range.low, high: range.high }
}

/// A time in a message: differences of times are rounded to the resolution of simulation time.
fn seconds(time: f64) -> String {
    format!("{}s", (time * 1e9).round() / 1e9)
}

impl<'a> Resolver<'a> {
    /// The lengths that the clause of an operation permits, which fit into its window.
    pub(super) fn window_lengths(&mut self, written: &ast::Range, within: Option<Range>) -> Option<Range> {
        let found = self.times(written, "`for`")?;
        if found.high == 0.0 {
            let diagnostic = Diagnostic::new(Code::BAD_WINDOW, written.span, "the operation is never active")
                .label("these lengths are all 0s");
            self.report(diagnostic);
            return None;
        }
        let room = within.map_or(f64::INFINITY, |within| within.high - within.low);
        if found.low > room && !permitted(found).contain(room) {
            let title = format!("no window of {} or more fits into `within`", seconds(found.low));
            let diagnostic = Diagnostic::new(Code::BAD_WINDOW, written.span, title)
                .label(format!("the permitted window is only {} long", seconds(room)));
            self.report(diagnostic);
            return None;
        }
        Some(found)
    }

    /// Where the lengths of an operation are written.
    fn written_lengths(&self, index: usize) -> Option<Span> {
        let body = &self.file.operations[index].body;
        body.lengths.first().map(|(_, range)| range.span)
    }

    /// Whether a regression test keeps an operation active as long as permitted; reported if not.
    pub(super) fn fits_lengths(
        &mut self,
        test: &'a ast::TestOperation,
        index: usize,
        operation: &Operation,
        activation: &Activation,
    ) -> bool {
        let Some(lengths) = operation.lengths else { return true };
        let name = &test.operation.text;
        let (title, label) = match activation {
            Activation::Offline => return true,
            Activation::Condition { end: End::Condition(_), .. } => (
                format!("`{name}` may be active for longer than permitted"),
                "`until` does not limit how long it is active; use `for` with a time".to_owned(),
            ),
            Activation::Window(Range { low, high }) if permitted(lengths).contain(high - low) => return true,
            Activation::Condition { end: End::Length(length), .. } if permitted(lengths).contain(*length) => {
                return true;
            }
            Activation::Window(_) | Activation::Condition { .. } => {
                let length = match activation {
                    Activation::Window(window) => window.high - window.low,
                    Activation::Condition { end: End::Length(length), .. } => *length,
                    Activation::Condition { .. } | Activation::Offline => 0.0,
                };
                let how = if length < lengths.low { "shorter" } else { "longer" };
                (
                    format!("`{name}` is active for {}, {how} than permitted", seconds(length)),
                    format!("expected a length of {} to {}", seconds(lengths.low), seconds(lengths.high)),
                )
            }
        };
        let span = match &test.activation {
            ast::Activation::Window(window) => window.span,
            ast::Activation::Trigger(_) | ast::Activation::Moment(..) => test.operation.span,
        };
        let mut diagnostic = Diagnostic::new(Code::BAD_WINDOW, span, title).label(label);
        if let Some(declared) = self.written_lengths(index) {
            diagnostic = diagnostic.secondary(declared, "the permitted lengths");
        }
        self.report(diagnostic);
        false
    }

    /// Compares the lengths of an operation with the time that the tests of a campaign leave for it.
    pub(super) fn lengths_and_end(&mut self, name: &ast::Name, index: usize, end: f64, campaign: &'a ast::Campaign) {
        // It was reported for the campaign that writes both.
        if campaign.inherited.operations && campaign.inherited.end {
            return;
        }
        let Some((lengths, within)) =
            self.operations[index].as_ref().and_then(|operation| Some((operation.lengths?, operation.within)))
        else {
            return;
        };
        let begin = within.map_or(0.0, |within| within.low);
        let (Some(written), Some((_, end_written))) = (self.written_lengths(index), campaign.ends.first()) else {
            return;
        };
        let end_written = &end_written.after;
        let room = end - begin;
        // That was reported of its window.
        let leaves_the_end = within.is_some_and(|within| within.high > end);
        let (end_text, of) = (self.text(end_written.span), &campaign.head.name.text);
        // An operation that begins too late was reported as that.
        let diagnostic = if room <= 0.0 {
            return;
        } else if lengths.low > room && !permitted(lengths).contain(room) {
            Diagnostic::new(
                Code::AFTER_THE_END,
                name.span,
                format!("`{}` can never be active in campaign `{of}`", name.text),
            )
            .label(format!("it needs {}, but tests end at {end_text}", seconds(lengths.low)))
        } else if lengths.high > room + 1e-9 && !leaves_the_end {
            Diagnostic::new(
                Code::OUTLASTS_THE_END,
                name.span,
                format!("`{}` may be active beyond the end of campaign `{of}`", name.text),
            )
            .label(format!("no window of {} fits, because tests end at {end_text}", seconds(lengths.high)))
        } else {
            return;
        };
        self.report(
            diagnostic.secondary(written, "its permitted lengths").secondary(end_written.span, "tests end here"),
        );
    }

    /// Reports an operation with permitted lengths in a campaign whose activations have none of these.
    pub(super) fn lengths_and_space(
        &mut self,
        name: &ast::Name,
        index: usize,
        space: &ConditionSpace,
        campaign: &'a ast::Campaign,
    ) {
        let Some(lengths) = self.operations[index].as_ref().and_then(|operation| operation.lengths) else { return };
        let title =
            format!("`{}` cannot keep its permitted lengths in campaign `{}`", name.text, campaign.head.name.text);
        let activation = campaign.activates.first().and_then(|(span, mode)| match mode {
            ast::ActivationMode::Condition(by) => Some(by.lengths.first().map_or(*span, |(_, range)| range.span)),
            ast::ActivationMode::Time => None,
        });
        // What a campaign inherits is not its mistake: that is what it writes itself.
        let (place, other) = match activation.filter(|_| campaign.inherited.operations) {
            Some(activation) => (activation, (name.span, "its operations are listed here")),
            None => (name.span, (activation.unwrap_or(name.span), "activated here")),
        };
        let diagnostic = Diagnostic::new(Code::CANNOT_CONTAIN, place, title);
        let diagnostic = match space.lengths {
            Some(of) if permitted(of).shared(permitted(lengths)).is_some() => return,
            Some(of) => diagnostic.label(format!("activations last {} to {} here", seconds(of.low), seconds(of.high))),
            None => diagnostic
                .label("activations end by a condition here, at any time")
                .note("add `for` with a range of times to the `activate` of this campaign, such as `for [0.1s, 2s]`"),
        };
        let diagnostic = diagnostic.secondary(other.0, other.1);
        let declared = self.written_lengths(index);
        self.report(match declared {
            Some(declared) => diagnostic.secondary(declared, "its permitted lengths"),
            None => diagnostic,
        });
    }
}
