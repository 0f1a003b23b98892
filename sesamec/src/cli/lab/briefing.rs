//! What a briefing sheet says of a test, from the facts of its report. Nothing is read or written here.

use sesame_dsl::units::Unit;
use sesame_notation as notation;
use sesame_plan::{Bound, CampaignPlan, Lab, Metric, Requirement, ShapePlace};
use sesame_record::{Repetition, Verdict as Recorded};
use sesame_report::{OperationReport, TestReport, VerdictReport};
use sesame_safety::briefing::{
    Active, Briefing, Disturbance, ExpectedContact, ExpectedMetric, ExpectedVerdict, Verdict,
};
use sesame_safety::coupling::by_messages;
use sesame_safety::expansion::{Approach, SeparationDistance};

use super::replay::{Meeting, reads_the_other};

/// What is known of a test.
#[derive(Debug, Clone, Copy)]
pub(super) struct Facts<'a> {
    /// The plan of its campaign.
    pub(super) plan: &'a CampaignPlan,
    /// The lab; `None` where the space has none.
    pub(super) lab: Option<&'a Lab>,
    /// What was recorded of it.
    pub(super) report: &'a TestReport,
    /// The runs in which it was simulated again.
    pub(super) repeated: &'a [Repetition],
    /// What its trace shows.
    pub(super) traced: &'a Traced,
}

/// What a trace shows of the shapes of a lab.
#[derive(Debug, Clone, Default)]
pub(super) struct Traced {
    /// The greatest speed of each shape that moves.
    pub(super) speeds: Vec<RobotSpeed>,
    /// The contacts of each pair.
    pub(super) meetings: Vec<Meeting>,
}

/// How fast something was.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct RobotSpeed {
    /// What was fast.
    pub(super) of: String,
    /// Its greatest speed.
    pub(super) metres_per_second: f64,
}

/// The sheet of a test. `separation` computes by how much zones must be wider if a robot has this speed, in metres per
/// second; `None` where it is not known how robots stop.
pub(super) fn briefing(
    facts: &Facts<'_>,
    separation: impl Fn(f64) -> Option<(Approach, SeparationDistance)>,
) -> Briefing {
    let &Facts { plan, report, traced, .. } = facts;
    let (zones, too_small) = zones(facts, separation);
    let mut warnings = excluded(facts);
    if let "crash" | "timeout" = report.outcome.as_str() {
        let detail = report.detail.as_ref().map_or_else(String::new, |detail| format!(": {detail}"));
        warnings.push(format!(
            "In simulation this test broke off by a {} at {:.3} s{detail}. What would have followed is not known.",
            report.outcome, report.end
        ));
    }
    warnings.extend(too_small);
    let coupling = coupling(facts);
    warnings.extend(coupling.iter().filter(|(coupled, _)| *coupled).map(|(_, said)| said.clone()));
    let mut disturbances: Vec<(f64, Disturbance)> = report.operations.iter().flat_map(disturbances).collect();
    disturbances.sort_by(|one, other| one.0.total_cmp(&other.0));
    let contacts = traced.meetings.iter().map(|meeting| ExpectedContact {
        body: meeting.one.clone(),
        zone: meeting.other.clone(),
        first: meeting.contacts.first(),
        nearest: Some([meeting.contacts.nearest.clearance, meeting.contacts.nearest.time]),
    });
    let lab = facts.lab.map_or_else(String::new, |lab| format!(", lab {}", lab.name));
    Briefing {
        title: format!("{} of {}, campaign {}{lab}", report.test, plan.space, plan.campaign.name),
        warnings,
        disturbances: disturbances.into_iter().map(|(_, disturbance)| disturbance).collect(),
        metrics: metrics(facts),
        verdicts: report.requirements.iter().map(expected_verdict).collect(),
        contacts: contacts.collect(),
        interlocks: interlocks(facts),
        zones,
        coupling: coupling.into_iter().map(|(_, said)| said).collect(),
        stop_when: stop_when(facts),
        present: Vec::new(),
    }
}

/// Why the lab does not run this test, by what the simulation measured.
fn excluded(facts: &Facts<'_>) -> Vec<String> {
    let &Facts { plan, lab, report, .. } = facts;
    let exclusions = lab.map_or(&[][..], |lab| &lab.exclude).iter();
    let holds = exclusions.filter_map(|exclusion| {
        let measured = report.metrics.get(exclusion.metric.index())?;
        let value = measured.value.filter(|value| exclusion.bound.holds(*value))?;
        let metric = plan.metric(exclusion.metric);
        Some(format!(
            "The lab excludes this test: it has {} {}, and tests with {} are too dangerous. Do not run it.",
            metric.name,
            in_unit(metric, value),
            bounded(metric, exclusion.bound)
        ))
    });
    holds.collect()
}

