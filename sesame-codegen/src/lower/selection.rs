//! What of a space is in the plan of a campaign, and the parts of the plan that refer to it: the campaign, requirements
//! and tests.

use sesame_dsl::model::{self, Space};
use sesame_plan as plan;

use super::operation::{operation, within};

/// The parts of a space that are in a campaign's plan, in declaration order: a position here is the id there.
pub(super) struct Selection {
    pub(super) metrics: Vec<model::MetricId>,
    pub(super) operations: Vec<model::OperationId>,
    pub(super) tests: Vec<model::TestId>,
}

impl Selection {
    pub(super) fn of(space: &Space, campaign: &model::Campaign) -> Self {
        let mut operations: Vec<model::OperationId> = match &campaign.search {
            model::Search::Strategy { template, .. } => template.operations.clone(),
            model::Search::Repeat { test, .. } => {
                space.tests[*test].operations.iter().map(|operation| operation.operation).collect()
            }
            model::Search::Passive { .. } => Vec::new(),
        };
        operations.sort();
        operations.dedup();
        let begins = |operation: &model::TestOperation| match &operation.activation {
            model::Activation::Window(window) => window.low,
            model::Activation::Offline => 0.0,
            model::Activation::Condition { .. } => {
                space.operations[operation.operation].within.map_or(0.0, |within| within.low)
            }
        };
        let fits = |test: &model::Test| {
            test.operations
                .iter()
                .all(|operation| operations.contains(&operation.operation) && begins(operation) < campaign.end_after)
        };
        let tests: Vec<model::TestId> = space.tests.iter().filter(|(_, test)| fits(test)).map(|(id, _)| id).collect();
        // A test holds an operation at least, so a campaign that only observes has none of them.
        let mut metrics: Vec<model::MetricId> = campaign.objectives.clone();
        metrics.extend(&campaign.observed);
        metrics.extend(space.requirements.values().map(|requirement| requirement.metric));
        metrics.extend(
            condition_space(campaign)
                .into_iter()
                .flat_map(|conditions| &conditions.variables)
                .map(|variable| variable.metric),
        );
        for operation in tests.iter().flat_map(|&test| &space.tests[test].operations) {
            operation.activation.conditions().for_each(|condition| condition.metrics_into(&mut metrics));
        }
        let expectations = tests.iter().flat_map(|&test| &space.tests[test].expectations);
        metrics.extend(expectations.map(|expectation| expectation.metric));
        space.physicals.values().for_each(|lab| lab.metrics_into(&mut metrics));
        campaign.end_when.iter().for_each(|condition| condition.metrics_into(&mut metrics));
        metrics.sort();
        metrics.dedup();
        Selection { metrics, operations, tests }
    }

    pub(super) fn metric(&self, id: model::MetricId) -> plan::MetricId {
        plan::MetricId(position(&self.metrics, id))
    }

    fn operation(&self, id: model::OperationId) -> plan::OperationId {
        plan::OperationId(position(&self.operations, id))
    }

    /// An operation, with its constraints where conditions are grown: elsewhere they say nothing.
    pub(super) fn operation_of(&self, declared: &model::Operation, campaign: &model::Campaign) -> plan::Operation {
        let constraints = match condition_space(campaign) {
            Some(_) => declared.constraints.iter().map(|constraint| self.constraint(constraint)).collect(),
            None => Vec::new(),
        };
        operation(declared, campaign.end_after, constraints)
    }

    pub(super) fn requirement(&self, requirement: &model::Requirement) -> plan::Requirement {
        plan::Requirement {
            name: requirement.declaration.name.clone(),
            text: requirement.text.clone(),
            metric: self.metric(requirement.metric),
            bound: requirement.bound,
        }
    }

    pub(super) fn test(&self, space: &Space, test: &model::Test, end_after: f64) -> plan::KnownTest {
        let operations = test.operations.iter().map(|operation| {
            let within = within(&space.operations[operation.operation], end_after);
            plan::TestOperation {
                operation: self.operation(operation.operation),
                activation: self.activation(&operation.activation, within.end),
                parameters: operation.choices.clone(),
                operation_seed: operation.draw_seed,
                messages: operation.messages.clone(),
            }
        });
        let expectations = test
            .expectations
            .iter()
            .map(|expectation| plan::Expectation { metric: self.metric(expectation.metric), bound: expectation.bound });
        plan::KnownTest {
            name: test.declaration.name.clone(),
            doc: test.declaration.doc.clone(),
            test: plan::Test { operations: operations.collect() },
            expectations: expectations.collect(),
            simulator_seed: test.simulator_seed,
        }
    }

