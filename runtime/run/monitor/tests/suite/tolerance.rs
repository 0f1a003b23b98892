//! Tolerances compared with all delays.

use std::collections::BTreeMap;
use std::sync::Arc;

use proptest::prelude::*;
use sesame_base::time::SimTime;
use sesame_monitor::compare::{Step, steps};
use sesame_monitor::tolerance::{Limit, RecordedMessage, Recording, tolerance, tolerances};
use sesame_monitor::{Changes, EvidenceId, Network, Reading, Run, State, Truth};
use sesame_plan::{Gate, Monitor, MonitorId};

use crate::random::{self, END};

const T: fn(i64) -> SimTime = SimTime::from_nanos;

/// A condition made from numbers: of what is the latest in each stream, and which of them was heard.
fn truth(values: &[u8], evidence: EvidenceId, heard: usize, latest: &[usize]) -> Truth {
    let sum: usize = latest.iter().map(|&at| values[at] as usize).sum();
    match (sum + evidence.index() + values[heard] as usize / 4) % 5 {
        0 | 1 => Truth::False,
        2 => Truth::Unknown,
        _ => Truth::True,
    }
}

/// The decisions of one monitor in the delayed recording, by a run of it.
fn delayed(
    network: &Arc<Network>,
    recording: &Recording,
    values: &[u8],
    streams: &[u32],
    delay: i64,
) -> Vec<Vec<Step<State>>> {
    let mut messages: Vec<(i64, usize)> = recording
        .messages
        .iter()
        .enumerate()
        .map(|(at, message)| {
            let by = if streams.contains(&message.stream) { delay } else { 0 };
            (message.at.nanos() + by, at)
        })
        .collect();
    messages.sort_unstable();
    let mut latest: Vec<Option<(usize, i64)>> = vec![None; 8];
    let mut changes = Changes::default();
    let mut run = Run::start(Arc::clone(network), &mut changes);
    messages.retain(|(at, _)| *at <= recording.end.nanos());
    // Messages that are joined are one event as long as nothing comes between them.
    let is_joined =
        |a: &(i64, usize), b: &(i64, usize)| a.0 == b.0 && (a.1 + 1..=b.1).all(|at| recording.messages[at].joined);
    for instant in messages.chunk_by(|one, next| one.0 == next.0) {
        let at = instant[0].0;
        // What hears several streams changes after all messages of the instant.
        let mut settled: BTreeMap<EvidenceId, Reading> = BTreeMap::new();
        for event in instant.chunk_by(is_joined) {
            let mut heard: Vec<Reading> = Vec::new();
            for &(_, message) in event {
                let stream = recording.messages[message].stream;
                latest[stream as usize] = Some((message, at));
                for (evidence, streams) in (0..).map(EvidenceId).zip(&recording.streams) {
                    let latest: Option<Vec<_>> = streams.iter().map(|&stream| latest[stream as usize]).collect();
                    let Some(latest) = latest.filter(|_| streams.contains(&stream)) else { continue };
                    let oldest = T(latest.iter().map(|read| read.1).min().unwrap());
                    let latest: Vec<usize> = latest.iter().map(|read| read.0).collect();
                    let reading = Reading { evidence, truth: truth(values, evidence, message, &latest), oldest };
                    if streams.len() > 1 {
                        settled.insert(evidence, reading);
                    } else {
                        heard.push(reading);
                    }
                }
            }
            run.observe(T(at), &heard, &mut changes);
        }
        run.observe(T(at), &settled.into_values().collect::<Vec<_>>(), &mut changes);
    }
    run.advance(recording.end, &mut changes);
    network.order().iter().map(|&monitor| steps(&changes.decisions, monitor)).collect()
}

fn is_kept(recorded: &[Step<State>], found: &[Step<State>], delay: i64, end: i64) -> bool {
    let missing = recorded.iter().skip(found.len()).all(|step| step.at.nanos() + delay > end);
    let same =
        recorded.iter().zip(found).all(|(a, b)| a.state == b.state && (a.at.nanos() - b.at.nanos()).abs() <= delay);
    missing && same && found.len() <= recorded.len()
}

