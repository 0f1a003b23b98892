//! Certificates and messages at random. Times are whole nanoseconds, few and small, so that messages and timers often
//! fall on one instant.

use std::collections::BTreeMap;

use proptest::prelude::*;
use sesame_monitor::Truth;
use sesame_plan::{
    Condition, Demand, Evidence, FieldRef, Gate, Guarantee, Input, Members, Monitor, MonitorId, SafeState, Side, Stale,
    StaleIs, TopicId,
};

/// The end of all runs.
pub(crate) const END: i64 = 40;

/// What all conditions of evidence say at a message: by monitor and position.
#[derive(Debug, Clone)]
pub(crate) struct HeardMessage {
    pub(crate) at: i64,
    pub(crate) heard: Vec<Heard>,
}

/// What the condition of a piece of evidence says, and when the source of it spoke that has been silent longest.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Heard {
    pub(crate) monitor: MonitorId,
    pub(crate) at: u32,
    pub(crate) truth: Truth,
    pub(crate) oldest: i64,
}

fn seconds(nanos: i64) -> f64 {
    nanos as f64 * 1e-9
}

/// A gate as numbers that say nothing about how many leaves there are.
#[derive(Debug, Clone)]
pub(crate) enum RawGate {
    Leaf(u8),
    Node(u8, Vec<RawGate>),
}

pub(crate) fn any_raw_gate() -> impl Strategy<Value = RawGate> {
    any::<u8>().prop_map(RawGate::Leaf).prop_recursive(3, 12, 4, |inner| {
        (any::<u8>(), prop::collection::vec(inner, 2..=4)).prop_map(|(kind, parts)| RawGate::Node(kind, parts))
    })
}

/// The gate that these numbers give over so many pieces of evidence and demands.
pub(crate) fn gate(raw: &RawGate, evidence: u32, demands: u32) -> Gate {
    match raw {
        RawGate::Leaf(at) => {
            let at = u32::from(*at) % (evidence + demands);
            if at < evidence { Gate::Evidence(at) } else { Gate::Demand(at - evidence) }
        }
        RawGate::Node(kind, parts) => {
            let of: Vec<Gate> = parts.iter().map(|part| gate(part, evidence, demands)).collect();
            match kind % 3 {
                0 => Gate::All(of),
                1 => Gate::Any(of),
                _ => Gate::AtLeast { count: u32::from(*kind / 3) % of.len() as u32 + 1, of },
            }
        }
    }
}

/// So many pieces of evidence that hold at once and are never stale.
pub(crate) fn plain(count: usize) -> Vec<Evidence> {
    vec![evidence(0, None); count]
}

fn any_evidence() -> impl Strategy<Value = Evidence> {
    let held = prop_oneof![2 => Just(0), 1 => 1..6_i64];
    let stale = prop::option::of((1..7_i64, any::<bool>(), any::<bool>()));
    (held, stale).prop_map(|(held, stale)| evidence(held, stale))
}

/// Evidence that must be held this long, and is false or unknown after this long, in nanoseconds, if any or all of its
/// sources are silent.
fn evidence(held: i64, stale: Option<(i64, bool, bool)>) -> Evidence {
    Evidence {
        name: "evidence".into(),
        doc: String::new(),
        inputs: vec![Input::new(FieldRef { topic: TopicId(0), path: Vec::new() }, Members::Min)],
        condition: Condition::Input(0),
        held: seconds(held),
        stale: stale.map(|(after, is_false, all)| Stale {
            after: seconds(after),
            is: if is_false { StaleIs::False } else { StaleIs::Unknown },
            all,
        }),
        side: Side::Outbound,
    }
}

/// A monitor without demands.
pub(crate) fn monitor(evidence: Vec<Evidence>, gates: Vec<Gate>) -> Monitor {
    let strongest = gates.len() as u32;
    let guarantees = (0..).zip(gates).map(|(at, gate)| Guarantee {
        name: format!("guarantee_{at}"),
        doc: String::new(),
        integrity: 2 * (strongest - at),
        gate,
    });
    Monitor {
        name: "monitor".into(),
        doc: String::new(),
        publishes: Some(TopicId(0)),
        demands: Vec::new(),
        evidence,
        guarantees: guarantees.collect(),
        otherwise: SafeState { name: "safe".into(), doc: String::new(), mitigation: None },
        line: 1,
    }
}