    pub(super) fn campaign(&self, space: &Space, campaign: &model::Campaign) -> plan::Campaign {
        // A search that is to stop at a coverage goes on until then or until its failsafe.
        let failsafe = campaign.coverage.as_ref().and_then(|coverage| coverage.failsafe);
        let (search, (operations, count)) = match &campaign.search {
            model::Search::Strategy { template, strategy, evaluations } => {
                (plan::Search::new(*strategy, failsafe.unwrap_or(*evaluations)), held(template))
            }
            model::Search::Repeat { test, times } => {
                let held = space.tests[*test].operations.len();
                let held = u32::try_from(held).expect("a file holds fewer than 2^32 operations");
                (
                    plan::Search::Repeat { test: plan::KnownTestId(position(&self.tests, *test)), times: *times },
                    (&self.operations, plan::Count { min: held, max: held }),
                )
            }
            model::Search::Passive { times } => (
                plan::Search::Repeat { test: plan::KnownTestId(0), times: *times },
                (&self.operations, plan::Count { min: 0, max: 0 }),
            ),
        };
        plan::Campaign {
            name: campaign.declaration.name.clone(),
            doc: campaign.declaration.doc.clone(),
            objectives: campaign.objectives.iter().map(|&id| self.metric(id)).collect(),
            operations: operations.iter().map(|&id| self.operation(id)).collect(),
            count,
            copies: copies(space, campaign),
            activation: match template(campaign) {
                Some(template) => self.activation_mode(space, &template.activation),
                // A repeated test brings its own.
                None => plan::ActivationMode::Time,
            },
            search,
            coverage: campaign.coverage.as_ref().map(coverage),
            exploration: campaign.exploration.clone(),
            confirm: campaign.confirm,
            neighbours: campaign.neighbours,
            stop: campaign.stop.clone(),
            seed: campaign.seed,
            end_after: campaign.end_after,
            end_when: campaign.end_when.as_ref().map(|condition| self.condition(condition)),
            record: campaign.record,
            describes_when: false,
        }
    }
}

/// The test of a campaign that only observes: nothing is intercepted.
pub(super) fn without_operations() -> plan::KnownTest {
    plan::KnownTest {
        name: "undisturbed".to_owned(),
        doc: String::new(),
        test: plan::Test { operations: Vec::new() },
        expectations: Vec::new(),
        simulator_seed: None,
    }
}

/// What the tests of a search hold; `None` for a campaign that repeats.
fn template(campaign: &model::Campaign) -> Option<&model::TestTemplate> {
    campaign.search.template()
}

/// Which operations the tests of a search hold, and how many.
fn held(template: &model::TestTemplate) -> (&Vec<model::OperationId>, plan::Count) {
    (&template.operations, plan::Count { min: template.min, max: template.max })
}

/// What holds of several copies of one operation in a campaign's tests. A known test that a campaign repeats is run as
/// tests of the space's searches are: its copies may act together where those of all of them may.
fn copies(space: &Space, campaign: &model::Campaign) -> plan::Copies {
    match template(campaign) {
        Some(template) => template.copies,
        None if space.copies_may_overlap() => plan::Copies::MayOverlap,
        None => plan::Copies::Apart,
    }
}

/// What a campaign grows conditions from, if it does.
fn condition_space(campaign: &model::Campaign) -> Option<&model::condition::ConditionSpace> {
    match &template(campaign)?.activation {
        model::ActivationMode::Time => None,
        model::ActivationMode::Condition(space) => Some(space),
    }
}

/// The position of a selected item. The selection holds everything that is asked for, by its construction.
fn position<I: Copy + Eq>(selected: &[I], id: I) -> u32 {
    let position = selected.iter().position(|&selected| selected == id).expect("the plan holds what its parts mention");
    u32::try_from(position).expect("a file holds fewer than 2^32 declarations")
}

fn coverage(coverage: &model::Coverage) -> plan::CoverageGoal {
    let axes = coverage.axes.iter().map(|axis| plan::GridAxis {
        dimension: axis.dimension,
        low: axis.range.low,
        high: axis.range.high,
        cells: axis.cells,
    });
    plan::CoverageGoal { axes: axes.collect(), hits: coverage.hits, stop_at: coverage.stop_at }
}
