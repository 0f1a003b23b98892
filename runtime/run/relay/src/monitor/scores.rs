//! Scores of monitors as metrics, while a run goes on.
//!
//! A hazard is the moment from which no continuation of the run can satisfy a requirement. It is a fact of an instant:
//! a value that a metric has only between two messages of one instant is not a hazard. For a metric that may
//! recover, only the end decides. The robustness of a temporal formula is known when the run is over, and its
//! signal says when the formula was lost: scores of such requirements are computed then.

use sesame_base::hazard::hazard;
use sesame_base::observation::{MetricObservation, MetricValue, MonitorHazard, Outcome, Reach};
use sesame_base::time::SimTime;
use sesame_base::verdict::{Verdict, breaks, verdict};
use sesame_monitor::compare::Step;
use sesame_monitor::score::{Score as Scored, Scorer, score};
use sesame_monitor::{Decision, Run, State, Truth};
use sesame_plan::{
    Bound, CampaignPlan, MetricId, MetricSource, MonitorId, MonitorPart, MonitorState, RequirementId, Score,
};

use super::outlet::integrity;
use crate::metric::{Metrics, Shown};

/// The scores of a plan.
pub(super) struct Scores<'p> {
    plan: &'p CampaignPlan,
    metrics: Vec<MetricScore>,
    /// What monitors made of hazards, whether or not a metric says so.
    judged: Vec<Judged>,
    /// The requirements whose hazards are scored, but for those that are known when the run is over.
    watched: Vec<Watched>,
    /// The instants at which alarms become false because no hazard has come.
    deadlines: Vec<SimTime>,
    /// Whether anything has changed that is not shown yet.
    changed: bool,
    /// Whether the run has come to its end, so that the scores are final.
    ended: bool,
}

/// A metric that is a score.
struct MetricScore {
    metric: MetricId,
    monitor: MonitorId,
    score: Score,
    /// The state of its monitor.
    state: State,
    scorer: Scorer,
    /// The decisions, if the score is computed when the run is over.
    late: Option<Vec<Step<State>>>,
}

/// The hazard of a requirement, and a monitor that is to foresee it.
struct Judged {
    monitor: MonitorId,
    requirement: RequirementId,
    scorer: Scorer,
    /// The decisions, if the hazard is known when the run is over.
    late: Option<Vec<Step<State>>>,
}

struct Watched {
    requirement: RequirementId,
    metric: MetricId,
    bound: Bound,
    /// Whether its metric is the fuzzing time.
    fuzzing_time: bool,
    found: bool,
}

impl Watched {
    fn is_violated(&self, metrics: &Metrics<'_>, fuzzing_time: SimTime) -> bool {
        let value = if self.fuzzing_time { Some(fuzzing_time.seconds()) } else { metrics.set_value(self.metric) };
        !self.found && breaks(self.bound, Reach::onwards(metrics.trend(self.metric), value))
    }

    /// Whether it is violated in a run that is over.
    fn ends_violated(&self, plan: &CampaignPlan, metrics: &Metrics<'_>, fuzzing_time: SimTime) -> bool {
        let set = if self.fuzzing_time { Some(fuzzing_time.seconds()) } else { metrics.set_value(self.metric) };
        let value = set.or(plan.metric(self.metric).default);
        let violated = metrics.is_finite(self.metric) && value.is_some_and(|value| !self.bound.holds(value));
        !self.found && violated
    }
}

