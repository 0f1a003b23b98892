//! Running tests again to confirm what was found: the same disturbance, a fresh seed of the simulator.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::ops::RangeInclusive;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use sesame_optimise::dominance::{Fitness, Unfit};
use sesame_optimise::front::Front;
use sesame_plan::{CampaignPlan, Confirmation, Test};
use sesame_record as record;
use sesame_record::{Event, EventKind, QUARANTINE, Recorder, Repetition, TestRecord};
use sesame_rng::derive_seed;
use sesame_search::{ConfirmedFront, Evaluated, GenerationTest};

use crate::campaign::error::{CampaignError, Halt};
use crate::campaign::evaluator::Evaluator;
use crate::campaign::executor::{Job, JobResult};
use crate::campaign::numbering::Numbering;
use crate::campaign::pool::Pool;
use crate::campaign::settings::{Settings, default_timeout};

/// The message if no confirmation could have shown anything.
const DETERMINISTIC_SIMULATOR: &str = "each run that confirms a test had exactly the results of the run it repeats: the simulator \
     does not vary with its seed, so `confirm` costs simulations and shows nothing";

/// The simulator's seed of a repetition. It depends on the test's number and the repetition only, so that a test has
/// the same seeds each time it is confirmed.
pub(super) fn confirmation_seed(seed: u64, test: u32, repetition: u32) -> u64 {
    derive_seed(seed, "confirm", &[u64::from(test), u64::from(repetition)])
}

/// The part of a campaign that confirms tests while it searches.
pub(super) struct ConfirmedSearch {
    confirmation: Confirmation,
    seed: u64,
    front: ConfirmedFront,
    repeated: RepeatedTests,
}

impl ConfirmedSearch {
    /// For a campaign with this seed.
    pub(super) fn new(confirmation: Confirmation, seed: u64) -> Self {
        ConfirmedSearch { confirmation, seed, front: ConfirmedFront::default(), repeated: RepeatedTests::default() }
    }

    /// Takes a test that may be confirmed until the next generation comes.
    pub(super) fn remember(&mut self, record: &TestRecord) {
        self.repeated.remember(record);
    }

    /// Runs to confirm tests so far.
    pub(super) fn runs(&self) -> u32 {
        self.repeated.runs
    }

    /// The front of confirmed tests.
    pub(super) fn front(&self) -> Front {
        self.front.front()
    }

    /// What is to be said after the search.
    pub(super) fn warning(&self) -> Option<String> {
        self.repeated.all_identical().then(|| DETERMINISTIC_SIMULATOR.to_owned())
    }

    /// Confirms the tests of a generation that would be on the front, or violate a requirement, until all tests on the
    /// front are confirmed; then gives tests their confirmed fitness and fresh runs. `each` sees the number of runs and
    /// the front.
    pub(super) fn confirm(
        &mut self,
        plan: &CampaignPlan,
        evaluator: &mut Evaluator<'_>,
        numbering: &Numbering,
        tests: &mut [Evaluated],
        violating: &BTreeSet<u32>,
        each: &mut dyn FnMut(u32, &Front),
    ) -> Result<(), Halt> {
        self.front.begin(tests.iter().map(|test| GenerationTest {
            number: test.number,
            stands_for: numbering.stands_for(test.number),
            first: test.fitness.clone(),
            violates: self.confirmation.violations && violating.contains(&test.number),
        }));
        loop {
            let unconfirmed = self.front.unconfirmed();
            if unconfirmed.is_empty() {
                break;
            }
            let before = self.front.front();
            let runs: Vec<_> = unconfirmed.iter().map(|&number| (number, 1..=self.confirmation.times)).collect();
            evaluator.repeat(plan, &mut self.repeated, &runs, self.seed, &mut |runs| each(runs, &before))?;
            for number in unconfirmed {
                let fitness = record::confirmed_fitness(plan, evaluator.repetitions_of(number));
                // Only runs of a quarantined test are missing.
                self.front.confirm(number, fitness.unwrap_or(Fitness::Unfit(Unfit::Crash)));
            }
        }
        for (test, fitness) in tests.iter_mut().zip(self.front.fitness()) {
            test.fitness = fitness.clone();
            let runs = evaluator.repetitions_of(numbering.stands_for(test.number));
            test.fresh_runs = record::confirming_runs(plan, runs).unwrap_or_default();
        }
        Ok(())
    }
}

