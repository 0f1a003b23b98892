//! The relay: the man in the middle, for one run of one test.
//!
//! Sans-IO. Messages and time go in, deliveries come out; a transport passes messages and time to it and carries out
//! its deliveries. Within one event the order is: due releases, inbound metrics, conditions, operations (including on
//! the message that caused the event), outbound metrics, then delivery. A message on a wire on which no operation of
//! the test acts is passed on unchanged.
//!
//! Conditions are evaluated when a metric that they read may have changed: after the inbound metrics of a message and
//! before its operations, after a message has been delivered, and at the end of an instant, for values that are known
//! only then. They are also evaluated at edges, and when a time that grows reaches what it is compared with.
//! Evaluating the same values again changes nothing, so no message that a condition does not read, and no step of time,
//! switches an operation. A test without conditions has no cost for them.
//!
//! A change of a message is an effect only if its wire has a receiver: a subscriber, or an outbound metric. Changes on
//! other wires are counted separately.

mod altered;
mod beginning;
mod compensation;
mod course;
mod crossings;
mod exchange;
mod finished;
mod fuzzing_time;
mod listener;
mod monitors;
mod pass;
mod publishing;
mod release;
mod stage;
mod traffic;

use std::collections::{BTreeMap, BTreeSet};

use beginning::{Beginning, chosen};
use fuzzing_time::Read;
use publishing::Publishing;
use release::{Held, ReleaseQueue};
use stage::Stage;

use sesame_base::activation::{Activity, Edge, TICK};
use sesame_base::condition::holds;
use sesame_base::observation::Counters;
use sesame_base::time::SimTime;
use sesame_plan::condition::{Condition, Operand};
use sesame_plan::{CampaignPlan, Copies, Drain, MetricId, MetricSource, Moment, NodeId, Side, Test};

use crate::files::SpaceFiles;
use crate::fuzz::{ChoiceError, Disturbance, KeyedRng, OnWire, OperationEntry, Order, PerWire, Resource, RunContext};
use crate::metric::Metrics;
use crate::monitor::Monitors;
use crate::value::Value;
use crate::wire::{Wire, WireTable};

pub(crate) use altered::AlteredList;
pub(crate) use crossings::{beyond, reaching};
pub use exchange::{Delivery, Exchange};
pub use finished::Finished;
pub use listener::{Listener, MessageRef, OperationEvent};

/// The most copies that operations may make in one event; beyond it, no more are made, with a warning.
pub const COPIES_LIMIT: u32 = 10_000;

/// The most messages that monitors may publish in one event; beyond it, no more are sent, with a warning.
pub const PUBLISHED_LIMIT: usize = 1_000;

/// The relay of one run.
pub struct Relay<'a> {
    wires: &'a WireTable,
    /// The operations of the test, and behind them what compensates for a reality gap.
    operations: Vec<Stage>,
    /// Positions of the test's operations by priority, then declaration.
    order: Vec<usize>,
    /// Per wire: the stages a message passes, in order, with the wire as the operation counts it. The test's
    /// operations come first.
    pipelines: Vec<Vec<(usize, OnWire)>>,
    /// Per wire: how many stages of its pipeline are operations of the test. Behind them the message is delivered, as
    /// far as metrics and listeners are concerned: what compensates stands for the robots.
    disturbed_by: Vec<usize>,
    /// Per wire: messages published so far.
    published: Vec<u64>,
    traffic: traffic::Recorder,
    /// In a run without operations: what happens in it.
    course: Option<Box<course::Recorder>>,
    queue: ReleaseQueue,
    metrics: Metrics<'a>,
    /// `None` for a plan without monitors.
    monitors: Option<Monitors<'a>>,
    publishing: Publishing,
    /// Per wire: whether it has a receiver.
    heard: Vec<bool>,
    /// The wires that operations of the plan act on, whether or not this test contains them.
    acted_on: BTreeSet<Wire>,
    conditions: Conditions,
    /// The instant at hand.
    now: SimTime,
    phase: Phase,
    /// Whether the run has come to its end.
    ended: bool,
    messages: u64,
    overflowed: bool,
    /// Copies made in the event at hand.
    copies: u32,
    flooded: bool,
    /// What the transport has to do.
    orders: Vec<Order>,
    beginning: Beginning,
    /// The listeners besides the metrics.
    taps: Vec<&'a mut dyn Listener>,
}

