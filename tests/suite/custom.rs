//! Custom operations: hooks in a generated runner, and files that are restored after every kind of end.

use std::fs;
use std::os::unix::process::CommandExt as _;
use std::process::Stdio;

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

use sesame_base::observation::Counters;
use sesame_patience as patience;
use sesame_plan::{Activation, Choice};
use sesame_record::{Repository, TestRecord};
use sesame_tests::{Project, Runner, workspace};

use crate::interruption::no_worker_is_left;

const SPACE: &str = r#"
space calibrated
system {
  simulator sim = in_process "calibrated_sim::Calibrated" { crate "simulator"  step 100ms }
  message Joint { name: text  position: real[rad] }
  topic gain  = "gain"  : real
  topic path  = "path"  : Joint
  topic heard = "heard" : real
}
metric gain_seen maximise default 0 = last(gain)
metric arrived              default 0 = count(heard > -1e9)
metric farthest             default 0 = max(heard)

/// Moves joints, and more.
operation bend on path = custom {
  /// How many joints are made up for each.
  copies: int [0, 3]
  shift:  point [(-2, -2, -2)m, (2, 2, 2)m]
  way:    one of "move", "drop", "scatter"
}
operation spoil = custom before start {
  file: file one of "calibration.txt", "spare.txt"
  gain: real [1, 9]
  fate: one of "go on", "panic", "abort", "leave"
}
operation stick = custom before start { } inclusion 0%
operation tidy  = custom after end { } priority -1
operation empty on gain = custom { } inclusion 0%

test moved     { bend copies 2 shift (1.5, 0, 0)m way "move" from 0.2s to 0.5s }
test dropped   { bend copies 0 shift (0, 0, 0)m way "drop" from 0.2s to 0.5s }
test scattered { bend copies 1 shift (1.5, 0, 0)m way "scatter" from 0.2s to 0.5s }
test spoilt    { spoil file "calibration.txt" gain 5 fate "go on" before start }
test panicking { spoil file "calibration.txt" gain 6 fate "panic" before start }
test aborting  { spoil file "calibration.txt" gain 7 fate "abort" before start }
test leaving   { spoil file "calibration.txt" gain 8 fate "leave" before start }
test undone    { tidy after end  spoil file "spare.txt" gain 2 fate "go on" before start }
test stuck     { stick before start }
test switched  {
  bend copies 0 shift (1.5, 0, 0)m way "move" when arrived > 2 until arrived > 4
  spoil file "calibration.txt" gain 4 fate "go on" before start
}

campaign look {
  objectives gain_seen
  observes arrived, farthest
  operations bend, spoil, stick, tidy, empty   1..3 per test
  activate by condition over arrived in [0, 20] { integers [1, 9]  depth 2 }
  search random { evaluations 12  seed 3 }
  end after 1s
}
"#;

/// The runner with its hooks filled in, but for that of `empty`.
fn project(name: &str) -> (Project, Runner) {
    let project = Project::new(name, &SPACE.replace("space calibrated", &format!("space {name}")), "calibrated");
    fs::write(project.folder.join("calibration.txt"), "1\n").unwrap();
    fs::write(project.folder.join("spare.txt"), "0\n").unwrap();
    project.sesamec("generate", &["--campaign", "look"]).expect(0);
    for operation in ["bend", "spoil", "stick", "tidy"] {
        let file = format!("{operation}.rs");
        let hooks = workspace().join("tests/simulators/calibrated/hooks");
        fs::copy(hooks.join(&file), project.runners.join("hooks").join(&file)).unwrap();
    }
    let runner = project.build("look");
    (project, runner)
}

fn record<'r>(records: &'r [TestRecord], repository: &Repository, test: &str) -> &'r TestRecord {
    let number = repository.find(test).unwrap();
    records.iter().find(|record| record.number == number).unwrap()
}

