//! The example with a certificate: its one command finds missed hazards, and none after the mend; searching for them is
//! better than chance.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use sesame_analysis::rank_sum;
use sesame_record::Repository;
use sesame_tests::{Project, Runner, command, done, fresh_folder, sesamec, turn, workspace};

use crate::search::quartiles;

#[test]
fn one_command_finds_missed_hazards_and_none_after_the_mend() {
    let folder = fresh_folder("transport");
    one_command(&folder, &["--evaluations", "80"]);
    // With a worker more or less nothing is different.
    let space = workspace().join("examples/transport/transport.sesame");
    let again = Project { space, runners: folder.join("transport"), folder };
    let digest = |workers: &str| {
        let short = ["--", "--evaluations", "40", "--workers", workers, "--results", workers];
        again.run("attack", &short).expect(0).digest()
    };
    assert_eq!(digest("1"), digest("3"));
}

#[test]
#[ignore = "long: two campaigns of 400 tests"]
fn the_readme_has_the_figures_of_its_command() {
    let line = one_command(&fresh_folder("transport_whole"), &[]);
    let readme = fs::read_to_string(workspace().join("examples/transport/README.md")).unwrap();
    assert!(readme.contains(&line), "the README has other figures than: {line}");
}

/// The command of the example, with further options; returns what it sums up.
fn one_command(folder: &Path, options: &[&str]) -> String {
    let example = workspace().join("examples/transport");
    let mut run = command(example.join("run"));
    let turn = turn();
    let said = done(run.env("SESAMEC", sesamec()).arg(folder).args(options).current_dir(folder)).expect(0);
    drop(turn);
    let line = said.out.lines().find_map(|line| line.strip_prefix("Tests with a missed hazard: ")).expect("a summary");
    let numbers: Vec<u32> = line.split(' ').filter_map(|word| word.parse().ok()).collect();
    assert!(numbers[0] >= 1 && numbers[1] == 0, "{line}");
    let pages: Vec<&str> = said.out.lines().filter_map(|line| line.trim().strip_prefix("Report ")).collect();
    assert_eq!(pages.len(), 4, "{}", said.out);
    for page in &pages {
        let page = fs::read_to_string(folder.join(page)).unwrap();
        assert!(page.contains("The certificate foresees every hazard"), "the page shows the requirement");
    }
    let before_and_after = fs::read_to_string(folder.join(pages[3])).unwrap();
    assert!(before_and_after.contains("hazards were missed in 3 before and in 0 after"), "three tests, twice");
    // Without disturbance nothing is stopped.
    let results = folder.join("transport/attack/results/42");
    let repository = Repository::open(&results).unwrap();
    let reference = &repository.tests().unwrap()[0];
    let stood = repository.plan().metrics.iter().position(|metric| metric.name == "stood").unwrap();
    assert_eq!(reference.values[stood].value, Some(0.0));
    line.to_owned()
}

#[test]
fn the_mend_is_one_clause() {
    let text = |name: &str| fs::read_to_string(workspace().join("examples/transport").join(name)).unwrap();
    let (drawn, mended) = (text("transport.sesame"), text("mended.sesame"));
    let differing = drawn.lines().zip(mended.lines()).filter(|(one, other)| one != other).collect::<Vec<_>>();
    assert_eq!(drawn.lines().count(), mended.lines().count());
    // What the space says of itself, its name, and the evidence.
    assert_eq!(differing.len(), 3, "{differing:?}");
    let (evidence, with_limit) = differing[2];
    assert_eq!(with_limit.strip_prefix(evidence).map(str::trim), Some("stale after 70ms is false"));
}

/// What a campaign came to.
struct Ran {
    /// Evaluations until the first missed hazard; infinite without one.
    first: f64,
    /// Tests with a missed hazard.
    missed: f64,
}

fn ran(runner: &Runner, campaign: &str, seed: u32) -> Ran {
    runner.run(&["--results", campaign, "--seed", &seed.to_string()]).expect(0);
    let repository = Repository::open(&runner.folder.join(campaign).join(seed.to_string())).unwrap();
    let at = repository.plan().metrics.iter().position(|metric| metric.name == "missed").unwrap();
    let tests = repository.tests().unwrap();
    let missed: Vec<u32> = tests.iter().filter(|row| row.values[at].value == Some(1.0)).map(|row| row.number).collect();
    Ran { first: missed.first().map_or(f64::INFINITY, |&number| f64::from(number)), missed: missed.len() as f64 }
}

#[test]
#[ignore = "long: 20 campaigns of 400 tests"]
fn searching_for_missed_hazards_is_better_than_chance() {
    let folder = fresh_folder("transport_search");
    let space = folder.join("transport_search.sesame");
    let example = workspace().join("examples/transport/transport.sesame");
    let text = format!(
        "space transport_search\nimport \"{}\"\ncampaign unguided from attack {{\n  search random {{ evaluations 400 }}\n}}\n",
        example.display()
    );
    fs::write(&space, text).unwrap();
    let project = Project { space, runners: folder.join("runners"), folder };
    let mut table = String::from(
        "| campaign | seeds with a missed hazard | evaluations until the first | tests with one of 400 |\n|---|---:|---:|---:|\n",
    );
    let [searched, drawn] = ["attack", "unguided"].map(|campaign| {
        let runner = project.build(campaign);
        let runs: Vec<Ran> = (1..=10).map(|seed| ran(&runner, campaign, seed)).collect();
        let column = |of: fn(&Ran) -> f64| {
            let values: Vec<f64> = runs.iter().map(of).collect();
            let [lower, median, upper] = quartiles(&values);
            (format!("{median:.1} ({lower:.1} to {upper:.1})"), values)
        };
        let (firsts, first) = column(|ran| ran.first);
        let (counts, missed) = column(|ran| ran.missed);
        let found = first.iter().filter(|first| first.is_finite()).count();
        writeln!(table, "| {campaign} | {found} of 10 | {firsts} | {counts} |").unwrap();
        (first, missed)
    });
    let first = rank_sum(&searched.0, &drawn.0).unwrap();
    let missed = rank_sum(&searched.1, &drawn.1).unwrap();
    println!("{table}\nfirst: {first:?}\nmissed: {missed:?}\n{searched:?}\n{drawn:?}");
    assert!(missed.a12 > 0.9 && missed.p < 0.001, "{table}\n{missed:?}");
    assert!(first.a12 < 0.5 && first.p < 0.05, "{table}\n{first:?}");
}
