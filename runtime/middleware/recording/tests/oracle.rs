//! Recordings that others wrote, beside another reader of them.
//!
//! `SESAME_ROS2_CYCLONE` names a Python with rosbags, `SESAME_BAGS` a folder with recordings.

#![expect(clippy::unwrap_used, reason = "a test ends where something is missing")]
#![expect(clippy::disallowed_methods, reason = "it looks for recordings")]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde_json::Value as Json;
use sesame_base::observation::{MetricObservation, Observation};
use sesame_base::time::SimTime;
use sesame_codec::cdr::Codec;
use sesame_interfaces::{Catalogue, msg};
use sesame_peers::named;
use sesame_peers::oracle::{bytes, each_line, is};
use sesame_plan::testing::{message, metric, minimal, ros2, test_of, topic};
use sesame_plan::{MessageId, MetricSource, Recorded, Type};
use sesame_recording::{Subject, TraceWriter, messages};
use sesame_relay::relay::Listener as _;
use sesame_relay::value::Value;
use sesame_relay::wire::{Wanted, WireTable};

const ORACLE: &str = "ros2/recordings_oracle.py";
const MESSAGES: &str = "ros2/cdr_oracle.py";

/// A line of it.
#[derive(Deserialize)]
struct Line {
    recording: PathBuf,
    topic: String,
    time: u64,
    fields: Option<Json>,
}

/// The messages of each topic, in order of time.
type Topics<T> = BTreeMap<String, Vec<(u64, T)>>;

fn in_order<T>(mut topics: Topics<T>) -> Topics<T> {
    for messages in topics.values_mut() {
        messages.sort_by_key(|(time, _)| *time);
    }
    topics
}

fn ours(path: &Path) -> Topics<Result<Value, String>> {
    let mut topics: Topics<_> = BTreeMap::new();
    messages(path, &[], &mut |message| {
        topics.entry(message.topic.to_owned()).or_default().push((message.time, message.value));
    })
    .unwrap_or_else(|error| panic!("{error}"));
    in_order(topics)
}

/// Reads what the oracle reads, and returns how many messages were compared.
fn compare(python: &Path, arguments: &[&str]) -> usize {
    let mut recordings: BTreeMap<PathBuf, Topics<Json>> = BTreeMap::new();
    each_line(python, ORACLE, arguments, |line: &Line| {
        let topics = recordings.entry(line.recording.clone()).or_default();
        let fields = line.fields.clone().unwrap_or_default();
        topics.entry(line.topic.clone()).or_default().push((line.time, fields));
    });
    let mut compared = 0;
    for (path, theirs) in recordings {
        let (theirs, ours) = (in_order(theirs), ours(&path));
        assert!(theirs.keys().eq(ours.keys()), "{}: {:?} and {:?}", path.display(), theirs.keys(), ours.keys());
        for ((topic, theirs), ours) in theirs.iter().zip(ours.values()) {
            let place = format!("{} {topic}", path.display());
            assert_eq!(theirs.len(), ours.len(), "{place}");
            for ((their_time, fields), (our_time, value)) in theirs.iter().zip(ours) {
                assert_eq!(their_time, our_time, "{place}");
                if fields.is_null() {
                    continue;
                }
                let value = match value {
                    Ok(value) => value,
                    // Numbers that Sesame does not have.
                    Err(error) if error.ends_with("too large for a whole number of 64 bits with a sign") => continue,
                    Err(error) => panic!("{place}: {error}"),
                };
                assert!(is(value, fields), "{place}: {value:?}, not {fields}");
                compared += 1;
            }
        }
    }
    compared
}

#[test]
fn recordings_of_all_kinds_are_read_as_rosbags_reads_them() {
    let Some(python) = named("SESAME_ROS2_CYCLONE") else { return };
    let folder = tempfile::tempdir().unwrap();
    let compared = compare(&python, &["write", folder.path().to_str().unwrap(), "30", "7"]);
    assert_eq!(compared, 6 * (30 + 10) + 3 * 10);
}

/// A random message as rosbags writes it.
#[derive(Deserialize)]
struct Sample {
    files: BTreeMap<String, String>,
    #[serde(rename = "type")]
    interface: String,
    cdr: String,
    fields: Json,
}

