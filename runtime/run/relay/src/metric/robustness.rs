//! Metrics that are the robustness of a temporal formula: a monitor gets the held values of its signals, and gives its
//! result at the end of the run.

use sesame_base::activation::TICK;
use sesame_base::observation::Reach;
use sesame_base::robustness::quantifier;
use sesame_base::time::SimTime;
use sesame_base::verdict::breaks;
use sesame_plan::stl::Robustness;
use sesame_plan::{Bound, CampaignPlan, Expression, Members, TopicId};

use crate::metric::Context;
use crate::metric::aggregate::{each_of, pairs_of};
use crate::metric::attendance::Attendance;
use crate::metric::expression::{Moment, least, number};
use crate::metric::held::{HeardValues, HeldInputs, Optional, Read, hear};
use crate::metric::memory::Memories;
use crate::value::Value;
use sesame_stl::{FormulaError, Monitor, Signal};

/// A robustness in one run.
pub(super) struct RobustnessState<'p> {
    robustness: &'p Robustness,
    /// One for each member of the groups, or each pair of the group, of which each has a formula of its own; one for a
    /// formula without.
    instances: Vec<Instance>,
    /// When the last message came, and when the last one of an earlier instant did.
    last: SimTime,
    previous: SimTime,
    /// Once the run is over: its last instant.
    end: SimTime,
    attendance: Attendance,
    heard: HeardValues,
    optional: Optional,
    memories: Memories,
    /// A monitor without samples, to find out when a requirement was lost; `None` where nothing is required of it.
    fresh: Option<Monitor>,
}

struct Instance {
    /// The member that it is of, twice, or the pair.
    of: (usize, usize),
    held: HeldInputs,
    /// When its signals were evaluated last.
    pushed: SimTime,
    /// `None` once the run is over, or a number was not finite: then there is an outcome.
    monitor: Option<Monitor>,
    /// `None` as long as there is a monitor, and if the formula was never evaluated.
    said: Option<Said>,
    /// The robustness with its signal, where the trace had begun.
    signal: Option<(f64, Signal)>,
    /// What the monitor got, without repetitions of a value, where something is required of it.
    samples: Samples,
    /// Nothing is known of its signals from then on; `None` as long as there is a monitor.
    unknown_from: Option<SimTime>,
}

/// The samples of a monitor, in the order of their times.
#[derive(Default)]
struct Samples {
    /// Time, signal, value.
    all: Vec<(SimTime, usize, f64)>,
    /// The last value of each signal.
    last: Vec<Option<f64>>,
}

impl Samples {
    fn push(&mut self, time: SimTime, signal: usize, value: f64) {
        if self.last.len() <= signal {
            self.last.resize(signal + 1, None);
        }
        if self.last[signal].replace(value) != Some(value) {
            self.all.push((time, signal, value));
        }
    }

    /// Gives a monitor those from the `from`th on, up to a time and that time included. Returns how many it then has.
    fn give(&self, monitor: &mut Monitor, from: usize, until: SimTime) -> usize {
        let new = self.all[from..].iter().take_while(|sample| sample.0 <= until);
        new.fold(from, |given, &(time, signal, value)| {
            monitor.push(time, signal, value);
            given + 1
        })
    }
}

/// The outcome of one monitor.
#[derive(Clone, Copy)]
struct Said {
    /// The robustness of the trace so far; `None` if the trace had not begun.
    robustness: Option<f64>,
    /// The least and the greatest robustness that the whole run may have.
    reach: (f64, f64),
}

impl Instance {
    /// Gives the monitor the values of the signals at the context's time, once there are values.
    fn push(&mut self, signals: &[Expression], kept: bool, context: &mut Context) {
        let (Some(values), Some(monitor)) = (self.held.values(), &mut self.monitor) else { return };
        self.pushed = context.now;
        for (at, signal) in signals.iter().enumerate() {
            let moment = Moment::new(values, context.given());
            let (value, undefined) = (number(signal, &moment), moment.undefined());
            // As with other formulas: if arithmetic gives no number, the last value stays.
            if value.is_finite() {
                monitor.push(context.now, at, value);
                if kept {
                    self.samples.push(context.now, at, value);
                }
            }
            if let Some(undefined) = undefined {
                context.note(format!("{undefined} at {}", context.now));
            } else if !value.is_finite() {
                context.note(format!("refused the value {value} at {}", context.now));
            }
        }
    }

