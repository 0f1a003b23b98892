//! Disagreements of two runs compared with the states at every nanosecond.

use std::sync::Arc;

use proptest::prelude::*;
use sesame_base::time::SimTime;
use sesame_monitor::difference::{Course, Deviation, Disagreement, Leads, disagreements};
use sesame_monitor::why::Moment;
use sesame_monitor::{Changes, EvidenceId, Network, Run, State, Truth};
use sesame_plan::{Gate, MonitorId};

use crate::random::{self, END, Heard, HeardMessage};
use crate::run::heard;

const T: fn(i64) -> SimTime = SimTime::from_nanos;

fn course(network: &Arc<Network>, messages: &[HeardMessage]) -> Course {
    let (mut changes, mut course) = (Changes::default(), Course { end: T(END), ..Course::default() });
    let mut run = Run::start(Arc::clone(network), &mut changes);
    for message in messages {
        run.observe(T(message.at), &heard(network, message), &mut changes);
    }
    run.advance(course.end, &mut changes);
    course.take(&mut changes);
    course
}

fn state(course: &Course, monitor: MonitorId, at: i64) -> State {
    let mut decided = course.decisions.iter().filter(|decision| decision.monitor == monitor && decision.at <= T(at));
    decided.next_back().map_or(State::Safe, |decision| decision.state)
}

fn truth(course: &Course, evidence: EvidenceId, at: SimTime) -> Truth {
    let mut changes = course.evidence.iter().filter(|change| change.evidence == evidence && change.at <= at);
    changes.next_back().map_or(Truth::Unknown, |change| change.truth)
}

/// The state in the second run if this evidence were in it as in the first.
fn with(network: &Network, monitor: MonitorId, at: SimTime, [a, b]: [&Course; 2], set: &[EvidenceId]) -> State {
    Moment::new(network, |id| truth(if set.contains(&id) { a } else { b }, id, at)).state(monitor)
}

prop_compose! {
    /// A run, and another in which messages come later, or not at all.
    fn any_two()((monitors, messages) in random::any_run())(
        late in prop::collection::vec(prop_oneof![4 => (0..6_i64).prop_map(Some), 1 => Just(None)], messages.len()),
        monitors in Just(monitors),
        messages in Just(messages),
    ) -> (Vec<sesame_plan::Monitor>, Vec<HeardMessage>, Vec<HeardMessage>) {
        let shifted = messages.iter().zip(late).filter_map(|(message, late)| {
            let at = message.at + late?;
            (at <= END).then(|| HeardMessage { at, ..message.clone() })
        });
        let mut other: Vec<HeardMessage> = shifted.collect();
        other.sort_by_key(|message| message.at);
        (monitors, messages, other)
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1500))]

    #[test]
    fn monitors_disagree_where_their_states_differ_and_no_evidence_too_much_is_named(
        (monitors, one, other) in any_two()
    ) {
        let network = Arc::new(Network::new(&monitors).unwrap());
        let (a, b) = (course(&network, &one), course(&network, &other));
        for &monitor in network.order() {
            let found = disagreements(&network, monitor, &a, &b);
            for at in 0..END {
                let states = (state(&a, monitor, at), state(&b, monitor, at));
                let covering = found.iter().filter(|disagreement: &&Disagreement| disagreement.from <= T(at) && T(at) < disagreement.to);
                let covered: Vec<_> = covering.map(|disagreement| (disagreement.first, disagreement.second)).collect();
                prop_assert_eq!(covered, if states.0 == states.1 { vec![] } else { vec![states] });
            }
            for disagreement in &found {
                let set: Vec<EvidenceId> = disagreement.because.iter().map(|deviation| deviation.evidence).collect();
                prop_assert_eq!(with(&network, monitor, disagreement.from, [&a, &b], &set), disagreement.first);
                for at in 0..set.len() {
                    let mut less = set.clone();
                    less.remove(at);
                    prop_assert_ne!(with(&network, monitor, disagreement.from, [&a, &b], &less), disagreement.first);
                }
                for Deviation { evidence, first, second, leads, follows } in &disagreement.because {
                    prop_assert_eq!(first.truth, truth(&a, *evidence, disagreement.from));
                    prop_assert_eq!(second.truth, truth(&b, *evidence, disagreement.from));
                    let (led, other) = if *leads == Leads::First { (first, &b) } else { (second, &a) };
                    let next = other.evidence.iter().position(|change| {
                        change.evidence == *evidence && change.at > disagreement.from && change.truth == led.truth
                    });
                    prop_assert_eq!(next, *follows);
                }
            }
        }
    }
}

#[test]
fn evidence_that_is_late_is_named_with_its_delay() {
    let monitor = random::monitor(random::plain(2), vec![Gate::All(vec![Gate::Evidence(0), Gate::Evidence(1)])]);
    let network = Arc::new(Network::new(&[monitor]).unwrap());
    let message = |when: i64, at: u32, truth| HeardMessage {
        at: when,
        heard: vec![Heard { monitor: MonitorId(0), at, truth, oldest: when }],
    };
    let other = [message(1, 1, Truth::True), message(20, 1, Truth::False)];
    let run = |at| {
        let mut messages = vec![message(at, 0, Truth::True)];
        messages.extend(other.iter().cloned());
        messages.sort_by_key(|message| message.at);
        course(&network, &messages)
    };
    let (a, b) = (run(12), run(17));
    let found = disagreements(&network, MonitorId(0), &a, &b);
    let [it] = &found[..] else { panic!("{found:?}") };
    assert_eq!((it.from, it.to, it.first, it.second), (T(12), T(17), State::Guarantee(0), State::Safe));
    let [late] = it.because[..] else { panic!("{found:?}") };
    assert_eq!((late.evidence, late.leads), (EvidenceId(0), Leads::First));
    assert_eq!(late.late(&a, &b), Some(T(5)));
    let found = disagreements(&network, MonitorId(0), &b, &a);
    assert_eq!(found[0].because[0].late(&b, &a), Some(T(-5)), "the second is earlier");
    let never = run(25);
    let found = disagreements(&network, MonitorId(0), &a, &never);
    assert_eq!(found[0].because[0].late(&a, &never), Some(T(13)), "too late to make a difference, and still named");
}
