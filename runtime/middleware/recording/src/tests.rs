//! Traces written, read again, cut off, and made up.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{BufWriter, Cursor};
use std::path::Path;

use mcap::records::MessageHeader;
use mcap::{WriteOptions, Writer};

use sesame_base::observation::{MetricObservation, Observation, Outcome};
use sesame_base::time::SimTime;
use sesame_plan::testing::{latency, offset, operation, plan, test_of, use_of};
use sesame_plan::{
    Activation, Aggregate, CampaignPlan, Choice, Distribution, Drain, Expression, Formula, Input, Members, Metric,
    MetricSource, Operation, OperationKind, Side, Test, TestOperation, ValueMode,
};
use sesame_rng::Stream;

use super::*;
use crate::trace::{CLOCK, RUN, SUBJECT};
use sesame_relay::evaluate::{Custom, Run, evaluate_tapped};
use sesame_relay::files::NoFiles;
use sesame_relay::metric::MetricTable;
use sesame_relay::relay::Exchange;
use sesame_relay::simulator::Progress;
use sesame_relay::transport::{Capabilities, Transport, TransportError};
use sesame_relay::value::{Fields, Record, Value};
use sesame_relay::wire::WireTable;

/// Publishes awkward numbers on all wires, ten times a second.
struct Awkward(SimTime);

impl Transport for Awkward {
    fn capabilities(&self) -> Capabilities {
        Capabilities { lock_stepped: true, resets: true }
    }
    fn reset(&mut self, _: u64, relay: &mut dyn Exchange) -> Result<(), TransportError> {
        self.0 = SimTime::ZERO;
        relay.clock_at_zero(1.7e9);
        for wire in relay.wires().iter() {
            relay.subscribed(wire);
        }
        Ok(())
    }
    fn advance(&mut self, until: SimTime, relay: &mut dyn Exchange) -> Result<Progress, TransportError> {
        if self.0 >= until {
            return Ok(Progress::Ended);
        }
        self.0 = self.0 + SimTime::from_seconds(0.1);
        let fields = Fields::new(["level", "count"]);
        relay.advance(self.0, &mut Vec::new());
        let third = self.0.seconds() / 3.0;
        for wire in relay.wires().iter() {
            let value = match relay.wires().path(wire) {
                "arm/command" => Value::Real(if third > 3.0 { f64::NAN } else { -third }),
                _ => Record::new(&fields, vec![Value::Real(third * 1e-300), Value::Int(i64::MIN)]).into(),
            };
            relay.message(self.0, wire, value, &mut Vec::new());
        }
        Ok(Progress::Running)
    }
    fn now(&self) -> SimTime {
        self.0
    }
    fn close(&mut self) {}
}

fn awkward_plan() -> (CampaignPlan, Test) {
    let mut plan = plan(vec![
        operation(0, offset(ValueMode::Offset, false)),
        operation(1, OperationKind::Blackhole),
        operation(1, latency(Distribution::Fixed, Drain::Drop)),
    ]);
    plan.metrics[1].default = Some(0.1);
    let shift = vec![Choice::Range { low: 0.1, high: 0.2 }];
    let late = vec![Choice::Value { value: 0.35 }];
    let test =
        test_of(vec![use_of(0, 1.0, 2.0, shift, 1), use_of(1, 3.0, 4.0, vec![], 2), use_of(2, 5.0, 6.0, late, 3)]);
    (plan, test)
}

/// A run of this test with its trace in `T1.mcap` of this folder.
fn traced(folder: &Path, plan: &CampaignPlan, test: &Test) -> Observation {
    let wires = WireTable::new(plan);
    let table = MetricTable::new(plan, &wires, &[]).unwrap();
    let subject = Subject { plan, number: 1, test, simulator_seed: u64::MAX };
    let mut writer = TraceWriter::create(&folder.join("unfinished"), subject, &wires).unwrap();
    let mut transport = Awkward(SimTime::ZERO);
    let run = Run { test, simulator_seed: 1, withheld: &[], lists_altered: false };
    let mut custom = Custom { hooks: &[], files: Box::new(NoFiles) };
    let observed = evaluate_tapped(plan, &wires, &table, &mut transport, &run, &mut custom, Some(&mut writer)).unwrap();
    assert!(!folder.join("T1.mcap").exists(), "it has its name only when it is complete");
    writer.keep(&observed, &folder.join("T1.mcap")).unwrap();
    assert!(!folder.join("unfinished").exists());
    observed
}

