//! How a campaign confirms what it finds, and how its search averages over neighbours.

use super::Resolver;
use crate::diagnostic::{Code, Diagnostic};
use crate::model::{Averaging, Confirmation, Statistic};
use crate::syntax::ast;

impl<'a> Resolver<'a> {
    /// The campaign's confirmation. The outer `None` means that it has mistakes.
    #[expect(clippy::option_option, reason = "the outer `None` means a mistake, the inner is the model's")]
    pub(super) fn confirm(&mut self, campaign: &'a ast::Campaign) -> Option<Option<Confirmation>> {
        let spans: Vec<_> = campaign.confirms.iter().map(|confirm| confirm.span).collect();
        self.at_most_one(&spans, "confirm");
        let Some(written) = campaign.confirms.first() else { return Some(None) };
        let times = self.count(written.times, 1, "the number of confirming runs");
        let by = match self.single(&written.by, "by") {
            None | Some(ast::Typical::Mean) => Some(Statistic::Mean),
            Some(ast::Typical::Median) => Some(Statistic::Median),
            Some(ast::Typical::Quantile(share)) => {
                self.share(share, "the share of a quantile").map(|share| Statistic::Quantile { share })
            }
        };
        let violations = self.single(&written.violations, "violations").is_some();
        if let Some((span, ())) = written.violations.first()
            && self.without_requirements(campaign)
        {
            let title = "`violations` needs a `requirement`";
            self.report(
                Diagnostic::new(Code::NOTHING_TO_EXPLORE, *span, title)
                    .label("add a `requirement` whose violations can be confirmed"),
            );
            return None;
        }
        Some(Some(Confirmation { times: times?, by: by?, violations }))
    }

    /// The number of neighbours that the search averages over. The outer `None` means that it has mistakes.
    #[expect(clippy::option_option, reason = "the outer `None` means a mistake, the inner is the model's")]
    pub(super) fn neighbours(&mut self, search: &'a ast::Search) -> Option<Option<u32>> {
        let Some(&count) = self.single(&search.neighbours, "neighbours") else { return Some(None) };
        let properties = search.strategy?.properties();
        let note = match properties.averaging {
            Averaging::Possible => return self.count(count, 1, "the number of neighbours").map(Some),
            Averaging::LearnsNothing => "its tests do not depend on the results of earlier ones",
            Averaging::ByItself => "its model of the distance to a violation already accounts for noise",
        };
        let title = format!("{} has no setting `neighbours`", properties.noun);
        let diagnostic =
            Diagnostic::new(Code::UNKNOWN_NAME, search.neighbours[0].0, title).label("remove this").note(note);
        self.report(diagnostic);
        None
    }
}