/// An operation in words, with the time at which it begins: once for each time at which it is planned, or was seen, to
/// be active.
fn disturbances(operation: &OperationReport) -> Vec<(f64, Disturbance)> {
    let choices: Vec<&str> = operation.choices.iter().map(|choice| choice.text.as_str()).collect();
    let choices = if choices.is_empty() { String::new() } else { format!(", {}", choices.join(", ")) };
    let what = format!("{} ({}{choices})", operation.kind, operation.operation);
    let target = match (operation.topics().count(), &operation.resource) {
        (0, None) => "the run as a whole".to_owned(),
        (0, Some(resource)) => resource.clone(),
        (1, _) => format!("topic {}", operation.target_in_words()),
        (_, _) => format!("topics {}", operation.target_in_words()),
    };
    let disturbance = |active| Disturbance { operation: what.clone(), target: target.clone(), active };
    if let Some(planned) = operation.planned {
        return vec![(planned.start, disturbance(Active::During { from: planned.start, to: planned.end }))];
    }
    let Some(conditions) = &operation.conditions else {
        return vec![(f64::NEG_INFINITY, disturbance(Active::While("the run is prepared or followed up".to_owned())))];
    };
    let seen = operation.observed.as_deref().unwrap_or_default();
    let times: Vec<String> = seen.iter().map(|span| format!("from {:.3} s to {:.3} s", span.start, span.end)).collect();
    let observed = match &times[..] {
        [] => "never in simulation".to_owned(),
        times => format!("in simulation {}", times.join(", ")),
    };
    let begin = seen.first().map_or(f64::INFINITY, |span| span.start);
    vec![(begin, disturbance(Active::While(format!("«{conditions}» ({observed})"))))]
}

fn metrics(facts: &Facts<'_>) -> Vec<ExpectedMetric> {
    let measured = facts.report.metrics.iter().enumerate().filter_map(|(at, measured)| {
        let again = facts.repeated.iter().filter_map(|run| run.values.get(at)?.value);
        let interval = again.fold(None, |range: Option<[f64; 2]>, value| {
            Some(range.map_or([value; 2], |[low, high]| [low.min(value), high.max(value)]))
        });
        Some(ExpectedMetric {
            metric: measured.metric.clone(),
            unit: measured.unit.clone().unwrap_or_default(),
            value: measured.value?,
            interval,
        })
    });
    measured.collect()
}

fn expected_verdict(verdict: &VerdictReport) -> ExpectedVerdict {
    ExpectedVerdict {
        requirement: requirement_in_words(&verdict.requirement, &verdict.text),
        verdict: match verdict.verdict {
            Recorded::Violated => Verdict::Violated,
            Recorded::Satisfied => Verdict::Satisfied,
            Recorded::Inconclusive => Verdict::Inconclusive,
        },
        violated: verdict.outside.iter().map(|span| [span.start, span.end]).collect(),
        repeated: verdict.fresh.as_ref().map(|fresh| [fresh.tally.violated, fresh.tally.conclusive()]),
    }
}

fn requirement_in_words(name: &str, text: &str) -> String {
    if text.is_empty() { name.to_owned() } else { format!("{name} ({text})") }
}

/// Which interlocks stand for which violations, and which violations none prevents.
fn interlocks(facts: &Facts<'_>) -> Vec<String> {
    let &Facts { plan, lab, report, .. } = facts;
    let Some(lab) = lab.filter(|lab| !lab.interlock.is_empty()) else { return Vec::new() };
    let of = |requirement: &&Requirement, metric: &Metric| plan.metric(requirement.metric).name == metric.name;
    let mut said = Vec::new();
    for &id in &lab.interlock {
        let metric = plan.metric(id);
        let requirements: Vec<&str> = plan
            .requirements
            .iter()
            .filter(|requirement| of(requirement, metric))
            .map(|requirement| requirement.name.as_str())
            .collect();
        said.push(match &requirements[..] {
            [] => format!(
                "The interlock of {} ends the test; it stands for any value that differs from that of the undisturbed \
                 run.",
                metric.name
            ),
            names => format!(
                "The interlock of {} ends the test; it stands for a violation of {}.",
                metric.name,
                names.join(" and of ")
            ),
        });
    }
    let mut topics: Vec<&str> = report.operations.iter().flat_map(OperationReport::topics).collect();
    topics.sort_unstable();
    topics.dedup();
    if !topics.is_empty() {
        said.push(format!("No interlock may depend on what is disturbed: {}.", topics.join(", ")));
    }
    let interlocked = |metric: &str| lab.interlock.iter().any(|&id| plan.metric(id).name == metric);
    let violated = report.requirements.iter().filter(|verdict| verdict.verdict == Recorded::Violated);
    for verdict in violated.filter(|verdict| !interlocked(&verdict.metric)) {
        said.push(format!(
            "No interlock stands for a violation of {}: people must stop the test.",
            verdict.requirement
        ));
    }
    said
}

