//! What the monitors of a campaign were worth, over all its tests.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;

use sesame_analysis::confirmed::FindingAgain;
use sesame_analysis::statistics::Sample;
use sesame_base::observation::MonitorObservation;
use sesame_base::test_number::TestNumber;
use sesame_base::time::SimTime;
use sesame_monitor::State;
use sesame_monitor::compare::Step;
use sesame_monitor::score::scorer;
use sesame_plan::{CampaignPlan, Monitor, MonitorId, RequirementId};
use sesame_present::number;
use sesame_record as record;
use sesame_record::{Judge, Origin, RecordError, Repository, TestRow, Verdict};

use crate::facts::certificate::why::named;

/// How many tests are read at once.
const AT_ONCE: usize = 500;

/// What the monitors of a campaign did. Duplicates are not counted, and the reference run only among the tests with
/// missed hazards. The hazards of a test that was run again are those of its fresh runs, as its verdicts are; what else
/// monitors did is known of first runs only.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MonitorsSummary {
    /// Tests with decisions.
    pub tests: usize,
    /// How many of these were run again.
    pub run_again: usize,
    /// In how many of all tests nobody can tell about a requirement whether it had a hazard, because it is
    /// inconclusive.
    #[serde(skip_serializing_if = "number::is_zero")]
    pub unknown: usize,
    /// Tests in which a monitor missed a hazard, by number, the reference run among them.
    pub missed: Vec<MissedHazard>,
    /// One entry for each monitor and each requirement whose hazards it should foresee.
    pub hazards: Vec<HazardSummary>,
    /// One entry for each monitor.
    pub monitors: Vec<MonitorSummary>,
}

/// A hazard that a monitor did not foresee.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MissedHazard {
    /// The test.
    pub test: TestNumber,
    /// The monitor.
    pub monitor: String,
    /// The requirement.
    pub requirement: String,
    /// When nothing could satisfy it any more, in seconds: in the first fresh run in which the monitor missed the
    /// hazard, or in the only run.
    pub at: f64,
    /// The state of the monitor then; `None` in a fresh run, whose decisions are not kept.
    pub state: Option<String>,
    /// How often it was missed in fresh runs, if the test was run again.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub again: Option<FindingAgain>,
}

/// Hazards of a requirement, and what a monitor made of them. In a test that was run again, it missed the hazard if it
/// did in a fresh run, and the lead time is the least of those.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HazardSummary {
    /// The monitor.
    pub monitor: String,
    /// The requirement.
    pub requirement: String,
    /// Tests with a hazard that it foresaw.
    pub foreseen: usize,
    /// Tests with a hazard that it only detected: it went into its safe state in the same instant.
    pub detected: usize,
    /// Tests with a hazard that it missed.
    pub missed: usize,
    /// Tests in which nobody can tell whether there was a hazard, because the requirement is inconclusive. They count
    /// nowhere else.
    #[serde(skip_serializing_if = "number::is_zero")]
    pub unknown: usize,
    /// Its alarms without a hazard.
    pub false_alarms: u32,
    /// The shortest lead time of a hazard that it foresaw, in seconds.
    pub least_lead: Option<f64>,
    /// The median lead time, in seconds.
    pub median_lead: Option<f64>,
}

/// What a monitor did over all tests.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MonitorSummary {
    /// Its name.
    pub monitor: String,
    /// The median number of changes of its state in a test.
    pub median_changes: f64,
    /// The test with the most changes, and how many; among equals, the test with the smallest number.
    pub most_changes: Option<(TestNumber, u32)>,
    /// The shortest stay in a state that ended, in seconds.
    pub shortest_stay: Option<f64>,
    /// How often a guarantee was lost and none was left.
    pub alarms: u64,
    /// How often its mitigation was sent; `None` if it has none.
    pub mitigations: Option<u64>,
    /// Tests in which it never left its safe state: it guaranteed nothing, so it could miss nothing.
    pub never_vouched: usize,
    /// The time in each of its states, the strongest first; the last one is the safe state.
    pub states: Vec<StateShare>,
}

/// The time that a monitor spent in a state, over all tests.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StateShare {
    /// The state.
    pub state: String,
    /// Its integrity; 0 for the safe state.
    pub integrity: u32,
    /// The time, in seconds.
    pub time: f64,
    /// The share of the whole time.
    pub share: f64,
}

/// What the monitors of these results were worth; `None` if there are none, or nothing is recorded of them.
pub(crate) fn monitors_summary(
    repository: &Repository,
    rows: &[TestRow],
) -> Result<Option<MonitorsSummary>, RecordError> {
    let plan = repository.plan();
    if plan.monitors.is_empty() {
        return Ok(None);
    }
    let mut all = Collected::new(plan);
    let judge = repository.judge()?;
    each_test(repository, rows, |row, shown| all.take(plan, &judge, row, shown))?;
    Ok((all.tests > 0 || !all.missed.is_empty()).then(|| all.summary(plan)))
}

