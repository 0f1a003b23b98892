//! Running tests again to confirm what was found: the same disturbance, a fresh seed of the simulator.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::RangeInclusive;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use sesame_plan::Test;
use sesame_results::record::{Event, EventKind, Recorder, Repetition, TestRecord};
use sesame_rng::derive_seed;

use crate::campaign::conduct::{CampaignError, Desk, Settings, patience};
use crate::campaign::pool::{Ended, Job, Pool, PoolSettings};

/// What is said when confirming showed that there was nothing to confirm.
pub(super) const LIKE_BEFORE: &str = "every run to confirm a test came out just like the run it repeats: the simulator does not vary \
     with its seed, so `confirm` costs simulations and shows nothing";

/// The simulator's seed of a repetition. It depends on the test's number and the repetition only, so that a test has the
/// same ones whenever it is confirmed.
pub(super) fn confirmation_seed(seed: u64, test: u32, repetition: u32) -> u64 {
    derive_seed(seed, "confirm", &[u64::from(test), u64::from(repetition)])
}

/// Tests of finished results that are to be run again.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Further {
    /// Numbers of the tests; none of a duplicate.
    pub tests: Vec<u32>,
    /// How often each is run.
    pub times: u32,
}

/// Runs tests of finished results again, and records that beside what is recorded already: the repetitions that a campaign
/// of its own accord confirms by are never among them, so that its front stays what it is. `each` is told how many runs
/// there are by now, and how many there will be. False if the user stopped it; what had ended by then is recorded.
pub fn confirm_further(
    recorder: &mut Recorder,
    further: &Further,
    settings: &Settings,
    directory: &Path,
    interrupted: &AtomicBool,
    each: &mut dyn FnMut(u32, u32),
) -> Result<bool, CampaignError> {
    let repository = recorder.repository();
    let repeated = repository.repetitions()?;
    let own = repository.plan().campaign.confirm.map_or(0, |confirmation| confirmation.times);
    let mut again = Again::default();
    let mut longest: f64 = 0.0;
    let mut wanted = Vec::with_capacity(further.tests.len());
    for &number in &further.tests {
        let record = repository.test(number)?;
        longest = longest.max(record.observation.wall.run);
        let shown = Repetition::of(number, 0, record.simulator_seed, &record.observation);
        again.first.insert(number, (record.test, shown));
        let last = repeated.get(&number).and_then(|runs| runs.last()).map_or(0, |run| run.position);
        let first = last.max(own) + 1;
        wanted.push((number, first..=first.saturating_add(further.times - 1)));
    }
    let total = further.times.saturating_mul(u32::try_from(further.tests.len()).unwrap_or(u32::MAX));
    let pool = Pool::start(&PoolSettings {
        workers: settings.workers_for(total),
        program: settings.program.clone(),
        directory: directory.to_path_buf(),
        timeout: settings.timeout.unwrap_or_else(|| patience(longest)),
    })?;
    let mut desk = Desk { recorder, recorded: BTreeSet::new(), repeated, pool, traces: None, interrupted };
    desk.repeat(&mut again, &wanted, settings.seed, &mut |runs| each(runs, total))
}

/// What repeating needs to know of tests, and what it has seen.
#[derive(Default)]
pub(super) struct Again {
    /// The tests of the generation at hand, with what their first runs showed.
    first: BTreeMap<u32, (Test, Repetition)>,
    generation: Option<u32>,
    runs: u32,
    differing: u32,
}

impl Again {
    /// Takes a test that may be repeated until the next generation comes.
    pub(super) fn remember(&mut self, record: &TestRecord) {
        if record.generation != self.generation {
            self.first.clear();
            self.generation = record.generation;
        }
        let shown = Repetition::of(record.number, 0, record.simulator_seed, &record.observation);
        self.first.insert(record.number, (record.test.clone(), shown));
    }

    /// Repetitions so far.
    pub(super) fn runs(&self) -> u32 {
        self.runs
    }

    /// Whether there were repetitions, and none of them differed from the run it repeated.
    pub(super) fn all_like_before(&self) -> bool {
        self.runs > 0 && self.differing == 0
    }

    fn count(&mut self, repetition: &Repetition) {
        let alike = self.first.get(&repetition.test).is_some_and(|(_, first)| {
            first.values == repetition.values && first.outcome.word() == repetition.outcome.word()
        });
        self.runs += 1;
        self.differing += u32::from(!alike);
    }
}

impl Desk<'_> {
    /// What is recorded of a test's repetitions, in their order.
    pub(super) fn repetitions(&self, test: u32) -> &[Repetition] {
        self.repeated.get(&test).map_or(&[], Vec::as_slice)
    }

    /// Runs these repetitions of each of these tests and records each as it ends; those recorded already are not run.
    /// `each` is told how many there are by now. False if the user stopped it; what had ended by then is recorded.
    pub(super) fn repeat(
        &mut self,
        again: &mut Again,
        tests: &[(u32, RangeInclusive<u32>)],
        seed: u64,
        each: &mut dyn FnMut(u32),
    ) -> Result<bool, CampaignError> {
        let mut waiting = BTreeMap::new();
        for (number, positions) in tests {
            let number = *number;
            let Some((test, _)) = again.first.get(&number) else { unreachable!("tests are remembered before") };
            let test = test.clone();
            for position in positions.clone() {
                let simulator_seed = confirmation_seed(seed, number, position);
                if let Some(known) = self.repetitions(number).iter().find(|it| it.position == position) {
                    if known.simulator_seed != simulator_seed {
                        return Err(CampaignError::OtherCampaign(number));
                    }
                    again.count(known);
                    continue;
                }
                // The pool's numbers only tell jobs apart.
                let job = u32::try_from(waiting.len()).unwrap_or(u32::MAX);
                self.pool.submit(Job { number: job, test: test.clone(), simulator_seed, trace: None });
                waiting.insert(job, (number, position, simulator_seed));
            }
        }
        each(again.runs());
        while !waiting.is_empty() {
            if self.interrupted.load(Ordering::Relaxed) {
                return Ok(false);
            }
            let Some(Ended { number: job, observation, notes, trace_failure: _, killed: _, lock_stepped: _ }) =
                self.pool.next(Duration::from_millis(100))?
            else {
                continue;
            };
            let Some((test, position, simulator_seed)) = waiting.remove(&job) else { continue };
            let repetition = Repetition::of(test, position, simulator_seed, &observation);
            self.recorder.put_repetition(&repetition, &observation.warnings)?;
            for note in notes {
                let text = format!("repetition {position}: {note}");
                self.recorder.put_event(&Event { kind: EventKind::Session, test: Some(test), text })?;
            }
            again.count(&repetition);
            let known = self.repeated.entry(test).or_default();
            let place = known.partition_point(|it| it.position < position);
            known.insert(place, repetition);
            each(again.runs());
        }
        Ok(true)
    }
}
