use std::collections::{BTreeMap, BTreeSet};

use proptest::prelude::*;
use sesame_plan::testing::{node, operation, plan, test_of, use_of};
use sesame_plan::{Activation, Choice, Operation, Span, TestOperation};

use super::*;
use crate::metric::MetricTable;
use crate::relay::Relay;
use crate::wire::WireTable;

/// Two nodes, and for each of them an operation of each kind: `pause`, `slow`, `kill`.
fn two_nodes() -> CampaignPlan {
    let on = |node| {
        [OperationKind::Pause { node }, OperationKind::Slow { node }, OperationKind::Kill { node }]
            .map(|kind| Operation { within: Span { start: 0.0, end: 15.0 }, ..operation(0, kind) })
    };
    CampaignPlan { nodes: vec![node("left"), node("right")], ..plan([on(NodeId(0)), on(NodeId(1))].concat()) }
}

/// How a node is that does what it is told.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Obeys {
    Well,
    Slow(f64),
    Paused,
    Dead,
}

fn choices(operation: u32, share: f64) -> Vec<Choice> {
    if operation % 3 == 1 { vec![Choice::Value { value: share }] } else { Vec::new() }
}

/// Which of the operations of a test act at an instant.
fn active(test: &[TestOperation], at: f64) -> impl Iterator<Item = &TestOperation> {
    test.iter().filter(move |used| match used.activation {
        Activation::Time { start, end } => (start..end).contains(&at),
        _ => unreachable!("they are drawn by time"),
    })
}

/// How a node must be: as the gravest of what acts on it says.
fn must_be(test: &[TestOperation], on: u32, at: f64) -> Obeys {
    let own: Vec<&TestOperation> = active(test, at).filter(|used| used.operation.0 / 3 == on).collect();
    let has = |kind: u32| own.iter().any(|used| used.operation.0 % 3 == kind);
    let shares = own.iter().filter_map(|used| match used.parameters.first() {
        Some(Choice::Value { value }) => Some(*value),
        _ => None,
    });
    match (has(2), has(0), shares.reduce(f64::min)) {
        (true, ..) => Obeys::Dead,
        (_, true, _) => Obeys::Paused,
        (.., Some(share)) => Obeys::Slow(share),
        _ => Obeys::Well,
    }
}

proptest! {
    #[test]
    fn a_node_that_obeys_is_always_as_the_gravest_active_operation_wants(
        drawn in prop::collection::vec((0u32..6, 1u32..20, 1u32..8, 1u32..10), 0..8)
    ) {
        let plan = two_nodes();
        let (wires, seconds) = (WireTable::new(&plan), |at: u32| f64::from(at) / 2.0);
        let uses = drawn.iter().zip(1..).map(|(&(operation, start, length, share), seed)| {
            let parameters = choices(operation, f64::from(share) / 10.0);
            use_of(operation, seconds(start), seconds(start + length), parameters, seed)
        });
        let test = test_of(uses.collect());
        let metrics = MetricTable::new(&plan, &wires, &[]).unwrap();
        let mut relay = Relay::new(&plan, &wires, &test, metrics.start(), &[]).unwrap();
        relay.begin();
        let (mut orders, mut nodes) = (NodeOrders::default(), BTreeMap::new());
        let mut felt = BTreeSet::new();
        for at in 0..30 {
            let now = SimTime::from_seconds(seconds(at));
            relay.advance(now, &mut Vec::new());
            for OrderToNode { node, order } in orders.take(&plan, now, &mut relay) {
                let state = nodes.entry(node).or_insert(Obeys::Well);
                *state = match (*state, order) {
                    (Obeys::Dead, NodeOrder::Restart) => Obeys::Well,
                    (Obeys::Dead, order) | (_, order @ NodeOrder::Restart) => panic!("{order:?} at {now}"),
                    (_, NodeOrder::Pause) => Obeys::Paused,
                    (_, NodeOrder::Slow { share }) => Obeys::Slow(share),
                    (_, NodeOrder::Resume) => Obeys::Well,
                    (_, NodeOrder::Kill) => Obeys::Dead,
                };
            }
            for (position, used) in test.operations.iter().enumerate() {
                let others: Vec<_> = test.operations.iter().filter(|other| !std::ptr::eq(*other, used)).cloned().collect();
                let on = used.operation.0 / 3;
                if must_be(&test.operations, on, seconds(at)) != must_be(&others, on, seconds(at)) {
                    felt.insert(position);
                }
            }
            for (on, name) in (0..).zip(["left", "right"]) {
                let is = nodes.get(name).copied().unwrap_or(Obeys::Well);
                prop_assert_eq!(is, must_be(&test.operations, on, seconds(at)), "`{}` at {}", name, now);
            }
        }
        let finished = relay.finish(SimTime::from_seconds(seconds(30)));
        // Without these, their nodes would have been otherwise at some time.
        for position in felt {
            prop_assert!(finished.operations[position].counters.side_effects > 0, "operation {}", position);
        }
    }
}

#[test]
fn an_operation_that_a_graver_one_covers_has_no_effect() {
    let plan = two_nodes();
    let wires = WireTable::new(&plan);
    let metrics = MetricTable::new(&plan, &wires, &[]).unwrap();
    let test = test_of(vec![use_of(2, 1.0, 4.0, vec![], 1), use_of(0, 2.0, 3.0, vec![], 2)]);
    let mut relay = Relay::new(&plan, &wires, &test, metrics.start(), &[]).unwrap();
    let (mut orders, mut given) = (NodeOrders::default(), Vec::new());
    for at in 0..6 {
        let now = SimTime::from_seconds(f64::from(at));
        relay.advance(now, &mut Vec::new());
        given.extend(orders.take(&plan, now, &mut relay).into_iter().map(|order| (at, order.order)));
    }
    assert_eq!(given, [(1, NodeOrder::Kill), (4, NodeOrder::Restart)]);
    let effects: Vec<_> =
        relay.finish(SimTime::from_seconds(6.0)).operations.iter().map(|used| used.counters.side_effects).collect();
    assert_eq!(effects, [1, 0]);
}

#[test]
fn what_is_not_offered_is_refused_with_what_is() {
    let plan = CampaignPlan { operations: vec![two_nodes().operations[3].clone()], ..two_nodes() };
    assert_eq!(plan.operations[0].kind.node(), Some(NodeId(1)));
    let refused = |offers: Offers| NodeOrders::are_offered(&plan, &offers).unwrap_err().to_string();
    let remedy = "name the node and what can be done to it in `nodes` of `ready`, or in Rust with `Bus::offer`";
    assert_eq!(
        refused(Offers::new()),
        format!(
            "the simulator does not offer to pause node `right`, as operation `pause` needs; it offers nothing: {remedy}"
        )
    );
    let offers = |right: &[NodeFault]| {
        Offers::from([
            ("left".to_owned(), BTreeSet::from([NodeFault::Pause, NodeFault::Kill])),
            ("right".to_owned(), right.iter().copied().collect()),
        ])
    };
    let error = refused(offers(&[NodeFault::Slow]));
    assert!(error.contains("needs; it offers `left` (pause, kill), `right` (slow): name"), "{error}");
    assert_eq!(NodeOrders::are_offered(&plan, &offers(&[NodeFault::Pause])), Ok(()));
}
