//! Traces of systems of ROS.

use std::sync::Arc;

use mcap::MessageStream;

use sesame_base::observation::MetricObservation;
use sesame_base::time::SimTime;
use sesame_codec::{cdr, ros1};
use sesame_interfaces::bundle::{self, Notation};
use sesame_plan::testing::{field, message, metric, minimal, test_of, topic};
use sesame_plan::testing::{operation, ros1 as of_ros1, ros2 as of_ros2, use_of};
use sesame_plan::{
    Channel, FieldRef, Interface, MessageId, MetricSource, OperationKind, Recorded, Simulator, TopicId, Type,
};
use sesame_relay::metric::MetricTable;
use sesame_relay::relay::{Listener as _, MessageRef, OperationEvent};
use sesame_relay::value::Value;
use sesame_relay::wire::{Wanted, WireTable};

use super::*;
use crate::{feed, messages, recover};

const STAMPED: &str = "std_msgs/Header header\nfloat64 level\nuint8[] rest\n\
    ================================================================================\n\
    MSG: std_msgs/Header\n";

/// A stamped level as it is in ROS 2 or ROS 1, with times that no double holds.
fn layout(notation: Notation) -> Vec<Interface> {
    let header = match notation {
        Notation::Ros1 => "uint32 seq\ntime stamp\nstring frame_id\n",
        _ => "builtin_interfaces/Time stamp\nstring frame_id\n",
    };
    let (catalogue, name) = bundle::read(notation, "made_up/msg/Level", &format!("{STAMPED}{header}")).unwrap();
    catalogue.layout(&name).unwrap()
}

const STAMP: [u32; 2] = [1_700_000_001, 123_456_789];

fn cdr_bytes(level: f64) -> Arc<[u8]> {
    let mut bytes = vec![0, 1, 0, 0];
    bytes.extend(STAMP.iter().flat_map(|part| part.to_le_bytes()));
    bytes.extend([2, 0, 0, 0, b'a', 0, 0, 0]);
    bytes.extend(level.to_le_bytes());
    bytes.extend([3, 0, 0, 0, 7, 8, 9]);
    bytes.into()
}

fn ros1_bytes(level: f64) -> Arc<[u8]> {
    let mut bytes = vec![5, 0, 0, 0];
    bytes.extend(STAMP.iter().flat_map(|part| part.to_le_bytes()));
    bytes.extend([1, 0, 0, 0, b'a']);
    bytes.extend(level.to_le_bytes());
    bytes.extend([3, 0, 0, 0, 7, 8, 9]);
    bytes.into()
}

/// A campaign with this system, of a level and of a service.
fn plan(mut simulator: Simulator, notation: Notation) -> CampaignPlan {
    let mut plan = minimal();
    plan.campaign.record = Some(Recorded::All);
    let level = || Type::Real { unit: None };
    plan.messages.push(message("Level", vec![field("level", level())]));
    simulator.ros.as_mut().unwrap().interfaces = layout(notation);
    plan.simulator = simulator;
    for (name, path, channel) in
        [("level", "/level", Channel::Topic), ("ask", "/grip", Channel::Request), ("answer", "/grip", Channel::Reply)]
    {
        let mut declared = topic(name, &[path], Type::Message { id: MessageId(0) });
        (declared.interface, declared.channel) = (Some("made_up/msg/Level".to_owned()), channel);
        plan.topics.push(declared);
    }
    plan.operations.push(operation(0, OperationKind::Blackhole));
    let input = FieldRef { topic: TopicId(0), path: vec!["level".to_owned()] };
    plan.metrics.push(metric("last", MetricSource::Last { input }));
    plan
}

/// Writes the trace of a run in which a message came, was changed, and a service was called.
fn traced(folder: &Path, plan: &CampaignPlan, came: &Value, changed: &Value) -> PathBuf {
    let (wires, test) = (WireTable::new(plan), test_of(vec![use_of(0, 0.0, 2.0, vec![], 1)]));
    let subject = Subject { plan, number: 1, test: &test, simulator_seed: 1 };
    let mut writer = TraceWriter::create(&folder.join("unfinished"), subject, &wires).unwrap();
    let [level, ask, answer] = [0, 1, 2].map(|at| wires.iter().nth(at).unwrap());
    let at = SimTime::from_seconds(0.5);
    writer.published(at, level, 0, came);
    writer.operated(at, 0, OperationEvent::Changed(MessageRef { wire: level, index: 0 }));
    writer.delivered(at, level, 0, changed);
    writer.published(at, ask, 0, came);
    writer.published(at, answer, 0, came);
    let mut observation = Observation::crashed("no run".to_owned());
    observation.metrics.push(MetricObservation { value: Some(1.5), series: vec![(0.5, 1.5)], ..Default::default() });
    let file = folder.join("T1.mcap");
    writer.keep(&observation, &file).unwrap();
    file
}

/// Topic, encodings, name of the schema and payload of each message in a file.
fn content(file: &Path) -> Vec<(String, String, String, String, Vec<u8>)> {
    let bytes = fs::read(file).unwrap();
    let all = MessageStream::new(&bytes).unwrap().map(|message| {
        let message = message.unwrap();
        let schema = message.channel.schema.as_ref().unwrap();
        let (topic, encoding) = (message.channel.topic.clone(), message.channel.message_encoding.clone());
        (topic, encoding, schema.encoding.clone(), schema.name.clone(), message.data.to_vec())
    });
    all.collect()
}

