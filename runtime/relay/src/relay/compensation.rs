//! Compensation for a reality gap: what the relay does to messages so that a simulation is closer to a lab
//! [SESAME 2023, Section 4.7].

use sesame_base::activation::Activity;
use sesame_base::observation::Counters;
use sesame_base::time::SimTime;
use sesame_plan::{
    Activation, CampaignPlan, Compensation, Distribution, Drain, Fitted, OperationId, Span, Test, TopicId, Values,
};
use sesame_rng::{derive_seed, keyed_unit};

use crate::fuzz::{Amount, Bias, Disturbance, Latency, Noise, Places, Scale};
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
                Fitted::Parameter { name } => self.parameters.push((name.clone(), value)),
                what => self.adjust(plan, what, value, seed),
            }
        }
        self
    }

    fn adjust(&mut self, plan: &CampaignPlan, what: &Fitted, value: f64, seed: u64) {
        let places = |values: &Values| Places::new(&values.places);
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
            None => plan.nodes.iter().any(|node| node.subscribes.contains(&topic)),
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
            timed: false,
            tail_since: None,
            tails: Vec::new(),
            counters: Counters::default(),
            first_touch: None,
            last_touch: None,
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
                self.pipelines[wire.index()].push((at, *member));
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
