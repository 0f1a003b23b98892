//! Runs that people made in a lab and entered by hand: which run of its test each is, and who made it with what.
//!
//! Each run is a test of the lab's results; [`LabTask::of`] says of which test of the campaign it is a run.

use std::collections::{BTreeMap, BTreeSet};

use rusqlite::params;

use sesame_base::observation::{MetricObservation, Observation, OperationEffect, Outcome, Reach};
use sesame_base::test_number::TestNumber;
use sesame_plan::{Activation, CampaignPlan, LabTask, Metric, Span, Task, Test, TestOperation};

use crate::lab_runs::{DDL, are_in};
use crate::write_tests::write_test;
use crate::{Origin, RecordError, Recorder, Repository, TestRecord};

/// The words for how a run can have ended, as people enter it.
pub const ENTERED_OUTCOMES: [&str; 8] =
    ["completed", "no_effect", "unknown", "crash", "timeout", "launch_failed", "disconnect", "wrong_clock"];

/// How a run ended, from one of [`ENTERED_OUTCOMES`]; `None` for any other word.
///
/// No cause is entered for a run that broke off. A lab runs in wall time, so the limit of a timeout is the length of a
/// test.
pub fn entered_outcome(word: &str, plan: &CampaignPlan) -> Option<Outcome> {
    let message = "entered by hand, without a cause".to_owned();
    Some(match word {
        "completed" => Outcome::Completed,
        "no_effect" => Outcome::NoEffect,
        "unknown" => Outcome::Unknown,
        "crash" => Outcome::Crash { message },
        "timeout" => Outcome::Timeout { limit: plan.campaign.end_after },
        "launch_failed" => Outcome::LaunchFailed { message },
        "disconnect" => Outcome::Disconnect { message },
        "wrong_clock" => Outcome::WrongClock { message },
        _ => return None,
    })
}

/// A run in a lab as people enter it.
#[derive(Debug, Clone, PartialEq)]
pub struct Entered {
    /// The number of the test of the campaign that was run.
    pub of: u32,
    /// Which run of that test in the lab, from 1.
    pub run: u32,
    /// How it ended.
    pub outcome: Outcome,
    /// Per metric of the plan, in its order and unit; `None` where it was not measured. Finite.
    pub values: Vec<Option<f64>>,
    /// Where the run comes from.
    pub provenance: Provenance,
}

/// A run in a lab that was entered by hand, as it is recorded.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EnteredRun {
    /// The number of the test that it is in the lab's results.
    pub test: u32,
    /// The number of the test of the campaign that was run.
    pub of: u32,
    /// Which run of that test in the lab, from 1.
    pub run: u32,
    /// Where the run comes from.
    pub provenance: Provenance,
}

/// Who made a run in a lab, with what and when: one line of text each, as far as people said it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Provenance {
    /// Who ran the test.
    pub operator: Option<String>,
    /// The robots and what is around them.
    pub hardware: Option<String>,
    /// What ran on them.
    pub software: Option<String>,
    /// When the test was run, in any notation.
    pub date: Option<String>,
}

impl Provenance {
    /// The names of what it says, in this order everywhere.
    pub const NAMES: [&str; 4] = ["operator", "hardware", "software", "date"];

    /// What was entered under each name.
    pub fn texts(&self) -> [Option<&str>; 4] {
        [&self.operator, &self.hardware, &self.software, &self.date].map(Option::as_deref)
    }
}

impl From<[Option<String>; 4]> for Provenance {
    fn from([operator, hardware, software, date]: [Option<String>; 4]) -> Self {
        Provenance { operator, hardware, software, date }
    }
}

/// A run as a test of the lab's results.
///
/// Nobody counted what operations did. If the outcome says so, the times at which they were to be active stand for
/// those at which they were, as in an imported test.
fn record(plan: &CampaignPlan, test: &Test, number: u32, entered: &Entered) -> TestRecord {
    let Entered { outcome, values, .. } = entered;
    let over = plan.campaign.end_after;
    let metric = |(metric, value): (&Metric, &Option<f64>)| {
        let mut shown = MetricObservation::whole(*value, value.is_some(), Vec::new());
        if !outcome.is_whole() {
            shown.reach = Reach::onwards(metric.trend, *value);
        }
        shown
    };
    let effect = |used: &TestOperation| {
        let planned = match used.activation {
            Activation::Time { start, end } => Some(Span { start: start.max(0.0), end: end.min(over) }),
            Activation::Condition { .. } | Activation::ConditionFor { .. } | Activation::Offline => None,
        };
        let intervals = planned.filter(|span| span.start <= span.end).into_iter().collect();
        OperationEffect { intervals, ..OperationEffect::default() }
    };
    let operations = match outcome {
        Outcome::Unknown => test.operations.iter().map(effect).collect(),
        _ => Vec::new(),
    };
    TestRecord {
        number,
        origin: Origin::Search,
        generation: None,
        parents: Vec::new(),
        test: test.clone(),
        simulator_seed: 0,
        duplicate_of: None,
        observation: Observation {
            end: over,
            operations,
            metrics: plan.metrics.iter().zip(values).map(metric).collect(),
            ..Observation::without_run(outcome.clone())
        },
    }
}

