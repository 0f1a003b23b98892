//! Fitting a simulation to a lab (system identification) [SESAME 2023, Section 4.7]: tests that the lab ran are
//! simulated with adjustments, until what they publish is as close to the traces of the lab as can be.

mod journal;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use std::{fs, io};

use sesame_base::test_number::TestNumber;
use sesame_gap::discrepancy::discrepancy;
use sesame_gap::fit::minimise;
use sesame_gap::series::{Between, Series};
use sesame_plan::{Adjustment, CampaignPlan, Compensation, Fit, Fitted, LabTask, Recorded, Test};
use sesame_record::{RecordError, Repository, recording};
use sesame_recording::{self as trace, RecordingError, Signal};
use sesame_relay::wire::WireTable;
use sesame_rng::derive_seed;

use crate::campaign::{Executor, ExecutorError, Job, TraceRequest};

pub(crate) use journal::Journal;

/// The numbers in the messages of one run over time, by name.
type Signals = BTreeMap<String, Signal>;

/// How many evaluations find the level of noise that one test shows.
const EVALUATIONS_OF_A_LEVEL: usize = 12;

/// Why a fit broke off.
#[derive(Debug, thiserror::Error)]
pub(crate) enum FitError {
    /// Results cannot be read.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A trace cannot be read.
    #[error(transparent)]
    Trace(#[from] RecordingError),
    /// A worker cannot be used.
    #[error(transparent)]
    Executor(#[from] ExecutorError),
    /// A trace could not be written.
    #[error("a run could not be recorded: {0}")]
    NotRecorded(String),
    /// A trace that was read cannot be removed.
    #[error("cannot remove a trace that was read: {0}")]
    Leftover(#[from] io::Error),
    /// What was tried cannot be kept.
    #[error("cannot keep what was tried: {0}")]
    NotKept(io::Error),
    /// A run says nothing about the adjustments.
    #[error("{test} broke off when it was simulated again: {why}")]
    BrokeOff {
        /// The test.
        test: TestNumber,
        /// How.
        why: String,
    },
}

/// A test as a lab ran it.
#[derive(Debug)]
pub(crate) struct LabTraces {
    /// Its number in the campaign's results.
    pub(crate) number: u32,
    /// The test.
    pub(crate) test: Test,
    /// What each of its runs published; at least one.
    runs: Vec<Signals>,
}

/// The tests of a lab that have traces.
pub(crate) fn lab_traces(lab: &Repository, task: &LabTask) -> Result<Vec<LabTraces>, FitError> {
    let (plan, wires) = (lab.plan(), WireTable::new(lab.plan()));
    let rows = lab.tests()?;
    let mut found = Vec::new();
    for selected in &task.tests {
        let mut runs = Vec::new();
        for row in rows.iter().filter(|row| row.test == selected.test) {
            if let Some(file) = recording(lab.folder(), row.number) {
                runs.push(trace::signals(&file, plan, &wires)?);
            }
        }
        if !runs.is_empty() {
            found.push(LabTraces { number: selected.number, test: selected.test.clone(), runs });
        }
    }
    Ok(found)
}

/// What is fitted, and how.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Settings<'a> {
    /// The name of the lab.
    pub(crate) lab: &'a str,
    /// What may be fitted; at least one.
    pub(crate) fits: &'a [Fit],
    /// How many sets of values are tried; at least one.
    pub(crate) evaluations: usize,
    /// How often each test is simulated with a set of values, if noise is fitted. Otherwise it is simulated once.
    pub(crate) repeats: u32,
    /// What everything random is drawn from.
    pub(crate) seed: u64,
}

/// What a fit has come to.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Outcome {
    /// The values.
    pub(crate) compensation: Compensation,
    /// How far the simulation is from the lab in the tests that it was fitted to.
    pub(crate) fitted: Judged,
    /// The same in tests that were kept aside; `None` if there are none.
    pub(crate) held_out: Option<Judged>,
}

/// How far a simulation is from a lab over some tests, before and after a fit: the mean over tests and signals of the
/// [discrepancy].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Judged {
    /// Without adjustments.
    pub(crate) before: f64,
    /// With them.
    pub(crate) after: f64,
}

