//! The repository as its users see it: what is written is read, what is committed stays, what is foreign is refused.

use std::path::Path;

use proptest::prelude::*;
use rusqlite::Connection;
use tempfile::TempDir;

use sesame_base::observation::{MetricObservation, OperationEffect, Reach, WallTime};
use sesame_optimise::nsga2::Variation as _;
use sesame_plan::condition::ConditionEnd;
use sesame_plan::{Activation, Bound, Choice, KnownTestId, MetricId, OperationId, Test, TestOperation};
use sesame_search::space::TestSpace;
use sesame_search::{Rates, TestVariation};

use super::*;

mod earlier;

fn folder() -> TempDir {
    tempfile::tempdir().unwrap()
}

fn commit_all(folder: &Path, records: &[TestRecord]) -> Recorder {
    let plan = sample::plan();
    let mut recorder = Recorder::create(folder, &plan, 42, 2).unwrap();
    for record in records {
        recorder.commit(record).unwrap();
    }
    recorder
}

/// The digest of a finished run with these tests.
fn digest_of(records: &[TestRecord]) -> String {
    let folder = folder();
    let repository = commit_all(folder.path(), records).finish("all evaluations done").unwrap();
    repository.digest().unwrap()
}

#[test]
fn everything_that_is_recorded_is_read_back() {
    let folder = folder();
    let plan = sample::plan();
    let records = sample::records(&plan, 60);
    let repository = sample::campaign(folder.path(), &plan, 60);
    for repository in [repository, Repository::open(folder.path()).unwrap()] {
        assert_eq!(repository.plan(), &plan);
        assert_eq!(repository.campaign().seed, 42);
        assert_eq!(repository.campaign().stop.as_deref(), Some("all evaluations done"));
        for record in &records {
            assert_eq!(&repository.test(record.number).unwrap(), record);
        }
        let rows = repository.tests().unwrap();
        assert_eq!(rows.len(), records.len());
        for (row, record) in rows.iter().zip(&records) {
            assert_eq!((row.number, row.origin, &row.test), (record.number, record.origin, &record.test));
            assert_eq!((&row.outcome, row.end), (&record.observation.outcome, record.observation.end));
            let values: Vec<_> = record.observation.metrics.iter().map(MetricValue::from).collect();
            assert_eq!(row.values, values);
        }
        let sets = repository.result_sets().unwrap();
        assert_eq!(sets.iter().map(|set| set.name.as_str()).collect::<Vec<_>>(), ["generation-0", "front"]);
        assert_eq!(repository.latest_result_set().unwrap().unwrap().members, sample::front(&plan, &records));
        let events = repository.events().unwrap();
        assert_eq!(events.iter().map(|event| event.test).collect::<Vec<_>>(), [None, Some(17)]);
        let sessions = repository.sessions().unwrap();
        assert_eq!((sessions.len(), sessions[0].workers, sessions[0].pid), (1, 2, std::process::id()));
        assert!(sessions[0].ended_at >= Some(sessions[0].started_at));
    }
}

#[test]
fn a_test_is_found_by_the_names_people_use() {
    let folder = folder();
    let repository = sample::campaign(folder.path(), &sample::plan(), 20);
    assert_eq!(repository.find("T7").unwrap(), 7);
    assert_eq!(repository.find("7").unwrap(), 7);
    assert_eq!(repository.find("known_jitter").unwrap(), 1);
    assert_eq!(repository.find("reference").unwrap(), 0);
    let error = repository.find("T700").unwrap_err();
    assert!(matches!(error, RecordError::NoSuchTest { ref name, .. } if name == "T700"), "{error}");
}

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