impl Recorder {
    /// Records runs that were entered by hand, together with the task of all runs that are then recorded: all of it in
    /// one transaction, or nothing. The task must have the tests of all of them.
    pub fn put_entered_runs(&mut self, task: LabTask, runs: &[Entered]) -> Result<(), RecordError> {
        self.check_lock()?;
        let path = self.repository().path().to_owned();
        let plan = self.repository().plan().clone();
        let first = self.repository().numbers()?.last().map_or(1, |last| last + 1);
        let tests: BTreeMap<u32, &Test> = task.tests.iter().map(|selected| (selected.number, &selected.test)).collect();
        let mut records = Vec::with_capacity(runs.len());
        for (number, entered) in (first..).zip(runs) {
            let test = tests.get(&entered.of).expect("a task has the tests of its runs");
            let record = record(&plan, test, number, entered);
            self.recordable(&record)?;
            records.push(record);
        }
        let task = Task::Lab(task);
        let json = serde_json::to_string(&task).expect("a task is plain data with text keys");
        let written = self.connection().transaction().and_then(|transaction| {
            if !are_in(&transaction)? {
                transaction.execute_batch(DDL)?;
            }
            for (record, Entered { run, provenance, .. }) in records.iter().zip(runs) {
                write_test(&transaction, &plan, record)?;
                let [operator, hardware, software, date] = provenance.texts();
                transaction
                    .prepare_cached(
                        "INSERT INTO lab_runs (test, run, operator, hardware, software, date) \
                         VALUES (?1, ?2, ?3, ?4, ?5, ?6)",
                    )?
                    .execute(params![record.number, run, operator, hardware, software, date])?;
            }
            transaction
                .execute("UPDATE campaign SET task = ?1, evaluations = ?2", params![json, task.evaluations(&plan)])?;
            transaction.commit()
        });
        written.map_err(|source| RecordError::database("record the runs of the lab", &path, source))?;
        self.now_has(task);
        Ok(())
    }
}

impl Repository {
    /// The runs in a lab that were entered by hand, by the number of the test that each is; empty where a runner made
    /// all tests.
    ///
    /// Each is a recorded test and a run of a test of the task, and no run of a test is there twice.
    pub fn entered_runs(&self) -> Result<Vec<EnteredRun>, RecordError> {
        if !are_in(&self.connection).map_err(|error| RecordError::database("read the results", &self.path, error))? {
            return Ok(Vec::new());
        }
        let damaged = |problem: String| RecordError::damaged(&self.path, problem);
        let sql = "SELECT test, run, operator, hardware, software, date FROM lab_runs ORDER BY test";
        let rows: Vec<(u32, u32, Provenance)> = self.read(sql, [], |row| {
            let texts = [row.get(2)?, row.get(3)?, row.get(4)?, row.get(5)?];
            Ok((row.get(0)?, row.get(1)?, Provenance::from(texts)))
        })?;
        let Some(task) = self.task().in_lab() else {
            return Err(damaged("there are runs of a lab in results of no lab".to_owned()));
        };
        let recorded: BTreeMap<u32, _> = self.tests()?.into_iter().map(|row| (row.number, row.test)).collect();
        let mut seen = BTreeSet::new();
        let mut runs = Vec::with_capacity(rows.len());
        for (test, run, provenance) in rows {
            let number = TestNumber(test);
            let Some(of) = recorded.get(&test).and_then(|recorded| task.of(recorded)) else {
                return Err(damaged(format!("{number} is a run of a lab, but of no test that was run there")));
            };
            if run == 0 || !seen.insert((of, run)) {
                let of = TestNumber(of);
                return Err(damaged(format!("run {run} of {of} in the lab is there twice, or has no number")));
            }
            runs.push(EnteredRun { test, of, run, provenance });
        }
        Ok(runs)
    }
}

#[cfg(test)]
mod tests {
    use rusqlite::Connection;
    use sesame_plan::LabTest;

    use super::*;
    use crate::{DATABASE, sample};

    fn entered(of: u32, run: u32, word: &str, collisions: Option<f64>) -> Entered {
        let outcome = entered_outcome(word, &sample::plan()).unwrap();
        let values = vec![collisions, Some(1.5), None, None, Some(-0.25)];
        Entered { of, run, outcome, values, provenance: Provenance::default() }
    }

    /// The task of so many tests, each of which was run so often.
    fn task(tests: u32, repeats: u32) -> LabTask {
        let numbered = |number: u32| {
            let mut test = sample::plan().tests[0].test.clone();
            test.operations[0].operation_seed = u64::from(number);
            LabTest { number, test }
        };
        LabTask { lab: "hall".to_owned(), results: "0".repeat(64), tests: (1..=tests).map(numbered).collect(), repeats }
    }

