//! Robustness signals in results: read back, outside the digest, and missing in earlier files.

use rusqlite::Connection;

use sesame_base::observation::Lost;
use sesame_plan::RequirementId;

use super::folder;
use crate::{DATABASE, Origin, Recorder, Repository, sample};

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

#[test]
fn when_a_requirement_was_lost_comes_back_with_its_test() {
    let (with, without) = (folder(), folder());
    let plan = sample::plan();
    let lost = Lost { requirement: RequirementId(1), at: 60.0 };
    let metric = plan.requirement(lost.requirement).metric.index();
    let mut recorder = Recorder::create(with.path(), &plan, 1, 1).unwrap();
    for number in [3, 4] {
        let mut record = sample::record(&plan, number, Origin::Search, plan.tests[0].test.clone());
        record.observation.metrics[4].robustness = SIGNAL.to_vec();
        record.observation.metrics[metric].lost.extend((number == 3).then_some(lost));
        recorder.commit(&record).unwrap();
    }
    let repository = recorder.finish("done").unwrap();
    assert_eq!(repository.test(3).unwrap().observation.metrics[metric].lost, [lost]);
    assert!(repository.test(4).unwrap().observation.metrics.iter().all(|metric| metric.lost.is_empty()));
    // The digest is of what was measured. Results without a lost requirement have no table of them.
    let two = |folder: &std::path::Path| {
        let mut recorder = Recorder::create(folder, &plan, 1, 1).unwrap();
        for number in [3, 4] {
            recorder.commit(&sample::record(&plan, number, Origin::Search, plan.tests[0].test.clone())).unwrap();
        }
        recorder.finish("done").unwrap()
    };
    assert_eq!(repository.digest().unwrap(), two(without.path()).digest().unwrap());
    drop(repository);
    let open = Connection::open(with.path().join(DATABASE)).unwrap();
    open.execute_batch("PRAGMA foreign_keys = OFF; UPDATE lost_requirements SET requirement = 99").unwrap();
    let said = Repository::open(with.path()).unwrap().test(3).unwrap_err().to_string();
    assert!(said.contains("T3 has a lost requirement that is not there"), "{said}");
    open.execute_batch("DROP TABLE lost_requirements; CREATE VIEW lost_requirements AS SELECT 1 AS test").unwrap();
    let said = Repository::open(with.path()).err().unwrap().to_string();
    assert!(said.contains("`lost_requirements` is not a table, but a view"), "{said}");
}
