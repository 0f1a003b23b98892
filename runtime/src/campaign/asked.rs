//! Tests that the program carries out which started this process: a loop of the user's own, around a real system or a
//! simulator that nothing else can run.
//!
//! That program starts the supervisor with one end of a pair of sockets as its standard input, and sets `SESAME_ASKED`.
//! Each side writes lines of JSON:
//!
//! | line of the supervisor | meaning |
//! |---|---|
//! | `{"campaign": {"end": 20.0, "metrics": […], …}}` | what is measured, before the first test |
//! | `{"test": {"number": 3, "simulator_seed": 7, "operations": […]}}` | a test to carry out |
//! | `{"waits": [3, 4]}` | no test comes before the result of one of these two |
//!
//! It answers `{"result": {"number": 3, "outcome": "unknown", "metrics": {"closest": 0.4}}}`, for any of the tests that
//! were sent.

use std::collections::BTreeMap;
use std::io::{self, BufRead as _, BufReader, Read as _, Write as _};
use std::os::fd::AsFd as _;
use std::os::unix::net::UnixStream;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use sesame_base::observation::{MetricObservation, Observation, Outcome, Reach, WallTime};
use sesame_plan::{Activation, CampaignPlan, Metric, MetricId, MetricSource, Test};
use sesame_report::OperationReport;

use crate::campaign::executor::{Executor, ExecutorError, Job, JobResult};

/// Says that standard input is the connection to the program that carries out tests, and whether equal tests give equal
/// results.
const VARIABLE: &str = "SESAME_ASKED";

/// The value of the variable if equal tests give equal results.
const DETERMINISTIC: &str = "deterministic";

/// The longest line of the program, in bytes.
const LIMIT: u64 = 1 << 20;

/// Tests that another program carries out.
pub(super) struct Asked {
    connection: UnixStream,
    results: Receiver<String>,
    plan: CampaignPlan,
    deterministic: bool,
    /// Tests that were sent, and since when.
    open: BTreeMap<u32, (Test, Instant)>,
    /// Whether it is known there that no test comes before one of these has ended.
    has_said: bool,
}

/// A line to the program.
#[derive(Serialize)]
#[serde(rename_all = "snake_case")]
enum Line<'a> {
    Campaign(Measured<'a>),
    Test(Asks<'a>),
    Waits(Vec<u32>),
}

/// What a campaign measures.
#[derive(Serialize)]
struct Measured<'a> {
    name: &'a str,
    /// Seconds after which a test ends.
    end: f64,
    metrics: Vec<MeasuredMetric<'a>>,
    objectives: Vec<&'a str>,
}

#[derive(Serialize)]
struct MeasuredMetric<'a> {
    name: &'a str,
    unit: Option<&'a str>,
    /// Its value where it is not set.
    default: Option<f64>,
    /// Whether its value follows from the test, unless the result has another.
    follows: bool,
}

/// A test to carry out.
#[derive(Serialize)]
struct Asks<'a> {
    number: u32,
    simulator_seed: u64,
    operations: &'a [OperationReport],
}

/// A line of the program.
#[derive(Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
enum Answer {
    Result(Told),
}

/// What came of a test.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Told {
    number: u32,
    outcome: ToldOutcome,
    #[serde(default)]
    message: Option<String>,
    /// When the run ended, in seconds; the end of the campaign's tests if it is missing.
    #[serde(default)]
    end: Option<f64>,
    #[serde(default)]
    metrics: BTreeMap<String, Option<f64>>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
enum ToldOutcome {
    /// It ran to its end; whether an operation had an effect is not known.
    Unknown,
    Completed,
    NoEffect,
    Crash,
    Timeout,
}

/// Whether the program that started this process carries out its tests.
pub(crate) fn carries_out_tests() -> bool {
    std::env::var_os(VARIABLE).is_some()
}

impl Asked {
    /// Connects to the program that started this process, and says what is measured. A process does so once.
    pub(super) fn connect(plan: &CampaignPlan) -> Result<Asked, ExecutorError> {
        let connection = UnixStream::from(io::stdin().as_fd().try_clone_to_owned()?);
        // Also where standard input is a file, or a pair of another kind.
        connection.peer_addr()?;
        let (sender, results) = channel();
        let mut lines = BufReader::new(connection.try_clone()?).take(LIMIT);
        thread::spawn(move || {
            loop {
                let mut line = String::new();
                lines.set_limit(LIMIT);
                match lines.read_line(&mut line) {
                    Ok(1..) if sender.send(line).is_ok() => {}
                    _ => return,
                }
            }
        });
        let deterministic = std::env::var_os(VARIABLE).is_some_and(|value| value == DETERMINISTIC);
        let mut asked =
            Asked { connection, results, plan: plan.clone(), deterministic, open: BTreeMap::new(), has_said: true };
        let metric = |id: MetricId| plan.metric(id);
        let campaign = Measured {
            name: &plan.campaign.name,
            end: plan.campaign.end_after,
            metrics: plan.metrics.iter().map(MeasuredMetric::of).collect(),
            objectives: plan.campaign.objectives.iter().map(|&id| metric(id).name.as_str()).collect(),
        };
        asked.say(&Line::Campaign(campaign))?;
        Ok(asked)
    }

