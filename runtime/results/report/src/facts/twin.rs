//! A test, and the same test in which monitors send no mitigation: its *twin*.

use serde::Serialize;

use sesame_base::hazard::hazard;
use sesame_base::observation::Observation;
use sesame_base::test_number::TestNumber;
use sesame_plan::{CampaignPlan, MetricSource, MonitorId, MonitorState, RequirementId};
use sesame_record::TestRecord;

/// What mitigation was worth in a test: what was recorded of it compared with a run without mitigation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Twin {
    /// The test.
    pub test: TestNumber,
    /// The simulator's seed of both runs.
    pub simulator_seed: u64,
    /// The monitors whose mitigation was not sent in the twin.
    pub withheld: Vec<String>,
    /// Whether the simulator is stepped. If it is not, chance also makes the two runs differ.
    pub lock_stepped: bool,
    /// How the test ended.
    pub outcome: String,
    /// How its twin ended.
    pub outcome_of_twin: String,
    /// When these monitors sent their mitigation in the test, in the order of time.
    pub mitigations: Vec<SentMitigation>,
    /// Per requirement whose hazards can be foreseen: those that bound scores of hazards are left out.
    pub requirements: Vec<TwinRequirement>,
    /// Whether no hazard is left that mitigation should have prevented or has caused, and none is undecided.
    pub passed: bool,
}

/// A mitigation that was sent.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SentMitigation {
    /// The monitor that sent it.
    pub monitor: String,
    /// When, in seconds.
    pub at: f64,
}

/// A requirement in a test and in its twin.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TwinRequirement {
    /// The requirement.
    pub requirement: String,
    /// The first moment of the test from which nothing could satisfy it, in seconds.
    pub hazard: Option<f64>,
    /// The first moment of the twin from which nothing could satisfy it, in seconds.
    pub hazard_of_twin: Option<f64>,
    /// When mitigation was sent for the first time, in seconds: until then, the two runs are the same.
    pub mitigation: Option<f64>,
    /// How long before the hazard of the twin that was, in seconds; negative if it was after it.
    pub lead: Option<f64>,
    /// What mitigation was worth.
    pub verdict: MitigationVerdict,
}

/// What mitigation was worth for a requirement.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum MitigationVerdict {
    /// Mitigation was sent and no hazard followed, but the twin has one.
    MitigatedInTime,
    /// Mitigation was sent, but the hazard came nevertheless.
    MitigatedTooLate,
    /// Neither the test nor its twin has a hazard.
    NotNeeded,
    /// There is a hazard, and mitigation was not sent.
    NotMitigated,
    /// Only the test has a hazard: what was sent led to it.
    Caused,
    /// It is not known: a run broke off before a hazard could have come, or the runs differ although no mitigation was
    /// sent.
    Undecided,
}

impl MitigationVerdict {
    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            MitigationVerdict::MitigatedInTime => "mitigated in time",
            MitigationVerdict::MitigatedTooLate => "mitigated too late",
            MitigationVerdict::NotNeeded => "mitigation not needed",
            MitigationVerdict::NotMitigated => "not mitigated",
            MitigationVerdict::Caused => "caused by mitigation",
            MitigationVerdict::Undecided => "undecided",
        }
    }

    fn of(sent: bool, [test, twin]: [Side; 2]) -> Self {
        match (test, twin) {
            (Side::Safe, Side::Safe) => MitigationVerdict::NotNeeded,
            (Side::Safe, Side::Hazard) if sent => MitigationVerdict::MitigatedInTime,
            (Side::Hazard, Side::Safe) if sent => MitigationVerdict::Caused,
            (Side::Hazard, _) if !sent => MitigationVerdict::NotMitigated,
            (Side::Hazard, Side::Hazard) => MitigationVerdict::MitigatedTooLate,
            _ => MitigationVerdict::Undecided,
        }
    }

    /// Whether no hazard is left, and none undecided.
    pub fn is_as_required(self) -> bool {
        matches!(self, MitigationVerdict::MitigatedInTime | MitigationVerdict::NotNeeded)
    }
}

/// What a run says of a requirement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Side {
    Hazard,
    Safe,
    /// It broke off without a hazard.
    Open,
}

