//! Programs in Python that put questions to packages that we did not write.

use std::io::Write as _;
use std::process::{Command, Stdio};

use crate::workspace;

/// What a script of the suite prints when it is given these lines; `None` where nobody set the variable that names its
/// Python. One that is named has to work.
pub(crate) fn asked(variable: &str, script: &str, lines: Vec<u8>) -> Option<String> {
    let python = std::env::var_os(variable)?;
    let mut child = Command::new(&python)
        .arg(workspace().join("tests/suite").join(script))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap_or_else(|error| panic!("{variable} names {}, which does not start: {error}", python.display()));
    let mut input = child.stdin.take().expect("it is piped");
    let asking = std::thread::spawn(move || input.write_all(&lines));
    let output = child.wait_with_output().expect("a process that started ends");
    assert!(output.status.success(), "{script} failed; make its Python anew with `./test --long`");
    asking.join().expect("writing does not panic").expect("all lines are read");
    Some(String::from_utf8(output.stdout).expect("Python prints text"))
}