/// The hazards that monitors missed, by test, as in `R1 by transport`.
pub(crate) fn missed_by_test(
    repository: &Repository,
    rows: &[TestRow],
) -> Result<BTreeMap<u32, Vec<String>>, RecordError> {
    let plan = repository.plan();
    let mut found = BTreeMap::new();
    let judge = repository.judge()?;
    each_test(repository, rows, |row, shown| {
        let missed = missed_in(plan, &judge, row, shown);
        let words = missed.iter().map(|hazard| format!("{} by {}", hazard.requirement, hazard.monitor));
        found.insert(row.number, words.collect());
    })?;
    Ok(found)
}

/// Tells what the monitors decided in each test, but for duplicates.
fn each_test(
    repository: &Repository,
    rows: &[TestRow],
    mut take: impl FnMut(&TestRow, &[MonitorObservation]),
) -> Result<(), RecordError> {
    for rows in rows.chunks(AT_ONCE) {
        let (Some(first), Some(last)) = (rows.first(), rows.last()) else { continue };
        let shown = repository.decisions(first.number..=last.number)?;
        for row in rows.iter().filter(|row| row.duplicate_of.is_none()) {
            if let Some(shown) = shown.get(&row.number) {
                take(row, shown);
            }
        }
    }
    Ok(())
}

/// The hazards that monitors missed in a test: in its fresh runs if it was run again, else in its only one.
fn missed_in(plan: &CampaignPlan, judge: &Judge<'_>, row: &TestRow, shown: &[MonitorObservation]) -> Vec<MissedHazard> {
    let (test, runs) = (TestNumber(row.number), judge.runs(row.number));
    let in_first = |monitor: MonitorId| shown.get(monitor.index()).map_or(&[][..], |shown| &shown.hazards);
    let mut missed = Vec::new();
    for (id, monitor) in (0..).map(MonitorId).zip(&plan.monitors) {
        let fresh = runs.iter().filter_map(|run| run.hazards.get(id.index())).flatten();
        let all: BTreeSet<RequirementId> = in_first(id).iter().chain(fresh).map(|hazard| hazard.requirement).collect();
        for requirement in all {
            let declared = plan.requirement(requirement);
            let first = in_first(id).iter().copied().find(|hazard| hazard.requirement == requirement);
            let verdict = record::missed(first, row.verdict(declared));
            let tally = judge.missed(row.number, id, requirement);
            if tally.verdict(verdict) != Verdict::Violated {
                continue;
            }
            let again = runs.iter().filter_map(|run| run.hazard(id, requirement)).find(|hazard| hazard.lead.is_none());
            let Some(hazard) = again.or(first) else { continue };
            let is_of_first = again.is_none();
            missed.push(MissedHazard {
                test,
                monitor: monitor.name.clone(),
                requirement: declared.name.clone(),
                at: hazard.time,
                state: is_of_first.then(|| state_at(monitor, &shown[id.index()], hazard.time)),
                again: FindingAgain::of(&declared.name, tally, verdict).filter(|_| !runs.is_empty()),
            });
        }
    }
    missed
}

/// Sums over tests.
struct Collected {
    tests: usize,
    run_again: usize,
    unknown: usize,
    missed: Vec<MissedHazard>,
    pairs: Vec<Pair>,
    monitors: Vec<OfMonitor>,
}

struct Pair {
    monitor: MonitorId,
    requirement: RequirementId,
    horizon: Option<SimTime>,
    missed: usize,
    detected: usize,
    unknown: usize,
    leads: Vec<f64>,
    false_alarms: u32,
}

#[derive(Default)]
struct OfMonitor {
    changes: Vec<f64>,
    most: Option<(TestNumber, u32)>,
    shortest: Option<SimTime>,
    alarms: u64,
    never_vouched: usize,
    time_in: Vec<f64>,
}

impl Collected {
    fn new(plan: &CampaignPlan) -> Self {
        let pairs = plan.hazards_to_foresee().into_iter().map(|(monitor, requirement)| {
            let horizon = plan.alarm_horizon(monitor, requirement).map(SimTime::from_seconds);
            Pair {
                monitor,
                requirement,
                horizon,
                missed: 0,
                detected: 0,
                unknown: 0,
                leads: Vec::new(),
                false_alarms: 0,
            }
        });
        let monitors = plan.monitors.iter().map(|monitor| {
            let states = monitor.guarantees.len() + 1;
            OfMonitor { time_in: vec![0.0; states], ..OfMonitor::default() }
        });
        let (pairs, monitors) = (pairs.collect(), monitors.collect());
        Collected { tests: 0, run_again: 0, unknown: 0, missed: Vec::new(), pairs, monitors }
    }

