//! The Python package mcap, by which others read our traces.

use std::path::PathBuf;
use std::process::Command;

use serde_json::Value;

use crate::workspace;

/// The variable that names a Python with mcap; `./test --long` makes one and sets it.
pub const PYTHON: &str = "SESAME_MCAP_PYTHON";

/// What Python finds in each of these files: an object with `topics` (messages per topic), `deeds` (what operations
/// did, how often, per position in the test), `series` (change points per metric) and `run` (how it ended). `None`
/// where nobody named a Python that has it. One that is named has to work.
pub fn read(files: &[PathBuf]) -> Option<Vec<Value>> {
    let python = std::env::var_os(PYTHON)?;
    let output = Command::new(&python)
        .arg(workspace().join("tests/suite/traces.py"))
        .args(files)
        .output()
        .unwrap_or_else(|error| panic!("{PYTHON} names {}, which does not start: {error}", python.display()));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said = String::from_utf8(output.stdout).expect("Python prints JSON");
    let found: Vec<Value> =
        said.lines().map(|line| serde_json::from_str(line).expect("each line is an object")).collect();
    assert_eq!(found.len(), files.len(), "every file has a line");
    Some(found)
}