impl<'p> Scores<'p> {
    pub(super) fn new(plan: &'p CampaignPlan) -> Self {
        let is_late = |requirement: RequirementId| {
            let metric = plan.requirement(requirement).metric;
            matches!(plan.metric(metric).source, MetricSource::Robustness { .. })
        };
        let mut scored = Vec::new();
        for (metric, declared) in (0..).map(MetricId).zip(&plan.metrics) {
            let MetricSource::Monitor { monitor, score } = declared.source else { continue };
            let horizon = match score {
                Score::FalseAlarms { within, .. } => within.map(SimTime::from_seconds),
                _ => None,
            };
            scored.push(MetricScore {
                metric,
                monitor,
                score,
                state: State::Safe,
                scorer: Scorer::new(guarantees(plan, monitor), horizon),
                late: score.requirement().is_some_and(is_late).then(Vec::new),
            });
        }
        let judged = plan.hazards_to_foresee().into_iter().map(|(monitor, requirement)| {
            let late = is_late(requirement).then(Vec::new);
            Judged { monitor, requirement, scorer: Scorer::new(guarantees(plan, monitor), None), late }
        });
        let judged: Vec<Judged> = judged.collect();
        let mut requirements: Vec<RequirementId> = judged.iter().map(|judged| judged.requirement).collect();
        requirements.sort_unstable();
        requirements.dedup();
        let watched = requirements.into_iter().filter(|&requirement| !is_late(requirement)).map(|requirement| {
            let declared = plan.requirement(requirement);
            let fuzzing_time = matches!(plan.metric(declared.metric).source, MetricSource::FuzzingTime);
            Watched { requirement, metric: declared.metric, bound: declared.bound, fuzzing_time, found: false }
        });
        let watched = watched.collect();
        Scores { plan, watched, judged, metrics: scored, deadlines: Vec::new(), changed: true, ended: false }
    }

    /// A monitor decided.
    pub(super) fn decided(&mut self, decision: &Decision) {
        for scored in self.metrics.iter_mut().filter(|scored| scored.monitor == decision.monitor) {
            scored.scorer.decide(decision.at, decision.state);
            scored.state = decision.state;
            if let Some(late) = &mut scored.late {
                late.push(Step { at: decision.at, state: decision.state });
            }
            if let Score::FalseAlarms { within: Some(within), .. } = scored.score
                && decision.mitigate
            {
                self.deadlines.push(decision.at + SimTime::from_seconds(within) + SimTime::from_nanos(1));
            }
        }
        for judged in self.judged.iter_mut().filter(|judged| judged.monitor == decision.monitor) {
            match &mut judged.late {
                Some(late) => late.push(Step { at: decision.at, state: decision.state }),
                None => judged.scorer.decide(decision.at, decision.state),
            }
        }
        self.changed = true;
    }

    /// Evidence has changed.
    pub(super) fn changed(&mut self) {
        self.changed = true;
    }

    /// When a score changes next without an event.
    pub(super) fn next_due(&self) -> Option<SimTime> {
        self.deadlines.iter().copied().min()
    }

    /// Sets the metrics to what the scores are now, if something has changed.
    pub(super) fn show(&mut self, now: SimTime, run: &Run, metrics: &mut Metrics<'_>) {
        if std::mem::take(&mut self.changed) && !self.ended {
            self.set(now, run, metrics, Scorer::so_far);
        }
    }

    fn set(&mut self, now: SimTime, run: &Run, metrics: &mut Metrics<'_>, at: impl Fn(&Scorer, SimTime) -> Scored) {
        for scored in &self.metrics {
            let shown = match scored.score {
                Score::Holds { part } => holds(part, scored.monitor, run),
                Score::Integrity => Shown::Value(f64::from(integrity(self.plan.monitor(scored.monitor), scored.state))),
                _ => value(scored.score, &at(&scored.scorer, now)).map_or(Shown::Nothing, Shown::Value),
            };
            metrics.score(scored.metric, now, shown);
        }
    }

    /// Time has passed: sets what grows with it, and shows what has become due.
    pub(super) fn tick(&mut self, now: SimTime, metrics: &mut Metrics<'_>) {
        for scored in self.metrics.iter().filter(|scored| scored.grows() && !self.ended) {
            if let Some(value) = value(scored.score, &scored.scorer.so_far(now)) {
                metrics.score(scored.metric, now, Shown::Growing(value));
            }
        }
        if self.deadlines.iter().any(|&due| due <= now) {
            self.deadlines.retain(|&due| due > now);
            self.changed = true;
        }
    }

    /// Whether a metric is the time in a state in which its monitor is now.
    pub(super) fn grows(&self, metric: MetricId) -> bool {
        self.metrics.iter().any(|scored| scored.metric == metric && scored.grows())
    }

    /// Whether a requirement is violated at this moment and was not before.
    pub(super) fn sees_hazard(&self, metrics: &Metrics<'_>, fuzzing_time: SimTime) -> bool {
        self.watched.iter().any(|watched| watched.is_violated(metrics, fuzzing_time))
    }

