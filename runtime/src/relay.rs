//! The relay: the man in the middle, for one run of one test.
//!
//! Sans-IO. Messages and time go in, deliveries come out; a transport feeds it and carries out what it says. Within one
//! event the order is: due releases, inbound metrics, conditions, operations (the triggering message included), outbound
//! metrics, then delivery. A message on a wire that no operation of the test touches is handed on as it came.
//!
//! Conditions are weighed once in every event, be it a message or a step of time, and at every edge and release between
//! two events. So what an outbound metric shows of a message counts from the next event on, and no operation goes on and
//! off in one event. A test without conditions pays nothing for them.

mod release;
mod tap;

use sesame_plan::{CampaignPlan, Drain, Moment, Span, Test};

use crate::activation::{Activity, Edge};
use crate::changed_files::ChangedFiles;
use crate::fuzz::{ChoiceError, Disturbance, Draws, Encounter, Fate, OperationEntry, RunContext};
use crate::metric::Metrics;
use crate::observation::{Counters, OperationEffect};
use crate::time::SimTime;
use crate::value::Value;
use crate::wire::{Wire, WireTable};

use release::{Held, ReleaseQueue};
pub use tap::{Deed, Tap, Touched};

/// A message that is to reach its subscribers now.
#[derive(Debug, Clone, PartialEq)]
pub struct Delivery {
    /// On which wire.
    pub wire: Wire,
    /// What.
    pub value: Value,
}

/// The relay as a transport sees it.
pub trait Exchange {
    /// The wires it knows; messages of other topics are none of its business.
    fn wires(&self) -> &WireTable;
    /// Whether messages of this wire must pass through it, because an operation may disturb them.
    fn intercepts(&self, wire: Wire) -> bool;
    /// Time has come to `now`; it never goes back.
    fn advance(&mut self, now: SimTime, deliveries: &mut Vec<Delivery>);
    /// A message was published at `now`.
    fn message(&mut self, now: SimTime, wire: Wire, value: Value, deliveries: &mut Vec<Delivery>);
}

/// The most messages that operations may hold back at once; beyond it, the oldest is let go early and the run warned.
pub const HELD_LIMIT: usize = 100_000;

/// The most copies that operations may make in one event; beyond it, no more are made and the run is warned.
pub const COPIES_LIMIT: u32 = 10_000;

/// The relay of one run.
pub struct Relay<'a> {
    wires: &'a WireTable,
    operations: Vec<Stage>,
    /// Their positions by priority, then declaration.
    order: Vec<usize>,
    /// Per wire: the stages a message passes, in order, with the wire's position in the operation's topic.
    pipelines: Vec<Vec<(usize, u64)>>,
    /// Per wire: messages published so far.
    published: Vec<u64>,
    queue: ReleaseQueue,
    metrics: Metrics<'a>,
    /// The operations that conditions switch.
    conditional: Vec<usize>,
    /// Those of them that went off in the step at hand; here so that no step has to allocate.
    ended: Vec<usize>,
    /// The number of the step: an event, or an edge or release between two.
    step: u64,
    now: SimTime,
    messages: u64,
    overflowed: bool,
    /// Copies made in the event at hand.
    copies: u32,
    flooded: bool,
    /// The run is over: nothing is delivered any more.
    over: bool,
    tap: Option<&'a mut dyn Tap>,
}

/// One operation of the test.
struct Stage {
    name: String,
    disturbance: Disturbance,
    /// Whether it has to hear messages while it is off.
    listens: bool,
    holds_order: bool,
    activity: Activity,
    /// When it last went on.
    since: SimTime,
    draw_seed: u64,
    /// Whether it counts in `fuzzing_time()`.
    timed: bool,
    counters: Counters,
    first_touch: Option<SimTime>,
    last_touch: Option<SimTime>,
}

impl Stage {
    fn touch(&mut self, now: SimTime) {
        self.first_touch.get_or_insert(now);
        self.last_touch = Some(now);
    }
}

