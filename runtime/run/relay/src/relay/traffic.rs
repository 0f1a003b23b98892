//! What is published on each wire: how often, and how long it was silent.

use sesame_base::observation::{Traffic, Unreached};
use sesame_base::time::SimTime;
use sesame_plan::{CampaignPlan, NodeId, OperationId, Span, Test};

use crate::wire::{Wire, WireTable};

/// How many gaps of a wire are kept for their median.
const SAMPLE: usize = 512;

/// The traffic of one run.
pub(super) struct Recorder {
    wires: Vec<Option<Heard>>,
    /// In a run without operations: those of the campaign that have met nothing so far, in order of declaration.
    unreached: Vec<Reached>,
    /// Whether one of these waits for a message, by wire: seldom after the first few.
    awaited: Vec<bool>,
}

/// What was heard on a wire.
struct Heard {
    messages: u64,
    first: SimTime,
    last: SimTime,
    /// The longest gap: how long it is, and when it ends.
    gap: (SimTime, SimTime),
    gaps: Sample,
}

/// An even sample of a series of any length: every `stride`th of its values, where the stride is a power of two.
struct Sample {
    kept: Vec<i64>,
    stride: u64,
    seen: u64,
}

/// What an operation would have met.
struct Reached {
    operation: OperationId,
    /// Whether it may act on a wire.
    wires: Vec<bool>,
    from: Vec<NodeId>,
    within: (SimTime, SimTime),
    /// The message that is nearest to `within`, and how far away it is.
    nearest: Option<(SimTime, SimTime)>,
}

impl Recorder {
    pub(super) fn new(plan: &CampaignPlan, wires: &WireTable, test: &Test) -> Self {
        let operations = (0..).map(OperationId).zip(&plan.operations).filter(|_| test.operations.is_empty());
        let unreached = operations.filter_map(|(id, operation)| {
            let Span { start, end } = operation.within;
            let mut reached = vec![false; wires.len()];
            let member = |wire| operation.may_act_on(wires.topic(wire), wires.member(wire));
            wires.iter().for_each(|wire| reached[wire.index()] = member(wire));
            operation.topic.map(|_| Reached {
                operation: id,
                wires: reached,
                from: operation.from.clone(),
                within: (SimTime::from_seconds(start), SimTime::from_seconds(end)),
                nearest: None,
            })
        });
        let unreached: Vec<Reached> = unreached.collect();
        let waits = |wire: Wire| unreached.iter().any(|reached| reached.wires[wire.index()]);
        Recorder { wires: wires.iter().map(|_| None).collect(), awaited: wires.iter().map(waits).collect(), unreached }
    }

    /// Whether an operation waits for a message on a wire.
    #[inline]
    pub(super) fn is_awaited(&self, wire: Wire) -> bool {
        self.awaited[wire.index()]
    }

    /// A message was published on a wire, by a node or by a monitor of the runner: operations act on both.
    #[inline(never)]
    pub(super) fn meets(&mut self, now: SimTime, wire: Wire, publisher: Option<NodeId>) {
        let at = wire.index();
        self.unreached.retain_mut(|reached| !reached.wires[at] || !reached.is_met(now, publisher));
        self.awaited[at] = self.unreached.iter().any(|reached| reached.wires[at]);
    }

    /// The system said something. What monitors of the runner publish is no sign of life.
    #[inline]
    pub(super) fn heard(&mut self, now: SimTime, wire: Wire) {
        match &mut self.wires[wire.index()] {
            Some(heard) => heard.again(now),
            wire => *wire = Some(Heard::first(now)),
        }
    }

    /// What was published on each wire that spoke.
    pub(super) fn traffic(&self) -> Vec<Traffic> {
        let spoke = (0..).zip(&self.wires).filter_map(|(wire, heard)| Some((wire, heard.as_ref()?)));
        let traffic = spoke.map(|(wire, heard)| Traffic {
            wire,
            messages: heard.messages,
            first: heard.first.seconds(),
            last: heard.last.seconds(),
            gap: Span { start: (heard.gap.1 - heard.gap.0).seconds(), end: heard.gap.1.seconds() },
            median_gap: SimTime::from_nanos(heard.gaps.median()).seconds(),
        });
        traffic.collect()
    }

    /// The operations of the campaign that would have met no message.
    pub(super) fn unreached(&self) -> Vec<Unreached> {
        let nearest = |reached: &Reached| reached.nearest.map(|(_, time)| time.seconds());
        self.unreached
            .iter()
            .map(|reached| Unreached { operation: reached.operation, nearest: nearest(reached) })
            .collect()
    }
}

impl Reached {
    /// Whether this message is one that it would have met; if not, how near it was is kept.
    fn is_met(&mut self, now: SimTime, publisher: Option<NodeId>) -> bool {
        if !self.from.is_empty() && !publisher.is_some_and(|node| self.from.contains(&node)) {
            return false;
        }
        let (start, end) = self.within;
        let away = if now < start {
            start - now
        } else if now >= end {
            now - end
        } else {
            return true;
        };
        if self.nearest.is_none_or(|(nearest, _)| away < nearest) {
            self.nearest = Some((away, now));
        }
        false
    }
}

impl Heard {
    fn first(now: SimTime) -> Self {
        let gaps = Sample { kept: Vec::new(), stride: 1, seen: 0 };
        Heard { messages: 1, first: now, last: now, gap: (SimTime::ZERO, now), gaps }
    }

