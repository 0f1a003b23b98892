//! Campaigns and known tests whose operations conditions switch, on the gearbox cell.

use std::collections::BTreeSet;
use std::fs;

use sesame_base::condition::constant::has_constant_part;
use sesame_base::condition::depth;
use sesame_base::observation::Outcome;
use sesame_plan::condition::{Condition, ConditionSpace};
use sesame_plan::{Activation, ActivationMode};
use sesame_record::{Origin, Repository, TestRecord};
use sesame_tests::{Project, Runner, shared};

/// A short run of a campaign by condition, in `r/5`: what it may grow, and the tests that its search made.
fn searched(runner: &Runner) -> (ConditionSpace, Vec<TestRecord>) {
    runner.run(&["--results", "r", "--seed", "5", "--evaluations", "60"]).expect(0);
    let repository = Repository::open(&runner.folder.join("r/5")).unwrap();
    let ActivationMode::Condition { space } = repository.plan().campaign.activation.clone() else {
        panic!("the campaign is by condition")
    };
    let rows = repository.tests().unwrap().into_iter().filter(|row| row.origin == Origin::Search);
    let records: Vec<TestRecord> = rows.map(|row| repository.test(row.number).unwrap()).collect();
    assert_eq!(records.len(), 60);
    (space, records)
}

/// The start conditions of these tests, and where there are any their end conditions.
fn conditions(records: &[TestRecord]) -> Vec<&Condition> {
    let operations = records.iter().flat_map(|record| &record.test.operations);
    operations
        .flat_map(|operation| match &operation.activation {
            Activation::Condition { start, end, .. } => vec![start, end],
            Activation::ConditionFor { start, .. } => vec![start],
            Activation::Time { .. } | Activation::Offline => panic!("{operation:?} in a campaign by condition"),
        })
        .collect()
}

/// What holds of every run by condition, for each way to end an activation.
fn holds_together(space: &ConditionSpace, records: &[TestRecord]) {
    for condition in conditions(records) {
        assert!(depth(condition) <= space.depth, "{condition:?}");
        assert!(!has_constant_part(condition, &space.variables), "{condition:?}");
    }
    for record in records {
        for effect in &record.observation.operations {
            let spans = &effect.intervals;
            assert!(spans.len() <= space.times as usize, "T{}: {spans:?}", record.number);
            assert!(spans.windows(2).all(|pair| pair[0].end <= pair[1].start), "T{}: {spans:?}", record.number);
            assert!(!spans.is_empty() || !effect.counters.any_effect(), "T{} did what it did not do", record.number);
        }
        let active = record.observation.operations.iter().any(|effect| effect.counters.any_effect());
        assert_eq!(record.observation.outcome == Outcome::NoEffect, !active, "T{}", record.number);
    }
    let active = records.iter().filter(|record| record.observation.outcome == Outcome::Completed).count();
    assert!(active > 20, "only {active} of 60 tests disturbed anything");
}

#[test]
fn conditions_that_a_search_grows_switch_operations_on_and_off() {
    let runner = shared("by_condition", "kuka_cell_by_condition", "condition_experiment", Project::kuka_cell);
    let (space, records) = searched(&runner);
    holds_together(&space, &records);
    let depths: BTreeSet<u32> = conditions(&records).into_iter().map(depth).collect();
    assert_eq!(depths.last(), Some(&space.depth), "{depths:?}");
    // Some activation ended while the run went on: by its end condition, as nothing else ends it before its window
    // does.
    let effects = records.iter().flat_map(|record| &record.observation.operations);
    assert!(effects.flat_map(|effect| &effect.intervals).any(|span| span.end < 60.0));
    let shown = runner.run(&["show", "T2", "--results", "r/5"]).expect(0).out;
    assert!(shown.contains("when ") && shown.contains(" until "), "{shown}");
}

