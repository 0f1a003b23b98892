//! Runs of tests again, written and read.

use std::collections::BTreeMap;

use rusqlite::params;

use sesame_base::observation::{MetricObservation, MonitorHazard, Observation, Outcome};
use sesame_base::test_number::TestNumber;
use sesame_optimise::dominance::Fitness;
use sesame_plan::{CampaignPlan, MonitorId, Requirement, RequirementId};
use sesame_search as search;
use sesame_search::aggregate;

use crate::columns::{finite, index, metric_value, perhaps_finite, position, unsigned};
use crate::monitors::write_hazards;
use crate::write_tests::write_event;
use crate::{
    Event, EventKind, MetricValue, RecordError, Recorder, Repetition, Repository, ScannedTest, Tally, TestRow, Verdict,
};

/// What the repetitions of a test say of its fitness, by the campaign's way to sum them up; `None` where the campaign
/// does not confirm, or not all of its repetitions are there. Further ones, which a user asked for later, change
/// nothing.
pub fn confirmed_fitness(plan: &CampaignPlan, repetitions: &[Repetition]) -> Option<Fitness> {
    let confirmation = plan.campaign.confirm?;
    let runs: Vec<Fitness> = own(plan, repetitions)?
        .iter()
        .map(|run| search::fitness_of(plan, &run.outcome, |metric| run.value(metric).value))
        .collect();
    Some(aggregate(&runs, confirmation.by))
}

/// The runs by which a campaign confirmed a test, without their series; `None` as for [`confirmed_fitness`].
pub fn confirming_runs(plan: &CampaignPlan, repetitions: &[Repetition]) -> Option<Vec<Observation>> {
    Some(own(plan, repetitions)?.iter().map(Repetition::observation).collect())
}

/// The repetitions by which a campaign itself confirms a test, if it does and all are there.
fn own<'a>(plan: &CampaignPlan, repetitions: &'a [Repetition]) -> Option<&'a [Repetition]> {
    let times = plan.campaign.confirm?.times;
    let count = repetitions.iter().take_while(|run| run.position <= times).count();
    (count == times as usize).then(|| &repetitions[..count])
}

impl Repetition {
    /// What is recorded of the run, in the form that a run reports. Series, operations and warnings are not kept.
    fn observation(&self) -> Observation {
        let shown = |recorded: &MetricValue| {
            let MetricValue { value, set, reach, not_finite } = *recorded;
            MetricObservation { value, set, reach, not_finite, ..MetricObservation::default() }
        };
        Observation {
            end: self.end,
            metrics: self.values.iter().map(shown).collect(),
            messages: self.messages,
            ..Observation::without_run(self.outcome.clone())
        }
    }
}

/// Whether a monitor missed a hazard in a run, as a verdict: violated if it did. Where nothing is known of a hazard,
/// and the run is inconclusive about its requirement, it is so about the hazard.
pub fn missed(hazard: Option<MonitorHazard>, of_requirement: Verdict) -> Verdict {
    match (hazard, of_requirement) {
        (Some(MonitorHazard { lead: None, .. }), _) => Verdict::Violated,
        (None, Verdict::Inconclusive) => Verdict::Inconclusive,
        _ => Verdict::Satisfied,
    }
}

/// Judges the tests of a campaign by their fresh runs where they were run again.
#[derive(Debug)]
pub struct Judge<'a> {
    plan: &'a CampaignPlan,
    repetitions: BTreeMap<u32, Vec<Repetition>>,
}

