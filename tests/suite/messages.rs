//! Violations reduced to the single messages that matter, and all causes of a campaign shrunk at once.

use std::fmt::Write as _;
use std::fs;
use std::process::Stdio;

use sesame_patience as patience;
use sesame_record::Repository;
use sesame_tests::{Done, Project, command, sesamec};

use crate::interpreted::{two_robots, without_cargo};

const CAMPAIGN: [&str; 3] = ["two_robots.sesame", "-c", "crossing"];

fn of(project: &Project, command: &str, more: &[&str]) -> Done {
    without_cargo(project, &[&[command], &CAMPAIGN[..], more].concat())
}

/// The two robots until they have met for the second time: nothing here takes longer, and each test is run hundreds of
/// times.
fn two_meetings(name: &str) -> Project {
    let project = two_robots(name);
    let mut space = fs::read_to_string(&project.space).unwrap();
    for (from, to) in [
        ("end        after 70s", "end after 25s"),
        ("within [0s, 60s]", "within [0s, 24s]"),
        // Not all trips are made by then.
        ("completion <= 60s", "completion <= 999s"),
    ] {
        assert!(space.contains(from), "{from}");
        space = space.replace(from, to);
    }
    fs::write(&project.space, space).unwrap();
    project
}

/// Adds tests to the space of a project.
fn add(project: &Project, tests: &str) {
    let space = fs::read_to_string(&project.space).unwrap();
    fs::write(&project.space, format!("{space}\n{tests}")).unwrap();
}

#[test]
fn a_violation_is_reduced_to_messages_of_which_none_can_be_left_out() {
    let project = two_meetings("reduced_to_messages");
    of(&project, "known", &["silent_departure"]).expect(0);
    let shrunk = |into: &str, workers: &str| {
        let more = ["T1", "--results", "known", "--messages", "--into", into, "--workers", workers, "--format", "json"];
        let more = [&more[..], &["--evaluations", "400"]].concat();
        of(&project, "shrink", &more).expect(0).json()
    };
    let said = shrunk("one", "1");
    let way = &said["shrinking"];
    assert_eq!((way["minimal"].as_bool(), way["messages"]["reduced"].as_bool()), (Some(true), Some(true)), "{way}");
    let left = way["messages"]["left"].as_array().unwrap();
    let numbers: Vec<u64> = left.iter().map(|message| message["number"].as_u64().unwrap()).collect();
    // Without poses for as long as it takes to cross; of the 120 in the test's window less than half are needed.
    assert!(!left.is_empty() && left.len() < 60, "{left:?}");
    for message in left {
        let text = |name: &str| message[name].as_str().unwrap();
        assert_eq!([text("operation"), text("topic"), text("path")], ["cut_east", "east", "robots/east/pose"]);
        assert!((15.0..=21.0).contains(&message["time"].as_f64().unwrap()), "{message}");
    }
    assert_eq!(said["digest"], shrunk("two", "2")["digest"], "the same for any number of workers");

    // What is recorded keeps the list.
    let smallest = way["after"]["test"].as_str().unwrap();
    let results = project.folder.join("one/shrink-T1");
    let results = results.to_str().unwrap();
    let shown = of(&project, "show", &[smallest, "--results", results, "--format", "json"]).expect(0).json();
    let listed = shown["operations"][0]["messages"].as_str().unwrap();
    of(&project, "replay", &[smallest, "--results", results]).expect(0);
    of(&project, "repeat", &[smallest, "1", "--results", results, "--into", "again"]).expect(0);
    let again = Repository::open(&project.folder.join(format!("again/repeat-{smallest}"))).unwrap();
    let recorded = again.test(1).unwrap().test.operations[0].messages.clone().unwrap();
    assert_eq!(recorded.count(), left.len() as u64);

    // The block is the test, and without any single one of its messages nothing is violated.
    let block = of(&project, "export", &[smallest, "--results", results, "--name", "all"]).expect(0).out;
    assert!(block.contains(&format!(" messages {listed}\n")), "{block}");
    let mut tests = block.clone();
    let mut names = Vec::new();
    for out in &numbers {
        let kept: Vec<String> =
            numbers.iter().filter(|&number| number != out).map(|number| format!("{number}")).collect();
        if kept.is_empty() {
            continue;
        }
        let list = format!(" messages {}\n", kept.join(", "));
        let without = block.replace(&format!(" messages {listed}\n"), &list);
        names.push(format!("without_{out}"));
        write!(tests, "\n{}", without.replace("test all {", &format!("test without_{out} {{"))).unwrap();
    }
    add(&project, &tests);
    let all = of(&project, "known", &["all"]).expect(3);
    assert!(all.out.lines().any(|line| line.trim_start().starts_with("all") && line.ends_with("  no")), "{}", all.out);
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    assert_eq!(names.len(), numbers.len(), "{numbers:?}");
    of(&project, "known", &names).expect(0);
}