prop_compose! {
    /// Monitors, and a recording with a number for each message.
    fn any_recording()(monitors in random::any_monitors())(
        streams in prop::collection::vec(
            prop::sample::subsequence(vec![0_u32, 1, 2, 3], 1..=2),
            monitors.iter().map(|monitor| monitor.evidence.len()).sum::<usize>(),
        ),
        mut messages in prop::collection::vec((0..=END, 0..4_u32, 0..16_u8, any::<bool>()), 0..16),
        monitors in Just(monitors),
    ) -> (Vec<Monitor>, Recording, Vec<u8>) {
        messages.sort_by_key(|message| message.0);
        let values = messages.iter().map(|message| message.2).collect();
        let mut all: Vec<RecordedMessage> = Vec::new();
        for (at, stream, _, joined) in messages {
            // A message is joined with the same one in another stream, and no evidence hears both.
            let apart = |last: &RecordedMessage| {
                let both = |of: &Vec<u32>| of.contains(&stream) && of.contains(&last.stream);
                last.at == T(at) && last.stream != stream && !last.joined && !streams.iter().any(both)
            };
            let joined = joined && all.last().is_some_and(apart);
            all.push(RecordedMessage { at: T(at), stream, joined });
        }
        (monitors, Recording { messages: all, streams, end: T(END) }, values)
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1500))]

    #[test]
    fn a_tolerance_is_the_largest_delay_below_which_all_keep_the_decisions(
        (monitors, recording, values) in any_recording(),
        streams in prop::sample::subsequence(vec![0_u32, 1, 2, 3], 1..=3),
    ) {
        let network = Arc::new(Network::new(&monitors).unwrap());
        let mut conditions = |evidence, heard, latest: &[usize]| truth(&values, evidence, heard, latest);
        let found = tolerance(&network, &recording, &mut conditions, &streams, network.order());
        let recorded = delayed(&network, &recording, &values, &streams, 0);
        let first_broken = (1..=END + 8).find(|&delay| {
            let found = delayed(&network, &recording, &values, &streams, delay);
            !recorded.iter().zip(&found).all(|(recorded, found)| is_kept(recorded, found, delay, END))
        });
        let Some(broken) = first_broken else {
            prop_assert_eq!((found.delay, found.limit), (SimTime::MAX, Limit::None));
            return Ok(());
        };
        prop_assert_eq!(found.delay, T(broken - 1));
        let Limit::Decision(limit) = found.limit else { panic!("{found:?}") };
        let rank = network.order().iter().position(|&monitor| monitor == limit.monitor).unwrap();
        let changed = &delayed(&network, &recording, &values, &streams, broken)[rank];
        prop_assert!(!is_kept(&recorded[rank], changed, broken, END));
        prop_assert_eq!(limit.recorded, recorded[rank].get(limit.position).copied());
        prop_assert_eq!(limit.delayed, changed.get(limit.position).copied());
    }
}

#[test]
fn a_pulse_that_comes_too_late_is_found() {
    let mut monitor = random::monitor(random::plain(2), vec![Gate::All(vec![Gate::Evidence(0), Gate::Evidence(1)])]);
    monitor.name = "both".into();
    let network = Network::new(&[monitor]).unwrap();
    let at = [(0, 1), (100, 0), (150, 0), (200, 1)];
    let messages = at.iter().map(|&(at, stream)| RecordedMessage { at: T(at), stream, joined: false }).collect();
    let recording = Recording { messages, streams: vec![vec![0], vec![1]], end: T(1000) };
    // The first is true from 100 to 150, the second from 0 to 200.
    let mut conditions = |_, heard: usize, _: &[usize]| Truth::from(heard < 2);
    let each = tolerances(&network, &recording, &mut conditions, &[&[0], &[1]], &[MonitorId(0)]);
    assert_eq!(each[0].delay, T(100), "the first begins as the second ends, and was recorded before it");
    assert_eq!(each[1].delay, T(150), "the second begins as the first ends");
    let Limit::Decision(broken) = each[0].limit else { panic!("{each:?}") };
    assert_eq!((broken.position, broken.recorded.unwrap().at), (1, T(100)));
}