fn fed(file: &Path, plan: &CampaignPlan) -> Result<Fed, RecordingError> {
    let wires = WireTable::new(plan);
    let table = MetricTable::new(plan, &wires, &[]).unwrap();
    feed(file, plan, &wires, &table)
}

/// The messages of a file by topic, in order.
fn content(file: &Path) -> BTreeMap<String, Vec<(u64, u32, String)>> {
    let bytes = fs::read(file).unwrap();
    let mut topics: BTreeMap<String, Vec<_>> = BTreeMap::new();
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        let payload = String::from_utf8(message.data.to_vec()).unwrap();
        let schema = message.channel.schema.as_ref().unwrap();
        assert_eq!((schema.encoding.as_str(), message.channel.message_encoding.as_str()), ("jsonschema", "json"));
        topics.entry(message.channel.topic.clone()).or_default().push((message.log_time, message.sequence, payload));
    }
    topics
}

#[test]
fn a_trace_holds_every_message_and_what_each_operation_did_to_it() {
    let folder = tempfile::tempdir().unwrap();
    let (plan, test) = awkward_plan();
    let observed = traced(folder.path(), &plan, &test);
    let topics = content(&folder.path().join("T1.mcap"));
    let published: usize = ["arm/command", "zones/Z1", "zones/Z2"].iter().map(|topic| topics[*topic].len()).sum();
    assert_eq!(published as u64, observed.messages);
    assert_eq!(topics["arm/command"][0], (100_000_000, 0, "{\"value\":-0.03333333333333333}".to_owned()));
    assert_eq!(topics["arm/command"][99].2, "{\"value\":\"NaN\"}");
    assert_eq!(topics["zones/Z1"][2].2, "{\"level\":9.999999999999999e-302,\"count\":-9223372036854775808}");

    // The numbers of deeds are those that the operations counted.
    let deeds: Vec<serde_json::Value> =
        topics["sesame/operations"].iter().map(|(_, _, json)| serde_json::from_str(json).unwrap()).collect();
    let count =
        |did: &str, at: usize| deeds.iter().filter(|event| event["did"] == did && event["position"] == at).count();
    for (at, operation) in observed.operations.iter().enumerate() {
        let counters = operation.counters;
        assert_eq!((count("started", at), count("ended", at)), (1, 1));
        assert_eq!(count("changed", at) as u64, counters.changed);
        assert_eq!(count("dropped", at) as u64, counters.dropped);
        assert!(counters.any_effect(), "{at}");
    }
    // A message that was held back at the end of the window and lost was delayed first.
    assert_eq!(count("delayed", 2) as u64, observed.operations[2].counters.delayed + count("dropped", 2) as u64);

    // What arrived is what was published, less what was dropped, and what was changed differs.
    let arrived = &topics["zones/Z1/delivered"];
    let lost = deeds.iter().filter(|event| event["did"] == "dropped" && event["topic"] == "zones/Z1").count();
    assert_eq!(arrived.len() + lost, topics["zones/Z1"].len());
    let changed = &deeds.iter().find(|event| event["did"] == "changed").unwrap()["message"];
    let number = changed.as_u64().unwrap();
    let find = |topic: &str| topics[topic].iter().find(|(_, sequence, _)| u64::from(*sequence) == number).unwrap();
    assert_ne!(find("arm/command").2, find("arm/command/delivered").2);

    let bytes = fs::read(folder.path().join("T1.mcap")).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let metadata: Vec<_> = summary.metadata_indexes.iter().map(|index| index.name.as_str()).collect();
    assert_eq!(metadata, [SUBJECT, CLOCK, RUN]);
}

