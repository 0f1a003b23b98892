//! All metrics of one run: which messages they read, and their results.

use std::sync::Arc;

use sesame_base::activation::TICK;
use sesame_base::observation::{MetricObservation, Reach};
use sesame_base::time::SimTime;
use sesame_base::verdict::ends;
use sesame_monitor::{Invalid, Network};
use sesame_plan::stl::Robustness;
use sesame_plan::{CampaignPlan, Formula, Members, MetricId, MetricSource, Side, Span, TopicId};

use crate::metric::aggregate::FormulaState;
use crate::metric::robustness::RobustnessState;
use crate::metric::{Context, Hook, HookEntry};

use crate::stl::FormulaError;
use crate::value::{Text, Value};
use crate::wire::{Wire, WireTable};

/// The metrics of a plan with their wiring; shared by all runs.
pub struct MetricTable<'p> {
    plan: &'p CampaignPlan,
    hooks: Vec<Option<HookEntry>>,
    /// Per wire: the metrics that read its messages as they were published, with the position of its topic among their
    /// inputs.
    taps: Vec<Vec<(usize, usize)>>,
    /// Per wire: the metrics that read its messages as they are delivered.
    delivered: Vec<Vec<usize>>,
    /// Per wire: its path, its topic, and the position among the topic's paths.
    wires: Vec<(Text, TopicId, usize)>,
    /// The monitors, whose scores are metrics; `None` for a plan without monitors.
    network: Option<Arc<Network>>,
}

/// Why a runner cannot compute the metrics of its plan.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MetricError {
    /// A hook that the runner does not have.
    #[error("metric `{0}` has no hook in this runner: run `sesamec generate` again")]
    MissingHook(String),
    /// A formula over each member of groups that have different numbers of members.
    #[error(
        "metric `{0}` reads each member of groups of different sizes; the plan was not written by sesamec: run \
         `sesamec generate` again"
    )]
    UnpairedMembers(String),
    /// A temporal formula that is not valid.
    #[error("metric `{metric}`: {error}; the plan was not written by sesamec: run `sesamec generate` again")]
    Formula {
        /// The metric.
        metric: String,
        /// The problem.
        error: FormulaError,
    },
    /// Monitors that are not valid.
    #[error("{0}; the plan was not written by sesamec: run `sesamec generate` again")]
    Monitors(Invalid),
}

impl<'p> MetricTable<'p> {
    /// Connects the metrics of a plan to its topics and to the runner's hooks, and checks its temporal formulas.
    pub fn new(plan: &'p CampaignPlan, wires: &WireTable, hooks: &[HookEntry]) -> Result<Self, MetricError> {
        let mut found = Vec::with_capacity(plan.metrics.len());
        let mut taps = vec![Vec::new(); wires.len()];
        let mut delivered = vec![Vec::new(); wires.len()];
        for (at, metric) in plan.metrics.iter().enumerate() {
            let topics: Vec<TopicId> = match &metric.source {
                MetricSource::Hook { topics } => topics.clone(),
                MetricSource::FuzzingTime | MetricSource::Monitor { .. } => Vec::new(),
                MetricSource::Last { input } => vec![input.topic],
                MetricSource::Robustness { robustness: Robustness { inputs, .. } }
                | MetricSource::Formula { formula: Formula { inputs, .. } } => {
                    inputs.iter().map(|input| input.field.topic).collect()
                }
            };
            let outbound = match &metric.source {
                MetricSource::Robustness { robustness } => robustness.side == Side::Outbound,
                MetricSource::Formula { formula } => formula.side == Side::Outbound,
                _ => false,
            };
            if let MetricSource::Formula { formula } = &metric.source {
                let each = formula.inputs.iter().filter(|input| input.members == Members::Each);
                let mut sizes = each.map(|input| plan.topic(input.field.topic).paths.len());
                if sizes.next().is_some_and(|first| sizes.any(|size| size != first)) {
                    return Err(MetricError::UnpairedMembers(metric.name.clone()));
                }
            }
            if let MetricSource::Robustness { robustness } = &metric.source {
                let refused = |error| MetricError::Formula { metric: metric.name.clone(), error };
                RobustnessState::new(robustness, plan).map_err(refused)?;
            }
            for wire in wires.iter() {
                let input = topics.iter().position(|&topic| topic == wires.topic(wire));
                if outbound {
                    delivered[wire.index()].extend(input.map(|_| at));
                    continue;
                }
                taps[wire.index()].extend(input.map(|input| (at, input)));
            }
            found.push(match metric.source {
                MetricSource::Hook { .. } => {
                    let entry = hooks.iter().find(|hook| hook.metric == metric.name);
                    Some(*entry.ok_or_else(|| MetricError::MissingHook(metric.name.clone()))?)
                }
                _ => None,
            });
        }
        let mut members = vec![0; plan.topics.len()];
        let wires = wires.iter().map(|wire| {
            let topic = wires.topic(wire);
            let member = members[topic.index()];
            members[topic.index()] += 1;
            (Text::from(wires.path(wire)), topic, member)
        });
        let network = (!plan.monitors.is_empty()).then(|| Network::new(&plan.monitors));
        let network = network.transpose().map_err(MetricError::Monitors)?.map(Arc::new);
        Ok(MetricTable { plan, hooks: found, taps, delivered, wires: wires.collect(), network })
    }

