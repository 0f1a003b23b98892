//! A test that was found, written as a block of the language and read back, is the same test bit for bit.

use proptest::prelude::*;

use sesame_base::observation::{MetricObservation, Observation, Outcome, WallTime};
use sesame_dsl::analyse;
use sesame_dsl::source::SourceMap;
use sesame_notation as notation;
use sesame_plan::{Activation, Bound, CampaignPlan, Choice, Domain, OperationId, Test, TestOperation};
use sesame_record::{Origin, Recorder, TestRecord};
use sesame_report::{Expected, export};
use sesame_search as search;
use sesame_tests::models::model;
use sesamec::frontend::{Look, SESAME};

/// Every kind of parameter in units that are awkward to write.
const SPACE: &str = r#"
    space cell
    system {
      simulator sim = in_process "cell_sim::Cell" { crate "simulator"  step 20ms }
      message Zone { level: real[mm]  share: real[%]  name: text  known: bool  at: int[ns]  spans: list of real[mm] }
      topic link = "link" : real[deg]
      topic speed = "speed" : real[km/h]
      topic count = "count" : int
      topic plain = "plain" : real
      topic zone = "zone" : Zone
      topic pose = "pose" : point[mm]
    }
    metric collisions maximise default 0 { hook on zone }
    metric distance: real[mm] minimise { hook on zone }
    metric share minimise = last(zone.share)
    metric fastest maximise = last(speed)
    metric time minimise = fuzzing_time()
    operation swing on link = random offset [-0.3rad, 0.3rad] within [0s, 65s]
    operation rush on speed = random absolute [-1m/s, 30m/s]
    operation recount on count = random absolute [-3, 4000000000]
    operation shift on plain = random offset [-1e-12, 1e30]
    operation level on zone.level = random absolute [0m, 1m] within [1ms, 1min]
    operation fill on zone.share = random absolute [0%, 12.3%]
    operation lose on link = packet loss [0%, 100%]
    operation lose_some on speed = packet loss [1.7%, 12.3%]
    operation lag on link = latency [0ms, 500ms]
    operation wobble on speed = latency [0ms, 500ms] uniform
    operation cut on plain = blackhole
    operation carry on pose = random offset [(-1, -1.25, 0)cm, (1, 1, 1e-9)cm]
    operation place on pose = stuck at [(-1, -1.25, 0)cm, (1, 1, 1e-9)cm]
    operation sink on pose = drift [(-1, -1.25, 0)cm/s, (1, 1, 1e-9)cm/s]
    operation charge on zone.share = drift [0%/s, 12.3%/s]
    operation rename on zone.name = stuck at one of "a \"b\"", "c"
    operation guess on zone.name = random one of "a", "b"
    operation deny on zone.known = stuck at false
    operation skew on zone.at = clock skew [-1ms, 1ms]
    operation stretch on zone.level, zone.spans[2], zone.spans[*] = scale [10%, 3]
    operation tremble on zone.level = noise [0mm, 3m]
    operation roam on zone.spans[*] = random walk [0mm, 3m]
    operation freeze_all on zone = freeze
    operation age on zone.spans = stale [0ms, 700ms]
    operation bursts on zone = burst loss { enter [0%, 12.3%]  leave [1.7%, 100%]  loss [50%, 99.9%] }
    operation thin on zone = rate limit [0.1Hz, 5kHz]
    operation mix on zone = reorder [0ms, 900ms] drain drop
    operation twice on zone = duplicate [1, 7]
    operation uneven on zone = latency [1ms, 900ms] normal
    operation bend on link = custom {
      points: int [-3, 20]  gain: real [0.1, 0.7]  tilt: real[deg] [-0.3rad, 0.3rad]
      shift: point [(-2, -2.5, 0)m, (2, 200, 1e-9)m]  frame: one of "frame \"B\" \\ 0", "frameB_1"
    } priority 3
    operation spoil = custom before start { file: file one of "calibration.yaml", "maps/hall.yaml" }
    operation tidy = custom after end { }
    campaign look {
      objectives time, collisions, distance, share, fastest
      operations swing, rush, recount, shift, level, fill, lose, lose_some, lag, wobble, cut, bend, spoil, tidy,
                 carry, place, sink, charge, rename, guess, deny, skew, stretch, tremble, roam, freeze_all, age, bursts, thin, mix,
                 twice, uneven   1..32 per test
      activate by time
      search random { evaluations 100 }
      end after 70s
    }
