//! Findings that are run again with fresh seeds of the simulator: what that shows, that it survives anything, and what
//! it brings where a simulator is noisy.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::process::{Child, Stdio};

use sesame_base::observation::Outcome;
use sesame_patience as patience;
use sesame_record::{Repetition, Repository, TestRow, Verdict};
use sesame_report::summary;
use sesame_tests::{Done, Project, Runner, command, done, sesamec, shared, workspace};

use crate::interruption::no_worker_is_left;

/// The runner of a campaign in gusts.
fn gusty(name: &str, campaign: &str) -> Runner {
    let space = fs::read_to_string(workspace().join("tests/simulators/gusty/space.sesame")).unwrap();
    shared(name, &format!("gusty-{campaign}"), campaign, |key| {
        Project::new(key, &space.replace("NAME", "gusty"), "gusty")
    })
}

fn results(runner: &Runner, results: &str) -> Repository {
    Repository::open(&runner.folder.join(results).join("3")).unwrap()
}

#[test]
fn a_front_is_of_confirmed_tests_and_says_how_often_each_finding_came_again() {
    let runner = gusty("confirming", "confirming");
    let junit = runner.folder.join("junit.xml");
    let said = runner.run(&["--results", "results", "--workers", "1", "--junit", junit.to_str().unwrap()]).expect(0);
    let repository = results(&runner, "results");
    let rows = repository.tests().unwrap();
    assert_eq!(rows.len(), 62, "repetitions are not tests");
    let repetitions = repository.repetitions().unwrap();
    let mut seeds: BTreeSet<u64> = BTreeSet::from([repository.test(1).unwrap().simulator_seed]);
    for (test, runs) in &repetitions {
        assert_eq!(runs.iter().map(|run| run.position).collect::<Vec<_>>(), [1, 2, 3, 4], "T{test}");
        assert!(runs.iter().all(|run| seeds.insert(run.simulator_seed)), "every run has a seed of its own");
    }

    // The disturbance is the same each time, so what varies is the gust.
    let failed = |run: &Repetition| matches!(run.outcome, Outcome::Crash { .. });
    assert!(repetitions.values().flatten().any(failed), "some gusts throw the robot over");
    assert!(repetitions.values().any(|runs| runs.iter().any(|run| run.values != runs[0].values)));

    // The front, as told by definition from what is recorded.
    let plan = repository.plan();
    let front = repository.latest_result_set().unwrap().unwrap().members;
    assert!(!front.is_empty() && front.iter().all(|test| repetitions.contains_key(test)), "{front:?}");
    let summary = runner.run(&["report", "--format", "json", "--results", "results/3"]).expect(0).json();
    let confirmed = summary["confirmed"].as_array().unwrap();
    assert_eq!(confirmed.len(), repetitions.len());
    let mut standings = BTreeMap::new();
    let mut counted = 0;
    let requirement = &plan.requirements[0];
    for test in confirmed {
        let number = u32::try_from(test["number"].as_u64().unwrap()).unwrap();
        let first = rows[number as usize].verdict(requirement) == Verdict::Violated;
        let said: Vec<Verdict> = repetitions[&number].iter().map(|run| run.verdict(requirement)).collect();
        let count = |wanted| said.iter().filter(|&&verdict| verdict == wanted).count();
        let (violated, kept) = (count(Verdict::Violated), count(Verdict::Satisfied));
        let finding = test["findings"].as_array().unwrap().iter().find(|finding| finding["finding"] == "R1");
        assert_eq!(finding.is_some(), first || violated > 0, "T{number}");
        let Some(finding) = finding else { continue };
        assert_eq!(finding["first"], first);
        assert_eq!(
            (&finding["again"], &finding["conclusive"]),
            (&violated.into(), &(violated + kept).into()),
            "T{number}"
        );
        let standing = match (violated, kept) {
            (0, 0) => "none",
            (0, _) => "not_confirmed",
            (_, 0) => "confirmed",
            _ => "flaky",
        };
        assert_eq!(finding["standing"].as_str().unwrap_or("none"), standing);
        *standings.entry(standing).or_insert(0) += 1;
        counted += violated;
    }
    assert!(standings.contains_key("confirmed") && standings.len() > 1, "{standings:?}");

    // What people and programs see of it.
    assert!(said.out.contains("confirmed"), "{}", said.out);
    assert!(said.out.contains("Values are means of 4 fresh runs of each test."), "{}", said.out);
    assert!(said.out.contains("further runs of"), "{}", said.out);
    let page = fs::read_to_string(runner.folder.join("results/3/report.html")).unwrap();
    assert!(page.contains("<th scope=\"col\">Confirmed</th>") || page.contains(">Confirmed<"), "the page has a column");
    assert!(fs::read_to_string(&junit).unwrap().contains("; in fresh runs: T"));
    let shown = runner.run(&["show", &format!("T{}", front[0]), "--results", "results/3"]).expect(0).out;
    assert!(shown.contains("Run again"), "{shown}");
    let mut analysis = command(sesamec());
    analysis.args(["results", "front", "--format", "csv"]).arg(repository.path());
    let table = done(&mut analysis).expect(0).out;
    let header = table.lines().next().unwrap();
    assert_eq!(
        header,
        "test,fuzzing_time,worst,same_as,finding,confirmed,conclusive,repetitions,confirmed_low,confirmed_high,standing"
    );
    let listed: BTreeSet<&str> = table.lines().skip(1).filter_map(|line| line.split(',').next()).collect();
    assert!(front.iter().all(|test| listed.contains(format!("T{test}").as_str())), "{table}");

    // Analyses count tests, not repetitions.
    let mut analysis = command(sesamec());
    let tests = done(analysis.args(["results", "tests", "--format", "csv"]).arg(repository.path())).expect(0).out;
    assert_eq!(tests.lines().count(), 61);
    let view = rusqlite::Connection::open(repository.path()).unwrap();
    let (rows, again): (u32, u32) = view
        .query_row("SELECT count(*), coalesce(sum(confirmed), 0) FROM confirmations", [], |row| {
            Ok((row.get(0)?, row.get(1)?))
        })
        .unwrap();
    assert_eq!(rows, standings.values().sum::<u32>());
    assert_eq!(usize::try_from(again).unwrap(), counted);
}