    /// Fresh metrics for one run.
    pub fn start(&self) -> Metrics<'_> {
        let states: Vec<State<'_>> = self
            .hooks
            .iter()
            .zip(&self.plan.metrics)
            .map(|(hook, metric)| State {
                hook: hook.map(|hook| (hook.build)()),
                formula: match &metric.source {
                    MetricSource::Formula { formula } => Some(FormulaState::new(formula, self.plan)),
                    _ => None,
                },
                robustness: match &metric.source {
                    MetricSource::Robustness { robustness } => Some(
                        RobustnessState::new(robustness, self.plan)
                            .expect("the table was made of formulas that are sound"),
                    ),
                    _ => None,
                },
                context: Context { trend: metric.trend, ..Context::default() },
                waits: false,
                ended: false,
                unknown: false,
            })
            .collect();
        let timed = states.iter().enumerate().filter(|(_, state)| state.is_timed()).map(|(at, _)| at).collect();
        Metrics { table: self, states, now: SimTime::ZERO, waiting: Vec::new(), timed, timed_until: None }
    }
}

/// The metrics of one run.
pub struct Metrics<'p> {
    table: &'p MetricTable<'p>,
    states: Vec<State<'p>>,
    /// The latest time.
    now: SimTime,
    /// The metrics whose formulas wait for the end of the current instant.
    waiting: Vec<usize>,
    /// The metrics whose formulas are evaluated at the end of every instant.
    timed: Vec<usize>,
    /// The last instant of which they were.
    timed_until: Option<SimTime>,
}

struct State<'p> {
    hook: Option<Box<dyn Hook>>,
    formula: Option<FormulaState<'p>>,
    robustness: Option<RobustnessState<'p>>,
    context: Context,
    /// Whether it is among those that wait.
    waits: bool,
    /// Whether it knows the end of the run.
    ended: bool,
    /// Whether it has no value for conditions although it had one.
    unknown: bool,
}

/// What a score of a monitor is at a moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Shown {
    /// This value, from this moment on.
    Value(f64),
    /// This value at this moment, and another one later: it grows with time, and its series has only the ends of that.
    Growing(f64),
    /// Nobody knows. The metric keeps its value, but conditions have none.
    Unknown,
    /// There is nothing of which it could be the score.
    Nothing,
}

impl State<'_> {
    fn is_timed(&self) -> bool {
        self.formula.as_ref().is_some_and(FormulaState::is_timed)
            || self.robustness.as_ref().is_some_and(RobustnessState::is_timed)
    }
}