"#;

/// The plan of the campaign in this text.
fn plan(text: &str) -> CampaignPlan {
    let mut sources = SourceMap::new();
    let file = sources.add("cell.sesame", text);
    let analysis = analyse(&sources, file);
    let space = analysis.model.unwrap_or_else(|| panic!("{text}\n{:#?}", analysis.diagnostics));
    sesame_codegen::lower::lower(&space, space.campaign("look").unwrap(), "cell.sesame", "sesamec").plan
}

/// Records tests, exports each, and reads it back below the space.
fn check(plan: &CampaignPlan, tests: &[(Test, f64)]) {
    let folder = tempfile::tempdir().unwrap();
    let mut recorder = Recorder::create(folder.path(), plan, 42, 1).unwrap();
    let metric = |value| MetricObservation::whole(Some(value), true, Vec::new());
    for (number, (test, value)) in (1..).zip(tests) {
        let observation = Observation {
            outcome: Outcome::Completed,
            end: 70.0,
            operations: Vec::new(),
            unheard: Vec::new(),
            unreached: Vec::new(),
            traffic: Vec::new(),
            course: None,
            altered: None,
            metrics: vec![metric(*value); plan.metrics.len()],
            monitors: Vec::new(),
            messages: 0,
            warnings: Vec::new(),
            wall: WallTime::default(),
        };
        let record = TestRecord {
            number,
            origin: Origin::Search,
            generation: Some(0),
            parents: Vec::new(),
            test: test.clone(),
            simulator_seed: 1,
            duplicate_of: None,
            observation,
        };
        recorder.commit(&record).unwrap();
    }
    let repository = recorder.finish("done").unwrap();
    let blocks = (1..=tests.len())
        .map(|number| export(&repository, &format!("T{number}"), None, Expected::Values).unwrap().block);
    let again = self::plan(&format!("{SPACE}\n{}", blocks.collect::<String>()));
    assert_eq!(again.tests.len(), tests.len());
    for (known, (test, value)) in again.tests.iter().zip(tests) {
        assert_eq!(&known.test, test);
        let expected: Vec<_> = known.expectations.iter().map(|expected| (expected.metric, expected.bound)).collect();
        let objectives = plan.campaign.objectives.iter().map(|&id| (id, Bound::Equal { value: *value }));
        assert_eq!(expected, objectives.collect::<Vec<_>>());
    }
}

#[test]
fn every_test_that_a_search_finds_reads_back_as_it_was() {
    let variables = "by condition over distance in [-2m, 1e5m], collisions, share, fastest in [0m/s, 9m/s], time";
    for activate in [
        "by time",
        &format!("{variables} {{ depth 6  integers [-2, 3000000] }}"),
        &format!("{variables} for [1ms, 0.25min] at most 3 times"),
    ] {
        let plan = plan(&SPACE.replace("activate by time", &format!("activate {activate}")));
        for seed in 0..10 {
            let mut strategy = search::strategy(&plan, seed).unwrap();
            let asked = strategy.ask();
            assert!(asked.len() >= 50);
            let values = asked.iter().map(|candidate| candidate.test.operations[0].operation_seed as f64 / 1e13);
            check(&plan, &asked.iter().map(|candidate| candidate.test.clone()).zip(values).collect::<Vec<_>>());
        }
    }
}