    /// Nothing is known from `now` on: the trace is evaluated up to the `last` message before, or to a later one of its
    /// own.
    fn break_off(&mut self, now: SimTime, last: SimTime) {
        if let Some(monitor) = self.monitor.take() {
            let reach = monitor.reach(now);
            self.unknown_from = Some(now);
            self.signal = monitor.finish_with_signal(last.max(self.pushed));
            self.said = Some(Said { robustness: self.signal.as_ref().map(|signal| signal.0), reach });
        }
    }
}

impl<'p> RobustnessState<'p> {
    /// Before the first message. Fails for a formula that the generator never writes. If something is `required` of it,
    /// it can tell [when that was lost](RobustnessState::lost).
    pub(super) fn new(robustness: &'p Robustness, plan: &CampaignPlan, required: bool) -> Result<Self, FormulaError> {
        let fresh = Monitor::new(&robustness.formula, robustness.signals.len())?;
        let fresh = if robustness.whole_windows { fresh.over_whole_windows() } else { fresh };
        let monitor = fresh.clone().keeping_its_signal();
        let each = robustness.inputs.iter().find(|input| input.members == Members::Each).map(|input| input.field.topic);
        let instance = |of: (usize, usize)| Instance {
            of,
            held: HeldInputs::of_one(&robustness.inputs, plan),
            pushed: SimTime::ZERO,
            monitor: Some(monitor.clone()),
            said: None,
            signal: None,
            samples: Samples::default(),
            unknown_from: None,
        };
        let mut instances: Vec<Instance> = pairs_of(&robustness.inputs, plan).map(instance).collect();
        if instances.is_empty() {
            let members = each.map_or(vec![0], |topic| each_of(&robustness.inputs, topic, plan));
            instances = members.into_iter().map(|member| instance((member, member))).collect();
        }
        let attendance = Attendance::new(&robustness.inputs, plan);
        Ok(RobustnessState {
            robustness,
            instances,
            last: SimTime::ZERO,
            previous: SimTime::ZERO,
            end: SimTime::ZERO,
            attendance,
            heard: HeardValues::default(),
            optional: Optional::new(&robustness.inputs, plan),
            memories: Memories::new(&robustness.inputs, plan),
            fresh: required.then_some(fresh),
        })
    }

    /// A message on the `member`th path of a topic, at the context's time.
    pub(super) fn message(&mut self, topic: TopicId, member: usize, value: &Value, context: &mut Context) {
        let Robustness { inputs, signals, .. } = self.robustness;
        let read = hear(inputs, &self.optional, (topic, member), value, &mut self.heard);
        if read == Ok(Read::Lacking) {
            return;
        }
        self.attendance.heard(context.now, topic, member);
        match read {
            Ok(Read::NotFinite) => context.read_not_finite(),
            Ok(_) => {}
            Err(lacking) => {
                context.note(format!("a message on `{}` has no value `{lacking}`", context.topic));
                return;
            }
        }
        if let Some(several) = self.heard.note(inputs) {
            context.note(format!("in a message on `{}`, {several}", context.topic));
        }
        self.memories.remember(&mut self.heard, member, context.now);
        if context.now > self.last {
            self.previous = std::mem::replace(&mut self.last, context.now);
        }
        for instance in &mut self.instances {
            let Instance { of, held, .. } = instance;
            // If each member or pair has a formula, values of all members go to all formulas, and those of one member
            // to its own.
            let mut finite = true;
            let mut concerned = false;
            for &(input, value) in self.heard.values() {
                let own = match inputs[input].members {
                    Members::Min | Members::Max | Members::Sum | Members::Only(_) => true,
                    Members::Each | Members::First => member == of.0,
                    Members::Second => member == of.1,
                };
                if own {
                    concerned = true;
                    finite &= value.iter().all(|x| x.is_finite());
                    held.hold_values(inputs, &[(input, value)], member);
                }
            }
            // What another member says tells nothing about this one.
            if !concerned {
                continue;
            }
            if !finite {
                // Another member may have spoken in this instant before.
                instance.break_off(context.now, self.previous);
                continue;
            }
            instance.push(signals, self.fresh.is_some(), context);
        }
    }