#[test]
fn a_recording_gives_metrics_their_values_again() {
    let folder = tempfile::tempdir().unwrap();
    let (plan, test) = awkward_plan();
    let mut plan = plan;
    plan.operations[1].timed = false;
    plan.metrics.push(age(&plan));
    let observed = traced(folder.path(), &plan, &test);
    assert_eq!(observed.metrics[0].value, Some(2.0), "two of three operations count");
    let oldest = observed.metrics.last().and_then(|metric| metric.value).unwrap();
    assert!(oldest > 1.7e9, "stamps are by the clock of the simulator: {oldest}");
    let fed = fed(&folder.path().join("T1.mcap"), &plan).unwrap();
    assert_eq!(fed.metrics, observed.metrics, "series and fuzzing time as well");
    assert_eq!((fed.messages, &fed.warnings), (observed.messages, &observed.warnings));
    let run = fed.run.unwrap();
    assert_eq!((run.test.as_str(), run.outcome.as_str()), ("T1", "completed"));
    let values: Vec<Option<f64>> = run.metrics.iter().map(|metric| metric.value).collect();
    assert_eq!(values, observed.metrics.iter().map(|metric| metric.value).collect::<Vec<_>>());
}

#[test]
fn a_recording_says_what_its_test_chose_for_the_space() {
    let folder = tempfile::tempdir().unwrap();
    let (mut plan, test) = awkward_plan();
    let scene = OperationKind::Scene { parameter: Some("arm/start".to_owned()), usual: Some(0.5) };
    plan.operations.push(Operation { name: "start".to_owned(), ..operation(0, scene) });
    let MetricSource::Last { input } = &plan.metrics[1].source else { panic!("it is the last command") };
    let start = Expression::Scene { operation: "start".to_owned(), usual: 0.5 };
    let formula = Formula {
        inputs: vec![Input::new(input.clone(), Members::Min)],
        aggregate: Aggregate::Max { of: Expression::Sum(vec![Expression::Input(0), start]) },
        when: None,
        every: None,
        per: None,
        side: Side::Inbound,
    };
    let source = MetricSource::Formula { formula };
    plan.metrics.push(Metric { name: "from_start".to_owned(), source, ..plan.metrics[1].clone() });
    plan.validate().unwrap();
    // The greatest command is the first, of minus a third of a tenth.
    let from_start = |metrics: &[MetricObservation], start: f64| {
        let value = metrics.last().and_then(|metric| metric.value).unwrap();
        assert!((value - (start - 0.1 / 3.0)).abs() < 1e-12, "{value} from {start}");
    };
    from_start(&traced(tempfile::tempdir().unwrap().path(), &plan, &test).metrics, 0.5);

    let mut chosen = test;
    chosen.operations.push(TestOperation {
        activation: Activation::Offline,
        ..use_of(3, 0.0, 0.0, vec![Choice::Value { value: 7.0 }], 4)
    });
    from_start(&traced(folder.path(), &plan, &chosen).metrics, 7.0);
    let file = folder.path().join("T1.mcap");
    from_start(&fed(&file, &plan).unwrap().metrics, 7.0);
    // So it does where the campaign has other operations.
    plan.operations.rotate_right(1);
    from_start(&fed(&file, &plan).unwrap().metrics, 7.0);
    plan.operations.clear();
    from_start(&fed(&file, &plan).unwrap().metrics, 7.0);
    let other = folder.path().join("foreign.mcap");
    foreign(&other, &[("arm/command", "json", 0, r#"{"value":-0.25}"#)]);
    let of_others = fed(&other, &plan).unwrap().metrics;
    assert_eq!(of_others.last().and_then(|metric| metric.value), Some(0.25), "nobody chose another start");
}

/// The greatest age of a command, as if it were its stamp.
fn age(plan: &CampaignPlan) -> Metric {
    let MetricSource::Last { input } = &plan.metrics[1].source else { panic!("it is the last command") };
    let stamp = Expression::Negate(Box::new(Expression::Input(0)));
    let formula = Formula {
        inputs: vec![Input::new(input.clone(), Members::Min)],
        aggregate: Aggregate::Max { of: Expression::Sum(vec![Expression::Now, stamp]) },
        when: None,
        every: None,
        per: None,
        side: Side::Inbound,
    };
    Metric { name: "age".to_owned(), source: MetricSource::Formula { formula }, ..plan.metrics[1].clone() }
}

#[test]
fn a_discarded_trace_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let (plan, test) = awkward_plan();
    let wires = WireTable::new(&plan);
    let subject = Subject { plan: &plan, number: 1, test: &test, simulator_seed: 1 };
    drop(TraceWriter::create(&folder.path().join("unfinished"), subject, &wires).unwrap());
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn what_a_dead_process_had_written_is_saved() {
    let folder = tempfile::tempdir().unwrap();
    let (plan, test) = awkward_plan();
    traced(folder.path(), &plan, &test);
    let whole = fs::read(folder.path().join("T1.mcap")).unwrap();
    let all = content(&folder.path().join("T1.mcap"));
    let limit = Outcome::Timeout { limit: 2.0 };
    let (unfinished, saved) = (folder.path().join("unfinished"), folder.path().join("T2.mcap"));
    let mut kept = Vec::new();
    for share in 0..=20 {
        fs::write(&unfinished, &whole[..whole.len() * share / 20]).unwrap();
        recover(&unfinished, &limit, &saved).unwrap();
        let found = content(&saved);
        assert!(found.iter().all(|(topic, messages)| all[topic].starts_with(messages)), "{share}");
        kept.push(found.values().map(Vec::len).sum::<usize>());
        let left: Vec<_> = fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        assert_eq!(left.len(), 2, "{left:?}");
    }
    assert!(kept.is_sorted() && kept[0] == 0 && kept[20] == all.values().map(Vec::len).sum::<usize>(), "{kept:?}");
    let run = fed(&saved, &plan).unwrap().run.unwrap();
    assert_eq!(run.outcome, "timeout");
    // Where nothing was begun there is nothing to save.
    recover(&folder.path().join("nothing"), &limit, &folder.path().join("T3.mcap")).unwrap();
    assert!(!folder.path().join("T3.mcap").exists());
}

/// A file as another program writes it: one message per entry, with topic, encoding, time and payload.
fn foreign(file: &Path, messages: &[(&str, &str, u64, &str)]) {
    let mut writer = Writer::new(BufWriter::new(File::create(file).unwrap())).unwrap();
    for (topic, encoding, time, payload) in messages {
        let channel_id = writer.add_channel(0, topic, encoding, &BTreeMap::new()).unwrap();
        let header = MessageHeader { channel_id, sequence: 0, log_time: *time, publish_time: *time };
        writer.write_to_known_channel(&header, payload.as_bytes()).unwrap();
    }
    writer.finish().unwrap();
}

#[test]
fn a_recording_of_another_program_is_fed_where_topic_and_payload_match() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("foreign.mcap");
    let mut plan = awkward_plan().0;
    plan.metrics.push(age(&plan));
    let epoch = 1_700_000_000_000_000_000;
    foreign(
        &file,
        &[
            ("other", "cdr", epoch - 5, "?"),
            ("arm/command", "json", epoch, "2.5"),
            ("arm/command", "json", epoch + 500_000_000, "{\"value\": 3}"),
        ],
    );
    let fed = fed(&file, &plan).unwrap();
    assert_eq!((fed.run, fed.messages), (None, 2));
    assert_eq!(fed.metrics[1].series, [(0.0, 2.5), (0.5, 3.0)], "time begins with the first message that counts");
    assert_eq!(fed.metrics[0].value, None, "nobody knows what was fuzzed");
    let oldest = fed.metrics.last().and_then(|metric| metric.value).unwrap();
    assert!(
        (oldest - (1.7e9 + 0.4 - 2.5)).abs() < 1e-6,
        "at the last step before it is renewed, by the clock: {oldest}"
    );
    assert_eq!(fed.warnings, ["topic `zones/Z1` is not in the recording", "topic `zones/Z2` is not in the recording"]);
}

#[test]
fn messages_that_are_nearly_in_order_are_put_in_order() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("foreign.mcap");
    foreign(
        &file,
        &[
            ("arm/command", "json", 2_000_000_000, "3"),
            ("arm/command", "json", 1_000_000_000, "2"),
            ("arm/command", "json", 2_000_000_000, "4"),
        ],
    );
    let fed = fed(&file, &awkward_plan().0).unwrap();
    assert_eq!(fed.metrics[1].series, [(0.0, 2.0), (1.0, 4.0)], "of one time, the last one in the file counts");
}

#[test]
fn a_recording_of_another_program_that_is_cut_off_is_read_up_to_there() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("foreign.mcap");
    let mut writer = WriteOptions::new().chunk_size(Some(1)).create(File::create(&file).unwrap()).unwrap();
    let channel_id = writer.add_channel(0, "arm/command", "json", &BTreeMap::new()).unwrap();
    for time in [1, 2, 3] {
        let header = MessageHeader { channel_id, sequence: 0, log_time: time * 1_000_000_000, publish_time: 0 };
        writer.write_to_known_channel(&header, b"1").unwrap();
    }
    writer.finish().unwrap();
    let whole = fs::read(&file).unwrap();
    let third = whole.windows(8).rposition(|window| window == 3_000_000_000u64.to_le_bytes()).unwrap();
    let first = whole.windows(8).position(|window| window == 3_000_000_000u64.to_le_bytes()).unwrap();
    assert!(first < third);
    fs::write(&file, &whole[..first]).unwrap();
    let fed = fed(&file, &awkward_plan().0).unwrap();
    assert_eq!(fed.messages, 2);
    let said = fed.warnings.last().unwrap();
    assert_eq!(said, "the recording is cut off; what comes before, up to 1.000 s, is used");
    let plan = awkward_plan().0;
    let refused = signals(&file, &plan, &WireTable::new(&plan)).unwrap_err();
    assert!(matches!(refused, RecordingError::CutOff { .. }), "{refused}");
}