/// Whether a row's first run violates the one requirement of gusts.
fn violates(repository: &Repository, row: &TestRow) -> bool {
    row.verdict(&repository.plan().requirements[0]) == Verdict::Violated
}

#[test]
fn a_violation_that_only_fresh_runs_show_closes_the_gate() {
    let runner = gusty("surprising", "confirming");
    let junit = runner.folder.join("junit.xml");
    // Seeds differ in what the first runs, which share a seed of the simulator, happen to keep; of many tests, nearly
    // always one violates at once.
    for seed in (1..=60).map(|seed| seed.to_string()) {
        let options = ["--seed", &seed, "--evaluations", "3", "--results", "r", "--fail-on", "violation"];
        let done = runner.run(&[&options[..], &["--junit", junit.to_str().unwrap()]].concat());
        let repository = Repository::open(&runner.folder.join("r").join(&seed)).unwrap();
        if repository.tests().unwrap().iter().any(|row| violates(&repository, row)) {
            continue;
        }
        let requirement = &repository.plan().requirements[0];
        let repetitions = repository.repetitions().unwrap();
        if !repetitions.values().flatten().any(|run| run.verdict(requirement) == Verdict::Violated) {
            continue;
        }
        let done = done.expect(3);
        assert!(done.err.contains("not as required: R1 is violated in "), "{}", done.err);
        assert!(
            done.out.contains("requirement violated (R1 by ") && done.out.contains("not in its first run"),
            "{}",
            done.out
        );
        let junit = fs::read_to_string(&junit).unwrap();
        assert!(junit.contains("<failure") && junit.contains("not in its first run"), "{junit}");
        return;
    }
    panic!("with none of 60 seeds only fresh runs violate");
}

