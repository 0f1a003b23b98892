//! Runs that the environment broke off, as reports list them.

use super::*;

#[test]
fn a_run_that_the_environment_broke_off_is_listed_and_no_finding() {
    let folder = tempfile::tempdir().unwrap();
    let repository = sample::broken_off(folder.path());
    let summary = summary(&repository).unwrap();
    assert_eq!(summary.counts.environment, 3);
    let listed: Vec<&str> = summary
        .failures
        .iter()
        .filter(|failure| failure.is_of_environment())
        .map(|failure| &*failure.outcome)
        .collect();
    assert_eq!(listed, ["wrong_clock", "disconnect", "launch_failed", "disconnect"]);
    let junit = junit(&summary);
    assert!(junit.contains("wrong_clock") && junit.contains("the bridge is away"), "{junit}");
    let page = page(&repository).unwrap();
    assert!(page.contains("runs that the environment broke off") && page.contains("wrong clock"));
}
