//! How a campaign's coverage is counted.

use super::Resolver;
use crate::diagnostic::{Code, Diagnostic};
use crate::model::{self, CoverageAxis};
use crate::syntax::ast;

/// The most cells of a grid: as many as a map of them can show.
const MOST_CELLS: u64 = 100_000;

impl<'a> Resolver<'a> {
    /// The campaign's coverage. The outer `None` means that it has mistakes.
    #[expect(clippy::option_option, reason = "the outer `None` means a mistake, the inner is the model's")]
    pub(super) fn coverage(&mut self, campaign: &'a ast::Campaign) -> Option<Option<model::Coverage>> {
        let spans: Vec<_> = campaign.coverages.iter().map(|coverage| coverage.span).collect();
        self.at_most_one(&spans, "coverage");
        let Some(written) = campaign.coverages.first() else { return Some(None) };
        let axes = self.axes(written);
        let hits = match self.single(&written.hits, "hits") {
            Some(&count) => self.count(count, 1, "the number of hits"),
            None => Some(1),
        };
        let stop_at = match self.single(&written.stops, "stop at") {
            Some(quantity) => self.share(quantity, "the share of covered cells").map(Some),
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
                    Diagnostic::new(Code::CLAUSE_MISSING, written.span, "`coverage` needs at least one dimension")
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
                let title = format!("dimension `{}` is listed twice", name.text);
                let diagnostic = Diagnostic::new(Code::LISTED_TWICE, name.span, title)
                    .label("remove one of the two")
                    .secondary(first.dimension.span, "first listed here");
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
                .label(format!("expected at most {MOST_CELLS} in total"))
                .note("the total is the product of the cells of all dimensions");
            self.report(diagnostic);
            return None;
        }
        complete.then_some(axes)
    }

    fn axis(&mut self, axis: &ast::CoverageAxis) -> Option<CoverageAxis> {
        let name = &axis.dimension;
        let dimension = self.dimension(name);
        let what = format!("the dimension `{}`", name.text);
        let range = self.range(&axis.range, None, &what);
        let cells = self.count(axis.cells, 1, "the number of cells");
        if range.is_some_and(|range| range.low == range.high) {
            let title = format!("`{}` cannot be divided into cells", self.text(axis.range.span));
            let diagnostic = Diagnostic::new(Code::OUT_OF_RANGE, axis.range.span, title);
            self.report(diagnostic.label("expected an end greater than the beginning"));
            return None;
        }
        Some(CoverageAxis { dimension: dimension?, range: range?, cells: cells? })
    }

    fn failsafe(&mut self, campaign: &ast::Campaign, written: &ast::Coverage, count: ast::Count) -> Option<u32> {
        let found = self.count(count, 1, "`failsafe`");
        if written.stops.is_empty() && !written.has_errors {
            let diagnostic = Diagnostic::new(Code::CLAUSE_MISSING, count.span, "`failsafe` needs `stop at`")
                .label("this ends a search that does not reach its `stop at`")
                .note("for example `stop at 50%`");
            self.report(diagnostic);
            return None;
        }
        let found = found?;
        let evaluations = campaign.searches.first().and_then(|search| search.evaluations.first());
        if let Some((_, evaluations)) = evaluations
            && evaluations.value.is_some_and(|least| u64::from(found) < least)
        {
            let title = format!("`failsafe {found}` ends the search before its evaluations are made");
            let diagnostic = Diagnostic::new(Code::BAD_COUNT, count.span, title)
                .label("expected at least the number of evaluations")
                .secondary(evaluations.span, "the number of evaluations");
            self.report(diagnostic);
            return None;
        }
        Some(found)
    }
}