/// How conditions switch operations.
struct Conditions {
    /// The operations that conditions switch.
    operations: Vec<usize>,
    /// The operations among them that have just become inactive; kept here so that an evaluation does not allocate.
    ended: Vec<usize>,
    /// Per wire: whether a condition reads a metric of its messages as they are published.
    read: Vec<bool>,
    /// Whether a condition reads a metric of messages as they are delivered, or a score of a monitor.
    reads_delivered: bool,
    /// Times that grow while nothing happens, each with what it is compared with.
    growing: Vec<(MetricId, Operand)>,
    /// Whether copies of one operation wait for each other.
    apart: bool,
}

/// The state of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// Nothing has happened, not even the edges at time zero.
    New,
    Running,
    /// Nothing is delivered any more.
    Over,
}

impl<'a> Relay<'a> {
    /// A relay for a test of this plan, at time zero.
    pub fn new(
        plan: &CampaignPlan,
        wires: &'a WireTable,
        test: &Test,
        mut metrics: Metrics<'a>,
        hooks: &[OperationEntry],
    ) -> Result<Self, ChoiceError> {
        let mut order: Vec<usize> = (0..test.operations.len()).collect();
        order.sort_by_key(|&at| {
            let id = test.operations[at].operation;
            (std::cmp::Reverse(plan.operation(id).priority), id, at)
        });
        let mut operations = Vec::with_capacity(test.operations.len());
        for choice in &test.operations {
            let operation = plan.operation(choice.operation);
            let disturbance = Disturbance::new(operation, choice, hooks)?;
            operations.push(Stage {
                operation: choice.operation,
                name: operation.name.clone(),
                from: operation.from.clone(),
                observes_inactive: disturbance.observes_inactive(),
                holds_order: disturbance.holds_order(),
                disturbance,
                activity: Activity::new(&choice.activation, operation.within),
                since: SimTime::ZERO,
                operation_seed: choice.operation_seed,
                messages: choice.messages.clone(),
                counts: operation.counts(&choice.parameters),
                counted: PerWire::default(),
                timed: operation.timed,
                tail_since: None,
                tails: Vec::new(),
                counters: Counters::default(),
                first_touch: None,
                last_touch: None,
                unheard: BTreeMap::new(),
            });
        }
        for stage in operations.iter_mut().filter(|stage| matches!(stage.disturbance, Disturbance::Scene(_))) {
            stage.counters.side_effects = 1;
        }
        let mut pipelines = vec![Vec::new(); wires.len_with_links()];
        for &at in &order {
            let used = &test.operations[at];
            let operation = plan.operation(used.operation);
            for (member, wire) in (0u64..).zip(wires.acted_on(operation)) {
                let Some((target, on)) = operation.target_on(wires.topic(wire)) else { continue };
                if operation.acts_on_member(on, wires.member(wire), &used.parameters) {
                    pipelines[wire.index()].push((at, OnWire { member, target }));
                }
            }
        }
        let conditional = (0..operations.len()).filter(|&at| operations[at].activity.is_conditional()).collect();
        let Read { variables, growing, formulas } = Read::by(plan, test);
        for (metric, with) in formulas {
            metrics.compare(metric, with);
        }
        let chosen = chosen(&operations);
        metrics.set_scene(&chosen);
        let reads = |wire, side| variables.iter().any(|&metric| metrics.hears(metric, wire, side));
        let is_score = |&metric: &MetricId| matches!(plan.metric(metric).source, MetricSource::Monitor { .. });
        let monitors = Monitors::new(&metrics, wires);
        let hears =
            |wire| metrics.delivers(wire) || monitors.as_ref().is_some_and(|monitors| monitors.hears_delivered(wire));
        Ok(Relay {
            wires,
            disturbed_by: pipelines.iter().map(Vec::len).collect(),
            beginning: Beginning::of(plan, &chosen),
            heard: wires.iter().map(hears).chain(wires.links().iter().map(|_| false)).collect(),
            acted_on: plan.operations.iter().flat_map(|operation| wires.acted_on(operation)).collect(),
            conditions: Conditions {
                ended: Vec::with_capacity(operations.len()),
                operations: conditional,
                read: wires.iter().map(|wire| reads(wire, Side::Inbound)).collect(),
                reads_delivered: wires.iter().any(|wire| reads(wire, Side::Outbound)) || variables.iter().any(is_score),
                growing,
                apart: plan.campaign.copies != Copies::MayOverlap,
            },
            phase: Phase::New,
            ended: false,
            operations,
            order,
            pipelines,
            published: vec![0; wires.len()],
            traffic: traffic::Recorder::new(plan, wires, test),
            course: course::Recorder::new(wires, course::read(plan, test)).map(Box::new),
            queue: ReleaseQueue::new(test.operations.len(), wires.len_with_links()),
            monitors,
            publishing: Publishing::default(),
            metrics,
            now: SimTime::ZERO,
            messages: 0,
            overflowed: false,
            copies: 0,
            flooded: false,
            orders: Vec::new(),
            taps: Vec::new(),
        })
    }

