//! From the language's model to the plan of one campaign's runner. Pure, and total: every campaign of a checked space
//! has a plan.
//!
//! What a campaign's plan holds:
//! - messages, topics, nodes and requirements of the whole space;
//! - operations: those its tests may hold, or those of the test it repeats;
//! - known tests: one without operations for a campaign that only observes; else those whose operations are all in the
//!   plan and begin before the campaign's end;
//! - metrics: its objectives, those it observes, its condition variables, and those of all requirements, of the labs,
//!   and of the conditions and expectations of these tests;
//! - all runtime monitors and all labs of the space.

mod condition;
mod formula;
mod id;
mod lab;
mod launch;
mod monitor;
mod operation;
mod robustness;
mod ros2;
mod selection;
mod simulator;
mod system;

use sesame_dsl::model::{self, CampaignId, EddiId, Space};
use sesame_plan as plan;

use self::id::topic_id;
use self::launch::launched_as_usual;
use self::operation::custom_operations;
use self::selection::{Selection, without_operations};
pub use self::simulator::simulator;
use self::system::{lifecycle, message, node, topic, unit};
use crate::plan::{HookPlan, MonitorPlan, RunnerPlan};

/// The plan of a campaign's runner. `source` is the `.sesame` file's name without its folder, `generator` the name and
/// version of what generates.
pub fn lower(space: &Space, campaign: CampaignId, source: &str, generator: &str) -> RunnerPlan {
    let declared = &space.campaigns[campaign];
    let selection = Selection::of(space, declared);
    let simulator_crate = space.simulator.crate_folder.clone();
    let system_file = space.file_of(&space.simulator.declaration).to_owned();
    let plan = plan::CampaignPlan {
        metrics: selection.metrics.iter().map(|&id| metric(&space.metrics[id])).collect(),
        requirements: space.requirements.values().map(|requirement| selection.requirement(requirement)).collect(),
        operations: selection
            .operations
            .iter()
            .map(|&id| selection.operation_of(&space.operations[id], declared))
            .collect(),
        tests: if let model::Search::Passive { .. } = declared.search {
            vec![without_operations()]
        } else {
            let tests = selection.tests.iter();
            tests.map(|&id| selection.test(space, &space.tests[id], declared.end_after)).collect()
        },
        labs: space.physicals.values().map(|lab| selection.lab(space, lab)).collect(),
        ..of_system(space, selection.campaign(space, declared), source, generator)
    };
    let plan = launched_as_usual(plan, space);
    RunnerPlan { plan, hooks: hooks(space), operations: custom_operations(space), simulator_crate, system_file }
}

/// The plan of a monitor that is a program of its own, or why it cannot be one. `source` and `generator` are as for
/// [`lower`].
pub fn lower_monitor(
    space: &Space,
    monitor: EddiId,
    source: &str,
    generator: &str,
) -> Result<MonitorPlan, plan::NotAlone> {
    let name = space.eddis[monitor].declaration.name.clone();
    let mut whole = of_system(space, for_as_long_as_can_be(&name), source, generator);
    whole.tests = vec![without_operations()];
    let plan = launched_as_usual(whole, space).of_monitor_alone(monitor::monitor_id(monitor))?;
    Ok(MonitorPlan { name, plan, system_file: space.file_of(&space.simulator.declaration).to_owned() })
}

/// The plan of a campaign with nothing but the system and its monitors: no metrics, operations, tests or labs.
fn of_system(space: &Space, campaign: plan::Campaign, source: &str, generator: &str) -> plan::CampaignPlan {
    plan::CampaignPlan {
        schema: plan::SCHEMA,
        generator: generator.to_owned(),
        source: source.to_owned(),
        space: space.declaration.name.clone(),
        doc: space.declaration.doc.clone(),
        simulator: plan::Simulator { lifecycle: lifecycle(&space.lifecycle), ..simulator(space, &space.simulator) },
        messages: space.messages.values().map(message).collect(),
        topics: space.topics.values().map(|declared| topic(space, declared)).collect(),
        nodes: space.nodes.values().map(node).collect(),
        metrics: Vec::new(),
        requirements: Vec::new(),
        operations: Vec::new(),
        tests: Vec::new(),
        campaign,
        monitors: space.eddis.values().map(|eddi| monitor::monitor(space, eddi)).collect(),
        labs: Vec::new(),
        compensation: None,
    }
}

