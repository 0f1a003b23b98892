//! What a plan means, without what it says to people only.

use crate::{
    Campaign, CampaignPlan, Demand, Evidence, Field, Guarantee, KnownTest, MessageType, Metric, Monitor, Node,
    Operation, Requirement, SafeState, Topic,
};

impl CampaignPlan {
    /// The plan without what it says to people only: doc comments, the sentences of requirements, where things are
    /// declared, and by which generator; and without labs, which change nothing of what a campaign does. These parts
    /// are empty in what is returned.
    ///
    /// Two plans with equal meanings are the same campaign: digests are over meanings, and
    /// [same models](CampaignPlan::same_model) are told by them.
    #[must_use]
    pub fn meaning(&self) -> CampaignPlan {
        let mut meaning = self.clone();
        forget_what_is_for_people(&mut meaning);
        meaning
    }

    /// Whether a test does the same with both plans: whether they disturb and measure alike. What is searched for,
    /// which tests are recorded, regression tests, and all that is [for people](CampaignPlan::meaning) make no
    /// difference to that.
    #[must_use]
    pub fn same_model(&self, other: &CampaignPlan) -> bool {
        self.model_difference(other).is_none()
    }

    /// The first part of the later plan that makes it [another model](CampaignPlan::same_model), in words; `None` if
    /// it is the same model.
    #[must_use]
    pub fn model_difference(&self, later: &CampaignPlan) -> Option<String> {
        let [mut before, mut now] = [self.meaning(), later.meaning()];
        align_what_no_test_depends_on(&mut before, &mut now);
        if before == now {
            return None;
        }
        let parts = [
            difference("message", &before.messages, &now.messages, |message| &message.name),
            difference("topic", &before.topics, &now.topics, |topic| &topic.name),
            difference("node", &before.nodes, &now.nodes, |node| &node.name),
            difference("metric", &before.metrics, &now.metrics, |metric| &metric.name),
            difference("operation", &before.operations, &now.operations, |operation| &operation.name),
            difference("requirement", &before.requirements, &now.requirements, |requirement| &requirement.name),
            difference("monitor", &before.monitors, &now.monitors, |monitor| &monitor.name),
            (before.simulator != now.simulator).then(|| format!("simulator `{}` has changed", now.simulator.name)),
            (before.campaign != now.campaign).then(|| format!("campaign `{}` has changed", now.campaign.name)),
        ];
        // What is left are the space's name and the schema.
        Some(parts.into_iter().flatten().next().unwrap_or_else(|| format!("space `{}` has changed", now.space)))
    }
}

/// The first difference of two lists of things with names.
fn difference<T: PartialEq>(kind: &str, before: &[T], now: &[T], name: impl Fn(&T) -> &str) -> Option<String> {
    let has = |list: &[T], wanted: &T| list.iter().any(|one| name(one) == name(wanted));
    if let Some(removed) = before.iter().find(|one| !has(now, one)) {
        return Some(format!("{kind} `{}` was removed", name(removed)));
    }
    if let Some(added) = now.iter().find(|one| !has(before, one)) {
        return Some(format!("{kind} `{}` was added", name(added)));
    }
    let (_, changed) = before.iter().zip(now).find(|(before, now)| before != now)?;
    let moved = before.iter().any(|before| before == changed);
    Some(format!("{kind} `{}` has {}", name(changed), if moved { "moved" } else { "changed" }))
}

