//! A disk that is full, or read-only: a clear error, nothing that was recorded is lost, and `resume` goes on.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use nix::sys::signal::Signal;
use rusqlite::Connection;

use sesame_record::Repository;
use sesame_tests::{Runner, done};

use crate::faults::recording;
use crate::interruption::Running;

/// A small disk in memory; gone when dropped.
struct Disk(PathBuf);

/// Set where a test runs once more, in a namespace of its own.
const WITHIN: &str = "SESAME_TEST_NAMESPACE";

/// Runs a test that mounts disks in a mount namespace of its own, so that no mount is left behind however the test
/// ends. For that, this program is started again with the test of this name only. A user who is not root gets a user
/// namespace too, where Linux permits it. Where neither is permitted, the test says that it is skipped.
fn with_disks(test: &str, body: fn()) {
    if std::env::var_os(WITHIN).is_some() {
        return body();
    }
    let namespace = |options: &[&str]| {
        let mut unshare = Command::new("unshare");
        unshare.arg("--mount").args(options);
        unshare
    };
    let may_mount = |options: &[&str]| {
        let place = tempfile::tempdir().unwrap();
        let script = "mount -t tmpfs -o size=64k sesame-test \"$0\"";
        let said = namespace(options).args(["sh", "-c", script]).arg(place.path()).output();
        said.is_ok_and(|said| said.status.success())
    };
    let Some(options) = [&[][..], &["--user", "--map-root-user"]].into_iter().find(|options| may_mount(options)) else {
        eprintln!("skipped: a small disk can be mounted neither by this user nor in a user namespace");
        return;
    };
    let mut again = namespace(options);
    again.arg(std::env::current_exe().unwrap()).args([&format!("disk::{test}"), "--exact", "--nocapture"]);
    let said = done(again.env(WITHIN, "1")).expect(0);
    assert!(said.out.contains("1 passed"), "{}", said.out);
}

impl Disk {
    fn mount(runner: &Runner) -> Disk {
        let place = runner.folder.join("disk");
        fs::create_dir_all(&place).unwrap();
        let mut mount = Command::new("mount");
        done(mount.args(["-t", "tmpfs", "-o", "size=16m", "sesame-test"]).arg(&place)).expect(0);
        Disk(place)
    }

    fn remount(&self, how: &str) {
        done(Command::new("mount").args(["-o", &format!("remount,{how}")]).arg(&self.0)).expect(0);
    }

    /// Fills it so that this many bytes are left, and gives the file to be removed.
    fn leave(&self, bytes: usize) -> PathBuf {
        let filler = self.0.join("filler");
        fs::write(&filler, vec![0; (16 << 20) - bytes - (64 << 10)]).unwrap();
        filler
    }
}

impl Drop for Disk {
    fn drop(&mut self) {
        Command::new("umount").arg("-l").arg(&self.0).status().ok();
    }
}

fn recorded(folder: &Path) -> usize {
    Repository::open(folder).and_then(|repository| repository.tests()).map_or(0, |tests| tests.len())
}

/// Runs on disks with less and less room, makes room, and goes on. Gives how many runs broke off in the middle.
fn filled_up(name: &str, clause: &str, room: &[usize]) -> usize {
    let runner = recording(name, "harmless", clause);
    let whole = runner.run(&["--results", "whole"]).expect(0).digest();
    let disk = Disk::mount(&runner);
    let mut broke_off = 0;
    for kilobytes in room {
        let filler = disk.leave(kilobytes << 10);
        let results = disk.0.join(format!("r{kilobytes}"));
        let said = runner.run(&["--results", results.to_str().unwrap()]);
        fs::remove_file(filler).unwrap();
        let folder = results.join("3");
        let tests = recorded(&folder);
        if said.code == Some(0) {
            assert_eq!(said.digest(), whole);
        } else {
            let said = said.expect(1);
            let words = ["disk is full", "No space left on device"];
            assert!(said.err.contains("error: "), "{}", said.err);
            assert!(words.iter().any(|words| said.err.contains(words)), "{}", said.err);
            assert!(said.err.contains(results.to_str().unwrap()), "the place is named: {}", said.err);
            assert!(!said.err.contains("panicked"), "{}", said.err);
            if tests > 0 {
                broke_off += 1;
                let rows = Repository::open(&folder).unwrap().tests().unwrap();
                assert!(
                    rows.iter().all(|row| row.outcome.word() == "completed"),
                    "nothing is taken for a crash: {rows:?}"
                );
                assert_eq!(runner.run(&["resume", folder.to_str().unwrap()]).expect(0).digest(), whole);
                assert_eq!(recorded(&folder), 62);
            }
        }
        fs::remove_dir_all(&results).unwrap();
    }
    broke_off
}