/// A recording of one message in CDR, with its definition.
fn in_cdr(file: &Path, topic: &str, name: &str, definition: &str, fields: &[u8]) {
    let mut writer = WriteOptions::new().create(File::create(file).unwrap()).unwrap();
    let schema = writer.add_schema(name, "ros2msg", definition.as_bytes()).unwrap();
    let channel_id = writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).unwrap();
    let header = MessageHeader { channel_id, sequence: 0, log_time: 1, publish_time: 1 };
    writer.write_to_known_channel(&header, &[&[0, 1, 0, 0], fields].concat()).unwrap();
    writer.finish().unwrap();
}

#[test]
fn a_message_has_to_have_what_is_read_of_it_and_may_be_of_another_shape() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("cdr.mcap");
    // The space declares `level` and `count`, and no metric reads them.
    let plan = awkward_plan().0;
    let wires = WireTable::new(&plan);
    in_cdr(&file, "zones/Z1", "p/msg/Zone", "float64 level", &1.5f64.to_le_bytes());
    assert_eq!(fed(&file, &plan).unwrap().messages, 1, "nobody reads what is missing");
    let said = signals(&file, &plan, &wires).unwrap_err().to_string();
    assert!(said.contains("field `count`: expected a value, found nothing"), "{said}");
    // A real that is a message of its own, as in `std_msgs`.
    in_cdr(&file, "arm/command", "std_msgs/msg/Float64", "float64 data", &2.5f64.to_le_bytes());
    assert_eq!(fed(&file, &plan).unwrap().metrics[1].value, Some(2.5));
    in_cdr(&file, "arm/command", "std_msgs/msg/String", "string data", &[2, 0, 0, 0, b'a', 0]);
    let said = fed(&file, &plan).unwrap_err().to_string();
    assert!(said.contains("not of its declared type: expected real, found text"), "{said}");
    in_cdr(&file, "arm/command", "std_msgs/msg/Float64", "nonsense", &[]);
    let said = fed(&file, &plan).unwrap_err().to_string();
    assert!(said.contains("the definition of `std_msgs/msg/Float64` in the file: line 1"), "{said}");
}

