//! A campaign on a simulator that nobody steps: nothing is concluded from the result of an equal test.

use std::fs;

use sesame_base::observation::Outcome;
use sesame_peers::has_python3;
use sesame_record::{EventKind, Origin, Repository, Verdict};
use sesame_tests::{Project, workspace};

#[test]
fn equal_tests_of_a_free_running_simulator_are_simulated_again_and_a_replay_may_differ() {
    if !has_python3() {
        return;
    }
    let space = fs::read_to_string(workspace().join("tests/simulators/free_running/space.sesame")).unwrap();
    let runner = Project::new("free_running", &space.replace("NAME", "free_running"), "free_running").build("freely");

    let ran = runner.run(&["known", "--workers", "1", "--results", "known"]).expect(0);
    let repository = Repository::open(&runner.folder.join("known/known")).unwrap();
    let tests = repository.tests().unwrap();
    assert!(tests.iter().all(|test| test.outcome == Outcome::Completed), "{tests:?}\n{}", ran.err);
    let known: Vec<u32> =
        tests.iter().filter(|test| test.origin != Origin::Reference).map(|test| test.number).collect();
    let [one, two] = known[..] else { panic!("{tests:?}") };
    let (one, two) = (repository.test(one).unwrap(), repository.test(two).unwrap());
    assert_eq!(one.test, two.test, "they are equal");
    assert_eq!((one.duplicate_of, two.duplicate_of), (None, None));
    let values = [&one, &two].map(|test| test.observation.metrics[0].value.unwrap());
    assert_eq!(values, [2.5, 3.5], "the second and the third run of the simulator, pushed by 0.5 m more");

    let warnings: Vec<String> = repository
        .events()
        .unwrap()
        .into_iter()
        .filter(|event| event.kind == EventKind::Warning)
        .map(|event| event.text)
        .collect();
    let [warning] = &warnings[..] else { panic!("{warnings:?}") };
    assert!(warning.starts_with("the simulator runs freely"), "{warning}");

    let replayed = runner.run(&["replay", "T2", "--results", "known/known"]).expect(0);
    assert!(replayed.err.contains("the simulator runs freely"), "{}", replayed.err);
    assert!(replayed.out.contains("1.5"), "the difference is shown: {}", replayed.out);
}

#[test]
fn a_system_that_has_gone_silent_is_never_taken_for_a_safe_one() {
    use Verdict::{Inconclusive, Satisfied};

    if !has_python3() {
        return;
    }
    let space = fs::read_to_string(workspace().join("tests/simulators/falls_silent/space.sesame")).unwrap();
    let runner = Project::new("falls_silent", &space, "falls_silent").build("known_only");
    let ran = runner.run(&["known", "--workers", "1", "--results", "r"]).expect(3);
    let repository = Repository::open(&runner.folder.join("r/known")).unwrap();
    let verdicts = |number: u32| {
        let row = repository.row(number).unwrap();
        repository.plan().requirements.iter().map(|requirement| row.verdict(requirement)).collect::<Vec<_>>()
    };
    assert_eq!(verdicts(1), [Satisfied, Satisfied]);
    // The distance was silent from one second on: nobody knows how near it came.
    assert_eq!(verdicts(2), [Inconclusive, Satisfied]);
    let warnings = &repository.test(2).unwrap().observation.warnings;
    let note = "`robot/distance` was silent from 0.950 s to the end of the run (in the reference run never longer than \
                0.050 s); what metrics read from a topic that fell silent is not known from then on";
    assert_eq!(warnings, &[note]);
    // The reference run at the end heard nothing at all, however often it was tried.
    let closing = repository.row(3).unwrap();
    assert!(matches!(&closing.outcome, Outcome::Disconnect { message } if message.contains("nothing was heard")));
    let differs = "the reference run after the campaign differs from the one before it: the outcome was completed and is \
                   disconnect";
    assert!(ran.err.contains(&format!("not as required: {differs}")), "{}", ran.err);
    assert_eq!(repository.test(0).unwrap().observation.traffic.len(), 2, "what was heard is recorded");
}
