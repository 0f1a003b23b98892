//! The way of a message: a node or a monitor publishes it, and it goes through its pipeline, in which each operation in
//! turn acts on it, and what it adds follows it.

use sesame_base::time::SimTime;
use sesame_plan::{NodeId, Side};

use crate::fuzz::{Action, Disturbance, HELD_LIMIT, KeyedRng, MessageContext};
use crate::relay::release::{Held, Why};
use crate::relay::stage::Stage;
use crate::relay::{COPIES_LIMIT, Delivery, Listener as _, OperationEvent, Phase, Relay};
use crate::value::Value;
use crate::wire::Wire;

impl Relay<'_> {
    /// Publishes a message of a node or a monitor: it gets the next number of its wire, listeners, metrics and monitors
    /// hear it, and it begins its way through the pipeline.
    pub(super) fn publish(
        &mut self,
        now: SimTime,
        wire: Wire,
        publisher: Option<NodeId>,
        by_monitor: bool,
        value: Value,
        deliveries: &mut Vec<Delivery>,
    ) {
        self.messages += 1;
        let index = self.published[wire.index()];
        self.published[wire.index()] += 1;
        if self.traffic.is_awaited(wire) {
            self.traffic.meets(now, wire, publisher);
        }
        if !by_monitor {
            self.traffic.heard(now, wire);
        }
        if let Some(course) = &mut self.course {
            course.published(now, wire, &value);
        }
        for tap in &mut self.taps {
            tap.published(now, wire, index, &value);
        }
        if !value.is_opaque() {
            self.metrics.published(now, wire, index, &value);
            self.monitors_hear(Side::Inbound, wire, index, &value);
            if self.conditions.read[wire.index()] {
                self.evaluate_conditions();
                self.release_due(deliveries);
            }
        }
        let message = Held { wire, publisher, by_monitor, published: index, index, value, next_stage: 0 };
        self.pass(now, message, deliveries);
    }

    /// Takes a message through the rest of its pipeline.
    pub(super) fn pass(&mut self, now: SimTime, mut message: Held, deliveries: &mut Vec<Delivery>) {
        loop {
            let wire = message.wire.index();
            if message.next_stage == self.disturbed_by[wire] {
                self.disturbed(now, &message, deliveries);
            }
            let Some(&(at, on)) = self.pipelines[wire].get(message.next_stage) else { break };
            message.next_stage += 1;
            let heard = self.heard[message.wire.index()];
            let stage = &mut self.operations[at];
            if !stage.concerns(message.publisher) {
                continue;
            }
            let queued_until = if stage.holds_order { self.queue.last_release(at, message.wire) } else { None };
            let mut active = stage.activity.is_active();
            if active {
                stage.counters.seen += 1;
            } else if stage.observes_inactive {
                stage.disturbance.observe(now, on, &message.value);
            }
            let context = |stage: &Stage| {
                let draws = KeyedRng::new(stage.operation_seed, on.member, message.index);
                MessageContext { now, active: now - stage.since, on, draws }
            };
            if active && !stage.alters(on.member, message.published) {
                stage.decide_on(self.wires.path(message.wire), context(stage), &message.value);
                active = false;
            }
            if active && matches!(stage.disturbance, Disturbance::Custom(_)) {
                return self.pass_custom(now, at, on.member, message, deliveries);
            }
            let action =
                if active { stage.disturbance.apply(context(stage), &mut message.value) } else { Action::Unchanged };
            if let Action::Duplicated(copies) = action {
                return self.pass_copies(now, at, message, copies, deliveries);
            }
            let release = match action {
                Action::Delayed(delay) => now + delay,
                _ => now,
            }
            .max(queued_until.unwrap_or(now));
            if action == Action::Dropped {
                stage.count(message.wire, heard, now, 1, |counters| &mut counters.dropped);
                self.tell(now, at, OperationEvent::Dropped(message.message_ref()));
                return;
            }
            if action == Action::Changed {
                stage.count(message.wire, heard, now, 1, |counters| &mut counters.changed);
                self.tell(now, at, OperationEvent::Changed(message.message_ref()));
            }
            if release > now {
                let stage = &mut self.operations[at];
                let why = match (heard, active) {
                    (false, active) => Why::Unheard { active },
                    (true, true) => Why::Delayed,
                    (true, false) => Why::Queued,
                };
                stage.count(message.wire, heard, now, 1, |counters| {
                    if active { &mut counters.delayed } else { &mut counters.queued }
                });
                self.tell(now, at, OperationEvent::Delayed(message.message_ref(), release));
                self.queue.push(release, at, why, message);
                if self.queue.len() > HELD_LIMIT {
                    self.overflowed = true;
                    if let Some(oldest) = self.release() {
                        self.pass(now, oldest, deliveries);
                    }
                }
                return;
            }
        }
        let Held { wire, published: index, by_monitor, value, .. } = message;
        deliveries.push(Delivery { wire, index, at: now, by_monitor, value });
    }

    /// A message has passed all operations of the test on its wire.
    fn disturbed(&mut self, now: SimTime, message: &Held, deliveries: &mut Vec<Delivery>) {
        if self.wires.link(message.wire).is_some() {
            return;
        }
        if self.phase != Phase::Over {
            let is_read = !message.value.is_opaque();
            if is_read {
                self.metrics.delivered(now, message.wire, message.published, &message.value);
            }
            for tap in &mut self.taps {
                tap.delivered(now, message.wire, message.published, &message.value);
            }
            if is_read {
                self.monitors_hear(Side::Outbound, message.wire, message.published, &message.value);
            }
        }
        self.fan_out(now, message, deliveries);
    }

    /// Sends a copy of a message on each of the links of its wire.
    fn fan_out(&mut self, now: SimTime, message: &Held, deliveries: &mut Vec<Delivery>) {
        let wires = self.wires;
        for link in wires.links().iter().filter(|link| link.of == message.wire) {
            self.pass(now, Held { wire: link.wire, next_stage: 0, ..message.clone() }, deliveries);
        }
    }

    /// Takes a message through a custom operation and on, followed by the messages that the operation injects.
    fn pass_custom(&mut self, now: SimTime, at: usize, member: u64, mut message: Held, deliveries: &mut Vec<Delivery>) {
        let heard = self.heard[message.wire.index()];
        let stage = &mut self.operations[at];
        let Disturbance::Custom(custom) = &mut stage.disturbance else {
            unreachable!("only custom operations come here")
        };
        let draws = KeyedRng::new(stage.operation_seed, member, message.index);
        let call = custom.on_message(now, self.wires.path(message.wire), draws, &mut message.value);
        stage.count(message.wire, heard, now, call.injected.len() as u64, |counters| &mut counters.injected);
        stage.count(message.wire, heard, now, u64::from(call.changed && !call.dropped), |counters| {
            &mut counters.changed
        });
        stage.count(message.wire, heard, now, u64::from(call.dropped), |counters| &mut counters.dropped);
        if call.dropped {
            self.tell(now, at, OperationEvent::Dropped(message.message_ref()));
        } else if call.changed {
            self.tell(now, at, OperationEvent::Changed(message.message_ref()));
        }
        for _ in &call.injected {
            self.tell(now, at, OperationEvent::Injected(message.message_ref()));
        }
        let seed = self.operations[at].operation_seed;
        let injected = (0u64..).zip(call.injected);
        let injected: Vec<Held> = injected.map(|(number, value)| message.beside(seed, number, value)).collect();
        if !call.dropped {
            self.pass(now, message, deliveries);
        }
        for message in injected {
            self.pass(now, message, deliveries);
        }
    }

    /// Takes a message on, followed by its copies: as many as the operation makes, up to the limit of one event.
    fn pass_copies(&mut self, now: SimTime, at: usize, message: Held, copies: u32, deliveries: &mut Vec<Delivery>) {
        let room = COPIES_LIMIT - self.copies;
        self.flooded |= copies > room;
        let copies = copies.min(room);
        self.copies += copies;
        let heard = self.heard[message.wire.index()];
        self.operations[at].count(message.wire, heard, now, u64::from(copies), |counters| &mut counters.injected);
        let seed = self.operations[at].operation_seed;
        let made: Vec<Held> =
            (0..u64::from(copies)).map(|number| message.beside(seed, number, message.value.clone())).collect();
        for copy in &made {
            self.tell(now, at, OperationEvent::Injected(copy.message_ref()));
        }
        self.pass(now, message, deliveries);
        for copy in made {
            self.pass(now, copy, deliveries);
        }
    }
}