#[test]
fn an_activation_with_a_length_ends_exactly_then() {
    let runner = Project::kuka_cell("kuka_cell_by_condition_for").build("condition_limited_experiment");
    let (space, records) = searched(&runner);
    holds_together(&space, &records);
    let mut whole = 0;
    for record in &records {
        for (operation, effect) in record.test.operations.iter().zip(&record.observation.operations) {
            let Activation::ConditionFor { length, .. } = operation.activation else { panic!("{operation:?}") };
            assert!((1.0..=15.0).contains(&length));
            for span in &effect.intervals {
                // To the nanosecond, unless the window or the run cut it short.
                let exact = (span.length() - length).abs() < 2e-9;
                assert!(exact || (span.length() < length && span.end >= 60.0), "{span:?} of {length} s");
                whole += usize::from(exact);
            }
        }
    }
    assert!(whole > 20, "only {whole} activations ran their whole length");
}

#[test]
fn operations_may_be_activated_again() {
    let runner = Project::kuka_cell("kuka_cell_by_condition_again").build("condition_repeated_experiment");
    let (space, records) = searched(&runner);
    assert_eq!(space.times, 3);
    holds_together(&space, &records);
    let effects = records.iter().flat_map(|record| &record.observation.operations);
    let most = effects.map(|effect| effect.intervals.len()).max();
    assert_eq!(most, Some(3));
}

#[test]
fn a_campaign_by_condition_comes_out_the_same_on_any_number_of_workers_and_when_it_is_resumed() {
    let runner = shared("by_condition_resumed", "kuka_cell_by_condition", "condition_experiment", Project::kuka_cell);
    let run = |results: &str, workers: &str| {
        let arguments = ["--results", results, "--seed", "7", "--evaluations", "40", "--workers", workers];
        runner.run(&arguments).expect(0).digest()
    };
    let digest = run("one", "1");
    assert_eq!(run("two", "2"), digest);
    // As if it had been stopped in the middle of its third generation: what came later is not there.
    let folder = runner.folder.join("two/7");
    let connection = rusqlite::Connection::open(folder.join(sesame_record::DATABASE)).unwrap();
    // The order in which rows go is of no interest here.
    connection.pragma_update(None, "foreign_keys", false).unwrap();
    let later = "SELECT number FROM tests WHERE origin = 'search' ORDER BY number LIMIT -1 OFFSET 25";
    for (table, column) in [
        ("parents", "test"),
        ("operations", "test"),
        ("choices", "test"),
        ("intervals", "test"),
        ("metric_values", "test"),
        ("series_pieces", "test"),
        ("events", "test"),
        ("wall_times", "test"),
        ("traffic", "test"),
        ("unreached", "test"),
        ("tests", "number"),
    ] {
        connection.execute(&format!("DELETE FROM {table} WHERE {column} IN ({later})"), []).unwrap();
    }
    connection.execute("DELETE FROM result_sets WHERE generation >= 2 OR status = 'final'", []).unwrap();
    let kept = "DELETE FROM result_set_members WHERE result_set NOT IN (SELECT name FROM result_sets)";
    connection.execute(kept, []).unwrap();
    assert_eq!(connection.execute("UPDATE campaign SET stop = NULL", []).unwrap(), 1);
    drop(connection);
    assert_eq!(runner.run(&["resume", "two/7"]).expect(0).digest(), digest);
    let same = runner.run(&["replay", "T9", "--results", "two/7"]).expect(0);
    assert!(same.out.contains("came out the same, bit for bit"), "{}", same.out);
}

