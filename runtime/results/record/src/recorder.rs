//! Writing results while a campaign runs.

use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use rusqlite::{Connection, ErrorCode, params};

use sesame_base::test_number::TestNumber;
use sesame_plan::{CampaignPlan, Task};
use sesame_search::indicators::GenerationIndicators;

use crate::columns::index;
use crate::files::{BEGUN, DATABASE};
use crate::folder::Lock;
use crate::monitors;
use crate::write_tests::{unrecordable, write_event, write_test};
use crate::{
    Claim, Event, EventKind, GenerationCoverage, LeftOutOperations, OriginalExtent, RecordError, Repository, ResultSet,
    SplitOperation, TestRecord, left_out_operations, original_extents, schema, split_operations,
};

/// Writes the results of one campaign run. There is one per folder: it holds the folder's lock.
///
/// Dropping it without [`Recorder::finish`] leaves the run unfinished, with all that was committed.
#[derive(Debug)]
pub struct Recorder {
    // Before the lock: the database is closed when the lock is let go.
    repository: Repository,
    session: i64,
    lock: Lock,
}

impl Recorder {
    /// Begins the results of a run in a folder, which is made if absent and must not hold results.
    pub fn create(folder: &Path, plan: &CampaignPlan, seed: u64, workers: u32) -> Result<Recorder, RecordError> {
        Recorder::create_for(folder, plan, &Task::Campaign, seed, workers)
    }

    /// As [`Recorder::create`], of a run that does this task.
    pub fn create_for(
        folder: &Path,
        plan: &CampaignPlan,
        task: &Task,
        seed: u64,
        workers: u32,
    ) -> Result<Recorder, RecordError> {
        std::fs::create_dir_all(folder).map_err(|e| RecordError::io("make the folder for results", folder, e))?;
        Recorder::create_locked(folder, Lock::acquire(folder)?, plan, task, seed, workers)
    }

    /// Begins the results of a run in a folder that was claimed for it.
    pub fn create_in(
        claim: Claim,
        plan: &CampaignPlan,
        task: &Task,
        seed: u64,
        workers: u32,
    ) -> Result<Recorder, RecordError> {
        Recorder::create_locked(&claim.folder, claim.lock, plan, task, seed, workers)
    }