#[test]
fn hooks_change_drop_and_inject_and_files_are_put_back() {
    let (project, runner) = project("bending");
    let calibration = project.folder.join("calibration.txt");
    let intact = || {
        assert_eq!(fs::read_to_string(&calibration).unwrap(), "1\n");
        assert_eq!(fs::read_to_string(project.folder.join("spare.txt")).unwrap(), "0\n");
        assert!(!project.folder.join("made.txt").exists());
    };
    let names = ["moved", "dropped", "scattered", "spoilt", "panicking", "aborting", "leaving", "undone", "switched"];
    let arguments = [&["known"], &names[..], &["--results", "results", "--workers", "2"]].concat();
    let said = runner.run(&arguments).expect(3);
    intact();
    assert!(said.err.contains("hook of operation `empty` is not filled in yet"), "{}", said.err);
    assert!(!said.err.contains("`tidy` is not filled in"), "{}", said.err);
    assert!(said.err.contains("tests run one at a time"), "{}", said.err);

    let repository = Repository::open(&runner.folder.join("results/known")).unwrap();
    let rows = repository.tests().unwrap();
    let records: Vec<TestRecord> = rows.iter().map(|row| repository.test(row.number).unwrap()).collect();
    let plan = repository.plan();
    let metric = |test: &str, name: &str| {
        let at = plan.metrics.iter().position(|metric| metric.name == name).unwrap();
        record(&records, &repository, test).observation.metrics[at].value.unwrap()
    };
    let counters = |test: &str| record(&records, &repository, test).observation.operations[0].counters;
    let counted =
        |seen, changed, dropped, injected| Counters { seen, changed, dropped, injected, ..Counters::default() };

    let before = metric("reference", "arrived");
    assert_eq!(counters("moved"), counted(3, 3, 0, 6), "active for three messages, two made up for each");
    assert_eq!((metric("moved", "arrived"), metric("moved", "farthest")), (before + 6.0, 1.5));
    assert_eq!(counters("dropped"), counted(3, 0, 3, 0));
    assert_eq!(metric("dropped", "arrived"), before - 3.0);
    assert_eq!(counters("scattered"), counted(3, 3, 0, 3));
    let farthest = metric("scattered", "farthest");
    assert!(farthest > 0.0 && farthest < 1.0, "{farthest}");

    assert_eq!((metric("reference", "gain_seen"), metric("spoilt", "gain_seen")), (1.0, 5.0));
    let spoilt = record(&records, &repository, "spoilt");
    assert_eq!(spoilt.observation.operations[0].counters, Counters { side_effects: 1, ..Counters::default() });
    assert!(spoilt.observation.operations[0].intervals.is_empty(), "it was never active");
    assert_eq!(
        spoilt.test.operations[0].parameters,
        [
            Choice::Text { text: "calibration.txt".to_owned() },
            Choice::Value { value: 5.0 },
            Choice::Text { text: "go on".to_owned() },
        ]
    );
    let undone = &record(&records, &repository, "undone").observation;
    let effects: Vec<u64> = undone.operations.iter().map(|operation| operation.counters.side_effects).collect();
    assert_eq!((undone.outcome.word(), effects), ("completed", vec![2, 1]), "before the start and after the end");
    let switched = record(&records, &repository, "switched");
    let [bent, spoilt] = &switched.observation.operations[..] else { panic!("{switched:?}") };
    assert_eq!(bent.counters, counted(2, 2, 0, 0), "from the third arrival until the fifth");
    assert_eq!((bent.intervals.len(), spoilt.intervals.len()), (1, 0));
    assert_eq!((metric("switched", "gain_seen"), metric("switched", "farthest")), (4.0, 1.5));
    assert!(matches!(switched.test.operations[0].activation, Activation::Condition { .. }));
    assert_eq!(switched.test.operations[1].activation, Activation::Offline);
    let detail = |test: &str| record(&records, &repository, test).observation.outcome.detail().unwrap();
    assert!(detail("panicking").contains("spoilt too much"), "{}", detail("panicking"));
    assert!(detail("aborting").contains("SIGABRT"), "{}", detail("aborting"));
    let left = detail("leaving");
    assert!(left.contains("operation `spoil`: `../elsewhere.txt` is not a file below"), "{left}");

    // The reference run at the end saw the same as the one at the start.
    assert!(repository.events().unwrap().iter().all(|event| !event.text.contains("does not start afresh")));
    let shown = runner.run(&["show", "moved", "--results", "results/known"]).expect(0).out;
    assert!(shown.contains("copies 2, shift (1.5, 0.0, 0.0) m, way move"), "{shown}");
    let exported = runner.run(&["export", "undone", "--results", "results/known"]).expect(0).out;
    assert!(exported.contains("spoil file \"spare.txt\" gain 2 fate \"go on\" before start seed "), "{exported}");
    assert!(exported.contains("tidy after end seed "), "{exported}");

    let exported = runner.run(&["export", "switched", "--results", "results/known"]).expect(0).out;
    assert!(exported.contains("way \"move\" when arrived > 2 until arrived > 4 seed "), "{exported}");

    let one = runner.run(&["--results", "one", "--workers", "1", "--fail-on", "nothing"]).expect(0);
    let two = runner.run(&["--results", "two", "--workers", "2", "--fail-on", "nothing"]).expect(0);
    assert_eq!(one.digest(), two.digest(), "hooks draw from their contexts alone");
    intact();
    let searched = Repository::open(&runner.folder.join("one/3")).unwrap();
    let mut activations = [0; 2];
    for row in searched.tests().unwrap() {
        for used in searched.test(row.number).unwrap().test.operations {
            let offline = searched.plan().operation(used.operation).kind.is_offline();
            assert_eq!(used.activation == Activation::Offline, offline, "{used:?}");
            assert!(!matches!(used.activation, Activation::Time { .. }), "{used:?}");
            activations[usize::from(offline)] += 1;
        }
    }
    assert!(activations[0] > 0 && activations[1] > 0, "{activations:?}");
}

