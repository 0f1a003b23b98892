//! What is known of a metric after a run that broke off, by the words of the documentation.

use std::collections::BTreeSet;

use sesame_plan::{CampaignPlan, Input, Metric, MetricSource};

use crate::computations::When;
use crate::formulas::heard;
use crate::ledger::{Ledger, Message};

/// The messages that count for a metric after a run that broke off at the end of this ledger, and up to when they do.
/// Nobody knows whether the last instant was over, so it counts only for what needs no whole instant, or if all spoke
/// in it who had spoken in each earlier one.
pub(crate) fn known(plan: &CampaignPlan, metric: &Metric, ledger: &Ledger) -> Ledger {
    let counts = needs_no_whole_instant(plan, metric) || is_over(plan, metric, ledger);
    let kept = |messages: &[Message]| -> Vec<Message> {
        messages.iter().filter(|message| counts || message.time < ledger.end).cloned().collect()
    };
    let (published, delivered) = (kept(&ledger.published), kept(&ledger.delivered));
    // What was heard last holds until something new is heard, which was not before the end of the run.
    Ledger { published, delivered, steps: ledger.end - 1, ..ledger.clone() }
}

fn needs_no_whole_instant(plan: &CampaignPlan, metric: &Metric) -> bool {
    match &metric.source {
        MetricSource::Formula { formula } => When::of(plan, formula) == When::Message,
        MetricSource::Robustness { .. } => false,
        _ => true,
    }
}

/// Whether the last instant of a run that broke off counts as over for a metric that needs whole instants.
pub(crate) fn is_over(plan: &CampaignPlan, metric: &Metric, ledger: &Ledger) -> bool {
    let inputs = match &metric.source {
        MetricSource::Formula { formula } => &formula.inputs,
        MetricSource::Robustness { robustness } => &robustness.inputs,
        _ => return false,
    };
    !needs_no_whole_instant(plan, metric) && is_complete(plan, inputs, heard(metric, ledger), ledger.end)
}

/// Whether every wire spoke at an instant that had spoken at each earlier instant at which any of them did.
fn is_complete(plan: &CampaignPlan, inputs: &[Input], messages: &[Message], instant: i64) -> bool {
    let wires: BTreeSet<&String> = inputs.iter().flat_map(|input| &plan.topic(input.field.topic).paths).collect();
    let spoken: BTreeSet<(i64, &String)> = messages
        .iter()
        .filter(|message| wires.contains(&message.path))
        .map(|message| (message.time, &message.path))
        .collect();
    let earlier: BTreeSet<i64> = spoken.iter().map(|message| message.0).filter(|&time| time < instant).collect();
    wires
        .iter()
        .all(|&wire| spoken.contains(&(instant, wire)) || earlier.iter().any(|&time| !spoken.contains(&(time, wire))))
}
