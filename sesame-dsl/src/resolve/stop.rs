//! When a campaign's search stops before it has made all its evaluations.

use super::Resolver;
use crate::diagnostic::{Code, Diagnostic};
use crate::model::StopRule;
use crate::syntax::ast;
use crate::units::Unit;

impl<'a> Resolver<'a> {
    /// The campaign's stopping rules; `None` if they have mistakes.
    pub(super) fn stop(&mut self, campaign: &'a ast::Campaign) -> Option<Vec<StopRule>> {
        let spans: Vec<_> = campaign.stops.iter().map(|stop| stop.span).collect();
        self.at_most_one(&spans, "stop");
        let Some(written) = campaign.stops.first() else { return Some(vec![]) };
        let time = self.single(&written.times, "time").map(|quantity| self.wall_time(quantity));
        let stagnation = self.single(&written.stagnations, "stagnation").map(|(count, quantity)| {
            let generations = self.count(*count, 1, "the number of generations");
            let below = self.share(quantity, "the growth of a stagnating search");
            Some(StopRule::Stagnation { generations: generations?, below: below? })
        });
        let discovery = self
            .single(&written.discoveries, "discovery")
            .map(|quantity| Some(StopRule::Discovery { below: self.share(quantity, "the discovery probability")? }));
        let completeness = self
            .single(&written.completenesses, "completeness")
            .map(|quantity| Some(StopRule::Completeness { share: self.share(quantity, "the completeness")? }));
        let causes = self
            .single(&written.causes, "no new cause")
            .map(|tests| Some(StopRule::NoNewCause { tests: self.count(*tests, 1, "the number of tests")? }));
        let pairs = self.single(&written.pairs, "every pair").map(|()| Some(StopRule::EveryPair));
        let by_causes = written.causes.first().map(|(span, _)| (*span, "no new cause"));
        let by_causes = by_causes.or(written.pairs.first().map(|(span, ())| (*span, "every pair")));
        if let Some((span, word)) = by_causes
            && self.without_requirements(campaign)
        {
            let title = format!("`{word}` needs a requirement, whose causes are counted");
            let diagnostic = Diagnostic::new(Code::NOTHING_TO_EXPLORE, span, title);
            self.report(diagnostic.label("add a `requirement`"));
            return None;
        }
        if let (Some((span, ())), Some(operations)) = (written.pairs.first(), campaign.operations.first())
            && operations.max.value.is_some_and(|max| max < 2)
        {
            let title = "`every pair` needs tests with at least two operations";
            let diagnostic = Diagnostic::new(Code::OUT_OF_RANGE, *span, title).label("no test holds a pair");
            self.report(diagnostic.secondary(operations.max.span, "no test holds more than this"));
            return None;
        }
        let by_cells = written.discoveries.first().map(|(span, _)| (*span, "discovery"));
        let by_cells = by_cells.or(written.completenesses.first().map(|(span, _)| (*span, "completeness")));
        if let Some((span, word)) = by_cells
            && campaign.coverages.is_empty()
            && !campaign.searches.is_empty()
            && !campaign.inherited_errors
        {
            let diagnostic = Diagnostic::new(Code::NOTHING_TO_EXPLORE, span, format!("`{word}` needs a `coverage`"));
            self.report(diagnostic.label("add a `coverage`, whose cells are counted"));
            return None;
        }
        let rules = [time, stagnation, discovery, completeness, causes, pairs];
        let none = rules.iter().all(Option::is_none);
        if none && !written.has_errors {
            let diagnostic = Diagnostic::new(Code::CLAUSE_MISSING, written.span, "`stop` needs at least one rule")
                .label("add a rule that says when the search stops")
                .note("for example `time 2h  stagnation 10 generations below 1%`");
            self.report(diagnostic);
            return None;
        }
        rules.into_iter().flatten().collect()
    }

    fn wall_time(&mut self, quantity: &ast::Quantity) -> Option<StopRule> {
        let title = "the time limit of a search must be greater than 0s";
        let seconds = self.above_zero(quantity, &Unit::seconds(), "the time limit of a search", title)?;
        Some(StopRule::WallTime { seconds })
    }
}
