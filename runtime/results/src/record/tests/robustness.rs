//! Robustness signals in results: read back, outside the digest, and missing in earlier files.

use rusqlite::Connection;

use super::folder;
use crate::record::{DATABASE, Origin, Recorder, Repository, sample};

const SIGNAL: [(f64, f64); 4] = [(0.02, 640.0), (30.1, 120.5), (31.0, 400.0), (70.0, 400.0)];

/// A campaign in which a test has a robustness signal or not.
fn recorded(folder: &std::path::Path, signal: &[(f64, f64)]) -> Repository {
    let plan = sample::plan();
    let mut recorder = Recorder::create(folder, &plan, 1, 1).unwrap();
    let mut record = sample::record(&plan, 3, Origin::Search, plan.tests[0].test.clone());
    record.observation.metrics[4].robustness = signal.to_vec();
    recorder.commit(&record).unwrap();
    recorder.finish("done").unwrap()
}

#[test]
fn a_signal_comes_back_with_its_test_and_sql_reads_each_point_of_it() {
    let folder = folder();
    let repository = recorded(folder.path(), &SIGNAL);
    assert_eq!(repository.test(3).unwrap().observation.metrics[4].robustness, SIGNAL);
    assert!(repository.records(3..=3, false).unwrap()[0].observation.metrics[4].robustness.is_empty());
    let open = Connection::open(folder.path().join(DATABASE)).unwrap();
    let mut statement = open
        .prepare("SELECT time_s, value FROM robustness WHERE test_name = 'T3' AND metric = 'arm_distance'")
        .unwrap();
    let points: Vec<(f64, f64)> =
        statement.query_map([], |row| Ok((row.get(0)?, row.get(1)?))).unwrap().collect::<Result<_, _>>().unwrap();
    assert_eq!(points, SIGNAL);
}

#[test]
fn the_digest_is_of_what_was_measured_not_of_its_explanation() {
    let (with, without) = (folder(), folder());
    assert_eq!(recorded(with.path(), &SIGNAL).digest().unwrap(), recorded(without.path(), &[]).digest().unwrap());
}

#[test]
fn another_table_in_its_place_is_refused() {
    let folder = folder();
    drop(recorded(folder.path(), &SIGNAL));
    let open = Connection::open(folder.path().join(DATABASE)).unwrap();
    open.execute_batch("ALTER TABLE robustness_pieces ADD COLUMN more TEXT").unwrap();
    drop(open);
    let said = Repository::open(folder.path()).err().unwrap().to_string();
    assert!(said.contains("the table `robustness_pieces` is not the one that a run makes"), "{said}");
}