    #[inline]
    fn again(&mut self, now: SimTime) {
        self.messages += 1;
        // Several messages of one instant are no gap.
        if now > self.last {
            let gap = now - self.last;
            if gap > self.gap.0 {
                self.gap = (gap, now);
            }
            self.gaps.add(gap.nanos());
            self.last = now;
        }
    }
}

impl Sample {
    #[inline]
    fn add(&mut self, value: i64) {
        if self.is_due() {
            self.keep(value);
        }
        self.seen += 1;
    }

    /// Whether the next value is one of the sample's: `is_multiple_of`, but without a division for each message.
    fn is_due(&self) -> bool {
        self.seen & (self.stride - 1) == 0
    }

    #[inline(never)]
    fn keep(&mut self, value: i64) {
        if self.kept.len() == SAMPLE {
            let mut at = 0;
            self.kept.retain(|_| {
                at += 1;
                at % 2 == 1
            });
            self.stride *= 2;
        }
        // After the stride has grown, this value may no longer be one of the sample's.
        if self.is_due() {
            self.kept.push(value);
        }
    }

    /// The lower median; 0 of nothing.
    fn median(&self) -> i64 {
        let mut sorted = self.kept.clone();
        sorted.sort_unstable();
        sorted.get(sorted.len().saturating_sub(1) / 2).copied().unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use sesame_plan::testing::{operation, plan};
    use sesame_plan::{OperationKind, TopicId};

    use super::*;

    fn at(tenths: u32) -> SimTime {
        SimTime::from_seconds(f64::from(tenths) / 10.0)
    }

    proptest! {
        #[test]
        fn traffic_is_what_the_list_of_all_messages_says(times in prop::collection::vec(0u32..400, 0..60)) {
            let plan = plan(vec![]);
            let wires = WireTable::new(&plan);
            let mut recorder = Recorder::new(&plan, &wires, &Test::default());
            let mut times = times;
            times.sort_unstable();
            let wire = wires.iter().next().unwrap();
            for &time in &times {
                recorder.heard(at(time), wire);
            }
            let traffic = recorder.traffic();
            prop_assert_eq!(traffic.len(), usize::from(!times.is_empty()));
            if let [shown] = traffic[..] {
                let mut gaps: Vec<f64> = times.windows(2).map(|pair| at(pair[1]).seconds() - at(pair[0]).seconds()).collect();
                gaps.retain(|gap| *gap > 0.0);
                gaps.sort_by(f64::total_cmp);
                prop_assert_eq!(shown.messages, times.len() as u64);
                prop_assert_eq!((shown.first, shown.last), (at(times[0]).seconds(), at(*times.last().unwrap()).seconds()));
                prop_assert!((shown.gap.length() - gaps.last().copied().unwrap_or(0.0)).abs() < 1e-9);
                let median = if gaps.is_empty() { 0.0 } else { gaps[(gaps.len() - 1) / 2] };
                prop_assert!((shown.median_gap - median).abs() < 1e-9);
            }
        }

        #[test]
        fn an_operation_is_unreached_exactly_if_no_message_lies_in_its_window(
            times in prop::collection::vec(0u32..100, 0..6), start in 0u32..90, length in 1u32..30,
        ) {
            let within = Span { start: at(start).seconds(), end: at(start + length).seconds() };
            let plan = plan(vec![sesame_plan::Operation { within, ..operation(0, OperationKind::Blackhole) }]);
            let wires = WireTable::new(&plan);
            let mut recorder = Recorder::new(&plan, &wires, &Test::default());
            let wire = wires.iter().find(|&wire| wires.topic(wire) == TopicId(0)).unwrap();
            let mut times = times;
            times.sort_unstable();
            for &time in &times {
                recorder.meets(at(time), wire, None);
            }
            let inside = times.iter().any(|time| (start..start + length).contains(time));
            let unreached = recorder.unreached();
            prop_assert_eq!(unreached.is_empty(), inside);
            if let [unreached] = unreached[..] {
                let away = |time: u32| if time < start { start - time } else { time - (start + length) };
                let nearest = times.iter().map(|&time| away(time)).min();
                let shown = unreached.nearest.map(|shown| times.iter().find(|&&time| at(time).seconds() == shown));
                prop_assert_eq!(shown.map(|time| away(*time.expect("it is the time of a message"))), nearest);
            }
        }
    }

    #[test]
    fn the_median_of_a_long_run_is_that_of_an_even_sample() {
        let mut sample = Sample { kept: Vec::new(), stride: 1, seen: 0 };
        (0..100_000).for_each(|value| sample.add(value));
        assert!(sample.kept.len() <= SAMPLE && sample.kept.len() > SAMPLE / 2);
        assert!(sample.kept.iter().zip(0..).all(|(&value, at)| value == at * i64::try_from(sample.stride).unwrap()));
        assert!(sample.median().abs_diff(50_000) < 500);
    }

    #[test]
    fn messages_that_other_nodes_publish_do_not_count_and_tests_have_no_such_list() {
        let of_robot = sesame_plan::Operation { from: vec![NodeId(1)], ..operation(0, OperationKind::Blackhole) };
        let plan = plan(vec![of_robot]);
        let wires = WireTable::new(&plan);
        let mut recorder = Recorder::new(&plan, &wires, &Test::default());
        let wire = wires.iter().find(|&wire| wires.topic(wire) == TopicId(0)).unwrap();
        recorder.meets(at(5), wire, Some(NodeId(0)));
        recorder.meets(at(5), wire, None);
        assert_eq!(recorder.unreached().len(), 1);
        recorder.meets(at(6), wire, Some(NodeId(1)));
        assert_eq!(recorder.unreached(), []);
    }
}
