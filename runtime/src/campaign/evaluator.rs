//! Tests are handed to an executor, and their results recorded.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use sesame_base::observation::Observation;
use sesame_plan::{CampaignPlan, Compensation, Recorded};
use sesame_record as record;
use sesame_record::{Event, EventKind, Origin, RecordError, Recorder, Repetition, TestRecord};

use crate::campaign::error::{CampaignError, Halt};
use crate::campaign::executor::{Executor, ExecutorError, Job, JobResult, Machines, TraceRequest};
use crate::campaign::numbering::PlannedTest;
use crate::campaign::silence;

/// How many recorded tests are read at once when a campaign is resumed.
const READ_TOGETHER: u32 = 50;

/// How long an executor is waited for before it is looked whether the user stopped the campaign.
const WAIT: Duration = Duration::from_millis(100);

/// What happens while tests are run.
#[derive(Debug, Clone, Copy)]
pub(super) enum Happened<'a> {
    /// A test has ended and is recorded.
    Ended(&'a TestRecord),
    /// No test has ended, and this is what the start of a system waits for; several times a second.
    Waits(Option<&'a str>),
    /// This has happened to a machine.
    Told(&'a str),
    /// Machines are as busy as this now.
    Machines(Machines),
}

/// Runs tests and records them; what is recorded already is read instead.
pub(super) struct Evaluator<'a> {
    plan: &'a CampaignPlan,
    /// What the first reference run showed, once it has ended; `None` for results without one.
    reference: Option<Observation>,
    pub(super) recorder: &'a mut Recorder,
    pub(super) executor: &'a mut dyn Executor,
    /// Numbers of the tests that were recorded when the campaign was resumed.
    recorded: BTreeSet<u32>,
    /// The recorded repetitions of each test, in their order.
    pub(super) repetitions: BTreeMap<u32, Vec<Repetition>>,
    traces: Option<Traces>,
    /// Whether the search looks at how metrics went in the course of a run.
    series: bool,
    /// Whether runs list the messages that operations alter, from now on.
    pub(super) lists_altered: bool,
    interrupted: &'a AtomicBool,
    /// How busy machines were when that was last said.
    machines: Option<Machines>,
    /// Tests that were begun before their turn, and have not ended.
    early: BTreeMap<u32, PlannedTest>,
}

/// Which traces are kept, and in which folder of results.
struct Traces {
    folder: PathBuf,
    keep: Recorded,
}

impl Traces {
    fn request(&self, test: &PlannedTest) -> TraceRequest {
        // The others are compared with the reference run.
        let keep = if test.origin == Origin::Reference { Recorded::All } else { self.keep };
        TraceRequest { file: record::trace_file(&self.folder, test.number), keep }
    }
}

impl<'a> Evaluator<'a> {
    /// What brings the simulation closer to a lab in all of these results.
    pub(super) fn compensation(&self) -> Option<Compensation> {
        self.recorder.repository().plan().compensation.clone()
    }

    /// One that goes on with what the recorder holds. `series` says whether the search reads the series of metrics.
    pub(super) fn new(
        plan: &'a CampaignPlan,
        series: bool,
        recorder: &'a mut Recorder,
        executor: &'a mut dyn Executor,
        interrupted: &'a AtomicBool,
    ) -> Result<Self, RecordError> {
        let repository = recorder.repository();
        let recorded = repository.numbers()?.into_iter().collect();
        let traces = match plan.campaign.record {
            Some(keep) => Some(Traces { folder: repository.make_trace_folder()?, keep }),
            None => None,
        };
        let idle = Evaluator::without_tests(plan, recorder, executor, interrupted)?;
        Ok(Evaluator { recorded, traces, series, ..idle })
    }

    /// One that only repeats tests that are recorded.
    pub(super) fn for_repetitions(
        plan: &'a CampaignPlan,
        recorder: &'a mut Recorder,
        executor: &'a mut dyn Executor,
        interrupted: &'a AtomicBool,
    ) -> Result<Self, RecordError> {
        let reference = recorder.repository().reference_run()?.map(|record| record.observation);
        let idle = Evaluator::without_tests(plan, recorder, executor, interrupted)?;
        Ok(Evaluator { reference, ..idle })
    }

    /// One that knows of no tests but their repetitions.
    fn without_tests(
        plan: &'a CampaignPlan,
        recorder: &'a mut Recorder,
        executor: &'a mut dyn Executor,
        interrupted: &'a AtomicBool,
    ) -> Result<Self, RecordError> {
        let repetitions = recorder.repository().repetitions()?;
        Ok(Evaluator {
            plan,
            reference: None,
            recorder,
            executor,
            recorded: BTreeSet::new(),
            repetitions,
            traces: None,
            series: false,
            lists_altered: false,
            interrupted,
            machines: None,
            early: BTreeMap::new(),
        })
    }

    /// From now on, what is heard in a run is compared with what was heard in this one.
    pub(super) fn compare_with(&mut self, reference: &Observation) {
        self.reference = Some(reference.clone());
    }

    /// Runs tests and records each as it ends; `each` hears of all of them, in the order in which they end, and of what
    /// happens meanwhile.
    pub(super) fn evaluate(
        &mut self,
        planned: Vec<PlannedTest>,
        each: &mut dyn FnMut(Happened<'_>),
    ) -> Result<(), Halt> {
        let mut waiting = BTreeMap::new();
        let mut duplicates = Vec::new();
        let mut read_ahead = VecDeque::new();
        let last = planned.last().map_or(0, |test| test.number);
        for test in planned {
            if self.recorded.contains(&test.number) {
                let record = self.read(&mut read_ahead, test.number..=last, test.origin)?;
                if record.test != test.test || record.simulator_seed != test.simulator_seed {
                    return Err(CampaignError::OtherCampaign(test.number).into());
                }
                each(Happened::Ended(&record));
            } else if let Some(original) = test.duplicate_of {
                duplicates.push((original, test));
            } else {
                if self.early.remove(&test.number).is_none() {
                    self.submit(&test);
                }
                waiting.insert(test.number, test);
            }
        }
        while !waiting.is_empty() {
            let result = self.next(each)?;
            if let Some(test) = self.early.remove(&result.number) {
                // It is recorded now, so that it is not lost, and told in its turn.
                let record = self.conclude(test, result)?;
                self.recorded.insert(record.number);
            } else if let Some(test) = waiting.remove(&result.number) {
                let record = self.conclude(test, result)?;
                each(Happened::Ended(&record));
            }
        }
        for (original, test) in duplicates {
            let observation = self.read(&mut VecDeque::new(), original..=original, test.origin)?.observation;
            let record = test.observed(observation);
            self.record(&record)?;
            each(Happened::Ended(&record));
        }
        Ok(())
    }

    /// Records what came of a test.
    fn conclude(&mut self, test: PlannedTest, result: JobResult) -> Result<TestRecord, Halt> {
        let JobResult { number, observation, notes, added, trace_failure, killed, lock_stepped: _, machine } = result;
        if let Some(reason) = trace_failure {
            return Err(CampaignError::Trace { test: number, reason }.into());
        }
        if killed && test.origin == Origin::Reference {
            // All tests are compared with it: they would be compared with that kill, for good.
            let reason = observation.outcome.detail().unwrap_or_default();
            return Err(CampaignError::Killed { test: number, reason }.into());
        }
        let record = test.observed(observation);
        self.record(&record)?;
        // Only there it is asked for: a campaign has too many tests.
        if self.recorder.repository().task().undisturbed().is_some() {
            let wires = added.iter().map(|wire| (wire.path.as_str(), &wire.latencies));
            self.recorder.put_relay_latencies(number, wires)?;
        }
        if let Some(machine) = machine {
            self.recorder.put_machine(number, &machine)?;
        }
        for text in notes {
            self.recorder.put_event(&Event { kind: EventKind::Session, test: Some(number), text })?;
        }
        Ok(record)
    }

    fn submit(&mut self, test: &PlannedTest) {
        self.executor.submit(Job {
            number: test.number,
            test: test.test.clone(),
            simulator_seed: test.simulator_seed,
            trace: self.traces.as_ref().map(|traces| traces.request(test)),
            compensation: self.compensation(),
            withheld: Vec::new(),
            lists_altered: self.lists_altered,
        });
    }

    /// Begins with tests of which [`evaluate`](Evaluator::evaluate) will be asked later, so that no worker has to wait
    /// for the last test of a generation.
    pub(super) fn begin_early(&mut self, planned: &[PlannedTest]) {
        for test in planned {
            let is_begun = self.recorded.contains(&test.number) || self.early.contains_key(&test.number);
            if !is_begun && test.duplicate_of.is_none() {
                self.submit(test);
                self.early.insert(test.number, test.clone());
            }
        }
    }

    /// How many tests from this number on were begun before their turn, and have not ended.
    pub(super) fn under_way_from(&self, number: u32) -> usize {
        self.early.range(number..).count()
    }

    /// How many tests were recorded when the campaign was resumed, without reference runs.
    pub(super) fn earlier(&self) -> Result<u32, RecordError> {
        Ok(u32::try_from(self.recorder.repository().evaluated()?).unwrap_or(u32::MAX))
    }

    /// Waits for the next result of the executor; `meanwhile` is called several times a second until it is there, and
    /// for all that happens to machines.
    pub(super) fn next(&mut self, meanwhile: &mut dyn FnMut(Happened<'_>)) -> Result<JobResult, Halt> {
        loop {
            if self.interrupted.load(Ordering::Relaxed) {
                return Err(Halt::Stopped);
            }
            let next = match self.executor.next(WAIT) {
                Err(ExecutorError::Closed) => return Err(Halt::Stopped),
                next => next?,
            };
            for text in self.executor.news() {
                meanwhile(Happened::Told(&text));
                self.recorder.put_event(&Event { kind: EventKind::Session, test: None, text })?;
            }
            let machines = self.executor.machines();
            if machines != self.machines {
                self.machines = machines;
                if let Some(machines) = machines {
                    meanwhile(Happened::Machines(machines));
                }
            }
            if let Some(mut result) = next {
                if let Some(reference) = &self.reference {
                    silence::judge(self.plan, reference, &mut result.observation);
                }
                return Ok(result);
            }
            meanwhile(Happened::Waits(self.executor.waits().as_deref()));
        }
    }

    /// Records a warning, of one test or of the campaign.
    pub(super) fn warn(&mut self, test: Option<u32>, text: String) -> Result<(), RecordError> {
        self.recorder.put_event(&Event { kind: EventKind::Warning, test, text })
    }

    /// The first of these tests as it is recorded, with its series only if the campaign looks at them. Those that
    /// follow are read together with it, into `ahead`.
    fn read(
        &self,
        ahead: &mut VecDeque<TestRecord>,
        numbers: RangeInclusive<u32>,
        origin: Origin,
    ) -> Result<TestRecord, RecordError> {
        let number = *numbers.start();
        while ahead.front().is_some_and(|record| record.number < number) {
            ahead.pop_front();
        }
        if ahead.is_empty() {
            let series = self.series || origin == Origin::Reference;
            let together = if series { number } else { number.saturating_add(READ_TOGETHER).min(*numbers.end()) };
            ahead.extend(self.recorder.repository().records(number..=together, series)?);
        }
        match ahead.pop_front() {
            Some(record) if record.number == number => Ok(record),
            // It is missing: the error says so.
            _ => self.recorder.repository().test(number),
        }
    }

    fn record(&mut self, record: &TestRecord) -> Result<(), RecordError> {
        self.recorder.commit(record)?;
        for warning in &record.observation.warnings {
            self.warn(Some(record.number), warning.clone())?;
        }
        Ok(())
    }
}
