//! Runs compared with the naive evaluator.

use std::sync::Arc;

use proptest::prelude::*;
use sesame_base::time::SimTime;
use sesame_monitor::{Changes, EvidenceId, Invalid, Network, Reading, Run, State, Truth};
use sesame_plan::{Demand, Gate, Monitor, MonitorId};

use crate::naive::{self, Moment, Step};
use crate::random::{self, END, HeardMessage};

const T: fn(i64) -> SimTime = SimTime::from_nanos;

pub(crate) fn heard(network: &Network, message: &HeardMessage) -> Vec<Reading> {
    let heard = message.heard.iter();
    heard
        .map(|heard| Reading {
            evidence: network.evidence(heard.monitor, heard.at),
            truth: heard.truth,
            oldest: T(heard.oldest),
        })
        .collect()
}

/// The decisions of each monitor.
fn decisions(monitors: &[Monitor], messages: &[HeardMessage], end: i64) -> Vec<Vec<Step>> {
    let network = Arc::new(Network::new(monitors).unwrap());
    let mut changes = Changes::default();
    let mut run = Run::start(Arc::clone(&network), &mut changes);
    for message in messages {
        run.observe(T(message.at), &heard(&network, message), &mut changes);
    }
    run.advance(T(end), &mut changes);
    let mut decisions = vec![Vec::new(); monitors.len()];
    for decision in changes.decisions {
        let lost = decision.state == State::Safe && !decisions[decision.monitor.index()].is_empty();
        assert_eq!(decision.mitigate, lost);
        decisions[decision.monitor.index()].push((decision.at.nanos(), decision.state));
    }
    decisions
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn decisions_are_those_of_the_naive_evaluator((monitors, messages) in random::any_run()) {
        prop_assert_eq!(decisions(&monitors, &messages, END), naive::decisions(&monitors, &messages, END));
    }

    #[test]
    fn every_value_is_that_of_the_naive_evaluator((monitors, messages) in random::any_run()) {
        let network = Arc::new(Network::new(&monitors).unwrap());
        let mut changes = Changes::default();
        let mut run = Run::start(Arc::clone(&network), &mut changes);
        let mut told: Vec<Truth> = vec![Truth::Unknown; network.evidence_count()];
        let mut taken = 0;
        for now in 0..=END {
            changes.clear();
            run.advance(T(now), &mut changes);
            let mut check = |run: &Run, changes: &Changes, taken: usize| {
                for change in &changes.evidence {
                    assert_eq!(change.at, T(now));
                    told[change.evidence.index()] = change.truth;
                }
                let moment = Moment { monitors: &monitors, heard: &messages[..taken], now };
                for (id, monitor) in (0..).map(MonitorId).zip(&monitors) {
                    for at in 0..monitor.evidence.len() as u32 {
                        let evidence = network.evidence(id, at);
                        assert_eq!(network.owner(evidence), (id, at));
                        assert_eq!(run.evidence(evidence), moment.evidence(id, at));
                        assert_eq!(run.evidence(evidence), told[evidence.index()]);
                    }
                    for at in 0..monitor.guarantees.len() as u32 {
                        assert_eq!(run.guarantee(id, at), moment.guarantee(id, at));
                    }
                    assert_eq!(run.state(id), moment.state(id));
                }
            };
            check(&run, &changes, taken);
            while let Some(message) = messages.get(taken).filter(|message| message.at == now) {
                taken += 1;
                changes.clear();
                run.observe(T(now), &heard(&network, message), &mut changes);
                check(&run, &changes, taken);
            }
        }
    }

    #[test]
    fn nothing_happens_before_it_is_due((monitors, messages) in random::any_run()) {
        let network = Arc::new(Network::new(&monitors).unwrap());
        let mut changes = Changes::default();
        let mut run = Run::start(Arc::clone(&network), &mut changes);
        let mut taken = 0;
        for now in 0..=END {
            while let Some(message) = messages.get(taken).filter(|message| message.at == now) {
                taken += 1;
                run.observe(T(now), &heard(&network, message), &mut changes);
            }
            let due = run.due();
            prop_assert!(due.is_none_or(|due| due > T(now)));
            changes.clear();
            run.advance(T(now + 1), &mut changes);
            let quiet = changes.evidence.is_empty() && changes.decisions.is_empty();
            prop_assert!(quiet || due == Some(T(now + 1)));
        }
    }

    #[test]
    fn the_order_of_declaration_does_not_matter(
        (monitors, messages) in random::any_run(),
        order in Just((0..4_u32).collect::<Vec<_>>()).prop_shuffle(),
    ) {
        let order: Vec<u32> = order.into_iter().filter(|&at| (at as usize) < monitors.len()).collect();
        let moved = |id: MonitorId| MonitorId(order.iter().position(|&at| at == id.0).unwrap() as u32);
        let shuffled: Vec<Monitor> = order.iter().map(|&at| {
            let mut monitor = monitors[at as usize].clone();
            monitor.demands.iter_mut().for_each(|demand| demand.monitor = moved(demand.monitor));
            monitor
        }).collect();
        let mut told = messages.clone();
        for message in &mut told {
            message.heard.iter_mut().for_each(|heard| heard.monitor = moved(heard.monitor));
            message.heard.reverse();
        }
        let mut expected = decisions(&monitors, &messages, END);
        for (id, steps) in (0..).zip(decisions(&shuffled, &told, END)) {
            prop_assert_eq!(steps, std::mem::take(&mut expected[order[id] as usize]));
        }
    }
}

/// A monitor with one guarantee, on one piece of evidence or on the first guarantee of another monitor.
fn simple(demand: Option<u32>) -> Monitor {
    let evidence = random::monitor(Vec::new(), vec![Gate::Demand(0)]);
    let demands = demand.map(|other| Demand { name: "other".into(), monitor: MonitorId(other), guarantee: 0 });
    Monitor { demands: demands.into_iter().collect(), ..evidence }
}

#[test]
fn monitors_that_rely_on_themselves_are_refused() {
    let monitors = [simple(Some(1)), simple(Some(2)), simple(Some(1))];
    assert!(matches!(Network::new(&monitors), Err(Invalid::Circle(MonitorId(1 | 2)))));
    assert_eq!(Network::new(&[simple(Some(3))]).err(), Some(Invalid::Demand(MonitorId(0))));
    assert_eq!(Network::new(&[simple(None)]).err(), Some(Invalid::Gate(MonitorId(0))));
    assert_eq!(
        Network::new(&[Monitor { guarantees: Vec::new(), ..simple(None) }]).err(),
        Some(Invalid::Guarantees(MonitorId(0)))
    );
}

#[test]
fn time_does_not_go_back() {
    let mut monitor = random::monitor(Vec::new(), vec![Gate::Evidence(0)]);
    monitor.evidence = vec![sesame_plan::Evidence {
        name: "it".into(),
        doc: String::new(),
        inputs: Vec::new(),
        condition: sesame_plan::Condition::Constant(true),
        held: 0.0,
        stale: None,
        side: sesame_plan::Side::Outbound,
    }];
    let mut changes = Changes::default();
    let mut run = Run::start(Arc::new(Network::new(&[monitor]).unwrap()), &mut changes);
    run.advance(T(10), &mut changes);
    run.observe(T(5), &[Reading::now(T(5), EvidenceId(0), Truth::True)], &mut changes);
    assert_eq!(changes.decisions.last().unwrap().at, T(10));
}