    /// The instant is over, and with it all that metrics are in it. Returns whether there was a hazard.
    pub(super) fn end_instant(
        &mut self,
        now: SimTime,
        run: &Run,
        metrics: &mut Metrics<'_>,
        fuzzing_time: SimTime,
    ) -> bool {
        if !self.sees_hazard(metrics, fuzzing_time) {
            return false;
        }
        self.find(now, |watched| watched.is_violated(metrics, fuzzing_time));
        self.show(now, run, metrics);
        true
    }

    /// Counts the hazards of those requirements.
    fn find(&mut self, now: SimTime, is_violated: impl Fn(&Watched) -> bool) {
        for watched in &mut self.watched {
            if is_violated(watched) {
                watched.found = true;
                let RequirementId(number) = watched.requirement;
                for scored in
                    self.metrics.iter_mut().filter(|scored| scored.score.requirement() == Some(watched.requirement))
                {
                    scored.scorer.hazard(now, number);
                }
                for judged in self.judged.iter_mut().filter(|judged| judged.requirement == watched.requirement) {
                    judged.scorer.hazard(now, number);
                }
                self.changed = true;
            }
        }
    }

    /// The run has come to its end. A metric that was never set has its default, which may be a hazard, too.
    pub(super) fn end(&mut self, now: SimTime, run: &Run, metrics: &mut Metrics<'_>, fuzzing_time: SimTime) {
        let plan = self.plan;
        self.find(now, |watched| {
            watched.is_violated(metrics, fuzzing_time) || watched.ends_violated(plan, metrics, fuzzing_time)
        });
        self.set(now, run, metrics, Scorer::end);
        self.ended = true;
    }

    /// The run broke off, unless it had come to its end.
    pub(super) fn break_off(&mut self, now: SimTime, run: &Run, metrics: &mut Metrics<'_>) {
        self.changed = true;
        self.show(now, run, metrics);
    }

    /// All is over: computes the scores of temporal formulas. Returns the hazards that each monitor was to foresee.
    pub(super) fn finish(
        self,
        end: SimTime,
        metrics: &mut [MetricObservation],
        whole: bool,
    ) -> Vec<Vec<MonitorHazard>> {
        let outcome = if whole { Outcome::Completed } else { Outcome::crash(String::new()) };
        let hazards = self.hazards(end, metrics, &outcome);
        let undecided = self.undecided(metrics, &outcome);
        let plan = self.plan;
        for MetricScore { metric, monitor, score: of, late, .. } in self.metrics {
            let (Some(steps), Some(requirement)) = (late, of.requirement()) else { continue };
            let hazard = hazard_at(plan, requirement, &outcome, metrics, end);
            let RequirementId(number) = requirement;
            let hazards: Vec<(u32, SimTime)> = hazard.map(|at| (number, at)).into_iter().collect();
            let horizon = match of {
                Score::FalseAlarms { within, .. } => within.map(SimTime::from_seconds),
                _ => None,
            };
            let mut scored = score(guarantees(plan, monitor), horizon, &steps, &hazards, end);
            if !whole {
                // Which alarms were false is not known of a run that broke off.
                scored.false_alarms = 0;
            }
            let declared = plan.metric(metric);
            let observed = &mut metrics[metric.index()];
            let value = value(of, &scored);
            observed.set = value.is_some();
            observed.value = value.or(declared.default);
            observed.reach =
                if whole { Reach::of_whole_run(observed.value) } else { Reach::onwards(declared.trend, value) };
            let at = hazard.filter(|_| !matches!(of, Score::FalseAlarms { .. })).unwrap_or(end);
            let changes = value.filter(|&value| observed.series.last().is_none_or(|last| last.1 != value));
            observed.series.extend(changes.map(|value| (at.seconds(), value)));
        }
        for metric in undecided {
            let default = plan.metric(metric).default;
            let observed = &mut metrics[metric.index()];
            (observed.value, observed.set, observed.reach) = (default, false, Reach::ANY);
        }
        hazards
    }