/// How far a fit has come.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Progress {
    /// Sets of values tried so far.
    pub(crate) done: usize,
    /// All of them.
    pub(crate) total: usize,
    /// The least discrepancy so far.
    pub(crate) best: f64,
}

/// Simulates tests and reads what they publish.
pub(crate) struct Simulations<'a> {
    pub(crate) plan: &'a CampaignPlan,
    pub(crate) executor: &'a mut dyn Executor,
    /// A folder for traces, which are removed once they are read.
    pub(crate) folder: PathBuf,
    pub(crate) interrupted: &'a AtomicBool,
}

/// Fits a simulation to a lab. `tests` are fitted to, `held_out` are judged by only. What `journal` knows is not tried
/// again. `None` when the user stopped it.
pub(crate) fn fit(
    simulations: &mut Simulations<'_>,
    journal: &mut Journal,
    tests: &[&LabTraces],
    held_out: &[&LabTraces],
    settings: Settings<'_>,
    progress: &mut dyn FnMut(Progress),
) -> Result<Option<Outcome>, FitError> {
    let Settings { lab, fits, evaluations, repeats, seed } = settings;
    let noises: Vec<usize> = (0..fits.len()).filter(|&at| matches!(fits[at].what, Fitted::Noise(_))).collect();
    let repeats = if noises.is_empty() { 1 } else { repeats.max(2) };
    let compensation = |levels: Vec<Vec<f64>>| Compensation {
        lab: lab.to_owned(),
        adjustments: fits
            .iter()
            .zip(levels)
            .map(|(fit, levels)| Adjustment { what: fit.what.clone(), levels })
            .collect(),
    };
    let of_values = |values: &[f64]| compensation(values.iter().map(|&value| vec![value]).collect());
    let mut runner = Evaluations { simulations, journal, repeats, seed, failure: None };

    let total = evaluations + noises.len() * tests.len() * EVALUATIONS_OF_A_LEVEL;
    let (mut done, mut best) = (0, f64::INFINITY);
    let bounds: Vec<[f64; 2]> = fits.iter().map(|fit| [fit.low, fit.high]).collect();
    let mut tried = |runner: &mut Evaluations<'_, '_>, tests: &[&LabTraces], with: &Compensation| {
        let value = runner.discrepancy(tests, Some(with));
        done += 1;
        best = best.min(value);
        progress(Progress { done, total, best });
        value
    };
    let found = minimise(&bounds, evaluations, seed, |values| tried(&mut runner, tests, &of_values(values)));
    let mut levels: Vec<Vec<f64>> = found.at.iter().map(|&value| vec![value]).collect();
    // Each test shows a level of its own, and what it shows is what later runs draw from (domain randomisation).
    for &noise in &noises {
        levels[noise] = tests
            .iter()
            .map(|test| {
                let level = minimise(&bounds[noise..=noise], EVALUATIONS_OF_A_LEVEL, seed, |level| {
                    let mut values = found.at.clone();
                    values[noise] = level[0];
                    tried(&mut runner, &[test], &of_values(&values))
                });
                level.at[0]
            })
            .collect();
    }
    let compensation = compensation(levels);
    let mut judged = |tests: &[&LabTraces]| Judged {
        before: runner.discrepancy(tests, None),
        after: runner.discrepancy(tests, Some(&compensation)),
    };
    let fitted = judged(tests);
    let held_out = (!held_out.is_empty()).then(|| judged(held_out));
    match runner.failure {
        Some(Stopped::Failed(failure)) => Err(failure),
        Some(Stopped::Interrupted) => Ok(None),
        None => Ok(Some(Outcome { compensation, fitted, held_out })),
    }
}

/// Why no more is evaluated.
enum Stopped {
    Interrupted,
    Failed(FitError),
}

/// Sets of values, one after the other.
struct Evaluations<'a, 's> {
    simulations: &'a mut Simulations<'s>,
    journal: &'a mut Journal,
    repeats: u32,
    seed: u64,
    /// Once it is there, every evaluation is infinite.
    failure: Option<Stopped>,
}