#[test]
fn what_cannot_be_fed_is_said_in_words() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("foreign.mcap");
    let (plan, test) = awkward_plan();
    let said = |messages: &[(&str, &str, u64, &str)]| {
        foreign(&file, messages);
        fed(&file, &plan).unwrap_err().to_string().replace(&file.display().to_string(), "FILE")
    };
    insta::assert_snapshot!(
        [
            said(&[("a\u{1b}", "json", 1, "1"), ("b", "json", 2, "1")]),
            said(&[]),
            said(&[("arm/command", "cdr", 1, "1")]),
            said(&[("arm/command", "json", 1, "\"high\"")]),
            said(&[("zones/Z1", "json", 1, "{\"level\": 1}")]),
            said(&[("arm/command", "json", 1, "not json")]),
            said(&[("arm/command", "json", 2, "1"), ("zones/Z1", "cdr", 1, "1")]),
            said(&[("arm/command", "protobuf", 1, "1")]),
        ]
        .join("\n")
    );
    traced(folder.path(), &plan, &test);
    let whole = fs::read(folder.path().join("T1.mcap")).unwrap();
    let of = |bytes: &[u8]| {
        fs::write(&file, bytes).unwrap();
        fed(&file, &plan).unwrap_err()
    };
    assert!(matches!(of(b"no trace at all"), RecordingError::Foreign { .. }));
    assert!(matches!(of(b""), RecordingError::CutOff { .. }));
    assert!(matches!(of(&whole[..whole.len() - 3]), RecordingError::CutOff { .. }));
    assert!(matches!(of(&whole[..whole.len() / 2]), RecordingError::CutOff { .. }));
    let mut changed = whole.clone();
    let at = whole.windows(10).position(|window| window == b"-0.0333333").unwrap();
    changed[at + 3] = b'7';
    assert!(matches!(of(&changed), RecordingError::Damaged { .. }), "a changed payload does not fit its checksum");
    let missing = fed(&folder.path().join("none.mcap"), &plan).unwrap_err();
    assert!(matches!(missing, RecordingError::Unreadable { .. }), "{missing}");
}