/// Compares a recorded test with its twin, in which these monitors sent no mitigation.
pub fn twin(
    plan: &CampaignPlan,
    record: &TestRecord,
    twin: &Observation,
    withheld: &[MonitorId],
    lock_stepped: bool,
) -> Twin {
    let test = &record.observation;
    let mut mitigations: Vec<SentMitigation> = Vec::new();
    for &id in withheld {
        let monitor = plan.monitor(id);
        let decisions = test.monitors.get(id.index()).map_or(&[][..], |monitor| &monitor.decisions);
        // The first decision is that of time zero, with which nothing is lost.
        let lost = decisions.iter().skip(1).filter(|decision| decision.state == MonitorState::Otherwise);
        mitigations.extend(lost.map(|decision| SentMitigation { monitor: monitor.name.clone(), at: decision.time }));
    }
    mitigations.sort_by(|a, b| a.at.total_cmp(&b.at));
    let first = mitigations.first().map(|mitigation| mitigation.at);
    let side = |run: &Observation, hazard: Option<f64>| match hazard {
        Some(_) => Side::Hazard,
        None if run.outcome.is_whole() => Side::Safe,
        None => Side::Open,
    };
    let scores_hazards = |id: RequirementId| match plan.metric(plan.requirement(id).metric).source {
        MetricSource::Monitor { score, .. } => score.requirement().is_some(),
        _ => false,
    };
    let all = (0..).map(RequirementId).zip(&plan.requirements).filter(|(id, _)| !scores_hazards(*id));
    let requirements: Vec<TwinRequirement> = all
        .map(|(id, declared)| {
            let of = |run: &Observation| hazard(plan, id, &run.outcome, &run.metrics, run.end);
            let (with, without) = (of(test), of(twin));
            TwinRequirement {
                requirement: declared.name.clone(),
                hazard: with,
                hazard_of_twin: without,
                mitigation: first,
                lead: without.zip(first).map(|(hazard, first)| hazard - first),
                verdict: MitigationVerdict::of(first.is_some(), [side(test, with), side(twin, without)]),
            }
        })
        .collect();
    Twin {
        test: TestNumber(record.number),
        simulator_seed: record.simulator_seed,
        withheld: withheld.iter().map(|&id| plan.monitor(id).name.clone()).collect(),
        lock_stepped,
        outcome: test.outcome.word().to_owned(),
        outcome_of_twin: twin.outcome.word().to_owned(),
        mitigations,
        passed: requirements.iter().all(|requirement| requirement.verdict.is_as_required()),
        requirements,
    }
}

#[cfg(test)]
mod tests {
    use sesame_base::observation::{MetricObservation, MonitorDecision, MonitorObservation};
    use sesame_plan::testing::{guarantee, monitor};
    use sesame_plan::{Bound, Gate, Test};
    use sesame_present::table::TextOptions;
    use sesame_record::{Origin, sample};

    use super::*;
    use crate::twin_text;

    /// A run of the sample's plan with a monitor, in which the first requirement's metric went like this.
    fn run(plan: &CampaignPlan, series: &[(f64, f64)], lost_at: &[f64]) -> TestRecord {
        let mut record = sample::record(plan, 5, Origin::Search, Test::default());
        let metric = plan.requirements[0].metric.index();
        let last = series.last().map(|point| point.1);
        record.observation.metrics[metric] = MetricObservation::whole(last, true, series.to_vec());
        let decision = |time, state| MonitorDecision { time, state };
        let mut decisions = vec![decision(0.0, MonitorState::Otherwise)];
        for &time in lost_at {
            decisions.push(decision(time - 0.5, MonitorState::Guarantee(0)));
            decisions.push(decision(time, MonitorState::Otherwise));
        }
        record.observation.monitors = vec![MonitorObservation { decisions, ..MonitorObservation::default() }];
        record
    }

    #[test]
    fn a_test_beside_its_twin_says_when_mitigation_was_sent_and_how_early_that_was() {
        let mut plan = sample::plan();
        plan.monitors = vec![monitor("guard", 0, vec![], vec![guarantee("go", 1, Gate::Evidence(0))])];
        plan.requirements.truncate(1);
        let (inside, outside) = match plan.requirements[0].bound {
            Bound::AtMost { value } => (value - 1.0, value + 1.0),
            bound => panic!("{bound:?} is not what this test takes it for"),
        };
        let safe = [(0.0, inside)];
        let violated = [(0.0, inside), (9.0, outside)];
        let of = |test: &[(f64, f64)], lost_at: &[f64], twin: &[(f64, f64)]| {
            let without = run(&plan, twin, lost_at).observation;
            super::twin(&plan, &run(&plan, test, lost_at), &without, &[MonitorId(0)], true)
        };
        let in_time = of(&safe, &[6.5, 8.0], &violated);
        let requirement = &in_time.requirements[0];
        assert_eq!((requirement.verdict, requirement.lead), (MitigationVerdict::MitigatedInTime, Some(2.5)));
        assert_eq!((in_time.mitigations.len(), in_time.passed), (2, true));
        let too_late = of(&violated, &[9.5], &violated);
        let requirement = &too_late.requirements[0];
        assert_eq!((requirement.verdict, requirement.lead), (MitigationVerdict::MitigatedTooLate, Some(-0.5)));
        assert_eq!(of(&violated, &[], &violated).requirements[0].verdict, MitigationVerdict::NotMitigated);
        assert!(!too_late.passed);
        let options = TextOptions { width: None, colour: false };
        insta::assert_snapshot!([in_time, too_late].map(|twin| twin_text(&twin, options)).join("\n"));
    }

    #[test]
    fn a_verdict_says_what_mitigation_was_worth() {
        use MitigationVerdict::{Caused, MitigatedInTime, MitigatedTooLate, NotMitigated, NotNeeded, Undecided};
        use Side::{Hazard, Open, Safe};
        let of = |sent, test, twin| MitigationVerdict::of(sent, [test, twin]);
        assert_eq!((of(true, Safe, Hazard), of(true, Hazard, Hazard)), (MitigatedInTime, MitigatedTooLate));
        assert_eq!((of(true, Safe, Safe), of(false, Safe, Safe)), (NotNeeded, NotNeeded));
        assert_eq!((of(false, Hazard, Hazard), of(true, Hazard, Safe)), (NotMitigated, Caused));
        assert_eq!(of(false, Safe, Hazard), Undecided, "nothing was sent that could have prevented it");
        assert_eq!(
            (of(true, Open, Hazard), of(true, Safe, Open), of(true, Hazard, Open)),
            (Undecided, Undecided, Undecided)
        );
    }
}