#[test]
fn known_tests_by_condition_are_held_to_what_they_expect_and_void_ones_said_to_be() {
    let project = Project::kuka_cell_with(
        "kuka_cell_known_by_condition",
        "
        test near { jitter_link0 offset [0.1rad, 0.2rad] when near_zone1 < 5 until link0_low > 1  expect fuzzing_time > 0s }
        test burst {
          jitter_link1 offset [0.27rad, 0.29rad] when near_zone2 < 0 or near_zone3 < 0 for 2s at most 3 times seed 4
          expect fuzzing_time <= 6s
        }
        test never {
          jitter_link0 offset [0.1rad, 0.2rad] when near_zone1 > 1000 until link0_low > 1
          expect fuzzing_time == 0s
        }
        ",
    );
    let runner = project.build("condition_experiment");
    let known = runner.run(&["known", "near", "burst", "never", "--results", "r"]).expect(0);
    assert!(known.out.contains("3 expectations satisfied"), "{}", known.out);
    let repository = Repository::open(&runner.folder.join("r/known")).unwrap();
    let test = |name: &str| repository.test(repository.find(name).unwrap()).unwrap();
    assert_eq!(test("never").observation.outcome, Outcome::NoEffect);
    for span in &test("burst").observation.operations[0].intervals {
        assert!((span.length() - 2.0).abs() < 2e-9 || span.end >= 60.0, "{span:?}");
    }
    // Undisturbed, the gripper is deep inside from 9.92 s to 13.1 s, and from 45.82 s to 49.96 s.
    runner.run(&["known", "jitter_bursts", "--results", "example"]).expect(0);
    let repository = Repository::open(&runner.folder.join("example/known")).unwrap();
    let burst = repository.test(repository.find("jitter_bursts").unwrap()).unwrap().observation;
    let starts: Vec<f64> = burst.operations[0].intervals.iter().map(|span| span.start).collect();
    assert!(starts.first().is_some_and(|start| (9.0..11.0).contains(start)), "{starts:?}");
    assert!(starts.iter().any(|start| (44.0..50.0).contains(start)), "the second place is disturbed too: {starts:?}");
    assert!((2..=3).contains(&starts.len()), "{starts:?}");
    assert!(burst.operations[0].last_touch > Some(44.0), "{starts:?}");
    assert_eq!(test("near").observation.operations[0].intervals.len(), 1);
}

#[test]
fn an_exported_test_by_condition_reproduces_its_values() {
    let project = Project::kuka_cell_with("kuka_cell_by_condition_exported", "");
    let campaigns = ["condition_experiment", "condition_limited_experiment", "condition_repeated_experiment"];
    let mut text = fs::read_to_string(&project.space).unwrap();
    let mut found = Vec::new();
    for campaign in campaigns {
        let runner = project.build(campaign);
        runner.run(&["--results", campaign, "--seed", "5", "--evaluations", "20"]).expect(0);
        let repository = Repository::open(&runner.folder.join(campaign).join("5")).unwrap();
        let rows = repository.tests().unwrap();
        let worst = rows.iter().rfind(|row| row.origin == Origin::Search && row.outcome == Outcome::Completed);
        let record = repository.test(worst.unwrap().number).unwrap();
        let name = format!("T{}", record.number);
        let results = format!("{campaign}/5");
        text.push_str(
            &runner
                .run(&["export", &name, "--results", &results, "--pin", "--name", campaign_test(campaign)])
                .expect(0)
                .out,
        );
        found.push((campaign, record));
    }
    fs::write(&project.space, text).unwrap();
    let runner = project.build("condition_experiment");
    let names = campaigns.map(campaign_test);
    let known = runner.run(&[&["known"], &names[..], &["--results", "again"]].concat()).expect(0);
    // Two objectives of each, and the metric of R4, which two of them violate.
    assert!(known.out.contains("8 expectations satisfied"), "{}", known.out);
    let again = Repository::open(&runner.folder.join("again/known")).unwrap();
    for (campaign, record) in found {
        let repeated = again.test(again.find(campaign_test(campaign)).unwrap()).unwrap();
        assert_eq!(repeated.test.operations.len(), record.test.operations.len());
        assert_eq!(repeated.observation.operations, record.observation.operations, "{campaign}");
    }
}

/// The name under which a test of a campaign is exported.
fn campaign_test(campaign: &str) -> &'static str {
    match campaign {
        "condition_experiment" => "found_by_condition",
        "condition_limited_experiment" => "found_with_length",
        _ => "found_with_repetition",
    }
}
