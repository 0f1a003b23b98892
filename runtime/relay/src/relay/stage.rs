//! One operation of the test that runs: its state, and what it has done.

use sesame_base::activation::Activity;
use sesame_base::observation::Counters;
use sesame_base::time::SimTime;
use sesame_plan::{NodeId, OperationId};

use crate::fuzz::Disturbance;

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
    /// Whether it counts in `fuzzing_time()`.
    pub(super) timed: bool,
    /// Since when it holds messages back without being active.
    pub(super) tail_since: Option<SimTime>,
    /// Earlier intervals of that kind.
    pub(super) tails: Vec<(SimTime, SimTime)>,
    pub(super) counters: Counters,
    pub(super) first_touch: Option<SimTime>,
    pub(super) last_touch: Option<SimTime>,
}

impl Stage {
    /// Whether it acts on messages of this publisher.
    pub(super) fn concerns(&self, publisher: Option<NodeId>) -> bool {
        self.from.is_empty() || publisher.is_some_and(|publisher| self.from.contains(&publisher))
    }

    /// Counts an action on this many messages on a wire with or without a receiver.
    pub(super) fn count(
        &mut self,
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
            return;
        }
        *count(&mut self.counters) += messages;
        self.first_touch.get_or_insert(now);
        self.last_touch = Some(now);
    }
}