#[test]
fn files_changed_when_all_was_killed_are_put_back_by_the_next_start() {
    let (project, runner) = project("killed");
    let calibration = project.folder.join("calibration.txt");
    let mut command = runner.command(&["repeat", "stuck", "1", "--into", "results"]);
    let mut running = command.process_group(0).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    patience::until("the file is changed", || fs::read_to_string(&calibration).unwrap() == "91\n");
    let refused = runner.run(&["known", "moved", "--results", "meanwhile"]).expect(1);
    assert!(refused.err.contains("another runner of this space may change files"), "{}", refused.err);
    kill(Pid::from_raw(i32::try_from(running.id()).unwrap()), Signal::SIGKILL).unwrap();
    running.wait().unwrap();
    no_worker_is_left(&runner);
    assert_eq!(fs::read_to_string(&calibration).unwrap(), "91\n", "nobody was left to put it back");

    let said = runner.run(&["known", "moved", "--results", "next"]).expect(0);
    assert!(said.err.contains("calibration.txt was changed; it has been restored"), "{}", said.err);
    assert_eq!(fs::read_to_string(&calibration).unwrap(), "1\n");
    let again = runner.run(&["known", "moved", "--results", "after"]).expect(0);
    assert!(!again.err.contains("restored"), "{}", again.err);

    // A worker that is stopped because its test takes too long leaves nothing either.
    runner.run(&["repeat", "stuck", "1", "--into", "slow", "--timeout", "2", "--reference-timeout", "120"]).expect(0);
    assert_eq!(fs::read_to_string(&calibration).unwrap(), "1\n");

    fs::remove_file(project.folder.join("spare.txt")).unwrap();
    let missing = runner.run(&["known", "moved", "--results", "missing"]).expect(1);
    assert!(
        missing.err.contains("operation `spoil` may choose the file `spare.txt`, which is not in"),
        "{}",
        missing.err
    );
}
