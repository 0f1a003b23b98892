//! All metrics of one run: which messages they read, and their results.

use std::sync::Arc;

use sesame_base::observation::{Lost, MetricObservation, Reach};
use sesame_base::time::SimTime;
use sesame_base::verdict::{breaks, ends};
use sesame_monitor::{Invalid, Network};
use sesame_plan::condition::Operand;
use sesame_plan::{Bound, CampaignPlan, Members, MetricId, MetricSource, RequirementId, Side, Span, TopicId, Trend};

use crate::metric::aggregate::FormulaState;
use crate::metric::expression::{Given, Scene};
use crate::metric::robustness::RobustnessState;
use crate::metric::{Context, Hook, HookEntry};
use crate::relay::{beyond, reaching};
use crate::value::{Text, Value};
use crate::wire::{Wire, WireTable};
use sesame_stl::FormulaError;

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
    /// Simulation time of one step; `None` for a system that nobody steps.
    step: Option<SimTime>,
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
            let sources = metric.source.sources();
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
                RobustnessState::new(robustness, plan, false).map_err(refused)?;
            }
            for wire in wires.iter() {
                let (topic, member) = (wires.topic(wire), wires.member(wire));
                let input = sources.iter().position(|source| source.reads(topic, member));
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
        let wires = wires.iter().map(|wire| (Text::from(wires.path(wire)), wires.topic(wire), wires.member(wire)));
        let network = (!plan.monitors.is_empty()).then(|| Network::new(&plan.monitors));
        let network = network.transpose().map_err(MetricError::Monitors)?.map(Arc::new);
        Ok(MetricTable { plan, hooks: found, taps, delivered, wires: wires.collect(), network, step: step_of(plan) })
    }

    /// Fresh metrics for one run.
    pub fn start(&self) -> Metrics<'_> {
        let states: Vec<State<'_>> = (0..)
            .zip(&self.hooks)
            .zip(&self.plan.metrics)
            .map(|((at, hook), metric)| State {
                compared: bounds_on(self.plan, MetricId(at)).map(Operand::Number).collect(),
                hook: hook.map(|hook| (hook.build)(hook.metric)),
                formula: match &metric.source {
                    MetricSource::Formula { formula } => Some(FormulaState::new(formula, self.plan)),
                    _ => None,
                },
                robustness: match &metric.source {
                    MetricSource::Robustness { robustness } => Some(
                        RobustnessState::new(
                            robustness,
                            self.plan,
                            required_of(self.plan, MetricId(at)).next().is_some(),
                        )
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
        let timed = (0..states.len()).filter(|&at| states[at].is_timed()).collect();
        let changes = |state: &State<'_>| state.grows() || (self.step.is_none() && state.is_timed());
        let changing = (0..states.len()).filter(|&at| changes(&states[at])).collect();
        Metrics {
            table: self,
            now: SimTime::ZERO,
            waiting: Vec::new(),
            timed,
            stepped: None,
            changing,
            heard: None,
            states,
        }
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
    /// The metrics whose formulas change while time passes.
    timed: Vec<usize>,
    /// The last step at which they were evaluated.
    stepped: Option<SimTime>,
    /// The metrics whose values may change between messages and steps.
    changing: Vec<usize>,
    /// When the last message was heard, on whatever wire.
    heard: Option<SimTime>,
}

struct State<'p> {
    hook: Option<Box<dyn Hook>>,
    formula: Option<FormulaState<'p>>,
    robustness: Option<RobustnessState<'p>>,
    context: Context,
    /// What requirements and conditions compare its value with.
    compared: Vec<Operand>,
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

    /// Whether its value grows while time passes.
    fn grows(&self) -> bool {
        self.formula.as_ref().is_some_and(FormulaState::grows)
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

    /// The clock of the simulator's stamps showed so many seconds at time zero. Until this is known, it shows the
    /// simulation time.
    pub fn clock_at_zero(&mut self, seconds: f64) {
        self.states.iter_mut().for_each(|state| state.context.zero = seconds);
    }

    /// The test chose these values of parameters of the space. Until this is known, they have their usual ones.
    pub fn set_scene(&mut self, scene: &Arc<Scene>) {
        self.states.iter_mut().for_each(|state| state.context.scene = Arc::clone(scene));
    }

    /// The value of this metric is compared with this in conditions.
    pub(crate) fn compare(&mut self, metric: MetricId, with: Operand) {
        self.states[metric.index()].compared.push(with);
    }

    /// Simulation time is `now` from here on: all messages of earlier instants are known, and formulas over several
    /// topics have their values of those instants, also for conditions. A message includes this call; call it before
    /// conditions are evaluated, and when time passes without a message.
    #[inline]
    pub fn advance_to(&mut self, now: SimTime) {
        if now > self.now {
            self.settle();
            if !(self.timed.is_empty() && self.changing.is_empty()) {
                self.pass_to(now);
            }
            self.now = now;
        }
    }

    /// What happens while time passes without a message: steps, comparisons that change, and values that cross a number
    /// with which they are compared. Most runs have nothing of the kind, and do not pay for it with each message.
    #[inline(never)]
    fn pass_to(&mut self, now: SimTime) {
        loop {
            let step = self.next_step().filter(|&step| step < now);
            let Some(next) = step.into_iter().chain(self.next_change()).min().filter(|&next| next <= now) else {
                return;
            };
            let changing: Vec<usize> =
                self.changing.iter().copied().filter(|&at| self.next_change_of(at) == Some(next)).collect();
            self.now = next;
            for at in changing {
                let State { formula: Some(formula), context, .. } = &mut self.states[at] else { continue };
                context.now = next;
                if formula.is_timed() && self.table.step.is_none() {
                    formula.at_time(context);
                } else {
                    formula.grow(context);
                }
            }
            if step == Some(next) {
                self.settle();
            }
        }
    }

    /// The next step of the system that a formula sees.
    fn next_step(&self) -> Option<SimTime> {
        let step = self.table.step?.nanos();
        // Nothing is evaluated after the end that was planned.
        let end = SimTime::from_seconds(self.table.plan.campaign.end_after);
        let next = SimTime::from_nanos((self.now.nanos() / step + 1).saturating_mul(step));
        (!self.timed.is_empty() && next <= end).then_some(next)
    }

    /// The next moment at which, if nothing but time passes, the value of a metric crosses a number with which it is
    /// compared, or a comparison in its formula changes.
    #[inline]
    pub(crate) fn next_change(&self) -> Option<SimTime> {
        if self.changing.is_empty() { None } else { self.first_change() }
    }

    #[inline(never)]
    fn first_change(&self) -> Option<SimTime> {
        self.changing.iter().filter_map(|&at| self.next_change_of(at)).min()
    }

    fn next_change_of(&self, at: usize) -> Option<SimTime> {
        let State { formula, context, compared, .. } = &self.states[at];
        let formula = formula.as_ref()?;
        let numbers = || compared.iter().filter_map(|&with| self.number(with));
        let growth = if compared.is_empty() { None } else { formula.growth(self.now) };
        let grown = growth.filter(|&(_, pace)| pace > 0);
        let mark = grown.and_then(|(total, pace)| next_mark(numbers(), total, pace)).map(|after| self.now + after);
        if self.table.step.is_some() || !formula.is_timed() {
            return mark;
        }
        let given = Given { now: self.now, ..context.given() };
        let crossings = numbers().filter_map(|number| formula.next_crossing(number, context.value, given));
        mark.into_iter().chain(crossings).chain(formula.next_change(given)).min()
    }

    fn number(&self, with: Operand) -> Option<f64> {
        match with {
            Operand::Number(number) => Some(number),
            Operand::Variable(metric) => self.value(metric, 0.0),
        }
    }

    /// Whether a formula waits for the end of the current instant.
    pub(crate) fn is_waiting(&self) -> bool {
        !self.waiting.is_empty()
    }

    /// The current instant is over: all its messages are known. Returns whether a formula waited for that.
    pub fn settle(&mut self) -> bool {
        let mut waited = !self.waiting.is_empty();
        let is_step = || self.table.step.is_some_and(|step| self.now.nanos() % step.nanos() == 0);
        // A division for each message would be felt, so where nothing needs it there is none.
        if !self.timed.is_empty() && is_step() && self.stepped.replace(self.now) != Some(self.now) {
            waited = true;
            self.evaluate_timed();
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

    /// Evaluates the formulas that change while time passes.
    #[inline(never)]
    fn evaluate_timed(&mut self) {
        for &at in &self.timed {
            let State { formula, robustness, context, .. } = &mut self.states[at];
            context.now = self.now;
            if let Some(robustness) = robustness {
                robustness.tick(context);
            }
            if let Some(formula) = formula {
                formula.at_time(context);
            }
        }
    }

    /// Tells hooks and formulas that the run has ended. This is not called after a failure.
    pub fn end(&mut self, now: SimTime) {
        self.advance_to(now);
        self.settle();
        if self.table.step.is_none() {
            self.evaluate_timed();
        }
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
        self.heard = Some(now);
        let dense = self.table.step.is_none();
        for &(at, input) in &self.table.taps[wire.index()] {
            let State { hook, formula, robustness, context, waits, .. } = &mut self.states[at];
            if let Some(robustness) = robustness {
                let (path, topic, member) = &self.table.wires[wire.index()];
                context.now = now;
                context.topic.clone_from(path);
                if dense && robustness.is_timed() {
                    robustness.just_before(context);
                }
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
                    if dense && formula.is_timed() {
                        formula.just_before(context);
                    }
                    let wait = formula.message(*topic, *member, value, context);
                    if wait && !std::mem::replace(waits, true) {
                        self.waiting.push(at);
                    }
                }
                (MetricSource::Last { input }, ..) => match value.number_at(&input.path) {
                    Some(number) if number.is_finite() => context.set(number),
                    Some(_) => context.read_not_finite(),
                    None if self.table.plan.may_lack(input) => {}
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
        let State { context, formula, unknown, .. } = &self.states[metric.index()];
        let grown = formula.as_ref().and_then(|formula| formula.growth(self.now)).map(|(total, _)| total.seconds());
        if *unknown && context.value.is_some() { None } else { grown.or(context.value).or(declared.initial) }
    }

    /// How long the condition of a duration has held until now, and how many times as fast as time passes that grows;
    /// `None` of other metrics, and before it has begun.
    pub(crate) fn growth(&self, metric: MetricId) -> Option<(SimTime, i64)> {
        self.states[metric.index()].formula.as_ref()?.growth(self.now)
    }

    /// The value that a metric was set to last; after it has read a number that was not finite, as far as that is
    /// certain all the same.
    pub(crate) fn set_value(&self, metric: MetricId) -> Option<f64> {
        let State { context, formula, .. } = &self.states[metric.index()];
        match (context.not_finite, formula) {
            (None, _) => context.value,
            (Some(_), Some(formula)) => formula.certain(context),
            (Some((_, before)), None) => before,
        }
    }

    /// The only direction in which a metric changes, if that was declared and is true so far.
    pub(crate) fn trend(&self, metric: MetricId) -> Option<Trend> {
        let context = &self.states[metric.index()].context;
        context.trend.filter(|_| !context.turned)
    }

    /// Whether everything that a metric has read was finite.
    pub(crate) fn is_finite(&self, metric: MetricId) -> bool {
        self.states[metric.index()].context.not_finite.is_none()
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
        self.heard = Some(now);
        let dense = self.table.step.is_none();
        for &at in &self.table.delivered[wire.index()] {
            let State { formula, robustness, context, waits, .. } = &mut self.states[at];
            let (path, topic, member) = &self.table.wires[wire.index()];
            context.now = now;
            context.topic.clone_from(path);
            if let Some(formula) = formula {
                if dense && formula.is_timed() {
                    formula.just_before(context);
                }
                if formula.message(*topic, *member, value, context) && !std::mem::replace(waits, true) {
                    self.waiting.push(at);
                }
            }
            if let Some(robustness) = robustness {
                if dense && robustness.is_timed() {
                    robustness.just_before(context);
                }
                robustness.message(*topic, *member, value, context);
            }
        }
    }

    /// Nothing more will be heard. If the run has not ended, formulas learn that it broke off, and their values are
    /// those up to then. Another call changes nothing.
    pub(crate) fn break_off(&mut self) {
        let observed = self.observed();
        for state in &mut self.states {
            let context = &mut state.context;
            if let Some(robustness) = &mut state.robustness {
                robustness.break_off(self.now, context);
            }
            if let Some(formula) = state.formula.as_mut().filter(|_| !state.ended) {
                context.now = self.now;
                formula.break_off(state.waits, observed, context);
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
        self.break_off();
        for (at, (state, metric)) in (0..).zip(self.states.iter_mut().zip(&self.table.plan.metrics)) {
            let context = &mut state.context;
            let bounds: Vec<f64> = bounds_on(self.table.plan, MetricId(at)).collect();
            if matches!(metric.source, MetricSource::FuzzingTime) {
                for (time, total) in fuzzing_time(busy, &bounds) {
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
                // Its default stands for no moment of the run, and decides nothing.
                (Some(_), _) if !set && state.ended => Reach::ANY,
                _ if state.ended && context.not_finite.is_none() => Reach::of_whole_run(value),
                (Some(robustness), _) => robustness.reach(),
                (_, Some(formula)) => context.onwards(formula.certain(context)),
                _ => context.onwards(context.not_finite.map_or(context.value, |(_, before)| before)),
            };
            let lost = state.robustness.as_ref().map_or_else(Vec::new, |robustness| {
                let violated = required_of(self.table.plan, MetricId(at)).filter(|(_, bound)| breaks(*bound, reach));
                let lost = violated.filter_map(|(requirement, bound)| Some((requirement, robustness.lost(bound)?)));
                lost.map(|(requirement, at)| Lost { requirement, at: at.seconds() }).collect()
            });
            observations.push(MetricObservation {
                value,
                set,
                reach,
                not_finite: context.not_finite.map(|(time, _)| time.seconds()),
                series: std::mem::take(&mut context.series),
                robustness: state.robustness.as_mut().map_or_else(Vec::new, |robustness| robustness.signal(&bounds)),
                lost,
            });
        }
        (observations, warnings)
    }
}

impl Metrics<'_> {
    /// The last instant that was observed. In a system that is stepped, it is the present one, whoever spoke in it:
    /// what was heard last holds until then. Elsewhere it is that of the last message, since nobody knows when it
    /// stopped.
    fn observed(&self) -> SimTime {
        if self.table.step.is_some() { self.now } else { self.heard.unwrap_or(SimTime::ZERO) }
    }
}

/// Simulation time of one step of a system that is stepped.
fn step_of(plan: &CampaignPlan) -> Option<SimTime> {
    let step = plan.simulator.step_ns()?;
    i64::try_from(step).ok().filter(|&step| step > 0).map(SimTime::from_nanos)
}

/// The requirements on a metric, with their bounds, in order of declaration.
fn required_of(plan: &CampaignPlan, metric: MetricId) -> impl Iterator<Item = (RequirementId, Bound)> {
    let requirements = (0..).map(RequirementId).zip(&plan.requirements);
    let requirements = requirements.filter(move |(_, requirement)| requirement.metric == metric);
    requirements.map(|(id, requirement)| (id, requirement.bound))
}

/// The ends of the bounds of requirements on a metric.
fn bounds_on(plan: &CampaignPlan, metric: MetricId) -> impl Iterator<Item = f64> {
    required_of(plan, metric).flat_map(|(_, bound)| {
        let (low, _, high, _) = ends(bound);
        [low, high].into_iter().flatten()
    })
}

/// After how long a total that grows so many times as fast as time passes reaches one of these numbers of seconds, or
/// exceeds it, whichever is next: the least number of nanoseconds after which it has added up enough.
pub(crate) fn next_mark(numbers: impl Iterator<Item = f64>, total: SimTime, pace: i64) -> Option<SimTime> {
    let total = total.nanos();
    let marks = numbers.flat_map(|number| [reaching(number), beyond(number)]).filter(|&mark| mark > total);
    marks.min().map(|mark| SimTime::from_nanos((mark - total - 1) / pace + 1))
}

/// The fuzzing time so far, at the end of each interval and where it reaches one of these numbers of seconds or exceeds
/// it. It is summed in whole nanoseconds, so tests with equal fuzzing times have equal values, wherever their intervals
/// are.
fn fuzzing_time(busy: &[Span], numbers: &[f64]) -> Vec<(SimTime, SimTime)> {
    let edges = busy.iter().flat_map(|span| [(span.start, 1), (span.end, -1)]);
    let mut edges: Vec<(SimTime, i64)> = edges.map(|(time, edge)| (SimTime::from_seconds(time), edge)).collect();
    edges.sort_unstable();
    let (mut now, mut total, mut pace) = (SimTime::ZERO, SimTime::ZERO, 0);
    let mut points = vec![(now, total)];
    for (time, edge) in edges {
        while pace > 0
            && let Some(after) = next_mark(numbers.iter().copied(), total, pace).filter(|&after| now + after <= time)
        {
            (now, total) = (now + after, total + SimTime::from_nanos(pace * after.nanos()));
            points.push((now, total));
        }
        total = total + SimTime::from_nanos(pace * (time - now).nanos());
        (now, pace) = (time, pace + edge);
        if edge < 0 {
            points.push((now, total));
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The last of it, in seconds.
    fn total(intervals: &[(f64, f64)]) -> f64 {
        fuzzing_time(&spans(intervals), &[]).last().unwrap().1.seconds()
    }

    fn spans(intervals: &[(f64, f64)]) -> Vec<Span> {
        intervals.iter().map(|&(start, end)| Span { start, end }).collect()
    }

    #[test]
    fn fuzzing_time_adds_up_over_operations_even_where_they_overlap() {
        let points = fuzzing_time(&spans(&[(1.0, 5.0), (6.0, 7.0), (2.0, 3.5)]), &[]);
        let points: Vec<(f64, f64)> = points.iter().map(|(time, total)| (time.seconds(), total.seconds())).collect();
        assert_eq!(points, [(0.0, 0.0), (3.5, 4.0), (5.0, 5.5), (7.0, 6.5)]);
        let points = super::fuzzing_time(&spans(&[(1.0, 5.0), (2.0, 3.5)]), &[2.0]);
        let near: Vec<(i64, i64)> = points.iter().map(|(time, total)| (time.nanos(), total.nanos())).collect();
        assert_eq!(near[1..3], [(2_500_000_000, 2_000_000_000), (2_500_000_001, 2_000_000_002)], "and at the bound");
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
