//! What this workspace depends on, held against advisories, licences and sources.

use std::path::{Path, PathBuf};
use std::process::Command;

use sesame_audit::{Problem, advisory, agreed, audit, licence, locked};

/// With `SESAME_ADVISORY_DB`, a folder, against that database; a relative one is looked for from the workspace.
/// Without, against the project's snapshot.
#[test]
fn no_dependency_has_an_advisory_a_licence_or_a_source_that_was_not_agreed_to() {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let workspace = here.join("../..");
    let database = match std::env::var_os("SESAME_ADVISORY_DB") {
        Some(folder) => workspace.join(PathBuf::from(folder)),
        None => here.join("advisories"),
    };

    let read = |path: PathBuf| std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path:?}: {error}"));
    let packages = locked::packages(&read(workspace.join("Cargo.lock"))).unwrap();
    let agreed = agreed::read(&read(here.join("agreed.toml"))).unwrap();
    let known = advisory::read(&database, &packages).unwrap_or_else(|error| panic!("{error}"));
    let licences = licence::of_metadata(&metadata(&workspace)).unwrap();

    let problems = audit(&packages, &known, &licences, &agreed).unwrap_or_else(|error| panic!("{error}"));
    let lines: Vec<String> = problems.iter().map(Problem::to_string).collect();
    assert!(problems.is_empty(), "held against {}:\n{}", database.display(), lines.join("\n"));
}

/// What `cargo metadata` prints. It needs no network once `cargo fetch --locked` has run, which `./test` does.
fn metadata(workspace: &Path) -> String {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version", "1", "--locked", "--all-features"])
        .current_dir(workspace)
        .output()
        .expect("cargo runs, since it runs this test");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("cargo prints JSON")
}
