//! Tests that are chosen for a lab: the published example, in both modes.

use std::path::{Path, PathBuf};

use sesame_tests::{Done, command, done, fresh_folder, sesamec};

/// The front of the published example.
const SET: &str = "NONDOM-20_06_2023_18_50_18-intermediate-210";

/// The example, imported; `None` without the files of the original platform.
fn imported(name: &str) -> Option<PathBuf> {
    let Some(folder) = std::env::var_os("SESAME_LEGACY_DIR") else {
        eprintln!("skipped: SESAME_LEGACY_DIR names no folder of files of the original platform");
        return None;
    };
    let out = fresh_folder(name);
    let file = Path::new(&folder).join("kuka-coverage-ga.model");
    done(command(sesamec()).arg("import").arg(file).arg("-o").arg(&out)).expect(0);
    Some(out.join("results/coverageExperiment"))
}

fn select(results: &Path, arguments: &[&str]) -> Done {
    done(command(sesamec()).arg("select").arg(results).args(["--set", SET, "--dims", "T1,T2,P1"]).args(arguments))
}

#[test]
fn the_published_choices_are_found_and_proved_in_both_modes() {
    let Some(results) = imported("table_4") else { return };
    // [SESAME 2023, Table 4] and the same example by our definitions: λ, tests, value.
    let paper = [
        ("0", "T27 T137 T158 T161 T174", 19.036_363_636),
        ("0.25", "T27 T158 T161 T174 T201", 16.639_976_145),
        ("0.5", "T158 T161 T174 T201 T209", 14.472_695_899),
        ("0.75", "T103 T158 T161 T174 T201", 12.934_505_379),
        ("1", "T103 T158 T161 T174 T187", 11.982_399_858),
    ];
    let ours = [
        ("0", "T27 T137 T158 T161 T174", 19.095_890_411),
        ("0.25", "T27 T137 T158 T161 T174", 15.488_983_908),
        ("0.5", "T27 T158 T161 T174 T201", 11.933_043_808),
        ("0.75", "T158 T161 T174 T201 T209", 8.536_869_371),
        ("1", "T103 T158 T161 T174 T187", 5.991_199_929),
    ];
    for (compat, expected) in [("paper", paper), ("ours", ours)] {
        for (lambda, tests, value) in expected {
            let rank = ["--rank", "collisionOccurance:descending", "--budget", "5"];
            let said =
                select(&results, &[&rank[..], &["--lambda", lambda, "--compat", compat, "--format", "csv"]].concat());
            let said = said.expect(0);
            let chosen: Vec<&str> = said.out.lines().skip(1).map(|row| row.split(',').next().unwrap()).collect();
            assert_eq!(chosen.join(" "), tests, "{compat} {lambda}");
            let (_, after) = said.err.split_once(": value ").unwrap_or_else(|| panic!("{}", said.err));
            let found: f64 = after.split(',').next().unwrap().parse().unwrap();
            assert!((found - value).abs() < 5e-10, "{compat} {lambda}: {found}");
            assert!(after.contains("proved to be the best"), "{}", said.err);
            assert!(said.err.contains("T202 is not a candidate: equal to T103"), "{}", said.err);
        }
    }
}

#[test]
fn a_choice_that_cannot_be_made_says_what_is_missing() {
    let Some(results) = imported("no_choice") else { return };
    let refused = |arguments: &[&str]| select(&results, arguments).expect(1).err;
    assert!(refused(&[]).contains("how much may the tests cost? give `--budget`"));
    assert!(refused(&["--budget", "0.5"]).contains("none of these tests is a candidate"));
    assert!(refused(&["--budget", "5", "--lambda", "2"]).contains("λ is 2, which is not in 0 to 1"));
    assert!(refused(&["--budget", "5", "--rank", "collisions:descending"]).contains("there is no metric `collisions`"));
    assert!(refused(&["--budget", "5", "--rank", "collisionOccurance:up"]).contains("`up` is neither `ascending`"));
    assert!(refused(&["--budget", "5", "--run", "T1"]).contains("T1 is not a candidate, so it cannot count as run"));
    assert!(refused(&["--budget", "5", "--lab", "hall"]).contains("there is no lab `hall`: the space had none"));
}
