//! The built-in cell: what the first command of the README promises.

use std::fs;
use std::path::Path;

use sesame_record::{Repository, TestRow};
use sesame_tests::{Done, Project, Runner};

/// A run of the campaign; results in a folder of this name.
fn run(runner: &Runner, results: &str, arguments: &[&str]) -> Done {
    let said = runner.run(&[&["run", "--results", results], arguments].concat()).expect(0);
    assert!(said.err.contains("Took "), "{}", said.err);
    said
}

/// The tests of the final front, with their collisions.
fn front(folder: &Path) -> Vec<(TestRow, f64)> {
    let repository = Repository::open(folder).unwrap();
    let collisions = repository.plan().metrics.iter().position(|metric| metric.name == "collision_occurrence").unwrap();
    let members = repository.latest_result_set().unwrap().unwrap().members;
    let tests = repository.tests().unwrap();
    let row = |number: u32| tests.iter().find(|row| row.number == number).unwrap().clone();
    members.into_iter().map(row).map(|row| (row.clone(), row.values[collisions].value.unwrap())).collect()
}

#[test]
fn the_first_command_finds_a_front_and_the_same_one_each_time() {
    let project = Project::kuka_cell("kuka_cell");
    let first = project.run("coverage_experiment", &["--", "--results", "first"]).expect(0);
    for stage in ["Checked", "Generated", "Built"] {
        assert!(first.err.contains(stage), "{}", first.err);
    }
    let folder = project.folder.join("first/42");
    let front = front(&folder);
    assert!(front.iter().any(|(_, collisions)| *collisions >= 5.0), "{front:?}");
    let least = front.iter().map(|(_, collisions)| *collisions).fold(f64::INFINITY, f64::min);
    assert!(front.iter().any(|(_, collisions)| *collisions >= 2.0 * least), "short tests do less harm: {front:?}");
    let repository = Repository::open(&folder).unwrap();
    assert_eq!(repository.tests().unwrap().len(), 212, "210 tests between two reference runs");
    assert!(repository.events().unwrap().is_empty(), "nothing is wrong with the cell: {:?}", repository.events());
    for (row, collisions) in &front {
        assert!(first.out.contains(&format!("T{}", row.number)), "{collisions}: {}", first.out);
    }
    let page = fs::read_to_string(folder.join("report.html")).unwrap();
    assert!(page.contains("<svg") && page.contains("coverage_experiment"));
    let addresses = page.matches("http://").count() + page.matches("https://").count();
    assert_eq!(addresses, page.matches("http://www.w3.org/2000/svg").count(), "the page needs nothing from elsewhere");

    let runner = project.build("coverage_experiment");
    // Shorter ones, for other numbers of workers and another seed.
    let short = |results: &str, more: &[&str]| run(&runner, results, &[&["--evaluations", "63"], more].concat());
    let of_workers = |workers: &str| short(&format!("{workers} workers"), &["--workers", workers]).digest();
    let one = of_workers("1");
    assert_eq!([of_workers("2"), of_workers("3")], [one.clone(), one.clone()]);
    let other = short("short", &["--seed", "7"]);
    assert_ne!(other.digest(), one);
    let read = runner.run(&["digest", "--results", "short/7"]).expect(0);
    assert_eq!(read.out.trim(), other.digest(), "the digest that a run prints is that of its file");
}

#[test]
fn repeating_a_known_test_gives_the_same_result_each_time() {
    let runner = Project::kuka_cell("kuka_cell_repeated").build("determinism");
    run(&runner, "results", &["--evaluations", "4"]);
    let only = fs::read_dir(runner.folder.join("results")).unwrap().next().unwrap().unwrap().path();
    let repository = Repository::open(&only).unwrap();
    let tests = repository.tests().unwrap();
    let repeated: Vec<_> = tests[1..5].iter().map(|row| &row.values).collect();
    assert!(repeated.windows(2).all(|pair| pair[0] == pair[1]), "{repeated:?}");
    assert_ne!(&tests[0].values, repeated[0], "the known test disturbs something");
}