/// What is said of speeds and zones, and warnings of shapes that are expanded by less than is needed.
fn zones(
    facts: &Facts<'_>,
    separation: impl Fn(f64) -> Option<(Approach, SeparationDistance)>,
) -> (Vec<String>, Vec<String>) {
    let mut speeds = facts.traced.speeds.clone();
    speeds.extend(measured_speeds(facts));
    let Some(fastest) = speeds.iter().max_by(|one, other| one.metres_per_second.total_cmp(&other.metres_per_second))
    else {
        return (Vec::new(), Vec::new());
    };
    let mut said: Vec<String> =
        speeds.iter().map(|speed| format!("Up to {:.3} m/s: {}.", speed.metres_per_second, speed.of)).collect();
    let Some((approach, distance)) = separation(fastest.metres_per_second) else {
        said.push("How much wider safety zones must be was not computed: it is not known how robots stop.".to_owned());
        return (said, Vec::new());
    };
    said.push(format!(
        "Safety zones must be wider by {:.3} m [ISO/TS 15066]: {:.3} m for people who approach at {} m/s, {:.3} m for the \
         robot before it begins to stop, {:.3} m until it stands, {:.3} m for intrusion, {:.3} m for uncertainty.",
        distance.total(),
        distance.other,
        approach.other_speed,
        distance.reaction,
        distance.stopping,
        distance.intrusion,
        distance.uncertainty
    ));
    let zones = facts.lab.map_or(&[][..], |lab| &lab.shapes).iter();
    let fixed = zones.filter(|shape| matches!(shape.place, ShapePlace::Fixed { .. }));
    let too_small = fixed.filter(|shape| shape.expand < distance.total()).map(|shape| {
        format!(
            "{} is expanded by {:.3} m only, and {:.3} m are needed at {:.3} m/s.",
            shape.name,
            shape.expand,
            distance.total(),
            fastest.metres_per_second
        )
    });
    (said, too_small.collect())
}

/// The metrics that are speeds, each with its greatest value over all runs.
fn measured_speeds(facts: &Facts<'_>) -> Vec<RobotSpeed> {
    let metre_per_second = Unit::parse("m/s").expect("it is a unit");
    let speeds = facts.report.metrics.iter().enumerate().filter_map(|(at, measured)| {
        let unit = Unit::parse(measured.unit.as_deref()?).ok()?;
        if unit.dimension() != metre_per_second.dimension() || !measured.set {
            return None;
        }
        let again = facts.repeated.iter().filter_map(|run| run.values.get(at)?.value);
        let greatest = again.chain(measured.value).map(f64::abs).max_by(f64::total_cmp)?;
        let metres_per_second = unit.convert(greatest, &metre_per_second);
        Some(RobotSpeed { of: format!("metric {}", measured.metric), metres_per_second })
    });
    speeds.collect()
}

/// For each pair of shapes that move with poses of their own: whether they are coupled, and what that means for robots
/// that are run one at a time.
fn coupling(facts: &Facts<'_>) -> Vec<(bool, String)> {
    let shapes = facts.lab.map_or(&[][..], |lab| &lab.shapes);
    let poses: Vec<(&str, &str)> = shapes
        .iter()
        .filter_map(|shape| match &shape.place {
            ShapePlace::Pose { pose } => Some((shape.name.as_str(), pose.as_str())),
            ShapePlace::Fixed { .. } => None,
        })
        .collect();
    let mut said = Vec::new();
    for (at, (one, pose)) in poses.iter().enumerate() {
        for (other, its_pose) in &poses[at + 1..] {
            if pose == its_pose {
                continue;
            }
            said.push(match reads_the_other(facts.plan, pose, its_pose) {
                Some(depends) => {
                    let coupling = by_messages(depends);
                    (depends, format!("{one} and {other}, run one at a time: {}", coupling.sentence()))
                }
                None => (
                    false,
                    format!(
                        "{one} and {other}, run one at a time: it is unknown whether their motion is coupled, as the \
                         space does not say which node publishes which pose."
                    ),
                ),
            });
        }
    }
    said
}

/// When people stop the test, by what the simulation showed and the lab excludes.
fn stop_when(facts: &Facts<'_>) -> Vec<String> {
    let &Facts { plan, lab, report, .. } = facts;
    let mut said = Vec::new();
    for verdict in report.requirements.iter().filter(|verdict| verdict.verdict == Recorded::Violated) {
        let first = verdict
            .outside
            .first()
            .map_or_else(String::new, |span| format!("; in simulation it was violated first at {:.3} s", span.start));
        said.push(format!(
            "{} is about to be violated{first}",
            requirement_in_words(&verdict.requirement, &verdict.text)
        ));
    }
    for exclusion in lab.map_or(&[][..], |lab| &lab.exclude) {
        said.push(format!("{}, which the lab excludes", bounded(plan.metric(exclusion.metric), exclusion.bound)));
    }
    said.push(format!("{} s have passed, at which the campaign ends its tests", plan.campaign.end_after));
    said
}

fn in_unit(metric: &Metric, value: f64) -> String {
    notation::Unit::named(metric.unit.as_deref()).number(value)
}

fn bounded(metric: &Metric, bound: Bound) -> String {
    format!("{} {}", metric.name, notation::Unit::named(metric.unit.as_deref()).bound(bound))
}
