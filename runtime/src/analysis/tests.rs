use sesame_plan::{CoverageGoal, GridAxis};

use super::*;
use crate::record::sample;
use crate::report::TextOptions;

fn repository() -> (tempfile::TempDir, Repository) {
    let folder = tempfile::tempdir().unwrap();
    let mut plan = sample::plan();
    let axis = |dimension, high, cells| GridAxis { dimension, low: 0.0, high, cells };
    plan.campaign.coverage = Some(CoverageGoal {
        axes: vec![axis(Dimension::T1, 1.0, 6), axis(Dimension::T2, 0.5, 6)],
        hits: 1,
        stop_at: None,
    });
    let repository = sample::campaign(folder.path(), &plan, 60);
    (folder, repository)
}

fn all() -> Selection {
    Selection::default()
}

fn names(dataset: &Dataset) -> Vec<String> {
    let first = dataset.rows().iter().map(|row| match &row[0] {
        Datum::Text(name) => name.clone(),
        other => panic!("{other:?}"),
    });
    first.collect()
}

#[test]
fn tests_are_listed_with_the_values_that_were_recorded() {
    let (_folder, repository) = repository();
    let dataset = tests(&repository, &all()).unwrap();
    let rows = repository.tests().unwrap();
    let searched: Vec<_> = rows.iter().filter(|row| row.origin != Origin::Reference).collect();
    assert_eq!(dataset.rows().len(), searched.len());
    for (row, found) in dataset.rows().iter().zip(searched) {
        assert_eq!(row[0], Datum::Text(format!("T{}", found.number)));
        assert_eq!(row[3], Datum::Text(found.outcome.word().to_owned()));
        for (at, datum) in row[6..].iter().enumerate() {
            let id = MetricId(u32::try_from(at).unwrap());
            assert_eq!(*datum, Datum::real(found.value(id).value));
        }
    }
    insta::assert_snapshot!("tests", dataset.text(TextOptions { width: None, colour: false }));
}

#[test]
fn the_front_of_all_tests_is_that_of_the_campaign_and_equal_tests_say_so() {
    let (_folder, repository) = repository();
    let dataset = front(&repository, &all()).unwrap();
    let standing: Vec<&Vec<Datum>> = dataset.rows().iter().filter(|row| row.last() == Some(&Datum::Missing)).collect();
    let recorded = repository.latest_result_set().unwrap().unwrap().members;
    let recorded: Vec<Datum> = recorded.into_iter().map(name).collect();
    assert!(recorded.len() > 2);
    assert_eq!(standing.iter().map(|row| row[0].clone()).collect::<Vec<_>>(), recorded);
    // Values are those of the tests, whichever way they are optimised.
    let listed = tests(&repository, &all()).unwrap();
    for row in dataset.rows() {
        let test = listed.rows().iter().find(|test| test[0] == row[0]).unwrap();
        assert_eq!(row[1..3], [test[7].clone(), test[6].clone()], "fuzzing time and collisions");
    }
    let members = Selection::of(&repository, Some("front")).unwrap();
    assert_eq!(front(&repository, &members).unwrap().rows().len(), standing.len());
}

#[test]
fn a_set_that_is_not_there_is_refused_with_those_that_are() {
    let (_folder, repository) = repository();
    let error = Selection::of(&repository, Some("frond")).unwrap_err().to_string();
    assert!(error.starts_with("no set of results `frond`; there are `generation-0` and `front`"), "{error}");
}

#[test]
fn points_are_those_of_the_observed_intervals_in_the_convention_asked_for() {
    let (_folder, repository) = repository();
    let dataset = sspr(&repository, &all(), &Dimension::ALL, Convention::Original).unwrap();
    assert_eq!(dataset.columns().len(), 10);
    let mut compared = 0;
    for row in dataset.rows() {
        let Datum::Text(test) = &row[0] else { panic!("{row:?}") };
        let record = repository.test(repository.find(test).unwrap()).unwrap();
        let disturbances = crate::sspr::observed(repository.plan(), &record.test, &record.observation);
        let point = crate::sspr::Point::of(&disturbances, Convention::Original).unwrap();
        for (datum, dimension) in row[1..].iter().zip(Dimension::ALL) {
            assert_eq!(*datum, Datum::real(point.get(dimension)), "{test} {dimension:?}");
        }
        compared += 1;
    }
    assert!(compared > 50);
    let few = sspr(&repository, &all(), &[Dimension::P2, Dimension::T1], Convention::Ours).unwrap();
    assert_eq!(few.columns(), ["test", "P2", "T1"]);
    assert_eq!(names(&few), names(&dataset));
}

#[test]
fn coverage_afterwards_is_what_the_campaign_reports() {
    let (_folder, repository) = repository();
    let reported = crate::report::summary(&repository).unwrap().coverage.unwrap();
    let grid = Grid::parse("T1:0:1:6,T2:0:0.5:6").unwrap();
    let analysis = coverage(&repository, &all(), grid.clone(), 1, Convention::Ours).unwrap();
    let curve = analysis.curve();
    let last = curve.rows().last().unwrap();
    assert_eq!(last[1..3], [Datum::count(reported.covered), Datum::Whole(36)]);
    assert_eq!(last[4], Datum::count(reported.feasible));
    let cells = analysis.cells();
    let covered = cells.rows().iter().filter(|row| row[5] == Datum::Truth(true)).count();
    assert_eq!((cells.rows().len(), covered), (36, reported.covered));
    assert_eq!(cells.columns(), ["T1_low", "T1_high", "T2_low", "T2_high", "hits", "covered", "feasible"]);
    let twice = coverage(&repository, &all(), grid, 2, Convention::Ours).unwrap();
    assert!(twice.curve().rows().len() < curve.rows().len());
}

#[test]
fn campaigns_tell_what_a_file_holds() {
    let (_folder, repository) = repository();
    let dataset = campaigns(&[repository]).unwrap();
    let row = &dataset.rows()[0];
    assert_eq!(row[2], Datum::Text("coverage_experiment".to_owned()));
    assert_eq!(row[5], Datum::Whole(61));
    assert_eq!(row[8], Datum::Text("generation-0 front".to_owned()));
}

#[test]
fn what_is_printed_for_programs_reads_back() {
    let mut dataset = Dataset::new(["a".to_owned(), "b, \"c\"".to_owned(), "d".to_owned(), "e".to_owned()]);
    let third = 0.1 + 0.2;
    dataset.row([Datum::Text("x\ny".to_owned()), Datum::Real(third), Datum::Missing, Datum::Truth(true)]);
    dataset.row([Datum::Whole(-3), Datum::Real(1e300), Datum::Text(String::new()), Datum::Whole(7)]);
    let csv = dataset.csv();
    assert!(csv.starts_with("a,\"b, \"\"c\"\"\",d,e\n\"x\ny\",0.30000000000000004,,true\n-3,1000000"), "{csv}");
    let json: serde_json::Value = serde_json::from_str(&dataset.json()).unwrap();
    assert_eq!(json[0]["b, \"c\""].as_f64(), Some(third));
    assert_eq!(json[1]["b, \"c\""].as_f64(), Some(1e300));
    assert!(json[0]["d"].is_null());
    assert_eq!(Dataset::new(["a".to_owned()]).json(), "[]\n");
    assert_eq!(Datum::real(Some(f64::NAN)), Datum::Missing);
}