impl Judge<'_> {
    /// The fitness of a test: that of its repetitions where the campaign confirmed it, else by its recorded values. A
    /// duplicate is what its original is.
    pub fn fitness(&self, test: &ScannedTest) -> Fitness {
        let runs = self.repetitions.get(&test.duplicate_of.unwrap_or(test.number));
        runs.and_then(|runs| confirmed_fitness(self.plan, runs))
            .unwrap_or_else(|| search::fitness_of(self.plan, &test.outcome, |metric| test.value(metric).value))
    }

    /// What a test says about a requirement: its fresh runs where it was run again, else its one run. A duplicate says
    /// what its original says.
    pub fn verdict(&self, row: &TestRow, requirement: &Requirement) -> Verdict {
        self.tally(row.duplicate_of.unwrap_or(row.number), requirement).verdict(row.verdict(requirement))
    }

    /// What a test says about a requirement, as [`Judge::verdict`] has it.
    pub fn verdict_of_scanned(&self, test: &ScannedTest, requirement: &Requirement) -> Verdict {
        self.tally(test.duplicate_of.unwrap_or(test.number), requirement).verdict(test.verdict(requirement))
    }

    /// The verdicts of a test's fresh runs on a requirement; the test must not be a duplicate.
    pub fn tally(&self, test: u32, requirement: &Requirement) -> Tally {
        Tally::of(self.runs(test).iter().map(|run| run.verdict(requirement)))
    }

    /// Whether a monitor missed the hazard of a requirement, by the verdicts of a test's fresh runs; the test must not
    /// be a duplicate.
    pub fn missed(&self, test: u32, monitor: MonitorId, requirement: RequirementId) -> Tally {
        let declared = self.plan.requirement(requirement);
        Tally::of(self.runs(test).iter().map(|run| missed(run.hazard(monitor, requirement), run.verdict(declared))))
    }

    /// The fresh runs of a test, in their order; none of one that was run once only.
    pub fn runs(&self, test: u32) -> &[Repetition] {
        self.repetitions.get(&test).map_or(&[], Vec::as_slice)
    }

    /// All repetitions, by the numbers of their tests.
    pub fn repetitions(&self) -> &BTreeMap<u32, Vec<Repetition>> {
        &self.repetitions
    }
}

impl Recorder {
    /// Records a repetition that has ended, of a test that was committed, and what its hooks warned of: all of it in
    /// one transaction, or nothing.
    pub fn put_repetition(&mut self, repetition: &Repetition, warnings: &[String]) -> Result<(), RecordError> {
        self.check_lock()?;
        let Repetition { test, position, simulator_seed, outcome, end, messages, values, hazards } = repetition;
        let path = self.repository().path().to_owned();
        let unrecordable =
            |what: String| RecordError::Unrecordable { test: TestNumber(*test), what, path: path.clone() };
        let (detail, limit) = match outcome {
            Outcome::Timeout { limit } => (None, Some(*limit)),
            outcome => (outcome.message(), None),
        };
        let shown = values.iter().flat_map(|shown| [shown.value, shown.reach.low, shown.reach.high, shown.not_finite]);
        let times = hazards.iter().flatten().flat_map(|hazard| [Some(hazard.time), hazard.lead]);
        let numbers = shown.chain(times).flatten().chain([*end]).chain(limit);
        if let Some(number) = numbers.into_iter().find(|number| !number.is_finite()) {
            return Err(unrecordable(format!("a number of repetition {position} is {number}")));
        }
        let messages = i64::try_from(*messages)
            .map_err(|_| unrecordable(format!("the count {messages}, which is beyond 63 bits,")))?;
        let written = self.connection().transaction().and_then(|transaction| {
            transaction
                .prepare_cached(
                    "INSERT INTO repetitions (test, position, simulator_seed, outcome, outcome_detail, time_limit_s, \
                     end_s, messages) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)",
                )?
                .execute(params![
                    test,
                    position,
                    simulator_seed.to_string(),
                    outcome.word(),
                    detail,
                    limit,
                    end,
                    messages
                ])?;
            for (metric, shown) in values.iter().enumerate() {
                transaction
                    .prepare_cached(
                        "INSERT INTO repetition_values (test, position, metric, value, is_set, reach_low, reach_high, \
                         not_finite_s) VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)",
                    )?
                    .execute(params![
                        test,
                        position,
                        index(metric),
                        shown.value,
                        shown.set,
                        shown.reach.low,
                        shown.reach.high,
                        shown.not_finite
                    ])?;
            }
            write_hazards(&transaction, (*test, *position), hazards)?;
            for warning in warnings {
                // It is an event of the campaign: a test's own warnings are those of its own run.
                let text = format!("repetition {position} of {}: {warning}", TestNumber(*test));
                write_event(&transaction, &Event { kind: EventKind::Warning, test: None, text })?;
            }
            transaction.commit()
        });
        written.map_err(|e| RecordError::database("record a repetition", &path, e))
    }
}

