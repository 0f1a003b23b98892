//! What a correct space should be warned of.

use crate::diagnostic::{Code, Diagnostic};
use crate::model::{Id as _, MetricSource, OperationId, Search, Space};

/// Warnings about a space without errors.
pub(crate) fn check(space: &Space) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    unused_operations(space, &mut diagnostics);
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

fn unused_operations(space: &Space, diagnostics: &mut Vec<Diagnostic>) {
    let mut used = vec![false; space.operations.len()];
    let mut mark = |id: OperationId| used[id.index()] = true;
    for campaign in space.campaigns.values() {
        if let Search::Nsga2 { content, .. } | Search::Random { content, .. } = &campaign.search {
            content.operations.iter().copied().for_each(&mut mark);
        }
    }
    space.tests.values().flat_map(|test| &test.operations).for_each(|operation| mark(operation.operation));
    for (id, operation) in space.operations.iter().filter(|(id, _)| !used[id.index()]) {
        debug_assert_eq!(space.operations[id].declaration.name, operation.declaration.name);
        let title = format!("operation `{}` is never used", operation.declaration.name);
        diagnostics.push(
            Diagnostic::new(Code::UNUSED_OPERATION, operation.declaration.span, title)
                .label("in no campaign and no known test"),
        );
    }
}

fn objectives_without_default(space: &Space, diagnostics: &mut Vec<Diagnostic>) {
    for (id, metric) in space.metrics.iter() {
        let objective = space.campaigns.values().any(|campaign| campaign.objectives.contains(&id));
        if objective && metric.default.is_none() && metric.source != MetricSource::FuzzingTime {
            let name = &metric.declaration.name;
            let title = format!("objective `{name}` may stay without a value");
            let diagnostic = Diagnostic::new(Code::OBJECTIVE_WITHOUT_DEFAULT, metric.declaration.span, title);
            diagnostics.push(diagnostic.label("a test in which it is never set counts as unmeasured: add a `default`"));
        }
    }
}