#[test]
fn a_recording_that_is_compressed_by_an_unknown_method_is_refused_with_a_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("compressed.mcap");
    let mut bytes = Cursor::new(Vec::new());
    let mut writer = WriteOptions::new().create(&mut bytes).unwrap();
    let channel_id = writer.add_channel(0, "arm/command", "json", &BTreeMap::new()).unwrap();
    let header = MessageHeader { channel_id, sequence: 0, log_time: 1, publish_time: 1 };
    writer.write_to_known_channel(&header, b"1").unwrap();
    writer.finish().unwrap();
    drop(writer);
    // The chunk's header says how it is compressed, as a text after times, size and checksum: `lzo` instead of nothing.
    let bytes = bytes.into_inner();
    let chunk =
        bytes.iter().enumerate().skip(8).find(|(at, byte)| **byte == 6 && bytes[at + 9 + 28..].starts_with(&[0; 4]));
    let (at, _) = chunk.unwrap();
    let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) + 3;
    let mut made = bytes[..=at].to_vec();
    made.extend(length.to_le_bytes());
    made.extend(&bytes[at + 9..at + 37]);
    made.extend([3, 0, 0, 0]);
    made.extend(b"lzo");
    made.extend(&bytes[at + 41..]);
    fs::write(&file, made).unwrap();
    let said = fed(&file, &awkward_plan().0).unwrap_err().to_string();
    assert!(said.contains("compressed by `lzo`") && said.contains("mcap compress --compression zstd"), "{said}");
}

/// The same recording without its checksums, which are then not looked at: what is changed in it is not refused for
/// being changed.
fn without_checksums(whole: &[u8]) -> Vec<u8> {
    use mcap::records::op;
    let mut bytes = whole.to_vec();
    let mut at = 8;
    while at + 9 <= whole.len() - 8 {
        let checksum = match whole[at] {
            op::CHUNK => Some(24),
            op::DATA_END => Some(0),
            op::FOOTER => Some(16),
            _ => None,
        };
        if let Some(inside) = checksum {
            bytes[at + 9 + inside..at + 13 + inside].fill(0);
        }
        at += 9 + usize::try_from(u64::from_le_bytes(whole[at + 1..at + 9].try_into().unwrap())).unwrap();
    }
    bytes
}

