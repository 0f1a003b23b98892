//! Results of earlier releases: they are read with the digest they were given, and nothing is added to them.

use std::path::Path;

use rusqlite::Connection;
use tempfile::TempDir;

use super::folder;
use crate::analysis::{self, Run, Selection, regions};
use crate::record::{DATABASE, Recorder, Repository, SCHEMA};

const SCHEMA_7: &str = include_str!("../fixtures/results_of_schema_7.sql");

/// What a runner of an earlier schema recorded, in a folder of its own.
fn of_earlier(fixture: &str) -> TempDir {
    let folder = folder();
    let open = Connection::open(folder.path().join(DATABASE)).unwrap();
    open.execute_batch(fixture).unwrap();
    folder
}

/// Records everything in a repository once more, as this release does.
fn recorded_again(repository: &Repository) -> (TempDir, Repository) {
    let folder = folder();
    let facts = repository.campaign();
    let mut recorder = Recorder::create(folder.path(), &facts.plan, facts.seed, 2).unwrap();
    for number in repository.numbers().unwrap() {
        recorder.commit(&repository.test(number).unwrap()).unwrap();
    }
    for repetition in repository.repetitions().unwrap().values().flatten() {
        recorder.put_repetition(repetition, &[]).unwrap();
    }
    for set in repository.result_sets().unwrap() {
        recorder.put_result_set(&set).unwrap();
    }
    for coverage in repository.coverage().unwrap() {
        recorder.put_coverage(&coverage).unwrap();
    }
    let reference = repository.reference_point().unwrap().map(|point| {
        facts.plan.objectives().zip(point).map(|(objective, value)| objective.oriented(value)).collect::<Vec<_>>()
    });
    for indicators in repository.indicators().unwrap() {
        recorder.put_indicators(&indicators, reference.as_deref()).unwrap();
    }
    for event in repository.events().unwrap().into_iter().filter(|event| event.test.is_none()) {
        recorder.put_event(&event).unwrap();
    }
    let stop = facts.stop.clone().unwrap();
    (folder, recorder.finish(&stop).unwrap())
}

/// Every analysis of the results in a folder, and the reports, as texts.
fn analyses(folder: &Path) -> Vec<String> {
    let repository = &Repository::open(folder).unwrap();
    let all = Selection::default();
    let convention = sesame_search::sspr::Convention::Ours;
    let dimensions = [sesame_plan::Dimension::T1, sesame_plan::Dimension::P1, sesame_plan::Dimension::O1];
    let axes = dimensions.map(|dimension| sesame_plan::GridAxis { dimension, low: 0.0, high: 1.0, cells: 3 });
    let grid = sesame_search::coverage::Grid::new(axes.to_vec()).unwrap();
    let covered = analysis::coverage(repository, &all, grid, 1, convention).unwrap();
    let run = Run { group: "all".to_owned(), repository: Repository::open(folder).unwrap() };
    let summary = crate::report::summary(repository).unwrap();
    let tests = repository.numbers().unwrap();
    let shown = tests.iter().map(|&number| crate::report::show(repository, &format!("T{number}")).unwrap());
    vec![
        analysis::tests(repository, &all).unwrap().csv(),
        analysis::front(repository, &all).unwrap().csv(),
        analysis::sspr(repository, &all, &dimensions, convention).unwrap().csv(),
        covered.curve().csv(),
        covered.cells().csv(),
        analysis::indicators(repository, None).unwrap().dataset().csv(),
        analysis::compare(&[run], None, None).unwrap().groups().csv(),
        regions::table(&regions::all_regions(repository, &all).unwrap()).csv(),
        serde_json::to_string(&summary).unwrap(),
        serde_json::to_string(&shown.collect::<Vec<_>>()).unwrap(),
        crate::report::junit(&summary),
    ]
}

/// Changes a file of results.
fn change(folder: &Path, sql: &str) {
    Connection::open(folder.join(DATABASE)).unwrap().execute_batch(sql).unwrap();
}

#[test]
fn results_of_schema_7_are_read_with_the_digest_they_were_given_and_nothing_is_added_to_them() {
    // Its first releases recorded no robustness over time.
    let first = "DROP VIEW robustness; DROP VIEW robustness_points; DROP TABLE robustness_pieces";
    for of_release in ["", first] {
        let folder = of_earlier(SCHEMA_7);
        change(folder.path(), of_release);
        let before = std::fs::read(folder.path().join(DATABASE)).unwrap();
        let repository = Repository::open(folder.path()).unwrap();
        let given = "1b2d60613842ea6fa43f672b75e4fd90b32d2817391d30f8b423c9e50bc3da44";
        assert_eq!(repository.digest().unwrap(), given);
        assert!(crate::report::page(&repository).unwrap().contains(given));
        let record = repository.test(1).unwrap();
        assert!(record.observation.traffic.is_empty(), "nobody wrote down what was heard");
        assert_eq!(
            repository.decisions(0..=20).unwrap().values().flatten().map(|it| it.hazards.len()).sum::<usize>(),
            8
        );
        let (again, _) = recorded_again(&repository);
        assert_eq!(analyses(folder.path()), analyses(again.path()));
        drop(repository);
        refuses_writers(folder.path(), 7);
        assert_eq!(std::fs::read(folder.path().join(DATABASE)).unwrap(), before);
    }
}

#[test]
fn the_same_results_keep_their_digest_in_later_releases() {
    let folder = of_earlier(SCHEMA_7);
    let (again, _) = recorded_again(&Repository::open(folder.path()).unwrap());
    // The version is part of the content.
    change(again.path(), "UPDATE campaign SET runtime = '0.1.0'");
    let given = "1b2d60613842ea6fa43f672b75e4fd90b32d2817391d30f8b423c9e50bc3da44";
    assert_eq!(Repository::open(again.path()).unwrap().digest().unwrap(), given);
}

#[test]
fn a_schema_has_its_own_words_and_tables() {
    let changes = [
        ("UPDATE tests SET outcome = 'void' WHERE number = 3", "cannot have ended as `void`"),
        ("PRAGMA user_version = 8", "is not the one that a run makes"),
    ];
    for (sql, words) in changes {
        let folder = of_earlier(SCHEMA_7);
        change(folder.path(), &format!("PRAGMA ignore_check_constraints = 1; {sql}"));
        let said = Repository::open(folder.path()).and_then(|repository| repository.tests()).unwrap_err().to_string();
        assert!(said.contains(words), "{said}");
    }
}

fn refuses_writers(folder: &Path, schema: i64) {
    for added in [Recorder::resume(folder, 1), Recorder::reopen(folder, 1)] {
        let said = added.unwrap_err().to_string();
        assert!(said.contains(&format!("schema {schema}, this release writes {SCHEMA}: they can be read")), "{said}");
    }
}
