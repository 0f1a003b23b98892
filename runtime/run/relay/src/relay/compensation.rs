//! Compensation for a reality gap: what the relay does to messages so that a simulation is closer to a lab
//! [SESAME 2023, Section 4.7].

use std::collections::BTreeMap;

use sesame_base::activation::Activity;
use sesame_base::observation::Counters;
use sesame_base::time::SimTime;
use sesame_plan::{
    Activation, CampaignPlan, Compensation, Counts, Distribution, Drain, Fitted, OperationId, Span, Test, TopicId,
    Values,
};
use sesame_rng::{derive_seed, keyed_unit};

use crate::fuzz::{Amount, Bias, Disturbance, Latency, Noise, OnWire, PerWire, Places, Scale};
use crate::relay::Relay;
use crate::relay::stage::Stage;

impl Relay<'_> {
    /// The same relay with what compensates for a reality gap. What a run draws depends on its test and on the seed of
    /// its simulator only.
    ///
    /// It acts behind the operations of the test, during the whole run. Metrics and listeners do not see it: it stands
    /// for what the robots do to messages that were delivered to them.
    #[must_use]
    pub fn compensated(mut self, plan: &CampaignPlan, test: &Test, simulator_seed: u64) -> Self {
        let Some(Compensation { lab: _, adjustments }) = &plan.compensation else { return self };
        let of_test: Vec<u64> = test.operations.iter().map(|operation| operation.operation_seed).collect();
        let seed = derive_seed(simulator_seed, "compensation", &of_test);
        for (at, adjustment) in (0u64..).zip(adjustments) {
            let seed = derive_seed(seed, "adjustment", &[at]);
            let value = drawn(&adjustment.levels, seed);
            match &adjustment.what {
                Fitted::Parameter { name } => self.beginning.parameters.push((name.clone(), value)),
                what => self.adjust(plan, what, value, seed),
            }
        }
        self
    }

    fn adjust(&mut self, plan: &CampaignPlan, what: &Fitted, value: f64, seed: u64) {
        let places = |values: &Values| Places::new([values.places.as_slice()]);
        let disturbance = match what {
            Fitted::Delay { .. } => Disturbance::Latency(Latency {
                delay: (value, value),
                distribution: Distribution::Fixed,
                drain: Drain::Finish,
            }),
            Fitted::Scale(values) => Disturbance::Scale(Scale { places: places(values), factor: value }),
            Fitted::Bias(values) => Disturbance::Bias(Bias { places: places(values), bias: Amount::Number(value) }),
            Fitted::Noise(values) => Disturbance::Noise(Noise { places: places(values), sigma: value }),
            Fitted::Parameter { .. } => return,
        };
        let concerned = |topic: TopicId| match what.topic() {
            Some(only) => topic == only,
            None => plan.nodes.iter().any(|node| node.subscribes(topic)),
        };
        // Longer than any run, so that it never ends within one.
        let always = Span { start: 0.0, end: plan.campaign.end_after + 1.0 };
        let activation = Activation::Time { start: always.start, end: always.end };
        let at = self.operations.len();
        self.operations.push(Stage {
            operation: OperationId(u32::MAX),
            name: "compensation".to_owned(),
            from: Vec::new(),
            observes_inactive: disturbance.observes_inactive(),
            holds_order: disturbance.holds_order(),
            disturbance,
            activity: Activity::new(&activation, always),
            since: SimTime::ZERO,
            operation_seed: seed,
            messages: None,
            counts: Counts::ALL,
            counted: PerWire::default(),
            timed: false,
            tail_since: None,
            tails: Vec::new(),
            counters: Counters::default(),
            first_touch: None,
            last_touch: None,
            unheard: BTreeMap::new(),
        });
        let wires = self.wires;
        let mut members = vec![0; plan.topics.len()];
        for wire in wires.iter() {
            let topic = wires.topic(wire);
            if !concerned(topic) {
                continue;
            }
            let member = &mut members[topic.index()];
            let links = wires.links().iter().filter(|link| link.of == wire).map(|link| link.wire);
            for wire in std::iter::once(wire).chain(links) {
                // The stage's random numbers differ from wire to wire.
                self.pipelines[wire.index()].push((at, OnWire { member: *member, target: 0 }));
            }
            *member += 1;
        }
        self.queue.add_operation();
    }
}

/// The level that a run draws.
fn drawn(levels: &[f64], seed: u64) -> f64 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "it is in the range of positions")]
    let at = (keyed_unit(seed, 0, 0) * levels.len() as f64) as usize;
    levels[at.min(levels.len() - 1)]
}

#[cfg(test)]
mod tests {
    use sesame_plan::testing::{node, operation, plan, test_of, use_of};
    use sesame_plan::{Adjustment, Choice, Node, OperationKind, TopicMembers};

    use super::*;
    use crate::metric::MetricTable;
    use crate::relay::{Delivery, Exchange, Finished, Listener};
    use crate::value::Value;
    use crate::wire::{Wire, WireTable};

    const COMMAND: TopicId = TopicId(0);

    fn values() -> Values {
        Values { topic: COMMAND, places: Vec::new() }
    }

