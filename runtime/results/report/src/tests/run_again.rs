//! Reports of tests that were run again.

use sesame_base::observation::{MetricObservation, Outcome};
use sesame_record::{MetricValue, Recorder, Repetition};

use super::*;

/// A fresh run of a test, which ended like this after 70 s.
fn again(test: u32, position: u32, simulator_seed: u64, outcome: Outcome, values: Vec<MetricValue>) -> Repetition {
    Repetition { test, position, simulator_seed, outcome, end: 70.0, messages: 1, values, hazards: Vec::new() }
}

/// The sample's campaign, which confirms by three runs each: some findings come again always, some sometimes, some
/// never.
fn confirmed() -> (tempfile::TempDir, Repository) {
    let folder = tempfile::tempdir().unwrap();
    let mut plan = sample::plan();
    plan.campaign.confirm =
        Some(sesame_plan::Confirmation { times: 3, by: sesame_plan::Statistic::Mean, violations: false });
    let first = sample::campaign(folder.path(), &plan, 60);
    let members = first.latest_result_set().unwrap().unwrap().members;
    let rows = first.tests().unwrap();
    drop(first);
    let mut recorder = Recorder::reopen(folder.path(), 1).unwrap();
    let crash = members.len() - 1;
    for (at, &test) in members.iter().enumerate() {
        for position in 1..=3 {
            let mut values = rows[test as usize].values.clone();
            let mut outcome = Outcome::Completed;
            match (at, position) {
                (1, 2) => values.iter_mut().for_each(|value| *value = MetricValue::default()),
                (2, _) | (4, 2) => {
                    values[0] = MetricValue::whole(Some(0.0), false);
                    values[2] = MetricValue::whole(Some(1.0), true);
                    values[3] = MetricValue::whole(Some(60.0), true);
                    values[4] = MetricValue::whole(Some(200.0), true);
                }
                (at, 3) if at == crash => outcome = Outcome::Crash { message: "it fell over".to_owned() },
                _ => {}
            }
            recorder.put_repetition(&again(test, position, u64::from(position), outcome, values), &[]).unwrap();
        }
    }
    // A crash is a finding too, whether or not a front has it.
    let crash = || Outcome::Crash { message: "index out of bounds".to_owned() };
    for (position, outcome) in [(4, crash()), (5, Outcome::Completed)] {
        let mut values = rows[17].values.clone();
        if outcome.is_whole() {
            for shown in &mut values {
                *shown = MetricValue::whole(shown.value, shown.set);
            }
        }
        recorder.put_repetition(&again(17, position, 9, outcome, values), &[]).unwrap();
    }
    let repository = recorder.finish("all evaluations done").unwrap();
    (folder, repository)
}

#[test]
fn findings_that_were_run_again_say_how_often_they_came_again() {
    let (_folder, repository) = confirmed();
    let summary = summary(&repository).unwrap();
    insta::assert_snapshot!("confirmed_summary", summary_text(&summary, WIDE));
    let first = summary.confirmed[0].clone();
    insta::assert_snapshot!("confirmed_test", test_text(&show(&repository, &first.test.to_string()).unwrap(), WIDE));
    insta::assert_snapshot!("confirmed_tests", confirmed_text(&summary.confirmed, WIDE));
    let standings: std::collections::BTreeSet<&str> =
        summary.confirmed.iter().filter_map(|test| test.standing).map(Standing::words).collect();
    assert_eq!(standings.into_iter().collect::<Vec<_>>(), ["confirmed", "flaky", "not confirmed"]);
    let junit = junit(&summary);
    assert!(junit.contains("; in fresh runs: T"), "{junit}");
    let page = page(&repository).unwrap();
    parsed(&page);
    assert!(page.contains("Values are means of 3 fresh runs of each test.") && page.contains("not confirmed"));
}

#[test]
fn the_views_of_findings_agree_with_the_report() {
    let (folder, repository) = confirmed();
    let summary = summary(&repository).unwrap();
    let count = |count: usize| u32::try_from(count).unwrap();
    let is_failure = |finding: &str| ["crash", "timeout"].contains(&finding);
    let mut told = Vec::new();
    for test in &summary.confirmed {
        for finding in test.findings.iter().filter(|finding| !is_failure(&finding.finding)) {
            told.push((
                test.number,
                finding.finding.clone(),
                count(finding.again),
                count(finding.conclusive),
                count(test.repetitions),
            ));
        }
    }
    assert!(told.len() > 3);
    let open = rusqlite::Connection::open(folder.path().join(sesame_record::DATABASE)).unwrap();
    let mut statement =
        open.prepare("SELECT test, requirement, confirmed, conclusive, repetitions FROM confirmations").unwrap();
    let rows =
        statement.query_map([], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?, row.get(4)?))).unwrap();
    assert_eq!(rows.collect::<Result<Vec<(u32, String, u32, u32, u32)>, _>>().unwrap(), told);

    // What each test violates, crashes that stand among it.
    let mut told: Vec<(String, String)> = list(&repository)
        .unwrap()
        .tests
        .into_iter()
        .filter(|test| test.duplicate_of.is_none())
        .flat_map(|test| test.violates.into_iter().map(move |requirement| (test.test.to_string(), requirement)))
        .collect();
    let failures = summary.failures.iter().filter(|failure| failure.stands());
    told.extend(failures.map(|failure| (failure.test.to_string(), failure.outcome.clone())));
    told.sort();
    let mut statement = open.prepare("SELECT test_name, coalesce(requirement, finding) FROM findings").unwrap();
    let rows = statement.query_map([], |row| Ok((row.get(0)?, row.get(1)?))).unwrap();
    let mut found = rows.collect::<Result<Vec<(String, String)>, _>>().unwrap();
    found.sort();
    assert_eq!(found, told);
}

