//! Folders of runs: who writes there, what a killed run leaves behind, and which run is the latest.

use std::path::Path;

use rusqlite::Connection;

use super::{commit_all, digest_of, folder};
use crate::{
    Claim, DATABASE, LOCK, RecordError, Recorder, Repository, claim_folder, latest_folder, latest_unfinished, sample,
};

#[test]
fn a_finished_run_is_one_plain_file_beside_its_lock() {
    let folder = folder();
    drop(sample::campaign(folder.path(), &sample::plan(), 20));
    let mut names: Vec<_> = std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    names.sort();
    assert_eq!(names, [LOCK, DATABASE]);
}

#[test]
fn a_run_that_was_killed_keeps_every_committed_test_and_can_be_resumed() {
    let folder = folder();
    let records = sample::records(&sample::plan(), 30);
    let (before, after) = records.split_at(20);
    let whole = digest_of(&records);
    // What a kill leaves behind: the files as they are in the middle of a run, log included.
    let killed = tempfile::tempdir().unwrap();
    let recorder = commit_all(folder.path(), before);
    for entry in std::fs::read_dir(folder.path()).unwrap() {
        let entry = entry.unwrap();
        std::fs::copy(entry.path(), killed.path().join(entry.file_name())).unwrap();
    }
    drop(recorder);
    let repository = Repository::open(killed.path()).unwrap();
    assert_eq!(repository.campaign().stop, None);
    assert_eq!(repository.tests().unwrap().len(), before.len());
    drop(repository);
    let mut resumed = Recorder::resume(killed.path(), 1).unwrap();
    for record in after {
        resumed.commit(record).unwrap();
    }
    let repository = resumed.finish("all evaluations done").unwrap();
    assert_eq!(repository.sessions().unwrap().len(), 2);
    assert_eq!(repository.digest().unwrap(), whole, "going on gives what an unbroken run gives");
}

/// What a kill in the middle of a transaction without write-ahead log leaves behind, as the end of a run has it: half
/// of the file overwritten, and a journal with what was there before. Gives the database.
fn broken_off(folder: &Path, into: &Path, change: &str) -> std::path::PathBuf {
    let writer = Connection::open(folder.join(DATABASE)).unwrap();
    // With next to no memory pages are written before the commit.
    let mode: String = writer.query_row("PRAGMA journal_mode = DELETE", [], |row| row.get(0)).unwrap();
    assert_eq!(mode, "delete");
    writer.pragma_update(None, "cache_size", 1).unwrap();
    writer.execute_batch(&format!("BEGIN IMMEDIATE; {change}")).unwrap();
    for name in [DATABASE.to_owned(), format!("{DATABASE}-journal")] {
        std::fs::copy(folder.join(&name), into.join(&name)).unwrap();
    }
    into.join(DATABASE)
}

#[test]
fn results_whose_run_was_killed_while_it_wrote_its_end_are_read_as_they_were() {
    let (folder, killed) = (folder(), tempfile::tempdir().unwrap());
    let whole = sample::campaign(folder.path(), &sample::plan(), 60).digest().unwrap();
    let before = std::fs::read(folder.path().join(DATABASE)).unwrap();
    let copy = broken_off(folder.path(), killed.path(), "UPDATE series_pieces SET points = points + 1");
    assert_ne!(std::fs::read(&copy).unwrap(), before, "it was half overwritten");
    let raw = Connection::open_with_flags(&copy, rusqlite::OpenFlags::SQLITE_OPEN_READ_ONLY).unwrap();
    let refused = raw.query_row("SELECT count(*) FROM tests", [], |row| row.get::<_, i64>(0)).unwrap_err();
    assert_eq!(refused.sqlite_error().unwrap().extended_code, rusqlite::ffi::SQLITE_READONLY_ROLLBACK);
    drop(raw);
    assert_eq!(Repository::open(killed.path()).unwrap().digest().unwrap(), whole);
    assert_eq!(std::fs::read(&copy).unwrap(), before);
    assert!(!killed.path().join(format!("{DATABASE}-journal")).exists());
}

