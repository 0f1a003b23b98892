//! Plans in which one thing is wrong that later code relies on: each is refused with the place of it.

use sesame_plan::condition::{ConditionEnd, ConditionSpace};
use sesame_plan::testing::{field, message};
use sesame_plan::{
    Activation, ActivationMode, Bound, CampaignPlan, Dimension, Domain, KnownTestId, MessageId, MessageType, MetricId,
    MetricSource, OperationId, Search, Strategy, TopicId, Type,
};
use sesame_results::record::sample;

use super::whole::rich;

/// A change to a plan, and what is then said of it.
type Altered = (fn(&mut CampaignPlan), &'static str);

#[test]
fn each_thing_that_later_code_relies_on_is_asked_for() {
    let by_time: &[Altered] = &[
        (|plan| plan.schema += 1, "schema: is 3, this release knows 2"),
        (
            |plan| plan.campaign.objectives[0] = MetricId(40),
            "campaign.objectives[0]: there is no metric 40, there are 5",
        ),
        (|plan| plan.metrics[1].direction = None, "campaign.objectives[0]: the metric `fuzzing_time` has no direction"),
        (
            |plan| plan.campaign.objectives[1] = plan.campaign.objectives[0],
            "campaign.objectives: MetricId(1) is there twice",
        ),
        (|plan| plan.campaign.operations[2] = OperationId(4), "campaign.operations[2]: there is no operation 4"),
        (|plan| plan.campaign.count.min = 6, "campaign.count: runs from 6 to 5"),
        (|plan| plan.campaign.end_after = 0.0, "campaign.end_after: 0 is not above 0"),
        (
            |plan| plan.campaign.search = Search::new(Strategy::Nsga2 { population: 0 }, 1),
            "campaign.search.strategy.population: must be at least 1",
        ),
        (
            |plan| plan.campaign.search = Search::Repeat { test: KnownTestId(1), times: 1 },
            "campaign.search.test: there is no test 1",
        ),
        (|plan| plan.campaign.neighbours = Some(0), "campaign.neighbours: must be at least 1"),
        (|plan| plan.campaign.confirm.as_mut().unwrap().times = 0, "campaign.confirm.times: must be at least 1"),
        (|plan| plan.campaign.coverage.as_mut().unwrap().axes[1].cells = 0, "campaign.coverage.axes[1].cells: must be"),
        (
            |plan| plan.campaign.coverage.as_mut().unwrap().axes[1].dimension = Dimension::T1,
            "campaign.coverage.axes: T1 is there twice",
        ),
        (|plan| plan.requirements[3].metric = MetricId(5), "requirements[3].metric: there is no metric 5"),
        (
            |plan| plan.requirements[0].bound = Bound::Within { low: 1.0, high: 0.0 },
            "requirements[0].bound: runs from 1 to 0",
        ),
        (
            |plan| plan.requirements[1].bound = Bound::Above { value: f64::NAN },
            "requirements[1].bound: NaN is not finite",
        ),
        (
            |plan| plan.metrics[0].source = MetricSource::Hook { topics: vec![TopicId(3)] },
            "metrics[0].source.topics[0]: there is no topic 3",
        ),
        (|plan| plan.metrics[2].name = "fuzzing_time".to_owned(), "metrics: \"fuzzing_time\" is there twice"),
        (
            |plan| plan.metrics[2].name = "\u{1b}[2J".to_owned(),
            "metrics[2].name: \"\\u{1b}[2J\" has control characters",
        ),
        (|plan| plan.topics[0].ty = Type::Message { id: MessageId(0) }, "topics[0].type.id: there is no message 0"),
        (|plan| plan.topics[0].paths.clear(), "topics[0].paths: there is none"),
        (
            |plan| plan.messages.push(containing_itself()),
            "messages[0].fields[0].type.of.id: message 0 contains message 0",
        ),
        (|plan| plan.operations[0].topic = None, "operations[0].topic: it acts on one"),
        (|plan| plan.operations[2].within.end = -1.0, "operations[2].within: runs from 0 to -1"),
        (|plan| plan.operations[2].inclusion = 1.5, "operations[2].inclusion: 1.5 is not in 0..=1"),
        (
            |plan| plan.tests[0].test.operations[0].parameters.clear(),
            "tests[0].test.operations[0].parameters: there are 0",
        ),
        (
            |plan| plan.tests[0].test.operations[0].activation = Activation::Offline,
            "tests[0].test.operations[0].activation: `jitter_link1` acts during the run",
        ),
        (
            |plan| plan.tests[0].expectations[0].metric = MetricId(9),
            "tests[0].expectations[0].metric: there is no metric 9",
        ),
    ];
    let by_condition: &[Altered] = &[
        (
            |plan| space_of(plan).variables[1].metric = MetricId(7),
            "activation.space.variables[1].metric: there is no metric 7",
        ),
        (|plan| space_of(plan).variables.clear(), "campaign.activation.space.variables: there is none"),
        (
            |plan| space_of(plan).integers.highest = 0,
            "campaign.activation.space.integers: there are no whole numbers from 1 to 0",
        ),
        (|plan| space_of(plan).integers.highest = i64::MAX, "campaign.activation.space.integers: there are no"),
        (|plan| space_of(plan).depth = 0, "campaign.activation.space.depth: must be at least 1"),
        (|plan| space_of(plan).depth = 2_000_000, "campaign.activation.space.depth: is 2000000, more than 10"),
        (
            |plan| plan.operations[4].parameters[0].domain = Domain::Texts { texts: Vec::new() },
            "operations[4].parameters[0].domain: there is none",
        ),
        (|plan| plan.operations[4].topic = Some(TopicId(0)), "operations[4].topic: it acts on none"),
    ];
    let conditional = sample::offline_plan(ConditionEnd::Condition);
    for (whole, altered) in [(rich(), by_time), (conditional, by_condition)] {
        whole.validate().unwrap();
        for (alter, words) in altered {
            let mut plan = whole.clone();
            alter(&mut plan);
            let said = plan.validate().unwrap_err().to_string();
            assert!(said.contains(words), "{said:?} does not say {words:?}");
            // What is not finite cannot be written in JSON, and does not come out of it.
            let read = serde_json::from_str::<CampaignPlan>(&serde_json::to_string(&plan).unwrap());
            let read = read.unwrap_err().to_string();
            assert!(read.contains(words) || read.contains("null"), "{read:?} does not say {words:?}");
        }
    }
}

fn containing_itself() -> MessageType {
    let ty = Type::List { of: Box::new(Type::Message { id: MessageId(0) }) };
    message("Loop", vec![field("again", ty)])
}

fn space_of(plan: &mut CampaignPlan) -> &mut ConditionSpace {
    match &mut plan.campaign.activation {
        ActivationMode::Condition { space } => space,
        ActivationMode::Time => panic!("conditions switch its operations"),
    }
}
