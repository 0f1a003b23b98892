//! What a scenario is varies from test to test: parameters of a simulator in Python, and one robot of several, which
//! are searched for together.

use std::fs;

use sesame_tests::{Project, fresh_folder, workspace};

use crate::interpreted::without_cargo;

const SPACE: &str = "crossing_carts.sesame";

/// A copy of the example.
fn crossing_carts(name: &str) -> Project {
    let folder = fresh_folder(name);
    for file in ["sim.py", SPACE] {
        fs::copy(workspace().join("examples/crossing_carts").join(file), folder.join(file)).unwrap();
    }
    Project { space: folder.join(SPACE), runners: folder.join("runners"), folder }
}

#[test]
fn start_positions_and_the_fault_of_one_robot_are_found_together_and_shrunk_to_the_simplest_scene() {
    let project = crossing_carts("scenes");
    let run = |into: &str, workers: &str| {
        let more = ["--workers", workers, "--results", into];
        without_cargo(&project, &[&["run", SPACE, "--"], &more[..]].concat()).expect(0)
    };
    let first = run("one", "1");
    assert_eq!(first.digest(), run("three", "3").digest(), "the same for any number of workers");

    // Neither a scene nor a late pose alone is dangerous, and only the poses of `b` are.
    let causes = without_cargo(&project, &["causes", SPACE, "--results", "one/1", "--format", "json"]).expect(0).json();
    let found: Vec<Vec<&str>> = causes["causes"]
        .as_array()
        .unwrap()
        .iter()
        .map(|cause| cause["operations"].as_array().unwrap().iter().map(|name| name.as_str().unwrap()).collect())
        .collect();
    assert!(!found.is_empty(), "{causes}");
    for operations in &found {
        assert!(operations.contains(&"late[b]"), "{operations:?}");
        assert!(operations.iter().any(|operation| operation.starts_with("start_")), "{operations:?}");
        assert!(!operations.contains(&"late[a]") && !operations.contains(&"noisy"), "{operations:?}");
    }

    let smallest = causes["causes"][0]["test"].as_str().unwrap().to_owned();
    let shrunk = ["shrink", SPACE, &smallest, "--results", "one/1", "--into", "small", "--format", "json"];
    let shrunk = without_cargo(&project, &shrunk).expect(0).json();
    let way = &shrunk["shrinking"];
    assert_eq!(way["minimal"], true, "{way}");
    // The simplest scene is the one nearest to the usual one: they still meet, and a hundredth nearer they do not.
    let block = without_cargo(
        &project,
        &["export", SPACE, way["after"]["test"].as_str().unwrap(), "--results", &in_folder(&project, &smallest)],
    );
    let block = block.expect(0).out;
    let chosen: Vec<&str> = block.lines().map(str::trim).filter(|line| line.starts_with("start_")).collect();
    let [start] = chosen[..] else { panic!("one parameter is enough:\n{block}") };
    assert!(start.contains("before start"), "{block}");
    assert!(block.contains("member \"b\""), "{block}");
}

fn in_folder(project: &Project, test: &str) -> String {
    project.folder.join(format!("small/shrink-{test}")).display().to_string()
}
