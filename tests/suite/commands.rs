//! The commands of a runner other than `run`: known tests, repetitions, replays, exports, reports; and what a build
//! server reads of them.

use std::fs;
use std::path::Path;

use sesame_record::{DATABASE, Origin, Repository, TestRow, Verdict};
use sesame_tests::{Project, Runner};

/// A known test that does not come out as expected, in addition to the example's own.
const MISTAKEN: &str = "
test mistaken {
  jitter_link1 offset [0.27rad, 0.29rad] from 8s to 57s seed 5
  expect collision_occurrence == 999
}
";

fn sql(folder: &Path, statement: &str) {
    let connection = rusqlite::Connection::open(folder.join(DATABASE)).unwrap();
    assert!(connection.execute(statement, []).unwrap() > 0, "{statement}");
}

/// The cell's runner with a short run of its campaign in `r/5`, and the project it comes from.
fn run_once(name: &str) -> (Project, Runner) {
    let project = Project::kuka_cell_with(name, MISTAKEN);
    let runner = project.build("coverage_experiment");
    runner.run(&["--results", "r", "--seed", "5", "--evaluations", "10"]).expect(0);
    (project, runner)
}

#[test]
fn known_tests_are_held_to_what_they_expect() {
    let project = Project::kuka_cell_with("kuka_cell_known", MISTAKEN);
    let runner = project.build("coverage_experiment");
    let both = runner.run(&["known", "--results", "r", "--junit", "known.xml"]).expect(3);
    assert!(both.out.contains("1 of 2 expectations satisfied"), "{}", both.out);
    assert!(both.out.contains("Report r/known/report.html"), "{}", both.out);
    let repository = Repository::open(&runner.folder.join("r/known")).unwrap();
    assert_eq!(repository.find("mistaken").unwrap(), 4);
    let xml = fs::read_to_string(runner.folder.join("known.xml")).unwrap();
    let document = roxmltree::Document::parse(&xml).unwrap();
    let failed = document.descendants().filter(|node| node.has_tag_name("failure"));
    let messages: Vec<&str> = failed.filter_map(|node| node.attribute("message")).collect();
    assert!(messages.iter().any(|message| message.contains("expected is = 999")), "{messages:?}");

    let kept = runner.run(&["known", "known_jitter", "--results", "r", "--format", "json"]).expect(0);
    let kept = kept.json();
    assert_eq!(kept["expectations"][0]["verdict"], "satisfied");
    assert_eq!(kept["results"], "r/known-2");
    runner.run(&["known", "known_jitter", "--results", "r", "--fail-on", "violation"]).expect(3);
    let stranger = runner.run(&["known", "jitter", "--results", "r"]).expect(1);
    assert!(
        stranger.err.contains("it can run known_jitter, jitter_near_zone, jitter_bursts, mistaken"),
        "{}",
        stranger.err
    );

    // A stopped one goes on as any run does, and is held to the same.
    sql(&runner.folder.join("r/known"), "UPDATE campaign SET stop = NULL");
    let resumed = runner.run(&["resume", "r/known"]).expect(3);
    assert_eq!(resumed.digest(), both.digest());
}

#[test]
fn a_replay_is_the_same_bit_for_bit_or_says_what_differs() {
    let (_, runner) = run_once("kuka_cell_replayed");
    let folder = runner.folder.join("r/5");
    let before = fs::read(folder.join(DATABASE)).unwrap();
    for test in ["T1", "7", "reference"] {
        let same = runner.run(&["replay", test, "--results", "r/5"]).expect(0);
        assert!(same.out.contains("came out the same, bit for bit"), "{}", same.out);
    }
    let same = runner.run(&["replay", "T3", "--results", "r/5", "--format", "json"]).expect(0);
    assert_eq!(same.json()["same"], true);
    assert_eq!(fs::read(folder.join(DATABASE)).unwrap(), before, "a replay leaves results as they are");

    let changed = "UPDATE metric_values SET value = value + 1 WHERE test = 3 \
                   AND metric = (SELECT id FROM metrics WHERE name = 'fuzzing_time')";
    sql(&folder, changed);
    let differs = runner.run(&["replay", "T3", "--results", "r/5"]).expect(3);
    assert!(differs.out.contains("T3 came out different"), "{}", differs.out);
    assert!(differs.out.contains("metric `fuzzing_time`"), "{}", differs.out);
    let differs = runner.run(&["replay", "T3", "--results", "r/5", "--format", "json"]).expect(3);
    assert_eq!(differs.json()["differences"].as_array().map(Vec::len), Some(1));
    let missing = runner.run(&["replay", "T99", "--results", "r/5"]).expect(1);
    assert!(missing.err.contains("no test `T99`"), "{}", missing.err);
}

