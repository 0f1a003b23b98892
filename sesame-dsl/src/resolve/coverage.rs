//! How a campaign's coverage is counted.

use super::Resolver;
use super::quantity::percent;
use crate::diagnostic::{Code, Diagnostic};
use crate::model::{self, CoverageAxis, Dimension};
use crate::similar::most_similar;
use crate::syntax::ast;

/// Cells of a grid at most: what a map of them can show.
const MOST_CELLS: u64 = 100_000;

impl<'a> Resolver<'a> {
    /// The campaign's coverage. The outer `None` says that it is not in order.
    #[expect(clippy::option_option, reason = "the outer says whether it was in order, the inner is the model's")]
    pub(super) fn coverage(&mut self, campaign: &'a ast::Campaign) -> Option<Option<model::Coverage>> {
        let spans: Vec<_> = campaign.coverages.iter().map(|coverage| coverage.span).collect();
        self.at_most_one(&spans, "coverage");
        let Some(written) = campaign.coverages.first() else { return Some(None) };
        let axes = self.axes(written);
        let hits = match self.single(&written.hits, "hits") {
            Some(&count) => self.count(count, 1, "the hits of a covered cell are"),
            None => Some(1),
        };
        let stop_at = match self.single(&written.stops, "stop at") {
            Some(quantity) => self.stop_at(quantity).map(Some),
            None => Some(None),
        };
        let failsafe = match self.single(&written.failsafes, "failsafe").copied() {
            Some(count) => self.failsafe(campaign, written, count).map(Some),
            None => Some(None),
        };
        Some(Some(model::Coverage { axes: axes?, hits: hits?, stop_at: stop_at?, failsafe: failsafe? }))
    }

    fn axes(&mut self, written: &ast::Coverage) -> Option<Vec<CoverageAxis>> {
        if written.axes.is_empty() {
            if !written.has_errors {
                let diagnostic =
                    Diagnostic::new(Code::CLAUSE_MISSING, written.span, "this `coverage` lacks its dimensions")
                        .label("add the dimensions whose cells are counted")
                        .note("for example `T1 [0, 1] cells 6   T2 [0, 0.5] cells 6   P1 [0, 1] cells 3`");
                self.report(diagnostic);
            }
            return None;
        }
        let mut complete = true;
        let mut axes = Vec::new();
        for (at, axis) in written.axes.iter().enumerate() {
            let name = &axis.dimension;
            if let Some(first) = written.axes[..at].iter().find(|first| first.dimension.text == name.text) {
                let title = format!("`{}` stands twice in this coverage", name.text);
                let diagnostic = Diagnostic::new(Code::LISTED_TWICE, name.span, title)
                    .label("remove this one or the other")
                    .also(first.dimension.span, "first here");
                self.report(diagnostic);
                complete = false;
                continue;
            }
            match self.axis(axis) {
                Some(axis) => axes.push(axis),
                None => complete = false,
            }
        }
        let cells = axes.iter().try_fold(1u64, |cells, axis| cells.checked_mul(u64::from(axis.cells)));
        if cells.is_none_or(|cells| cells > MOST_CELLS) {
            let diagnostic = Diagnostic::new(Code::BAD_COUNT, written.span, "this coverage has too many cells")
                .label(format!("expected at most {MOST_CELLS} together"))
                .note("the cells of the dimensions multiply");
            self.report(diagnostic);
            return None;
        }
        complete.then_some(axes)
    }

    fn axis(&mut self, axis: &ast::CoverageAxis) -> Option<CoverageAxis> {
        let name = &axis.dimension;
        let known = Dimension::named(&name.text);
        if known.is_none() {
            let mut diagnostic =
                Diagnostic::new(Code::UNKNOWN_NAME, name.span, format!("no dimension named `{}`", name.text))
                    .label("not a dimension of tests")
                    .note("there are T1, T2, T3 (timing), P1, P2 (parameters), O0, O1, O2 and O3 (operations)");
            if let Some(similar) = most_similar(&name.text, Dimension::ALL.map(Dimension::name)) {
                diagnostic = diagnostic.suggest(format!("`{similar}` is"), name.span, similar);
            }
            self.report(diagnostic);
        }
        let what = format!("the dimension `{}`", name.text);
        let range = self.range(&axis.range, None, &what);
        let cells = self.count(axis.cells, 1, "the cells of a dimension are");
        let (range, cells, dimension) = (range?, cells?, known?);
        if range.low == range.high {
            let title = format!("`{}` has no width to divide into cells", self.text(axis.range.span));
            let diagnostic = Diagnostic::new(Code::OUT_OF_RANGE, axis.range.span, title);
            self.report(diagnostic.label("expected an end above the beginning"));
            return None;
        }
        Some(CoverageAxis { dimension, range, cells })
    }

    fn stop_at(&mut self, quantity: &ast::Quantity) -> Option<f64> {
        let value = self.value(quantity, Some(&percent()), "the share of covered cells")?;
        if 0.0 < value && value <= 100.0 {
            return Some(self.probability(quantity, value));
        }
        let title = format!("a search cannot stop at `{}` of all cells", self.text(quantity.span));
        let diagnostic = Diagnostic::new(Code::OUT_OF_RANGE, quantity.span, title);
        self.report(diagnostic.label("expected more than 0% and at most 100%"));
        None
    }

    fn failsafe(&mut self, campaign: &ast::Campaign, written: &ast::Coverage, count: ast::Count) -> Option<u32> {
        let found = self.count(count, 1, "a search evaluates")?;
        if written.stops.is_empty() && !written.has_errors {
            let diagnostic = Diagnostic::new(Code::CLAUSE_MISSING, count.span, "there is nothing to give up")
                .label("`failsafe` ends a search that is to stop at a coverage and does not reach it")
                .note("add for example `stop at 50%`");
            self.report(diagnostic);
            return None;
        }
        let evaluations = campaign.searches.first().and_then(|search| search.evaluations.first());
        if let Some((_, evaluations)) = evaluations
            && evaluations.value.is_some_and(|least| u64::from(found) < least)
        {
            let title = format!("`failsafe {found}` gives up before the search's evaluations are done");
            let diagnostic = Diagnostic::new(Code::BAD_COUNT, count.span, title)
                .label("expected at least as many")
                .also(evaluations.span, "its evaluations");
            self.report(diagnostic);
            return None;
        }
        Some(found)
    }
}
