//! `examples/bugs`, the benchmark of searches for causes: its own tests, which compare its judge with the real program.

use std::process::Command;

use sesame_tests::{sesamec, workspace};

/// Python as the benchmark needs it; without it the test is skipped, and this says so.
fn python() -> Option<Command> {
    let new_enough = "import sys; sys.exit(sys.version_info < (3, 11))";
    let found = ["python3", "python3.11"]
        .into_iter()
        .find(|python| Command::new(python).args(["-c", new_enough]).output().is_ok_and(|said| said.status.success()));
    assert!(found.is_some() || std::env::var_os("CI").is_none(), "Python 3.11 or later is needed");
    if found.is_none() {
        eprintln!("skipped: Python 3.11 or later was not found");
    }
    found.map(Command::new)
}

/// Runs the benchmark's tests whose names contain one of these; all of them if there is none.
fn passes(names: &[&str]) {
    let Some(mut python) = python() else { return };
    let selected = names.iter().flat_map(|name| ["-k", name]);
    let output = python
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
