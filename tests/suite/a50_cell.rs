//! The A50 drive-shaft cell: its known tests come out as they are known, and its `ConSert` is watched.

use std::fs;

use sesame_record::Repository;
use sesame_tests::{Project, command, done, fresh_folder, sesamec, workspace};

/// A copy of the example.
fn a50_cell(name: &str) -> Project {
    let folder = fresh_folder(name);
    for file in ["sim.py", "a50_cell.sesame"] {
        fs::copy(workspace().join("examples/a50_cell").join(file), folder.join(file)).unwrap();
    }
    Project { space: folder.join("a50_cell.sesame"), runners: folder.join("runners"), folder }
}

#[test]
fn the_space_has_nothing_to_remark_and_the_known_tests_are_as_expected() {
    let project = a50_cell("a50_cell");
    done(command(sesamec()).args(["check", "--deny", "warnings"]).arg(&project.space)).expect(0);
    let known = project.sesamec("known", &["--campaign", "firstExperiment"]).expect(0);
    assert_eq!(known.out.matches("known_").count(), 6, "six expectations:\n{}", known.out);
    assert!(!known.out.contains("inconclusive\n") && !known.err.contains("not as required"), "{}", known.out);
}

#[test]
fn each_campaign_comes_to_what_is_known_of_it() {
    let project = a50_cell("a50_campaigns");
    // What the metrics are in all of the tests; the last one is the lead time of a hazard, if there is one.
    let expected = [
        ("nullFuzzing", [0.0, 9.05, 0.0, -99999.0]),
        ("knownCollision", [7.0, 9.05, 0.0, 1.2]),
        ("knownDynamic", [0.0, 100.0, 70.0, -99999.0]),
    ];
    for (campaign, values) in expected {
        project.sesamec("run", &["--campaign", campaign]).expect(0);
        let results = project.runners.join(campaign).join("results");
        let only = fs::read_dir(results).unwrap().next().unwrap().unwrap().path();
        let repository = Repository::open(&only).unwrap();
        let tests = repository.tests().unwrap();
        assert_eq!(tests.len(), 12, "{campaign}: ten between two reference runs");
        for row in &tests[1..11] {
            for (name, value) in ["M1_collision", "M2_", "M3_", "M4_"].iter().zip(values) {
                let at = repository.plan().metrics.iter().position(|metric| metric.name.starts_with(name)).unwrap();
                let found = row.values[at].value.unwrap();
                assert!((found - value).abs() < 0.001, "{campaign}, T{}, {name}: {found}", row.number);
            }
        }
    }
    let searched = project.sesamec("run", &["--campaign", "firstExperiment", "--", "--evaluations", "60"]).expect(0);
    assert!(searched.out.contains("R4"), "the search finds hazards that the ConSert misses: {}", searched.out);
}