/// Tests that a search would try in random spaces, each below its space.
#[test]
fn every_test_of_a_random_space_reads_back_as_it_was() {
    let mut checked = 0;
    for seed in 0..120 {
        let model = model(seed);
        let folder = tempfile::tempdir().unwrap();
        model.write(folder.path(), "simulator");
        let file = folder.path().join("random.sesame");
        let plans = |text: &str| {
            let found = (SESAME.check)(file.to_str().unwrap(), text, Look::Human { colour: false });
            assert_eq!(found.errors, 0, "space {seed}:\n{}", found.diagnostics);
            found.plans.into_iter().map(|runner| runner.plan).collect::<Vec<_>>()
        };
        for (campaign, plan) in plans(&model.text).iter().enumerate() {
            if plan.campaign.search.strategy().is_none() {
                continue;
            }
            let tried = search::strategy(plan, seed).unwrap().ask().into_iter().take(10);
            let tried: Vec<Test> = tried.map(|candidate| candidate.test).collect();
            let mut text = model.text.clone();
            for (at, test) in tried.iter().enumerate() {
                let operations = test.operations.iter().map(|used| notation::test_operation(plan, used));
                text.push_str(&notation::test_block("", &format!("tried_{at}"), operations));
            }
            let again = plans(&text).swap_remove(campaign);
            let found = again.tests.iter().filter(|known| known.name.starts_with("tried_"));
            assert!(found.map(|known| &known.test).eq(&tried), "space {seed}:\n{text}");
            checked += tried.len();
        }
    }
    assert!(checked > 200, "{checked}");
}

#[test]
fn the_ends_of_what_is_permitted_read_back_as_they_are() {
    let plan = plan(SPACE);
    let at = |share: f64| {
        let operations = (0u32..).map(OperationId).zip(&plan.operations).map(|(id, operation)| TestOperation {
            operation: id,
            activation: if operation.kind.is_offline() {
                Activation::Offline
            } else {
                Activation::Time { start: operation.within.start, end: operation.within.end }
            },
            parameters: operation
                .parameters
                .iter()
                .map(|parameter| {
                    let first = share == 0.0;
                    match &parameter.domain {
                        Domain::Number { low, high, shape, .. } => {
                            let end = if first { *low } else { *high };
                            match shape {
                                sesame_plan::ChoiceKind::Value => Choice::Value { value: end },
                                sesame_plan::ChoiceKind::Range => Choice::Range { low: end, high: end },
                            }
                        }
                        Domain::Point { low, high } => Choice::Point { point: if first { *low } else { *high } },
                        Domain::Texts { texts: items } | Domain::Files { files: items } => {
                            let text = if first { items.first() } else { items.last() };
                            Choice::Text { text: text.unwrap().clone() }
                        }
                    }
                })
                .collect(),
            operation_seed: if share == 0.0 { 0 } else { u64::MAX },
            messages: None,
        });
        Test { operations: operations.collect() }
    };
    check(&plan, &[(at(0.0), f64::MAX), (at(1.0), f64::MIN_POSITIVE), (at(1.0), -5e-324)]);
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(64) })]

    #[test]
    fn every_loss_delay_seed_and_value_reads_back_as_it_was(
        rows in prop::collection::vec(
            (0.0..=1.0f64, 0.0..=0.5f64, any::<u64>(), prop::num::f64::NORMAL | prop::num::f64::ZERO, 0.0..69.0f64),
            20,
        ),
    ) {
        let plan = plan(SPACE);
        let id = |name: &str| {
            let position = plan.operations.iter().position(|operation| operation.name == name).unwrap();
            OperationId(u32::try_from(position).unwrap())
        };
        let tests = rows.into_iter().map(|(loss, delay, operation_seed, value, start)| {
            let operation = |name: &str, choice: f64| TestOperation {
                operation: id(name),
                activation: Activation::Time { start, end: start.next_up() },
                parameters: vec![Choice::Value { value: choice }],
                operation_seed,
                messages: None,
            };
            // SQLite keeps no sign of zero, and the language has none either.
            (Test { operations: vec![operation("lose", loss), operation("lag", delay)] }, value + 0.0)
        });
        check(&plan, &tests.collect::<Vec<_>>());
    }
}