    /// The scores of hazards of which nobody can tell whether there were any.
    fn undecided(&self, metrics: &[MetricObservation], outcome: &Outcome) -> Vec<MetricId> {
        let scores = self.metrics.iter().filter(|scored| {
            scored.score.requirement().is_some_and(|requirement| {
                let declared = self.plan.requirement(requirement);
                let observed = &metrics[declared.metric.index()];
                verdict(declared.bound, outcome, MetricValue::from(observed)) == Verdict::Inconclusive
            })
        });
        scores.map(|scored| scored.metric).collect()
    }

    /// Per monitor the hazards that it was to foresee, in the order of time.
    fn hazards(&self, end: SimTime, metrics: &[MetricObservation], outcome: &Outcome) -> Vec<Vec<MonitorHazard>> {
        let mut found = vec![Vec::new(); self.plan.monitors.len()];
        for judged in &self.judged {
            let scored = match &judged.late {
                None => judged.scorer.end(end),
                Some(steps) => {
                    let hazard = hazard_at(self.plan, judged.requirement, outcome, metrics, end);
                    let hazards: Vec<_> = hazard.map(|at| (judged.requirement.0, at)).into_iter().collect();
                    score(guarantees(self.plan, judged.monitor), None, steps, &hazards, end)
                }
            };
            found[judged.monitor.index()].extend(scored.hazards.iter().map(|hazard| MonitorHazard {
                requirement: judged.requirement,
                time: hazard.at.seconds(),
                lead: hazard.lead.map(SimTime::seconds),
            }));
        }
        for hazards in &mut found {
            hazards.sort_by(|a, b| a.time.total_cmp(&b.time));
        }
        found
    }
}

/// How many guarantees a monitor has.
fn guarantees(plan: &CampaignPlan, monitor: MonitorId) -> u32 {
    u32::try_from(plan.monitor(monitor).guarantees.len()).unwrap_or(u32::MAX)
}

impl MetricScore {
    fn grows(&self) -> bool {
        matches!(self.score, Score::TimeIn { state } if self.state == State::from(state))
    }
}

/// When a requirement was lost in a run that is over; `None` if it was not.
fn hazard_at(
    plan: &CampaignPlan,
    requirement: RequirementId,
    outcome: &Outcome,
    metrics: &[MetricObservation],
    end: SimTime,
) -> Option<SimTime> {
    hazard(plan, requirement, outcome, metrics, end.seconds()).map(|at| SimTime::from_seconds(at).min(end))
}

/// What a score is, of all that a monitor was worth.
fn value(score: Score, of: &Scored) -> Option<f64> {
    #[expect(clippy::cast_precision_loss, reason = "a run has fewer than 2^52 of anything")]
    let count = |count: usize| Some(count as f64);
    match score {
        Score::MissedHazards { .. } => count(of.missed()),
        Score::ForeseenHazards { .. } => count(of.foreseen()),
        Score::FalseAlarms { .. } => Some(f64::from(of.false_alarms)),
        Score::LeadTime { .. } => of.least_lead().map(SimTime::seconds),
        Score::TimeIn { state: MonitorState::Guarantee(at) } => of.time_in.get(at as usize).map(|time| time.seconds()),
        Score::TimeIn { state: MonitorState::Otherwise } => of.time_in.last().map(|time| time.seconds()),
        Score::Changes => Some(f64::from(of.changes)),
        Score::ShortestStay => of.shortest_stay.map(SimTime::seconds),
        Score::Mitigations => Some(f64::from(of.mitigations)),
        Score::Integrity | Score::Holds { .. } => None,
    }
}

/// Whether a part of a monitor holds.
fn holds(part: MonitorPart, monitor: MonitorId, run: &Run) -> Shown {
    let truth = match part {
        MonitorPart::Evidence(at) => run.evidence(run.network().evidence(monitor, at)),
        MonitorPart::Demand(at) => run.demand(monitor, at),
        MonitorPart::Guarantee(at) => run.guarantee(monitor, at),
        MonitorPart::Otherwise => Truth::from(run.state(monitor) == State::Safe),
    };
    match truth {
        Truth::False => Shown::Value(0.0),
        Truth::Unknown => Shown::Unknown,
        Truth::True => Shown::Value(1.0),
    }
}