impl Evaluations<'_, '_> {
    /// The mean discrepancy over tests and signals; infinite if nothing can be compared.
    fn discrepancy(&mut self, tests: &[&LabTraces], with: Option<&Compensation>) -> f64 {
        if self.failure.is_some() {
            return f64::INFINITY;
        }
        let numbers: Vec<u32> = tests.iter().map(|test| test.number).collect();
        let key = serde_json::json!([numbers, with]).to_string();
        if let Some(known) = self.journal.find(&key) {
            return known;
        }
        let stopped = match self.simulations.run(tests, with, self.repeats, self.seed) {
            Ok(Some(simulated)) => {
                let of_tests = tests.iter().zip(&simulated);
                let found: Vec<f64> =
                    of_tests.flat_map(|(lab, simulated)| discrepancies(simulated, &lab.runs)).collect();
                let value =
                    if found.is_empty() { f64::INFINITY } else { found.iter().sum::<f64>() / found.len() as f64 };
                match self.journal.keep(key, value) {
                    Ok(()) => return value,
                    Err(error) => Stopped::Failed(FitError::NotKept(error)),
                }
            }
            Ok(None) => Stopped::Interrupted,
            Err(failure) => Stopped::Failed(failure),
        };
        self.failure = Some(stopped);
        f64::INFINITY
    }
}

impl Simulations<'_> {
    /// What each run of each test publishes. Runs are the same each time, except for the adjustments. `None` when the
    /// user stopped it.
    fn run(
        &mut self,
        tests: &[&LabTraces],
        with: Option<&Compensation>,
        repeats: u32,
        seed: u64,
    ) -> Result<Option<Vec<Vec<Signals>>>, FitError> {
        let mut waiting: BTreeMap<u32, (usize, PathBuf)> = BTreeMap::new();
        for (number, (at, run)) in (0u32..).zip((0..tests.len()).flat_map(|at| (1..=repeats).map(move |run| (at, run))))
        {
            let file = self.folder.join(format!("{number}.mcap"));
            let of_run = [u64::from(tests[at].number), u64::from(run)];
            self.executor.submit(Job {
                number,
                test: tests[at].test.clone(),
                simulator_seed: derive_seed(seed, "compensate", &of_run),
                trace: Some(TraceRequest { file: file.clone(), keep: Recorded::All }),
                compensation: with.cloned(),
                withheld: Vec::new(),
                lists_altered: false,
            });
            waiting.insert(number, (at, file));
        }
        let wires = WireTable::new(self.plan);
        let mut simulated: BTreeMap<u32, (usize, Signals)> = BTreeMap::new();
        while !waiting.is_empty() {
            if self.interrupted.load(Ordering::Relaxed) {
                return Ok(None);
            }
            let Some(result) = self.executor.next(Duration::from_millis(100))? else { continue };
            let Some((at, file)) = waiting.remove(&result.number) else { continue };
            if let Some(reason) = result.trace_failure {
                return Err(FitError::NotRecorded(reason));
            }
            if !result.observation.outcome.is_whole() {
                let why = result.observation.outcome.detail().unwrap_or_default().clone();
                return Err(FitError::BrokeOff { test: TestNumber(tests[at].number), why });
            }
            let signals = trace::signals(&file, self.plan, &wires)?;
            fs::remove_file(&file)?;
            simulated.insert(result.number, (at, signals));
        }
        let mut by_test: Vec<Vec<Signals>> = tests.iter().map(|_| Vec::new()).collect();
        for (at, signals) in simulated.into_values() {
            by_test[at].push(signals);
        }
        Ok(Some(by_test))
    }
}

/// The discrepancy of each signal that all runs have and that moves in the lab.
fn discrepancies(simulated: &[Signals], lab: &[Signals]) -> Vec<f64> {
    let Some(first) = lab.first() else { return Vec::new() };
    let found = first.keys().filter_map(|name| {
        let simulated = series_of(simulated, name)?;
        let lab = series_of(lab, name)?;
        discrepancy(&simulated, &lab).ok()
    });
    found.collect()
}

/// One signal of several runs; `None` if it is none in some of them.
fn series_of<'a>(runs: &'a [Signals], name: &str) -> Option<Vec<Series<'a>>> {
    let of = |run: &'a Signals| {
        let Signal { times, values } = run.get(name)?;
        Series::new(times, values, Between::Linear).ok()
    };
    runs.iter().map(of).collect()
}