impl Repository {
    /// A judge of its tests.
    pub fn judge(&self) -> Result<Judge<'_>, RecordError> {
        Ok(Judge { plan: self.plan(), repetitions: self.repetitions()? })
    }

    /// All repetitions of all tests: by test, and of each in their order.
    pub fn repetitions(&self) -> Result<BTreeMap<u32, Vec<Repetition>>, RecordError> {
        let values = self.read(
            "SELECT test, position, metric, value, is_set, reach_low, reach_high, not_finite_s FROM repetition_values \
             ORDER BY test, position, metric",
            [],
            |row| {
                let at: (u32, u32) = (row.get(0)?, row.get(1)?);
                Ok((at, position(row, 2)?, metric_value(row, 3)?))
            },
        )?;
        let mut of: BTreeMap<(u32, u32), Vec<MetricValue>> = BTreeMap::new();
        for (at, metric, value) in values {
            let of = of.entry(at).or_default();
            self.in_order(at.0, "values in a repetition", metric, of.len())?;
            of.push(value);
        }
        let rows = self.read(
            "SELECT test, position, simulator_seed, end_s, messages, outcome, outcome_detail, time_limit_s \
             FROM repetitions ORDER BY test, position",
            [],
            |row| {
                let at: (u32, u32) = (row.get(0)?, row.get(1)?);
                let ended: (f64, u64) = (finite(row, 3)?, unsigned(row, 4)?);
                let limit = perhaps_finite(row, 7)?;
                let outcome: (String, Option<String>, Option<f64>) = (row.get(5)?, row.get(6)?, limit);
                Ok((at, row.get::<_, String>(2)?, ended, outcome))
            },
        )?;
        let mut hazards = self.repeated_hazards()?;
        let mut repetitions: BTreeMap<u32, Vec<Repetition>> = BTreeMap::new();
        for ((test, position), seed, (end, messages), (word, detail, limit)) in rows {
            repetitions.entry(test).or_default().push(Repetition {
                test,
                position,
                simulator_seed: self.seed(&seed)?,
                outcome: self.outcome(&word, detail, limit)?,
                end,
                messages,
                values: of.remove(&(test, position)).unwrap_or_default(),
                hazards: hazards.remove(&(test, position)).unwrap_or_default(),
            });
        }
        Ok(repetitions)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use sesame_optimise::falsify::Margin;
    use sesame_plan::{Confirmation, Statistic};

    use super::*;
    use crate::{DATABASE, sample};

    fn repetition(test: u32, position: u32, outcome: Outcome, collisions: Option<f64>) -> Repetition {
        let value = |value: Option<f64>| MetricValue::whole(value, value.is_some());
        let values = [collisions, Some(0.1 + f64::from(position)), Some(1.0), None, Some(-0.25)].map(value).to_vec();
        let seed = u64::MAX - u64::from(position);
        let (end, messages, hazards) = (69.98, 12, Vec::new());
        Repetition { test, position, simulator_seed: seed, outcome, end, messages, values, hazards }
    }

    /// The sample's results with these repetitions, finished again.
    fn repeated(folder: &std::path::Path, plan: &CampaignPlan, repetitions: &[Repetition]) -> Repository {
        drop(sample::campaign(folder, plan, 20));
        let mut recorder = Recorder::reopen(folder, 1).unwrap();
        for repetition in repetitions {
            recorder.put_repetition(repetition, &[]).unwrap();
        }
        recorder.finish("all evaluations done").unwrap()
    }

    fn every_outcome() -> Vec<Repetition> {
        let crash = Outcome::Crash { message: "the simulator panicked".to_owned() };
        let mut empty = repetition(3, 2, crash, None);
        empty.values.clear();
        vec![
            repetition(5, 1, Outcome::NoEffect, Some(0.0)),
            repetition(3, 1, Outcome::Completed, Some(1.0 / 3.0)),
            empty,
            repetition(3, 3, Outcome::Timeout { limit: 30.0 }, Some(2.0)),
        ]
    }

    #[test]
    fn repetitions_are_read_as_they_were_written_and_are_no_tests() {
        let folder = tempfile::tempdir().unwrap();
        let mut written = every_outcome();
        let repository = repeated(folder.path(), &sample::plan(), &written);
        written.sort_by_key(|repetition| (repetition.test, repetition.position));
        let read: Vec<Repetition> = repository.repetitions().unwrap().into_values().flatten().collect();
        assert_eq!(read, written);
        assert_eq!(repository.tests().unwrap().len(), 22);
        assert_eq!(repository.campaign().stop.as_deref(), Some("all evaluations done"));
    }

    #[test]
    fn the_digest_covers_repetitions_in_any_order_of_completion() {
        let digest = |repetitions: &[Repetition]| {
            let folder = tempfile::tempdir().unwrap();
            repeated(folder.path(), &sample::plan(), repetitions).digest().unwrap()
        };
        let written = every_outcome();
        let mut backwards = written.clone();
        backwards.reverse();
        let whole = digest(&written);
        assert_eq!(digest(&backwards), whole);
        let changes: [fn(&mut Repetition); 9] = [
            |repetition| repetition.simulator_seed -= 9,
            |repetition| repetition.outcome = Outcome::Completed,
            |repetition| repetition.end = repetition.end.next_up(),
            |repetition| repetition.messages += 1,
            |repetition| repetition.values[1].value = repetition.values[1].value.map(f64::next_up),
            |repetition| repetition.values[1].set = false,
            |repetition| repetition.values[1].reach.low = None,
            |repetition| repetition.values[1].reach.high = repetition.values[1].reach.high.map(f64::next_up),
            |repetition| repetition.values[1].not_finite = Some(1.5),
        ];
        for (at, change) in changes.into_iter().enumerate() {
            let mut changed = written.clone();
            change(&mut changed[0]);
            assert_ne!(digest(&changed), whole, "change {at}");
        }
        let mut slower = written.clone();
        slower[3].outcome = Outcome::Timeout { limit: 31.0 };
        assert_eq!(digest(&slower), whole, "the limit is wall time");
    }

    #[test]
    fn what_cannot_be_recorded_is_refused_whole() {
        let folder = tempfile::tempdir().unwrap();
        let plan = sample::plan();
        drop(repeated(folder.path(), &plan, &[]));
        let mut recorder = Recorder::reopen(folder.path(), 1).unwrap();
        let refused = recorder.put_repetition(&repetition(3, 1, Outcome::Completed, Some(f64::INFINITY)), &[]);
        assert!(refused.unwrap_err().to_string().contains("repetition 1 is inf"));
        let first = repetition(3, 1, Outcome::Completed, Some(1.0));
        recorder.put_repetition(&first, &["`top_speed` refused NaN".to_owned()]).unwrap();
        assert!(
            recorder.put_repetition(&repetition(3, 1, Outcome::NoEffect, None), &[]).is_err(),
            "it is there already"
        );
        let repository = recorder.finish("all evaluations done").unwrap();
        assert_eq!(repository.repetitions().unwrap()[&3], [first]);
        let warned = repository
            .events()
            .unwrap()
            .into_iter()
            .any(|event| event.test.is_none() && event.text == "repetition 1 of T3: `top_speed` refused NaN");
        assert!(warned);
    }

    #[test]
    fn only_finished_results_are_reopened() {
        let folder = tempfile::tempdir().unwrap();
        Recorder::create(folder.path(), &sample::plan(), 42, 1).unwrap().interrupt().unwrap();
        let refused = Recorder::reopen(folder.path(), 1).unwrap_err();
        assert!(matches!(&refused, RecordError::Unfinished { path } if path.ends_with(DATABASE)), "{refused}");
    }

    #[test]
    fn a_campaign_goes_by_its_own_repetitions_and_not_by_later_ones() {
        let mut plan = sample::plan();
        let completed = |position, collisions| repetition(3, position, Outcome::Completed, Some(collisions));
        let runs = [completed(1, 2.0), completed(2, 4.0), completed(3, 90.0)];
        assert_eq!(confirmed_fitness(&plan, &runs), None, "it does not confirm");
        plan.campaign.confirm = Some(Confirmation { times: 2, by: Statistic::Mean, violations: false });
        // Fuzzing time is minimised, collisions are maximised.
        let Some(Fitness::Measured(values)) = confirmed_fitness(&plan, &runs) else { panic!("both have values") };
        assert_eq!(values, [f64::midpoint(1.1, 2.1), -3.0]);
        assert_eq!(confirmed_fitness(&plan, &runs[1..]), None, "one of its own is missing");
    }
    #[test]
    fn margins_are_those_of_the_fresh_runs() {
        let mut plan = sample::plan();
        let completed = |position, collisions| repetition(3, position, Outcome::Completed, Some(collisions));
        let runs = [completed(1, 2.0), completed(2, 4.0), completed(3, 90.0)];
        assert_eq!(confirming_runs(&plan, &runs), None, "it does not confirm");
        plan.campaign.confirm = Some(Confirmation { times: 2, by: Statistic::Mean, violations: false });
        let margins = |runs: &[Repetition]| {
            confirming_runs(&plan, runs).map(|runs| search::confirmed_margins(&plan, Statistic::Mean, &runs))
        };
        // R1: at most 0 collisions. R4 bounds a metric without value here.
        let confirmed = margins(&runs).unwrap();
        assert_eq!(confirmed[0], Margin { value: Some(-3.0), violated: true });
        assert_eq!(confirmed[3], Margin { value: None, violated: false });
        let crash = Outcome::Crash { message: "gone".to_owned() };
        let one_crash = [repetition(3, 1, crash, Some(0.0)), completed(2, 4.0)];
        assert_eq!(margins(&one_crash).unwrap()[0], Margin { value: None, violated: false });
        assert_eq!(margins(&runs[1..]), None, "one of its own is missing");
    }
    /// A run: how it ended, and whether it shows a collision; `None` where it has no value.
    fn run() -> impl Strategy<Value = (Outcome, Option<bool>)> {
        let crash = Outcome::Crash { message: String::new() };
        let outcomes = vec![Outcome::Completed, Outcome::NoEffect, Outcome::Timeout { limit: 1.0 }, crash];
        (prop::sample::select(outcomes), prop::option::of(any::<bool>()))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// The oracle counts the runs by hand, each by what it is.
        #[test]
        fn database_and_reports_say_the_same_of_a_test_that_was_run_again(
            first in run(), fresh in prop::collection::vec(run(), 0..5),
        ) {
            let said = |(outcome, shows): &(Outcome, Option<bool>)| match (outcome, shows) {
                (_, Some(true)) => "violated",
                (Outcome::Completed | Outcome::NoEffect, Some(false)) => "satisfied",
                _ => "inconclusive",
            };
            let count = |word: &str| fresh.iter().filter(|run| said(run) == word).count();
            let expected = match (fresh.len(), count("violated"), count("satisfied")) {
                (0, ..) => said(&first),
                (_, 1.., _) => "violated",
                (_, _, 1..) => "satisfied",
                _ if said(&first) == "violated" => "violated",
                _ => "inconclusive",
            };
            let value = |shows: Option<bool>| shows.map(|shows| f64::from(u8::from(shows)));

            let folder = tempfile::tempdir().unwrap();
            let mut plan = sample::plan();
            plan.requirements.truncate(1);
            let mut record = sample::record(&plan, 3, crate::Origin::Search, sesame_plan::Test::default());
            record.observation.outcome = first.0.clone();
            record.observation.metrics[0] = MetricObservation::whole(value(first.1), first.1.is_some(), Vec::new());
            let mut recorder = Recorder::create(folder.path(), &plan, 1, 1).unwrap();
            recorder.commit(&record).unwrap();
            for (position, (outcome, shows)) in (1..).zip(&fresh) {
                recorder.put_repetition(&repetition(3, position, outcome.clone(), value(*shows)), &[]).unwrap();
            }
            let repository = recorder.finish("all evaluations done").unwrap();

            let row = repository.row(3).unwrap();
            let judge = repository.judge().unwrap();
            prop_assert_eq!(judge.verdict(&row, &plan.requirements[0]).word(), expected);
            let open = rusqlite::Connection::open(folder.path().join(DATABASE)).unwrap();
            let word = |view: &str| -> String {
                open.query_row(&format!("SELECT verdict FROM {view}"), [], |row| row.get(0)).unwrap()
            };
            prop_assert_eq!(word("verdicts"), expected);
            prop_assert_eq!(word("first_verdicts"), said(&first));
            let counts: Vec<(u32, u32, u32)> = open
                .prepare("SELECT confirmed, conclusive, repetitions FROM confirmations")
                .unwrap()
                .query_map([], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?)))
                .unwrap()
                .collect::<Result<_, _>>()
                .unwrap();
            let listed = !fresh.is_empty() && (said(&first) == "violated" || count("violated") > 0);
            let counted = [count("violated"), count("violated") + count("satisfied"), fresh.len()];
            let [violated, told, all] = counted.map(|count| u32::try_from(count).unwrap());
            prop_assert_eq!(counts, if listed { vec![(violated, told, all)] } else { vec![] });
            let is_finding: bool = open
                .query_row("SELECT count(*) > 0 FROM findings WHERE finding = 'violation'", [], |row| row.get(0))
                .unwrap();
            prop_assert_eq!(is_finding, expected == "violated");
        }
    }
}