    /// Whether a condition holds now.
    pub fn holds(&self, condition: &Condition) -> bool {
        let fuzzing_time = self.fuzzing_time().seconds();
        holds(condition, &|metric| self.metrics.value(metric, fuzzing_time))
    }

    /// Adds a listener, which is told everything that happens from now on.
    pub fn tapped(mut self, listener: &'a mut dyn Listener) -> Self {
        self.taps.push(listener);
        self.monitors.iter_mut().for_each(Monitors::tell);
        self
    }

    /// The same relay with a simulator that subscribes to everything.
    #[cfg(test)]
    pub(crate) fn received_everywhere(mut self) -> Self {
        self.heard.fill(true);
        self
    }

    /// Calls the custom operations of the test before the start, or those after the end, ordered by priority and
    /// declaration. The error says which operation failed, and why.
    pub fn before_or_after_run(&mut self, moment: Moment, files: &mut dyn SpaceFiles) -> Result<(), String> {
        for at in self.order.clone() {
            let stage = &mut self.operations[at];
            let Disturbance::Custom(custom) = &mut stage.disturbance else { continue };
            if custom.moment != moment {
                continue;
            }
            let mut ctx = RunContext::new(files, KeyedRng::new(stage.operation_seed, 0, 0));
            custom.hook.before_or_after_run(&mut ctx);
            stage.counters.side_effects += ctx.side_effects;
            if let Some(failure) = ctx.failure {
                return Err(format!("operation `{}`: {failure}", stage.name));
            }
        }
        Ok(())
    }

    /// Tells the listeners of an action, if an operation of the test took it.
    fn tell(&mut self, now: SimTime, operation: usize, event: OperationEvent) {
        if operation >= self.order.len() {
            return;
        }
        for tap in &mut self.taps {
            tap.operated(now, operation, event);
        }
    }

    /// Tells the listeners the time.
    fn tell_time(&mut self, now: SimTime) {
        self.metrics.advanced(now);
        if let Some(monitors) = &mut self.monitors {
            monitors.tick(now, &mut self.metrics);
        }
        for tap in &mut self.taps {
            tap.advanced(now);
        }
    }

    /// Tells the metrics' hooks that the run begins.
    pub fn begin(&mut self) {
        self.metrics.begin();
    }

    /// Tells the metrics that the run has ended.
    pub fn end(&mut self, now: SimTime) {
        self.settle_monitors(&mut Vec::new());
        self.metrics.end(now);
        self.monitors_end(now);
        self.ended = true;
    }

    /// Carries out, in order of time, every activation edge and every release up to `now`; at one instant edges come
    /// first, since an operation is active for `start <= t < end`.
    fn advance_to(&mut self, now: SimTime, deliveries: &mut Vec<Delivery>) {
        self.begin_time();
        if self.now < now {
            self.open_publishing(deliveries);
        }
        loop {
            self.release_due(deliveries);
            if self.now >= now {
                return;
            }
            if self.leave(deliveries) {
                continue;
            }
            let Some(moment) = self.next_moment().filter(|&moment| moment <= now) else {
                self.now = now;
                self.tell_time(now);
                return;
            };
            self.now = moment;
            self.tell_time(moment);
            self.arrive();
            self.monitors_arrive(deliveries);
        }
    }

