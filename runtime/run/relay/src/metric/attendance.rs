//! Which wires a formula hears at every instant at which it hears any.
//!
//! If a run breaks off, its last instant may be incomplete: what was still to come in it is not known. It counts if
//! each wire that was heard at every earlier instant was heard in it too.

use std::collections::BTreeMap;

use sesame_base::time::SimTime;
use sesame_plan::{CampaignPlan, Input, TopicId};

/// By member of a topic: the number of instants in which it was heard, and the last of them.
type Heard = BTreeMap<usize, (u64, SimTime)>;

/// The instants of one formula.
pub(super) struct Attendance {
    /// Per topic of the inputs, the members that they read.
    topics: Vec<(TopicId, Heard)>,
    /// The number of instants at which anything was heard, and the last of them.
    instants: (u64, SimTime),
}

impl Attendance {
    /// Before the first message.
    pub(super) fn new(inputs: &[Input], plan: &CampaignPlan) -> Self {
        let mut topics: Vec<(TopicId, Heard)> = Vec::new();
        for topic in inputs.iter().map(|input| input.field.topic) {
            if topics.iter().all(|(known, _)| *known != topic) {
                let is_read = |member: &usize| inputs.iter().any(|input| input.reads(topic, *member));
                let members = (0..plan.topic(topic).paths.len()).filter(is_read);
                topics.push((topic, members.map(|member| (member, (0, SimTime::ZERO))).collect()));
            }
        }
        Attendance { topics, instants: (0, SimTime::ZERO) }
    }

    /// A message on the `member`th path of a topic.
    pub(super) fn heard(&mut self, now: SimTime, topic: TopicId, member: usize) {
        let count = |(instants, last): &mut (u64, SimTime)| {
            if *instants == 0 || *last != now {
                (*instants, *last) = (*instants + 1, now);
            }
        };
        count(&mut self.instants);
        let members = self.topics.iter_mut().find(|(known, _)| *known == topic).map(|(_, members)| members);
        if let Some(wire) = members.and_then(|members| members.get_mut(&member)) {
            count(wire);
        }
    }

    /// Whether anything was heard.
    pub(super) fn has_begun(&self) -> bool {
        self.instants.0 > 0
    }

    /// Whether the last instant is complete, as far as can be told.
    pub(super) fn is_complete(&self) -> bool {
        let (instants, now) = self.instants;
        let wires = self.topics.iter().flat_map(|(_, members)| members.values());
        instants > 0 && wires.copied().all(|(heard, last)| (heard > 0 && last == now) || heard + 1 < instants)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use sesame_plan::testing::plan;
    use sesame_plan::{FieldRef, Members};

    use super::*;

    proptest! {
        #[test]
        fn an_instant_is_complete_if_all_spoke_in_it_who_always_did(
            spoke in prop::collection::vec(prop::collection::vec(any::<bool>(), 3), 1..8),
        ) {
            // `arm/command`, and both members of `zones`.
            let input = |topic| Input::new(FieldRef { topic: TopicId(topic), path: Vec::new() }, Members::Min);
            let mut attendance = Attendance::new(&[input(1), input(0), input(1)], &plan(Vec::new()));
            let spoke: Vec<Vec<bool>> = spoke.into_iter().filter(|instant| instant.contains(&true)).collect();
            for (at, instant) in (0..).zip(&spoke) {
                for (wire, _) in instant.iter().enumerate().filter(|(_, spoke)| **spoke) {
                    let (topic, member) = if wire == 0 { (0, 0) } else { (1, wire - 1) };
                    attendance.heard(SimTime::from_nanos(at), TopicId(topic), member);
                    attendance.heard(SimTime::from_nanos(at), TopicId(topic), member);
                }
            }
            let complete = spoke.split_last().is_some_and(|(last, earlier)| {
                (0..3).all(|wire| last[wire] || earlier.iter().any(|instant| !instant[wire]))
            });
            prop_assert_eq!(attendance.is_complete(), complete);
        }
    }
}
