//! Monitors in the relay: when they hear, decide and publish.
//!
//! What a monitor publishes takes the same way as a message of the simulator: through inbound metrics, conditions,
//! operations and outbound metrics to its subscribers, at the same instant. It belongs to the event that caused it, so
//! it waits in a queue until that event is over. Conditions see new states of monitors when the queue is empty: an
//! operation that begins because of a decision does not act on the message that tells of it.
//!
//! Monitors begin with the run, but what they publish at time zero waits until the transport advances time: before
//! that, not all subscribers may be there.

use sesame_base::activation::TICK;
use sesame_base::time::SimTime;
use sesame_plan::{MonitorId, Side};

use crate::monitor::Monitors;
use crate::relay::{Delivery, PUBLISHED_LIMIT, Phase, Relay};
use crate::value::Value;
use crate::wire::Wire;

impl Relay<'_> {
    /// The same relay in which these monitors send no mitigation. Everything else that they do stays as it is.
    #[must_use]
    pub(crate) fn withholding(mut self, monitors: &[MonitorId]) -> Self {
        if let Some(all) = &mut self.monitors {
            all.withhold(monitors);
        }
        self
    }

    /// Monitors hear a message.
    pub(super) fn monitors_hear(&mut self, side: Side, wire: Wire, index: u64, value: &Value) {
        if let Some(monitors) = &mut self.monitors {
            monitors.hear(self.now, side, wire, index, value);
        }
    }

    /// Ends an event, after its messages were delivered: monitors decide, and what they publish is passed on. Evaluates
    /// conditions that read what may have changed.
    pub(super) fn end_event(&mut self, deliveries: &mut Vec<Delivery>) {
        self.decide(deliveries);
        if self.conditions.reads_delivered {
            self.evaluate_conditions();
        }
    }

    fn decide(&mut self, deliveries: &mut Vec<Delivery>) {
        let Some(monitors) = &mut self.monitors else { return };
        monitors.decide(self.now);
        self.tell_decided();
        // What is published may release messages that were held back; whoever empties the queue goes on with it.
        if self.publishing.busy {
            return;
        }
        self.publishing.busy = true;
        let mut published = 0;
        while self.publishing.open
            && let Some((wire, value)) = self.monitors.as_mut().and_then(Monitors::publication)
        {
            published += 1;
            self.publish(self.now, wire, None, true, value, deliveries);
            if let Some(monitors) = &mut self.monitors {
                monitors.decide(self.now);
                if published == PUBLISHED_LIMIT {
                    self.publishing.endless |= monitors.give_up() > 0;
                }
            }
            self.tell_decided();
        }
        self.publishing.busy = false;
        self.show_scores();
    }

    /// Tells listeners what monitors decided.
    #[inline]
    fn tell_decided(&mut self) {
        // Most messages decide nothing.
        let Some(monitors) = self.monitors.as_mut().filter(|monitors| monitors.has_decided()) else { return };
        for decided in monitors.take_decided() {
            self.taps.iter_mut().for_each(|tap| tap.decided(&decided));
        }
    }

    /// Conditions see what monitors are now.
    pub(super) fn show_scores(&mut self) {
        if let Some(monitors) = &mut self.monitors {
            monitors.show(self.now, &mut self.metrics);
        }
    }

    /// Sends what monitors publish at time zero, once.
    pub(super) fn open_publishing(&mut self, deliveries: &mut Vec<Delivery>) {
        if self.monitors.is_some() && !self.publishing.open && self.phase == Phase::Running {
            self.publishing.open = true;
            self.end_event(deliveries);
        }
    }

    /// What monitors have to do at this instant without a message: evidence has been held for long enough, or is stale.
    pub(super) fn monitors_arrive(&mut self, deliveries: &mut Vec<Delivery>) {
        let Some(monitors) = &mut self.monitors else { return };
        monitors.advance(self.now);
        if self.phase == Phase::Over {
            monitors.give_up();
        }
        self.end_event(deliveries);
    }

    /// Ends an instant for evidence that reads several topics: monitors decide on it, and what they publish is of this
    /// instant too.
    #[inline]
    pub(super) fn settle_monitors(&mut self, deliveries: &mut Vec<Delivery>) {
        if self.monitors.as_ref().is_some_and(Monitors::wait) {
            self.settle_all_monitors(deliveries);
        }
    }

    #[inline(never)]
    fn settle_all_monitors(&mut self, deliveries: &mut Vec<Delivery>) {
        for _ in 0..PUBLISHED_LIMIT {
            let Some(monitors) = &mut self.monitors else { return };
            if !monitors.settle(self.now) {
                return;
            }
            if self.phase == Phase::Over {
                monitors.give_up();
            }
            self.end_event(deliveries);
        }
        if let Some(monitors) = &mut self.monitors {
            monitors.stop_waiting();
            self.publishing.endless = true;
        }
    }

    /// Monitors learn that an instant is over. Returns whether that made values known.
    pub(super) fn monitors_leave(&mut self) -> bool {
        if self.monitors.is_none() {
            return false;
        }
        let fuzzing_time = self.fuzzing_time();
        let Some(monitors) = &mut self.monitors else { return false };
        monitors.end_instant(self.now, &mut self.metrics, fuzzing_time)
    }

    /// Whether the end of this instant makes values known that are scores of monitors.
    pub(super) fn monitors_wait(&self) -> bool {
        self.monitors.as_ref().is_some_and(|monitors| monitors.sees_hazard(&self.metrics, self.fuzzing_time()))
    }

    /// When monitors have something to do next without a message.
    pub(super) fn monitors_due(&self) -> Option<SimTime> {
        let monitors = self.monitors.as_ref()?;
        if monitors.wait() {
            return Some(self.now + TICK);
        }
        if self.phase == Phase::Running && !self.publishing.open && monitors.has_publication() {
            return Some(self.now);
        }
        monitors.next_due()
    }

    /// The run has come to its end.
    pub(super) fn monitors_end(&mut self, now: SimTime) {
        let fuzzing_time = self.fuzzing_time();
        if let Some(monitors) = &mut self.monitors {
            monitors.end(now, &mut self.metrics, fuzzing_time);
        }
        self.tell_decided();
    }

    /// The run broke off.
    pub(super) fn monitors_break_off(&mut self) {
        if let Some(monitors) = &mut self.monitors {
            monitors.settle_whole(self.now);
            monitors.stop_waiting();
        }
        self.tell_decided();
        self.show_scores();
        self.monitors_leave();
        if let Some(monitors) = &mut self.monitors {
            monitors.break_off(self.now, &mut self.metrics);
        }
    }
}
