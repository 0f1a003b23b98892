//! Results of earlier releases, analysed and reported.

use std::path::Path;

use sesame_analysis as analysis;
use sesame_analysis::{Run, Selection, regions};
use sesame_record::DATABASE;

use super::*;

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
    let summary = summary(repository).unwrap();
    let tests = repository.numbers().unwrap();
    let shown = tests.iter().map(|&number| show(repository, &format!("T{number}")).unwrap());
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
        junit(&summary),
    ]
}

#[test]
fn results_of_schema_7_are_analysed_and_reported_as_if_this_release_had_recorded_them() {
    for robustness in [true, false] {
        let [earlier, again] = [(); 2].map(|()| tempfile::tempdir().unwrap());
        sample::of_schema_7(earlier.path(), robustness);
        let before = std::fs::read(earlier.path().join(DATABASE)).unwrap();
        let repository = Repository::open(earlier.path()).unwrap();
        assert!(page(&repository).unwrap().contains(&repository.digest().unwrap()));
        sample::recorded_again(again.path(), &repository).unwrap();
        assert_eq!(analyses(earlier.path()), analyses(again.path()));
        drop(repository);
        assert_eq!(std::fs::read(earlier.path().join(DATABASE)).unwrap(), before);
    }
}
