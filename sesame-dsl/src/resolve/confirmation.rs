//! How a campaign confirms what it finds, and how its search is told of it.

use super::Resolver;
use crate::diagnostic::{Code, Diagnostic};
use crate::model::{Confirmation, Statistic};
use crate::syntax::ast::{self, Strategy};

impl<'a> Resolver<'a> {
    /// The campaign's confirmation. The outer `None` says that it is not in order.
    #[expect(clippy::option_option, reason = "the outer says whether it was in order, the inner is the model's")]
    pub(super) fn confirm(&mut self, campaign: &'a ast::Campaign) -> Option<Option<Confirmation>> {
        let spans: Vec<_> = campaign.confirms.iter().map(|confirm| confirm.span).collect();
        self.at_most_one(&spans, "confirm");
        let Some(written) = campaign.confirms.first() else { return Some(None) };
        let times = self.count(written.times, 1, "a test is confirmed by being repeated");
        let by = match self.single(&written.by, "by") {
            None | Some(ast::Typical::Mean) => Some(Statistic::Mean),
            Some(ast::Typical::Median) => Some(Statistic::Median),
            Some(ast::Typical::Quantile(share)) => {
                self.share(share, "the share of a quantile").map(|share| Statistic::Quantile { share })
            }
        };
        let violations = self.single(&written.violations, "violations").is_some();
        if let Some((span, ())) = written.violations.first().filter(|_| !campaign.unread)
            && self.file.requirements.is_empty()
        {
            let title = "there is no requirement whose violations could be confirmed";
            self.report(Diagnostic::new(Code::NOTHING_TO_EXPLORE, *span, title).label("add a `requirement`"));
            return None;
        }
        Some(Some(Confirmation { times: times?, by: by?, violations }))
    }

    /// Over how many neighbours the search averages. The outer `None` says that it is not in order.
    #[expect(clippy::option_option, reason = "the outer says whether it was in order, the inner is the model's")]
    pub(super) fn neighbours(&mut self, search: &'a ast::Search) -> Option<Option<u32>> {
        let Some(&count) = self.single(&search.neighbours, "neighbours") else { return Some(None) };
        let learns_nothing = "what came of its tests changes nothing that it does";
        let (strategy, note) = match search.strategy? {
            Strategy::Random => ("random search", learns_nothing),
            Strategy::LatinHypercube => ("Latin hypercube", learns_nothing),
            Strategy::Sobol => ("Sobol search", learns_nothing),
            Strategy::Falsification => (
                "falsification",
                "it goes by how far requirements are from their violation, and tells noise from that itself",
            ),
            Strategy::Nsga2 | Strategy::MapElites => {
                return self.count(count, 1, "a search averages over").map(Some);
            }
        };
        let title = format!("a {strategy} has no setting `neighbours`");
        let diagnostic =
            Diagnostic::new(Code::UNKNOWN_NAME, search.neighbours[0].0, title).label("leave it out").note(note);
        self.report(diagnostic);
        None
    }
}