/// Up to four monitors, each of which may demand of those that come before it in an order of its own.
pub(crate) fn any_monitors() -> impl Strategy<Value = Vec<Monitor>> {
    let one = (
        prop::collection::vec(any_evidence(), 1..=4),
        prop::collection::vec(any_raw_gate(), 1..=3),
        prop::collection::vec((any::<u8>(), any::<u8>()), 0..=2),
    );
    let order = Just((0..4_u32).collect::<Vec<_>>()).prop_shuffle();
    (prop::collection::vec(one, 1..=4), order).prop_map(|(many, order)| {
        let order: Vec<u32> = order.into_iter().filter(|&at| (at as usize) < many.len()).collect();
        let mut monitors: Vec<Option<Monitor>> = vec![None; many.len()];
        for (rank, (evidence, raw_gates, demands)) in many.into_iter().enumerate() {
            let demands = demands.into_iter().filter(|_| rank > 0).map(|(of, guarantee)| {
                let other = order[of as usize % rank];
                let guarantees = monitors[other as usize].as_ref().unwrap().guarantees.len();
                Demand {
                    name: "demand".into(),
                    monitor: MonitorId(other),
                    guarantee: u32::from(guarantee) % guarantees as u32,
                }
            });
            let demands: Vec<Demand> = demands.collect();
            let gates = raw_gates.iter().map(|raw| gate(raw, evidence.len() as u32, demands.len() as u32)).collect();
            monitors[order[rank] as usize] = Some(Monitor { demands, ..monitor(evidence, gates) });
        }
        monitors.into_iter().map(Option::unwrap).collect()
    })
}

pub(crate) fn any_truth() -> impl Strategy<Value = Truth> {
    prop_oneof![3 => Just(Truth::True), 2 => Just(Truth::False), 1 => Just(Truth::Unknown)]
}

/// How long the source has been silent that has been silent longest: most often it is the one that speaks.
fn any_age() -> impl Strategy<Value = i64> {
    prop_oneof![2 => Just(0), 1 => 0..9_i64]
}

/// Monitors and messages to some of their evidence.
pub(crate) fn any_run() -> impl Strategy<Value = (Vec<Monitor>, Vec<HeardMessage>)> {
    any_monitors().prop_flat_map(|monitors| {
        let evidence: Vec<(MonitorId, u32)> = (0..)
            .zip(&monitors)
            .flat_map(|(id, monitor)| (0..monitor.evidence.len() as u32).map(move |at| (MonitorId(id), at)))
            .collect();
        let count = evidence.len();
        let heard = prop::sample::subsequence(evidence, 1..=count.min(3))
            .prop_flat_map(|heard| {
                let truths = prop::collection::vec((any_truth(), any_age()), heard.len());
                (Just(heard), truths)
            })
            .prop_map(|(heard, truths)| heard.into_iter().zip(truths).collect::<Vec<_>>());
        let messages = prop::collection::vec((0..=END, heard), 0..30).prop_map(|mut messages| {
            messages.sort_by_key(|(at, _)| *at);
            // The source that has been silent longest never spoke earlier than it was known to have spoken.
            let mut oldest = BTreeMap::new();
            let message = |(at, heard): (i64, Vec<_>)| {
                let heard = heard.into_iter().map(|((monitor, position), (truth, age)): ((_, u32), (_, i64))| {
                    let oldest: &mut i64 = oldest.entry((monitor, position)).or_default();
                    *oldest = (at - age).max(*oldest);
                    Heard { monitor, at: position, truth, oldest: *oldest }
                });
                HeardMessage { at, heard: heard.collect() }
            };
            messages.into_iter().map(message).collect()
        });
        (Just(monitors), messages)
    })
}
