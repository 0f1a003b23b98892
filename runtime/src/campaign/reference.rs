//! What the reference run, without any disturbance, says about a campaign before and after its search.

use std::collections::BTreeSet;
use std::fmt;

use sesame_base::observation::Observation;
use sesame_plan::{CampaignPlan, OperationId, Task, Test};
use sesame_relay::wire::WireTable;
use sesame_results::record::{Difference, Verdict, differences, verdict};

/// An operation on a topic that nothing in the system receives, or of whose members nothing receives some.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unheard {
    operation: String,
    topic: String,
    /// The wires without a receiver.
    paths: Vec<String>,
    /// How many wires the topic has.
    of: usize,
}

impl Unheard {
    /// Whether no wire of its topic has a receiver.
    pub(super) fn wholly(&self) -> bool {
        self.paths.len() == self.of
    }
}

impl fmt::Display for Unheard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Unheard { operation, topic, paths, .. } = self;
        let named = paths.iter().map(|path| format!("`{path}`")).collect::<Vec<_>>().join(", ");
        if self.wholly() {
            write!(
                f,
                "nothing receives what operation `{operation}` disturbs: the simulator does not subscribe to its topic \
                 `{topic}` ({named}), and no outbound metric and no monitor reads it"
            )
        } else {
            write!(
                f,
                "nothing receives what operation `{operation}` disturbs on {named}: of topic `{topic}`, the simulator \
                 subscribes to other members only"
            )
        }
    }
}

/// The operations that tests of this campaign may hold and whose messages had no receiver, wholly or in part, in its
/// reference run.
pub(super) fn unheard(plan: &CampaignPlan, task: &Task, reference: &Observation) -> Vec<Unheard> {
    let of_test = |test: &Test| -> Vec<OperationId> { test.operations.iter().map(|used| used.operation).collect() };
    let operations: BTreeSet<OperationId> = match (task, task.repeated(plan)) {
        (_, Some(repeated)) => of_test(repeated.test).into_iter().collect(),
        (Task::Known { tests, .. }, _) => tests.iter().flat_map(|&id| of_test(&plan.test(id).test)).collect(),
        (Task::Shrink(shrinking), _) => of_test(&shrinking.test).into_iter().collect(),
        (Task::Variations(variations), _) => variations.tests.iter().flat_map(of_test).collect(),
        (Task::Undisturbed(_), _) => BTreeSet::new(),
        (Task::Lab(lab) | Task::Compensated(lab), _) => lab.tests.iter().flat_map(|it| of_test(&it.test)).collect(),
        (Task::Campaign | Task::Repeat { .. }, _) => plan.campaign.operations.iter().copied().collect(),
    };
    let found = operations.into_iter().filter_map(|id| {
        let operation = plan.operation(id);
        let topic = plan.topic(operation.topic?);
        let wires = WireTable::new(plan);
        let acted_on: Vec<&str> = wires.acted_on(operation).map(|wire| wires.path(wire)).collect();
        let of = acted_on.len();
        let paths = acted_on.into_iter().filter(|path| reference.unheard.iter().any(|unheard| unheard == path));
        let paths = paths.map(str::to_owned).collect();
        let unheard = Unheard { operation: operation.name.clone(), topic: topic.name.clone(), paths, of };
        (!unheard.paths.is_empty()).then_some(unheard)
    });
    found.collect()
}

/// Whether a run violates a requirement.
pub(super) fn violates(plan: &CampaignPlan, observation: &Observation) -> bool {
    plan.requirements.iter().any(|requirement| {
        let value = observation.value(requirement.metric);
        verdict(requirement.bound, &observation.outcome, value) == Verdict::Violated
    })
}

/// The requirements that the system violates without any disturbance, each in a sentence.
pub(super) fn violations(plan: &CampaignPlan, reference: &Observation) -> Vec<String> {
    let violated = plan.requirements.iter().filter_map(|requirement| {
        let value = reference.value(requirement.metric);
        (verdict(requirement.bound, &reference.outcome, value) == Verdict::Violated).then(|| {
            let name = &plan.metric(requirement.metric).name;
            let value = value.value.map_or_else(|| "no value".to_owned(), |value| value.to_string());
            format!("requirement {} is violated before anything is fuzzed: `{name}` is {value}", requirement.name)
        })
    });
    violated.collect()
}

/// What two reference runs of one campaign differ in, in a sentence: equal seeds must give equal runs.
pub(super) fn difference(plan: &CampaignPlan, first: &Observation, last: &Observation) -> Option<String> {
    let differing = differences(plan, &Test::default(), first, last);
    differing.first().map(|Difference { what, before, after }| {
        format!(
            "the reference run after the campaign differs from the one before it: {what} was {before} and is {after}; \
             the simulator does not start afresh for each test"
        )
    })
}

#[cfg(test)]
mod tests {
    use sesame_results::record::sample;

    use super::*;
    use crate::campaign::error::CampaignError;

    #[test]
    fn an_operation_without_a_receiver_is_named_and_a_group_has_one_if_a_member_has() {
        let plan = sample::plan();
        let heard = |unheard: &[&str]| {
            let mut reference = sample::observe(&plan, &Test::default(), 1);
            reference.unheard = unheard.iter().map(|&path| path.to_owned()).collect();
            super::unheard(&plan, &Task::Campaign, &reference)
        };
        assert_eq!(heard(&[]), []);
        let operation = plan.operation(plan.campaign.operations[0]);
        let topic = plan.topic(operation.topic.unwrap());
        let paths: Vec<&str> = topic.paths.iter().map(String::as_str).collect();
        let found = heard(&paths);
        assert!(found[0].wholly());
        let message = CampaignError::Unheard(found.clone()).to_string();
        for part in [&operation.name, &topic.name, &topic.paths[0], "--allow-unheard"] {
            assert!(message.contains(part), "{message}");
        }
        let partly = Unheard { of: paths.len() + 1, ..found[0].clone() };
        assert!(!partly.wholly() && partly.to_string().contains("other members only"));
        let known = Task::Known { tests: Vec::new(), lab: None };
        let mut reference = sample::observe(&plan, &Test::default(), 1);
        reference.unheard = topic.paths.clone();
        assert_eq!(super::unheard(&plan, &known, &reference), [], "only what is to be run counts");
    }
}