impl<'p> Metrics<'p> {
    /// The plan whose metrics these are.
    pub(crate) fn plan(&self) -> &'p CampaignPlan {
        self.table.plan
    }

    /// The monitors of the plan, if it has any.
    pub(crate) fn network(&self) -> Option<&'p Arc<Network>> {
        self.table.network.as_ref()
    }
}

impl Metrics<'_> {
    /// Tells the hooks that the run begins.
    pub fn begin(&mut self) {
        for State { hook, context, .. } in &mut self.states {
            if let Some(hook) = hook {
                hook.on_start(context);
            }
        }
    }

    /// Simulation time is `now` from here on: all messages of earlier instants are known, and formulas over several
    /// topics have their values of those instants, also for conditions. A message includes this call; call it before
    /// conditions are evaluated, and when time passes without a message.
    pub fn advance_to(&mut self, now: SimTime) {
        if now > self.now {
            self.settle();
            self.now = now;
        }
    }

    /// Whether a formula waits for the end of the current instant.
    pub(crate) fn is_waiting(&self) -> bool {
        !self.waiting.is_empty()
    }

    /// The current instant is over: all its messages are known. Returns whether a formula waited for that.
    pub fn settle(&mut self) -> bool {
        let waited = !self.waiting.is_empty();
        // The time right after an instant, at which its values switch operations, still belongs to it.
        if self.timed_until.is_none_or(|last| self.now > last + TICK) {
            self.timed_until = Some(self.now);
            self.wake_timed();
        }
        for at in self.waiting.drain(..) {
            let State { formula, context, waits, .. } = &mut self.states[at];
            *waits = false;
            context.now = self.now;
            if let Some(formula) = formula {
                formula.settle(context);
            }
        }
        waited
    }

    /// Lets those metrics wait that change while time passes.
    fn wake_timed(&mut self) {
        for &at in &self.timed {
            let State { robustness, context, waits, .. } = &mut self.states[at];
            if let Some(robustness) = robustness {
                context.now = self.now;
                robustness.tick(context);
            } else if !std::mem::replace(waits, true) {
                self.waiting.push(at);
            }
        }
    }

    /// Tells hooks and formulas that the run has ended. This is not called after a failure.
    pub fn end(&mut self, now: SimTime) {
        self.advance_to(now);
        self.settle();
        for State { hook, formula, robustness, context, ended, .. } in &mut self.states {
            context.now = now;
            if let Some(formula) = formula {
                formula.end(context);
            }
            if let Some(robustness) = robustness {
                robustness.end(context);
            }
            if let Some(hook) = hook {
                hook.on_end(context);
            }
            *ended = true;
        }
    }

    /// A message, as the simulator sent it.
    pub fn message(&mut self, now: SimTime, wire: Wire, value: &Value) {
        self.advance_to(now);
        for &(at, input) in &self.table.taps[wire.index()] {
            let State { hook, formula, robustness, context, waits, .. } = &mut self.states[at];
            if let Some(robustness) = robustness {
                let (path, topic, member) = &self.table.wires[wire.index()];
                context.now = now;
                context.topic.clone_from(path);
                robustness.message(*topic, *member, value, context);
                continue;
            }
            let (path, topic, member) = &self.table.wires[wire.index()];
            context.now = now;
            context.topic.clone_from(path);
            match (&self.table.plan.metrics[at].source, hook, formula) {
                (MetricSource::Hook { .. }, Some(hook), _) => {
                    let accepts = self.table.plan.metrics[at].accepts_not_finite || context.not_finite.is_some();
                    if !accepts && !value.is_finite() {
                        context.read_not_finite();
                    }
                    hook.on_message(input, value, context);
                }
                (MetricSource::Formula { .. }, _, Some(formula)) => {
                    let wait = formula.message(*topic, *member, value, context);
                    if wait && !std::mem::replace(waits, true) {
                        self.waiting.push(at);
                    }
                }
                (MetricSource::Last { input }, ..) => match value.number_at(&input.path) {
                    Some(number) if number.is_finite() => context.set(number),
                    Some(_) => context.read_not_finite(),
                    None => context.note(format!(
                        "a message on `{}` has no number `{}`",
                        context.topic,
                        input.path.join(".")
                    )),
                },
                _ => {}
            }
        }
    }

    /// The value of a metric for conditions at this moment: its last one, or its initial one before that. The relay
    /// knows the fuzzing time so far, in seconds.
    pub fn value(&self, metric: MetricId, fuzzing_time: f64) -> Option<f64> {
        let declared = self.table.plan.metric(metric);
        if matches!(declared.source, MetricSource::FuzzingTime) {
            return Some(fuzzing_time);
        }
        let State { context, unknown, .. } = &self.states[metric.index()];
        if *unknown && context.value.is_some() { None } else { context.value.or(declared.initial) }
    }

    /// The value that a metric was set to last.
    pub(crate) fn set_value(&self, metric: MetricId) -> Option<f64> {
        self.states[metric.index()].context.value
    }

    /// Says what a score of a monitor is now.
    pub(crate) fn score(&mut self, metric: MetricId, now: SimTime, shown: Shown) {
        let State { context, unknown, .. } = &mut self.states[metric.index()];
        *unknown = shown == Shown::Unknown;
        match shown {
            Shown::Value(value) => {
                // Since then it may have grown.
                context.value = context.series.last().map(|point| point.1);
                context.now = now;
                context.set(value);
            }
            Shown::Growing(value) => context.value = Some(value),
            Shown::Unknown | Shown::Nothing => {}
        }
    }

    /// Whether messages of this wire, as they are published or as they are delivered, may change this metric.
    pub(crate) fn hears(&self, metric: MetricId, wire: Wire, side: Side) -> bool {
        let at = metric.index();
        match side {
            Side::Inbound => self.table.taps[wire.index()].iter().any(|&(tapping, _)| tapping == at),
            Side::Outbound => self.table.delivered[wire.index()].contains(&at),
        }
    }

    /// Whether a metric reads this wire's messages as they are delivered.
    pub(crate) fn delivers(&self, wire: Wire) -> bool {
        !self.table.delivered[wire.index()].is_empty()
    }

    /// A message as it is delivered.
    pub fn delivery(&mut self, now: SimTime, wire: Wire, value: &Value) {
        self.advance_to(now);
        for &at in &self.table.delivered[wire.index()] {
            let State { formula, robustness, context, waits, .. } = &mut self.states[at];
            let (path, topic, member) = &self.table.wires[wire.index()];
            context.now = now;
            context.topic.clone_from(path);
            if let Some(formula) = formula
                && formula.message(*topic, *member, value, context)
                && !std::mem::replace(waits, true)
            {
                self.waiting.push(at);
            }
            if let Some(robustness) = robustness {
                robustness.message(*topic, *member, value, context);
            }
        }
    }

    /// The result of the run, as far as it went, and warnings for the user, one line per metric. A metric that was
    /// never set takes its default; one whose hook is not implemented has no value. No hook is called any more.
    ///
    /// `busy` has the intervals in which each operation that counts in `fuzzing_time()` was active or held messages
    /// back.
    pub fn finish(mut self, busy: &[Span]) -> (Vec<MetricObservation>, Vec<String>) {
        let mut warnings = Vec::new();
        let mut observations = Vec::with_capacity(self.states.len());
        let requirements = &self.table.plan.requirements;
        for (at, (state, metric)) in self.states.iter_mut().zip(&self.table.plan.metrics).enumerate() {
            let context = &mut state.context;
            if let Some(robustness) = &mut state.robustness {
                robustness.break_off(self.now, context);
            }
            if matches!(metric.source, MetricSource::FuzzingTime) {
                for (time, total) in fuzzing_time(busy) {
                    context.now = time;
                    context.set(total.seconds());
                }
            }
            warnings.extend(context.problem.take().map(|problem| format!("metric `{}`: {problem}", metric.name)));
            let set = context.value.is_some();
            let value = if context.unimplemented { None } else { context.value.or(metric.default) };
            let set = set && value.is_some();
            let reach = match (&state.robustness, &state.formula) {
                _ if context.unimplemented => Reach::ANY,
                _ if state.ended && context.not_finite.is_none() => Reach::of_whole_run(value),
                (Some(robustness), _) => robustness.reach(metric.default),
                (_, Some(formula)) => context.onwards(formula.certain(context)),
                _ => context.onwards(context.not_finite.map_or(context.value, |(_, before)| before)),
            };
            observations.push(MetricObservation {
                value,
                set,
                reach,
                not_finite: context.not_finite.map(|(time, _)| time.seconds()),
                series: std::mem::take(&mut context.series),
                robustness: state.robustness.as_mut().map_or_else(Vec::new, |robustness| {
                    let bounds = requirements.iter().filter(|requirement| requirement.metric.index() == at);
                    let bounds = bounds.flat_map(|requirement| {
                        let (low, _, high, _) = ends(requirement.bound);
                        [low, high].into_iter().flatten()
                    });
                    robustness.signal(&bounds.collect::<Vec<f64>>())
                }),
            });
        }
        (observations, warnings)
    }
}

