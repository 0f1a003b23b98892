//! The repository as its users see it: what is written is read, by functions and by views.

#![expect(clippy::disallowed_methods, reason = "tests of files, and of a record of wall time")]

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use proptest::prelude::*;
use rusqlite::Connection;
use tempfile::TempDir;

use sesame_base::observation::{MetricObservation, OperationEffect, Reach};
use sesame_optimise::nsga2::Variation as _;
use sesame_plan::condition::ConditionEnd;
use sesame_plan::{Activation, Bound, Choice, MetricId, OperationId, Test};
use sesame_search::space::TestSpace;
use sesame_search::{Rates, TestVariation};

use super::*;

mod courses;
mod damage;
mod digests;
mod earlier;
mod environment;
mod monitors;
mod robustness;
#[expect(clippy::disallowed_types, reason = "it holds locks as another process does")]
mod runs;

fn folder() -> TempDir {
    tempfile::tempdir().unwrap()
}

fn commit_all(folder: &Path, records: &[TestRecord]) -> Recorder {
    let plan = sample::plan();
    let mut recorder = Recorder::create(folder, &plan, 42, 2).unwrap();
    for record in records {
        recorder.commit(record).unwrap();
    }
    recorder
}

/// The digest of a finished run with these tests.
fn digest_of(records: &[TestRecord]) -> String {
    let folder = folder();
    let repository = commit_all(folder.path(), records).finish("all evaluations done").unwrap();
    repository.digest().unwrap()
}

#[test]
fn everything_that_is_recorded_is_read_back() {
    let folder = folder();
    let plan = sample::plan();
    let records = sample::records(&plan, 60);
    let repository = sample::campaign(folder.path(), &plan, 60);
    for repository in [repository, Repository::open(folder.path()).unwrap()] {
        assert_eq!(repository.plan(), &plan);
        assert_eq!(repository.campaign().seed, 42);
        assert_eq!(repository.campaign().stop.as_deref(), Some("all evaluations done"));
        for record in &records {
            assert_eq!(&repository.test(record.number).unwrap(), record);
        }
        let rows = repository.tests().unwrap();
        assert_eq!(rows.len(), records.len());
        for (row, record) in rows.iter().zip(&records) {
            assert_eq!((row.number, row.origin, &row.test), (record.number, record.origin, &record.test));
            assert_eq!((&row.outcome, row.end), (&record.observation.outcome, record.observation.end));
            let values: Vec<_> = record.observation.metrics.iter().map(MetricValue::from).collect();
            assert_eq!(row.values, values);
        }
        let sets = repository.result_sets().unwrap();
        assert_eq!(sets.iter().map(|set| set.name.as_str()).collect::<Vec<_>>(), ["generation-0", "front"]);
        assert_eq!(repository.latest_result_set().unwrap().unwrap().members, sample::front(&plan, &records));
        let events = repository.events().unwrap();
        assert_eq!(events.iter().map(|event| event.test).collect::<Vec<_>>(), [None, Some(17)]);
        let sessions = repository.sessions().unwrap();
        assert_eq!((sessions.len(), sessions[0].workers, sessions[0].pid), (1, 2, std::process::id()));
        assert!(sessions[0].ended_at >= Some(sessions[0].started_at));
    }
}

#[test]
fn a_test_is_found_by_the_names_people_use() {
    let folder = folder();
    let repository = sample::campaign(folder.path(), &sample::plan(), 20);
    assert_eq!(repository.find("T7").unwrap(), 7);
    assert_eq!(repository.find("7").unwrap(), 7);
    assert_eq!(repository.find("known_jitter").unwrap(), 1);
    assert_eq!(repository.find("reference").unwrap(), 0);
    let error = repository.find("T700").unwrap_err();
    assert!(matches!(error, RecordError::NoSuchTest { ref name, .. } if name == "T700"), "{error}");
}

#[test]
fn the_views_answer_in_the_names_of_the_space() {
    let folder = folder();
    let plan = sample::plan();
    let repository = sample::campaign(folder.path(), &plan, 60);
    let open = Connection::open(folder.path().join(DATABASE)).unwrap();
    let (number, collisions): (u32, f64) = open
        .query_row(
            "SELECT number, collision_occurrence FROM front ORDER BY collision_occurrence DESC LIMIT 1",
            [],
            |row| Ok((row.get(0)?, row.get(1)?)),
        )
        .unwrap();
    assert_eq!(repository.test(number).unwrap().observation.metrics[0].value, Some(collisions));
    let crashes: i64 =
        open.query_row("SELECT count(*) FROM findings WHERE finding = 'crash'", [], |row| row.get(0)).unwrap();
    assert_eq!(crashes, 2);
    let series = |test: u32| -> i64 {
        open.query_row("SELECT count(*) FROM series WHERE test = ?1", [test], |row| row.get(0)).unwrap()
    };
    assert!(series(40) > 0 && series(44) == series(40), "a duplicate shows the series of its original");
}