impl<'a> Relay<'a> {
    /// A relay for a test of this plan, at time zero.
    pub fn new(
        plan: &CampaignPlan,
        wires: &'a WireTable,
        test: &Test,
        metrics: Metrics<'a>,
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
                name: operation.name.clone(),
                listens: disturbance.listens(),
                holds_order: disturbance.holds_order(),
                disturbance,
                activity: Activity::new(&choice.activation, operation.within),
                since: SimTime::ZERO,
                draw_seed: choice.draw_seed,
                timed: operation.timed,
                counters: Counters::default(),
                first_touch: None,
                last_touch: None,
            });
        }
        let mut pipelines = vec![Vec::new(); wires.len()];
        let mut members = vec![0u64; plan.topics.len()];
        for wire in wires.iter() {
            let topic = wires.topic(wire);
            let member = members[topic.index()];
            members[topic.index()] += 1;
            let touched =
                order.iter().filter(|&&at| plan.operation(test.operations[at].operation).topic == Some(topic));
            pipelines[wire.index()].extend(touched.map(|&at| (at, member)));
        }
        let conditional = (0..operations.len()).filter(|&at| operations[at].activity.is_conditional()).collect();
        Ok(Relay {
            wires,
            conditional,
            ended: Vec::with_capacity(operations.len()),
            step: 0,
            operations,
            order,
            pipelines,
            published: vec![0; wires.len()],
            queue: ReleaseQueue::new(test.operations.len(), wires.len()),
            metrics,
            now: SimTime::ZERO,
            messages: 0,
            overflowed: false,
            copies: 0,
            flooded: false,
            over: false,
            tap: None,
        })
    }

    /// The same relay, telling this tap what happens.
    pub fn tapped(self, tap: &'a mut dyn Tap) -> Self {
        Relay { tap: Some(tap), ..self }
    }

    fn tell(&mut self, now: SimTime, operation: usize, deed: Deed) {
        if let Some(tap) = &mut self.tap {
            tap.operated(now, operation, deed);
        }
    }

    /// Tells the metrics' hooks that the run begins.
    pub fn begin(&mut self) {
        self.metrics.begin();
    }

    /// Tells the metrics that the run has come to its end.
    pub fn end(&mut self, now: SimTime) {
        self.metrics.end(now);
    }

    /// Closes the books at `end`, where the run ended or broke off: what is still held is lost, open intervals are closed.
    pub fn finish(mut self, end: SimTime) -> Finished {
        self.over = true;
        self.follow_time(end, &mut Vec::new());
        let operations: Vec<OperationEffect> = self
            .operations
            .iter()
            .map(|stage| OperationEffect {
                intervals: stage.activity.intervals(end),
                counters: stage.counters,
                first_touch: stage.first_touch.map(SimTime::seconds),
                last_touch: stage.last_touch.map(SimTime::seconds),
            })
            .collect();
        let timed = self.operations.iter().zip(&operations).filter(|(stage, _)| stage.timed);
        let active: Vec<Span> = timed.flat_map(|(_, operation)| operation.intervals.clone()).collect();
        let (metrics, mut warnings) = self.metrics.finish(&active);
        for stage in &self.operations {
            if let Disturbance::Custom(custom) = &stage.disturbance
                && let Some(mismatch) = &custom.mismatch
            {
                warnings.push(format!("operation `{}`: {mismatch}", stage.name));
            }
        }
        if self.overflowed {
            warnings
                .push(format!("more than {HELD_LIMIT} messages were held back at once; the oldest were let go early"));
        }
        if self.flooded {
            warnings.push(format!("copies of copies: more than {COPIES_LIMIT} in one event are not made"));
        }
        Finished { operations, metrics, warnings, messages: self.messages }
    }

    /// Carries out, in order of time, every activation edge and every release up to `now`; at one moment edges come
    /// first, since an operation is active for `start <= t < end`. Conditions are weighed at each moment before `now`, for
    /// which the event at hand does it.
    fn follow_time(&mut self, now: SimTime, deliveries: &mut Vec<Delivery>) {
        loop {
            let release = self.queue.next_release().filter(|&time| time <= now);
            let edge = self.operations.iter().filter_map(|stage| stage.activity.next_edge()).min();
            match (edge.filter(|&time| time <= now), release) {
                (Some(edge), release) if release.is_none_or(|release| edge <= release) => {
                    self.metrics.follow_time(edge);
                    self.follow_activities(edge, deliveries);
                    if edge < now {
                        self.weigh_conditions(edge, deliveries);
                    }
                }
                (_, Some(release)) => {
                    self.metrics.follow_time(release);
                    if let Some(held) = self.queue.pop() {
                        self.pass(release, held, deliveries);
                    }
                    if release < now {
                        self.weigh_conditions(release, deliveries);
                    }
                }
                (_, None) => return self.metrics.follow_time(now),
            }
        }
    }

    /// Carries out the edges at one moment; messages let go by them are let go then.
    fn follow_activities(&mut self, edge: SimTime, deliveries: &mut Vec<Delivery>) {
        for at in 0..self.operations.len() {
            match self.operations[at].activity.follow(edge, self.step) {
                Edge::None => {}
                Edge::Started => self.begin_activity(at, edge),
                Edge::Ended => self.end_activity(at, edge, deliveries),
            }
        }
    }

    /// Weighs the conditions of all operations on the same values, and ends the step.
    fn weigh_conditions(&mut self, now: SimTime, deliveries: &mut Vec<Delivery>) {
        if self.conditional.is_empty() || self.over {
            return;
        }
        let timed = self.operations.iter().filter(|stage| stage.timed);
        let active = |sum, stage: &Stage| sum + stage.activity.active_time(now);
        let active_time = timed.fold(SimTime::ZERO, active).seconds();
        for next in 0..self.conditional.len() {
            let at = self.conditional[next];
            let value = |metric| self.metrics.value(metric, active_time);
            match self.operations[at].activity.weigh(now, self.step, &value) {
                Edge::None => {}
                Edge::Started => self.begin_activity(at, now),
                Edge::Ended => self.ended.push(at),
            }
        }
        self.step += 1;
        for next in 0..self.ended.len() {
            self.end_activity(self.ended[next], now, deliveries);
        }
        self.ended.clear();
    }

    /// What happens when an operation goes on: it begins afresh.
    fn begin_activity(&mut self, at: usize, now: SimTime) {
        let stage = &mut self.operations[at];
        stage.since = now;
        stage.disturbance.begin();
        self.tell(now, at, Deed::Started);
    }

    /// What happens when an operation goes off: it is told, and the messages it holds become what they are to become.
    fn end_activity(&mut self, at: usize, now: SimTime, deliveries: &mut Vec<Delivery>) {
        self.tell(now, at, Deed::Ended);
        match self.operations[at].disturbance.drain() {
            None | Some(Drain::Finish) => {}
            Some(Drain::Flush) => {
                for held in self.queue.take_all(at) {
                    self.pass(now, held, deliveries);
                }
            }
            Some(Drain::Drop) => {
                let lost = self.queue.take_all(at);
                let counters = &mut self.operations[at].counters;
                counters.delayed -= lost.len() as u64;
                counters.dropped += lost.len() as u64;
                for held in lost {
                    self.tell(now, at, Deed::Dropped(held.touched()));
                }
            }
        }
    }

    /// Takes a message through the rest of its pipeline.
    fn pass(&mut self, now: SimTime, mut message: Held, deliveries: &mut Vec<Delivery>) {
        while let Some(&(at, member)) = self.pipelines[message.wire.index()].get(message.next_stage) {
            message.next_stage += 1;
            let stage = &mut self.operations[at];
            let queued_until = if stage.holds_order { self.queue.last_release(at, message.wire) } else { None };
            let active = stage.activity.is_active();
            if active {
                stage.counters.seen += 1;
            } else if stage.listens {
                stage.disturbance.overhear(now, member, &message.value);
            }
            if active && matches!(stage.disturbance, Disturbance::Custom(_)) {
                return self.pass_custom(now, at, member, message, deliveries);
            }
            let fate = if active {
                let draws = Draws::new(stage.draw_seed, member, message.index);
                let encounter = Encounter { now, active: now - stage.since, member, draws };
                stage.disturbance.apply(encounter, &mut message.value)
            } else {
                Fate::Unchanged
            };
            if let Fate::Duplicated(copies) = fate {
                return self.pass_copies(now, at, message, copies, deliveries);
            }
            let release = match fate {
                Fate::Delayed(delay) => now + delay,
                _ => now,
            }
            .max(queued_until.unwrap_or(now));
            if fate == Fate::Dropped {
                stage.counters.dropped += 1;
                stage.touch(now);
                self.tell(now, at, Deed::Dropped(message.touched()));
                return;
            }
            if fate == Fate::Changed {
                stage.counters.changed += 1;
                stage.touch(now);
                self.tell(now, at, Deed::Changed(message.touched()));
            }
            if release > now {
                let stage = &mut self.operations[at];
                stage.counters.delayed += 1;
                stage.touch(now);
                self.tell(now, at, Deed::Delayed(message.touched(), release));
                self.queue.push(release, at, message);
                if self.queue.len() > HELD_LIMIT {
                    self.overflowed = true;
                    if let Some(oldest) = self.queue.pop() {
                        self.pass(now, oldest, deliveries);
                    }
                }
                return;
            }
        }
        if !self.over {
            self.metrics.delivered(now, message.wire, &message.value);
            if let Some(tap) = &mut self.tap {
                tap.delivered(now, message.wire, message.published, &message.value);
            }
        }
        deliveries.push(Delivery { wire: message.wire, value: message.value });
    }
}