    /// Results of these runs, entered one after the other.
    fn lab(folder: &std::path::Path, entries: &[(LabTask, &[Entered])]) -> Repository {
        let plan = sample::plan();
        for (at, (task, runs)) in entries.iter().enumerate() {
            let mut recorder = if at == 0 {
                Recorder::create_for(folder, &plan, &Task::Lab(task.clone()), 1, 0).unwrap()
            } else {
                Recorder::reopen(folder, 0).unwrap()
            };
            recorder.put_entered_runs(task.clone(), runs).unwrap();
            recorder.finish("entered by hand").unwrap();
        }
        Repository::open(folder).unwrap()
    }

    #[test]
    fn runs_are_read_as_they_were_entered_at_once_or_one_after_the_other() {
        let mut runs =
            [entered(1, 1, "completed", Some(2.0)), entered(2, 1, "crash", Some(1.0)), entered(1, 2, "unknown", None)];
        let (apart, together) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let together = lab(together.path(), &[(task(2, 2), &runs)]);
        runs[1].provenance.operator = Some("Ada".to_owned());
        let apart = lab(apart.path(), &[(task(2, 1), &runs[..2]), (task(2, 2), &runs[2..])]);
        for repository in [&apart, &together] {
            assert_eq!(repository.task(), &Task::Lab(task(2, 2)));
            for (number, run) in (1..).zip(&runs) {
                let recorded = repository.test(number).unwrap().observation;
                assert_eq!(recorded.outcome, run.outcome);
                let values: Vec<Option<f64>> = recorded.metrics.iter().map(|metric| metric.value).collect();
                assert_eq!(values, run.values);
            }
        }
        let read = apart.entered_runs().unwrap();
        let read: Vec<_> = read
            .iter()
            .map(|entered| (entered.test, entered.of, entered.run, entered.provenance.operator.as_deref()))
            .collect();
        assert_eq!(read, [(1, 1, 1, None), (2, 2, 1, Some("Ada")), (3, 1, 2, None)]);
        assert_eq!(apart.digest().unwrap(), together.digest().unwrap(), "who made the runs is not part of it");
    }

    #[test]
    fn the_digest_says_which_run_of_which_test_it_was() {
        let digest = |of: u32, run: u32| {
            let folder = tempfile::tempdir().unwrap();
            lab(folder.path(), &[(task(2, 1), &[entered(of, run, "completed", None)])]).digest().unwrap()
        };
        assert_eq!(digest(1, 1), digest(1, 1));
        assert_ne!(digest(1, 1), digest(1, 2));
        assert_ne!(digest(1, 1), digest(2, 1));
    }

    #[test]
    fn what_a_run_that_broke_off_might_still_have_shown_is_open() {
        let folder = tempfile::tempdir().unwrap();
        let runs = [entered(1, 1, "completed", Some(0.0)), entered(1, 2, "timeout", Some(0.0))];
        let repository = lab(folder.path(), &[(task(1, 2), &runs)]);
        let verdicts: Vec<&str> = [1, 2]
            .map(|number| repository.row(number).unwrap().verdict(&repository.plan().requirements[0]).word())
            .to_vec();
        assert_eq!(verdicts, ["satisfied", "inconclusive"]);
    }

    #[test]
    fn each_word_for_an_outcome_is_that_of_the_outcome() {
        for word in ENTERED_OUTCOMES {
            assert_eq!(entered_outcome(word, &sample::plan()).unwrap().word(), word);
        }
        assert_eq!(entered_outcome("Completed", &sample::plan()), None);
    }

    #[test]
    fn runs_that_contradict_the_tests_are_damaged() {
        let said = |sql: &str| {
            let folder = tempfile::tempdir().unwrap();
            let runs = [entered(1, 1, "completed", None), entered(1, 2, "completed", None)];
            drop(lab(folder.path(), &[(task(1, 2), &runs)]));
            let connection = Connection::open(folder.path().join(DATABASE)).unwrap();
            connection.execute_batch(&format!("PRAGMA foreign_keys = OFF; {sql}")).unwrap();
            drop(connection);
            Repository::open(folder.path()).and_then(|repository| repository.entered_runs()).unwrap_err().to_string()
        };
        assert!(said("UPDATE lab_runs SET test = 9 WHERE test = 2").contains("T9 is a run of a lab, but of no test"));
        assert!(
            said("UPDATE operations SET operation_seed = '5' WHERE test = 2").contains("T2 is a run of a lab, but")
        );
        assert!(said("UPDATE lab_runs SET run = 0").contains("run 0 of T1"));
        assert!(said("UPDATE lab_runs SET run = 1").contains("run 1 of T1 in the lab is there twice"));
        assert!(said("UPDATE campaign SET task = NULL").contains("runs of a lab in results of no lab"));
        let view = "DROP TABLE lab_runs; CREATE VIEW lab_runs AS SELECT 1 AS test";
        assert!(said(view).contains("`lab_runs` is not a table, but a view"));
    }
}