    fn adjusted(adjustments: &[(Fitted, &[f64])]) -> Compensation {
        let adjustments =
            adjustments.iter().map(|(what, levels)| Adjustment { what: what.clone(), levels: levels.to_vec() });
        Compensation { lab: "hall".to_owned(), adjustments: adjustments.collect() }
    }

    /// A plan with a node that receives commands.
    fn model() -> CampaignPlan {
        let mut plan = plan(vec![operation(0, OperationKind::Bias)]);
        plan.nodes = vec![Node { subscribes: vec![TopicMembers::All(COMMAND)], ..node("drive") }];
        plan
    }

    /// What listeners are told was delivered.
    #[derive(Default)]
    struct Told(Vec<f64>);

    impl Listener for Told {
        fn published(&mut self, _: SimTime, _: Wire, _: u64, _: &Value) {}
        fn delivered(&mut self, _: SimTime, _: Wire, _: u64, value: &Value) {
            self.0.extend(value.number_at::<&str>(&[]));
        }
    }

    struct Run {
        /// What was delivered, with its time in tenths of a second.
        delivered: Vec<(i64, f64)>,
        told: Vec<f64>,
        finished: Finished,
        parameters: Vec<(String, f64)>,
    }

    /// Ten commands, 1 at each tenth of a second.
    fn relayed(plan: &CampaignPlan, test: &Test, seed: u64) -> Run {
        let mut told = Told::default();
        let wires = WireTable::new(plan);
        let metrics = MetricTable::new(plan, &wires, &[]).unwrap();
        let relay = Relay::new(plan, &wires, test, metrics.start(), &[]).unwrap().received_everywhere();
        let mut relay = relay.compensated(plan, test, seed).tapped(&mut told);
        let parameters = relay.parameters().to_vec();
        let mut delivered = Vec::new();
        for tick in 0..100 {
            let (now, mut out) = (SimTime::from_nanos(tick * 100_000_000), Vec::new());
            relay.advance(now, &mut out);
            if tick < 10 {
                relay.message(now, wires.find("arm/command").unwrap(), Value::Real(1.0), &mut out);
            }
            let number = |delivery: Delivery| (tick, delivery.value.number_at::<&str>(&[]).unwrap());
            delivered.extend(out.into_iter().map(number));
        }
        let finished = relay.finish(SimTime::from_seconds(10.0));
        Run { delivered, told: told.0, finished, parameters }
    }

    #[test]
    fn it_acts_behind_the_test_and_nothing_of_the_run_but_deliveries_shows_it() {
        let mut plan = model();
        let test = test_of(vec![use_of(0, 0.0, 0.5, vec![Choice::Value { value: 2.0 }], 1)]);
        let before = relayed(&plan, &test, 1);
        plan.compensation = Some(adjusted(&[
            (Fitted::Delay { topic: None }, &[0.3]),
            (Fitted::Scale(values()), &[2.0]),
            (Fitted::Bias(values()), &[0.5]),
            (Fitted::Parameter { name: "servo_gain".to_owned() }, &[0.9]),
        ]));
        let after = relayed(&plan, &test, 1);
        let expected: Vec<(i64, f64)> = (0..10).map(|tick| (tick + 3, if tick < 5 { 6.5 } else { 2.5 })).collect();
        assert_eq!(after.delivered, expected);
        assert_eq!(after.parameters, [("servo_gain".to_owned(), 0.9)]);
        // The operation, what is told of what was delivered, and the fuzzing time are those of the test.
        assert_eq!(after.finished.operations, before.finished.operations);
        assert_eq!(after.finished.metrics, before.finished.metrics);
        assert_eq!((&after.told, after.told[0], after.told[9]), (&before.told, 3.0, 1.0));
    }

    #[test]
    fn a_run_draws_one_of_the_levels_of_noise_and_always_the_same_one() {
        let mut plan = model();
        plan.compensation = Some(adjusted(&[(Fitted::Noise(values()), &[0.0, 5.0])]));
        let test = test_of(vec![]);
        let of = |seed| relayed(&plan, &test, seed).delivered;
        let noisy = |run: &[(i64, f64)]| run.iter().any(|(_, value)| *value != 1.0);
        let runs: Vec<_> = (0..40).map(of).collect();
        let count = runs.iter().filter(|run| noisy(run)).count();
        assert!((8..=32).contains(&count), "{count} of 40 draw the level above 0");
        assert_eq!(runs, (0..40).map(of).collect::<Vec<_>>());
        let noisy: Vec<_> = runs.iter().filter(|run| noisy(run)).collect();
        assert_ne!(noisy[0], noisy[1], "the noise itself is drawn anew");
    }

    #[test]
    fn without_a_subscriber_there_is_nothing_to_delay() {
        let mut plan = model();
        plan.nodes.clear();
        plan.compensation = Some(adjusted(&[(Fitted::Delay { topic: None }, &[0.3])]));
        assert_eq!(relayed(&plan, &test_of(vec![]), 1).delivered[0], (0, 1.0));
        plan.compensation = Some(adjusted(&[(Fitted::Delay { topic: Some(COMMAND) }, &[0.3])]));
        assert_eq!(relayed(&plan, &test_of(vec![]), 1).delivered[0], (3, 1.0));
    }
}