#[test]
fn rosbags_reads_in_the_trace_of_a_system_of_ros_2_what_its_nodes_published() {
    let Some(python) = named("SESAME_ROS2_CYCLONE") else { return };
    let mut plan = minimal();
    plan.simulator = ros2(0, Vec::new());
    plan.campaign.record = Some(Recorded::All);
    plan.messages.push(message("Any", Vec::new()));
    plan.metrics.push(metric("fuzzed", MetricSource::FuzzingTime));
    let ros = plan.simulator.ros.as_mut().unwrap();
    let mut published: Vec<(Value, Json)> = Vec::new();
    each_line(&python, MESSAGES, &["rosbags", "60", "11"], |sample: &Sample| {
        // Types of one name differ from sample to sample, so each has a package of its own.
        let package = format!("p{}", published.len());
        let own = |text: &str| text.replace("oracle/", &format!("{package}/"));
        let mut catalogue = Catalogue::default();
        sample.files.iter().for_each(|(name, text)| catalogue.add(msg(&package, name, &own(text)).unwrap()));
        let interface = own(&sample.interface);
        let layout = catalogue.layout(&interface).unwrap();
        let codec = Codec::new(&layout, &interface, &Wanted::All).unwrap();
        published.push((codec.read(bytes(&sample.cdr)).unwrap(), sample.fields.clone()));
        ros.interfaces.extend(layout);
        let mut declared = topic(&package, &[&format!("/{package}")], Type::Message { id: MessageId(0) });
        declared.interface = Some(interface);
        plan.topics.push(declared);
    });

    let folder = tempfile::tempdir().unwrap();
    let (unfinished, file) = (folder.path().join("unfinished"), folder.path().join("T1.mcap"));
    let (wires, test) = (WireTable::new(&plan), test_of(Vec::new()));
    let subject = Subject { plan: &plan, number: 1, test: &test, simulator_seed: 1 };
    let mut writer = TraceWriter::create(&unfinished, subject, &wires).unwrap();
    let time = |index: u64| SimTime::from_nanos(i64::try_from(index).unwrap() * 1_000_000_007);
    for index in 0..3 {
        for (wire, (value, _)) in wires.iter().zip(&published) {
            writer.published(time(index), wire, index, value);
        }
    }
    let mut observation = Observation::crashed("no run".to_owned());
    observation.metrics.push(MetricObservation { series: vec![(0.5, 0.1)], ..MetricObservation::default() });
    writer.keep(&observation, &file).unwrap();

    // Ours and theirs, and both as it was published.
    let compared = compare(&python, &["read", file.to_str().unwrap()]);
    assert_eq!(compared, 3 * published.len() + 1);
    let mut topics = ours(&file);
    let of_metric = topics.remove("/sesame/metrics/fuzzed").unwrap();
    let (at, Ok(value)) = &of_metric[0] else { panic!("{of_metric:?}") };
    assert_eq!((*at, value.number_at(&["data"])), (500_000_000, Some(0.1)));
    assert_eq!(topics.len(), published.len());
    for ((value, fields), wire) in published.iter().zip(wires.iter()) {
        assert!(is(value, fields));
        for (index, (at, read)) in (0..).zip(&topics[wires.path(wire)]) {
            assert_eq!(i64::try_from(*at).unwrap(), time(index).nanos());
            assert!(read.as_ref().unwrap().is_same(value), "{}: bit for bit", wires.path(wire));
        }
    }
}

/// All recordings below a folder: files, and folders with `metadata.yaml`.
fn below(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
        if path.is_dir() {
            if path.join("metadata.yaml").is_file() {
                found.push(path.clone());
            }
            below(&path, found);
        } else if ["mcap", "db3", "bag", "zstd"].contains(&ending) {
            found.push(path);
        }
    }
}

#[test]
fn recordings_of_other_projects_are_read_completely() {
    let Some(folder) = std::env::var_os("SESAME_BAGS") else {
        eprintln!("skipped: SESAME_BAGS names no folder with recordings");
        return;
    };
    let mut found = Vec::new();
    below(Path::new(&folder), &mut found);
    found.sort();
    assert!(!found.is_empty(), "there are no recordings below {}", Path::new(&folder).display());
    let (mut read, mut unknown) = (0, BTreeMap::new());
    for path in &found {
        let mut told = 0;
        let whole = messages(path, &[], &mut |message| {
            told += 1;
            if let Err(reason) = message.value {
                *unknown.entry(format!("{} {}: {reason}", path.display(), message.topic)).or_insert(0) += 1;
            }
        });
        whole.unwrap_or_else(|error| panic!("{error}"));
        read += told;
    }
    println!("{read} messages of {} recordings; not decoded: {unknown:#?}", found.len());
    let Some(python) = named("SESAME_ROS2_CYCLONE") else { return };
    let folders: Vec<&str> = found.iter().filter(|path| path.is_dir()).map(|path| path.to_str().unwrap()).collect();
    let arguments: Vec<&str> = std::iter::once("read").chain(folders).collect();
    let compared = compare(&python, &arguments);
    println!("{compared} of them compared with rosbags");
}