#[test]
fn a_run_killed_before_its_results_had_all_tables_has_none_and_the_folder_can_be_used() {
    let results = folder();
    let run = results.path().join("7");
    std::fs::create_dir(&run).unwrap();
    let database = Connection::open(run.join("results.sqlite.begun")).unwrap();
    database.execute_batch("CREATE TABLE tests (number INTEGER)").unwrap();
    drop(database);
    std::fs::write(run.join("results.sqlite.begun-journal"), "half a journal").unwrap();
    assert!(matches!(Repository::open(&run), Err(RecordError::Missing { .. })));
    assert_eq!(latest_folder(results.path()).unwrap(), None);
    let whole = sample::campaign(&run, &sample::plan(), 60).digest().unwrap();
    assert_eq!(Repository::open(&run).unwrap().digest().unwrap(), whole);
    let mut left: Vec<_> = std::fs::read_dir(&run).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    left.sort();
    assert_eq!(left, ["results.lock", "results.sqlite"]);
}

#[test]
fn what_broke_off_in_the_file_of_another_program_is_left_to_that_program() {
    let (folder, killed) = (folder(), tempfile::tempdir().unwrap());
    let other = Connection::open(folder.path().join(DATABASE)).unwrap();
    let fill = "INSERT INTO t WITH RECURSIVE n(i) AS (SELECT 1 UNION SELECT i + 1 FROM n WHERE i < 999) \
                SELECT i, hex(zeroblob(200)) FROM n";
    other.execute_batch(&format!("CREATE TABLE t (a, b); {fill}")).unwrap();
    drop(other);
    let copy = broken_off(folder.path(), killed.path(), "UPDATE t SET a = a + 1");
    let journal = killed.path().join(format!("{DATABASE}-journal"));
    let before = (std::fs::read(&copy).unwrap(), std::fs::read(&journal).unwrap());
    let error = Repository::open(killed.path()).unwrap_err();
    assert!(matches!(error, RecordError::Foreign { .. }), "{error}");
    assert_eq!((std::fs::read(&copy).unwrap(), std::fs::read(&journal).unwrap()), before);
}

#[test]
fn one_process_writes_and_others_may_read() {
    let folder = folder();
    let recorder = commit_all(folder.path(), &sample::records(&sample::plan(), 3));
    let error = Recorder::resume(folder.path(), 1).unwrap_err();
    assert!(matches!(error, RecordError::Locked { pid: Some(pid), .. } if pid == std::process::id()), "{error}");
    assert!(error.to_string().contains(&format!("process {} is writing", std::process::id())), "{error}");
    assert_eq!(Repository::open(folder.path()).unwrap().tests().unwrap().len(), 5);
    recorder.interrupt().unwrap();
    Recorder::resume(folder.path(), 1).unwrap().finish("stopped").unwrap();
    assert!(matches!(Recorder::resume(folder.path(), 1).unwrap_err(), RecordError::Finished { .. }));
    let error = Recorder::create(folder.path(), &sample::plan(), 42, 1).unwrap_err();
    assert!(matches!(error, RecordError::Exists { .. }), "{error}");
}

#[test]
fn a_run_can_be_finished_while_somebody_reads_it() {
    let folder = folder();
    let recorder = commit_all(folder.path(), &sample::records(&sample::plan(), 3));
    let reader = Connection::open(folder.path().join(DATABASE)).unwrap();
    let mut statement = reader.prepare("SELECT number FROM tests").unwrap();
    let mut rows = statement.query([]).unwrap();
    assert!(rows.next().unwrap().is_some());
    recorder.repository().connection.busy_timeout(std::time::Duration::ZERO).unwrap();
    let repository = recorder.finish("all evaluations done").unwrap();
    assert_eq!(repository.tests().unwrap().len(), 5);
}

