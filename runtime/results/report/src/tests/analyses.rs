//! What the summary reports is what analyses of the same results find.

use sesame_analysis as analysis;
use sesame_analysis::{Datum, Selection, Table};
use sesame_search::coverage::Grid;
use sesame_search::sspr::Convention;

use super::*;

/// A campaign that counts the cells that it covers.
fn covering() -> (tempfile::TempDir, Repository) {
    let folder = tempfile::tempdir().unwrap();
    let repository = sample::covering(folder.path());
    (folder, repository)
}

/// The last value of a column.
fn last(table: &Table, column: &str) -> Datum {
    let at = table.columns().iter().position(|&name| name == column).unwrap();
    table.rows().last().unwrap()[at].clone()
}

#[test]
fn coverage_is_what_an_analysis_finds_afterwards() {
    let (_folder, repository) = covering();
    let reported = summary(&repository).unwrap().coverage.unwrap();
    let grid = Grid::parse("T1:0:1:6,T2:0:0.5:6").unwrap();
    let analysed = analysis::coverage(&repository, &Selection::default(), grid, 1, Convention::Ours).unwrap();
    let curve = analysed.curve();
    assert_eq!(last(&curve, "covered"), Datum::count(reported.covered));
    assert_eq!(last(&curve, "feasible"), Datum::count(reported.feasible));
}

#[test]
fn counts_and_front_are_those_of_the_last_generation() {
    let (_folder, repository) = covering();
    let reported = summary(&repository).unwrap();
    let analysed = analysis::indicators(&repository, None).unwrap();
    assert_eq!(analysed.generations.len(), 7);
    let last = &analysed.generations[6];
    assert_eq!(last.covered, Some(reported.coverage.as_ref().unwrap().covered));
    assert_eq!(last.no_effect, u32::try_from(reported.counts.no_effect).ok());
    assert_eq!(last.front as usize, reported.front.len());
}

#[test]
fn deviations_of_metrics_are_those_of_the_statistics() {
    let (_folder, repository) = covering();
    let reported = summary(&repository).unwrap();
    let reported: Vec<Datum> = reported.spreads.iter().map(|spread| Datum::real(spread.deviation)).collect();
    let table = analysis::statistics(&repository, &Selection::default()).unwrap();
    let at = table.columns().iter().position(|&name| name == "deviation").unwrap();
    assert_eq!(table.rows().into_iter().map(|row| row[at].clone()).collect::<Vec<_>>(), reported);
}