/// Tests of finished results that are to be run again.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Confirmations {
    /// Numbers of the tests; none of a duplicate.
    pub tests: Vec<u32>,
    /// How often each is run.
    pub times: u32,
}

/// Runs tests of finished results again, and records the runs in addition to those that are recorded already: the
/// repetitions by which the campaign itself confirms are never among them, so its front stays what it is. `each` is
/// told how many runs there are by now, and how many there will be. False if the user stopped it; what had ended by
/// then is recorded.
pub fn confirm_recorded(
    recorder: &mut Recorder,
    confirmations: &Confirmations,
    settings: &Settings,
    directory: &Path,
    interrupted: &AtomicBool,
    each: &mut dyn FnMut(u32, u32),
) -> Result<bool, CampaignError> {
    let repository = recorder.repository();
    let recorded = repository.repetitions()?;
    let own = repository.plan().campaign.confirm.map_or(0, |confirmation| confirmation.times);
    let mut repeated = RepeatedTests::default();
    let mut longest: f64 = 0.0;
    let mut runs = Vec::with_capacity(confirmations.tests.len());
    for &number in &confirmations.tests {
        let record = repository.test(number)?;
        longest = longest.max(record.observation.wall.run);
        let shown = Repetition::of(number, 0, record.simulator_seed, &record.observation);
        repeated.first.insert(number, (record.test, shown));
        let last = recorded.get(&number).and_then(|runs| runs.last()).map_or(0, |run| run.position);
        let first = last.max(own) + 1;
        runs.push((number, first..=first.saturating_add(confirmations.times - 1)));
    }
    let total = confirmations.times.saturating_mul(u32::try_from(confirmations.tests.len()).unwrap_or(u32::MAX));
    let timeout = settings.timeout.unwrap_or_else(|| default_timeout(longest));
    let mut pool = Pool::start(&settings.pool(total, directory, timeout))?;
    let plan = repository.plan().clone();
    let mut evaluator = Evaluator::for_repetitions(&plan, recorder, &mut pool, interrupted)?;
    match evaluator.repeat(&plan, &mut repeated, &runs, settings.seed, &mut |runs| each(runs, total)) {
        Ok(()) => Ok(true),
        Err(Halt::Stopped) => Ok(false),
        Err(Halt::Failed(error)) => Err(error),
    }
}

/// What is known of tests that are run again.
#[derive(Default)]
pub(super) struct RepeatedTests {
    /// The tests of the current generation, with what their first runs showed.
    first: BTreeMap<u32, (Test, Repetition)>,
    generation: Option<u32>,
    /// Repetitions so far.
    runs: u32,
    /// Those with other results than the run they repeat.
    differing: u32,
}

impl RepeatedTests {
    fn remember(&mut self, record: &TestRecord) {
        if record.generation != self.generation {
            self.first.clear();
            self.generation = record.generation;
        }
        let shown = Repetition::of(record.number, 0, record.simulator_seed, &record.observation);
        self.first.insert(record.number, (record.test.clone(), shown));
    }

    /// Whether there were repetitions, and all had the results of the run that they repeat.
    fn all_identical(&self) -> bool {
        self.runs > 0 && self.differing == 0
    }

    fn count(&mut self, repetition: &Repetition) {
        let identical = self.first.get(&repetition.test).is_some_and(|(_, first)| {
            first.values == repetition.values && first.outcome.word() == repetition.outcome.word()
        });
        self.runs += 1;
        self.differing += u32::from(!identical);
    }
}