#[test]
fn when_an_operation_has_to_act_is_described_and_held_against_fresh_windows() {
    let project = two_meetings("when_it_has_to_act");
    of(&project, "known", &["silent_departure"]).expect(0);
    let shrunk = |into: &str, more: &[&str]| {
        let arguments = ["T1", "--results", "known", "--when", "--into", into];
        of(&project, "shrink", &[&arguments[..], more].concat()).expect(0)
    };
    let said = shrunk("one", &["--workers", "1", "--format", "json"]).json();
    let when = &said["shrinking"]["when"][0];
    assert_eq!(when["operation"], "cut_east", "{said}");
    let count = |of: &str, what: &str| when[of][what].as_u64().unwrap();
    // All variations, and the smallest test itself.
    assert_eq!((count("made_of", "of"), count("fresh", "of")), (33, 16), "{when}");
    assert!(count("fresh", "right") >= 12, "{when}");
    let steps = said["shrinking"]["steps"].as_array().unwrap();
    assert_eq!(steps.iter().filter(|step| step["tried"] == "variations").count(), 48);
    let told = shrunk("two", &["--workers", "2"]);
    assert_eq!(said["digest"].as_str().unwrap(), told.digest(), "the same for any number of workers");
    let sentence = format!("cut_east {}: so it was", when["text"].as_str().unwrap());
    let words = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>().join(" ");
    assert!(words(&told.out).contains(&words(&sentence)), "{sentence}: {}", told.out);
    let page = fs::read_to_string(project.folder.join("two/shrink-T1/report.html")).unwrap();
    assert!(page.contains(": so it was with "), "{sentence}");
}

#[test]
fn every_cause_is_shrunk_within_one_budget_and_the_same_for_any_number_of_workers() {
    let project = two_meetings("causes_shrunk");
    of(&project, "run", &[]).expect(0);
    let causes = of(&project, "causes", &["--format", "json"]).expect(0).json();
    let causes = causes["causes"].as_array().unwrap().clone();
    assert!(causes.len() > 1, "{causes:?}");
    let arguments = |into: &str, workers: &str| -> Vec<String> {
        let more = ["--violations", "--messages", "--budget", "100", "--results", "42", "--into", into];
        let format = ["--workers", workers, "--format", "json"];
        let all = ["shrink"].iter().chain(&CAMPAIGN).chain(&more).chain(&format);
        all.map(|&argument| argument.to_owned()).collect()
    };
    let shrunk = |into: &str, workers: &str| {
        let arguments = arguments(into, workers);
        without_cargo(&project, &arguments.iter().map(String::as_str).collect::<Vec<_>>()).expect(0).json()
    };
    let said = shrunk("one", "1");
    let shrinkings = said["shrinkings"].as_array().unwrap();
    assert_eq!(shrinkings.len(), causes.len());
    let mut tried = 0;
    for (cause, way) in causes.iter().zip(shrinkings) {
        assert_eq!(way["test"], cause["test"]);
        assert_eq!(way["fails"], format!("violates {}", cause["requirement"].as_str().unwrap()));
        assert!(way["after"].is_object() && way["operations"].is_array() && way["block"].is_string(), "{way}");
        for threshold in way["thresholds"].as_array().unwrap() {
            assert_ne!(threshold["fails"], threshold["passes"], "{threshold}");
        }
        tried += way["steps"].as_array().unwrap().len();
    }
    assert!(tried <= 100);
    assert!(said["shrinking"].is_null());
    assert_eq!(said["digest"], shrunk("two", "2")["digest"]);

    // A stopped run goes on to the same.
    let mut killed = command(sesamec());
    let mut killed = killed.args(arguments("killed", "2")).current_dir(&project.folder);
    killed = killed.stdout(Stdio::null()).stderr(Stdio::null());
    let mut process = killed.spawn().unwrap();
    let folder = project.folder.join("killed/shrink-violations");
    let recorded = || Repository::open(&folder).and_then(|results| results.tests()).map_or(0, |tests| tests.len());
    patience::until("eight tests are recorded", || {
        assert!(process.try_wait().unwrap().is_none(), "it ended before it could be killed");
        recorded() >= 8
    });
    process.kill().unwrap();
    process.wait().unwrap();
    let folder = folder.to_str().unwrap();
    let resumed = of(&project, "resume", &[folder, "--format", "json"]).expect(0).json();
    assert_eq!(resumed["digest"], said["digest"]);
    assert_eq!(resumed["shrinkings"], said["shrinkings"]);

    let refused = of(&project, "shrink", &["--violations", "--results", "42", "--requirement", "R9"]).expect(1);
    assert!(refused.err.contains("the campaign has no requirement `R9`; it has R1, R2"), "{}", refused.err);
    let refused = of(&project, "shrink", &["--violations", "--results", "42", "--budget", "1"]).expect(1);
    assert!(refused.err.contains("--budget 1 is too little for"), "{}", refused.err);
    let refused = of(&project, "shrink", &["T3", "--violations"]).expect(2);
    assert!(refused.err.contains("cannot be used with"), "{}", refused.err);
}

#[test]
fn messages_of_a_simulator_that_runs_freely_are_not_tried_in_single_runs() {
    let project = two_robots("free_messages");
    let space = fs::read_to_string(&project.space).unwrap();
    fs::write(&project.space, space.replace("{ step 50ms }", "{ free running }")).unwrap();
    let refused = of(&project, "shrink", &["T1", "--messages"]).expect(1);
    assert!(refused.err.contains("`two_robots` runs freely: the same test sends other messages"), "{}", refused.err);
    let refused = of(&project, "shrink", &["T1", "--messages", "--runs", "3"]).expect(1);
    assert!(refused.err.contains("there are no results yet"), "{}", refused.err);
}
