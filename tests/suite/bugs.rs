//! `examples/bugs`, the benchmark of searches for causes: its own tests, which compare its judge with the real program.

use std::process::Command;

use sesame_tests::{sesamec, workspace};

/// What succeeds in Python 3.11 and later, which the benchmark needs.
const NEW_ENOUGH: &str = "import sys; sys.exit(sys.version_info < (3, 11))";

/// Runs the benchmark's tests whose names contain one of these; all of them if there is none.
fn passes(names: &[&str]) {
    let Some(python) = sesame_peers::installed(&["python3", "python3.11"], &["-c", NEW_ENOUGH]) else { return };
    let selected = names.iter().flat_map(|name| ["-k", name]);
    let output = Command::new(python)
        .args(["test_bugs.py", "-v"])
        .args(selected)
        .current_dir(workspace().join("examples/bugs"))
        .env("SESAMEC", sesamec())
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .output()
        .expect("Python starts");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    // Strategies whose packages are not installed are skipped; the comparisons with Sesame are not.
    assert!(!said.contains("the variable SESAMEC"), "{said}");
    let ran = said.lines().filter(|line| line.ends_with("... ok")).count();
    assert!(ran >= names.len().max(1), "{said}");
}

#[test]
fn cases_are_those_of_their_spaces_and_the_table_counts_what_was_found() {
    passes(&["test_the_plan_of_a_case", "test_a_case", "test_what_is_finished", "Table", "Operations"]);
}

#[test]
#[ignore = "long: judges thousands of tests in Python"]
fn the_judge_of_the_benchmark_agrees_with_what_searches_record() {
    passes(&[]);
}