impl Evaluator<'_> {
    /// What is recorded of a test's repetitions, in their order.
    pub(super) fn repetitions_of(&self, test: u32) -> &[Repetition] {
        self.repetitions.get(&test).map_or(&[], Vec::as_slice)
    }

    /// Runs these repetitions of each of these tests and records each as it ends; those that are recorded are not run,
    /// and none of a quarantined test. The first ones of a test that crashed decide that, so the others wait for them.
    /// `each` is told how many there are by now.
    fn repeat(
        &mut self,
        plan: &CampaignPlan,
        repeated: &mut RepeatedTests,
        tests: &[(u32, RangeInclusive<u32>)],
        seed: u64,
        each: &mut dyn FnMut(u32),
    ) -> Result<(), Halt> {
        let (mut waiting, mut jobs) = (BTreeMap::new(), 0..);
        let mut later: BTreeMap<u32, VecDeque<Job>> = BTreeMap::new();
        for (number, positions) in tests {
            let number = *number;
            let Some((test, first)) = repeated.first.get(&number) else { unreachable!("tests are remembered before") };
            let (test, first) = (test.clone(), first.outcome.clone());
            let mut queue = VecDeque::new();
            for position in positions.clone() {
                let simulator_seed = confirmation_seed(seed, number, position);
                if let Some(recorded) = self.repetitions_of(number).iter().find(|run| run.position == position) {
                    if recorded.simulator_seed != simulator_seed {
                        return Err(CampaignError::OtherCampaign(number).into());
                    }
                    repeated.count(recorded);
                    continue;
                }
                let job = jobs.next().unwrap_or(u32::MAX);
                queue.push_back(Job {
                    number: job,
                    test: test.clone(),
                    simulator_seed,
                    trace: None,
                    compensation: self.compensation(),
                    withheld: Vec::new(),
                    lists_altered: false,
                });
                waiting.insert(job, (number, position, simulator_seed));
            }
            let known = self.repetitions_of(number).len();
            let now = match () {
                () if record::is_quarantined(plan, &first, self.repetitions_of(number)) => 0,
                () if record::may_be_quarantined(plan, &first) && known < QUARANTINE - 1 => QUARANTINE - 1 - known,
                () => queue.len(),
            };
            for job in queue.drain(..now.min(queue.len())) {
                self.executor.submit(job);
            }
            later.insert(number, queue);
            self.go_on(plan, repeated, number, &mut later, &mut waiting);
        }
        each(repeated.runs);
        while !waiting.is_empty() {
            let JobResult { number: job, observation, notes, .. } = self.next(&mut |_| {})?;
            let Some((test, position, simulator_seed)) = waiting.remove(&job) else { continue };
            let repetition = Repetition::of(test, position, simulator_seed, &observation);
            self.recorder.put_repetition(&repetition, &observation.warnings)?;
            for note in notes {
                let text = format!("repetition {position}: {note}");
                self.recorder.put_event(&Event { kind: EventKind::Session, test: Some(test), text })?;
            }
            repeated.count(&repetition);
            let recorded = self.repetitions.entry(test).or_default();
            let place = recorded.partition_point(|run| run.position < position);
            recorded.insert(place, repetition);
            self.go_on(plan, repeated, test, &mut later, &mut waiting);
            each(repeated.runs);
        }
        Ok(())
    }

    /// Submits the runs of a test that waited for its first ones, or leaves them out, once these have ended.
    fn go_on(
        &mut self,
        plan: &CampaignPlan,
        repeated: &RepeatedTests,
        test: u32,
        later: &mut BTreeMap<u32, VecDeque<Job>>,
        waiting: &mut BTreeMap<u32, (u32, u32, u64)>,
    ) {
        if self.repetitions_of(test).len() < QUARANTINE - 1 {
            return;
        }
        let Some(jobs) = later.remove(&test) else { return };
        let first = repeated.first.get(&test).map(|(_, first)| &first.outcome);
        let quarantined = first.is_some_and(|first| record::is_quarantined(plan, first, self.repetitions_of(test)));
        for job in jobs {
            if quarantined {
                waiting.remove(&job.number);
            } else {
                self.executor.submit(job);
            }
        }
    }
}
