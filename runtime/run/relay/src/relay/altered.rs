//! Which messages operations of the test alter, for runs that are asked for them.

use std::collections::BTreeMap;

use sesame_base::observation::{ALTERED_LISTED, AlteredMessage, AlteredMessages};
use sesame_base::time::SimTime;
use sesame_plan::{CampaignPlan, Test};

use crate::relay::{Listener, OperationEvent};
use crate::value::Value;
use crate::wire::{Wire, WireTable};

/// Lists altered messages, up to [`ALTERED_LISTED`].
#[derive(Debug)]
pub(crate) struct AlteredList {
    /// Per operation of the test: the wires that it acts on.
    wires: Vec<Vec<Wire>>,
    /// By operation, position of the wire and number there: when it was first altered.
    found: BTreeMap<(u32, u32, u64), SimTime>,
    /// Whether there are more than that.
    too_many: bool,
}

impl AlteredList {
    /// An empty list for a run of a test.
    pub(crate) fn new(plan: &CampaignPlan, wires: &WireTable, test: &Test) -> AlteredList {
        let acted_on = test.operations.iter().map(|used| wires.acted_on(plan.operation(used.operation)).collect());
        AlteredList { wires: acted_on.collect(), found: BTreeMap::new(), too_many: false }
    }

    /// What the run altered.
    pub(crate) fn listed(self) -> AlteredMessages {
        if self.too_many {
            return AlteredMessages::TooMany;
        }
        let message = |((operation, wire, number), time): ((u32, u32, u64), SimTime)| AlteredMessage {
            operation,
            wire,
            number,
            time: time.seconds(),
        };
        AlteredMessages::Listed(self.found.into_iter().map(message).collect())
    }
}

impl Listener for AlteredList {
    fn published(&mut self, _: SimTime, _: Wire, _: u64, _: &Value) {}

    fn delivered(&mut self, _: SimTime, _: Wire, _: u64, _: &Value) {}

    fn operated(&mut self, now: SimTime, operation: usize, event: OperationEvent) {
        let message = match event {
            OperationEvent::Started | OperationEvent::Ended => return,
            OperationEvent::Changed(message)
            | OperationEvent::Dropped(message)
            | OperationEvent::Injected(message)
            | OperationEvent::Delayed(message, _) => message,
        };
        let wire = self.wires[operation].iter().position(|&wire| wire == message.wire);
        let [operation, wire] =
            [operation, wire.unwrap_or_default()].map(|position| u32::try_from(position).unwrap_or(u32::MAX));
        let key = (operation, wire, message.index);
        if self.found.len() < ALTERED_LISTED || self.found.contains_key(&key) {
            self.found.entry(key).or_insert(now);
        } else {
            self.too_many = true;
        }
    }
}
