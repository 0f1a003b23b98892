//! The relay: the man in the middle, for one run of one test.
//!
//! Sans-IO. Messages and time go in, deliveries come out; a transport feeds it and carries out what it says. Within one
//! event the order is: due releases, inbound metrics, activations, operations (the triggering message included), outbound
//! metrics, then delivery. A message on a wire that no operation of the test touches is handed on as it came.

mod release;

use sesame_plan::{CampaignPlan, Drain, Span, Test};

use crate::activation::{Activity, Edge};
use crate::fuzz::{ChoiceError, Disturbance, Draws, Fate};
use crate::metric::Metrics;
use crate::observation::{Counters, OperationEffect};
use crate::time::SimTime;
use crate::value::Value;
use crate::wire::{Wire, WireTable};

use release::{Held, ReleaseQueue};

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

/// The relay of one run.
pub struct Relay<'a> {
    wires: &'a WireTable,
    operations: Vec<Stage>,
    /// Per wire: the stages a message passes, in order, with the wire's position in the operation's topic.
    pipelines: Vec<Vec<(usize, u64)>>,
    /// Per wire: messages published so far.
    published: Vec<u64>,
    queue: ReleaseQueue,
    metrics: Metrics<'a>,
    now: SimTime,
    messages: u64,
    overflowed: bool,
    /// The run is over: nothing is delivered any more.
    over: bool,
}

/// One operation of the test.
struct Stage {
    disturbance: Disturbance,
    activity: Activity,
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

    fn holds_order(&self) -> bool {
        matches!(self.disturbance, Disturbance::Latency(_))
    }
}

impl<'a> Relay<'a> {
    /// A relay for a test of this plan, at time zero.
    pub fn new(
        plan: &CampaignPlan,
        wires: &'a WireTable,
        test: &Test,
        metrics: Metrics<'a>,
    ) -> Result<Self, ChoiceError> {
        let mut order: Vec<usize> = (0..test.operations.len()).collect();
        order.sort_by_key(|&at| {
            let id = test.operations[at].operation;
            (std::cmp::Reverse(plan.operation(id).priority), id, at)
        });
        let mut operations = Vec::with_capacity(test.operations.len());
        for choice in &test.operations {
            let operation = plan.operation(choice.operation);
            operations.push(Stage {
                disturbance: Disturbance::new(operation, choice)?,
                activity: Activity::new(choice.activation, operation.within),
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
            let touched = order.iter().filter(|&&at| plan.operation(test.operations[at].operation).topic == topic);
            pipelines[wire.index()].extend(touched.map(|&at| (at, member)));
        }
        Ok(Relay {
            wires,
            operations,
            pipelines,
            published: vec![0; wires.len()],
            queue: ReleaseQueue::new(test.operations.len(), wires.len()),
            metrics,
            now: SimTime::ZERO,
            messages: 0,
            overflowed: false,
            over: false,
        })
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
        if self.overflowed {
            warnings
                .push(format!("more than {HELD_LIMIT} messages were held back at once; the oldest were let go early"));
        }
        Finished { operations, metrics, warnings, messages: self.messages }
    }

    /// Carries out, in order of time, every activation edge and every release up to `now`; at one moment edges come
    /// first, since an operation is active for `start <= t < end`.
    fn follow_time(&mut self, now: SimTime, deliveries: &mut Vec<Delivery>) {
        loop {
            let release = self.queue.next_release().filter(|&time| time <= now);
            let edge = self.operations.iter().filter_map(|stage| stage.activity.next_edge()).min();
            match (edge.filter(|&time| time <= now), release) {
                (Some(edge), release) if release.is_none_or(|release| edge <= release) => {
                    self.follow_activities(edge, deliveries);
                }
                (_, Some(release)) => {
                    if let Some(held) = self.queue.pop() {
                        self.pass(release, held, deliveries);
                    }
                }
                (_, None) => return,
            }
        }
    }

    /// Carries out the edges at one moment; messages let go by them are let go then.
    fn follow_activities(&mut self, edge: SimTime, deliveries: &mut Vec<Delivery>) {
        for at in 0..self.operations.len() {
            let stage = &mut self.operations[at];
            if stage.activity.follow(edge) != Edge::Ended {
                continue;
            }
            let Disturbance::Latency(latency) = &stage.disturbance else { continue };
            match latency.drain {
                Drain::Finish => {}
                Drain::Flush => {
                    for held in self.queue.take_all(at) {
                        self.pass(edge, held, deliveries);
                    }
                }
                Drain::Drop => {
                    let lost = self.queue.take_all(at).len() as u64;
                    stage.counters.delayed -= lost;
                    stage.counters.dropped += lost;
                }
            }
        }
    }

    /// Takes a message through the rest of its pipeline.
    fn pass(&mut self, now: SimTime, mut message: Held, deliveries: &mut Vec<Delivery>) {
        while let Some(&(at, member)) = self.pipelines[message.wire.index()].get(message.next_stage) {
            message.next_stage += 1;
            let stage = &mut self.operations[at];
            let queued_until = if stage.holds_order() { self.queue.last_release(at, message.wire) } else { None };
            let active = stage.activity.is_active();
            if active {
                stage.counters.seen += 1;
            }
            let fate = if active {
                stage.disturbance.apply(Draws::new(stage.draw_seed, member, message.index), &mut message.value)
            } else {
                Fate::Unchanged
            };
            let release = match fate {
                Fate::Delayed(delay) => now + delay,
                _ => now,
            }
            .max(queued_until.unwrap_or(now));
            if fate == Fate::Dropped {
                stage.counters.dropped += 1;
                stage.touch(now);
                return;
            }
            if fate == Fate::Changed {
                stage.counters.changed += 1;
                stage.touch(now);
            }
            if release > now {
                stage.counters.delayed += 1;
                stage.touch(now);
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
        }
        deliveries.push(Delivery { wire: message.wire, value: message.value });
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
        self.follow_time(self.now, deliveries);
    }

    fn message(&mut self, now: SimTime, wire: Wire, value: Value, deliveries: &mut Vec<Delivery>) {
        if now > self.now || self.messages == 0 {
            self.advance(now, deliveries);
        }
        self.messages += 1;
        let index = self.published[wire.index()];
        self.published[wire.index()] += 1;
        self.metrics.message(self.now, wire, &value);
        self.pass(self.now, Held { wire, index, value, next_stage: 0 }, deliveries);
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
mod tests;
