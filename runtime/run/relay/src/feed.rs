//! Metrics and monitors are fed with messages that were recorded, instead of with those of a run.

mod fuzzing_time;

use std::sync::Arc;

use sesame_base::observation::{MetricObservation, MonitorObservation};
use sesame_base::time::SimTime;
use sesame_plan::{CampaignPlan, MetricSource, Side, Span};

use crate::metric::{MetricTable, Metrics, Scene};
use crate::monitor::{Decided, Monitors};
use crate::value::Value;
use crate::wire::{Wire, WireTable};
use fuzzing_time::{FuzzingTime, scored_bounds};

/// A message of a recording, as it passes.
#[derive(Debug, Clone, Copy)]
pub struct Passing<'v> {
    /// Simulation time.
    pub time: SimTime,
    /// Its wire.
    pub wire: Wire,
    /// Whether this is the message as it was published.
    pub published: bool,
    /// Whether this is the message as it was delivered.
    pub delivered: bool,
    /// Its number among those published on its wire.
    pub index: u64,
    /// The payload.
    pub value: &'v Value,
}

/// How a recording ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum End {
    /// The run came to its end then; a recording that no runner made ends with its last message.
    Whole(SimTime),
    /// The run broke off, if that is known, then.
    BrokenOff(Option<SimTime>),
}

/// What came of the messages.
#[derive(Debug)]
pub struct Found {
    /// Per metric of the plan. Where it is not known when operations were active, `fuzzing_time()` has no value.
    pub metrics: Vec<MetricObservation>,
    /// Per monitor of the plan.
    pub monitors: Vec<MonitorObservation>,
    /// Warnings for the user.
    pub warnings: Vec<String>,
}

/// Who is told what monitors decide, in order of time.
pub type Tell<'d> = &'d mut (dyn FnMut(&Decided) + 'd);

/// Whether [`Feeder::new`] has to know when operations were active: hazards are scored that depend on the fuzzing time.
pub fn asks_for_busy(plan: &CampaignPlan) -> bool {
    !scored_bounds(plan).is_empty()
}

/// Feeds messages to the metrics and monitors of a plan, in order of time, as a run of the relay does.
pub struct Feeder<'a, 'd> {
    plan: &'a CampaignPlan,
    fuzzing_time: FuzzingTime,
    metrics: Metrics<'a>,
    /// `None` for a plan without monitors. What they publish is in the recording.
    monitors: Option<Monitors<'a>>,
    /// Who is told what they decide.
    decided: Option<Tell<'d>>,
    now: SimTime,
}

impl<'a, 'd> Feeder<'a, 'd> {
    /// At the start of a run in which operations that count in `fuzzing_time()` were active, or held messages back, in
    /// these spans.
    pub fn new(
        plan: &'a CampaignPlan,
        wires: &'a WireTable,
        table: &'a MetricTable<'_>,
        busy: &[Span],
        decided: Option<Tell<'d>>,
    ) -> Self {
        let mut feeder = Feeder {
            plan,
            fuzzing_time: FuzzingTime::new(busy, &scored_bounds(plan)),
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
        feeder
    }

    /// The clock of the stamps showed so many seconds at time zero. Without this, stamps are in simulation time.
    pub fn clock_at_zero(&mut self, seconds: f64) {
        self.metrics.clock_at_zero(seconds);
    }

    /// The test chose these values of parameters of the space. Without this, they have their usual ones.
    pub fn set_scene(&mut self, scene: &Arc<Scene>) {
        self.metrics.set_scene(scene);
    }

    /// The next message, which is not earlier than the one before.
    pub fn message(&mut self, message: &Passing<'_>) {
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

    /// The end, and when operations were active, if that is known.
    pub fn finish(mut self, end: End, busy: Option<&[Span]>) -> Found {
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
        let (mut metrics, mut warnings) = self.metrics.finish(busy.unwrap_or_default());
        let mut monitors = Vec::new();
        if let Some(of_run) = self.monitors {
            let (observed, problems) = of_run.finish(self.now, &mut metrics, matches!(end, End::Whole(_)));
            monitors = observed;
            warnings.extend(problems);
        }
        if busy.is_none() {
            warnings.extend(forget_unknown(self.plan, &mut metrics));
        }
        Found { metrics, monitors, warnings }
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