    /// Whether its signals change while time passes; then [`RobustnessState::tick`] is called for every instant.
    pub(super) fn is_timed(&self) -> bool {
        self.robustness.signals.iter().any(Expression::reads_time)
    }

    /// A message comes at the context's time, in a system without steps: what time has made of the signals until then.
    pub(super) fn just_before(&mut self, context: &mut Context) {
        let now = context.now;
        let before = SimTime::from_nanos(now.nanos() - TICK.nanos());
        if self.attendance.has_begun() && self.last < before {
            context.now = before;
            self.tick(context);
            context.now = now;
        }
    }

    /// The instant at the context's time is over, with a message or without.
    pub(super) fn tick(&mut self, context: &mut Context) {
        self.last = self.last.max(context.now);
        for instance in &mut self.instances {
            instance.push(&self.robustness.signals, self.fresh.is_some(), context);
        }
    }

    /// The run is over, at the context's time: sets the robustness.
    pub(super) fn end(&mut self, context: &mut Context) {
        let end = context.now.max(self.last);
        self.end = end;
        for instance in &mut self.instances {
            if let Some(monitor) = instance.monitor.take() {
                // A formula without a trace says nothing about the run.
                instance.signal = monitor.finish_with_signal(end);
                let robustness = instance.signal.as_ref().map(|signal| signal.0);
                instance.said = robustness.map(|value| Said { robustness, reach: (value, value) });
            }
        }
        self.set(context);
    }

    fn set(&self, context: &mut Context) {
        let robustness = self.instances.iter().filter_map(|instance| instance.said?.robustness).reduce(least);
        match robustness {
            Some(robustness) if robustness.is_finite() => context.set(robustness),
            Some(_) => context.note("the run ended before the formula says anything of it".to_owned()),
            None => {}
        }
    }

    /// The run broke off at `now`, without its end: it is evaluated up to its last message. Nothing is known of the
    /// instant of that, if it is not over, unless it is complete as far as can be told.
    pub(super) fn break_off(&mut self, now: SimTime, context: &mut Context) {
        if self.instances.iter().any(|instance| instance.monitor.is_some()) {
            let complete = self.attendance.is_complete();
            if complete && self.is_timed() {
                // Time has gone on for those that did not speak in this instant, too.
                context.now = self.last;
                self.tick(context);
            }
            let known = now.max(if complete { self.last + TICK } else { self.last });
            self.end = known;
            for instance in &mut self.instances {
                instance.break_off(known, self.last);
            }
            context.now = self.last;
            self.set(context);
        }
    }

    /// The signal once the run is over, in seconds. It is exact as to when it was beyond these values.
    pub(super) fn signal(&mut self, bounds: &[f64]) -> Vec<(f64, f64)> {
        let signals = self.instances.iter_mut().filter_map(|instance| instance.signal.take()).collect();
        Signal::of_least(signals, quantifier(&self.robustness.formula)).thinned(bounds)
    }

    /// The values that it may have at the end of the run, once the run is over.
    pub(super) fn reach(&self) -> Reach {
        let said = self.instances.iter().filter_map(|instance| instance.said);
        reach_of_least(&said.map(|said| said.reach).collect::<Vec<_>>())
    }

    /// Once the run is over: the first moment from which no continuation of the run could keep a bound that the run did
    /// not keep. `None` if there was none before the run ended, or nothing is required of it.
    pub(super) fn lost(&self, bound: Bound) -> Option<SimTime> {
        let fresh = self.fresh.as_ref()?;
        let all: Vec<&Instance> = self.instances.iter().filter(|instance| instance.said.is_some()).collect();
        // What was lost stays lost, so the moment is found by halving. The monitors have the samples up to the time
        // before the earliest moment that is possible.
        let mut behind: Vec<(Monitor, usize)> = all.iter().map(|_| (fresh.clone(), 0)).collect();
        let ahead = |behind: &[(Monitor, usize)], time: SimTime| -> Vec<(Monitor, usize)> {
            let mut ahead = behind.to_vec();
            for (instance, (monitor, given)) in all.iter().zip(&mut ahead) {
                *given = instance.samples.give(monitor, *given, time);
            }
            ahead
        };
        let is_lost = |monitors: &[(Monitor, usize)], time: SimTime| {
            let known = |instance: &Instance| instance.unknown_from.unwrap_or(SimTime::MAX).min(time + TICK);
            let reaches = all.iter().zip(monitors).map(|(instance, (monitor, _))| monitor.reach(known(instance)));
            breaks(bound, reach_of_least(&reaches.collect::<Vec<_>>()))
        };
        let first = all.iter().filter_map(|instance| instance.samples.all.first()).map(|sample| sample.0).min()?;
        let (mut low, mut high) = (first, self.end);
        if !is_lost(&ahead(&behind, high), high) {
            return None;
        }
        while low < high {
            let middle = SimTime::from_nanos(low.nanos() + (high.nanos() - low.nanos()) / 2);
            let monitors = ahead(&behind, middle);
            if is_lost(&monitors, middle) {
                high = middle;
            } else {
                behind = monitors;
                low = middle + TICK;
            }
        }
        Some(low)
    }
}

