//! Reading results

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use rusqlite::{Connection, Row, params};

use sesame_plan::{CampaignPlan, Task};
use sesame_search::indicators::GenerationIndicators;

use crate::columns::{finite, perhaps_finite, position};
use crate::files::{DATABASE, TRACES, recording};
use crate::{Event, EventKind, GenerationCoverage, RecordError, ResultSet, Session, Status, plan, recognise, schema};

/// The results of one campaign run, to be read.
#[derive(Debug)]
pub struct Repository {
    pub(super) connection: Connection,
    pub(super) path: PathBuf,
    /// The schema of the file, which may be an earlier one.
    pub(super) schema: i64,
    /// Whether the file has a table of robustness signals.
    pub(super) has_robustness: bool,
    pub(super) facts: CampaignFacts,
}

/// The recorded campaign: plan, seed, version of the runtime, why it ended, task.
type CampaignColumns = (String, String, String, Option<String>, Option<String>);

/// What is fixed for a campaign run.
#[derive(Debug, Clone, PartialEq)]
pub struct CampaignFacts {
    /// Everything the runner knew of the campaign.
    pub plan: CampaignPlan,
    /// What the run does with the plan.
    pub task: Task,
    /// The one seed that determined everything.
    pub seed: u64,
    /// Version of the runtime that ran it.
    pub runtime: String,
    /// Why the run ended; `None` while it is unfinished.
    pub stop: Option<String>,
}

/// How many prepared statements are cached: more than reading and writing a test need together.
const STATEMENTS: usize = 64;

impl Repository {
    /// Opens the results in a run's folder, or a results file itself, for reading only. A run may be writing them.
    pub fn open(path: &Path) -> Result<Repository, RecordError> {
        let path = if path.is_dir() { path.join(DATABASE) } else { path.to_owned() };
        let connection = schema::open(&path, false)?;
        Repository::from_connection(connection, path)
    }