/// A campaign of one run without operations that nothing ends.
fn for_as_long_as_can_be(name: &str) -> plan::Campaign {
    // The nanoseconds of simulation time are whole numbers, of which there are more for ten times as long.
    const LONGEST: f64 = 1e9;
    plan::Campaign {
        name: name.to_owned(),
        doc: String::new(),
        objectives: Vec::new(),
        operations: Vec::new(),
        count: plan::Count { min: 0, max: 0 },
        copies: plan::Copies::default(),
        activation: plan::ActivationMode::Time,
        search: plan::Search::Repeat { test: plan::KnownTestId(0), times: 1 },
        coverage: None,
        exploration: None,
        confirm: None,
        neighbours: None,
        stop: Vec::new(),
        seed: 0,
        end_after: LONGEST,
        end_when: None,
        record: None,
        describes_when: false,
    }
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
        | model::MetricSource::Monitor(..)
        | model::MetricSource::Last(_)
        | model::MetricSource::Robustness(_)
        | model::MetricSource::Formula(_) => None,
    });
    hooks.collect()
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
        model::MetricSource::Monitor(_, score) => score.trend(),
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
            model::MetricSource::Monitor(of, score) => {
                plan::MetricSource::Monitor { monitor: monitor::monitor_id(*of), score: *score }
            }
            model::MetricSource::Formula(of) => plan::MetricSource::Formula { formula: formula::formula(of) },
        },
        line: metric.declaration.line,
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use sesame_dsl::analyse;
    use sesame_dsl::source::SourceMap;
    use sesame_plan::testing::compact::{Base, Tree, variant, variants};

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
        operation glitch on link = freeze for [500ms, 2s]
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
        campaign glitches from look { operations glitch, swing 1..3 per test }
    "#;

    fn lowered(campaign: &str) -> RunnerPlan {
        lowered_from(CELL, campaign)
    }

    fn lowered_from(text: &str, campaign: &str) -> RunnerPlan {
        let mut sources = SourceMap::new();
        let file = sources.add("cell.sesame", text);
        let analysis = analyse(&sources, file);
        let space = analysis.model.unwrap_or_else(|| panic!("{:#?}", analysis.diagnostics));
        lower(&space, space.campaign(campaign).unwrap(), "cell.sesame", "sesamec 0.0.0")
    }

    #[test]
    fn topics_on_which_monitors_publish_are_cut_and_nobody_needs_to_publish_a_state() {
        let text = r#"
            space cell
            system {
              simulator sim = ros2
              message Level = "std_msgs/msg/Float64" { data: real[mm] }
              message Flag  = "std_msgs/msg/Bool" { data: bool }
              topic level = "level" : Level
              topic stop  = "stop"  : Flag
              topic safe  = "safe"  : Flag
              node arm { publishes level  subscribes stop, safe  launch "./arm" "{ros-args}" }
              node plc { publishes stop   launch "./plc" "{ros-args}" }
            }
            eddi cell publishes safe {
              evidence  low = level.data < 1m
              guarantee moves  integrity 1 = low
              otherwise stands  mitigate with stop.data = true
            }
            metric highest maximise default 0mm = max(level.data)
            operation lag on node arm = slow [10%, 50%]
            campaign look { objectives highest  operations lag 1 per test
                            search random { evaluations 8 }  end after 10s }
        "#;
        let plan = lowered_from(text, "look").plan;
        plan.validate().unwrap();
        let cut: Vec<bool> = plan.simulator.wiring.iter().map(|wiring| wiring.cut).collect();
        assert_eq!(cut, [false, true, true], "a level is only heard");
        let remapped =
            |node| plan.remappings(plan::NodeId(node)).into_iter().map(|remapping| remapping.to).collect::<Vec<_>>();
        assert_eq!((remapped(0), remapped(1)), (Vec::new(), vec!["/stop/undisturbed".to_owned()]));
        assert!(plan.unclaimed().is_empty(), "{:?}", plan.unclaimed());
        assert_eq!(plan.state_on(plan::TopicId(2)), Some((&plan::Type::Bool, Some("data"))));
    }

    #[test]
    fn an_operation_on_a_node_has_the_node_and_no_topic_and_cuts_none() {
        let text = r#"
            space cell
            system {
              simulator sim = ros2
              message Level = "std_msgs/msg/Float64" { data: real[mm] }
              topic level = "level" : Level
              node arm { publishes level  launch "./arm" "{ros-args}" }
              node plan "/planner" { subscribes level }
            }
            metric highest maximise default 0mm = max(level.data)
            operation weak on parameter "limits.payload" of plan = set [-1, 3] priority 2
            operation lag on node arm = slow [10%, 50%] for [1s, 2s]
            operation halt on node arm = pause untimed
            operation fail on node arm = kill within [2s, 3s]
            test bad { weak value 2.5 from 1s to 3s  lag share 25% from 1s to 2.5s }
            campaign look { objectives highest  operations weak, lag, halt, fail 1 per test
                            search random { evaluations 8 }  end after 10s }
        "#;
        let plan = lowered_from(text, "look").plan;
        plan.validate().unwrap();
        let kinds: Vec<_> = plan.operations.iter().map(|operation| operation.kind.clone()).collect();
        let [arm, planner] = [0, 1].map(plan::NodeId);
        let set = plan::OperationKind::Set { node: planner, parameter: "limits.payload".to_owned(), values: vec![] };
        let on_arm = [
            plan::OperationKind::Slow { node: arm },
            plan::OperationKind::Pause { node: arm },
            plan::OperationKind::Kill { node: arm },
        ];
        assert_eq!(kinds, [&[set][..], &on_arm].concat());
        assert!(plan.operations.iter().all(|operation| operation.topic.is_none() && operation.places.is_empty()));
        let domain = |low, high| plan::Domain::Number { low, high, shape: plan::ChoiceKind::Value, integer: false };
        let parameters: Vec<_> = plan
            .operations
            .iter()
            .flat_map(|operation| &operation.parameters)
            .map(|parameter| (parameter.name.as_str(), parameter.domain.clone()))
            .collect();
        assert_eq!(parameters, [("value", domain(-1.0, 3.0)), ("share", domain(0.1, 0.5))]);
        let chosen: Vec<_> = plan.tests[0].test.operations.iter().flat_map(|used| &used.parameters).collect();
        assert_eq!(chosen, [&plan::Choice::Value { value: 2.5 }, &plan::Choice::Value { value: 0.25 }]);
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
    fn a_bound_on_lengths_is_written_only_where_there_is_one() {
        let plan = lowered("glitches").plan;
        let glitch = plan.operations.iter().find(|operation| operation.name == "glitch").unwrap();
        assert_eq!(glitch.lengths, Some(plan::Lengths { low: 0.5, high: 2.0 }));
        let written = serde_json::to_string(&plan).unwrap();
        assert_eq!(written.matches(r#""lengths":{"low":0.5,"high":2.0}"#).count(), 1);
        assert_eq!(serde_json::from_str::<plan::CampaignPlan>(&written).unwrap(), plan);
        let without = serde_json::to_string(&lowered("look").plan).unwrap();
        assert!(!without.contains("lengths"), "a plan without a bound is written as before");
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
        let parts = (&grown.plan.campaign.activation, &grown.plan.tests[0].test);
        insta::assert_snapshot!(Base::default().compact(&tree(&parts)));
        let constraints: Vec<usize> =
            grown.plan.operations.iter().map(|operation| operation.constraints.len()).collect();
        assert_eq!(constraints, [0, 0, 2]);
        let read: plan::CampaignPlan = serde_json::from_str(&serde_json::to_string(&grown.plan).unwrap()).unwrap();
        assert_eq!(read, grown.plan);
        let by_time = lower(&space, space.campaign("look").unwrap(), "cell.sesame", "sesamec 0.0.0");
        assert!(by_time.plan.operations.iter().all(|operation| operation.constraints.is_empty()));
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
    fn points_texts_pairs_and_regions_arrive_as_data_that_reads_back() {
        let named = ["metric time", "objectives time", "observes time"];
        let text = named.iter().fold(CELL.to_owned(), |text, name| text.replace(name, &format!("{name}_fuzzed")));
        let text = text.replace(
            "metric seen",
            "metric high = last(pose.at.z)
             metric far = max(distance(each of poses.at, (1, 0, -0.5)m)) when tower != \"hold\" and time > 2s
             metric closest = min(distance(each pair of poses.at))
             metric fence = max(signed_distance(pose.at, polygon((0, 0), (5, 0), (0, 500))cm))
             metric room = min(signed_distance(pose.at, box((2, 0, 0), (0, 3, 4))m))
             metric way = last(sqrt(pose.at.x * pose.at.x) + hypot(pose.at.x, 3mm) * sin(90deg))
             metric seen",
        );
        let text = text.replacen(
            "topic ",
            "message Pose { at: point[mm] }  topic tower = \"tower\" : text
             topic pose = \"pose\" : Pose  topic poses = \"poses/{a,b}\" : Pose  topic ",
            1,
        );
        let mut sources = SourceMap::new();
        let text = text.replace("observes time_fuzzed", "observes time_fuzzed, high, far, closest, fence, room, way");
        let file = sources.add("cell.sesame", text);
        let analysis = analyse(&sources, file);
        let space = analysis.model.unwrap_or_else(|| panic!("{:#?}", analysis.diagnostics));
        let RunnerPlan { plan, .. } = lower(&space, space.campaign("again").unwrap(), "cell.sesame", "sesamec 0.0.0");
        plan.validate().unwrap();
        let new = ["high", "far", "closest", "fence", "room", "way"];
        let lines = plan.metrics.iter().filter(|metric| new.contains(&metric.name.as_str()));
        let lines: Vec<String> = lines.map(|metric| serde_json::to_string(&metric.source).unwrap()).collect();
        assert_eq!(lines.len(), new.len());
        insta::assert_snapshot!(lines.join("\n"));
        let read: plan::CampaignPlan = serde_json::from_str(&serde_json::to_string(&plan).unwrap()).unwrap();
        assert_eq!(read, plan);
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

    /// What is ordinary in a plan: the plans of spaces that have each kind of declaration in its plainest form.
    pub(crate) fn base() -> Base {
        let spaces = [
            include_str!("../../sesame-dsl/tests/good/base.sesame"),
            include_str!("../../sesame-dsl/tests/good/base_of_ros.sesame"),
        ];
        let mut plans = Vec::new();
        for text in spaces {
            let mut sources = SourceMap::new();
            let file = sources.add("base.sesame", text);
            let space = analyse(&sources, file).model.unwrap();
            for (campaign, _) in space.campaigns.iter() {
                plans.push(tree(&lower(&space, campaign, "base.sesame", "sesamec 0.0.0").plan));
            }
        }
        Base::of(&[Tree::List(plans)])
    }

    /// A part of a plan as its JSON has it.
    pub(crate) fn tree(part: &impl serde::Serialize) -> Tree {
        Tree::read(&serde_json::to_string(part).unwrap())
    }

    #[test]
    fn snapshots_of_plans_leave_out_what_is_ordinary() {
        insta::assert_snapshot!(base().ordinary(&Base::default()));
    }

    #[test]
    fn the_whole_plan_is_as_blessed() {
        let plan = tree(&lowered("again").plan);
        let base = base();
        let shown = base.compact(&plan);
        for number in 0..variants(&plan) {
            let text = base.compact(&variant(&plan, number).unwrap());
            assert!(text != shown, "change {number} is hidden");
        }
        insta::assert_snapshot!(shown);
    }
}