    fn create_locked(
        folder: &Path,
        lock: Lock,
        plan: &CampaignPlan,
        task: &Task,
        seed: u64,
        workers: u32,
    ) -> Result<Recorder, RecordError> {
        let path = folder.join(DATABASE);
        if path.exists() {
            return Err(RecordError::Exists { path });
        }
        // Whole before it has its name: a run that is killed as it begins leaves no results, rather than some that are
        // none. What an earlier one left under the other name is not worth keeping.
        let begun = folder.join(BEGUN);
        for leftover in [begun.clone(), folder.join(format!("{BEGUN}-journal"))] {
            match std::fs::remove_file(&leftover) {
                Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                    return Err(RecordError::io("remove what a broken-off run left", &leftover, error));
                }
                _ => {}
            }
        }
        let failed = |error| RecordError::database("begin the results", &path, error);
        let mut connection = Connection::open(&begun).map_err(failed)?;
        schema::install(&mut connection, plan, task, seed).map_err(failed)?;
        connection.close().map_err(|(_, error)| failed(error))?;
        std::fs::rename(&begun, &path).map_err(|e| RecordError::io("begin the results", &path, e))?;
        let connection = Connection::open(&path).map_err(failed)?;
        tune(&connection).map_err(failed)?;
        let repository = Repository::from_connection(connection, path).map_err(|error| match error {
            // Reading back needs room for what SQLite keeps in addition to the file.
            RecordError::Database { source, path, doing: _ } => {
                RecordError::database("begin the results", &path, source)
            }
            other => other,
        })?;
        Recorder::begin_session(repository, lock, workers)
    }

    /// Continues the results of a run that was interrupted.
    pub fn resume(folder: &Path, workers: u32) -> Result<Recorder, RecordError> {
        Recorder::open(folder, workers, false)
    }

    /// Opens the results of a run that is finished, to add [repetitions](Recorder::put_repetition) to them.
    pub fn reopen(folder: &Path, workers: u32) -> Result<Recorder, RecordError> {
        Recorder::open(folder, workers, true)
    }

    fn open(folder: &Path, workers: u32, finished: bool) -> Result<Recorder, RecordError> {
        let path = folder.join(DATABASE);
        if !path.exists() {
            return Err(RecordError::Missing { path });
        }
        let lock = Lock::acquire(folder)?;
        let connection = schema::open(&path, true)?;
        schema::check_whole(&connection, &path)?;
        let repository = Repository::from_connection(connection, path)?;
        match repository.campaign().stop {
            Some(_) if !finished => return Err(RecordError::Finished { path: repository.path }),
            None if finished => return Err(RecordError::Unfinished { path: repository.path }),
            _ => {}
        }
        tune(&repository.connection).map_err(|e| RecordError::database("open the results", &repository.path, e))?;
        monitors::install(&repository.connection, repository.plan())
            .map_err(|e| RecordError::database("open the results", &repository.path, e))?;
        Recorder::begin_session(repository, lock, workers)
    }

    fn begin_session(repository: Repository, lock: Lock, workers: u32) -> Result<Recorder, RecordError> {
        repository
            .connection
            .execute(
                "INSERT INTO sessions (started_at, host, pid, workers) VALUES (?1, ?2, ?3, ?4)",
                params![wall_clock(), host(), std::process::id(), workers],
            )
            .map_err(|e| RecordError::database("begin a session", &repository.path, e))?;
        let session = repository.connection.last_insert_rowid();
        Ok(Recorder { repository, session, lock })
    }

    /// What was recorded so far.
    pub fn repository(&self) -> &Repository {
        &self.repository
    }

    pub(super) fn check_lock(&self) -> Result<(), RecordError> {
        self.lock.check()
    }

    pub(super) fn connection(&mut self) -> &mut Connection {
        &mut self.repository.connection
    }

    /// Records a test that has ended: all of it in one transaction, or nothing.
    pub fn commit(&mut self, record: &TestRecord) -> Result<(), RecordError> {
        self.lock.check()?;
        self.recordable(record)?;
        let plan = &self.repository.facts.plan;
        let written = self.repository.connection.transaction().and_then(|transaction| {
            write_test(&transaction, plan, record)?;
            transaction.commit()
        });
        written.map_err(|source| self.not_recorded(record, source))
    }

    /// Records tests that are all known already, in one transaction: all of them, or none. Each is taken, written, and
    /// dropped before the next one, so many tests need no more memory than one.
    pub fn commit_all(&mut self, records: impl IntoIterator<Item = TestRecord>) -> Result<(), RecordError> {
        self.lock.check()?;
        let failed = |source| RecordError::database("record the tests", &self.repository.path, source);
        let transaction = self.repository.connection.unchecked_transaction().map_err(failed)?;
        for record in records {
            self.recordable(&record)?;
            write_test(&transaction, &self.repository.facts.plan, &record)
                .map_err(|source| self.not_recorded(&record, source))?;
        }
        transaction.commit().map_err(failed)
    }

    /// Records which operations of tests were one operation in the file that they were imported from.
    pub fn put_split_operations(&mut self, split: &[SplitOperation]) -> Result<(), RecordError> {
        split_operations::write(&mut self.repository.connection, split)
            .map_err(|e| RecordError::database("record the operations of tests", &self.repository.path, e))
    }

    /// Records the tests of which operations could not be imported.
    pub fn put_left_out_operations(&mut self, left_out: &[LeftOutOperations]) -> Result<(), RecordError> {
        left_out_operations::write(&mut self.repository.connection, left_out)
            .map_err(|e| RecordError::database("record the operations of tests", &self.repository.path, e))
    }

    /// Records windows and ranges of operations that are others in the file they were imported from.
    pub fn put_original_extents(&mut self, extents: &[OriginalExtent]) -> Result<(), RecordError> {
        let Repository { connection, facts, .. } = &mut self.repository;
        let named: Vec<(&str, OriginalExtent)> =
            extents.iter().map(|&extent| (facts.plan.operation(extent.operation).name.as_str(), extent)).collect();
        original_extents::write(connection, &named)
            .map_err(|e| RecordError::database("record the windows of operations", &self.repository.path, e))
    }

    /// The recorded task is another from now on.
    pub(super) fn now_has(&mut self, task: Task) {
        self.repository.facts.task = task;
    }

    /// What would be refused when it is read is never written.
    pub(super) fn recordable(&self, record: &TestRecord) -> Result<(), RecordError> {
        let unfit = || self.repository.facts.plan.validate_test(&record.test).err().map(|error| error.to_string());
        match unrecordable(record).or_else(unfit) {
            Some(what) => {
                let path = self.repository.path.clone();
                Err(RecordError::Unrecordable { test: TestNumber(record.number), what, path })
            }
            None => Ok(()),
        }
    }

    fn not_recorded(&self, record: &TestRecord, source: rusqlite::Error) -> RecordError {
        let path = self.repository.path.clone();
        match source.sqlite_error() {
            Some(error) if error.extended_code == rusqlite::ffi::SQLITE_CONSTRAINT_PRIMARYKEY => {
                match self.repository.row(record.number) {
                    Err(RecordError::NoSuchTest { .. }) => self.repository.without_test(record.number),
                    _ => RecordError::TestExists { number: TestNumber(record.number), path },
                }
            }
            _ => RecordError::database("record a test", &path, source),
        }
    }

    /// Records what tests were called in the file they were imported from, each a test that was committed.
    pub fn put_original_names<'n>(
        &mut self,
        names: impl IntoIterator<Item = (u32, &'n str)>,
    ) -> Result<(), RecordError> {
        let written = self.repository.connection.transaction().and_then(|transaction| {
            for (test, name) in names {
                transaction
                    .prepare_cached("INSERT OR REPLACE INTO original_names (test, name) VALUES (?1, ?2)")?
                    .execute(params![test, name])?;
            }
            transaction.commit()
        });
        written.map_err(|e| RecordError::database("record the names of tests", &self.repository.path, e))
    }

    /// Records a set of results; one of the same name is replaced, unless it is this one.
    pub fn put_result_set(&mut self, set: &ResultSet) -> Result<(), RecordError> {
        if self.repository.has_result_set(set)? {
            return Ok(());
        }
        let written = self.repository.connection.transaction().and_then(|transaction| {
            transaction.execute("DELETE FROM result_set_members WHERE result_set = ?1", [&set.name])?;
            transaction.execute(
                "INSERT OR REPLACE INTO result_sets (name, generation, status) VALUES (?1, ?2, ?3)",
                params![set.name, set.generation, set.status.word()],
            )?;
            for (position, test) in set.members.iter().enumerate() {
                transaction
                    .prepare_cached("INSERT INTO result_set_members (result_set, position, test) VALUES (?1, ?2, ?3)")?
                    .execute(params![set.name, index(position), test])?;
            }
            transaction.commit()
        });
        written.map_err(|e| RecordError::database("record a set of results", &self.repository.path, e))
    }

    /// Records how much is covered after a generation; what was recorded for it before is replaced.
    pub fn put_coverage(&mut self, coverage: &GenerationCoverage) -> Result<(), RecordError> {
        let GenerationCoverage { generation, evaluations, covered, cells, feasible } = *coverage;
        self.repository
            .connection
            .execute(
                "INSERT OR REPLACE INTO coverage (generation, evaluations, covered, cells, feasible) \
                 VALUES (?1, ?2, ?3, ?4, ?5)",
                params![generation, evaluations, index(covered), index(cells), index(feasible)],
            )
            .map(drop)
            .map_err(|e| RecordError::database("record the coverage", &self.repository.path, e))
    }

    /// Records the indicators after a generation, and the point that hypervolumes are measured from, oriented as a
    /// fitness is, once there is one; what was recorded for the generation before is replaced.
    pub fn put_indicators(
        &mut self,
        indicators: &GenerationIndicators,
        reference: Option<&[f64]>,
    ) -> Result<(), RecordError> {
        let plan = &self.repository.facts.plan;
        let GenerationIndicators {
            generation,
            evaluations,
            unique,
            no_effect,
            crashes,
            timeouts,
            front,
            hypervolume,
            standard_error,
        } = *indicators;
        let written = self.repository.connection.transaction().and_then(|transaction| {
            transaction
                .prepare_cached(
                    "INSERT OR REPLACE INTO indicators (generation, evaluations, unique_tests, no_effect, crashes, timeouts, \
                     front, hypervolume, estimated, standard_error) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10)",
                )?
                .execute(params![
                    generation,
                    evaluations,
                    unique,
                    no_effect,
                    crashes,
                    timeouts,
                    front,
                    hypervolume,
                    standard_error.is_some(),
                    standard_error
                ])?;
            let objectives = plan.objectives().zip(reference.unwrap_or_default()).enumerate();
            for (position, (objective, &value)) in objectives {
                transaction
                    .prepare_cached(
                        "INSERT OR REPLACE INTO reference_point (objective, metric, value) VALUES (?1, ?2, ?3)",
                    )?
                    .execute(params![index(position), objective.metric.0, objective.in_unit(value)])?;
            }
            transaction.commit()
        });
        written.map_err(|e| RecordError::database("record the indicators", &self.repository.path, e))
    }

    /// Records an event. An equal warning is recorded once, so that a resumed run may repeat it.
    pub fn put_event(&mut self, event: &Event) -> Result<(), RecordError> {
        let written = self.repository.connection.transaction().and_then(|transaction| {
            let known: bool = transaction
                .prepare_cached(
                    "SELECT EXISTS (SELECT 1 FROM events WHERE kind = 'warning' AND test IS ?1 AND text = ?2)",
                )?
                .query_row(params![event.test, event.text], |row| row.get(0))?;
            if event.kind == EventKind::Session || !known {
                write_event(&transaction, event)?;
            }
            transaction.commit()
        });
        written.map_err(|e| RecordError::database("record an event", &self.repository.path, e))
    }

    /// Ends this session but not the run: `resume` can continue it. Dropping does the same without the time of day.
    pub fn interrupt(self) -> Result<(), RecordError> {
        self.end_session()
    }

    /// Ends the run, with why it ended in a few words, and leaves one plain file that needs nothing beside it.
    pub fn finish(mut self, stop: &str) -> Result<Repository, RecordError> {
        let failed = |source, path: &Path| RecordError::database("finish the results", path, source);
        self.repository
            .connection
            .execute("UPDATE campaign SET stop = ?1", [stop])
            .map_err(|e| failed(e, &self.repository.path))?;
        self.repository.facts.stop = Some(stop.to_owned());
        self.end_session()?;
        self.repository.connection.flush_prepared_statement_cache();
        // Leaving the write-ahead log needs the file for ourselves. With a reader at work the log stays, which loses
        // nothing: the last process that closes the file folds it in.
        let left: rusqlite::Result<String> =
            self.repository.connection.query_row("PRAGMA journal_mode = DELETE", [], |row| row.get(0));
        match left {
            Err(error)
                if !matches!(error.sqlite_error_code(), Some(ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked)) =>
            {
                Err(failed(error, &self.repository.path))
            }
            _ => Ok(self.repository),
        }
    }

    fn end_session(&self) -> Result<(), RecordError> {
        self.repository
            .connection
            .execute("UPDATE sessions SET ended_at = ?1 WHERE id = ?2", params![wall_clock(), self.session])
            .map(drop)
            .map_err(|e| RecordError::database("end a session", &self.repository.path, e))
    }
}

/// Commits append to a log that the system writes out when it likes: a killed process loses nothing that was
/// committed, a power cut may lose the last tests but damages nothing.
fn tune(connection: &Connection) -> rusqlite::Result<()> {
    connection.query_row("PRAGMA journal_mode = WAL", [], |_| Ok(()))?;
    connection.pragma_update(None, "synchronous", "NORMAL")?;
    // References are for readers: a test's rows are written together, so that checking two for each change point of a
    // series would cost time and find nothing.
    connection.pragma_update(None, "foreign_keys", false)?;
    Ok(())
}

#[expect(clippy::disallowed_methods, reason = "when a run began is recorded, and decides nothing")]
fn wall_clock() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |elapsed| elapsed.as_secs_f64())
}

fn host() -> Option<String> {
    let name =
        std::fs::read_to_string("/proc/sys/kernel/hostname").ok().or_else(|| std::env::var("COMPUTERNAME").ok())?;
    Some(name.trim().to_owned()).filter(|name| !name.is_empty())
}