/// Every field is named here, so that nobody adds one without a decision.
fn forget_what_is_for_people(plan: &mut CampaignPlan) {
    let CampaignPlan {
        schema: _,
        generator,
        source,
        space: _,
        doc,
        simulator: _,
        messages,
        topics,
        nodes,
        metrics,
        requirements,
        operations,
        tests,
        campaign,
        monitors,
        labs,
        compensation: _,
    } = plan;
    for text in [generator, source, doc] {
        text.clear();
    }
    // Nothing of a campaign depends on what is done with its results.
    labs.clear();
    for MessageType { name: _, doc, fields, constants } in messages {
        constants.clear();
        doc.clear();
        for Field { name: _, doc, ty: _, optional: _ } in fields {
            doc.clear();
        }
    }
    for Topic { name: _, doc, paths: _, members, ty: _, interface: _, channel: _ } in topics {
        doc.clear();
        members.clear();
    }
    for Node { name: _, doc, publishes: _, subscribes: _, named: _, launch: _, answers: _, every_step: _ } in nodes {
        doc.clear();
    }
    for metric in metrics {
        let Metric {
            name: _,
            doc,
            unit: _,
            direction: _,
            default: _,
            initial: _,
            source: _,
            trend: _,
            accepts_not_finite: _,
            line,
        } = metric;
        doc.clear();
        *line = 0;
    }
    for Requirement { name: _, text, metric: _, bound: _ } in requirements {
        text.clear();
    }
    for operation in operations {
        let Operation {
            name: _,
            doc,
            topic: _,
            further: _,
            members: _,
            from: _,
            to: _,
            places: _,
            kind: _,
            parameters: _,
            within: _,
            priority: _,
            inclusion: _,
            timed: _,
            constraints: _,
            lengths: _,
            counted: _,
            wrapped: _,
        } = operation;
        doc.clear();
    }
    monitors.iter_mut().for_each(forget_in_monitor);
    for KnownTest { name: _, doc, test: _, expectations: _, simulator_seed: _ } in tests {
        doc.clear();
    }
    let Campaign {
        name: _,
        doc,
        objectives: _,
        operations: _,
        count: _,
        copies: _,
        activation: _,
        search: _,
        coverage: _,
        exploration: _,
        confirm: _,
        neighbours: _,
        stop: _,
        seed: _,
        end_after: _,
        end_when: _,
        record: _,
        describes_when: _,
    } = campaign;
    doc.clear();
}

fn forget_in_monitor(monitor: &mut Monitor) {
    let Monitor { name: _, doc, publishes: _, demands, evidence, guarantees, otherwise, line } = monitor;
    doc.clear();
    *line = 0;
    for Demand { name: _, monitor: _, guarantee: _ } in demands {}
    for Evidence { name: _, doc, inputs: _, condition: _, held: _, stale: _, side: _ } in evidence {
        doc.clear();
    }
    for Guarantee { name: _, doc, integrity: _, gate: _ } in guarantees {
        doc.clear();
    }
    let SafeState { name: _, doc, mitigation: _ } = otherwise;
    doc.clear();
}