#[test]
fn violations_off_the_front_are_confirmed_where_that_is_asked_for() {
    let space = fs::read_to_string(workspace().join("tests/simulators/gusty/space.sesame")).unwrap();
    let more = "campaign thorough from believing { confirm 4 times { violations } }\n";
    let project = Project::new("thorough", &format!("{}\n{more}", space.replace("NAME", "thorough")), "gusty");
    let thorough = project.build("thorough");
    let digest = thorough.run(&["--results", "one", "--workers", "1"]).expect(0).digest();
    assert_eq!(thorough.run(&["--results", "three", "--workers", "3"]).expect(0).digest(), digest);
    let repository = results(&thorough, "one");
    let found: BTreeSet<u32> = repository
        .tests()
        .unwrap()
        .iter()
        .filter(|row| row.duplicate_of.is_none() && violates(&repository, row))
        .map(|row| row.number)
        .collect();
    let repetitions = repository.repetitions().unwrap();
    assert!(found.len() > 5 && found.iter().all(|test| repetitions[test].len() == 4), "{found:?}");
    let front = repository.latest_result_set().unwrap().unwrap().members;
    assert!(found.iter().any(|test| !front.contains(test)), "some are off the front");
    assert_eq!(summary(&repository).unwrap().once, 0);

    // The same later, of results in which nothing was confirmed.
    let believing = project.build("believing");
    believing.run(&["--results", "later"]).expect(0);
    let once = summary(&results(&believing, "later")).unwrap().once;
    assert!(once > 5);
    let front = believing.run(&["confirm", "-n", "1", "--results", "later/3"]).expect(0);
    let left = summary(&results(&believing, "later")).unwrap().once;
    assert!(0 < left && left < once, "{}", front.out);
    let told = believing.run(&["report", "--results", "later/3"]).expect(0).out;
    assert!(told.contains(&format!("{left} tests that violate a requirement were run once only")), "{told}");
    believing.run(&["confirm", "--violations", "-n", "2", "--results", "later/3"]).expect(0);
    assert_eq!(summary(&results(&believing, "later")).unwrap().once, 0);
    let none = believing.run(&["confirm", "--violations", "--results", "later/3", "--fail-on", "violation"]).expect(3);
    assert!(none.err.contains("no test that violates a requirement was run only once"), "{}", none.err);
}

/// A campaign in the background, which does not come further than this number of runs.
fn start(runner: &Runner, results: &str, runs: &Path, most: usize) -> Child {
    let mut command = runner.command(&["--results", results, "--workers", "2"]);
    command.env("PAUSE_US", "300").env("RUNS", runs).env("MOST_RUNS", most.to_string());
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command.spawn().unwrap()
}

fn counted(runs: &Path) -> usize {
    fs::read_to_string(runs).map_or(0, |text| text.lines().count())
}