    /// The next edge, release, or moment at which a time that grows reaches what it is compared with.
    #[expect(clippy::inline_always, reason = "the call would be a fiftieth of what a message costs")]
    #[inline(always)]
    fn next_moment(&self) -> Option<SimTime> {
        let edges = self.operations.iter().filter_map(|stage| stage.activity.next_edge());
        let of_values = self.next_comparison().into_iter().chain(self.metrics.next_change());
        edges.chain(self.queue.next_release()).chain(of_values).chain(self.monitors_due()).min()
    }

    /// Carries out the edges at time zero, once.
    fn begin_time(&mut self) {
        if self.phase == Phase::New {
            self.phase = Phase::Running;
            self.show_scores();
            self.arrive();
        }
    }

    /// Begins an instant at which something is due: carries out its edges.
    fn arrive(&mut self) {
        for at in 0..self.operations.len() {
            match self.operations[at].activity.advance_to(self.now) {
                Edge::None => {}
                Edge::Started => self.begin_activity(at, self.now),
                Edge::Ended => self.end_activity(at, self.now),
            }
        }
        self.evaluate_conditions();
    }

    /// Ends an instant, when time advances: some values are known only now. They switch operations one nanosecond
    /// later, since the instant to which they belong is over. Returns whether that is why time has advanced: then there
    /// is another instant to end.
    fn leave(&mut self, deliveries: &mut Vec<Delivery>) -> bool {
        self.settle_monitors(deliveries);
        let waited = self.metrics.settle();
        if self.monitors_leave() || waited {
            self.now = self.now + TICK;
            self.tell_time(self.now);
            // What ends at that moment ends before conditions see the values.
            self.arrive();
            return true;
        }
        self.evaluate_conditions();
        false
    }

    /// Evaluates the conditions of all operations on the same values: first which operations become inactive, then
    /// which become active, so that an operation can begin when its copy ends.
    fn evaluate_conditions(&mut self) {
        if self.conditions.operations.is_empty() {
            return;
        }
        let now = self.now;
        loop {
            let fuzzing_time = self.fuzzing_time().seconds();
            let metrics = &self.metrics;
            let value = |metric| metrics.value(metric, fuzzing_time);
            for &at in &self.conditions.operations {
                if self.operations[at].activity.evaluate_end(now, &value) == Edge::Ended {
                    self.conditions.ended.push(at);
                }
            }
            for next in 0..self.conditions.operations.len() {
                let at = self.conditions.operations[next];
                let free = !self.conditions.apart || !self.copy_is_active(at);
                let value = |metric| self.metrics.value(metric, fuzzing_time);
                if self.operations[at].activity.evaluate_start(now, free, &value) == Edge::Started {
                    self.begin_activity(at, now);
                }
            }
            if self.conditions.ended.is_empty() {
                return;
            }
            for next in 0..self.conditions.ended.len() {
                self.end_activity(self.conditions.ended[next], now);
            }
            self.conditions.ended.clear();
        }
    }

    /// Releases due messages, one after another, since conditions may read what is delivered.
    fn release_due(&mut self, deliveries: &mut Vec<Delivery>) {
        while self.queue.next_release().is_some_and(|release| release <= self.now) {
            if let Some(held) = self.release() {
                self.pass(self.now, held, deliveries);
                self.end_event(deliveries);
            }
        }
    }

    /// Whether another copy of this operation is active.
    fn copy_is_active(&self, at: usize) -> bool {
        let operation = self.operations[at].operation;
        let others = self.operations.iter().enumerate().filter(|&(other, _)| other != at);
        others.into_iter().any(|(_, stage)| stage.operation == operation && stage.activity.is_active())
    }

    /// Takes the next held message out of the queue, due or not.
    fn release(&mut self) -> Option<Held> {
        let (operation, held) = self.queue.pop()?;
        if self.queue.holds(operation) == 0 {
            self.operations[operation].end_tail(self.now);
        }
        Some(held)
    }