/// Gives both plans the same of what decides which tests are run, and not what a test does.
fn align_what_no_test_depends_on(one: &mut CampaignPlan, other: &mut CampaignPlan) {
    one.tests.clone_from(&other.tests);
    // Results say with which one they were recorded, and a test is run again with the same.
    one.compensation.clone_from(&other.compensation);
    let Campaign {
        name: _,
        doc: _,
        objectives,
        operations: _,
        count: _,
        copies: _,
        activation: _,
        search,
        coverage,
        exploration,
        confirm,
        neighbours,
        stop,
        seed,
        end_after: _,
        end_when: _,
        record,
        describes_when,
    } = &mut one.campaign;
    let campaign = &other.campaign;
    objectives.clone_from(&campaign.objectives);
    search.clone_from(&campaign.search);
    coverage.clone_from(&campaign.coverage);
    exploration.clone_from(&campaign.exploration);
    *confirm = campaign.confirm;
    *neighbours = campaign.neighbours;
    stop.clone_from(&campaign.stop);
    *seed = campaign.seed;
    *record = campaign.record;
    *describes_when = campaign.describes_when;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{
        evidence_above, guarantee, known_test, lab, metric, monitor, node, operation, plan, requirement,
    };
    use crate::{
        Bound, CoverageGoal, Dimension, Gate, GridAxis, MetricId, MetricSource, OperationKind, Recorded, Task, Test,
    };

    fn whole() -> CampaignPlan {
        CampaignPlan {
            nodes: vec![node("arm")],
            requirements: vec![
                requirement("R1", 1, Bound::AtMost { value: 1.0 }),
                requirement("R2", 0, Bound::Below { value: 9.0 }),
            ],
            tests: vec![known_test("known", Test::default())],
            monitors: vec![monitor(
                "transport",
                0,
                vec![evidence_above("ok", 0, 1.0)],
                vec![guarantee("safe", 1, Gate::Evidence(0))],
            )],
            ..plan(vec![operation(0, OperationKind::Bias), operation(1, OperationKind::Blackhole)])
        }
    }

    #[test]
    fn what_is_only_for_people_is_not_part_of_the_meaning() {
        let plan = whole();
        let changes: [fn(&mut CampaignPlan); 20] = [
            |plan| plan.generator = "sesamec 9.9.9".to_owned(),
            |plan| plan.source = "moved.sesame".to_owned(),
            |plan| plan.doc = "Corrected.".to_owned(),
            |plan| plan.messages[0].doc = "Corrected.".to_owned(),
            |plan| plan.messages[0].fields[1].doc = "Corrected.".to_owned(),
            |plan| plan.topics[1].doc = "Corrected.".to_owned(),
            |plan| plan.topics[1].members.push("other".to_owned()),
            |plan| plan.nodes[0].doc = "Corrected.".to_owned(),
            |plan| plan.metrics[1].doc = "Corrected.".to_owned(),
            |plan| plan.metrics[1].line += 7,
            |plan| plan.requirements[1].text = "Corrected.".to_owned(),
            |plan| plan.operations[1].doc = "Corrected.".to_owned(),
            |plan| plan.tests[0].doc = "Corrected.".to_owned(),
            |plan| plan.campaign.doc = "Corrected.".to_owned(),
            |plan| plan.labs.push(lab("lab")),
            |plan| plan.monitors[0].doc = "Corrected.".to_owned(),
            |plan| plan.monitors[0].line += 7,
            |plan| plan.monitors[0].evidence[0].doc = "Corrected.".to_owned(),
            |plan| plan.monitors[0].guarantees[0].doc = "Corrected.".to_owned(),
            |plan| plan.monitors[0].otherwise.doc = "Corrected.".to_owned(),
        ];
        for (at, change) in changes.into_iter().enumerate() {
            let mut changed = plan.clone();
            change(&mut changed);
            assert_ne!(changed, plan, "change {at}");
            assert_eq!(changed.meaning(), plan.meaning(), "change {at}");
            assert!(changed.same_model(&plan) && plan.same_model(&changed), "change {at}");
        }
    }

    #[test]
    fn what_is_run_may_change_but_not_what_is_disturbed_or_measured() {
        let plan = whole();
        let changed = |change: fn(&mut CampaignPlan)| {
            let mut changed = plan.clone();
            change(&mut changed);
            assert_ne!(changed.meaning(), plan.meaning());
            assert_eq!(plan.same_model(&changed), changed.same_model(&plan));
            plan.same_model(&changed)
        };
        assert!(changed(|plan| plan.tests.clear()));
        assert!(changed(|plan| plan.campaign.objectives.push(MetricId(0))));
        assert!(changed(|plan| plan.campaign.search.set_evaluations(7)));
        assert!(changed(|plan| plan.campaign.seed += 1));
        assert!(changed(|plan| plan.campaign.record = Some(Recorded::All)));
        assert!(changed(|plan| {
            let axes = vec![GridAxis { dimension: Dimension::T1, low: 0.0, high: 1.0, cells: 6 }];
            plan.campaign.coverage = Some(CoverageGoal { axes, hits: 1, stop_at: None });
        }));
        // What a command does instead of the campaign changes nothing of the model, so that `resume` goes on with it.
        assert!(Task::Known { tests: Vec::new(), lab: None }.plan(&plan).same_model(&plan));
    }

    #[test]
    fn the_part_that_makes_another_model_is_named() {
        let plan = whole();
        let difference = |change: fn(&mut CampaignPlan)| {
            let mut changed = plan.clone();
            change(&mut changed);
            assert!(!plan.same_model(&changed) && !changed.same_model(&plan));
            plan.model_difference(&changed).unwrap_or_default()
        };
        assert_eq!(difference(|plan| plan.metrics[0].default = Some(1.0)), "metric `fuzzing_time` has changed");
        assert_eq!(difference(|plan| plan.operations[1].within.end += 1.0), "operation `blackhole` has changed");
        assert_eq!(difference(|plan| plan.operations.swap(0, 1)), "operation `blackhole` has moved");
        assert_eq!(difference(|plan| plan.requirements.truncate(1)), "requirement `R2` was removed");
        let further = metric("further", MetricSource::FuzzingTime);
        let added = CampaignPlan { metrics: [&plan.metrics[..], &[further]].concat(), ..plan.clone() };
        assert_eq!(plan.model_difference(&added).unwrap(), "metric `further` was added");
        assert_eq!(difference(|plan| plan.nodes.clear()), "node `arm` was removed");
        assert_eq!(difference(|plan| plan.topics[0].paths.clear()), "topic `command` has changed");
        assert_eq!(difference(|plan| plan.messages[0].fields.clear()), "message `Zone` has changed");
        assert_eq!(difference(|plan| plan.monitors[0].evidence[0].held = 1.0), "monitor `transport` has changed");
        assert_eq!(difference(|plan| plan.monitors.clear()), "monitor `transport` was removed");
        assert_eq!(difference(|plan| plan.simulator.name.push('2')), "simulator `sim2` has changed");
        assert_eq!(difference(|plan| plan.campaign.end_after += 1.0), "campaign `campaign` has changed");
        assert_eq!(difference(|plan| plan.space.push('2')), "space `test2` has changed");
    }
}
