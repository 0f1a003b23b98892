//! Damaged results, given to everything that reads results: they are read, or refused with a message, and stay as they
//! are.
//!
//! The damage: bytes are overwritten or cut off; values, rows and tables are changed in SQL; the plan inside is changed
//! token by token and branch by branch. A change is a function of its number, so that one that makes a reader fail can
//! be repeated.

mod changes;
mod plans;
mod readers;
mod whole;

use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use sesame_record::DATABASE;

use self::changes::tampered;
use self::readers::read_all;
use self::whole::wholes;

/// Reads results after each of these changes; fails if a reader panics, takes longer than a minute or writes to the
/// file. Returns how many answers and how many refusals there were.
fn all_are_read_or_refused(numbers: std::ops::Range<u64>) -> (u32, u32) {
    let wholes = wholes();
    let folder = tempfile::tempdir().unwrap();
    let (ask, asked) = channel::<PathBuf>();
    let (answer, answered) = channel();
    let reader = std::thread::spawn(move || {
        for folder in asked {
            let read = catch_unwind(AssertUnwindSafe(|| read_all(&folder)));
            if answer.send(read.map_err(|_| ())).is_err() {
                break;
            }
        }
    });
    let (mut answers, mut refusals, mut troubles) = (0, 0, Vec::new());
    for number in numbers {
        // What ends the whole process, such as a stack that overflows, leaves at least this.
        if number % 100 == 0 {
            println!("from change {number}");
        }
        let done = tampered(&wholes, number, folder.path());
        let before = fs::read(folder.path().join(DATABASE)).unwrap();
        ask.send(folder.path().to_owned()).unwrap();
        match answered.recv_timeout(Duration::from_secs(60)) {
            Ok(Ok(read)) => {
                answers += read.answered;
                refusals += read.refused;
            }
            Ok(Err(())) => troubles.push(format!("{done}: a reader panics")),
            Err(RecvTimeoutError::Timeout) => panic!("{done}: no answer after a minute"),
            Err(RecvTimeoutError::Disconnected) => panic!("{done}: the reader is gone"),
        }
        if fs::read(folder.path().join(DATABASE)).unwrap() != before {
            troubles.push(format!("{done}: the file was changed"));
        }
        assert!(troubles.len() < 20, "{}", troubles.join("\n"));
    }
    drop(ask);
    reader.join().unwrap();
    assert!(troubles.is_empty(), "{}", troubles.join("\n"));
    (answers, refusals)
}

#[test]
fn whatever_is_done_to_results_they_are_read_or_refused_and_stay_as_they_are() {
    let (answers, refusals) = all_are_read_or_refused(0..60);
    assert!(answers > 0 && refusals > 0, "what is done leaves some results whole, and spoils others");
}

#[test]
#[ignore = "long: 35,000 changes to results, each before all that reads results"]
fn of_35_000_changes_to_results_none_is_too_much() {
    let number = |name| std::env::var(name).ok().and_then(|text| text.parse().ok());
    let first = number("SESAME_TAMPERING_FROM").unwrap_or(1_000);
    let last = first + number("SESAME_TAMPERING_COUNT").unwrap_or(35_000);
    let parts = std::thread::available_parallelism().map_or(1, |processors| processors.get() as u64);
    let edge = |part: u64| first + (last - first) * part / parts;
    std::thread::scope(|scope| {
        for part in 0..parts {
            scope.spawn(move || all_are_read_or_refused(edge(part)..edge(part + 1)));
        }
    });
}

/// A shrunk test that was gone to for ever, and generations that end before those before them.
#[test]
fn changes_that_were_once_too_much_are_read_or_refused() {
    for change in [20_827, 22_243] {
        all_are_read_or_refused(change..change + 1);
    }
}