#[test]
fn a_repetition_has_seeds_of_its_own_and_says_how_often_requirements_were_violated() {
    let (_, runner) = run_once("kuka_cell_repeated_by_hand");
    let found = runner.run(&["repeat", "T3", "4", "--results", "r/5", "--format", "json"]).expect(0);
    let found = found.json();
    assert_eq!(found["results"], "r/repeat-T3");
    assert_eq!(found["repetition"]["test"], "T3");
    assert_eq!(found["repetition"]["requirements"][0]["conclusive"], 4);
    assert_eq!(found["counts"]["evaluations"], 4);
    let original = Repository::open(&runner.folder.join("r/5")).unwrap();
    let repeated = Repository::open(&runner.folder.join("r/repeat-T3")).unwrap();
    let original = original.test(3).unwrap();
    let mut seeds = vec![original.simulator_seed];
    for number in 1..=4 {
        let again = repeated.test(number).unwrap();
        assert_eq!(again.test, original.test, "the disturbance is the same, draw seeds included");
        seeds.push(again.simulator_seed);
    }
    seeds.sort_unstable();
    seeds.dedup();
    assert_eq!(seeds.len(), 5, "each run has a seed of its own, and none that of the run that found the test");

    let known = runner.run(&["repeat", "known_jitter", "3", "--into", "r"]).expect(0);
    assert!(known.out.contains("known_jitter repeated"), "{}", known.out);
    assert!(known.out.contains("3 of 3 [44 %, 100 %]"), "{}", known.out);
    runner.run(&["repeat", "known_jitter", "2", "--into", "r", "--fail-on", "violation"]).expect(3);

    // A stopped one goes on as any run does.
    let folder = runner.folder.join("r/repeat-T3");
    let digest = runner.run(&["digest", "--results", "r/repeat-T3"]).expect(0).out;
    sql(&folder, "UPDATE campaign SET stop = NULL");
    assert_eq!(runner.run(&["resume", "r/repeat-T3"]).expect(0).digest(), digest.trim());
}