#[test]
fn repetitions_survive_a_kill_and_come_out_the_same_with_any_number_of_workers() {
    let runner = gusty("confirm_killed", "confirming");
    let whole = runner.run(&["--results", "one", "--workers", "1"]).expect(0).digest();
    assert_eq!(runner.run(&["--results", "three", "--workers", "3"]).expect(0).digest(), whole);
    let repository = results(&runner, "one");
    let repetitions: usize = repository.repetitions().unwrap().values().map(Vec::len).sum();
    let needed = 62 + repetitions;
    // Each kill is after so many repetitions were recorded, so that some are in the middle of a test's.
    for (at, least) in [1, repetitions / 3, 2 * repetitions / 3].into_iter().enumerate() {
        let name = format!("killed{at}");
        let (folder, runs) = (runner.folder.join(&name).join("3"), runner.folder.join(format!("{name}.runs")));
        // Even if all tests come first, so many repetitions are recorded, and two runs are not.
        let mut child = start(&runner, &name, &runs, 62 + least + 2);
        let recorded = || {
            Repository::open(&folder)
                .and_then(|repository| repository.repetitions())
                .map_or(0, |repetitions| repetitions.values().map(Vec::len).sum::<usize>())
        };
        patience::until(format_args!("{least} repetitions are recorded"), || {
            assert!(child.try_wait().unwrap().is_none(), "it ended before it was killed");
            recorded() >= least
        });
        child.kill().unwrap();
        child.wait().unwrap();
        no_worker_is_left(&runner);
        assert!(recorded() < repetitions, "killed in the middle");
        let mut resume = runner.command(&["resume", &format!("{name}/3"), "--workers", "2"]);
        let resumed = Done::of(&resume.env("RUNS", &runs).output().unwrap()).expect(0);
        assert_eq!(resumed.digest(), whole, "killed after {least} repetitions");
        // Only what the two workers were at is run again, and each may have begun one more meanwhile.
        let ran = counted(&runs);
        assert!((needed..=needed + 4).contains(&ran), "{ran} runs for {needed}");
    }
}

#[test]
fn where_nothing_varies_confirming_says_so() {
    let runner = gusty("confirm_still", "confirming");
    let mut command = runner.command(&["--results", "still"]);
    let said = Done::of(&command.env("STILL", "1").output().unwrap()).expect(0);
    assert!(said.out.contains("the simulator does not vary with its seed"), "{}", said.out);
    let noisy = runner.run(&["--results", "noisy"]).expect(0);
    assert!(!noisy.out.contains("the simulator does not vary"), "{}", noisy.out);
}

#[test]
fn tests_of_finished_results_are_confirmed_later_and_the_front_stays() {
    let runner = gusty("confirm_later", "believing");
    runner.run(&["--results", "results"]).expect(0);
    let before = results(&runner, "results");
    let front = before.latest_result_set().unwrap().unwrap().members;
    let digest = before.digest().unwrap();
    assert!(before.repetitions().unwrap().is_empty());
    drop(before);

    let tests = runner.run(&["confirm", "-n", "3", "--results", "results/3", "--format", "json"]).expect(0).json();
    let numbers: Vec<u64> = tests.as_array().unwrap().iter().map(|test| test["number"].as_u64().unwrap()).collect();
    assert_eq!(numbers, front.iter().map(|&number| u64::from(number)).collect::<Vec<_>>());
    let again = runner.run(&["confirm", &format!("T{}", front[0]), "-n", "2", "--results", "results/3"]).expect(0);
    assert!(again.out.contains(&format!("T{}", front[0])), "{}", again.out);
    let after = results(&runner, "results");
    assert_eq!(after.latest_result_set().unwrap().unwrap().members, front);
    let positions: Vec<u32> = after.repetitions().unwrap()[&front[0]].iter().map(|run| run.position).collect();
    assert_eq!(positions, [1, 2, 3, 4, 5], "what was there is kept and not run again");
    assert_ne!(after.digest().unwrap(), digest, "it is part of the content");

    let unknown = runner.run(&["confirm", "T999", "--results", "results/3"]).expect(1);
    assert!(unknown.err.contains("T999"), "{}", unknown.err);
}

/// Fresh runs by which each campaign's findings are judged in the end, which neither its search nor its `confirm` saw.
const JUDGES: usize = 10;

/// The findings of fronts, by whether fresh runs show them again.
#[derive(Default)]
struct Believed {
    runs: usize,
    findings: usize,
    /// Violated again in every one of the fresh runs.
    always: usize,
    never: usize,
    /// Fresh runs that violate again, of all findings together.
    again: usize,
    /// The harm by which findings are on their fronts, and that of their fresh runs, in sum.
    promised: f64,
    kept: f64,
}

