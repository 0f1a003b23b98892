//! Windows and ranges of a file that its space cannot have: results keep them, so that points by the formulas of the
//! original are measured in them.

use std::collections::BTreeMap;

use sesame_plan::{CampaignPlan, Domain, OperationId, Span};
use sesame_record::OriginalExtent;

use crate::original::{self, Activation, Operation, OperationKind};
use crate::parts::{Effect, Part};
use crate::writer::Mapped;

/// What is less than this is rounding, and no other window or range.
const SAME: f64 = 1e-9;

/// The operations of a plan whose windows or ranges are others in the file.
pub(crate) fn original(
    mapped: &Mapped,
    plan: &CampaignPlan,
    operations: &BTreeMap<&str, OperationId>,
) -> Vec<OriginalExtent> {
    let mut found = Vec::new();
    for (template, parts) in mapped.holders.operations.iter().zip(&mapped.parts) {
        for part in parts {
            // What is called before the start has no window.
            let offline = matches!(part.effect, Effect::Custom { offline: true, .. });
            let Some(&operation) = operations.get(part.name.as_str()).filter(|_| !offline) else { continue };
            let permitted = plan.operation(operation);
            let within = (permitted.within.start, permitted.within.end);
            let window = window(template).filter(|window| differ((window.start, window.end), within));
            let planned = permitted.parameters.first().and_then(|parameter| match parameter.domain {
                Domain::Number { low, high, .. } => Some((low, high)),
                _ => None,
            });
            let range = range(template, part).filter(|&range| planned.is_some_and(|planned| differ(range, planned)));
            if window.is_some() || range.is_some() {
                found.push(OriginalExtent { operation, window, range });
            }
        }
    }
    found
}

/// The window of an operation of the file, its earlier end first.
fn window(template: &Operation) -> Option<Span> {
    let Activation::Time(start, end) = template.activation else { return None };
    Some(Span { start: start.min(end), end: start.max(end) })
}

/// The range of what a part draws or chooses, its lower end first. Parameters of custom operations are no part of the
/// original's points.
fn range(template: &Operation, part: &Part) -> Option<(f64, f64)> {
    let (one, other) = match (&part.effect, &template.kind) {
        (&Effect::Value { set, .. }, OperationKind::RandomValue { values, .. }) => match values.get(set)?.domain {
            original::Domain::Reals(low, high) => (low, high),
            original::Domain::Integers(low, high) => (low as f64, high as f64),
            _ => return None,
        },
        (Effect::Loss, OperationKind::PacketLoss { keep }) => (1.0 - keep.0, 1.0 - keep.1),
        (Effect::Delay { .. }, OperationKind::Latency { delay, .. }) => *delay,
        _ => return None,
    };
    Some((one.min(other), one.max(other)))
}

fn differ(one: (f64, f64), other: (f64, f64)) -> bool {
    (one.0 - other.0).abs() > SAME || (one.1 - other.1).abs() > SAME
}