#[test]
fn a_taken_folder_gets_the_next_number_and_an_unfinished_one_is_named() {
    let results = folder();
    let claimed = |name: &str| {
        let Claim { folder, unfinished, .. } = claim_folder(results.path(), name).unwrap();
        (folder, unfinished)
    };
    let (first, second, third) = (results.path().join("42"), results.path().join("42-2"), results.path().join("42-3"));
    assert_eq!(claimed("42"), (first.clone(), None));
    let running = commit_all(&first, &[]);
    assert_eq!(claimed("42"), (second.clone(), None), "the first still runs");
    std::fs::write(second.join("mine"), "what is in a folder is not touched").unwrap();
    running.interrupt().unwrap();
    assert_eq!(claimed("42"), (third, Some(first.clone())));
    Recorder::resume(&first, 1).unwrap().finish("done").unwrap();
    assert_eq!(claimed("42").1, None);
    assert_eq!(claimed("7").0, results.path().join("7"));
}

#[test]
fn a_folder_that_a_run_left_without_results_is_taken_by_the_next_one_unless_it_is_being_begun() {
    let results = folder();
    let run = results.path().join("42");
    let leftovers: [&[&str]; 3] =
        [&[], &["results.lock"], &["results.lock", "results.sqlite.begun", "results.sqlite.begun-journal"]];
    for left in leftovers {
        std::fs::create_dir_all(&run).unwrap();
        for name in left {
            std::fs::write(run.join(name), "half").unwrap();
        }
        let claim = claim_folder(results.path(), "42").unwrap();
        assert_eq!(claim.folder, run, "{left:?}");
        let other = claim_folder(results.path(), "42").unwrap();
        assert_eq!(other.folder, results.path().join("42-2"), "{left:?}: the first is claimed");
        drop(other);
        let recorder = Recorder::create_in(claim, &sample::plan(), &sesame_plan::Task::Campaign, 42, 1).unwrap();
        assert_eq!(claim_folder(results.path(), "42").unwrap().folder, results.path().join("42-2"));
        recorder.finish("done").unwrap();
        std::fs::remove_dir_all(&run).unwrap();
    }
}

/// Sets back the clock of what is in a folder, by so many seconds.
fn age(folder: &Path, seconds: u64) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let file = std::fs::File::options().write(true).open(entry.unwrap().path()).unwrap();
        let then = file.metadata().unwrap().modified().unwrap() - std::time::Duration::from_secs(seconds);
        file.set_modified(then).unwrap();
    }
}

#[test]
fn a_run_that_ended_before_any_test_did_hides_none_that_found_something() {
    let results = folder();
    let [found, failed] = ["7", "8"].map(|name| results.path().join(name));
    let records = sample::records(&sample::plan(), 3);
    commit_all(&failed, &records[..1]).finish("the reference run failed").unwrap();
    assert_eq!(latest_folder(results.path()).unwrap(), Some(failed.clone()), "there is nothing else");
    commit_all(&found, &records).finish("done").unwrap();
    age(&found, 500);
    assert_eq!(latest_folder(results.path()).unwrap(), Some(found));
    std::fs::write(failed.join(DATABASE), "damaged").unwrap();
    assert_eq!(latest_folder(results.path()).unwrap(), Some(failed), "what is damaged is not passed over in silence");
}

#[test]
fn a_killed_run_whose_log_was_written_last_is_the_latest_and_the_one_to_go_on_with() {
    let (results, elsewhere) = (folder(), folder());
    let [killed, finished] = ["7", "8"].map(|name| results.path().join(name));
    assert_eq!(latest_unfinished(results.path()).unwrap(), None);
    // The run that is killed was begun first, and its database is as old as that.
    let recorder = commit_all(&elsewhere.path().join("7"), &sample::records(&sample::plan(), 3));
    std::fs::create_dir(&killed).unwrap();
    for entry in std::fs::read_dir(elsewhere.path().join("7")).unwrap() {
        let entry = entry.unwrap();
        std::fs::copy(entry.path(), killed.join(entry.file_name())).unwrap();
    }
    drop(recorder);
    age(&killed, 500);
    commit_all(&finished, &sample::records(&sample::plan(), 2)).finish("done").unwrap();
    age(&finished, 100);
    assert_eq!(latest_folder(results.path()).unwrap(), Some(finished.clone()), "it was written last");
    assert_eq!(latest_unfinished(results.path()).unwrap(), Some(killed.clone()));

    let log = std::fs::File::options().write(true).open(killed.join("results.sqlite-wal")).unwrap();
    assert!(log.metadata().unwrap().len() > 0);
    log.set_modified(std::time::SystemTime::now()).unwrap();
    assert_eq!(latest_folder(results.path()).unwrap(), Some(killed.clone()), "its log was written last");
    assert_eq!(latest_unfinished(results.path()).unwrap(), Some(killed.clone()));

    let resumed = Recorder::resume(&killed, 1).unwrap();
    assert!(matches!(latest_unfinished(results.path()), Err(RecordError::Locked { .. })), "somebody is at it");
    resumed.finish("done").unwrap();
    assert_eq!(latest_unfinished(results.path()).unwrap(), None);
}