fn changed(mut value: Value) -> Value {
    *value.at_mut(&["level"]).unwrap() = Value::Real(2.5);
    value
}

/// Writes and reads a trace of messages that came as these bytes.
fn written_and_read(plan: &CampaignPlan, came: &Value, bytes: [&[u8]; 2], names: [&str; 3], simple: &str) {
    let folder = tempfile::tempdir().unwrap();
    let file = traced(folder.path(), plan, came, &changed(came.clone()));
    let [profile, encoding, schemas] = names;
    assert!(fs::read(&file).unwrap()[9..].windows(profile.len()).any(|window| window == profile.as_bytes()));
    let content = content(&file);
    for (topic, messages, of_schema, ..) in &content {
        assert_eq!((messages.as_str(), of_schema.as_str()), (encoding, schemas), "{topic}");
    }
    let of = |topic: &str| content.iter().find(|message| message.0 == topic).unwrap();
    assert_eq!(of("/level").4, bytes[0], "as it came, with its stamp");
    assert_eq!(of("/level/delivered").4, bytes[1], "nothing but the level is changed");
    assert_eq!((&of("/grip/request").4, &of("/grip/reply").4), (&bytes[0].to_vec(), &bytes[0].to_vec()));
    assert_eq!(of("/sesame/metrics/last").3, simple);
    let operations = String::from_utf8_lossy(&of("/sesame/operations").4).into_owned();
    assert!(operations.contains("{\"operation\":\"o0\"") || operations.contains("\"did\":\"changed\""), "{operations}");

    let mut read = 0;
    messages(&file, &[], &mut |message| {
        message.value.unwrap();
        read += 1;
    })
    .unwrap();
    assert_eq!(read, content.len());
    let wires = WireTable::new(plan);
    let fed = feed(&file, plan, &wires, &MetricTable::new(plan, &wires, &[]).unwrap()).unwrap();
    assert_eq!((fed.messages, fed.metrics[0].value), (3, Some(1.5)));
    let signals = crate::signals(&file, plan, &wires).unwrap();
    assert_eq!(signals["/level.level"].values, [1.5]);
}

#[test]
fn a_trace_of_ros_2_is_as_ros_2_records_it() {
    let plan = plan(of_ros2(0, Vec::new()), Notation::Msg);
    let codec = cdr::Codec::new(&layout(Notation::Msg), "made_up/msg/Level", &Wanted::All).unwrap();
    let came = codec.read(cdr_bytes(1.5)).unwrap();
    let bytes = [&*cdr_bytes(1.5), &*cdr_bytes(2.5)];
    written_and_read(&plan, &came, bytes, ["ros2", "cdr", "ros2msg"], "std_msgs/msg/Float64");
}

#[test]
fn a_trace_of_ros_1_is_as_ros_1_serialises() {
    let plan = plan(of_ros1("http://localhost:11311", Vec::new()), Notation::Ros1);
    let codec = ros1::Codec::new(&layout(Notation::Ros1), "made_up/msg/Level", &Wanted::All).unwrap();
    let came = codec.read(ros1_bytes(1.5)).unwrap();
    let bytes = [&*ros1_bytes(1.5), &*ros1_bytes(2.5)];
    written_and_read(&plan, &came, bytes, ["ros1", "ros1", "ros1msg"], "std_msgs/Float64");
}

#[test]
fn what_is_saved_of_a_trace_of_ros_is_of_ros() {
    let plan = plan(of_ros2(0, Vec::new()), Notation::Msg);
    let codec = cdr::Codec::new(&layout(Notation::Msg), "made_up/msg/Level", &Wanted::All).unwrap();
    let came = codec.read(cdr_bytes(1.5)).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let whole = traced(folder.path(), &plan, &came, &came);
    let bytes = fs::read(&whole).unwrap();
    let unfinished = folder.path().join("trace.unfinished");
    fs::write(&unfinished, &bytes[..bytes.len() - 8]).unwrap();
    let saved = folder.path().join("T2.mcap");
    recover(&unfinished, &Outcome::Timeout { limit: 2.0 }, &saved).unwrap();
    assert_eq!(content(&saved), content(&whole));
    let header = fs::read(&saved).unwrap();
    assert_eq!(&header[8 + 9 + 4..][..4], b"ros2");
}

#[test]
fn what_a_hook_makes_of_a_message_that_is_none_fails_the_trace() {
    let plan = plan(of_ros2(0, Vec::new()), Notation::Msg);
    let folder = tempfile::tempdir().unwrap();
    let (wires, test) = (WireTable::new(&plan), test_of(Vec::new()));
    let subject = Subject { plan: &plan, number: 1, test: &test, simulator_seed: 1 };
    let mut writer = TraceWriter::create(&folder.path().join("unfinished"), subject, &wires).unwrap();
    writer.published(SimTime::ZERO, wires.iter().next().unwrap(), 0, &Value::Real(1.0));
    let failed = writer.keep(&Observation::crashed(String::new()), &folder.path().join("T1.mcap")).unwrap_err();
    assert!(failed.to_string().contains("a message of /level cannot be written"), "{failed}");
}