/// The results of a test that violates R1 in exactly these of its runs, the first one and fresh ones; `None` is a crash
/// at the very beginning.
fn run_again(first: bool, fresh: &[Option<bool>]) -> (tempfile::TempDir, Repository) {
    let folder = tempfile::tempdir().unwrap();
    let plan = sample::plan();
    let mut recorder = Recorder::create(folder.path(), &plan, 42, 1).unwrap();
    let collisions = |violates: bool| MetricValue::whole(Some(f64::from(u8::from(violates))), true);
    let reference = sample::record(&plan, 0, Origin::Reference, sesame_plan::Test::default());
    recorder.commit(&reference).unwrap();
    let mut record = sample::record(&plan, 1, Origin::Known(sesame_plan::KnownTestId(0)), plan.tests[0].test.clone());
    record.observation.metrics = reference.observation.metrics.clone();
    record.observation.metrics[0] = MetricObservation::whole(collisions(first).value, true, Vec::new());
    recorder.commit(&record).unwrap();
    for (position, violates) in (1..).zip(fresh) {
        let mut values: Vec<MetricValue> =
            record.observation.metrics.iter().map(|shown| MetricValue::whole(shown.value, shown.set)).collect();
        values[0] = collisions(*violates == Some(true));
        let mut outcome = Outcome::Completed;
        if violates.is_none() {
            values.clear();
            outcome = Outcome::Crash { message: "it fell over".to_owned() };
        }
        recorder.put_repetition(&again(1, position, u64::from(position), outcome, values), &[]).unwrap();
    }
    let repository = recorder.finish("all evaluations done").unwrap();
    (folder, repository)
}

#[test]
fn a_requirement_that_only_the_first_run_satisfied_is_violated_in_every_report() {
    let (_folder, repository) = run_again(false, &[Some(true), Some(true), Some(false), Some(true)]);
    let summary = summary(&repository).unwrap();
    let r1 = &summary.requirements[0];
    assert_eq!((r1.violated, r1.flaky, r1.fresh_only, r1.satisfied), (1, 1, 1, 0));
    assert!(headline(&summary).contains("1 requirement violated (R1 by 1 test)"), "{}", headline(&summary));
    let said = "3 of 4 (0.30–0.95) flaky, not in its first run";
    assert_eq!(summary.confirmed[0].words(), format!("R1 {said}"));
    assert_eq!(list(&repository).unwrap().tests[1].violates, ["R1"]);
    let text = test_text(&show(&repository, "T1").unwrap(), WIDE);
    assert!(text.contains(said) && text.contains("3 of 4 (0.30–0.95)"), "{text}");
    let junit = junit(&summary);
    assert!(junit.contains("<failure message=\"violated by 1 of 1 test"), "{junit}");
    assert!(junit.contains(&format!("; in fresh runs: T1 {said}")), "{junit}");
    assert!(page(&repository).unwrap().contains(">1 flaky<"));
}

#[test]
fn a_violation_that_no_fresh_run_shows_fails_nothing_and_stays_listed() {
    let (_folder, repository) = run_again(true, &[Some(false), None, Some(false)]);
    let summary = summary(&repository).unwrap();
    let r1 = &summary.requirements[0];
    assert_eq!((r1.violated, r1.not_confirmed, r1.satisfied), (0, 1, 1));
    let text = summary_text(&summary, WIDE);
    assert!(text.contains("1 not confirmed"), "{text}");
    assert_eq!(summary.confirmed[0].findings[0].words(), "0 of 2 (0.00–0.66) not confirmed, 1 run inconclusive");
    let junit = junit(&summary);
    assert!(!junit.contains("<failure") && junit.contains("T1 0 of 2"), "{junit}");
    // The crash of a fresh run is a finding, though the first run came to its end.
    assert_eq!(summary.failures.iter().filter(|failure| failure.stands()).count(), 1);
}

#[test]
fn violations_that_were_seen_in_one_run_only_are_counted() {
    let (_folder, repository) = confirmed();
    let found = summary(&repository).unwrap();
    let rows = list(&repository).unwrap().tests;
    let again: Vec<_> = found.confirmed.iter().map(|test| test.test).collect();
    let once = rows.iter().filter(|row| {
        !row.violates.is_empty()
            && row.duplicate_of.is_none()
            && row.origin != "reference"
            && !again.contains(&row.test)
    });
    let sentence = format!("{} tests that violate a requirement were run once only", once.count());
    assert!(summary_text(&found, WIDE).contains(&sentence), "{sentence}");
    assert!(page(&repository).unwrap().contains(&sentence));
}
