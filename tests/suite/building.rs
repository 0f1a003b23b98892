//! What is seen while a runner is built.

use std::fs;

use sesame_tests::{Project, workspace};

/// A crate that takes long to build even if its dependencies are built.
const SLOW: &str = "fn main() { std::thread::sleep(std::time::Duration::from_secs(8)) }";

#[test]
fn a_build_that_takes_long_says_every_few_seconds_how_far_it_is() {
    let space = fs::read_to_string(workspace().join("tests/simulators/faulty/space.sesame")).unwrap();
    let project = Project::new("building", &space.replace("NAME", "building"), "faulty");
    let slow = project.folder.join("slow");
    fs::create_dir_all(slow.join("src")).unwrap();
    fs::write(slow.join("Cargo.toml"), "[package]\nname = \"slow\"\nedition = \"2024\"\n\n[workspace]\n").unwrap();
    fs::write(slow.join("build.rs"), SLOW).unwrap();
    fs::write(slow.join("src/lib.rs"), "").unwrap();
    fs::write(project.folder.join("sesame.toml"), "[dependencies]\nslow = { path = \"slow\" }\n").unwrap();

    let arguments = ["--campaign", "harmless", "--", "--evaluations", "1", "--allow-unimplemented"];
    let said = project.sesamec("run", &arguments).expect(0).err;
    assert!(!said.contains(['\r', '\x1b']), "not a terminal: {said:?}");
    let built = said.lines().find_map(|line| line.trim().strip_prefix("Built harmless in ")).expect("it was built");
    let took: f64 = built.strip_suffix(" s").unwrap().parse().unwrap();
    let lines: Vec<&str> = said.lines().filter_map(|line| line.trim().strip_prefix("Building harmless: ")).collect();
    assert!(!lines.is_empty(), "{said}");
    assert!(lines.len() as f64 <= took / 5.0, "a line each five seconds at most, in {took} s: {said}");
    let counts: Vec<(usize, usize)> = lines
        .iter()
        .map(|line| {
            let (done, rest) = line.split_once(" of ").unwrap_or_else(|| panic!("no total in `{line}`"));
            let (all, _) = rest.split_once(" crates, ").unwrap_or_else(|| panic!("no crates in `{line}`"));
            (done.parse().unwrap(), all.parse().unwrap())
        })
        .collect();
    assert!(counts.iter().all(|(done, all)| done < all && *all > 20), "the runner itself comes last: {lines:?}");
    assert!(counts.is_sorted(), "{lines:?}");
}