/// Makes a change to a recording: bytes, digits of the numbers in its texts, or its end.
fn changed(whole: &[u8], stream: &mut Stream) -> Vec<u8> {
    let mut bytes = whole.to_vec();
    for _ in 0..=stream.below(3) {
        let at = stream.below(bytes.len());
        if stream.chance(0.5) {
            // The next sign of a text or number.
            let found = (at..bytes.len()).find(|&at| bytes[at].is_ascii_digit() || b"{}[]\",:".contains(&bytes[at]));
            let signs = b"0123456789-+.eE{}[]\",:\x1b \xff";
            if let Some(at) = found {
                bytes[at] = signs[stream.below(signs.len())];
            }
        } else {
            let to = (at + 1 + stream.below(9)).min(bytes.len());
            let byte = u8::try_from(stream.below(256)).unwrap();
            bytes[at..to].fill(byte);
        }
    }
    if stream.chance(0.1) {
        bytes.truncate(stream.below(bytes.len()));
    }
    bytes
}

/// Feeds changed recordings, and insists on an answer in time: neither a panic nor memory for a length that a damaged
/// file claims.
fn all_are_fed_or_refused(numbers: std::ops::Range<u64>) {
    let folder = tempfile::tempdir().unwrap();
    let (plan, test) = awkward_plan();
    traced(folder.path(), &plan, &test);
    let whole = fs::read(folder.path().join("T1.mcap")).unwrap();
    let unchecked = without_checksums(&whole);
    assert!(unchecked != whole);
    let file = folder.path().join("changed.mcap");
    let (said, heard) = std::sync::mpsc::channel();
    let feeder = std::thread::spawn(move || {
        for number in numbers {
            let mut stream = Stream::derive(5, "recordings", &[number]);
            let bytes = changed(if stream.chance(0.2) { &whole } else { &unchecked }, &mut stream);
            fs::write(&file, &bytes).unwrap();
            let fed = std::panic::catch_unwind(|| fed(&file, &plan));
            let words = fed.map(|fed| fed.err().map(|error| error.to_string()));
            let unchanged = fs::read(&file).unwrap() == bytes;
            said.send((number, words, unchanged)).unwrap();
        }
    });
    let (mut fed, mut refused) = (0, 0);
    loop {
        use std::sync::mpsc::RecvTimeoutError;
        match heard.recv_timeout(std::time::Duration::from_secs(60)) {
            Ok((number, words, unchanged)) => {
                assert!(unchanged, "recording {number} was changed");
                match words.unwrap_or_else(|_| panic!("recording {number} is too much")) {
                    None => fed += 1,
                    Some(words) => {
                        assert!(!words.chars().any(char::is_control), "recording {number}: {words:?}");
                        refused += 1;
                    }
                }
            }
            Err(RecvTimeoutError::Disconnected) => break,
            Err(RecvTimeoutError::Timeout) => panic!("no answer for a minute"),
        }
    }
    feeder.join().unwrap();
    assert!(fed > 0 && refused > 0, "{fed} are fed and {refused} refused");
}

#[test]
fn a_changed_recording_is_fed_or_refused() {
    all_are_fed_or_refused(0..500);
}

#[test]
#[ignore = "long: 15,000 changes to a recording"]
fn of_15_000_changes_to_a_recording_none_is_too_much() {
    all_are_fed_or_refused(1_000..16_000);
}

#[test]
fn lengths_inside_a_chunk_that_do_not_add_up_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (plan, test) = awkward_plan();
    traced(folder.path(), &plan, &test);
    let whole = fs::read(folder.path().join("T1.mcap")).unwrap();
    // The first chunk: its checksum, the length of its records, and that of the first of these.
    let chunk = {
        let mut at = 8;
        while whole[at] != mcap::records::op::CHUNK {
            at += 9 + usize::try_from(u64::from_le_bytes(whole[at + 1..at + 9].try_into().unwrap())).unwrap();
        }
        at + 9
    };
    let (checksum, length) = (chunk + 24, chunk + 32);
    let first = length + 8;
    for (place, value) in
        [(length, 7u64), (length, u64::MAX), (first + 1, u64::MAX), (first + 1, 1 << 40), (first + 1, 3)]
    {
        let mut bytes = whole.clone();
        bytes[checksum..checksum + 4].fill(0);
        bytes[place..place + 8].copy_from_slice(&value.to_le_bytes());
        let file = folder.path().join("damaged.mcap");
        fs::write(&file, bytes).unwrap();
        let said = fed(&file, &plan).unwrap_err().to_string();
        assert!(said.contains("damaged.mcap"), "{said}");
    }
}
