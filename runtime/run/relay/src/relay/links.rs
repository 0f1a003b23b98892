//! Operations that act on the messages of some publishers, or on their way to some subscribers.

use sesame_base::observation::Counters;
use sesame_base::time::SimTime;
use sesame_plan::testing::{latency, node, operation, plan, ros2, test_of, topics, use_of};
use sesame_plan::{CampaignPlan, Choice, Distribution, Drain, Node, NodeId, Operation, OperationKind, Test, Wiring};

use crate::metric::MetricTable;
use crate::relay::{Exchange, Finished, Relay};
use crate::value::Value;
use crate::wire::WireTable;

const COMMAND: &str = "arm/command";
const LEFT: NodeId = NodeId(0);
const RIGHT: NodeId = NodeId(1);

/// A plan of these operations in which the nodes `left` and `right` are told apart as subscribers of the commands.
fn plan_of(operations: Vec<Operation>) -> CampaignPlan {
    let mut plan = plan(operations);
    plan.nodes = ["left", "right"].map(|name| Node { subscribes: topics(&[0]), ..node(name) }).to_vec();
    let mut wiring = vec![Wiring::default(); plan.topics.len()];
    wiring[0] = Wiring { cut: true, publishers: vec![LEFT], subscribers: vec![LEFT, RIGHT], joined: false };
    plan.simulator = ros2(0, wiring);
    plan
}

/// Publishes 0, 1, … 9 once a second, the even ones by `left`; gives what was delivered: seconds, wire, number of the
/// message, value.
fn relayed(plan: &CampaignPlan, test: &Test, hears: &[&str]) -> (Vec<(f64, String, u64, f64)>, Finished) {
    let wires = WireTable::new(plan);
    let metrics = MetricTable::new(plan, &wires, &[]).unwrap();
    let mut relay = Relay::new(plan, &wires, test, metrics.start(), &[]).unwrap();
    let all: Vec<_> = wires.iter().chain(wires.links().iter().map(|link| link.wire)).collect();
    for wire in all {
        if hears.contains(&wires.path(wire)) {
            relay.subscribed(wire);
        }
    }
    let command = wires.find(COMMAND).unwrap();
    let mut delivered = Vec::new();
    for second in 0u8..10 {
        let now = SimTime::from_seconds(f64::from(second));
        let publisher = if second % 2 == 0 { LEFT } else { RIGHT };
        let mut out = Vec::new();
        relay.message_from(now, command, Some(publisher), Value::Real(f64::from(second)), &mut out);
        delivered.extend(out.into_iter().map(|delivery| {
            let value = delivery.value.number_at::<&str>(&[]).unwrap();
            (now.seconds(), wires.path(delivery.wire).to_owned(), delivery.index, value)
        }));
    }
    (delivered, relay.finish(SimTime::from_seconds(10.0)))
}

fn on<'a>(delivered: &'a [(f64, String, u64, f64)], path: &str) -> Vec<(f64, f64)> {
    let on: Vec<&'a _> = delivered.iter().filter(|(_, wire, ..)| wire == path).collect();
    assert!(on.iter().all(|(.., index, value)| *index as f64 == *value), "a delivery says which message it comes from");
    on.into_iter().map(|&(now, .., value)| (now, value)).collect()
}

#[test]
fn of_two_subscribers_one_is_disturbed_and_the_other_gets_every_message_untouched() {
    let mut lost = operation(0, OperationKind::Blackhole);
    lost.to = vec![RIGHT];
    let mut late = operation(0, latency(Distribution::Fixed, Drain::Finish));
    late.to = vec![LEFT];
    let plan = plan_of(vec![lost, late]);
    let test =
        test_of(vec![use_of(0, 2.0, 5.0, vec![], 1), use_of(1, 6.0, 9.0, vec![Choice::Value { value: 1.5 }], 1)]);
    let everywhere = [COMMAND, "arm/command/to/left", "arm/command/to/right"];
    let (delivered, finished) = relayed(&plan, &test, &everywhere);
    let all: Vec<(f64, f64)> = (0u8..10).map(|n| (f64::from(n), f64::from(n))).collect();
    assert_eq!(on(&delivered, COMMAND), all, "those without a link of their own");
    let right = all.iter().copied().filter(|&(at, _)| !(2.0..5.0).contains(&at)).collect::<Vec<_>>();
    assert_eq!(on(&delivered, "arm/command/to/right"), right);
    let left = on(&delivered, "arm/command/to/left");
    assert_eq!(left[..6], all[..6]);
    assert_eq!(left[6..], [(8.0, 6.0), (9.0, 7.0)], "seen at the first event after its release; two are still held");
    let [dropped, delayed] = [0, 1].map(|at| finished.operations[at].counters);
    assert_eq!(dropped, Counters { seen: 3, dropped: 3, ..Counters::default() });
    assert_eq!((delayed.seen, delayed.delayed), (3, 3));
}

#[test]
fn only_messages_of_the_named_publisher_are_disturbed() {
    let mut lost = operation(0, OperationKind::Blackhole);
    lost.from = vec![LEFT];
    let plan = plan_of(vec![lost]);
    let (delivered, finished) = relayed(&plan, &test_of(vec![use_of(0, 0.0, 10.0, vec![], 1)]), &[COMMAND]);
    assert_eq!(on(&delivered, COMMAND), [1.0, 3.0, 5.0, 7.0, 9.0].map(|n| (n, n)));
    assert_eq!(finished.operations[0].counters.seen, 5, "messages of others are not seen");
}

#[test]
fn a_subscriber_that_is_not_there_is_said_and_its_messages_are_no_effects() {
    let mut lost = operation(0, OperationKind::Blackhole);
    lost.to = vec![RIGHT];
    let plan = plan_of(vec![lost]);
    let test = test_of(vec![use_of(0, 0.0, 10.0, vec![], 1)]);
    let (_, finished) = relayed(&plan, &test, &[COMMAND, "arm/command/to/left"]);
    assert_eq!(finished.unheard, ["arm/command/to/right"]);
    assert_eq!(finished.operations[0].counters, Counters { seen: 10, unheard: 10, ..Counters::default() });
}