#[test]
fn the_verdicts_of_the_view_are_those_of_the_function() {
    let folder = folder();
    let plan = sample::plan();
    let repository = sample::campaign(folder.path(), &plan, 60);
    let mut expected = Vec::new();
    for row in repository.tests().unwrap() {
        for requirement in &plan.requirements {
            let word = verdict(requirement.bound, &row.outcome, row.value(requirement.metric)).word();
            expected.push((row.number, requirement.name.clone(), word.to_owned()));
        }
    }
    let open = Connection::open(folder.path().join(DATABASE)).unwrap();
    let mut statement = open.prepare("SELECT test, requirement, verdict FROM verdicts").unwrap();
    let rows = statement.query_map([], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?))).unwrap();
    let view: Vec<(u32, String, String)> = rows.collect::<Result<_, _>>().unwrap();
    assert_eq!(view, expected);
    for word in ["satisfied", "violated", "inconclusive"] {
        assert!(view.iter().any(|row| row.2 == word), "the sample has every verdict");
    }
}

/// The record of a test that conditions switch.
fn conditional_record(plan: &sesame_plan::CampaignPlan) -> TestRecord {
    sample::record(plan, 3, Origin::Search, sample::conditional_test())
}

#[test]
fn activations_of_every_kind_come_back_as_they_were() {
    let folder = folder();
    let plan = sample::plan();
    let record = conditional_record(&plan);
    let recorder = commit_all(folder.path(), std::slice::from_ref(&record));
    assert_eq!(recorder.repository().test(3).unwrap(), record);
    let read = |sql: &str| -> String { recorder.repository().connection.query_row(sql, [], |row| row.get(0)).unwrap() };
    assert_eq!(
        read("SELECT start_condition FROM operations WHERE position = 0"),
        "arm_distance < 450mm and (1.5m/s < top_speed or arm_distance < 450mm)"
    );
    let columns = "start_s || ',' || end_s || ',' || times IS NULL AND start_condition IS NULL";
    assert_eq!(read(&format!("SELECT CAST({columns} AS TEXT) FROM operations WHERE position = 1")), "1");
}

#[test]
fn tests_by_condition_that_hold_an_offline_operation_vary_and_come_back_as_they_were() {
    for end in [ConditionEnd::Condition, ConditionEnd::Length { low: 1.0, high: 15.0 }] {
        let plan = sample::offline_plan(end);
        let mut variation = TestVariation::new(TestSpace::from_plan(&plan).unwrap(), Rates::by_condition(), 5);
        let mut tests = [variation.initial(0), variation.initial(1)];
        let folder = folder();
        let mut recorder = Recorder::create(folder.path(), &plan, 42, 2).unwrap();
        let mut records = Vec::new();
        for generation in 1..=30 {
            tests = variation.offspring([&tests[0], &tests[1]], generation, 0).map(|child| child.genome);
            for test in &tests {
                let number = u32::try_from(records.len()).unwrap() + 1;
                records.push(sample::record(&plan, number, Origin::Search, test.clone()));
                recorder.commit(&records[records.len() - 1]).unwrap();
            }
        }
        let repository = recorder.repository();
        for record in &records {
            assert_eq!(repository.test(record.number).unwrap(), *record);
        }
        let all = records.iter().flat_map(|record| &record.test.operations);
        let (offline, others): (Vec<_>, Vec<_>) = all.partition(|used| used.operation == OperationId(4));
        assert!(offline.iter().all(|used| used.activation == Activation::Offline));
        assert!(others.iter().all(|used| !matches!(used.activation, Activation::Offline | Activation::Time { .. })));
        let chosen = |text: &str| {
            let choice = Choice::Text { text: text.to_owned() };
            offline.iter().filter(|used| used.parameters == [choice.clone()]).count()
        };
        assert!(["cold", "warm", "hot"].into_iter().all(|text| chosen(text) > 0), "{offline:?}");
        assert!(!others.is_empty());
        let bare: u32 = repository
            .connection
            .query_row(
                "SELECT count(*) FROM operations WHERE operation = 'spoil' AND start_s IS NULL AND end_s IS NULL \
                 AND start_condition IS NULL AND end_condition IS NULL AND length_s IS NULL AND times IS NULL",
                [],
                |row| row.get(0),
            )
            .unwrap();
        assert_eq!(bare as usize, offline.len());
    }
}

