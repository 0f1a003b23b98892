//! From the language's model to the plan of one campaign's runner. Pure, and total: every campaign of a checked space
//! has a plan.
//!
//! What a campaign's plan holds:
//! - messages, topics, nodes and requirements of the whole space;
//! - operations: those its tests may hold, or those of the test it repeats;
//! - known tests: one without operations for a campaign that only observes; else those whose operations are all in the
//!   plan and begin before the campaign's end;
//! - metrics: its objectives, those it observes, its condition variables, and those of all requirements and of the
//!   conditions and expectations of these tests.

mod condition;
mod formula;
mod id;
mod robustness;

use sesame_dsl::model::{self, CampaignId, Id as _, Space};
use sesame_dsl::units::Unit;
use sesame_plan as plan;

use self::id::{raw, topic_id};
use crate::plan::{Called, HookPlan, Offline, OperationPlan, RunnerPlan};

/// The plan of a campaign's runner. `source` is the `.sesame` file's name without its folder, `generator` the name and
/// version of what generates.
pub fn lower(space: &Space, campaign: CampaignId, source: &str, generator: &str) -> RunnerPlan {
    let declared = &space.campaigns[campaign];
    let selection = Selection::of(space, declared);
    let (transport, simulator_crate) = match &space.simulator.transport {
        model::Transport::InProcess { path, crate_folder, step_ns } => {
            (plan::Transport::InProcess { path: path.clone(), step_ns: *step_ns }, crate_folder.clone())
        }
        model::Transport::Process { program, arguments, step_ns } => {
            let (program, arguments) = (program.clone(), arguments.clone());
            (plan::Transport::Process { program, arguments, step_ns: *step_ns }, None)
        }
    };
    let system_file = space.file_of(&space.simulator.declaration).to_owned();
    let plan = plan::CampaignPlan {
        schema: plan::SCHEMA,
        generator: generator.to_owned(),
        source: source.to_owned(),
        space: space.declaration.name.clone(),
        doc: space.declaration.doc.clone(),
        simulator: plan::Simulator { name: space.simulator.declaration.name.clone(), transport },
        messages: space.messages.values().map(message).collect(),
        topics: space.topics.values().map(topic).collect(),
        nodes: space.nodes.values().map(node).collect(),
        metrics: selection.metrics.iter().map(|&id| metric(&space.metrics[id])).collect(),
        requirements: space.requirements.values().map(|requirement| selection.requirement(requirement)).collect(),
        operations: selection
            .operations
            .iter()
            .map(|&id| selection.operation_of(&space.operations[id], declared))
            .collect(),
        tests: if let model::Search::Passive { .. } = declared.search {
            vec![undisturbed()]
        } else {
            let tests = selection.tests.iter();
            tests.map(|&id| selection.test(space, &space.tests[id], declared.end_after)).collect()
        },
        campaign: selection.campaign(space, declared),
    };
    RunnerPlan { plan, hooks: hooks(space), operations: custom_operations(space), simulator_crate, system_file }
}

/// The parts of a space that are in a campaign's plan, in declaration order: a position here is the id there.
struct Selection {
    metrics: Vec<model::MetricId>,
    operations: Vec<model::OperationId>,
    tests: Vec<model::TestId>,
}

impl Selection {
    fn of(space: &Space, campaign: &model::Campaign) -> Self {
        let mut operations: Vec<model::OperationId> = match &campaign.search {
            model::Search::Strategy { template, .. } => template.operations.clone(),
            model::Search::Repeat { test, .. } => {
                space.tests[*test].operations.iter().map(|operation| operation.operation).collect()
            }
            model::Search::Passive { .. } => Vec::new(),
        };
        operations.sort();
        operations.dedup();
        let begins = |it: &model::TestOperation| match &it.activation {
            model::Activation::Window(window) => window.low,
            model::Activation::Offline => 0.0,
            model::Activation::Condition { .. } => {
                space.operations[it.operation].within.map_or(0.0, |within| within.low)
            }
        };
        let fits = |test: &model::Test| {
            test.operations.iter().all(|it| operations.contains(&it.operation) && begins(it) < campaign.end_after)
        };
        let tests: Vec<model::TestId> = space.tests.iter().filter(|(_, test)| fits(test)).map(|(id, _)| id).collect();
        // A test holds an operation at least, so a campaign that only observes has none of them.
        let mut metrics: Vec<model::MetricId> = campaign.objectives.clone();
        metrics.extend(&campaign.observed);
        metrics.extend(space.requirements.values().map(|requirement| requirement.metric));
        metrics.extend(condition_space(campaign).into_iter().flat_map(|it| &it.variables).map(|it| it.metric));
        for operation in tests.iter().flat_map(|&test| &space.tests[test].operations) {
            operation.activation.conditions().for_each(|condition| condition.metrics_into(&mut metrics));
        }
        let expectations = tests.iter().flat_map(|&test| &space.tests[test].expectations);
        metrics.extend(expectations.map(|expectation| expectation.metric));
        metrics.sort();
        metrics.dedup();
        Selection { metrics, operations, tests }
    }