#[test]
fn a_full_disk_loses_nothing_that_was_recorded_and_resume_goes_on() {
    with_disks("a_full_disk_loses_nothing_that_was_recorded_and_resume_goes_on", || {
        // The first ones before there is a table, and before there is a test.
        let broke_off = filled_up("disk_full", "", &[16, 80, 200, 300, 400, 500]);
        assert!(broke_off >= 2, "{broke_off} runs broke off in the middle");
    });
}

#[test]
fn a_disk_that_traces_fill_loses_nothing_that_was_recorded_and_resume_goes_on() {
    with_disks("a_disk_that_traces_fill_loses_nothing_that_was_recorded_and_resume_goes_on", || {
        let broke_off = filled_up("disk_full_of_traces", "record mcap all", &[600, 1200]);
        assert!(broke_off >= 1, "{broke_off} runs broke off in the middle");
    });
}

#[test]
fn results_on_a_disk_made_read_only_are_left_alone_and_taken_up_again() {
    with_disks("results_on_a_disk_made_read_only_are_left_alone_and_taken_up_again", || {
        let runner = recording("disk_read_only", "harmless", "");
        let whole = runner.run(&["--results", "whole"]).expect(0).digest();
        let disk = Disk::mount(&runner);
        let mut running = Running::start(&runner, "disk/r", "1");
        running.until_recorded(10);
        running.signal(Signal::SIGINT);
        running.ended().1.expect(130);
        let tests = recorded(&disk.0.join("r/3"));
        disk.remount("ro");
        let said = runner.run(&["resume", "disk/r/3"]).expect(1);
        assert!(said.err.contains("error: cannot lock the results: Read-only file system"), "{}", said.err);
        assert!(said.err.contains("disk/r/3"), "{}", said.err);
        let begun = runner.run(&["--results", "disk/other"]).expect(1);
        assert!(begun.err.contains("Read-only file system") && begun.err.contains("disk/other"), "{}", begun.err);
        disk.remount("rw");
        assert_eq!(recorded(&disk.0.join("r/3")), tests);
        assert_eq!(runner.run(&["resume", "disk/r/3"]).expect(0).digest(), whole);
    });
}

#[test]
fn results_left_in_the_middle_of_writing_are_put_right_where_something_may_be_written() {
    with_disks("results_left_in_the_middle_of_writing_are_put_right_where_something_may_be_written", || {
        let runner = recording("disk_unsettled", "harmless", "");
        let whole = runner.run(&["--results", "whole"]).expect(0).digest();
        let disk = Disk::mount(&runner);
        let (from, to) = (runner.folder.join("whole/3"), disk.0.join("3"));
        fs::create_dir(&to).unwrap();
        // What a kill leaves of a transaction that has begun to overwrite the file.
        let database = Connection::open(from.join("results.sqlite")).unwrap();
        database.pragma_update(None, "cache_size", 1).unwrap();
        database.execute_batch("BEGIN IMMEDIATE; UPDATE series_pieces SET points = points + 1").unwrap();
        for name in ["results.sqlite", "results.sqlite-journal"] {
            fs::copy(from.join(name), to.join(name)).unwrap();
        }
        disk.remount("ro");
        let refused = runner.run(&["digest", "--results", "disk/3"]).expect(1);
        assert!(refused.err.contains("a run that broke off left these results in need of recovery"), "{}", refused.err);
        assert!(refused.err.contains("disk/3"), "{}", refused.err);
        disk.remount("rw");
        assert_eq!(runner.run(&["digest", "--results", "disk/3"]).expect(0).out.trim(), whole);
    });
}