    /// An operation becomes active: it starts from its initial state.
    fn begin_activity(&mut self, at: usize, now: SimTime) {
        let stage = &mut self.operations[at];
        stage.since = now;
        stage.counted = PerWire::default();
        stage.end_tail(now);
        stage.disturbance.begin();
        self.order(at, true);
        self.tell(now, at, OperationEvent::Started);
    }

    /// Tells the transport what an operation on a node does, or that it has ended.
    fn order(&mut self, at: usize, begins: bool) {
        if let Disturbance::Resources(resources) = &self.operations[at].disturbance {
            let order = |resource: &Resource| Order { operation: at, resource: resource.clone(), begins };
            self.orders.extend(resources.iter().map(order));
        }
    }

    /// An operation becomes inactive: listeners are told, and the messages that it holds are handled by its `drain`.
    fn end_activity(&mut self, at: usize, now: SimTime) {
        self.tell(now, at, OperationEvent::Ended);
        self.order(at, false);
        match self.operations[at].disturbance.drain() {
            None | Some(Drain::Finish) => {}
            Some(Drain::Flush) => return self.queue.release_all(at, now),
            Some(Drain::Drop) => {
                let lost = self.queue.take_all(at);
                for (why, held) in &lost {
                    self.operations[at].lost(held.wire, *why);
                }
                for (_, held) in lost {
                    self.tell(now, at, OperationEvent::Dropped(held.message_ref()));
                }
            }
        }
        if self.queue.holds(at) > 0 {
            self.operations[at].tail_since = Some(now);
        }
    }
}

impl Exchange for Relay<'_> {
    fn wires(&self) -> &WireTable {
        self.wires
    }

    fn intercepts(&self, wire: Wire) -> bool {
        !self.pipelines[wire.index()].is_empty()
    }

    fn subscribed(&mut self, wire: Wire) {
        self.heard[wire.index()] = true;
    }

    fn found(&mut self, wire: Wire) {
        if !std::mem::replace(&mut self.heard[wire.index()], true) {
            self.operations.iter_mut().for_each(|stage| stage.found(wire));
        }
    }

    fn clock_at_zero(&mut self, seconds: f64) {
        self.metrics.clock_at_zero(seconds);
        self.taps.iter_mut().for_each(|tap| tap.clock_at_zero(seconds));
    }

    fn advance(&mut self, now: SimTime, deliveries: &mut Vec<Delivery>) {
        self.copies = 0;
        self.begin_time();
        self.open_publishing(deliveries);
        self.advance_to(now, deliveries);
    }

    fn message_from(
        &mut self,
        now: SimTime,
        wire: Wire,
        publisher: Option<NodeId>,
        value: Value,
        deliveries: &mut Vec<Delivery>,
    ) {
        if now > self.now || self.phase == Phase::New {
            self.advance_to(now, deliveries);
        }
        self.copies = 0;
        self.publish(self.now, wire, publisher, false, value, deliveries);
        self.end_event(deliveries);
        if self.conditions.reads_delivered {
            self.release_due(deliveries);
        }
    }

    fn next_index(&self, wire: Wire) -> u64 {
        self.published[wire.index()]
    }

    fn parameters(&self) -> &[(String, f64)] {
        &self.beginning.parameters
    }

    fn arguments(&self) -> &[(String, String)] {
        &self.beginning.arguments
    }

    fn take_orders(&mut self) -> Vec<Order> {
        std::mem::take(&mut self.orders)
    }

    fn carried_out(&mut self, now: SimTime, operation: usize) {
        self.operations[operation].acted(now, 1, |counters| &mut counters.side_effects);
    }

    fn next_due(&self) -> Option<SimTime> {
        match self.phase {
            Phase::New => Some(self.now),
            Phase::Over => None,
            Phase::Running => {
                // The end of this instant may make values known that conditions read.
                let settled =
                    !self.conditions.operations.is_empty() && (self.metrics.is_waiting() || self.monitors_wait());
                self.next_moment().into_iter().chain(settled.then(|| self.now + TICK)).min()
            }
        }
    }
}

#[cfg(test)]
mod activations;
#[cfg(test)]
mod behaviour;
#[cfg(test)]
mod counted;
#[cfg(test)]
mod links;
#[cfg(test)]
mod matrix;
#[cfg(test)]
mod monitored;
#[cfg(test)]
mod tests;
