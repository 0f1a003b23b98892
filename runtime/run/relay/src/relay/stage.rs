//! One operation of the test that runs: its state, and what it has done.

use std::collections::BTreeMap;

use sesame_base::activation::Activity;
use sesame_base::observation::Counters;
use sesame_base::time::SimTime;
use sesame_plan::{Counts, Messages, NodeId, OperationId};

use crate::fuzz::{Disturbance, MessageContext, PerWire};
use crate::relay::release::Why;
use crate::value::Value;
use crate::wire::Wire;

/// One operation of the test.
pub(super) struct Stage {
    pub(super) operation: OperationId,
    pub(super) name: String,
    /// Only messages that these nodes publish; none for all.
    pub(super) from: Vec<NodeId>,
    pub(super) disturbance: Disturbance,
    /// Whether it observes messages while it is inactive.
    pub(super) observes_inactive: bool,
    pub(super) holds_order: bool,
    pub(super) activity: Activity,
    /// When it last became active.
    pub(super) since: SimTime,
    pub(super) operation_seed: u64,
    /// The only messages that it alters; `None` for all.
    pub(super) messages: Option<Messages>,
    /// Which messages of an activation it alters.
    pub(super) counts: Counts,
    /// Per wire: how many messages there were since it became active, and how many of them it was to alter.
    pub(super) counted: PerWire<(u64, u64)>,
    /// Whether it counts in `fuzzing_time()`.
    pub(super) timed: bool,
    /// Since when it holds messages back without being active.
    pub(super) tail_since: Option<SimTime>,
    /// Earlier intervals of that kind.
    pub(super) tails: Vec<(SimTime, SimTime)>,
    pub(super) counters: Counters,
    pub(super) first_touch: Option<SimTime>,
    pub(super) last_touch: Option<SimTime>,
    /// What it did on wires without a receiver, which may yet be found.
    pub(super) unheard: BTreeMap<Wire, Unheard>,
}

/// What an operation did on a wire without a receiver.
pub(super) struct Unheard {
    pub(super) counters: Counters,
    messages: u64,
    first: SimTime,
    last: SimTime,
}

impl Stage {
    /// Whether it acts on messages of this publisher.
    pub(super) fn concerns(&self, publisher: Option<NodeId>) -> bool {
        self.from.is_empty() || publisher.is_some_and(|publisher| self.from.contains(&publisher))
    }

    /// Whether it alters a message while it is active, by the position of its wire and its number there. Called once
    /// for each message, in order: it counts them.
    pub(super) fn alters(&mut self, member: u64, number: u64) -> bool {
        let listed = self.messages.as_ref().is_none_or(|messages| messages.hold(member, number));
        if self.counts == Counts::ALL {
            return listed;
        }
        let (seen, due) = self.counted.entry(member);
        *seen += 1;
        let is_due = *seen % self.counts.every == 0 && self.counts.next.is_none_or(|next| *due < next);
        *due += u64::from(is_due);
        listed && is_due
    }

    /// Decides on a message that it does not alter, so that what it does to others does not depend on which it alters.
    pub(super) fn decide_on(&mut self, path: &str, context: MessageContext, message: &Value) {
        let mut spared = message.clone();
        match &mut self.disturbance {
            Disturbance::Custom(custom) => drop(custom.on_message(context.now, path, context.draws, &mut spared)),
            disturbance => _ = disturbance.apply(context, &mut spared),
        }
    }

    /// Counts an action on this many messages on a wire with or without a receiver.
    pub(super) fn count(
        &mut self,
        wire: Wire,
        heard: bool,
        now: SimTime,
        messages: u64,
        count: impl FnOnce(&mut Counters) -> &mut u64,
    ) {
        if messages == 0 {
            return;
        }
        if !heard {
            self.counters.unheard += messages;
            let nothing = Unheard { counters: Counters::default(), messages: 0, first: now, last: now };
            let unheard = self.unheard.entry(wire).or_insert(nothing);
            *count(&mut unheard.counters) += messages;
            unheard.messages += messages;
            unheard.last = now;
            return;
        }
        self.acted(now, messages, count);
    }

    /// Counts an action that had an effect.
    pub(super) fn acted(&mut self, now: SimTime, times: u64, count: impl FnOnce(&mut Counters) -> &mut u64) {
        *count(&mut self.counters) += times;
        self.first_touch.get_or_insert(now);
        self.last_touch = Some(now);
    }

    /// A message that it held back is lost.
    pub(super) fn lost(&mut self, wire: Wire, why: Why) {
        let (counters, active) = match why {
            Why::Delayed => (&mut self.counters, true),
            Why::Queued => (&mut self.counters, false),
            Why::Unheard { active } => match self.unheard.get_mut(&wire) {
                Some(unheard) => (&mut unheard.counters, active),
                // Its receiver was found meanwhile.
                None => (&mut self.counters, active),
            },
        };
        let held = if active { &mut counters.delayed } else { &mut counters.queued };
        *held = held.saturating_sub(1);
        counters.dropped += 1;
    }

    /// A receiver of this wire was found that was there all the time: what was done there had an effect.
    pub(super) fn found(&mut self, wire: Wire) {
        let Some(Unheard { counters: found, messages, first, last }) = self.unheard.remove(&wire) else { return };
        let Counters { seen: _, changed, dropped, delayed, queued, injected, side_effects, unheard } =
            &mut self.counters;
        *unheard -= messages;
        *changed += found.changed;
        *dropped += found.dropped;
        *delayed += found.delayed;
        *queued += found.queued;
        *injected += found.injected;
        *side_effects += found.side_effects;
        self.first_touch = Some(self.first_touch.map_or(first, |touch| touch.min(first)));
        self.last_touch = Some(self.last_touch.map_or(last, |touch| touch.max(last)));
    }
}
