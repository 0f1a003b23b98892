//! Two recordings of real runs, one with a topic that is late; tolerances compared with recordings whose messages are
//! really delayed.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::BufWriter;

use mcap::records::MessageHeader;
use mcap::{WriteOptions, Writer};

use sesame_base::observation::{ChangeCause, MonitorObservation, Observation};
use sesame_monitor::State;
use sesame_monitor::compare::{compare, steps};
use sesame_monitor::difference::disagreements;
use sesame_monitor::tolerance::{Limit, Tolerance};
use sesame_plan::testing::{
    evidence_above, guarantee, metric, minimal, monitor, operation, requirement, score, test_of, topic, use_of,
};
use sesame_plan::{
    Bound, Choice, Distribution, Drain, Evidence, FieldRef, Gate, Metric, MetricSource, MonitorId, MonitorState,
    OperationKind, RequirementId, Score, Stale, StaleIs, Test, TopicId, Trend, Type,
};

use super::*;
use crate::{Subject, TraceWriter, feed};
use sesame_relay::evaluate::{Custom, Run, evaluate_tapped};
use sesame_relay::metric::MetricTable;
use sesame_relay::relay::Exchange;
use sesame_relay::simulator::Progress;
use sesame_relay::transport::{Capabilities, Transport, TransportError};
use sesame_relay::value::Value;

const MS: i64 = 1_000_000;

