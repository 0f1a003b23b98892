//! What is seen while a runner is built.

use std::fs;
use std::io::{BufRead as _, BufReader};
use std::process::Stdio;

use sesame_tests::{Project, command, sesamec, workspace};

/// A crate whose build is not over before a file is there, even if its dependencies are built.
const SLOW: &str = "fn main() {
    let enough = std::path::Path::new(env!(\"CARGO_MANIFEST_DIR\")).join(\"../enough\");
    while !enough.exists() { std::thread::sleep(std::time::Duration::from_millis(20)) }
}";

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
    let mut building = command(sesamec());
    building.arg("run").arg(&project.space).arg("-o").arg(&project.runners).args(arguments);
    building.current_dir(&project.folder).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut building = building.spawn().unwrap();
    let mut said = String::new();
    // What is written while it is built is read while it is built. How many crates there are may not be known at first.
    for line in BufReader::new(building.stderr.take().unwrap()).split(b'\n') {
        let line = String::from_utf8(line.unwrap()).unwrap();
        if line.contains("Building harmless: ") && line.contains(" of ") {
            fs::write(project.folder.join("enough"), "").unwrap();
        }
        said += &(line + "\n");
    }
    assert!(building.wait().unwrap().success(), "{said}");
    assert!(!said.contains(['\r', '\x1b']), "not a terminal: {said:?}");
    let built = said.lines().find_map(|line| line.trim().strip_prefix("Built harmless in ")).expect("it was built");
    let took: f64 = built.strip_suffix(" s").unwrap().parse().unwrap();
    let lines: Vec<&str> = said.lines().filter_map(|line| line.trim().strip_prefix("Building harmless: ")).collect();
    assert!(!lines.is_empty(), "{said}");
    assert!(lines.len() as f64 <= took / 5.0, "a line each five seconds at most, in {took} s: {said}");
    let counts: Vec<(usize, usize)> = lines
        .iter()
        .skip_while(|line| !line.contains(" of "))
        .map(|line| {
            let (done, rest) = line.split_once(" of ").unwrap_or_else(|| panic!("no total in `{line}`"));
            let (all, _) = rest.split_once(" crates, ").unwrap_or_else(|| panic!("no crates in `{line}`"));
            (done.parse().unwrap(), all.parse().unwrap())
        })
        .collect();
    assert!(!counts.is_empty(), "{said}");
    assert!(counts.iter().all(|(done, all)| done < all && *all > 20), "the runner itself comes last: {lines:?}");
    assert!(counts.is_sorted(), "{lines:?}");
}