    fn metric(&self, id: model::MetricId) -> plan::MetricId {
        plan::MetricId(position(&self.metrics, id))
    }

    fn operation(&self, id: model::OperationId) -> plan::OperationId {
        plan::OperationId(position(&self.operations, id))
    }

    /// An operation, with its constraints where conditions are grown: elsewhere they say nothing.
    fn operation_of(&self, declared: &model::Operation, campaign: &model::Campaign) -> plan::Operation {
        let constraints = match condition_space(campaign) {
            Some(_) => declared.constraints.iter().map(|constraint| self.constraint(constraint)).collect(),
            None => Vec::new(),
        };
        operation(declared, campaign.end_after, constraints)
    }

    fn requirement(&self, requirement: &model::Requirement) -> plan::Requirement {
        plan::Requirement {
            name: requirement.declaration.name.clone(),
            text: requirement.text.clone(),
            metric: self.metric(requirement.metric),
            bound: requirement.bound,
        }
    }

    fn test(&self, space: &Space, test: &model::Test, end_after: f64) -> plan::KnownTest {
        let operations = test.operations.iter().map(|it| {
            let within = within(&space.operations[it.operation], end_after);
            plan::TestOperation {
                operation: self.operation(it.operation),
                activation: self.activation(&it.activation, within.end),
                parameters: it.choices.clone(),
                operation_seed: it.draw_seed,
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
        }
    }

    fn campaign(&self, space: &Space, campaign: &model::Campaign) -> plan::Campaign {
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
            record: campaign.record,
        }
    }
}

/// The test of a campaign that only observes: nothing is intercepted.
fn undisturbed() -> plan::KnownTest {
    plan::KnownTest {
        name: "undisturbed".to_owned(),
        doc: String::new(),
        test: plan::Test { operations: Vec::new() },
        expectations: Vec::new(),
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

fn hooks(space: &Space) -> Vec<HookPlan> {
    let hooks = space.metrics.values().filter_map(|metric| match &metric.source {
        model::MetricSource::Hook(topics) => Some(HookPlan {
            metric: metric.declaration.name.clone(),
            doc: metric.declaration.doc.clone(),
            unit: unit(metric.unit.as_ref()),
            direction: metric.direction,
            source: space.file_of(&metric.declaration).to_owned(),
            line: metric.declaration.line,
            inputs: topics.iter().map(|&id| topic_id(id)).collect(),
        }),
        model::MetricSource::FuzzingTime
        | model::MetricSource::Last(_)
        | model::MetricSource::Robustness(_)
        | model::MetricSource::Formula(_) => None,
    });
    hooks.collect()
}

fn custom_operations(space: &Space) -> Vec<OperationPlan> {
    let operations = space.operations.values().filter_map(|operation| match &operation.kind {
        model::OperationKind::Custom { moment } => Some(OperationPlan {
            operation: operation.declaration.name.clone(),
            doc: operation.declaration.doc.clone(),
            source: space.file_of(&operation.declaration).to_owned(),
            line: operation.declaration.line,
            called: match (moment, operation.topic()) {
                (plan::Moment::BeforeStart, _) => Called::Offline(Offline::BeforeStart),
                (plan::Moment::AfterEnd, _) => Called::Offline(Offline::AfterEnd),
                (plan::Moment::OnMessage, Some(topic)) => Called::OnMessage(topic_id(topic)),
                (plan::Moment::OnMessage, None) => unreachable!("an operation that is called on messages has a topic"),
            },
            parameters: operation.parameters.iter().map(|it| (parameter(it), it.doc.clone())).collect(),
        }),
        _ => None,
    });
    operations.collect()
}

fn parameter(parameter: &model::Parameter) -> plan::Parameter {
    plan::Parameter {
        name: parameter.name.clone(),
        unit: unit(parameter.unit.as_ref()),
        domain: match &parameter.domain {
            model::Domain::Number { range, shape, integer } => {
                plan::Domain::Number { low: range.low, high: range.high, shape: *shape, integer: *integer }
            }
            model::Domain::Point { low, high } => plan::Domain::Point { low: *low, high: *high },
            model::Domain::Texts(texts) => plan::Domain::Texts { texts: texts.clone() },
            model::Domain::Files(files) => plan::Domain::Files { files: files.clone() },
        },
    }
}

fn message(message: &model::Message) -> plan::MessageType {
    let fields = message.fields.iter().map(|field| plan::Field {
        name: field.declaration.name.clone(),
        doc: field.declaration.doc.clone(),
        ty: ty(&field.ty),
    });
    plan::MessageType {
        name: message.declaration.name.clone(),
        doc: message.declaration.doc.clone(),
        fields: fields.collect(),
    }
}

fn ty(of: &model::Type) -> plan::Type {
    match of {
        model::Type::Bool => plan::Type::Bool,
        model::Type::Int(it) => plan::Type::Int { unit: unit(it.as_ref()) },
        model::Type::Real(it) => plan::Type::Real { unit: unit(it.as_ref()) },
        model::Type::Text => plan::Type::Text,
        model::Type::Point(it) => plan::Type::Point { unit: unit(it.as_ref()) },
        model::Type::List(of) => plan::Type::List { of: Box::new(ty(of)) },
        model::Type::Message(id) => plan::Type::Message { id: plan::MessageId(raw(id.index())) },
    }
}

fn topic(topic: &model::Topic) -> plan::Topic {
    plan::Topic {
        name: topic.declaration.name.clone(),
        doc: topic.declaration.doc.clone(),
        paths: topic.paths.clone(),
        ty: ty(&topic.ty),
    }
}

fn node(node: &model::Node) -> plan::Node {
    plan::Node {
        name: node.declaration.name.clone(),
        doc: node.declaration.doc.clone(),
        publishes: node.publishes.iter().map(|&id| topic_id(id)).collect(),
        subscribes: node.subscribes.iter().map(|&id| topic_id(id)).collect(),
    }
}

/// The only way in which the value of a metric changes during a run, where its formula or the declaration of its hook
/// says so.
fn trend(metric: &model::Metric) -> Option<plan::Trend> {
    match &metric.source {
        model::MetricSource::Hook(_) => metric.trend,
        model::MetricSource::FuzzingTime => Some(plan::Trend::Rising),
        model::MetricSource::Formula(formula) => match formula.aggregate {
            plan::Aggregate::Max { .. } | plan::Aggregate::Count { .. } | plan::Aggregate::Duration { .. } => {
                Some(plan::Trend::Rising)
            }
            plan::Aggregate::Min { .. } => Some(plan::Trend::Falling),
            plan::Aggregate::Last { .. } | plan::Aggregate::Mean { .. } => None,
        },
        model::MetricSource::Last(_) | model::MetricSource::Robustness(_) => None,
    }
}

fn metric(metric: &model::Metric) -> plan::Metric {
    plan::Metric {
        name: metric.declaration.name.clone(),
        doc: metric.declaration.doc.clone(),
        unit: unit(metric.unit.as_ref()),
        direction: metric.direction,
        default: metric.default,
        initial: metric.initial,
        trend: trend(metric),
        accepts_not_finite: metric.accepts_not_finite,
        source: match &metric.source {
            model::MetricSource::Hook(topics) => {
                plan::MetricSource::Hook { topics: topics.iter().map(|&id| topic_id(id)).collect() }
            }
            model::MetricSource::FuzzingTime => plan::MetricSource::FuzzingTime,
            model::MetricSource::Last(input) => plan::MetricSource::Last { input: formula::field(input) },
            model::MetricSource::Robustness(of) => {
                plan::MetricSource::Robustness { robustness: robustness::robustness(of) }
            }
            model::MetricSource::Formula(of) => plan::MetricSource::Formula { formula: formula::formula(of) },
        },
        line: metric.declaration.line,
    }
}

fn operation(
    operation: &model::Operation,
    end_after: f64,
    constraints: Vec<plan::condition::Constraint>,
) -> plan::Operation {
    plan::Operation {
        name: operation.declaration.name.clone(),
        doc: operation.declaration.doc.clone(),
        topic: operation.topic().map(topic_id),
        places: operation.target.iter().flat_map(|target| &target.places).cloned().collect(),
        kind: operation.kind.clone(),
        parameters: operation.parameters.iter().map(parameter).collect(),
        within: within(operation, end_after),
        priority: operation.priority,
        inclusion: operation.inclusion,
        timed: operation.timed,
        constraints,
    }
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

/// The window of an operation; one without `within` may be active during the whole test.
fn within(operation: &model::Operation, end_after: f64) -> plan::Span {
    match operation.within {
        Some(window) => plan::Span { start: window.low, end: window.high },
        None => plan::Span { start: 0.0, end: end_after },
    }
}

fn unit(unit: Option<&Unit>) -> Option<String> {
    unit.map(|unit| unit.text().to_owned())
}

#[cfg(test)]
mod tests {
    use sesame_dsl::analyse;
    use sesame_dsl::source::SourceMap;

    use super::*;

    const CELL: &str = r#"
        space cell
        system {
          simulator sim = in_process "cell_sim::Cell" { crate "simulator"  step 20ms }
          message Zone { name: text  level: real[mm] }
          topic link = "link" : real[rad]
          topic count = "count" : int
          topic zones = "zones/{A,B}" : Zone
        }
        metric collisions maximise default 0 { hook on zones }
        metric unused: real[m/s] { hook on link, zones }
        metric seen = last(count)
        metric time minimise = fuzzing_time()
        requirement R1 "nothing is hit" = collisions <= 0
        operation swing on link = random offset [-18deg, 18deg] within [0s, 1min]
        operation lose on link = packet loss [0%, 50%] untimed
        operation recount on count = random absolute [-3, 3] priority 2 inclusion 40%
        operation level on zones.level = random absolute [0m, 1m]
        test early { lose loss 25% from 1s to 30s  expect seen > 3 }
        test late { lose loss 25% from 20s to 21s }
        campaign look { objectives time, collisions  operations recount, swing 1..3 per test
                        search nsga2 { population 4  evaluations 8 }  end after 10s }
        campaign cover { objectives time  operations recount, swing 1..3 per test
                         search nsga2 { population 4  evaluations 8 }
                         coverage { T1 [0, 1] cells 6  O0 [0.5, 3.5] cells 3  hits 2  stop at 50%  failsafe 30 }
                         end after 10s }
        campaign again { repeat early 3 times { seed 9 }  observes time  end after 10s }
        campaign guard from again { passive 4 times { seed 2 }  observes seen }
    "#;

    fn lowered(campaign: &str) -> RunnerPlan {
        let mut sources = SourceMap::new();
        let file = sources.add("cell.sesame", CELL);
        let analysis = analyse(&sources, file);
        let space = analysis.model.unwrap_or_else(|| panic!("{:#?}", analysis.diagnostics));
        lower(&space, space.campaign(campaign).unwrap(), "cell.sesame", "sesamec 0.0.0")
    }

    #[test]
    fn coverage_is_counted_over_a_grid_and_its_failsafe_bounds_the_search() {
        let campaign = lowered("cover").plan.campaign;
        let axis = |dimension, low, high, cells| plan::GridAxis { dimension, low, high, cells };
        let axes = vec![axis(plan::Dimension::T1, 0.0, 1.0, 6), axis(plan::Dimension::O0, 0.5, 3.5, 3)];
        assert_eq!(campaign.coverage, Some(plan::CoverageGoal { axes, hits: 2, stop_at: Some(0.5) }));
        assert_eq!(campaign.search, plan::Search::new(plan::Strategy::Nsga2 { population: 4 }, 30));
        assert_eq!(lowered("look").plan.campaign.coverage, None);
    }

    #[test]
    fn a_search_has_the_parts_it_needs_and_all_hooks() {
        let RunnerPlan { plan, hooks, simulator_crate, system_file, .. } = lowered("look");
        assert_eq!(system_file, "cell.sesame");
        let names: Vec<&str> = plan.metrics.iter().map(|metric| metric.name.as_str()).collect();
        assert_eq!(names, ["collisions", "time"]);
        assert_eq!(plan.campaign.objectives, [plan::MetricId(1), plan::MetricId(0)]);
        let names: Vec<&str> = plan.operations.iter().map(|operation| operation.name.as_str()).collect();
        assert_eq!(names, ["swing", "recount"]);
        assert_eq!(plan.campaign.operations, [plan::OperationId(1), plan::OperationId(0)]);
        assert!(plan.tests.is_empty(), "the known tests use another operation");
        let names: Vec<&str> = hooks.iter().map(|hook| hook.metric.as_str()).collect();
        assert_eq!(names, ["collisions", "unused"]);
        assert_eq!(simulator_crate.as_deref(), Some("simulator"));
    }

    #[test]
    fn a_repetition_has_its_test_with_windows_cut_at_the_end() {
        let RunnerPlan { plan, .. } = lowered("again");
        assert_eq!(plan.tests.len(), 1, "the other test begins after the end");
        assert_eq!(plan.campaign.search, plan::Search::Repeat { test: plan::KnownTestId(0), times: 3 });
        assert_eq!(plan.campaign.seed, 9);
        assert_eq!(plan.operations[0].within, plan::Span { start: 0.0, end: 10.0 });
        assert_eq!(plan.tests[0].test.operations[0].activation, plan::Activation::Time { start: 1.0, end: 10.0 });
        assert_eq!(plan.tests[0].test.operations[0].parameters, [plan::Choice::Value { value: 0.25 }]);
        let names: Vec<&str> = plan.metrics.iter().map(|metric| metric.name.as_str()).collect();
        assert_eq!(names, ["collisions", "seen", "time"]);
    }

    #[test]
    fn a_campaign_that_only_observes_repeats_a_test_without_operations() {
        let RunnerPlan { plan, hooks, .. } = lowered("guard");
        assert!(plan.operations.is_empty() && plan.campaign.operations.is_empty());
        assert_eq!(plan.campaign.search, plan::Search::Repeat { test: plan::KnownTestId(0), times: 4 });
        assert_eq!((plan.campaign.seed, plan.campaign.end_after), (2, 10.0));
        let [test] = plan.tests.as_slice() else { panic!("{:?}", plan.tests) };
        assert_eq!((test.name.as_str(), test.test.operations.len()), ("undisturbed", 0));
        let names: Vec<&str> = plan.metrics.iter().map(|metric| metric.name.as_str()).collect();
        assert_eq!(names, ["collisions", "seen"]);
        assert_eq!(hooks.len(), 2);
    }

    #[test]
    fn an_operation_says_if_it_counts_in_the_fuzzing_time() {
        assert!(lowered("look").plan.operations.iter().all(|operation| operation.timed));
        let plan = lowered("again").plan;
        assert!(!plan.operations[0].timed);
        let json = serde_json::to_string(&plan.operations[0]).unwrap();
        let read: plan::Operation = serde_json::from_str(&json).unwrap();
        assert_eq!(read, plan.operations[0]);
        let before = json.replace(",\"timed\":false", "");
        assert_ne!(before, json);
        assert!(serde_json::from_str::<plan::Operation>(&before).unwrap().timed, "as older plans meant it");
    }

    #[test]
    fn a_search_by_condition_measures_its_variables_and_those_of_known_tests() {
        let text = CELL.replace("metric seen", "metric near initial 0rad = last(abs(link)) outbound metric seen").replace(
            "campaign look {",
            "test spot { swing offset [1deg, 2deg] when near > 0.1rad and collisions == 2 until time > 1min at most 2 times
                          recount value [1, 2] when collisions > 1 for 500ms }
             operation shake on link = random offset [0rad, 1rad] start contains near, integer [2, 3]
             campaign grown { objectives time  operations shake, swing, recount 1..3 per test
                              activate by condition over unused in [-1km/h, 36km/h], near
                              search random { evaluations 8 }  end after 10s }
             campaign look {",
        );
        let mut sources = SourceMap::new();
        let file = sources.add("cell.sesame", text);
        let analysis = analyse(&sources, file);
        let space = analysis.model.unwrap_or_else(|| panic!("{:#?}", analysis.diagnostics));
        let grown = lower(&space, space.campaign("grown").unwrap(), "cell.sesame", "sesamec 0.0.0");
        let names: Vec<&str> = grown.plan.metrics.iter().map(|metric| metric.name.as_str()).collect();
        assert_eq!(names, ["collisions", "unused", "near", "time"]);
        assert!(grown.hooks.iter().all(|hook| grown.uses(hook)), "the hook of a variable is compiled");
        assert_eq!(grown.plan.metrics[2].initial, Some(0.0));
        insta::assert_snapshot!(serde_json::to_string_pretty(&grown.plan.campaign.activation).unwrap());
        insta::assert_snapshot!(serde_json::to_string_pretty(&grown.plan.tests[0].test).unwrap());
        let constraints: Vec<usize> = grown.plan.operations.iter().map(|it| it.constraints.len()).collect();
        assert_eq!(constraints, [0, 0, 2]);
        let read: plan::CampaignPlan = serde_json::from_str(&serde_json::to_string(&grown.plan).unwrap()).unwrap();
        assert_eq!(read, grown.plan);
        let by_time = lower(&space, space.campaign("look").unwrap(), "cell.sesame", "sesamec 0.0.0");
        assert!(by_time.plan.operations.iter().all(|it| it.constraints.is_empty()));
        let names: Vec<&str> = by_time.plan.metrics.iter().map(|metric| metric.name.as_str()).collect();
        assert_eq!(names, ["collisions", "near", "time"], "the known test is in this plan too");
    }

    #[test]
    fn the_deepest_condition_can_be_read_again_from_the_plan() {
        let chained = vec!["time > 1s"; model::condition::Condition::MAX_DEPTH].join(" and ");
        let text = CELL.replace("lose loss 25% from 1s to 30s", &format!("lose loss 25% when {chained} for 1s"));
        let mut sources = SourceMap::new();
        let file = sources.add("cell.sesame", text);
        let space = analyse(&sources, file).model.unwrap();
        let RunnerPlan { plan, .. } = lower(&space, space.campaign("again").unwrap(), "cell.sesame", "sesamec 0.0.0");
        let read: plan::CampaignPlan = serde_json::from_str(&serde_json::to_string(&plan).unwrap()).unwrap();
        assert_eq!(read, plan);
    }

    #[test]
    fn quantities_arrive_in_the_units_of_the_wire() {
        let RunnerPlan { plan, .. } = lowered("look");
        let swing = &plan.operations[0];
        let plan::Domain::Number { high, .. } = swing.parameters[0].domain else { panic!("an offset is a number") };
        assert_eq!(high, std::f64::consts::PI / 10.0);
        assert_eq!(swing.within, plan::Span { start: 0.0, end: 60.0 });
        assert_eq!(plan.operations[1].inclusion, 0.4);
        assert!(matches!(plan.operations[1].parameters[0].domain, plan::Domain::Number { integer: true, .. }));
    }

    #[test]
    fn a_formula_arrives_with_its_constants_in_the_units_of_the_wire_and_needs_no_hook() {
        let text = CELL.replace(
            "metric seen",
            "metric close = count(zones.level < 0.3m and link > 180deg) every 200ms per zones.name outbound metric seen",
        );
        let mut sources = SourceMap::new();
        let file = sources.add("cell.sesame", text.replace("observes time", "observes time, close"));
        let space = analyse(&sources, file).model.unwrap();
        let lowered = lower(&space, space.campaign("again").unwrap(), "cell.sesame", "sesamec 0.0.0");
        let metric = lowered.plan.metrics.iter().find(|metric| metric.name == "close").unwrap();
        insta::assert_snapshot!(serde_json::to_string(&metric.source).unwrap());
        assert!(lowered.hooks.iter().all(|hook| hook.metric != "close"));
        let read: plan::Metric = serde_json::from_str(&serde_json::to_string(metric).unwrap()).unwrap();
        assert_eq!(read, *metric);
    }

    #[test]
    fn the_deepest_formula_can_be_read_again_from_the_plan() {
        let nested = format!("{}link{}", "(-(1rad + ".repeat(8), " * 1) * 1)".repeat(8));
        let text = CELL.replace("metric seen", &format!("metric deep = last({nested}) outbound metric seen"));
        let mut sources = SourceMap::new();
        let file = sources.add("cell.sesame", text.replace("observes time", "observes time, deep"));
        let analysis = analyse(&sources, file);
        let space = analysis.model.unwrap_or_else(|| panic!("{:#?}", analysis.diagnostics));
        let RunnerPlan { plan, .. } = lower(&space, space.campaign("again").unwrap(), "cell.sesame", "sesamec 0.0.0");
        let read: plan::CampaignPlan = serde_json::from_str(&serde_json::to_string(&plan).unwrap()).unwrap();
        assert_eq!(read, plan);
    }

    #[test]
    fn the_whole_plan_is_as_blessed() {
        let plan = serde_json::to_string_pretty(&lowered("again").plan).unwrap();
        insta::assert_snapshot!(plan);
    }
}