/// The values that the least of several robustnesses may have, from those that each may have.
fn reach_of_least(reaches: &[(f64, f64)]) -> Reach {
    let ends =
        |end: fn((f64, f64)) -> f64| reaches.iter().copied().map(end).reduce(least).filter(|end| end.is_finite());
    Reach { low: ends(|reach| reach.0), high: ends(|reach| reach.1) }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use sesame_base::observation::MetricObservation;
    use sesame_plan::stl::{Formula, Interval};
    use sesame_plan::testing::{plan, requirement};
    use sesame_plan::{Comparison, FieldRef, Input, MetricSource, Requirement, Side};

    use super::*;
    use crate::metric::MetricTable;
    use crate::value::{Fields, Record};
    use crate::wire::WireTable;

    /// A message: milliseconds, path, number.
    type Sent = (i64, usize, f64);

    const PATHS: [&str; 3] = ["arm/command", "zones/Z1", "zones/Z2"];

    fn payload(path: usize, number: f64) -> Value {
        match path {
            0 => Value::Real(number),
            _ => Record::new(&Fields::new(["level"]), vec![Value::Real(number)]).into(),
        }
    }

    fn command() -> Input {
        Input::new(FieldRef { topic: TopicId(0), path: Vec::new() }, Members::Min)
    }

    fn level(members: Members) -> Input {
        Input::new(FieldRef { topic: TopicId(1), path: vec!["level".into()] }, members)
    }

    fn above(signal: u32) -> Formula {
        Formula::Predicate { signal, comparison: Comparison::Above, constant: 0.0 }
    }

    fn always(of: Formula) -> Formula {
        Formula::Always { interval: Interval::UNBOUNDED, of: Box::new(of) }
    }

    fn eventually(from: f64, to: f64, of: Formula) -> Formula {
        Formula::Eventually { interval: Interval { from, to: Some(to) }, of: Box::new(of) }
    }

    /// The robustness of a formula the signals of which are the inputs.
    fn of(inputs: Vec<Input>, formula: Formula) -> Robustness {
        let signals = (0..inputs.len()).map(|at| Expression::Input(u32::try_from(at).unwrap()));
        Robustness { signals: signals.collect(), inputs, formula, side: Side::Inbound, whole_windows: false }
    }

    /// Value and warnings of a run that ends at this time in milliseconds, or breaks off after its last message.
    fn measured(robustness: Robustness, sent: &[Sent], end: Option<i64>) -> (Option<f64>, Vec<String>) {
        let (observed, warnings) = observed(robustness, sent, end);
        (observed.value, warnings)
    }

    fn observed(robustness: Robustness, sent: &[Sent], end: Option<i64>) -> (MetricObservation, Vec<String>) {
        observed_with(Vec::new(), robustness, sent, end)
    }

    /// The same with what is required of it.
    fn observed_with(
        required: Vec<Requirement>,
        robustness: Robustness,
        sent: &[Sent],
        end: Option<i64>,
    ) -> (MetricObservation, Vec<String>) {
        let mut plan = plan(Vec::new());
        plan.metrics.truncate(1);
        plan.metrics[0].source = MetricSource::Robustness { robustness };
        plan.requirements = required;
        let wires = WireTable::new(&plan);
        let table = MetricTable::new(&plan, &wires, &[]).unwrap();
        let mut metrics = table.start();
        metrics.begin();
        for &(time, path, number) in sent {
            let wire = wires.find(PATHS[path]).unwrap();
            metrics.message(SimTime::from_nanos(time * 1_000_000), wire, &payload(path, number));
        }
        if let Some(end) = end {
            metrics.end(SimTime::from_nanos(end * 1_000_000));
        }
        let (mut observed, warnings) = metrics.finish(&[]);
        (observed.remove(0), warnings)
    }

    fn value(robustness: Robustness, sent: &[Sent]) -> Option<f64> {
        measured(robustness, sent, Some(10_000)).0
    }

    fn value_at(robustness: Robustness, sent: &[Sent], end: i64) -> Option<f64> {
        measured(robustness, sent, Some(end)).0
    }

    #[test]
    fn a_signal_of_two_topics_jumps_once_where_both_do() {
        let apart = Expression::Sum(vec![Expression::Input(0), Expression::Negate(Box::new(Expression::Input(1)))]);
        let mut robustness = of(vec![command(), level(Members::Min)], always(above(0)));
        robustness.signals = vec![apart];
        // Between the two messages at 100 ms the difference is 1, for no time at all.
        let sent = [(0, 0, 9.0), (0, 1, 4.0), (100, 0, 5.0), (100, 1, -1.0)];
        assert_eq!(value(robustness, &sent), Some(5.0));
    }

    #[test]
    fn nothing_is_judged_before_every_topic_had_a_message() {
        let both = || {
            let both = Formula::And { left: Box::new(above(0)), right: Box::new(above(1)) };
            of(vec![command(), level(Members::Min)], always(both))
        };
        assert_eq!(value(both(), &[(0, 0, -9.0), (100, 0, 3.0), (200, 1, 7.0)]), Some(3.0));
        assert_eq!(value(both(), &[(0, 0, -9.0), (100, 0, 3.0)]), None);
    }

    #[test]
    fn the_signal_tells_when_a_robustness_was_lost() {
        let sent = [(0, 1, 4.0), (2_000, 1, -2.0), (3_000, 1, 1.0), (6_000, 1, -0.5)];
        let observed = |members, formula| observed(of(vec![level(members)], formula), &sent, Some(10_000)).0;
        let signal = observed(Members::Min, always(above(0))).robustness;
        assert_eq!(signal, [(0.0, 4.0), (2.0, -2.0), (3.0, 1.0), (6.0, -0.5), (10.0, -0.5)]);
        // A request without its answer counts from the request on.
        let soon = observed(Members::Min, always(eventually(0.0, 1.0, above(0)))).robustness;
        assert_eq!(soon.iter().copied().find(|point| point.1 < 0.0), Some((6.0, -0.5)));
    }

    #[test]
    fn the_signal_of_a_group_is_the_least_of_its_members() {
        let sent = [(0, 1, 4.0), (0, 2, 3.0), (2_000, 1, -2.0), (3_000, 1, 5.0), (4_000, 2, 1.0)];
        let each = of(vec![level(Members::Each)], always(above(0)));
        let signal = observed(each, &sent, Some(10_000)).0.robustness;
        assert_eq!(signal, [(0.0, 3.0), (2.0, -2.0), (3.0, 3.0), (4.0, 1.0), (10.0, 1.0)]);
    }

    #[test]
    fn a_group_is_its_minimum_or_each_member_has_a_formula_of_its_own() {
        let soon = |members| of(vec![level(members)], always(eventually(0.0, 1.0, above(0))));
        // Each zone is left by one of them at any time, but both are clear at one time only for a moment.
        let sent = [(0, 1, 4.0), (0, 2, -2.0), (5_000, 1, -3.0), (5_000, 2, 6.0), (9_900, 2, 1.0)];
        assert_eq!(value(soon(Members::Max), &sent), Some(1.0));
        assert_eq!(value(soon(Members::Min), &sent), Some(-3.0));
        assert_eq!(value(soon(Members::Each), &sent), Some(-3.0));
        let turns = [
            (0, 1, 4.0),
            (0, 2, -2.0),
            (500, 1, -3.0),
            (500, 2, 6.0),
            (1_000, 1, 4.0),
            (1_000, 2, -2.0),
            (1_500, 2, 6.0),
        ];
        assert_eq!(value(soon(Members::Min), &turns), Some(-2.0));
        assert_eq!(value(soon(Members::Each), &turns), Some(4.0));
    }

    #[test]
    fn a_run_that_breaks_off_is_judged_up_to_its_last_message() {
        let robustness = || of(vec![level(Members::Min)], always(above(0)));
        assert_eq!(measured(robustness(), &[(0, 1, 4.0), (100, 1, -2.0)], None).0, Some(-2.0));
        let answer = || of(vec![level(Members::Min)], eventually(2.0, 3.0, above(0)));
        assert_eq!(measured(answer(), &[(0, 1, 4.0), (2_000, 1, 1.0)], None).0, Some(1.0));
    }

    #[test]
    fn moments_whose_interval_lies_after_the_end_are_not_judged_and_a_default_decides_nothing() {
        let never: Vec<Sent> = (0..50).map(|tenth| (tenth * 100, 1, -5.0)).collect();
        let within = |from| of(vec![level(Members::Min)], always(eventually(from, 1.0, above(0))));
        for from in [0.0, 0.1] {
            assert_eq!(measured(within(from), &never, Some(5000)).0, Some(-5.0));
        }
        let granted: Vec<Sent> = (0..50).map(|tenth| (tenth * 100, 1, 1.0)).collect();
        assert_eq!(measured(within(0.1), &granted, Some(5000)).0, Some(1.0), "the last tenth asks for nothing");
        let late = observed(of(vec![level(Members::Min)], eventually(20.0, 30.0, above(0))), &granted, Some(5000)).0;
        assert_eq!((late.value, late.set, late.reach), (None, false, Reach::ANY));
    }

    #[test]
    fn what_the_run_was_too_short_for_is_not_set_and_said() {
        let late = of(vec![level(Members::Min)], eventually(20.0, 30.0, above(0)));
        let (value, warnings) = measured(late, &[(0, 1, 4.0)], Some(10_000));
        assert_eq!(value, None);
        assert_eq!(warnings, ["metric `fuzzing_time`: the run ended before the formula says anything of it"]);
    }

    #[test]
    fn from_a_value_that_is_not_finite_on_a_formula_is_judged_as_if_the_run_had_broken_off() {
        let robustness = |members| of(vec![level(members)], always(above(0)));
        let stream = [(0, 1, 4.0), (100, 1, f64::NAN), (200, 1, -3.0)];
        let gap = observed(robustness(Members::Min), &stream, Some(300)).0;
        assert_eq!((gap.value, gap.not_finite), (Some(4.0), Some(0.1)));
        assert_eq!(gap.reach, Reach { low: None, high: Some(4.0) });
        let violated = observed(robustness(Members::Min), &[(0, 1, -1.0), (100, 1, f64::NAN)], Some(300)).0;
        assert_eq!(violated.reach, Reach { low: None, high: Some(-1.0) });
        // The other member goes on.
        let stream = [(0, 1, 4.0), (0, 2, 5.0), (100, 1, f64::NAN), (200, 2, -3.0)];
        let each = observed(robustness(Members::Each), &stream, Some(300)).0;
        assert_eq!((each.value, each.reach), (Some(-3.0), Reach { low: None, high: Some(-3.0) }));
    }

    #[test]
    fn members_that_say_at_one_instant_what_is_not_finite_are_judged_alike() {
        let late = |members| of(vec![level(members)], eventually(1.0, 2.0, above(0)));
        let one = [(0, 1, 4.0), (500, 1, 5.0), (1_000, 1, f64::NAN)];
        let both = [(0, 1, 4.0), (0, 2, 4.0), (500, 1, 5.0), (500, 2, 5.0), (1_000, 1, f64::NAN), (1_000, 2, f64::NAN)];
        let value = |members, sent: &[Sent]| observed(late(members), sent, Some(3_000)).0.value;
        assert_eq!(value(Members::Each, &one), None, "up to the message before, nothing was asked for");
        assert_eq!(value(Members::Each, &both), None);
    }

    #[test]
    fn after_a_run_that_broke_off_the_reach_is_what_no_continuation_can_leave() {
        let reach = |formula, end| {
            observed(of(vec![level(Members::Min)], formula), &[(0, 1, 4.0), (100, 1, -2.0)], end).0.reach
        };
        assert_eq!(reach(always(above(0)), Some(300)), Reach::only(-2.0));
        assert_eq!(reach(always(above(0)), None), Reach { low: None, high: Some(-2.0) });
        assert_eq!(reach(eventually(0.0, 5.0, above(0)), None), Reach { low: Some(4.0), high: None });
        assert_eq!(reach(eventually(2.0, 5.0, above(0)), None), Reach::ANY);
    }

    /// When a run that ends at this time in milliseconds lost a bound on a robustness, in seconds.
    fn lost(robustness: Robustness, bound: Bound, sent: &[Sent], end: Option<i64>) -> Option<f64> {
        let required = vec![requirement("R1", 0, bound)];
        observed_with(required, robustness, sent, end).0.lost.first().map(|lost| lost.at)
    }

    #[test]
    fn a_requirement_is_lost_at_the_first_moment_from_which_nothing_could_satisfy_it() {
        let kept = Bound::AtLeast { value: 0.0 };
        let one = || vec![level(Members::Min)];
        let late = [(0, 1, -4.0), (70_000, 1, 3.0)];
        let within_a_minute = || of(one(), eventually(0.0, 60.0, above(0)));
        assert_eq!(lost(within_a_minute(), kept, &late, Some(90_000)), Some(60.0), "the deadline, not the end");
        assert_eq!(lost(within_a_minute(), kept, &late[..1], Some(90_000)), Some(60.0), "without any message there");
        assert_eq!(lost(within_a_minute(), kept, &late[..1], Some(30_000)), None, "it could come until the end");
        assert_eq!(lost(within_a_minute(), kept, &[(0, 1, -4.0), (50_000, 1, 3.0)], Some(90_000)), None);
        // A request that nobody grants is lost when its time is over, not when it is made.
        let granted = Formula::Implies { left: Box::new(above(0)), right: Box::new(eventually(0.0, 5.0, above(1))) };
        let granted = of(vec![command(), level(Members::Min)], always(granted));
        let sent = [(0, 0, -1.0), (0, 1, -1.0), (10_000, 0, 1.0), (11_000, 0, -1.0), (20_000, 1, 1.0)];
        assert_eq!(lost(granted.clone(), kept, &sent, Some(30_000)), Some(15.0));
        assert_eq!(lost(granted.clone(), kept, &sent[..4], None), None, "of a run that broke off nobody knows");
        assert_eq!(lost(granted, kept, &[&sent[..4], &[(17_000, 0, -1.0)]].concat(), None), Some(15.0));
        // The least of the members counts: one that is lost is enough, and for an upper bound all have to be.
        let each = of(vec![level(Members::Each)], always(above(0)));
        let sent = [(0, 1, 4.0), (0, 2, 5.0), (2_000, 2, -3.0), (3_000, 1, -1.0)];
        assert_eq!(lost(each, kept, &sent, Some(9_000)), Some(2.0));
        let each = of(vec![level(Members::Each)], eventually(0.0, 60.0, above(0)));
        let sent = [(0, 1, -4.0), (0, 2, -5.0), (2_000, 2, 3.0), (3_000, 1, 1.0)];
        assert_eq!(lost(each, Bound::AtMost { value: 0.0 }, &sent, Some(9_000)), Some(3.0));
    }

    #[test]
    fn a_formula_that_no_generator_writes_is_refused_before_any_run() {
        let mut plan = plan(Vec::new());
        let robustness = of(vec![command()], always(above(7)));
        plan.metrics[0].source = MetricSource::Robustness { robustness };
        let refused = MetricTable::new(&plan, &WireTable::new(&plan), &[]).err().unwrap().to_string();
        assert!(refused.starts_with("metric `fuzzing_time`: the formula names signal 7 of 1"), "{refused}");
    }

    /// By trying every moment at which anything can be decided, each with a monitor of its own: at whole milliseconds,
    /// and just before them. A signal has an old value up to a nanosecond before it changes, and a formula in a formula
    /// up to a nanosecond before that.
    fn lost_by_trying(robustness: &Robustness, bound: Bound, sent: &[Sent], end: i64) -> Option<f64> {
        // At least as deep as `formulas` nests them.
        const NESTED: i64 = 4;
        let millis = |millis: i64| SimTime::from_nanos(millis * 1_000_000);
        let first = |path: usize| sent.iter().find(|sent| sent.1 == path).map(|sent| sent.0);
        let start = first(0)?.max(first(1)?);
        let is_lost = |now: SimTime| {
            let mut monitor = Monitor::new(&robustness.formula, 2).unwrap();
            let mut last = [None, None];
            for &(time, path, number) in sent.iter().filter(|sent| millis(sent.0) <= now) {
                last[path] = Some(number);
                if let [Some(command), Some(level)] = last {
                    monitor.push(millis(time), 0, command);
                    monitor.push(millis(time), 1, level);
                }
            }
            breaks(bound, reach_of_least(&[monitor.reach(now + TICK)]))
        };
        let moments = (start..=end).flat_map(|at| (0..=NESTED).rev().map(move |before| (at, before)));
        let moments = moments.map(|(at, before)| SimTime::from_nanos(at * 1_000_000 - before));
        moments.filter(|now| *now >= millis(start)).find(|&now| is_lost(now)).map(SimTime::seconds)
    }

    /// Formulas over two signals; all ends of intervals are whole milliseconds.
    fn formulas() -> impl Strategy<Value = Formula> {
        let boxed = |formula: Formula| Box::new(formula);
        let predicate = (0..2u32).prop_map(above);
        predicate.prop_recursive(3, 8, 2, move |inner| {
            let interval = (0..20u8, prop::option::of(0..20u8)).prop_map(|(from, length)| {
                let millis = |millis: u8| f64::from(millis) / 1_000.0;
                Interval { from: millis(from), to: length.map(|length| millis(from + length)) }
            });
            prop_oneof![
                inner.clone().prop_map(move |of| Formula::Not { of: boxed(of) }),
                (inner.clone(), inner.clone())
                    .prop_map(move |(left, right)| Formula::And { left: boxed(left), right: boxed(right) }),
                (inner.clone(), inner.clone())
                    .prop_map(move |(left, right)| Formula::Implies { left: boxed(left), right: boxed(right) }),
                (interval.clone(), inner.clone())
                    .prop_map(move |(interval, of)| Formula::Always { interval, of: boxed(of) }),
                (interval.clone(), inner.clone())
                    .prop_map(move |(interval, of)| Formula::Eventually { interval, of: boxed(of) }),
                (interval, inner.clone(), inner).prop_map(move |(interval, left, right)| Formula::Until {
                    interval,
                    weak: false,
                    left: boxed(left),
                    right: boxed(right)
                }),
            ]
        })
    }

    proptest! {
        #[test]
        fn what_is_lost_is_lost_when_trying_every_moment_says_so(
            formula in formulas(),
            steps in proptest::collection::vec((0..12i64, 0..2usize, -3..4i32), 1..10),
            bound in prop_oneof![
                Just(Bound::AtLeast { value: 0.0 }), Just(Bound::Below { value: 1.0 }), Just(Bound::Equal { value: 1.0 })
            ],
        ) {
            let mut now = 0;
            let sent: Vec<Sent> = steps
                .into_iter()
                .map(|(step, path, number)| {
                    now += step;
                    (now, path, f64::from(number))
                })
                .collect();
            let robustness = of(vec![command(), level(Members::Min)], formula);
            let end = now + 30;
            let expected = lost_by_trying(&robustness, bound, &sent, end);
            let value = value_at(robustness.clone(), &sent, end);
            // A run that kept the bound lost nothing, and one of which nothing is known neither.
            prop_assert!(value.is_none_or(|value| !(bound.holds(value) && expected.is_some())));
            let expected = expected.filter(|_| value.is_some_and(|value| !bound.holds(value)));
            prop_assert_eq!(lost(robustness, bound, &sent, Some(end)), expected);
        }

        // With each message at a time of its own, the least over time is the least over messages.
        #[test]
        fn always_is_the_least_of_all_messages(
            steps in proptest::collection::vec((1..300i64, 1..3usize, -9..9i32), 1..30),
        ) {
            let mut now = 0;
            let sent: Vec<Sent> = steps
                .into_iter()
                .map(|(step, path, number)| {
                    now += step;
                    (now, path, f64::from(number))
                })
                .collect();
            let least = sent.iter().map(|sent| sent.2).reduce(f64::min);
            for members in [Members::Min, Members::Each] {
                prop_assert_eq!(value(of(vec![level(members)], always(above(0))), &sent), least);
            }
        }
    }
}