fn finite() -> impl Strategy<Value = f64> {
    prop_oneof![
        any::<f64>().prop_filter("finite", |x| x.is_finite()),
        Just(0.0),
        Just(f64::MIN_POSITIVE),
        (-10i32..10).prop_map(f64::from)
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn any_finite_numbers_come_back_bit_for_bit(
        value in prop::option::of(finite()),
        low in prop::option::of(finite()),
        high in prop::option::of(finite()),
        not_finite in prop::option::of(finite()),
        series in prop::collection::vec((finite(), finite()), 0..20),
        end in finite(),
    ) {
        let folder = folder();
        let plan = sample::plan();
        let mut record = sample::record(&plan, 3, Origin::Search, Test::default());
        record.observation.end = end;
        record.observation.metrics[0] = MetricObservation { value, set: true, reach: Reach { low, high }, not_finite, series, ..MetricObservation::default() };
        let recorder = commit_all(folder.path(), std::slice::from_ref(&record));
        let read = recorder.repository().test(3).unwrap();
        prop_assert_eq!(&read, &record);
        let bits = |record: &TestRecord| -> Vec<u64> {
            let points = record.observation.metrics[0].series.iter().flat_map(|point| [point.0, point.1]);
            points.chain([record.observation.end]).map(|x| (x + 0.0).to_bits()).collect()
        };
        prop_assert_eq!(bits(&read), bits(&record));
    }

    #[test]
    fn bounds_of_every_kind_mean_the_same_in_the_view(
        kind in 0usize..6, a in -3i32..4, width in 0i32..3, x in prop::option::of(-3i32..4), set in any::<bool>(), outcome in 0usize..4,
        low in prop::option::of(-3i32..4), more in prop::option::of(0i32..4), whole in any::<bool>(), finite in any::<bool>(),
    ) {
        let value = f64::from(a);
        let bound = [
            Bound::AtMost { value }, Bound::Below { value }, Bound::AtLeast { value }, Bound::Above { value },
            Bound::Equal { value }, Bound::Within { low: value, high: f64::from(a + width) },
        ][kind];
        let mut plan = sample::plan();
        plan.requirements.truncate(1);
        plan.requirements[0].bound = bound;
        let mut record = sample::record(&plan, 3, Origin::Search, Test::default());
        record.observation.outcome = [
            Outcome::Completed, Outcome::NoEffect, Outcome::Timeout { limit: 1.0 }, Outcome::Crash { message: String::new() },
        ][outcome].clone();
        // A value of a whole run or of one that broke off; also values that do not fit their reach, which no run shows.
        let shown = MetricValue {
            reach: Reach { low: low.map(f64::from), high: more.map(|more| f64::from(low.unwrap_or(0) + more)) },
            not_finite: (!finite).then_some(1.5),
            ..MetricValue::whole(x.map(f64::from), set)
        };
        let shown = if whole { MetricValue::whole(shown.value, set) } else { shown };
        let MetricValue { value: measured, reach, not_finite, .. } = shown;
        record.observation.metrics[0] = MetricObservation { value: measured, set, reach, not_finite, ..MetricObservation::default() };
        let folder = folder();
        let mut recorder = Recorder::create(folder.path(), &plan, 1, 1).unwrap();
        recorder.commit(&record).unwrap();
        let said = verdict(bound, &record.observation.outcome, shown);
        let again = Repetition::of(3, 1, 7, &record.observation);
        recorder.put_repetition(&again, &[]).unwrap();
        let connection = &recorder.repository().connection;
        let view: String = connection.query_row("SELECT verdict FROM verdicts", [], |row| row.get(0)).unwrap();
        prop_assert_eq!(view, said.word());
        let found = |finding: &str| -> i64 {
            let sql = "SELECT count(*) FROM findings WHERE finding = ?1";
            connection.query_row(sql, [finding], |row| row.get(0)).unwrap()
        };
        prop_assert_eq!(found("violation"), i64::from(said == Verdict::Violated));
        prop_assert_eq!(found("not_finite"), i64::from(shown.not_finite.is_some()));
        let confirmed: i64 = connection
            .query_row("SELECT coalesce(sum(confirmed), 0) FROM confirmations", [], |row| row.get(0))
            .unwrap();
        prop_assert_eq!(confirmed, i64::from(said == Verdict::Violated));
        let row = &recorder.repository().tests().unwrap()[0];
        prop_assert_eq!(row.value(MetricId(0)), shown);
    }
}

#[test]
fn what_was_imported_keeps_its_intervals_and_names_without_counts() {
    let folder = tempfile::tempdir().unwrap();
    let plan = sample::plan();
    let mut recorder = Recorder::create(folder.path(), &plan, 1, 0).unwrap();
    let mut record = sample::record(&plan, 1, Origin::Search, plan.tests[0].test.clone());
    record.observation.outcome = Outcome::Unknown;
    for effect in &mut record.observation.operations {
        *effect = OperationEffect { intervals: effect.intervals.clone(), ..OperationEffect::default() };
    }
    recorder.commit(&record).unwrap();
    recorder.put_original_names([(1, "Test_001_20_06_2023")]).unwrap();
    let repository = recorder.finish("imported").unwrap();
    assert_eq!(repository.test(1).unwrap(), record);
    assert!(!record.observation.operations[0].intervals.is_empty());
    assert_eq!(repository.find("Test_001_20_06_2023").unwrap(), 1);
    assert_eq!(repository.original_names().unwrap(), [(1, "Test_001_20_06_2023".to_owned())].into());
    let seen: Option<i64> =
        repository.connection.query_row("SELECT seen FROM operations", [], |row| row.get(0)).unwrap();
    assert_eq!(seen, None, "nobody counted");
}

#[test]
fn tests_that_are_committed_together_are_all_recorded_or_none() {
    let plan = sample::plan();
    let mut records = sample::records(&plan, 20);
    let together = folder();
    let mut recorder = Recorder::create(together.path(), &plan, 1, 0).unwrap();
    recorder.commit_all(records.clone()).unwrap();
    let together = recorder.repository().tests().unwrap();
    assert_eq!(together, commit_all(folder().path(), &records).repository().tests().unwrap());

    let none = folder();
    let mut recorder = Recorder::create(none.path(), &plan, 1, 0).unwrap();
    records.last_mut().unwrap().observation.end = f64::NAN;
    let refused = recorder.commit_all(records).unwrap_err();
    assert!(matches!(refused, RecordError::Unrecordable { .. }), "{refused}");
    assert_eq!(recorder.repository().tests().unwrap(), []);
}

#[test]
fn a_set_of_results_that_is_recorded_already_is_not_written_again() {
    let folder = folder();
    let mut recorder = commit_all(folder.path(), &sample::records(&sample::plan(), 5));
    let set =
        ResultSet { name: "a".to_owned(), generation: Some(0), status: Status::Intermediate, members: vec![1, 2] };
    recorder.put_result_set(&set).unwrap();
    let writes = |recorder: &Recorder| recorder.repository().connection.total_changes();
    let before = writes(&recorder);
    recorder.put_result_set(&set).unwrap();
    assert_eq!(writes(&recorder), before);
    for other in [
        ResultSet { members: vec![2, 1], ..set.clone() },
        ResultSet { generation: None, ..set.clone() },
        ResultSet { status: Status::Final, ..set.clone() },
    ] {
        recorder.put_result_set(&other).unwrap();
        assert_eq!(recorder.repository().result_sets().unwrap(), [other]);
    }
}

#[test]
fn reading_one_test_takes_no_longer_among_many_than_among_few() {
    // How much the database does is counted in the steps of its machine, of which there are as many on any day.
    let steps_among = |tests: u32| {
        let folder = folder();
        let plan = sample::plan();
        let mut repository = sample::campaign(folder.path(), &plan, tests);
        let steps = Arc::new(AtomicU64::new(0));
        let counted = Arc::clone(&steps);
        let count = move || {
            counted.fetch_add(1, Ordering::Relaxed);
            false
        };
        repository.connection.progress_handler(1, Some(count)).unwrap();
        assert_eq!(repository.records(11..=20, false).unwrap().len(), 10);
        assert_eq!(repository.test(12).unwrap().number, 12);
        steps.load(Ordering::Relaxed)
    };
    let (few, many) = (steps_among(30), steps_among(1500));
    // Looking at all rows would take some twenty times as many.
    assert!(few > 100 && many < 2 * few, "{many} among many, {few} among few");
}