#[test]
fn an_exported_test_reproduces_its_values_in_the_space_it_is_written_into() {
    let (project, runner) = run_once("kuka_cell_exported");
    // Two tests that keep all requirements, so that each of them is expected again.
    let found = Repository::open(&runner.folder.join("r/5")).unwrap();
    let requirements = &found.plan().requirements;
    let keeps_all = |row: &&TestRow| requirements.iter().all(|one| row.verdict(one) == Verdict::Satisfied);
    let rows = found.tests().unwrap();
    let mut kept = rows.iter().filter(|row| row.origin == Origin::Search).filter(keeps_all).map(|row| row.number);
    let (first, second) = (kept.next().unwrap(), kept.next().unwrap());
    let [first_test, second_test] = [first, second].map(|number| format!("T{number}"));
    let first_name = format!("coverage_experiment_{first_test}");
    let block = runner.run(&["export", &first_test, "--results", "r/5"]).expect(0).out;
    assert!(block.contains(&format!("test {first_name} {{")), "{block}");
    let named = runner.run(&["export", &second_test, "--results", "r/5", "--name", "five", "--format", "json"]);
    let named = named.expect(0).json();
    assert_eq!((&named["name"], &named["test"]), (&"five".into(), &second_test.as_str().into()));
    runner.run(&["export", &second_test, "--results", "r/5", "--name", "5"]).expect(2);

    let text = fs::read_to_string(&project.space).unwrap();
    let described = format!("// A remark.\n{}", text.replace("/// ", "/// Corrected: "));
    fs::write(&project.space, format!("{described}\n{block}\n{}", named["block"].as_str().unwrap())).unwrap();
    let runner = project.build("coverage_experiment");
    let kept = runner.run(&["known", &first_name, "five", "--results", "r"]).expect(0);
    assert!(kept.out.contains("8 expectations satisfied"), "four requirements each: {}", kept.out);
    let again = Repository::open(&runner.folder.join("r/known")).unwrap();
    for (number, known) in [(first, first_name.as_str()), (second, "five")] {
        let (found, again) = (found.test(number).unwrap(), again.test(again.find(known).unwrap()).unwrap());
        assert_eq!(again.test, found.test);
        assert_eq!(again.observation.metrics, found.observation.metrics, "the series as well");
    }
    // More known tests and other comments are not another model: what was found before can still be replayed.
    runner.run(&["replay", &first_test, "--results", "r/5"]).expect(0);

    let text = fs::read_to_string(&project.space).unwrap();
    fs::write(&project.space, text.replace("cycle_time <= 70s", "cycle_time <= 69s")).unwrap();
    let changed = project.build("coverage_experiment").run(&["replay", &first_test, "--results", "r/5"]).expect(1);
    assert!(changed.err.contains("the model has changed"), "{}", changed.err);
    assert!(changed.err.contains("(requirement `"), "{}", changed.err);
    assert!(changed.err.contains(&format!(" export {first_test} --results r/5")), "{}", changed.err);
}

#[test]
fn a_report_is_made_anew_also_of_an_unfinished_run() {
    let (_, runner) = run_once("kuka_cell_reported");
    let folder = runner.folder.join("r/5");
    let page = fs::read(folder.join("report.html")).unwrap();
    fs::remove_file(folder.join("report.html")).unwrap();
    let digest = runner.run(&["digest", "--results", "r/5"]).expect(0).out;
    let told = runner.run(&["report", "--results", "r/5", "--junit", "run.xml"]).expect(0);
    assert_eq!(told.digest(), digest.trim());
    assert_eq!(fs::read(folder.join("report.html")).unwrap(), page);
    let xml = fs::read_to_string(runner.folder.join("run.xml")).unwrap();
    let document = roxmltree::Document::parse(&xml).unwrap();
    assert_eq!(document.root_element().attribute("tests"), Some("4"), "a case for each requirement: {xml}");

    let told = runner.run(&["report", "--results", "r/5", "--output", "page.html", "--format", "json"]).expect(0);
    assert_eq!(fs::read(runner.folder.join("page.html")).unwrap(), page);
    let told = told.json();
    assert_eq!((&told["seed"], &told["digest"]), (&5.into(), &digest.trim().into()));
    let violated =
        told["requirements"].as_array().unwrap().iter().any(|requirement| requirement["violated"].as_u64() > Some(0));
    let code = if violated { 3 } else { 0 };
    runner.run(&["report", "--results", "r/5", "--fail-on", "violation"]).expect(code);

    sql(&folder, "UPDATE campaign SET stop = NULL");
    let unfinished = runner.run(&["report", "--results", "r/5"]).expect(0);
    assert!(
        unfinished.out.contains("10 evaluations") && unfinished.out.contains("the run is unfinished"),
        "{}",
        unfinished.out
    );
    let resumed = runner.run(&["resume", "r/5", "--format", "json"]).expect(0).json();
    assert_eq!(resumed["digest"], digest.trim());
    let nowhere = runner.run(&["report", "--results", "r/5", "--output", "no/such/page.html"]).expect(1);
    assert!(nowhere.err.contains("cannot write the page"), "{}", nowhere.err);
}
