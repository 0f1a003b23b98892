//! Replays a recording: feeds metrics from it instead of a simulator.

use std::path::Path;

use sesame_base::observation::{MetricObservation, MonitorObservation};
use sesame_base::time::SimTime;
use sesame_plan::{CampaignPlan, MetricSource, Side};

use crate::metric::{MetricTable, Metrics};
use crate::monitor::{Decided, Monitors};
use crate::trace::fuzzing_time::{FuzzingTime, scored_bounds};
use crate::trace::recording::{self, End, Ending, Passing, RecordedRun, RecordingError};
use crate::value::Value;
use crate::wire::{Wire, WireTable};

/// The result of feeding a recording to a campaign's metrics.
#[derive(Debug)]
pub struct Fed {
    /// The recorded run, if a runner recorded it.
    pub run: Option<RecordedRun>,
    /// Per metric of the plan. Without a run, the actions of operations are unknown, and so is `fuzzing_time()`.
    pub metrics: Vec<MetricObservation>,
    /// Per monitor of the plan.
    pub monitors: Vec<MonitorObservation>,
    /// Warnings for the user.
    pub warnings: Vec<String>,
    /// Messages fed, as published.
    pub messages: u64,
}

/// Feeds the messages of a recording to the metrics of a plan, in order of time and without a simulator.
///
/// The trace of a runner is fed in the same order as in its run. In any other recording, the JSON messages on topics of
/// the space count, with times since the first of them, both as published and as delivered. Memory holds one record at
/// a time.
pub fn feed(
    path: &Path,
    plan: &CampaignPlan,
    wires: &WireTable,
    table: &MetricTable<'_>,
) -> Result<Fed, RecordingError> {
    feed_telling(path, plan, wires, table, None)
}

/// As [`feed`], and tells what monitors decide, in order of time.
pub fn feed_telling<'d>(
    path: &Path,
    plan: &CampaignPlan,
    wires: &WireTable,
    table: &MetricTable<'_>,
    decided: Option<&'d mut (dyn FnMut(&Decided) + 'd)>,
) -> Result<Fed, RecordingError> {
    // The fuzzing time at each moment follows from what is said at the end of a trace.
    let scored = scored_bounds(plan);
    let busy = if scored.is_empty() { None } else { recording::busy(path)? };
    let mut feeder = Feeder {
        plan,
        fuzzing_time: FuzzingTime::new(busy.as_deref().unwrap_or_default(), &scored),
        metrics: table.start(),
        monitors: None,
        decided,
        now: SimTime::ZERO,
    };
    feeder.monitors = Monitors::new(&feeder.metrics, wires);
    if feeder.decided.is_some() {
        feeder.monitors.iter_mut().for_each(Monitors::tell);
    }
    feeder.show_monitors();
    feeder.metrics.begin();
    let ending = recording::pass(path, plan, wires, &mut |message| {
        feeder.message(message);
        Ok(())
    })?;
    Ok(feeder.finish(ending))
}

struct Feeder<'a, 'd> {
    plan: &'a CampaignPlan,
    fuzzing_time: FuzzingTime,
    metrics: Metrics<'a>,
    /// `None` for a plan without monitors. What they publish is in the recording.
    monitors: Option<Monitors<'a>>,
    /// Who is told what they decide.
    decided: Option<&'d mut (dyn FnMut(&Decided) + 'd)>,
    now: SimTime,
}

impl Feeder<'_, '_> {
    fn message(&mut self, message: &Passing<'_>) {
        let &Passing { time, wire, published, delivered, index, value } = message;
        self.pass_to(time);
        self.now = time;
        if published {
            self.metrics.message(time, wire, value);
            self.monitors_hear(Side::Inbound, wire, index, value);
        }
        if delivered {
            self.metrics.delivery(time, wire, value);
            self.monitors_hear(Side::Outbound, wire, index, value);
        }
    }