#[test]
fn runs_in_a_lab_are_not_the_campaigns_latest_run_though_written_later() {
    let results = folder();
    let [search, lab] = ["7-2", "7-2-hall"].map(|name| results.path().join(name));
    commit_all(&lab, &[]).interrupt().unwrap();
    assert_eq!(latest_folder(results.path()).unwrap(), Some(lab.clone()), "there is nothing else");
    commit_all(&search, &[]).finish("done").unwrap();
    age(&search, 500);
    assert_eq!(latest_folder(results.path()).unwrap(), Some(search));
    assert_eq!(latest_unfinished(results.path()).unwrap(), Some(lab), "it is what `resume` goes on with");
}

#[test]
fn reading_an_older_run_does_not_make_it_the_latest() {
    let results = folder();
    let [older, newer] = ["7", "8"].map(|name| results.path().join(name));
    // Interrupted in an orderly way: a database in write-ahead mode without a log beside it.
    commit_all(&older, &[]).interrupt().unwrap();
    age(&older, 500);
    commit_all(&newer, &[]).interrupt().unwrap();
    age(&newer, 100);
    let reading = Repository::open(&older).unwrap();
    assert!(reading.tests().unwrap().is_empty());
    assert_eq!(latest_folder(results.path()).unwrap(), Some(newer.clone()));
    drop(reading);
    assert_eq!(latest_folder(results.path()).unwrap(), Some(newer.clone()));
    assert_eq!(latest_unfinished(results.path()).unwrap(), Some(newer.clone()));
    // What was written last and cannot be read may be the one that is meant.
    std::fs::write(newer.join(DATABASE), "notes").unwrap();
    assert!(matches!(latest_unfinished(results.path()), Err(RecordError::Foreign { .. })));
}

#[cfg(unix)]
#[test]
fn a_run_whose_lock_was_removed_writes_no_more_and_can_be_gone_on_with() {
    let folder = folder();
    let records = sample::records(&sample::plan(), 3);
    let mut recorder = commit_all(folder.path(), &records[..2]);
    std::fs::remove_file(folder.path().join(LOCK)).unwrap();
    let other = Recorder::resume(folder.path(), 1).unwrap();
    let said = recorder.commit(&records[2]).unwrap_err().to_string();
    assert!(said.contains("the lock of these results was removed"), "{said}");
    drop(other);
    drop(recorder);
    let mut resumed = Recorder::resume(folder.path(), 1).unwrap();
    records[2..].iter().for_each(|record| resumed.commit(record).unwrap());
}

#[test]
fn the_latest_run_is_one_of_the_campaign_not_what_was_run_on_the_side() {
    let results = folder();
    assert_eq!(latest_folder(results.path()).unwrap(), None);
    let run = claim_folder(results.path(), "42").unwrap().folder;
    commit_all(&run, &[]).finish("done").unwrap();
    for aside in ["known", "repeat-T5"] {
        let folder = claim_folder(results.path(), aside).unwrap().folder;
        commit_all(&folder, &[]).finish("done").unwrap();
    }
    assert_eq!(latest_folder(results.path()).unwrap(), Some(run));
}