    fn say(&mut self, line: &Line<'_>) -> Result<(), ExecutorError> {
        let mut text = serde_json::to_vec(line).map_err(io::Error::from)?;
        text.push(b'\n');
        Ok(self.connection.write_all(&text)?)
    }

    /// What came of a test, read of a line.
    fn result(&mut self, line: &str) -> Result<JobResult, ExecutorError> {
        let Answer::Result(told) = serde_json::from_str(line).map_err(|error| of_program(error.to_string()))?;
        let Some((test, since)) = self.open.remove(&told.number) else {
            return Err(of_program(format!("it sent a result of {}, which was not asked for", told.number)));
        };
        self.has_said = false;
        let run = since.elapsed().as_secs_f64();
        let number = told.number;
        let observation = observation(&self.plan, &test, told, run).map_err(of_program)?;
        Ok(JobResult {
            number,
            observation,
            notes: Vec::new(),
            added: Vec::new(),
            trace_failure: None,
            killed: false,
            lock_stepped: self.deterministic,
            machine: None,
        })
    }
}

impl<'a> MeasuredMetric<'a> {
    fn of(metric: &'a Metric) -> Self {
        let follows = matches!(metric.source, MetricSource::FuzzingTime);
        MeasuredMetric { name: &metric.name, unit: metric.unit.as_deref(), default: metric.default, follows }
    }
}

/// A test as the results repository keeps it. Nothing is known of messages and of when operations acted.
fn observation(plan: &CampaignPlan, test: &Test, told: Told, run: f64) -> Result<Observation, String> {
    let Told { number, outcome, message, end, mut metrics } = told;
    let end = end.unwrap_or(plan.campaign.end_after);
    if !(0.0..=plan.campaign.end_after).contains(&end) {
        return Err(format!(
            "test {number} ends after {end} s; tests of this campaign end after {}",
            plan.campaign.end_after
        ));
    }
    let message = message.unwrap_or_else(|| "the program that carried it out says no more".to_owned());
    let outcome = match outcome {
        ToldOutcome::Unknown => Outcome::Unknown,
        ToldOutcome::Completed => Outcome::Completed,
        ToldOutcome::NoEffect => Outcome::NoEffect,
        ToldOutcome::Crash => Outcome::crash(message),
        ToldOutcome::Timeout => Outcome::Timeout { limit: run },
    };
    let observed = |metric: &Metric| {
        let (value, set) = match metrics.remove(&metric.name) {
            Some(Some(value)) if !value.is_finite() => {
                return Err(format!("metric `{}` of test {number} is not finite", metric.name));
            }
            Some(Some(value)) => (Some(value), true),
            Some(None) => (metric.default, false),
            None if matches!(metric.source, MetricSource::FuzzingTime) => (planned_time(test, end), true),
            None if metric.default.is_some() || !outcome.is_whole() => (metric.default, false),
            None => return Err(format!("the result of test {number} lacks metric `{}`", metric.name)),
        };
        let reach = if outcome.is_whole() { Reach::of_whole_run(value) } else { Reach::onwards(metric.trend, value) };
        Ok(MetricObservation { reach, ..MetricObservation::whole(value, set, Vec::new()) })
    };
    let observed = plan.metrics.iter().map(observed).collect::<Result<_, _>>()?;
    if let Some(unknown) = metrics.keys().next() {
        return Err(format!("the result of test {number} has a metric `{unknown}`, which the space does not declare"));
    }
    Ok(Observation { end, metrics: observed, wall: WallTime { run }, ..Observation::without_run(outcome) })
}

/// For how long the operations of a test are to be active, in seconds; `None` where conditions decide that.
fn planned_time(test: &Test, run_end: f64) -> Option<f64> {
    let times = test.operations.iter().map(|used| match used.activation {
        Activation::Time { start, end } => Some((end.min(run_end) - start).max(0.0)),
        Activation::Offline => Some(0.0),
        Activation::Condition { .. } | Activation::ConditionFor { .. } => None,
    });
    times.sum()
}

fn of_program(reason: String) -> ExecutorError {
    ExecutorError::Program { reason }
}

impl Executor for Asked {
    fn submit(&mut self, job: Job) {
        let operations = sesame_report::operations_of(&self.plan, &job.test);
        let Job { number, simulator_seed, test, .. } = job;
        self.open.insert(number, (test, Instant::now()));
        self.has_said = false;
        // If the program has ended, `next` says so.
        self.say(&Line::Test(Asks { number, simulator_seed, operations: &operations })).ok();
    }

    fn next(&mut self, wait: Duration) -> Result<Option<JobResult>, ExecutorError> {
        if !self.has_said && !self.open.is_empty() {
            self.has_said = true;
            let open = self.open.keys().copied().collect();
            // If the program has ended, what it sent before is still read.
            self.say(&Line::Waits(open)).ok();
        }
        match self.results.recv_timeout(wait) {
            Ok(line) => self.result(&line).map(Some),
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => Err(ExecutorError::Closed),
        }
    }

    fn set_timeout(&mut self, _: Duration, _: Duration) {
        // The program decides how long a test may take.
    }

    fn lock_stepped(&self) -> bool {
        self.deterministic
    }

    fn at_once(&self) -> usize {
        1
    }
}
