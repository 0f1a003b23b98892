//! Warnings about a space without errors.

mod system;
mod unused;

use crate::diagnostic::{Code, Diagnostic};
use crate::model::{MetricSource, Space};
use crate::span::FileId;

/// Warnings about a space without errors. Unused declarations are only reported in the file itself: a file that several
/// spaces import contains more than each of them uses.
pub(crate) fn check(space: &Space, root: FileId) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    unused::operations(space, root, &mut diagnostics);
    unused::metrics(space, root, &mut diagnostics);
    unused::topics(space, root, &mut diagnostics);
    unused::evidence(space, &mut diagnostics);
    system::misnamed_operations(space, &mut diagnostics);
    system::two_publishers(space, &mut diagnostics);
    system::unheard_operations(space, &mut diagnostics);
    objectives_without_default(space, &mut diagnostics);
    if space.campaigns.is_empty() {
        let title = format!("space `{}` has no campaign", space.declaration.name);
        diagnostics.push(
            Diagnostic::new(Code::NO_CAMPAIGN, space.declaration.span, title)
                .label("there is nothing to generate or run"),
        );
    }
    diagnostics
}

fn objectives_without_default(space: &Space, diagnostics: &mut Vec<Diagnostic>) {
    for (id, metric) in space.metrics.iter() {
        let objective = space.campaigns.values().any(|campaign| campaign.objectives.contains(&id));
        let always = match &metric.source {
            MetricSource::FuzzingTime => true,
            MetricSource::Monitor(_, score) => score.always_has_a_value(),
            _ => false,
        };
        if objective && metric.default.is_none() && !always {
            let name = &metric.declaration.name;
            let title = format!("objective `{name}` has no default");
            let diagnostic = Diagnostic::new(Code::OBJECTIVE_WITHOUT_DEFAULT, metric.declaration.span, title);
            diagnostics.push(diagnostic.label("a test that never sets it counts as unmeasured; add a `default`"));
        }
    }
}