/// Publishes numbers at times in milliseconds.
struct Script {
    now: SimTime,
    messages: Vec<(i64, &'static str, f64)>,
    next: usize,
}

impl Transport for Script {
    fn capabilities(&self) -> Capabilities {
        Capabilities { lock_stepped: true, resets: true }
    }
    fn reset(&mut self, _: u64, relay: &mut dyn Exchange) -> Result<(), TransportError> {
        for wire in relay.wires().iter() {
            relay.subscribed(wire);
        }
        Ok(())
    }
    fn advance(&mut self, until: SimTime, relay: &mut dyn Exchange) -> Result<Progress, TransportError> {
        let at = self.messages.get(self.next).map(|message| SimTime::from_nanos(message.0 * MS));
        self.now = at.map_or(until, |at| at.min(until));
        relay.advance(self.now, &mut Vec::new());
        while let Some(&(at, path, value)) =
            self.messages.get(self.next).filter(|message| message.0 * MS <= self.now.nanos())
        {
            assert_eq!(at * MS, self.now.nanos());
            self.next += 1;
            let wire = relay.wires().find(path).unwrap();
            relay.message(self.now, wire, Value::Real(value), &mut Vec::new());
        }
        Ok(if self.now >= until { Progress::Ended } else { Progress::Running })
    }
    fn now(&self) -> SimTime {
        self.now
    }
    fn close(&mut self) {}
}

/// `near` is above zero on `a`; `lit` above zero on `b` for 20 ms, and false after 400 ms of silence; `seen` is what is
/// published on `b`, whatever is made of it. An operation may delay what is on `b`.
fn plan() -> CampaignPlan {
    let lit = Evidence {
        held: 0.02,
        stale: Some(Stale { after: 0.4, is: StaleIs::False, all: false }),
        ..evidence_above("lit", 1, 0.0)
    };
    let seen = Evidence { side: Side::Inbound, ..evidence_above("seen", 1, 0.0) };
    let all = Gate::All(vec![Gate::Evidence(0), Gate::Evidence(1)]);
    let one = Gate::Any(vec![Gate::Evidence(1), Gate::Evidence(2)]);
    let evidence = vec![evidence_above("near", 0, 0.0), lit, seen];
    let guarantees = vec![guarantee("both", 2, all), guarantee("light", 1, one)];
    let late = OperationKind::Latency { distribution: Distribution::Fixed, drain: Drain::Finish };
    let real = || Type::Real { unit: None };
    let last = MetricSource::Last { input: FieldRef { topic: TopicId(0), path: Vec::new() } };
    let mut plan = CampaignPlan {
        topics: vec![topic("a", &["a"], real()), topic("b", &["b"], real()), topic("state", &["state"], Type::Text)],
        metrics: vec![metric("a", last)],
        operations: vec![operation(1, late)],
        monitors: vec![monitor("cell", 2, evidence, guarantees)],
        ..minimal()
    };
    plan.campaign.end_after = 3.0;
    plan
}

/// Runs a test with these messages, and records it in a file of this name.
fn recorded(
    folder: &Path,
    name: &str,
    plan: &CampaignPlan,
    test: &Test,
    mut script: Vec<(i64, &'static str, f64)>,
) -> Observation {
    script.sort_by_key(|message| message.0);
    let wires = WireTable::new(plan);
    let table = MetricTable::new(plan, &wires, &[]).unwrap();
    let subject = Subject { plan, number: 1, test, simulator_seed: 1 };
    let mut writer = TraceWriter::create(&folder.join("unfinished"), subject, &wires).unwrap();
    let mut transport = Script { now: SimTime::ZERO, messages: script, next: 0 };
    let run = Run { test, simulator_seed: 1, withheld: &[], lists_altered: false };
    let tap = Some(&mut writer as &mut dyn sesame_relay::relay::Listener);
    let seen = evaluate_tapped(plan, &wires, &table, &mut transport, &run, &mut Custom::none(), tap).unwrap();
    writer.keep(&seen, &folder.join(name)).unwrap();
    // Monitors decide on the recording as they did in the run.
    let fed = feed(&folder.join(name), plan, &wires, &table).unwrap();
    assert_eq!(fed.monitors, seen.monitors);
    let (heard, ..) = monitors(&folder.join(name), plan, &wires, &network(plan)).unwrap();
    assert_eq!(decided(&heard), of_run(&seen.monitors[0]));
    seen
}

fn network(plan: &CampaignPlan) -> Arc<Network> {
    Arc::new(Network::new(&plan.monitors).unwrap())
}

type Decisions = Vec<(i64, Option<u32>)>;

fn decided(heard: &RecordedMonitors<'_>) -> Decisions {
    let state = |state| match state {
        State::Guarantee(at) => Some(at),
        State::Safe => None,
    };
    heard.decide().course.decisions.iter().map(|decision| (decision.at.nanos(), state(decision.state))).collect()
}

fn of_run(observed: &MonitorObservation) -> Decisions {
    let state = |state| match state {
        MonitorState::Guarantee(at) => Some(at),
        MonitorState::Otherwise => None,
    };
    observed
        .decisions
        .iter()
        .map(|decision| (SimTime::from_seconds(decision.time).nanos(), state(decision.state)))
        .collect()
}

/// The decisions on a copy of a recording in which what is on a topic comes so much later: fed to the monitors of the
/// relay, message by message.
fn delayed(file: &Path, plan: &CampaignPlan, late: &str, delay: i64) -> Decisions {
    let copy = file.with_extension("delayed.mcap");
    let bytes = fs::read(file).unwrap();
    let mut messages: Vec<_> = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap).collect();
    for message in &mut messages {
        let topic = message.channel.topic.strip_suffix("/delivered").unwrap_or(&message.channel.topic);
        if topic == late {
            message.log_time += u64::try_from(delay).unwrap();
        }
    }
    let end = 3000 * MS.unsigned_abs();
    messages.sort_by_key(|message| message.log_time);
    let mut writer = Writer::with_options(BufWriter::new(File::create(&copy).unwrap()), uncompressed()).unwrap();
    let metadata = |writer: &mut Writer<_>, wanted: &str| {
        for record in mcap::read::LinearReader::new(&bytes).unwrap() {
            if let mcap::records::Record::Metadata(metadata) = record.unwrap()
                && metadata.name == wanted
            {
                writer.write_metadata(&metadata).unwrap();
            }
        }
    };
    metadata(&mut writer, crate::trace::SUBJECT);
    // Whether messages are delivered apart is known of all channels before the first message.
    let mut channels = BTreeMap::new();
    for message in &messages {
        let mut add = || writer.add_channel(0, &message.channel.topic, "json", &message.channel.metadata).unwrap();
        channels.entry(message.channel.topic.clone()).or_insert_with(&mut add);
    }
    for message in messages.iter().filter(|message| message.log_time <= end) {
        let (sequence, log_time) = (message.sequence, message.log_time);
        let channel_id = channels[&message.channel.topic];
        let header = MessageHeader { channel_id, sequence, log_time, publish_time: log_time };
        writer.write_to_known_channel(&header, &message.data).unwrap();
    }
    metadata(&mut writer, crate::trace::RUN);
    writer.finish().unwrap();
    drop(writer);
    let wires = WireTable::new(plan);
    let table = MetricTable::new(plan, &wires, &[]).unwrap();
    of_run(&feed(&copy, plan, &wires, &table).unwrap().monitors[0])
}

fn uncompressed() -> WriteOptions {
    WriteOptions::new().compression(None)
}

fn is_kept(recorded: &Decisions, found: &Decisions, delay: i64) -> bool {
    let missing = recorded.iter().skip(found.len()).all(|(at, _)| at + delay > 3000 * MS);
    let same = recorded.iter().zip(found).all(|(a, b)| a.1 == b.1 && (a.0 - b.0).abs() <= delay);
    missing && same && found.len() <= recorded.len()
}

/// Compares a tolerance with all delays up to 700 ms, to the nanosecond: with these messages nothing changes between a
/// whole millisecond and the next but for what changes a nanosecond after it.
fn is_the_first_that_breaks(file: &Path, plan: &CampaignPlan, late: &str, found: Tolerance) {
    let recorded = delayed(file, plan, late, 0);
    let mut delays = (0..700).flat_map(|ms| [ms * MS, ms * MS + 1]);
    let broken = delays.find(|&delay| !is_kept(&recorded, &delayed(file, plan, late, delay), delay));
    match broken {
        Some(broken) => assert_eq!(found.delay.nanos(), broken - 1, "{late}: {found:?}"),
        None => assert!(found.delay.nanos() >= 700 * MS, "{late}: {found:?}"),
    }
}

#[test]
fn fifty_milliseconds_are_found_with_the_evidence_that_is_late_and_what_could_have_been_borne() {
    let folder = tempfile::tempdir().unwrap();
    let plan = plan();
    let script = |late: i64| {
        let of_a = [(0, "a", 0.0), (1000, "a", 1.0), (1100, "a", 0.0)];
        let of_b = [(0, "b", 0.0), (900, "b", 0.0), (1060, "b", 1.0), (1400, "b", 0.0)];
        of_a.into_iter().chain(of_b.map(|(at, path, value)| (at + late, path, value))).collect::<Vec<_>>()
    };
    recorded(folder.path(), "simulation.mcap", &plan, &test_of(vec![]), script(0));
    recorded(folder.path(), "lab.mcap", &plan, &test_of(vec![]), script(50));
    let (wires, network, cell) = (WireTable::new(&plan), network(&plan), MonitorId(0));
    let file = |name: &str| folder.path().join(name);
    let (simulation, run, warnings) = monitors(&file("simulation.mcap"), &plan, &wires, &network).unwrap();
    let (lab, ..) = monitors(&file("lab.mcap"), &plan, &wires, &network).unwrap();
    assert_eq!((run.unwrap().outcome.as_str(), warnings), ("completed", vec![]));
    let [a, b] = [simulation.decide(), lab.decide()];
    let ms = |at: i64| SimTime::from_nanos(at * MS);

    // `light` 1060, `both` 1080, `light` 1100, nothing 1400; in the lab `light` 1110, nothing 1450.
    let compared = compare(&steps(&a.course.decisions, cell), &steps(&b.course.decisions, cell));
    let difference = compared.difference.unwrap();
    assert_eq!(difference.position, 2, "after `light`, 50 ms late");
    assert_eq!((difference.first.unwrap().at, difference.first.unwrap().state), (ms(1080), State::Guarantee(0)));
    assert_eq!((difference.second.unwrap().at, difference.second.unwrap().state), (ms(1450), State::Safe));
    assert_eq!(compared.shifts, [ms(0), ms(50)]);

    let found = disagreements(&network, cell, &a.course, &b.course);
    let at: Vec<_> = found.iter().map(|disagreement| (disagreement.from, disagreement.to)).collect();
    assert_eq!(at, [(ms(1060), ms(1080)), (ms(1080), ms(1100)), (ms(1100), ms(1110)), (ms(1400), ms(1450))]);
    let [lit] = found[1].because[..] else { panic!("{found:?}") };
    assert_eq!((lit.evidence, lit.late(&a.course, &b.course)), (network.evidence(cell, 1), Some(ms(50))));
    assert_eq!(a.causes[lit.first.since.unwrap()], ChangeCause::Held);
    let [_, seen] = found[3].because[..] else { panic!("{found:?}") };
    let message = |causes: &[ChangeCause], at: usize| match &causes[at] {
        ChangeCause::Message { topic, index } => (topic.clone(), *index),
        other => panic!("{other:?}"),
    };
    assert_eq!(message(&a.causes, seen.first.since.unwrap()), ("b".to_owned(), 3));
    assert_eq!(message(&b.causes, seen.follows.unwrap()), ("b".to_owned(), 3));

    let topics: Vec<&str> = simulation.topics().iter().map(|topic| topic.0).collect();
    assert_eq!(topics, ["a", "b"]);
    let tolerances = simulation.tolerances(&[cell]);
    assert_eq!(tolerances[1].delay, ms(20), "`lit` begins as `near` ends");
    assert!(matches!(tolerances[1].limit, Limit::Decision(broken) if broken.position == 2), "{tolerances:?}");
    for (topic, tolerance) in topics.into_iter().zip(tolerances) {
        is_the_first_that_breaks(&file("simulation.mcap"), &plan, topic, tolerance);
    }
}

#[test]
fn tolerances_of_runs_at_random_are_those_of_recordings_that_are_delayed() {
    let folder = tempfile::tempdir().unwrap();
    let plan = plan();
    for round in 0..4_u32 {
        let mut random = sesame_rng::Stream::derive(round.into(), "script", &[]);
        let mut number = |below: usize| i64::try_from(random.below(below)).unwrap();
        let mut script = Vec::new();
        for _ in 0..25 {
            script.push((number(150) * 20, if number(2) == 0 { "a" } else { "b" }, number(3) as f64 - 0.5));
        }
        script.sort_by_key(|message| message.0);
        let late = use_of(0, 0.5, 2.5, vec![Choice::Value { value: 0.03 }], 1);
        recorded(folder.path(), "run.mcap", &plan, &test_of(vec![late]), script);
        let (wires, file) = (WireTable::new(&plan), folder.path().join("run.mcap"));
        let (heard, ..) = monitors(&file, &plan, &wires, &network(&plan)).unwrap();
        let found = heard.tolerances(&[MonitorId(0)]);
        for ((topic, _), tolerance) in heard.topics().into_iter().zip(found) {
            is_the_first_that_breaks(&file, &plan, topic, tolerance);
        }
    }
}

/// Fuzzing time is at most 300 ms; what is scored is how early the monitor was in its safe state.
fn with_limit() -> CampaignPlan {
    let mut plan = plan();
    let fuzzing_time = metric("fuzzing_time", MetricSource::FuzzingTime);
    plan.metrics.push(Metric { trend: Some(Trend::Rising), ..fuzzing_time });
    plan.requirements = vec![requirement("briefly", 1, Bound::AtMost { value: 0.3 })];
    let requirement = RequirementId(0);
    for of in [Score::MissedHazards { requirement }, Score::LeadTime { requirement }] {
        plan.metrics.push(score("score", 0, of));
    }
    plan
}

#[test]
fn hazards_of_the_fuzzing_time_are_scored_from_recordings_too() {
    let folder = tempfile::tempdir().unwrap();
    let plan = with_limit();
    let late = use_of(0, 0.5, 1.0, vec![Choice::Value { value: 0.03 }], 1);
    let stops = vec![(100, "b", 1.0), (600, "b", 0.0)];
    // Beyond 300 ms is a nanosecond after 800 ms.
    for (script, missed, lead) in [(stops, 0.0, Some(0.200_000_001)), (vec![(100, "b", 1.0)], 1.0, None)] {
        let seen = recorded(folder.path(), "run.mcap", &plan, &test_of(vec![late.clone()]), script);
        let (wires, file) = (WireTable::new(&plan), folder.path().join("run.mcap"));
        let fed = feed(&file, &plan, &wires, &MetricTable::new(&plan, &wires, &[]).unwrap()).unwrap();
        assert_eq!(fed.metrics, seen.metrics);
        assert_eq!((seen.metrics[2].value, seen.metrics[3].value), (Some(missed), lead), "{seen:?}");
    }
}

#[test]
fn hazards_of_the_fuzzing_time_are_unknown_where_nobody_says_what_operations_did() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("foreign.mcap");
    let mut writer = Writer::with_options(BufWriter::new(File::create(&file).unwrap()), uncompressed()).unwrap();
    let channel = writer.add_channel(0, "b", "json", &BTreeMap::new()).unwrap();
    let header = MessageHeader { channel_id: channel, sequence: 0, log_time: 1, publish_time: 1 };
    writer.write_to_known_channel(&header, b"{\"value\":1.0}").unwrap();
    writer.finish().unwrap();
    drop(writer);
    let plan = with_limit();
    let wires = WireTable::new(&plan);
    let fed = feed(&file, &plan, &wires, &MetricTable::new(&plan, &wires, &[]).unwrap()).unwrap();
    assert_eq!(fed.metrics[2].value, None);
    let said = "`score` has no value: the recording does not say when operations were active, so it is not known when \
                briefly was violated";
    assert!(fed.warnings.contains(&said.to_owned()), "{:?}", fed.warnings);
}
