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

#[test]
fn what_is_launched_beside_a_simulator_has_the_scene_of_each_test_in_its_arguments() {
    let folder = fresh_folder("launched_scene");
    for file in ["sim.py", "world.py", "space.sesame"] {
        fs::copy(workspace().join("tests/simulators/launched_scene").join(file), folder.join(file)).unwrap();
    }
    let project = Project { space: folder.join("space.sesame"), runners: folder.join("runners"), folder };
    let sesamec = |arguments: &[&str]| without_cargo(&project, arguments);
    // The numbers of the test, the furthest place and the number of boxes. The robot drives for a second.
    let measured = |results: &str| {
        let listed = sesamec(&["list", "space.sesame", "--results", results, "--format", "json"]).expect(0).json();
        let row = |row: &serde_json::Value| {
            let number = |metric: &str| row["measured"][metric].as_f64().unwrap_or_else(|| panic!("{listed:#}"));
            let place = (number("furthest") * 1e6).round() / 1e6;
            (row["test"].as_str().unwrap().to_owned(), place, number("heaviest"))
        };
        listed["tests"].as_array().unwrap().iter().map(row).collect::<Vec<_>>()
    };
    let row = |test: &str, place: f64, boxes: f64| (test.to_owned(), place, boxes);

    // One worker keeps the simulator from test to test, and starts what is launched anew for each.
    let known = ["known", "space.sesame", "--campaign", "scenes", "--workers", "1", "--results", "k"];
    sesamec(&known).expect(0);
    // The last one is without disturbance again.
    let (usual, again) = (row("T0", 1.5, 1.0), row("T4", 1.5, 1.0));
    let expected = [usual.clone(), row("T1", 2.25, 1.0), row("T2", 1.5, 6.0), row("T3", -1.0, 3.0), again];
    let mut found = measured("k/known");
    found.sort_by(|one, other| one.0.cmp(&other.0));
    assert_eq!(found, expected);

    let run = |into: &str, workers: &str| {
        let run = ["run", "space.sesame", "--campaign", "scenes", "--", "--workers", workers, "--results", into];
        sesamec(&run).expect(0).digest()
    };
    assert_eq!(run("one", "1"), run("three", "3"), "the same for any number of workers");
    let found = measured("three/1");
    assert_eq!(found[0], usual);
    assert!(found.iter().any(|(_, place, _)| (*place - 1.5).abs() > 0.1), "{found:?}");

    // A campaign that knows nothing of scenes has their usual values.
    sesamec(&["run", "space.sesame", "--campaign", "delays", "--", "--results", "delays"]).expect(0);
    let found = measured("delays/1");
    assert!(found.iter().all(|(_, place, boxes)| (*place, *boxes) == (1.5, 1.0)), "{found:?}");
}

#[test]
fn formulas_read_what_each_test_chose_or_the_default() {
    let project = crossing_carts("scenes_in_formulas");
    let mut text = fs::read_to_string(&project.space).unwrap();
    // Each cart is a step from its start when it first says where it is.
    let metrics = "metric least_a = min(poses[a].x + start_a)\n\
                   metric least_b = min(poses[b].y + start_b)\n\
                   metric margin  = robustness(always (poses[b].y > -start_b))\n\
                   metric first_b = min(poses[b].y)\n\n";
    for (from, to) in [
        ("/// How far before", &*format!("{metrics}/// How far before")),
        ("objectives closest\n", "objectives closest\n  observes least_a, least_b, margin, first_b\n"),
        ("evaluations 120", "evaluations 12"),
        // Where `a` starts, no test of this campaign chooses.
        ("operations start_a, start_b, late, noisy 1..3", "operations start_b, late 1..2"),
    ] {
        assert!(text.contains(from), "{from}");
        text = text.replacen(from, to, 1);
    }
    fs::write(&project.space, text).unwrap();
    without_cargo(&project, &["run", SPACE, "--", "--results", "r"]).expect(0);

    let near = |a: f64, b: f64| (a - b).abs() < 1e-9;
    let mut starts = Vec::new();
    for test in 0..=12 {
        let show = ["show", SPACE, &format!("T{test}"), "--results", "r/1", "--format", "json"];
        let shown = without_cargo(&project, &show).expect(0).json();
        let value = |name: &str| {
            let metric = shown["metrics"].as_array().unwrap().iter().find(|metric| metric["metric"] == name);
            metric.and_then(|metric| metric["value"].as_f64()).unwrap_or_else(|| panic!("{name}: {shown}"))
        };
        for name in ["least_a", "least_b", "margin"] {
            assert!(near(value(name), 0.05), "{name}: {shown}");
        }
        starts.push(0.05 - value("first_b"));
    }
    assert!(near(starts[0], 9.0), "T0 chooses nothing: {starts:?}");
    assert!(starts.iter().filter(|&&start| !near(start, 9.0)).count() > 2, "{starts:?}");
}