/// What the user's code does.
impl Relay<'_> {
    /// Calls the custom operations of the test before the start, or those after the end, in priority, then declaration
    /// order. The error says which could not do what.
    pub fn beside_run(&mut self, moment: Moment, files: &mut ChangedFiles) -> Result<(), String> {
        for at in self.order.clone() {
            let stage = &mut self.operations[at];
            let Disturbance::Custom(custom) = &mut stage.disturbance else { continue };
            if custom.moment != moment {
                continue;
            }
            let mut ctx = RunContext::new(files, Draws::new(stage.draw_seed, 0, 0));
            custom.hook.beside_run(&mut ctx);
            stage.counters.side_effects += ctx.side_effects;
            if let Some(failure) = ctx.failure {
                return Err(format!("operation `{}`: {failure}", stage.name));
            }
        }
        Ok(())
    }

    /// Takes a message through a custom operation and on, then what the operation made up.
    fn pass_custom(&mut self, now: SimTime, at: usize, member: u64, mut message: Held, deliveries: &mut Vec<Delivery>) {
        let stage = &mut self.operations[at];
        let Disturbance::Custom(custom) = &mut stage.disturbance else {
            unreachable!("only custom operations come here")
        };
        let draws = Draws::new(stage.draw_seed, member, message.index);
        let call = custom.on_message(now, self.wires.path(message.wire), draws, &mut message.value);
        stage.counters.injected += call.injected.len() as u64;
        stage.counters.changed += u64::from(call.changed && !call.dropped);
        stage.counters.dropped += u64::from(call.dropped);
        if call.changed || call.dropped || !call.injected.is_empty() {
            stage.touch(now);
        }
        if call.dropped {
            self.tell(now, at, Deed::Dropped(message.touched()));
        } else if call.changed {
            self.tell(now, at, Deed::Changed(message.touched()));
        }
        for _ in &call.injected {
            self.tell(now, at, Deed::Injected(message.touched()));
        }
        let injected = (0u64..).zip(call.injected);
        let injected: Vec<Held> = injected.map(|(number, value)| message.beside(at, number, value)).collect();
        if !call.dropped {
            self.pass(now, message, deliveries);
        }
        for message in injected {
            self.pass(now, message, deliveries);
        }
    }
}