impl Believed {
    /// Adds a run's front, of which only tests whose own repetitions `believes` is content with are findings: how many
    /// of them there are, and how many violate again.
    fn add(&mut self, repository: &Repository, believes: impl Fn(usize, usize) -> bool) {
        let plan = repository.plan();
        let rows = repository.tests().unwrap();
        let repetitions = repository.repetitions().unwrap();
        let front = summary(repository).unwrap().front;
        let harm = plan.campaign.objectives[1];
        self.runs += rows.len() + repetitions.values().map(Vec::len).sum::<usize>() - JUDGES * front.len();
        for test in front {
            let row = &rows[test.number as usize];
            let violated: Vec<_> =
                plan.requirements.iter().filter(|requirement| row.verdict(requirement) == Verdict::Violated).collect();
            let violates =
                |run: &&Repetition| violated.iter().all(|requirement| run.verdict(requirement) == Verdict::Violated);
            let runs = &repetitions[&test.number];
            let (own, judges) = runs.split_at(runs.len() - JUDGES);
            if violated.is_empty() || !believes(own.len(), own.iter().filter(violates).count()) {
                continue;
            }
            let again = judges.iter().filter(violates).count();
            self.findings += 1;
            self.again += again;
            self.always += usize::from(again == JUDGES);
            self.never += usize::from(again == 0);
            let fresh: Vec<f64> = judges.iter().filter_map(|run| run.value(harm).value).collect();
            if !fresh.is_empty() {
                self.promised += test.values[1].unwrap();
                self.kept += fresh.iter().sum::<f64>() / fresh.len() as f64;
            }
        }
    }

    fn held(&self) -> Held {
        let findings = self.findings as f64;
        Held { runs: self.again as f64 / (findings * JUDGES as f64), always: self.always as f64 / findings }
    }

    fn row(&self, name: &str) -> String {
        format!(
            "| {name} | {} | {} | {} ({:.0} %) | {} | {:.1} % | {:+.1} % |\n",
            self.runs,
            self.findings,
            self.always,
            100.0 * self.always as f64 / self.findings.max(1) as f64,
            self.never,
            100.0 * self.held().runs,
            100.0 * (self.kept / self.promised - 1.0)
        )
    }
}

/// How well the findings of a campaign hold.
#[derive(Debug, Clone, Copy)]
struct Held {
    /// The share of fresh runs that show a finding again.
    runs: f64,
    /// The share of findings that came again in every fresh run.
    always: f64,
}

