//! Decisions in the relay compared with those of `sesame_monitor`, fed with the messages of a trace.

use std::collections::BTreeMap;
use std::sync::Arc;

use proptest::prelude::*;

use sesame_monitor::{Changes, EvidenceId, Network, Reading, Run, State, Truth};

use super::*;

/// Evidence of the property: on one topic or both, held or not, stale or not, published or delivered.
fn any_evidence() -> impl Strategy<Value = Evidence> {
    let held = prop_oneof![Just(0.0), Just(3e-9), Just(7e-9)];
    let stale = prop_oneof![
        Just(None),
        (1..9_u32, any::<bool>(), any::<bool>()).prop_map(|(after, is, all)| {
            let is = if is { StaleIs::False } else { StaleIs::Unknown };
            Some(Stale { after: f64::from(after) * 1e-9, is, all })
        })
    ];
    (0..3_u32, -2..3_i32, held, stale, any::<bool>()).prop_map(|(on, limit, held, stale, inbound)| {
        let (one, other) = (evidence_above("e", on % 2, f64::from(limit)), evidence_above("e", 1, 0.0));
        let inputs = if on == 2 { [one.inputs, other.inputs].concat() } else { one.inputs };
        let side = if inbound { Side::Inbound } else { Side::Outbound };
        Evidence { inputs, condition: one.condition, held, stale, side, ..ok() }
    })
}

proptest! {
    /// The decisions of a run are those of the messages that its trace says were published and delivered.
    #[test]
    fn decisions_are_those_of_the_messages_of_the_trace(
        evidence in prop::collection::vec(any_evidence(), 3),
        sent in prop::collection::vec((0..6_i64, any::<bool>(), -3..4_i32), 0..25),
        delay in 0..12_i64,
        gates in prop::collection::vec((0..3_u32, 0..3_u32, any::<bool>()), 2),
    ) {
        let named = evidence.into_iter().enumerate();
        let evidence: Vec<Evidence> =
            named.map(|(at, evidence)| Evidence { name: format!("e{at}"), ..evidence }).collect();
        let gate = |(one, other, all): (u32, u32, bool)| {
            let parts = vec![Gate::Evidence(one), Gate::Evidence(other)];
            if all { Gate::All(parts) } else { Gate::Any(parts) }
        };
        let guarantees = (0..).zip(["strong", "weak"]).zip(&gates);
        let guarantees = guarantees.map(|((at, name), &gates)| guarantee(name, 2 - at, gate(gates))).collect();
        let first = Monitor { guarantees, ..monitor("first", 2, evidence, vec![]) };
        let relies = Gate::All(vec![Gate::Evidence(0), Gate::Demand(0)]);
        let second = monitor("second", 3, vec![ok()], vec![guarantee("relies", 1, relies)]);
        let second = Monitor { demands: vec![demand("weak", 0, 1)], ..second };
        let late = operation(0, OperationKind::Latency {
            distribution: sesame_plan::Distribution::Fixed,
            drain: sesame_plan::Drain::Finish,
        });
        let plan = CampaignPlan { operations: vec![late], ..watched(vec![second, first]) };
        let mut plan = plan;
        plan.monitors[0].demands[0].monitor = sesame_plan::MonitorId(1);
        let mut now = 0;
        let sent: Vec<(i64, &str, Value)> = sent.into_iter().map(|(wait, on_a, value)| {
            now += wait;
            (now, if on_a { "a" } else { "b" }, Value::Real(f64::from(value)))
        }).collect();
        let choice = vec![Choice::Value { value: delay as f64 * 1e-9 }];
        let ran = run(&plan, vec![use_of(0, 0.0, 1.0, choice, 1)], &sent, now + 30);
        prop_assert_eq!(fed(&plan, &ran, now + 30), [ran.decisions(0), ran.decisions(1)]);
    }
}

/// The decisions of `sesame_monitor` on the messages that listeners were told of.
fn fed(plan: &CampaignPlan, ran: &Ran, end: i64) -> [Vec<(i64, Option<u32>)>; 2] {
    let network = Arc::new(Network::new(&plan.monitors).unwrap());
    let mut changes = Changes::default();
    let mut run = Run::start(Arc::clone(&network), &mut changes);
    let mut last: Vec<[Option<(f64, i64)>; 2]> = vec![[None; 2]; network.evidence_count()];
    let mut told = ran.told.iter().filter(|told| told.wire.index() < 2).peekable();
    // What evidence on both topics says in this instant.
    let mut settled: BTreeMap<EvidenceId, Reading> = BTreeMap::new();
    while let Some(first) = told.next() {
        // A message that is delivered at once follows its publication, but for states that monitors publish.
        let same = |next: &&Told| {
            !first.delivered
                && next.delivered
                && next.wire == first.wire
                && next.index == first.index
                && next.at == first.at
        };
        let mut event = vec![first];
        event.extend(told.next_if(same));
        let mut heard: Vec<Reading> = Vec::new();
        for Told { delivered, wire, value, .. } in &event {
            for (at, last) in last.iter_mut().enumerate() {
                let id = EvidenceId(u32::try_from(at).unwrap());
                let (monitor, position) = network.owner(id);
                let evidence = &plan.monitors[monitor.index()].evidence[position as usize];
                let reads = |topic: usize| evidence.inputs.iter().any(|input| input.field.topic.index() == topic);
                if reads(wire.index()) && *delivered == (evidence.side == Side::Outbound) {
                    last[wire.index()] = value.number_at::<&str>(&[]).map(|value| (value, first.at));
                    let read: Option<Vec<_>> = (0..2).filter(|&topic| reads(topic)).map(|topic| last[topic]).collect();
                    let Some(read) = read else { continue };
                    let sesame_plan::Condition::Compare { by, right: Expression::Constant(limit), .. } =
                        &evidence.condition
                    else {
                        panic!("evidence is a comparison")
                    };
                    let holds =
                        last[evidence.inputs[0].field.topic.index()].is_some_and(|message| by.holds(message.0, *limit));
                    let oldest = SimTime::from_nanos(read.iter().map(|message| message.1).min().unwrap());
                    let reading = Reading { evidence: id, truth: Truth::from(holds), oldest };
                    if read.len() > 1 {
                        settled.insert(id, reading);
                    } else {
                        heard.push(reading);
                    }
                }
            }
        }
        let at = SimTime::from_nanos(first.at);
        run.observe(at, &heard, &mut changes);
        if told.peek().is_none_or(|next| next.at > first.at) {
            run.observe(at, &std::mem::take(&mut settled).into_values().collect::<Vec<_>>(), &mut changes);
        }
    }
    run.advance(SimTime::from_nanos(end), &mut changes);
    let of = |monitor: u32| {
        let own = changes.decisions.iter().filter(|decision| decision.monitor == sesame_plan::MonitorId(monitor));
        let state = |state| match state {
            State::Guarantee(at) => Some(at),
            State::Safe => None,
        };
        own.map(|decision| (decision.at.nanos(), state(decision.state))).collect()
    };
    [of(0), of(1)]
}