    pub(super) fn from_connection(connection: Connection, path: PathBuf) -> Result<Repository, RecordError> {
        let schema = connection
            .pragma_query_value(None, "user_version", |row| row.get(0))
            .map_err(|e| RecordError::database("read the campaign", &path, e))?;
        // Before the first query: an object with the name of a table may be a view that never ends.
        recognise::tables(&connection, &path, schema)?;
        let sql = "SELECT plan, seed, runtime, stop, task FROM campaign";
        let row: rusqlite::Result<CampaignColumns> =
            connection.query_row(sql, [], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?, row.get(4)?)));
        let (plan, seed, runtime, stop, task) = row.map_err(|source| match source {
            rusqlite::Error::QueryReturnedNoRows => RecordError::damaged(&path, "there is no campaign in it"),
            _ => RecordError::database("read the campaign", &path, source),
        })?;
        let (plan, task) = plan::read(&plan, task.as_deref()).map_err(|reason| RecordError::damaged(&path, reason))?;
        recognise::views(&connection, &path, &plan)?;
        let seed = seed.parse().map_err(|_| RecordError::damaged(&path, format!("`{seed}` is not a seed")))?;
        connection.set_prepared_statement_cache_capacity(STATEMENTS);
        let has_robustness = schema::has_robustness(&connection)
            .map_err(|error| RecordError::database("read the results", &path, error))?;
        Ok(Repository {
            connection,
            path,
            schema,
            has_robustness,
            facts: CampaignFacts { plan, task, seed, runtime, stop },
        })
    }

    /// The database's file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The folder of the run, in which the database lies.
    pub fn folder(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new(""))
    }

    /// Makes the folder for traces, if it is missing. Returns the absolute path of the run's folder, for workers in
    /// other folders.
    pub fn make_trace_folder(&self) -> Result<PathBuf, RecordError> {
        let traces = self.folder().join(TRACES);
        let made = std::fs::create_dir_all(&traces).and_then(|()| std::path::absolute(self.folder()));
        made.map_err(|e| RecordError::io("make the folder for traces", &traces, e))
    }

    /// The recording of a test, or of the test whose result stands for it, if there is one: its trace, or what people
    /// put in its place.
    pub fn trace(&self, test: u32, duplicate_of: Option<u32>) -> Option<PathBuf> {
        recording(self.folder(), duplicate_of.unwrap_or(test))
    }

    /// What is fixed for the run.
    pub fn campaign(&self) -> &CampaignFacts {
        &self.facts
    }

    /// Everything the runner knew of the campaign.
    pub fn plan(&self) -> &CampaignPlan {
        &self.facts.plan
    }

    /// What the run does with the plan.
    pub fn task(&self) -> &Task {
        &self.facts.task
    }

    /// SHA-256 over the canonical content of a results repository, as 64 hexadecimal digits.
    ///
    /// Wall times and limits of wall time, hosts, processes, session notes, paths, and the order of writing are left
    /// out, and so is what a plan says to people only: only the plan's [meaning](CampaignPlan::meaning) is hashed.
    /// Everything is read from the file each time: no stored hash is used.
    ///
    /// Operations that were one operation in an imported file are hashed last, if there are any, and so are runs of a
    /// lab that were entered by hand: which run of its test each is, but not who made it.
    ///
    /// Results of an earlier schema have the digest that their release computed.
    pub fn digest(&self) -> Result<String, RecordError> {
        super::digest::of_connection(&self.connection, self.plan())
            .map_err(|e| RecordError::database("read the results", &self.path, e))
    }

    /// SHA-256 over which tests there are, as 64 hexadecimal digits: over the names of the space and the campaign, the
    /// seed, and each test with its number.
    ///
    /// Unlike the [digest](Self::digest) it stays as it is when tests are run again.
    pub fn tests_digest(&self) -> Result<String, RecordError> {
        let rows = self.tests()?;
        let tests = rows.iter().map(|row| (row.number, &row.test));
        Ok(super::digest::of_tests(self.plan(), self.campaign().seed, tests))
    }

    /// How many tests there are, without reference runs.
    pub fn evaluated(&self) -> Result<usize, RecordError> {
        let count = self.read("SELECT count(*) FROM tests WHERE origin <> 'reference'", [], |row| position(row, 0))?;
        Ok(count.into_iter().sum())
    }

    /// The numbers of all tests, ascending.
    pub fn numbers(&self) -> Result<Vec<u32>, RecordError> {
        self.read("SELECT number FROM tests ORDER BY number", [], |row| row.get(0))
    }

    /// The number of the test that a user calls `T158`, `158`, by the name of a regression test or by its name before
    /// it was imported, or `reference` (the first reference run).
    pub fn find(&self, name: &str) -> Result<u32, RecordError> {
        let found = self.read(
            "SELECT min(number) FROM tests WHERE name = ?1 OR name = 'T' || ?1 OR known_test = ?1 \
             OR number = (SELECT min(test) FROM original_names WHERE name = ?1) \
             OR (origin = 'reference' AND ?1 = 'reference')",
            params![name],
            |row| row.get::<_, Option<u32>>(0),
        )?;
        found
            .into_iter()
            .flatten()
            .next()
            .ok_or_else(|| RecordError::NoSuchTest { name: name.to_owned(), path: self.path.clone() })
    }

    /// What tests were called in the file they were imported from, by number; empty for a campaign that was run.
    pub fn original_names(&self) -> Result<BTreeMap<u32, String>, RecordError> {
        let names = self.read("SELECT test, name FROM original_names", [], |row| Ok((row.get(0)?, row.get(1)?)))?;
        Ok(names.into_iter().collect())
    }

    /// The sets of results, by generation, the final one last.
    pub fn result_sets(&self) -> Result<Vec<ResultSet>, RecordError> {
        let mut sets = Vec::new();
        for (mut set, _) in self.result_set_sizes()? {
            set.members = self.members(&set.name)?;
            sets.push(set);
        }
        Ok(sets)
    }

    /// The sets of results in the same order, without their members but with how many there are: the fronts of
    /// thousands of generations may have millions.
    pub fn result_set_sizes(&self) -> Result<Vec<(ResultSet, usize)>, RecordError> {
        self.read(
            "SELECT name, generation, status, coalesce((SELECT max(position) + 1 FROM result_set_members WHERE result_set = name), 0) \
             FROM result_sets ORDER BY status = 'final', generation, name",
            [],
            |row| {
                let last = row.get::<_, String>(2)? == Status::Final.word();
                let status = if last { Status::Final } else { Status::Intermediate };
                let set = ResultSet { name: row.get(0)?, generation: row.get(1)?, status, members: Vec::new() };
                Ok((set, position(row, 3)?))
            },
        )
    }

    /// The numbers of the tests of a set of results, in its order; empty where there is no such set.
    pub fn members(&self, set: &str) -> Result<Vec<u32>, RecordError> {
        self.read("SELECT test FROM result_set_members WHERE result_set = ?1 ORDER BY position", params![set], |row| {
            row.get(0)
        })
    }

    /// Whether just this set of results is recorded.
    pub(super) fn has_result_set(&self, set: &ResultSet) -> Result<bool, RecordError> {
        let sql = "SELECT generation IS ?2 AND status = ?3 FROM result_sets WHERE name = ?1";
        let same: Vec<bool> = self.read(sql, params![set.name, set.generation, set.status.word()], |row| row.get(0))?;
        Ok(same == [true] && self.members(&set.name)? == set.members)
    }

    /// The final set of results, or the latest one while there is no final one.
    pub fn latest_result_set(&self) -> Result<Option<ResultSet>, RecordError> {
        let Some((mut set, _)) = self.result_set_sizes()?.pop() else { return Ok(None) };
        set.members = self.members(&set.name)?;
        Ok(Some(set))
    }

    /// How much was covered after each generation; empty for a campaign that does not count it.
    pub fn coverage(&self) -> Result<Vec<GenerationCoverage>, RecordError> {
        self.read(
            "SELECT generation, evaluations, covered, cells, feasible FROM coverage ORDER BY generation",
            [],
            |row| {
                Ok(GenerationCoverage {
                    generation: row.get(0)?,
                    evaluations: row.get(1)?,
                    covered: position(row, 2)?,
                    cells: position(row, 3)?,
                    feasible: position(row, 4)?,
                })
            },
        )
    }

    /// The indicators after each generation; none of an imported campaign, whose tests are of no generation.
    pub fn indicators(&self) -> Result<Vec<GenerationIndicators>, RecordError> {
        self.read(
            "SELECT generation, evaluations, unique_tests, no_effect, crashes, timeouts, front, hypervolume, standard_error \
             FROM indicators ORDER BY generation",
            [],
            |row| {
                Ok(GenerationIndicators {
                    generation: row.get(0)?,
                    evaluations: row.get(1)?,
                    unique: row.get(2)?,
                    no_effect: row.get(3)?,
                    crashes: row.get(4)?,
                    timeouts: row.get(5)?,
                    front: row.get(6)?,
                    hypervolume: perhaps_finite(row, 7)?,
                    standard_error: perhaps_finite(row, 8)?,
                })
            },
        )
    }

    /// The point that the hypervolumes of [`Repository::indicators`] are measured from, a value per objective in its
    /// unit; `None` where there is none.
    pub fn reference_point(&self) -> Result<Option<Vec<f64>>, RecordError> {
        let point = self.read("SELECT value FROM reference_point ORDER BY objective", [], |row| finite(row, 0))?;
        let needed = self.plan().campaign.objectives.len();
        if !point.is_empty() && point.len() != needed {
            let problem = format!("its reference point has {} values for {needed} objectives", point.len());
            return Err(RecordError::damaged(&self.path, problem));
        }
        Ok(Some(point).filter(|point| !point.is_empty()))
    }

    /// Everything that happened that a user should know, warnings of tests included: first those of the campaign, then
    /// by test.
    pub fn events(&self) -> Result<Vec<Event>, RecordError> {
        self.read("SELECT kind, test, text FROM events ORDER BY test, position, id", [], |row| {
            let warning = row.get::<_, String>(0)? == EventKind::Warning.word();
            let kind = if warning { EventKind::Warning } else { EventKind::Session };
            Ok(Event { kind, test: row.get(1)?, text: row.get(2)? })
        })
    }

    /// When and where the campaign was worked on.
    pub fn sessions(&self) -> Result<Vec<Session>, RecordError> {
        self.read("SELECT started_at, ended_at, host, pid, workers FROM sessions ORDER BY id", [], |row| {
            Ok(Session {
                started_at: row.get(0)?,
                ended_at: row.get(1)?,
                host: row.get(2)?,
                pid: row.get(3)?,
                workers: row.get(4)?,
            })
        })
    }

    /// The days on which the campaign was worked on, in UTC, and the hosts, once each: `2026-03-01 on bench-2`.
    pub fn days(&self) -> Result<Vec<String>, RecordError> {
        let sql = "SELECT DISTINCT date(started_at, 'unixepoch') || ' on ' || host FROM sessions ORDER BY id";
        let days = self.read(sql, [], |row| row.get::<_, Option<String>>(0))?;
        Ok(days.into_iter().flatten().collect())
    }

    pub(super) fn seed(&self, text: &str) -> Result<u64, RecordError> {
        text.parse().map_err(|_| RecordError::damaged(&self.path, format!("`{text}` is not a seed")))
    }

    pub(super) fn read<T>(
        &self,
        sql: &str,
        parameters: impl rusqlite::Params,
        row: impl FnMut(&Row<'_>) -> rusqlite::Result<T>,
    ) -> Result<Vec<T>, RecordError> {
        let rows = self
            .connection
            .prepare_cached(sql)
            .and_then(|mut statement| statement.query_map(parameters, row)?.collect::<rusqlite::Result<Vec<T>>>());
        rows.map_err(|e| RecordError::database("read the results", &self.path, e))
    }
}

/// The hash of the canonical content of the results in a run's folder, or of a results file, see
/// [`Repository::digest`].
pub fn digest(path: &Path) -> Result<String, RecordError> {
    Repository::open(path)?.digest()
}
