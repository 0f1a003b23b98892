//! The action for GitHub, as far as bash goes: its scripts, with the files and variables that GitHub gives to them.

use sesame_tests::workspace;

use crate::steps::{Action, Checkout, Job, SPACE, read};

/// The steps after the installation, which takes a wheel.
const FROM: &str = "Check the space";

/// Few tests, the same each time.
const FEW: (&str, &str) = ("arguments", "--evaluations 12 --workers 2");

fn action() -> Action {
    Action::read(&read(&workspace().join("action.yml")))
}

fn run(checkout: &mut Checkout, with: &[(&str, &str)]) -> Job {
    checkout.run(&action(), FROM, &[&[("file", SPACE), FEW], with].concat())
}

#[test]
fn it_has_the_steps_that_its_page_promises() {
    let action = action();
    let names: Vec<&str> = action.steps.iter().map(|step| step.name.as_str()).collect();
    let expected = [
        "Install sesamec",
        "Check the space",
        "Run the regression tests",
        "Run the campaign",
        "Upload what came of it",
    ];
    assert_eq!(names, expected);
    assert!(!action.defaults.contains_key("file"), "only the file is required");
}

#[test]
fn a_violated_requirement_fails_it_and_leaves_the_page_and_junit() {
    let Some(mut checkout) = Checkout::new("action-violated") else { return };
    let job = run(&mut checkout, &[]);
    assert_eq!(job.last(), ("Run the campaign", Some(3)), "{job:?}");
    assert!(job.summary.contains("R1") && job.summary.ends_with("```\n"), "{}", job.summary);
    assert!(checkout.has(&job.outputs["run.page"]), "{:?}", job.outputs);
    let junit = read(&checkout.folder.join("sesame-results/campaign.xml"));
    assert!(junit.contains("<failure message=\"violated by"), "{junit}");
    assert!(!checkout.has("folder"), "a name was run as a command");
}

#[test]
fn what_the_gate_does_not_name_does_not_fail_it() {
    let Some(mut checkout) = Checkout::new("action-passes") else { return };
    let job = run(&mut checkout, &[("fail-on", "crash,timeout"), ("seed", "7"), ("campaign", "first")]);
    assert_eq!(job.last(), ("Run the campaign", Some(0)), "{job:?}");
    assert_eq!(job.outputs["run.page"], "sesame-results/7/report.html");
    assert!(checkout.has("sesame-results/7/report.html"));
}

#[test]
fn mistakes_in_the_space_become_annotations_and_nothing_runs() {
    let Some(mut checkout) = Checkout::new("action-mistake") else { return };
    let space = checkout.folder.join(SPACE);
    std::fs::write(&space, read(&space).replace("requirement R1", "requirement R1 nonsense")).unwrap();
    let job = run(&mut checkout, &[]);
    assert_eq!(job.last(), (FROM, Some(1)), "{job:?}");
    assert!(job.ran[0].1.out.starts_with(&format!("::error file={SPACE},line=")), "{}", job.ran[0].1.out);
}

#[test]
fn regression_tests_run_alone_when_asked() {
    let Some(mut checkout) = Checkout::new("action-regression") else { return };
    run(&mut checkout, &[("results", "earlier")]);
    // It expects what the requirement does, and nobody has mended the controller.
    checkout.keep("earlier/1", &["T2"]);
    let with = [("regression-tests", "true"), ("run", "false"), ("deny-warnings", "true")];
    let job = run(&mut checkout, &with);
    assert_eq!(job.last(), ("Run the regression tests", Some(3)), "{job:?}");
    let junit = read(&checkout.folder.join("sesame-results/regression-tests.xml"));
    assert!(junit.contains("first_T2") && junit.contains("<failure"), "{junit}");
    assert!(!checkout.has("sesame-results/campaign.xml"));
}