/// Copies of messages.
impl Relay<'_> {
    /// Takes a message on, then copies of it: as many as the operation makes, and no more than one event may bring.
    fn pass_copies(&mut self, now: SimTime, at: usize, message: Held, copies: u32, deliveries: &mut Vec<Delivery>) {
        let room = COPIES_LIMIT - self.copies;
        self.flooded |= copies > room;
        let copies = copies.min(room);
        self.copies += copies;
        if copies > 0 {
            let stage = &mut self.operations[at];
            stage.counters.injected += u64::from(copies);
            stage.touch(now);
        }
        let made: Vec<Held> =
            (0..u64::from(copies)).map(|number| message.beside(at, number, message.value.clone())).collect();
        for copy in &made {
            self.tell(now, at, Deed::Injected(copy.touched()));
        }
        self.pass(now, message, deliveries);
        for copy in made {
            self.pass(now, copy, deliveries);
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

    fn advance(&mut self, now: SimTime, deliveries: &mut Vec<Delivery>) {
        self.now = self.now.max(now);
        self.copies = 0;
        self.follow_time(self.now, deliveries);
        self.weigh_conditions(self.now, deliveries);
    }

    fn message(&mut self, now: SimTime, wire: Wire, value: Value, deliveries: &mut Vec<Delivery>) {
        if now > self.now || self.messages == 0 {
            self.now = self.now.max(now);
            self.follow_time(self.now, deliveries);
        }
        self.messages += 1;
        self.copies = 0;
        let index = self.published[wire.index()];
        self.published[wire.index()] += 1;
        if let Some(tap) = &mut self.tap {
            tap.published(self.now, wire, index, &value);
        }
        self.metrics.message(self.now, wire, &value);
        self.weigh_conditions(self.now, deliveries);
        self.pass(self.now, Held { wire, published: index, index, value, next_stage: 0 }, deliveries);
    }
}

/// What a run left behind.
pub struct Finished {
    /// Per operation of the test, in its order.
    pub operations: Vec<OperationEffect>,
    /// Per metric of the plan.
    pub metrics: Vec<crate::observation::MetricObservation>,
    /// What the user should know.
    pub warnings: Vec<String>,
    /// Messages handled.
    pub messages: u64,
}

#[cfg(test)]
mod behaviour;
#[cfg(test)]
mod matrix;
#[cfg(test)]
mod tests;