    fn monitors_hear(&mut self, side: Side, wire: Wire, index: u64, value: &Value) {
        if let Some(monitors) = &mut self.monitors {
            monitors.hear(self.now, side, wire, index, value);
        }
    }

    /// Time passes up to an instant: monitors learn that the last one is over, and what is due until then happens.
    fn pass_to(&mut self, time: SimTime) {
        let Some(monitors) = &mut self.monitors else { return };
        let mut now = self.now;
        while now < time {
            monitors.decide(now);
            monitors.settle(now);
            monitors.show(now, &mut self.metrics);
            self.metrics.settle();
            monitors.end_instant(now, &mut self.metrics, self.fuzzing_time.at(now));
            let next = monitors.next_due().into_iter().chain(self.fuzzing_time.next(now)).min();
            now = next.map_or(time, |due| due.min(time));
            self.metrics.advance_to(now);
            monitors.tick(now, &mut self.metrics);
            monitors.advance(now);
        }
        self.show_monitors();
    }

    fn show_monitors(&mut self) {
        if let Some(monitors) = &mut self.monitors {
            monitors.give_up();
            monitors.show(self.now, &mut self.metrics);
        }
        self.tell_decided();
    }

    fn tell_decided(&mut self) {
        if let (Some(monitors), Some(tell)) = (&mut self.monitors, &mut self.decided) {
            monitors.take_decided().iter().for_each(&mut **tell);
        }
    }

    fn finish(mut self, ending: Ending) -> Fed {
        let Ending { run, end, busy, warnings: about_topics, messages } = ending;
        match end {
            End::Whole(end) => {
                self.pass_to(end);
                self.now = end;
                self.metrics.end(end);
                if let Some(monitors) = &mut self.monitors {
                    monitors.end(end, &mut self.metrics, self.fuzzing_time.at(end));
                }
            }
            // Hooks are not told of the end of a run that failed.
            End::BrokenOff(at) => {
                if let Some(at) = at {
                    self.pass_to(at);
                    self.metrics.advance_to(at);
                    self.now = self.now.max(at);
                }
                if let Some(monitors) = &mut self.monitors {
                    monitors.decide(self.now);
                    monitors.settle_whole(self.now);
                    monitors.show(self.now, &mut self.metrics);
                    monitors.break_off(self.now, &mut self.metrics);
                }
            }
        }
        self.tell_decided();
        let (mut metrics, mut warnings) = self.metrics.finish(busy.as_deref().unwrap_or_default());
        let mut monitors = Vec::new();
        if let Some(of_run) = self.monitors {
            let (observed, problems) = of_run.finish(self.now, &mut metrics, matches!(end, End::Whole(_)));
            monitors = observed;
            warnings.extend(problems);
        }
        if busy.is_none() {
            warnings.extend(forget_unknown(self.plan, &mut metrics));
        }
        warnings.extend(about_topics);
        Fed { run, metrics, monitors, warnings, messages }
    }
}

/// Takes away what cannot be known where the recording does not say what operations did: the fuzzing time, and scores
/// of hazards that depend on it, which is said.
fn forget_unknown(plan: &CampaignPlan, metrics: &mut [MetricObservation]) -> Vec<String> {
    let is_fuzzing_time = |metric| matches!(plan.metric(metric).source, MetricSource::FuzzingTime);
    let mut warnings = Vec::new();
    for (observed, metric) in metrics.iter_mut().zip(&plan.metrics) {
        let requirement = match metric.source {
            MetricSource::FuzzingTime => None,
            MetricSource::Monitor { score, .. } => match score.requirement() {
                Some(id) if is_fuzzing_time(plan.requirement(id).metric) => Some(plan.requirement(id)),
                _ => continue,
            },
            _ => continue,
        };
        *observed = MetricObservation::default();
        if let Some(requirement) = requirement {
            warnings.push(format!(
                "`{}` has no value: the recording does not say when operations were active, so it is not known when \
                 {} was violated",
                metric.name, requirement.name
            ));
        }
    }
    warnings
}