/// What a kill in the middle of a transaction without write-ahead log leaves behind, as the end of a run has it: half of
/// the file overwritten, and a journal with what was there before. Gives the database.
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
fn a_test_that_cannot_be_recorded_leaves_nothing_behind() {
    let folder = folder();
    let records = sample::records(&sample::plan(), 5);
    let mut recorder = commit_all(folder.path(), &records[..3]);
    let mut bad = records[3].clone();
    bad.observation.metrics[2].series[0].1 = f64::NAN;
    let error = recorder.commit(&bad).unwrap_err();
    assert!(error.to_string().starts_with("test T3 cannot be recorded (a value in a series is NaN)"), "{error}");
    // What would be refused when it is read.
    let mut unfit = records[3].clone();
    unfit.test.operations[0].activation = sesame_plan::Activation::Time { start: -1.0, end: 2.0 };
    let error = recorder.commit(&unfit).unwrap_err().to_string();
    assert!(error.contains("operations[0].activation") && error.contains("before the start"), "{error}");
    let error = recorder.commit(&records[2]).unwrap_err();
    assert!(matches!(error, RecordError::TestExists { number: 2, .. }), "{error}");
    assert_eq!(recorder.repository().tests().unwrap().len(), 3);
    recorder.commit(&records[3]).unwrap();
    assert_eq!(recorder.repository().test(3).unwrap(), records[3]);
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
fn what_is_no_repository_of_this_release_is_refused_with_what_to_do() {
    let folder = folder();
    let path = folder.path().join(DATABASE);
    let refused = |expected: &str| {
        let error = Repository::open(&path).unwrap_err();
        let text = error.to_string();
        assert!(text.contains(expected), "{text}");
        assert!(text.ends_with(&path.display().to_string()), "the path comes last: {text}");
        assert!(Recorder::resume(folder.path(), 1).is_err(), "nor is it written to");
        error
    };
    assert!(matches!(refused("no results here"), RecordError::Missing { .. }));
    std::fs::write(&path, "").unwrap();
    assert!(matches!(refused("the file is empty"), RecordError::Damaged { .. }));
    std::fs::write(&path, "time,value\n1,2\n".repeat(100)).unwrap();
    assert!(matches!(refused("not an SQLite file"), RecordError::Foreign { .. }));
    std::fs::remove_file(&path).unwrap();
    Connection::open(&path).unwrap().execute_batch("CREATE TABLE notes (text TEXT)").unwrap();
    assert!(matches!(refused("of another program"), RecordError::Foreign { .. }));
    std::fs::remove_file(&path).unwrap();

    drop(sample::campaign(folder.path(), &sample::plan(), 30));
    let whole = std::fs::read(&path).unwrap();
    let open = Connection::open(&path).unwrap();
    open.pragma_update(None, "user_version", SCHEMA + 1).unwrap();
    drop(open);
    let later = refused(&format!("schema {}, this release reads {SCHEMA}", SCHEMA + 1));
    assert!(matches!(later, RecordError::Newer { known: SCHEMA, .. }));
    Connection::open(&path).unwrap().pragma_update(None, "user_version", 1).unwrap();
    let told = format!("schema 1, this release reads {SCHEMA}; read them with the release that wrote them");
    assert!(matches!(refused(&told), RecordError::Older { found: 1, known: SCHEMA, .. }));
    for length in [whole.len() / 2, 4096, 700] {
        std::fs::write(&path, &whole[..length]).unwrap();
        assert!(matches!(refused("restore the file"), RecordError::Damaged { .. }), "cut to {length} bytes");
    }
    std::fs::write(&path, &whole).unwrap();
    assert_eq!(Repository::open(&path).unwrap().tests().unwrap().len(), 32, "the file itself may be named");
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
    commit_all(&finished, &[]).finish("done").unwrap();
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
fn reading_an_older_run_does_not_make_it_the_latest() {
    let results = folder();
    let [older, newer] = ["7", "8"].map(|name| results.path().join(name));
    // Interrupted in good order: a database that wants a log, and none beside it.
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
fn a_test_of_which_only_parts_are_left_is_damage_for_those_who_read_and_those_who_go_on() {
    let folder = folder();
    let records = sample::records(&sample::plan(), 3);
    drop(commit_all(folder.path(), &records[..4]));
    let connection = Connection::open(folder.path().join(DATABASE)).unwrap();
    connection.pragma_update(None, "foreign_keys", false).unwrap();
    for number in [0u32, 3] {
        connection.execute("DELETE FROM tests WHERE number = ?1", [number]).unwrap();
        let gone = format!("T{number} is gone, and some of what was recorded of it is still there");
        let repository = Repository::open(folder.path()).unwrap();
        for said in [repository.tests().map(drop), repository.scan(&mut drop)] {
            let said = said.unwrap_err().to_string();
            assert!(said.contains(&gone), "{said}");
        }
        let mut resumed = Recorder::resume(folder.path(), 1).unwrap();
        let said = resumed.commit(&records[number as usize]).unwrap_err().to_string();
        assert!(said.contains(&gone), "{said}");
        drop(resumed);
        let tables = ["metric_values", "operations", "choices", "intervals", "series_pieces", "wall_times"];
        for table in tables {
            connection.execute(&format!("DELETE FROM {table} WHERE test = ?1"), [number]).unwrap();
        }
    }
}

#[test]
fn positions_with_gaps_and_numbers_that_are_never_recorded_are_damage() {
    let changes = [
        ("DELETE FROM metric_values WHERE test = 1 AND metric = 1", "of the values of T1, number 1 is missing"),
        ("DELETE FROM metric_values WHERE test = 1 AND metric = 4", "there are 4 values of 5 metrics"),
        ("UPDATE operations SET position = 3 WHERE test = 1", "of the operations of T1, number 0 is missing"),
        ("DELETE FROM choices WHERE test = 1", "parameters: there are 0 instead of 1"),
        ("UPDATE choices SET position = 1 WHERE test = 1", "of the choices of T1, number 0 is missing"),
        (
            "UPDATE choices SET low = NULL, high = NULL, text = 'x' WHERE test = 1",
            "is of another kind than its parameter",
        ),
        ("UPDATE choices SET high = -9 WHERE test = 1", "runs from 0.27 to -9"),
        ("UPDATE operations SET start_s = 9e999 WHERE test = 1", "inf is recorded where only finite numbers are"),
        ("UPDATE tests SET end_s = -9e999 WHERE number = 1", "-inf is recorded where only finite numbers are"),
        ("UPDATE tests SET outcome = 'timeout', time_limit_s = -1 WHERE number = 1", "cannot have ended as `timeout`"),
        ("UPDATE metric_values SET reach_high = 9e999", "inf is recorded where only finite numbers are"),
    ];
    for (change, words) in changes {
        let folder = folder();
        drop(commit_all(folder.path(), &sample::records(&sample::plan(), 3)));
        Connection::open(folder.path().join(DATABASE)).unwrap().execute_batch(change).unwrap();
        let said = Repository::open(folder.path()).unwrap().tests().unwrap_err().to_string();
        assert!(said.contains(words), "{change}: {said}");
    }
    for seconds in ["-1", "1e300"] {
        let folder = folder();
        drop(commit_all(folder.path(), &sample::records(&sample::plan(), 3)));
        let connection = Connection::open(folder.path().join(DATABASE)).unwrap();
        connection.execute_batch(&format!("UPDATE wall_times SET run_s = {seconds}")).unwrap();
        let said = Repository::open(folder.path()).unwrap().test(1).unwrap_err().to_string();
        assert!(said.contains("the run of T1 took"), "{said}");
    }
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

#[test]
fn the_views_answer_in_the_names_of_the_space() {
    let folder = folder();
    let plan = sample::plan();
    let repository = sample::campaign(folder.path(), &plan, 60);
    let open = Connection::open(folder.path().join(DATABASE)).unwrap();
    let (number, collisions): (u32, f64) = open
        .query_row(
            "SELECT number, collision_occurrence FROM front ORDER BY collision_occurrence DESC LIMIT 1",
            [],
            |row| Ok((row.get(0)?, row.get(1)?)),
        )
        .unwrap();
    assert_eq!(repository.test(number).unwrap().observation.metrics[0].value, Some(collisions));
    let crashes: i64 =
        open.query_row("SELECT count(*) FROM findings WHERE finding = 'crash'", [], |row| row.get(0)).unwrap();
    assert_eq!(crashes, 2);
    let series = |test: u32| -> i64 {
        open.query_row("SELECT count(*) FROM series WHERE test = ?1", [test], |row| row.get(0)).unwrap()
    };
    assert!(series(40) > 0 && series(44) == series(40), "a duplicate shows the series of its original");
}

#[test]
fn the_verdicts_of_the_view_are_those_of_the_function() {
    let folder = folder();
    let plan = sample::plan();
    let repository = sample::campaign(folder.path(), &plan, 60);
    let mut expected = Vec::new();
    for row in repository.tests().unwrap() {
        for requirement in &plan.requirements {
            let word = verdict(requirement.bound, &row.outcome, row.value(requirement.metric)).word();
            expected.push((row.number, requirement.name.clone(), word.to_owned()));
        }
    }
    let open = Connection::open(folder.path().join(DATABASE)).unwrap();
    let mut statement = open.prepare("SELECT test, requirement, verdict FROM verdicts").unwrap();
    let rows = statement.query_map([], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?))).unwrap();
    let view: Vec<(u32, String, String)> = rows.collect::<Result<_, _>>().unwrap();
    assert_eq!(view, expected);
    for word in ["satisfied", "violated", "inconclusive"] {
        assert!(view.iter().any(|row| row.2 == word), "the sample has every verdict");
    }
}

#[test]
fn the_digest_does_not_depend_on_wall_times_sessions_and_the_order_of_writing() {
    let plan = sample::plan();
    let mut records = sample::records(&plan, 30);
    let digest = digest_of(&records);
    assert_eq!(digest.len(), 64);
    for record in &mut records {
        record.observation.wall = WallTime { run: record.observation.wall.run + 1.0 };
    }
    records.reverse();
    let folder = folder();
    let mut recorder = Recorder::create(folder.path(), &plan, 42, 8).unwrap();
    for record in &records {
        recorder.commit(record).unwrap();
    }
    recorder.put_event(&Event { kind: EventKind::Session, test: None, text: "resumed".to_owned() }).unwrap();
    let repository = recorder.finish("all evaluations done").unwrap();
    assert_eq!(repository.digest().unwrap(), digest);
    drop(repository);
    assert_eq!(super::digest(&folder.path().join(DATABASE)).unwrap(), digest);
}

#[test]
fn the_digest_tells_campaigns_sets_and_warnings_apart() {
    let plan = sample::plan();
    let records = sample::records(&plan, 3);
    let with = |change: &dyn Fn(&mut Recorder), seed, stop: &str| {
        let folder = folder();
        let mut recorder = Recorder::create(folder.path(), &plan, seed, 1).unwrap();
        for record in &records {
            recorder.commit(record).unwrap();
        }
        change(&mut recorder);
        recorder.finish(stop).unwrap().digest().unwrap()
    };
    let set = |members: &[u32], status| ResultSet {
        name: "front".to_owned(),
        generation: None,
        status,
        members: members.to_vec(),
    };
    let warning = |text: &str| Event { kind: EventKind::Warning, test: None, text: text.to_owned() };
    let digests = [
        with(&|_| {}, 42, "done"),
        with(&|_| {}, 43, "done"),
        with(&|_| {}, 42, "stopped"),
        with(&|r| r.put_result_set(&set(&[1, 2], Status::Final)).unwrap(), 42, "done"),
        with(&|r| r.put_result_set(&set(&[2, 1], Status::Final)).unwrap(), 42, "done"),
        with(&|r| r.put_result_set(&set(&[1, 2], Status::Intermediate)).unwrap(), 42, "done"),
        with(&|r| r.put_event(&warning("a")).unwrap(), 42, "done"),
        with(&|r| r.put_event(&warning("b")).unwrap(), 42, "done"),
    ];
    for (at, digest) in digests.iter().enumerate() {
        assert!(!digests[..at].contains(digest), "case {at} equals an earlier one");
    }
    let twice = with(
        &|r| {
            r.put_event(&warning("a")).unwrap();
            r.put_event(&warning("a")).unwrap();
        },
        42,
        "done",
    );
    assert_eq!(twice, digests[6], "a warning said again when a run is resumed is one warning");
    let replaced = with(
        &|r| {
            r.put_result_set(&set(&[1], Status::Intermediate)).unwrap();
            r.put_result_set(&set(&[1, 2], Status::Final)).unwrap();
        },
        42,
        "done",
    );
    assert_eq!(replaced, digests[3], "a set of the same name is replaced");
}

/// One kind of change to one test's record.
fn change(record: &mut TestRecord, kind: usize) {
    let next_up = |x: &mut f64| *x = x.next_up();
    let observation = &mut record.observation;
    match kind {
        0 => record.simulator_seed ^= 1 << 63,
        1 => record.parents.push(1),
        2 => record.generation = record.generation.map_or(Some(0), |_| None),
        3 => next_up(&mut observation.end),
        4 => observation.messages += 1,
        5 => observation.outcome = Outcome::Timeout { limit: 31.0 },
        6 => observation.outcome = Outcome::Crash { message: "other".to_owned() },
        7 => observation.warnings.push("a warning".to_owned()),
        8 => next_up(&mut observation.metrics[2].series[0].0),
        9 => next_up(&mut observation.metrics[2].series[0].1),
        10 => observation.metrics[0].set = !observation.metrics[0].set,
        11 => observation.metrics[4].value = None,
        22 => observation.metrics[4].reach.low = None,
        23 => next_up(observation.metrics[4].reach.high.as_mut().expect("it has a value")),
        24 => observation.metrics[4].not_finite = Some(1.5),
        12 => drop(observation.metrics[2].series.pop()),
        13 => record.test.operations[0].operation_seed ^= 1,
        14 => observation.operations[0].counters.seen += 1,
        15 => observation.operations[0].counters.side_effects += 1,
        16 => next_up(&mut observation.operations[0].intervals[0].end),
        17 => observation.operations[0].first_touch = Some(0.5),
        18 => {
            let Activation::Time { start, .. } = &mut record.test.operations[0].activation else {
                panic!("the regression test has a window")
            };
            *start = start.next_down();
        }
        19 => record.origin = Origin::Known(KnownTestId(0)),
        20 => match &mut record.test.operations[0].parameters[0] {
            Choice::Range { high, .. } => next_up(high),
            Choice::Value { value } => next_up(value),
            Choice::Point { point } => next_up(&mut point[1]),
            Choice::Text { text } => text.push('.'),
        },
        _ => observation.operations.clear(),
    }
}

/// The record of a test that conditions switch.
fn conditional_record(plan: &sesame_plan::CampaignPlan) -> TestRecord {
    sample::record(plan, 3, Origin::Search, sample::conditional_test())
}

#[test]
fn activations_of_every_kind_come_back_as_they_were() {
    let folder = folder();
    let plan = sample::plan();
    let record = conditional_record(&plan);
    let recorder = commit_all(folder.path(), std::slice::from_ref(&record));
    assert_eq!(recorder.repository().test(3).unwrap(), record);
    let read = |sql: &str| -> String { recorder.repository().connection.query_row(sql, [], |row| row.get(0)).unwrap() };
    assert_eq!(
        read("SELECT start_condition FROM operations WHERE position = 0"),
        "arm_distance < 450mm and (1.5m/s < top_speed or arm_distance < 450mm)"
    );
    let columns = "start_s || ',' || end_s || ',' || times IS NULL AND start_condition IS NULL";
    assert_eq!(read(&format!("SELECT CAST({columns} AS TEXT) FROM operations WHERE position = 1")), "1");
}

#[test]
fn any_kind_of_change_to_a_condition_changes_the_digest() {
    use sesame_plan::condition::{Comparison, Condition};
    let plan = sample::plan();
    let mut seen = std::collections::BTreeSet::from([digest_of(&[conditional_record(&plan)])]);
    let changes: [fn(&mut Activation, &mut Activation); 6] = [
        |until, _| {
            if let Activation::Condition { times, .. } = until {
                *times += 1;
            }
        },
        |until, _| {
            if let Activation::Condition { start, end, .. } = until {
                std::mem::swap(start, end);
            }
        },
        |until, _| {
            if let Activation::Condition { end: Condition::Compare { by, .. }, .. } = until {
                *by = Comparison::Equal;
            }
        },
        |until, lasting| *until = lasting.clone(),
        |_, lasting| {
            if let Activation::ConditionFor { length, .. } = lasting {
                *length = length.next_up();
            }
        },
        |_, lasting| {
            if let Activation::ConditionFor { times, .. } = lasting {
                *times += 1;
            }
        },
    ];
    for (kind, change) in changes.into_iter().enumerate() {
        let mut record = conditional_record(&plan);
        let [until, _, lasting] = &mut record.test.operations[..] else { panic!("three operations") };
        change(&mut until.activation, &mut lasting.activation);
        assert!(seen.insert(digest_of(&[record])), "change {kind} goes unnoticed");
    }
}

#[test]
fn a_number_in_a_condition_that_is_none_is_refused() {
    use sesame_plan::condition::{Condition, Operand};
    let folder = folder();
    let plan = sample::plan();
    let mut record = conditional_record(&plan);
    if let Activation::Condition { end: Condition::Compare { left, .. }, .. } =
        &mut record.test.operations[0].activation
    {
        *left = Operand::Number(f64::NAN);
    }
    let mut recorder = Recorder::create(folder.path(), &plan, 1, 1).unwrap();
    let refused = recorder.commit(&record).unwrap_err().to_string();
    assert!(refused.starts_with("test T3 cannot be recorded (a number in a condition is NaN)"), "{refused}");
}

#[test]
fn tests_by_condition_that_hold_an_offline_operation_vary_and_come_back_as_they_were() {
    for end in [ConditionEnd::Condition, ConditionEnd::Length { low: 1.0, high: 15.0 }] {
        let plan = sample::offline_plan(end);
        let mut variation = TestVariation::new(TestSpace::from_plan(&plan).unwrap(), Rates::by_condition(), 5);
        let mut tests = [variation.initial(0), variation.initial(1)];
        let folder = folder();
        let mut recorder = Recorder::create(folder.path(), &plan, 42, 2).unwrap();
        let mut records = Vec::new();
        for generation in 1..=30 {
            tests = variation.offspring([&tests[0], &tests[1]], generation, 0).map(|child| child.genome);
            for test in &tests {
                let number = u32::try_from(records.len()).unwrap() + 1;
                records.push(sample::record(&plan, number, Origin::Search, test.clone()));
                recorder.commit(&records[records.len() - 1]).unwrap();
            }
        }
        let repository = recorder.repository();
        for record in &records {
            assert_eq!(repository.test(record.number).unwrap(), *record);
        }
        let all = records.iter().flat_map(|record| &record.test.operations);
        let (offline, others): (Vec<_>, Vec<_>) = all.partition(|used| used.operation == OperationId(4));
        assert!(offline.iter().all(|used| used.activation == Activation::Offline));
        assert!(others.iter().all(|used| !matches!(used.activation, Activation::Offline | Activation::Time { .. })));
        let chosen = |text: &str| {
            let choice = Choice::Text { text: text.to_owned() };
            offline.iter().filter(|used| used.parameters == [choice.clone()]).count()
        };
        assert!(["cold", "warm", "hot"].into_iter().all(|text| chosen(text) > 0), "{offline:?}");
        assert!(!others.is_empty());
        let bare: u32 = repository
            .connection
            .query_row(
                "SELECT count(*) FROM operations WHERE operation = 'spoil' AND start_s IS NULL AND end_s IS NULL \
                 AND start_condition IS NULL AND end_condition IS NULL AND length_s IS NULL AND times IS NULL",
                [],
                |row| row.get(0),
            )
            .unwrap();
        assert_eq!(bare as usize, offline.len());
    }
}

#[test]
fn an_activation_that_does_not_fit_its_operation_is_damage() {
    let folder = folder();
    let plan = sample::offline_plan(ConditionEnd::Condition);
    let offline = TestOperation {
        operation: OperationId(4),
        activation: Activation::Offline,
        parameters: vec![Choice::Text { text: "hot".to_owned() }],
        operation_seed: 1,
    };
    let mut test = sample::conditional_test();
    test.operations.push(offline);
    let mut recorder = Recorder::create(folder.path(), &plan, 42, 2).unwrap();
    recorder.commit(&sample::record(&plan, 3, Origin::Search, test)).unwrap();
    let refused = |change: &str| {
        let changing = Connection::open(folder.path().join(DATABASE)).unwrap();
        assert_eq!(changing.execute(change, []).unwrap(), 1, "{change}");
        recorder.repository().test(3).unwrap_err().to_string()
    };
    let nothing = refused("UPDATE operations SET start_s = NULL, end_s = NULL WHERE position = 1");
    assert!(nothing.contains("switched neither by time nor by condition"), "{nothing}");
    refused("UPDATE operations SET start_s = 1, end_s = 2 WHERE position = 3");
    let window = refused("UPDATE operations SET start_s = 1.5, end_s = 20 WHERE position = 1");
    assert!(window.contains("T3 has `spoil` during the run, which acts before or after it"), "{window}");
}

fn finite() -> impl Strategy<Value = f64> {
    prop_oneof![
        any::<f64>().prop_filter("finite", |x| x.is_finite()),
        Just(0.0),
        Just(f64::MIN_POSITIVE),
        (-10i32..10).prop_map(f64::from)
    ]
}

#[test]
fn any_kind_of_change_to_a_test_changes_the_digest() {
    let plan = sample::plan();
    let record = sample::record(&plan, 3, Origin::Search, plan.tests[0].test.clone());
    let before = digest_of(std::slice::from_ref(&record));
    assert_eq!(digest_of(std::slice::from_ref(&record)), before);
    let mut seen = std::collections::BTreeSet::from([before]);
    for kind in 0..25 {
        let mut changed = record.clone();
        change(&mut changed, kind);
        assert!(seen.insert(digest_of(&[changed])), "change {kind} goes unnoticed");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn any_finite_numbers_come_back_bit_for_bit(
        value in prop::option::of(finite()),
        low in prop::option::of(finite()),
        high in prop::option::of(finite()),
        not_finite in prop::option::of(finite()),
        series in prop::collection::vec((finite(), finite()), 0..20),
        end in finite(),
    ) {
        let folder = folder();
        let plan = sample::plan();
        let mut record = sample::record(&plan, 3, Origin::Search, Test::default());
        record.observation.end = end;
        record.observation.metrics[0] = MetricObservation { value, set: true, reach: Reach { low, high }, not_finite, series };
        let recorder = commit_all(folder.path(), std::slice::from_ref(&record));
        let read = recorder.repository().test(3).unwrap();
        prop_assert_eq!(&read, &record);
        let bits = |record: &TestRecord| -> Vec<u64> {
            let points = record.observation.metrics[0].series.iter().flat_map(|point| [point.0, point.1]);
            points.chain([record.observation.end]).map(|x| (x + 0.0).to_bits()).collect()
        };
        prop_assert_eq!(bits(&read), bits(&record));
    }

    #[test]
    fn bounds_of_every_kind_mean_the_same_in_the_view(
        kind in 0usize..6, a in -3i32..4, width in 0i32..3, x in prop::option::of(-3i32..4), set in any::<bool>(), outcome in 0usize..4,
        low in prop::option::of(-3i32..4), more in prop::option::of(0i32..4), whole in any::<bool>(), finite in any::<bool>(),
    ) {
        let value = f64::from(a);
        let bound = [
            Bound::AtMost { value }, Bound::Below { value }, Bound::AtLeast { value }, Bound::Above { value },
            Bound::Equal { value }, Bound::Within { low: value, high: f64::from(a + width) },
        ][kind];
        let mut plan = sample::plan();
        plan.requirements.truncate(1);
        plan.requirements[0].bound = bound;
        let mut record = sample::record(&plan, 3, Origin::Search, Test::default());
        record.observation.outcome = [
            Outcome::Completed, Outcome::NoEffect, Outcome::Timeout { limit: 1.0 }, Outcome::Crash { message: String::new() },
        ][outcome].clone();
        // Of a whole run and of one that broke off; also with values that do not fit their reach, which no run shows.
        let shown = MetricValue {
            reach: Reach { low: low.map(f64::from), high: more.map(|more| f64::from(low.unwrap_or(0) + more)) },
            not_finite: (!finite).then_some(1.5),
            ..MetricValue::whole(x.map(f64::from), set)
        };
        let shown = if whole { MetricValue::whole(shown.value, set) } else { shown };
        let MetricValue { value: measured, reach, not_finite, .. } = shown;
        record.observation.metrics[0] = MetricObservation { value: measured, set, reach, not_finite, series: vec![] };
        let folder = folder();
        let mut recorder = Recorder::create(folder.path(), &plan, 1, 1).unwrap();
        recorder.commit(&record).unwrap();
        let said = verdict(bound, &record.observation.outcome, shown);
        let again = Repetition::of(3, 1, 7, &record.observation);
        recorder.put_repetition(&again, &[]).unwrap();
        let connection = &recorder.repository().connection;
        let view: String = connection.query_row("SELECT verdict FROM verdicts", [], |row| row.get(0)).unwrap();
        prop_assert_eq!(view, said.word());
        let found = |finding: &str| -> i64 {
            let sql = "SELECT count(*) FROM findings WHERE finding = ?1";
            connection.query_row(sql, [finding], |row| row.get(0)).unwrap()
        };
        prop_assert_eq!(found("violation"), i64::from(said == Verdict::Violated));
        prop_assert_eq!(found("not_finite"), i64::from(shown.not_finite.is_some()));
        let confirmed: i64 = connection
            .query_row("SELECT coalesce(sum(confirmed), 0) FROM confirmations", [], |row| row.get(0))
            .unwrap();
        prop_assert_eq!(confirmed, i64::from(said == Verdict::Violated));
        let row = &recorder.repository().tests().unwrap()[0];
        prop_assert_eq!(row.value(MetricId(0)), shown);
    }
}

#[test]
fn what_was_imported_keeps_its_intervals_and_names_without_counts() {
    let folder = tempfile::tempdir().unwrap();
    let plan = sample::plan();
    let mut recorder = Recorder::create(folder.path(), &plan, 1, 0).unwrap();
    let mut record = sample::record(&plan, 1, Origin::Search, plan.tests[0].test.clone());
    record.observation.outcome = Outcome::Unknown;
    for effect in &mut record.observation.operations {
        *effect = OperationEffect { intervals: effect.intervals.clone(), ..OperationEffect::default() };
    }
    recorder.commit(&record).unwrap();
    recorder.put_original_names([(1, "Test_001_20_06_2023")]).unwrap();
    let repository = recorder.finish("imported").unwrap();
    assert_eq!(repository.test(1).unwrap(), record);
    assert!(!record.observation.operations[0].intervals.is_empty());
    assert_eq!(repository.find("Test_001_20_06_2023").unwrap(), 1);
    assert_eq!(repository.original_names().unwrap(), [(1, "Test_001_20_06_2023".to_owned())].into());
    let seen: Option<i64> =
        repository.connection.query_row("SELECT seen FROM operations", [], |row| row.get(0)).unwrap();
    assert_eq!(seen, None, "nobody counted");
}

#[test]
fn every_byte_of_a_series_is_in_the_digest_and_a_piece_that_nothing_is_written_as_is_damage() {
    let folder = folder();
    let whole = sample::campaign(folder.path(), &sample::plan(), 30).digest().unwrap();
    let open = Connection::open(folder.path().join(DATABASE)).unwrap();
    let one = "WHERE test = 3 AND metric = 2 AND position = 0";
    let after = |change: &str| {
        open.execute_batch("BEGIN").unwrap();
        assert_eq!(open.execute(&format!("UPDATE series_pieces SET {change} {one}"), []).unwrap(), 1, "{change}");
        open.execute_batch("COMMIT").unwrap();
        let read = Repository::open(folder.path()).unwrap();
        (read.digest().unwrap(), read.test(3).map(|_| ()).map_err(|error| error.to_string()))
    };
    let numbers: Vec<u8> =
        open.query_row(&format!("SELECT numbers FROM series_pieces {one}"), [], |row| row.get(0)).unwrap();
    for at in 0..numbers.len() {
        let mut changed = numbers.clone();
        changed[at] ^= 1;
        let digits = changed.iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().concat();
        let (digest, read) = after(&format!("numbers = x'{digits}'"));
        assert_ne!(digest, whole, "byte {at}");
        assert_eq!(read, Ok(()));
    }
    for change in [
        "numbers = x'7ff0000000000000'",
        "numbers = x''",
        "times = x'01020304050607080910'",
        "points = 0",
        "points = -1",
        "start_ns = 9223372036854775807, tick_ns = 9223372036854775807",
        "tick_ns = NULL",
    ] {
        let (digest, read) = after(change);
        assert_ne!(digest, whole, "{change}");
        let said = read.expect_err(change);
        assert!(said.contains(DATABASE), "{change}: {said}");
    }
}

#[test]
fn a_set_of_results_that_is_recorded_already_is_not_written_again() {
    let folder = folder();
    let mut recorder = commit_all(folder.path(), &sample::records(&sample::plan(), 5));
    let set =
        ResultSet { name: "a".to_owned(), generation: Some(0), status: Status::Intermediate, members: vec![1, 2] };
    recorder.put_result_set(&set).unwrap();
    let writes = |recorder: &Recorder| recorder.repository().connection.total_changes();
    let before = writes(&recorder);
    recorder.put_result_set(&set).unwrap();
    assert_eq!(writes(&recorder), before);
    for other in [
        ResultSet { members: vec![2, 1], ..set.clone() },
        ResultSet { generation: None, ..set.clone() },
        ResultSet { status: Status::Final, ..set.clone() },
    ] {
        recorder.put_result_set(&other).unwrap();
        assert_eq!(recorder.repository().result_sets().unwrap(), [other]);
    }
}

#[test]
fn reading_one_test_takes_no_longer_among_many_than_among_few() {
    let time_among = |tests: u32| {
        let folder = folder();
        let plan = sample::plan();
        let repository = sample::campaign(folder.path(), &plan, tests);
        let once = |_| {
            let begun = std::time::Instant::now();
            assert_eq!(repository.records(11..=20, false).unwrap().len(), 10);
            assert_eq!(repository.test(12).unwrap().number, 12);
            begun.elapsed()
        };
        (0..20).map(once).min().unwrap()
    };
    let (few, many) = (time_among(30), time_among(1500));
    // Looking at all rows would take some twenty times as long.
    assert!(many < 5 * few, "{many:?} among many, {few:?} among few");
}