/// The fuzzing time so far, at the end of each interval. It is summed in whole nanoseconds, so tests with equal fuzzing
/// times have equal values, wherever their intervals are.
fn fuzzing_time(busy: &[Span]) -> Vec<(SimTime, SimTime)> {
    let mut intervals: Vec<(SimTime, SimTime)> =
        busy.iter().map(|span| (SimTime::from_seconds(span.start), SimTime::from_seconds(span.end))).collect();
    intervals.sort_by_key(|&(_, end)| end);
    let mut total = SimTime::ZERO;
    std::iter::once((SimTime::ZERO, total))
        .chain(intervals.into_iter().map(|(start, end)| {
            total = total + (end - start);
            (end, total)
        }))
        .collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The last of it, in seconds.
    fn total(intervals: &[(f64, f64)]) -> f64 {
        fuzzing_time(&spans(intervals)).last().unwrap().1.seconds()
    }

    fn spans(intervals: &[(f64, f64)]) -> Vec<Span> {
        intervals.iter().map(|&(start, end)| Span { start, end }).collect()
    }

    #[test]
    fn fuzzing_time_adds_up_over_operations_even_where_they_overlap() {
        let points = fuzzing_time(&spans(&[(1.0, 5.0), (6.0, 7.0), (2.0, 3.5)]));
        let points: Vec<(f64, f64)> = points.iter().map(|(time, total)| (time.seconds(), total.seconds())).collect();
        assert_eq!(points, [(0.0, 0.0), (3.5, 1.5), (5.0, 5.5), (7.0, 6.5)]);
    }

    proptest! {
        #[test]
        fn equal_activity_is_equal_fuzzing_time(
            mut intervals in prop::collection::vec((0i64..70_000_000_000, 0i64..9_000_000_000), 1..20),
            moved in prop::collection::vec(0i64..70_000_000_000, 20),
        ) {
            let seconds = |intervals: &[(i64, i64)]| {
                let of = |nanos| SimTime::from_nanos(nanos).seconds();
                intervals.iter().map(|&(start, length)| (of(start), of(start + length))).collect::<Vec<_>>()
            };
            let before = total(&seconds(&intervals));
            let nanos: i64 = intervals.iter().map(|(_, length)| length).sum();
            prop_assert_eq!(before, SimTime::from_nanos(nanos).seconds());
            for (interval, start) in intervals.iter_mut().zip(moved) {
                interval.0 = start;
            }
            prop_assert_eq!(total(&seconds(&intervals)), before);
        }
    }

    #[test]
    fn intervals_that_seconds_cannot_hold_exactly_add_up_all_the_same() {
        assert_ne!((0.3 - 0.2) + (0.6 - 0.5), 0.2, "floating point would tell them apart");
        assert_eq!(total(&[(0.2, 0.3), (0.5, 0.6)]), total(&[(0.0, 0.2)]));
    }
}