    fn take(&mut self, plan: &CampaignPlan, judge: &Judge<'_>, row: &TestRow, shown: &[MonitorObservation]) {
        let test = TestNumber(row.number);
        self.missed.append(&mut missed_in(plan, judge, row, shown));
        if row.origin == Origin::Reference {
            return;
        }
        let runs = judge.runs(row.number);
        self.tests += 1;
        self.run_again += usize::from(!runs.is_empty());
        let end = SimTime::from_seconds(row.end);
        let steps: Vec<Vec<Step<State>>> = shown.iter().map(steps).collect();
        let guarantees = |id: MonitorId| u32::try_from(plan.monitor(id).guarantees.len()).unwrap_or(u32::MAX);
        let mut unknown = false;
        for pair in &mut self.pairs {
            let id = pair.monitor.index();
            let (Some(steps), Some(shown)) = (steps.get(id), shown.get(id)) else { continue };
            let hazards = shown.hazards.iter().filter(|hazard| hazard.requirement == pair.requirement);
            let first = hazards.clone().next().copied();
            let verdict = record::missed(first, row.verdict(plan.requirement(pair.requirement)));
            let is_missed = judge.missed(row.number, pair.monitor, pair.requirement).verdict(verdict);
            if is_missed == Verdict::Inconclusive {
                pair.unknown += 1;
                unknown = true;
                continue;
            }
            let fresh = runs.iter().filter_map(|run| run.hazard(pair.monitor, pair.requirement));
            let leads: Vec<f64> = match runs {
                [] => first.and_then(|hazard| hazard.lead).into_iter().collect(),
                _ => fresh.filter_map(|hazard| hazard.lead).collect(),
            };
            match leads.into_iter().reduce(f64::min) {
                _ if is_missed == Verdict::Violated => pair.missed += 1,
                Some(lead) if lead > 0.0 => pair.leads.push(lead),
                Some(_) => pair.detected += 1,
                None => {}
            }
            let hazards: Vec<(u32, SimTime)> =
                hazards.map(|hazard| (hazard.requirement.0, SimTime::from_seconds(hazard.time))).collect();
            let scorer = scorer(guarantees(pair.monitor), pair.horizon, steps, &hazards);
            // Which of its last alarms were false is not known of a run that broke off.
            let score = if row.outcome.is_whole() { scorer.end(end) } else { scorer.so_far(end) };
            pair.false_alarms += score.false_alarms;
        }
        self.unknown += usize::from(unknown);
        for (id, (of, steps)) in (0..).map(MonitorId).zip(self.monitors.iter_mut().zip(&steps)) {
            let score = scorer(guarantees(id), None, steps, &[]).so_far(end);
            of.changes.push(f64::from(score.changes));
            if of.most.is_none_or(|(_, most)| score.changes > most) {
                of.most = Some((test, score.changes));
            }
            of.shortest = [of.shortest, score.shortest_stay].into_iter().flatten().min();
            of.alarms += u64::from(score.mitigations);
            of.never_vouched += usize::from(score.changes == 0);
            for (sum, time) in of.time_in.iter_mut().zip(&score.time_in) {
                *sum += time.seconds();
            }
        }
    }

    fn summary(self, plan: &CampaignPlan) -> MonitorsSummary {
        let hazards = self.pairs.into_iter().map(|pair| {
            let leads = Sample::of(pair.leads.iter().copied());
            HazardSummary {
                monitor: plan.monitor(pair.monitor).name.clone(),
                requirement: plan.requirement(pair.requirement).name.clone(),
                foreseen: pair.leads.len(),
                detected: pair.detected,
                missed: pair.missed,
                unknown: pair.unknown,
                false_alarms: pair.false_alarms,
                least_lead: leads.as_ref().map(|leads| leads.min),
                median_lead: leads.as_ref().map(|leads| leads.median),
            }
        });
        let monitors = plan.monitors.iter().zip(self.monitors).map(|(monitor, of)| {
            let whole: f64 = of.time_in.iter().sum();
            let states = (0..).map(State::Guarantee).take(monitor.guarantees.len()).chain([State::Safe]);
            let states = states.zip(&of.time_in).map(|(state, &time)| {
                let (state, integrity) = named(monitor, state);
                let share = if whole > 0.0 { time / whole } else { 0.0 };
                StateShare { state: state.to_owned(), integrity, time, share }
            });
            MonitorSummary {
                monitor: monitor.name.clone(),
                median_changes: Sample::of(of.changes.iter().copied()).map_or(0.0, |changes| changes.median),
                most_changes: of.most.filter(|(_, most)| *most > 0),
                shortest_stay: of.shortest.map(SimTime::seconds),
                alarms: of.alarms,
                mitigations: monitor.otherwise.mitigation.is_some().then_some(of.alarms),
                never_vouched: of.never_vouched,
                states: states.collect(),
            }
        });
        MonitorsSummary {
            tests: self.tests,
            run_again: self.run_again,
            unknown: self.unknown,
            missed: self.missed,
            hazards: hazards.collect(),
            monitors: monitors.collect(),
        }
    }
}

fn steps(shown: &MonitorObservation) -> Vec<Step<State>> {
    let steps = shown.decisions.iter();
    steps
        .map(|decision| Step { at: SimTime::from_seconds(decision.time), state: State::from(decision.state) })
        .collect()
}

/// The name of the state of a monitor at the end of an instant.
fn state_at(monitor: &Monitor, shown: &MonitorObservation, at: f64) -> String {
    let past = shown.decisions.iter().take_while(|decision| decision.time <= at);
    let state = past.last().map_or(State::Safe, |decision| State::from(decision.state));
    named(monitor, state).0.to_owned()
}
