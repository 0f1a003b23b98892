//! Standard output and standard error that cannot be written: a full disk under a log, a reader that has gone away.

use std::fs::File;
use std::process::{Command, Stdio};

use sesame_tests::{Done, done, sesamec, workspace};

/// Where output goes that cannot be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Nowhere {
    /// A disk without space.
    Full,
    /// A pipe whose reader is gone.
    Gone,
}

impl Nowhere {
    const ALL: &[Nowhere] = if cfg!(target_os = "linux") { &[Nowhere::Full, Nowhere::Gone] } else { &[Nowhere::Gone] };

    fn open(self) -> Stdio {
        match self {
            Nowhere::Full => File::options().write(true).open("/dev/full").unwrap().into(),
            // The reader is dropped here.
            Nowhere::Gone => std::io::pipe().unwrap().1.into(),
        }
    }
}

/// What a command does whose standard error cannot be written.
fn unheard(command: &mut Command, nowhere: Nowhere) -> Done {
    let output = command.stderr(nowhere.open()).stdout(Stdio::piped()).spawn().unwrap().wait_with_output().unwrap();
    Done::of(&output)
}

/// What a command does whose standard output cannot be written.
fn unread(command: &mut Command, nowhere: Nowhere) -> Done {
    let output = command.stdout(nowhere.open()).stderr(Stdio::piped()).spawn().unwrap().wait_with_output().unwrap();
    Done::of(&output)
}

#[test]
fn a_log_that_cannot_be_written_ends_no_run() {
    let runner = super::faults::faulty("unwritable_log", "all_faults");
    let short = ["--timeout", "2", "--fail-on", "nothing", "--evaluations", "12"];
    let run = |results: &str| runner.command(&[&["--results", results], &short[..]].concat());
    let digest = done(&mut run("heard")).expect(0).digest();
    for &nowhere in Nowhere::ALL {
        let name = format!("{nowhere:?}");
        assert_eq!(unheard(&mut run(&name), nowhere).expect(0).digest(), digest);
        let results = format!("{name}/3");
        // A gate that closes and a note say something, too.
        unheard(&mut runner.command(&["report", "--results", &results, "--fail-on", "crash"]), nowhere).expect(3);
        unheard(&mut runner.command(&["replay", "T1", "--results", &results]), nowhere).expect(0);
        unheard(&mut runner.command(&["show", "T9999", "--results", &results]), nowhere).expect(1);
    }
}

#[test]
fn what_was_asked_for_and_cannot_be_written_is_an_error_unless_nobody_reads_on() {
    let space = workspace().join("examples/kuka_cell/kuka_cell.sesame");
    let space = space.to_str().unwrap();
    let asked: &[&[&str]] = &[
        &["explain", "E0203"],
        &["explain", "coverage_experiment", space],
        &["completions", "bash"],
        &["generate", "--dry-run", space],
    ];
    for arguments in asked {
        done(Command::new(sesamec()).args(*arguments)).expect(0);
        for &nowhere in Nowhere::ALL {
            let (code, words) = match nowhere {
                Nowhere::Full => (1, "error: cannot write to standard output: No space left on device"),
                Nowhere::Gone => (0, ""),
            };
            let said = unread(Command::new(sesamec()).args(*arguments), nowhere).expect(code);
            assert!(said.err.contains(words), "{arguments:?}: {}", said.err);
            assert!(!said.err.contains("panicked"), "{arguments:?}: {}", said.err);
        }
    }
}