/// Runs these campaigns with seeds from 1 on, runs the tests of their fronts again, and prints a table. Says how well
/// findings hold, by campaign, and for `sure` those that came again in all of the last campaign's own repetitions.
fn judged(project: &Project, campaigns: &[&'static str], seeds: u32) -> BTreeMap<&'static str, Held> {
    let mut table = String::from(
        "| campaign | runs | findings | again in all 10 | in none | fresh runs that show it | harm against what the front says |\n\
         |---|---:|---:|---:|---:|---:|---:|\n",
    );
    let mut held = BTreeMap::new();
    for &campaign in campaigns {
        let runner = project.build(campaign);
        let (mut all, mut sure) = (Believed::default(), Believed::default());
        for seed in 1..=seeds {
            let results = format!("{campaign}/{seed}");
            let seed = seed.to_string();
            runner.run(&["--results", campaign, "--seed", &seed, "--fail-on", "nothing"]).expect(0);
            let times = JUDGES.to_string();
            runner.run(&["confirm", "-n", &times, "--results", &results, "--fail-on", "nothing"]).expect(0);
            let repository = Repository::open(&runner.folder.join(&results)).unwrap();
            all.add(&repository, |_, _| true);
            sure.add(&repository, |own, again| own > 0 && own == again);
        }
        table += &all.row(campaign);
        held.insert(campaign, all.held());
        if sure.findings > 0 {
            table += &sure.row(&format!("{campaign}, marked confirmed"));
            held.insert("sure", sure.held());
        }
    }
    println!("{table}");
    held
}

#[test]
#[ignore = "long: 40 campaigns of 210 tests, and fresh runs of their fronts"]
fn findings_of_a_noisy_cell_hold_more_often_where_they_were_confirmed() {
    let project = Project::kuka_cell_with(
        "noisy_cell",
        "campaign believing from coverage_experiment { }\n\
         campaign confirming from coverage_experiment { confirm 5 times }\n\
         campaign doubting from coverage_experiment { confirm 5 times { by quantile 100% } }\n\
         campaign averaging from coverage_experiment {\n  \
           search nsga2 { population 10  evaluations 210  seed 42  neighbours 3 }\n}\n",
    );
    let space = fs::read_to_string(&project.space).unwrap();
    fs::write(&project.space, space.replace("kuka_cell_sim::Cell", "kuka_cell_sim::NoisyCell")).unwrap();
    let held = judged(&project, &["believing", "averaging", "confirming", "doubting"], 10);
    assert!(held["sure"].always > held["believing"].always, "{held:?}");
}

/// Gusts are far from what a real cell does: most of what is found there once was luck.
#[test]
#[ignore = "long: 100 campaigns of 60 to 150 tests, and fresh runs of their fronts"]
fn findings_in_gusts_hold_where_they_were_confirmed() {
    let space = fs::read_to_string(workspace().join("tests/simulators/gusty/space.sesame")).unwrap();
    let more = "campaign doubting from believing { confirm 4 times { by quantile 100% } }\n\
                campaign averaging from believing { search nsga2 { population 10  evaluations 60  seed 3  neighbours 3 } }\n\
                campaign longer from believing { search nsga2 { population 10  evaluations 150  seed 3 } }\n";
    // Two shoves at once do more harm than one, so that there is something to find that is harmful with every seed.
    let space = space.replace("NAME", "gusts").replace("1..2 per test", "1..2 per test may overlap");
    let project = Project::new("gusts", &format!("{space}\n{more}"), "gusty");
    let held = judged(&project, &["believing", "longer", "averaging", "confirming", "doubting"], 20);
    // A front of means holds tests that do harm in some runs only, so it is no more reproducible than one of single
    // runs; worst runs and marks are what tells them apart.
    let as_many_runs = held["longer"].runs;
    assert!(held["sure"].runs > as_many_runs && held["doubting"].runs > as_many_runs, "{held:?}");
}

#[test]
fn a_search_told_of_neighbours_asks_for_other_tests_and_the_same_ones_with_any_number_of_workers() {
    let space = fs::read_to_string(workspace().join("tests/simulators/gusty/space.sesame")).unwrap();
    let search = "search nsga2 { population 10  evaluations 60  seed 3  neighbours 3 }";
    let more = format!("campaign averaging from believing {{ {search} }}\n");
    let space = format!("{}\n{more}", space.replace("NAME", "neighbours"));
    let project = Project::new("neighbours", &space, "gusty");
    let averaging = project.build("averaging");
    let digest = averaging.run(&["--results", "one", "--workers", "1"]).expect(0).digest();
    assert_eq!(averaging.run(&["--results", "three", "--workers", "3"]).expect(0).digest(), digest);
    project.build("believing").run(&["--results", "believing"]).expect(0);
    let tests = |folder: &str| -> Vec<_> {
        results(&averaging, folder).tests().unwrap().into_iter().map(|row| (row.generation, row.test)).collect()
    };
    let (averaged, believed) = (tests("one"), tests("believing"));
    let first = |tests: &[(Option<u32>, _)]| tests.iter().take_while(|(generation, _)| *generation != Some(1)).count();
    let bred = first(&averaged);
    assert_eq!((bred, first(&believed)), (11, 11));
    assert_eq!(averaged[..bred], believed[..bred], "nothing was told before the first generation");
    assert_ne!(averaged[bred..], believed[bred..]);
}
